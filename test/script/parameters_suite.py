#!/usr/bin/env python3
"""What demo_parameters.launch promises: a drag changes the parameters that a launch file has set, and they are saved
into the file that they came from, whose comments and layout stay."""

import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from rosgraph_msgs.msg import Log
from rosslt.msg import PoseStampedTracked
from std_srvs.srv import Trigger

import rosslt
from support.hand import Hand, wait_until

ORIGINAL = Path(rospy.myargv()[1]).read_text()
NODE = '/parameter_waypoints'
END = '/trajectory_markers:end:0'


class Parameters(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.waypoints = []
        rosslt.Subscriber('waypoint', PoseStampedTracked, cls.waypoints.append)
        cls.hand = Hand()
        wait_until(lambda: cls.waypoints and END in cls.hand.names(), 'the first waypoint and its handle')

    def save_in(self, path):
        rospy.set_param(NODE + '/file', str(path))
        return rospy.ServiceProxy(NODE + '/save', Trigger)()

    def test_a_drag_changes_the_parameters_and_saving_writes_those_numbers_and_nothing_else(self):
        x, y, z = self.hand.position(END)
        self.assertEqual((x, y, z), (2.0, 1.0, 1.5))
        self.hand.drag(END, dx=0.5, dy=-1.25, dz=0.25)
        wait_until(lambda: rospy.get_param(NODE + '/waypoints')[0] == [2.5, -0.25, 1.75], 'the parameter to follow')
        wait_until(
            lambda: tuple(rosslt.untracked(list(place(self.waypoints[-1])))) == (2.5, -0.25, 1.75),
            'the waypoint to follow',
        )
        self.assertEqual(self.waypoints[-1].header.stamp, self.waypoints[0].header.stamp, 'it is the same waypoint')
        with tempfile.TemporaryDirectory() as directory:
            copy = Path(directory, 'tour.yaml')
            copy.write_text(ORIGINAL)
            answer = self.save_in(copy)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(copy.read_text(), ORIGINAL.replace('[2.0, 1.0,  1.50]', '[2.5, -0.25,  1.75]'))
            self.assertIn('already', self.save_in(copy).message)

    def test_saving_into_a_file_of_another_shape_is_refused(self):
        with tempfile.TemporaryDirectory() as directory:
            copy = Path(directory, 'tour.yaml')
            copy.write_text('pause: 1.0\nwaypoints: [[1, 2, 3]]\n')
            answer = self.save_in(copy)
            self.assertFalse(answer.success)
            self.assertIn('the file has no waypoints/1/0 any more', answer.message)
            copy.write_text(ORIGINAL + '  - [9, 9, 9]\n')
            self.assertIn('it has more in waypoints than the 3 waypoints', self.save_in(copy).message)
            self.assertFalse(self.save_in(Path(directory, 'none.yaml')).success)

    def test_what_is_no_waypoint_is_named_and_the_ones_before_stay(self):
        errors = []
        rospy.Subscriber('/rosout', Log, lambda log: errors.append(log.msg) if log.name == NODE else None)
        before = {name: rospy.get_param(NODE + name) for name in ('/waypoints', '/pause')}
        for name, said, wanted in (
            ('/waypoints', [['north', 1.0, 2.0]], 'a list of [x, y, z]'),
            ('/pause', 'long', 'a number of seconds'),
        ):
            rospy.set_param(NODE + name, said)
            expected = '{}{} is {} instead of {}'.format(NODE, name, said, wanted)
            wait_until(lambda expected=expected: expected in errors, expected)
            rospy.set_param(NODE + name, before[name])
        moved = [[*before['/waypoints'][0][:2], 7.5], *before['/waypoints'][1:]]
        rospy.set_param(NODE + '/waypoints', moved)
        wait_until(
            lambda: any(rosslt.untracked(one.pose.position.z) == 7.5 for one in self.waypoints), 'a waypoint to follow'
        )
        rospy.set_param(NODE + '/waypoints', before['/waypoints'])


def place(waypoint):
    position = waypoint.pose.position
    return position.x, position.y, position.z


if __name__ == '__main__':
    rosslt.init_node('parameters')
    rostest.rosrun('rosslt', 'parameters', Parameters, sys.argv)
