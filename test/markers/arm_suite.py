#!/usr/bin/env python3
"""What arm.launch promises: dragged by its tip in a real RViz, the arm turns its joints."""

import math
import sys

import rospy
import rostest

import rosslt
from support.hand import wait_until
from support.mouse import MouseCase

UPPER_ARM, FOREARM = 1.2, 0.9
TIP, NOTE = '/arm:arm:3', '/arm:arm:3:note'


class Arm(MouseCase):
    config = rospy.myargv()[1]
    topic, node = '/arm', '/arm'
    spots = (-3.0, 2.0), (3.0, -2.0)

    def tip(self):
        """Where the joints' parameters have the tip."""
        shoulder, elbow = self.parameter('shoulder'), self.parameter('elbow')
        return (
            UPPER_ARM * math.cos(shoulder) + FOREARM * math.cos(shoulder + elbow),
            UPPER_ARM * math.sin(shoulder) + FOREARM * math.sin(shoulder + elbow),
        )

    def drag_tip(self, x, y, is_released=True):
        """Drag the tip, and give where the mouse has it then."""
        start = self.tip()
        right, down = self.drag(start, (x, y), TIP, 20, is_released=is_released)
        return start[0] + right / self.screen.scale, start[1] - down / self.screen.scale

    def assert_tip_comes_to(self, x, y):
        wait_until(
            lambda: math.dist(self.tip(), (x, y)) < 1.5 / self.screen.scale,
            lambda: 'the tip to come to {}; it is at {}'.format((x, y), self.tip()),
        )

    def test_dragging_the_tip_turns_both_joints(self):
        shoulder, elbow = self.parameter('shoulder'), self.parameter('elbow')
        self.assert_tip_comes_to(*self.drag_tip(-0.5, 1.1))
        self.assertGreater(abs(self.parameter('shoulder') - shoulder), 0.1)
        self.assertGreater(abs(self.parameter('elbow') - elbow), 0.1)

    def test_the_drag_stops_at_the_reach_and_comes_back_from_there(self):
        x, y = self.drag_tip(-2.4, 1.2, is_released=False)
        reach, direction = UPPER_ARM + FOREARM, math.atan2(y, x)
        self.assert_tip_comes_to(reach * math.cos(direction), reach * math.sin(direction))
        wait_until(lambda: NOTE in self.inserts, 'a note that it goes no further')
        mouse, empty = self.screen.pixel(x, y), self.screen.color(self.screen.pixel(x, -y))
        self.screen.screenshot('arm_at_its_reach')
        self.screen.release()
        wait_until(lambda: self.screen.color(mouse) == empty, 'the ghost to leave the mouse')
        self.assert_tip_comes_to(*self.drag_tip(-1.0, 1.0))


if __name__ == '__main__':
    rosslt.init_node('check_arm')
    rostest.rosrun('rosslt', 'arm', Arm, sys.argv)
