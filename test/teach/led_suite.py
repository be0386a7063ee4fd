#!/usr/bin/env python3
"""What devices.launch promises: a joystick, played from a bag, adds two waypoints to the tour of the quadcopter."""

import ast
import difflib
import sys
import unittest
from pathlib import Path

import rosbag
import rospkg
import rospy
import rostest
from rosslt.msg import PoseStampedTracked
from visualization_msgs.msg import Marker

import rosslt
from support.hand import wait_until
from support.shell import rosslt as shell

SCRIPT = Path(rospy.myargv()[1])
CONFIG = Path(rospkg.RosPack().get_path('rosslt'), 'config')
TOUR, BAG = CONFIG / 'led.script', CONFIG / 'joystick.bag'
SPEED, DEAD_ZONE = 0.5, 0.1  # m/s of a stick at its stop, and of 1
ARRIVED = 0.02  # m, as the tour takes it
PRECISION = 0.0015  # m: a hand tells a thousandth apart, and numbers are rounded to it
STARTING, FLYING = 90.0, 60.0  # s: the bag takes 20 of them; the tour 25


class Led(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.waypoints, cls.flown = [], []
        rosslt.Subscriber('waypoint', PoseStampedTracked, lambda sent: cls.waypoints.append(place(sent.pose)))
        rospy.Subscriber('quadcopter', Marker, lambda shown: cls.flown.append(place(shown.pose)))

    def test_two_waypoints_are_added_flown_over_and_undone_one_by_one(self):
        before = TOUR.read_text().splitlines()
        wait_until(SCRIPT.exists, 'the copy of the tour', STARTING)
        wait_until(lambda: len(changed(before)) >= 2, lambda: f'two rows; there are {changed(before)}', STARTING)
        added = changed(before)
        self.assertEqual([line[:1] for line in added], ['+', '+'], 'nothing else has changed')
        after = SCRIPT.read_text().splitlines()
        first = after.index(added[0][2:])
        self.assertEqual(after[first + 1], added[1][2:], 'the second press is behind the first one')

        above, *rows = (ast.literal_eval(line.strip())[0] for line in after[first - 1 : first + 2])
        for row, way in zip(rows, led_by()):
            self.assertLess(distance(row, [a + by for a, by in zip(above, way)]), PRECISION, (row, above, way))

        del self.waypoints[:], self.flown[:]
        wait_until(lambda: rows in self.in_a_row(2), lambda: f'{rows} in a row; there were {self.waypoints}', FLYING)
        for row in rows:
            wait_until(
                lambda at=row: any(distance(at, there) <= ARRIVED for there in list(self.flown)),
                f'the quadcopter at {row}',
                FLYING,
            )

        for left in (added[:1], []):
            undone = shell('undo', '/interactive_script')
            self.assertEqual(undone.returncode, 0, undone.stderr)
            self.assertEqual(changed(before), left)
        self.assertEqual(SCRIPT.read_bytes(), TOUR.read_bytes())

    def in_a_row(self, count):
        """So many waypoints one after the other, each time."""
        seen = list(self.waypoints)
        return [seen[first : first + count] for first in range(len(seen))]


def changed(before):
    """The lines of the script that are not as they were, as `difflib` marks them."""
    after = SCRIPT.read_text().splitlines()
    return [line for line in difflib.ndiff(before, after) if line[:1] in '+-']


def led_by():
    """How far the recorded hand has led by each press: speed times time, from taking hold."""
    ways, way, last, was_pressed = [], (0.0, 0.0, 0.0), None, 0
    with rosbag.Bag(str(BAG)) as bag:
        for _, message, _ in bag.read_messages():
            now = message.header.stamp.to_sec() if message.buttons[0] else None
            if now is not None and last is not None:
                way = tuple(a + SPEED * counted(axis) * (now - last) for a, axis in zip(way, message.axes))
            if message.buttons[2] and not was_pressed:
                ways.append(way)
            last, was_pressed = now, message.buttons[2]
    return ways


def counted(deflection):
    beyond = max(abs(deflection) - DEAD_ZONE, 0.0) / (1.0 - DEAD_ZONE)
    return beyond if deflection > 0.0 else -beyond


def place(pose):
    return tuple(float(part) for part in (pose.position.x, pose.position.y, pose.position.z))


def distance(first, second):
    return sum((a - b) ** 2 for a, b in zip(first, second)) ** 0.5


if __name__ == '__main__':
    rosslt.init_node('led')
    rostest.rosrun('rosslt', 'led', Led, sys.argv)
