#!/usr/bin/env python3
"""What visualization_talker_listener.launch promises: a drag in one process changes a number in another."""

import unittest

import rospy
import rostest
from rosslt.msg import MarkerTracked

import rosslt
from support.hand import Hand, wait_until

LOCATION = '/visualization_talker/rosslt/'


def are_near(first, second):
    return all(abs(a - b) < 1e-5 for a, b in zip(first, second))


class LinkedMarkers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.hand = Hand()
        cls.seen = {}
        rosslt.Subscriber('markers', MarkerTracked, lambda marker: cls.seen.update({marker.id: marker}))
        wait_until(lambda: len(cls.seen) == 2, 'two markers')

    def position(self, number):
        position = self.seen[number].pose.position
        return tuple(map(float, (position.x, position.y, position.z)))

    def assert_both_come_to(self, x, y, z):
        for number, expected in ((0, (x, y, z)), (1, (x + 2, y, z))):
            handle = '/markers:linked:{}'.format(number)
            wait_until(
                lambda number=number, expected=expected: are_near(self.position(number), expected),
                'marker {} to be at {}'.format(number, expected),
            )
            wait_until(
                lambda handle=handle, at=expected: are_near(self.hand.position(handle), at),
                'the handle {} to be at {}'.format(handle, expected),
            )

    def test_each_tracked_coordinate_has_its_control(self):
        for name in ('/markers:linked:0', '/markers:linked:1'):
            self.assertEqual(set(self.hand.controls(name)), {'move_x', 'move_y', 'move_z', 'body'})

    def test_a_drag_changes_the_parameter_and_both_markers(self):
        x, y, z = self.position(0)
        self.hand.drag('/markers:linked:1', dx=1.25)
        self.assert_both_come_to(x + 1.25, y, z)
        self.assertAlmostEqual(rospy.get_param(LOCATION + 'x'), x + 1.25, places=5)
        self.assertAlmostEqual(rospy.get_param(LOCATION + 'y'), y)

    def test_a_whole_position_is_changed_together(self):
        x, y, z = self.position(0)
        self.hand.drag('/markers:linked:0', dx=-0.5, dy=0.75, dz=0.25)
        self.assert_both_come_to(x - 0.5, y + 0.75, z + 0.25)
        for name, value in zip('xyz', (x - 0.5, y + 0.75, z + 0.25)):
            self.assertAlmostEqual(rospy.get_param(LOCATION + name), value, places=5)


if __name__ == '__main__':
    rosslt.init_node('check_visualization_talker_listener')
    rostest.rosrun('rosslt', 'visualization_talker_listener', LinkedMarkers)
