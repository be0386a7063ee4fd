#!/usr/bin/env python3
"""What a mouse in a real RViz does to the joint of a robot, to the goal of an action, and where an answer leaps."""

import math
import sys

import rospy
import rostest

import rosslt
from support.hand import wait_until
from support.mouse import EMPTY, MouseCase

JOINT, GOAL, FOLDED = '/joint_states:shoulder', '/move_base/goal:target_pose', '/stage:folded:0'
CENTRE = (-3.0, 2.0)  # of the joint
RADIUS = 0.93  # m: how far out the ring is around a ball of half of 0.8 m
BESIDE = 0.2  # m along x and y from the middle: on the ball, and on no arrow
NOTE_COLOR = (255, 217, 77)


class Robot(MouseCase):
    config = rospy.myargv()[1]
    topic, node = '/stage', '/robot_stage'
    spots = (-5.5, 4.0), (5.5, -4.0)

    def turn_ring(self, angle, steps):
        """Turn the ring of the joint by an angle; the pixels where the mouse was pressed and let go."""

        def on_ring(direction):
            return CENTRE[0] + RADIUS * math.cos(direction), CENTRE[1] + RADIUS * math.sin(direction)

        first = self.press(on_ring(2.4), JOINT)
        path = [self.screen.pixel(*on_ring(2.4 + angle * step / steps)) for step in range(1, steps + 1)]
        self.screen.move(path)
        self.screen.release()
        return first, path[-1]

    def test_the_ring_of_a_joint_turns_what_its_position_comes_from(self):
        before, centre = self.parameter('shoulder'), self.screen.pixel(*CENTRE)

        def direction(pixel):
            return math.atan2(centre[1] - pixel[1], pixel[0] - centre[0])

        first, last = self.turn_ring(math.radians(-50), 20)
        turned = math.remainder(direction(last) - direction(first), 2 * math.pi)
        self.assert_comes_to('shoulder', before + turned, tolerance=1.5 / (RADIUS * self.screen.scale))

    def test_the_ring_of_a_joint_stops_at_its_limit(self):
        self.turn_ring(math.radians(350), 140)
        self.assert_comes_to('shoulder', 3.0, 1e-12)

    def test_the_goal_of_an_action_is_dragged_and_keeps_its_bound(self):
        x, y = self.parameter('goal_x'), self.parameter('goal_y')
        right, down = self.drag((x + BESIDE, y + BESIDE), (x + BESIDE + 0.75, y + BESIDE - 0.5), GOAL)
        self.assert_comes_to('goal_x', x + right / self.screen.scale)
        self.assert_comes_to('goal_y', y - down / self.screen.scale)
        x, y = self.parameter('goal_x'), self.parameter('goal_y')
        self.drag((x + BESIDE, y + BESIDE), (5.0, y + BESIDE), GOAL)
        self.assert_comes_to('goal_x', 4.0, 1e-12)

    def test_an_answer_that_leaps_is_shown_and_waits_for_the_hand_to_let_go(self):
        """x = fold^3 / 3 - fold turns round at fold = -1, where x is 2/3; beyond, only a fold above 2 gives x.

        A drag that comes there follows as far as it can without a leap; one that begins there is told of it.
        """
        self.drag((0.0, -2.0), (0.75, -2.0), FOLDED, steps=30)
        self.assert_comes_to('fold', -1.0, 0.05)
        self.screen.move([EMPTY])
        self.drag((2 / 3, -2.0), (0.72, -2.0), FOLDED, is_released=False)
        wait_until(lambda: FOLDED + ':note' in self.inserts, 'the note')
        wait_until(lambda: self.screen.count(NOTE_COLOR, *self.note_box()) > 20, 'the note to be seen')
        self.screen.screenshot('leap')
        self.assertTrue(-1.01 <= self.parameter('fold') <= 0.0, self.parameter('fold'))
        self.screen.release()
        self.screen.move([EMPTY])
        wait_until(lambda: self.parameter('fold') > 2.0, lambda: f'the leap to be made: {self.parameter("fold")}')

    def note_box(self):
        """The pixels around where the marker is dragged to: left, top, right, bottom."""
        (left, top), (right, bottom) = self.screen.pixel(-1.5, -0.5), self.screen.pixel(4.0, -3.0)
        return left, top, right, bottom


if __name__ == '__main__':
    rosslt.init_node('check_robot')
    rostest.rosrun('rosslt', 'robot', Robot, sys.argv)
