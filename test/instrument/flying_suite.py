#!/usr/bin/env python3
"""What a mouse in a real RViz does to the frame of kite.py, a node as people write them, under `rosslt run`."""

import sys

import rospy
import rostest
from tf2_msgs.msg import TFMessage

import rosslt
from support.hand import wait_until
from support.mouse import EMPTY, MouseCase
from support.shell import lines

KITE = '/tf:kite'
SWING = 0.25  # m: how far to the east and west it circles
ROUNDING = 1e-12
BESIDE = 0.1  # m along x and y from the middle, on the ball
ARROW = 1.7  # m from the middle, on the arrow along an axis


class Flying(MouseCase):
    config = rospy.myargv()[1]
    topic, node = '/stage', '/kite'
    spots = (-5.5, 4.0), (5.5, -4.0)

    @classmethod
    def setUpClass(cls):
        cls.place = None
        rospy.Subscriber('/tf', TFMessage, cls.see_frames)
        super().setUpClass()
        wait_until(lambda: cls.place, 'the frame of the kite')

    @classmethod
    def see_frames(cls, message):
        for transform in message.transforms:
            if transform.child_frame_id == 'kite':
                cls.place = transform.transform.translation

    def parameter(self, name):
        return self.literals()[name]

    @staticmethod
    def literals():
        """{name: value} of the numbers of the node."""
        return {
            name.rpartition('/')[2]: float(value) for name, kind, value, *_ in lines('list', '/kite') if kind == 'float'
        }

    def beside(self):
        return self.place.x + BESIDE, self.place.y + BESIDE

    def test_a_frame_that_moves_is_dragged_by_its_literals(self):
        before = self.literals()
        right, down = self.drag(self.beside, lambda start: (start[0] + 3.0, start[1] - 2.0), KITE, steps=24)
        self.screen.move([EMPTY])
        east, north = before['east'] + right / self.screen.scale, before['north'] - down / self.screen.scale
        self.assert_comes_to('north', north)
        # It circles on while the mouse has it.
        self.assert_comes_to('east', east, 2 * SWING + 1.0 / self.screen.scale)
        after = self.literals()
        self.assertEqual(
            {name for name, value in after.items() if value != before[name]},
            {'east', 'north'},
            'how it circles has stayed as it was',
        )
        self.assert_frame_follows()

    def test_an_arrow_of_a_frame_moves_the_literal_of_that_axis(self):
        before = self.literals()
        _, down = self.drag(
            lambda: (self.place.x, self.place.y + ARROW), lambda start: (start[0] + 0.5, start[1] - 0.75), KITE
        )
        self.assert_comes_to('north', before['north'] - down / self.screen.scale)
        after = self.literals()
        # The others keep it where it was taken along x, as it circles on.
        self.assertLessEqual({name for name, value in after.items() if value != before[name]}, {'east', 'north'})
        self.assert_frame_follows()

    def assert_frame_follows(self):
        """The node broadcasts its frame where its literals have it."""

        def is_there():
            literals = self.literals()
            return self.place.y == literals['north'] and abs(self.place.x - literals['east']) <= SWING + ROUNDING

        wait_until(is_there, lambda: 'the frame to be at {}; it is at {}'.format(self.literals(), self.place))


if __name__ == '__main__':
    rosslt.init_node('check_flying')
    rostest.rosrun('rosslt', 'flying', Flying, sys.argv)
