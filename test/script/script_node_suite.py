#!/usr/bin/env python3
"""What the node interactive_script does: waypoints, locations, changes, errors and restarts, over ROS."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Point, TransformStamped
from rosgraph_msgs.msg import Log
from rosslt.msg import PoseStampedTracked
from rosslt.srv import ListLocations

import rosslt
from support.processes import wait_until

NODE = '/interactive_script'
TOUR = '# tour\ngoto(2.0, 1.0, 1.5)\nwait(0.1)\ngoto(-1, 2, 0.5)\n'


class ScriptNode(unittest.TestCase):
    """One node plays all scripts, but for the tests that stop it."""

    node = None

    @classmethod
    def setUpClass(cls):
        cls.log, cls.waypoints = [], []
        rospy.Subscriber('/rosout', Log, cls.log.append)
        rosslt.Subscriber('waypoint', PoseStampedTracked, cls.waypoints.append)
        cls.tf = tf2_ros.TransformBroadcaster()
        directory = tempfile.TemporaryDirectory(prefix='rosslt_script_')
        cls.addClassCleanup(directory.cleanup)
        cls.addClassCleanup(cls.stop)
        cls.script = Path(directory.name, 'tour.script')

    def setUp(self):
        if self.node is not None:
            self.script.write_text('goto(0, 0, 0)\n')
            self.wait_for_position(0.0, 0.0, 0.0)
        self.script.write_text(TOUR)
        if self.node is None:
            self.start()
        self.wait_for_position(2.0, 1.0, 1.5)

    @classmethod
    def start(cls):
        """Start the node, and wait for its first waypoint."""
        del cls.waypoints[:]
        command = ['rosrun', 'rosslt', 'interactive_script', '_file:={}'.format(cls.script)]
        cls.node = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_until(lambda: cls.waypoints, 'a waypoint', 60.0)

    @classmethod
    def stop(cls):
        if cls.node is not None:
            cls.node.terminate()
            cls.node.wait(60)
            cls.node = None

    def locations(self):
        rospy.wait_for_service(NODE + '/rosslt/list_locations', 5)
        return rospy.ServiceProxy(NODE + '/rosslt/list_locations', ListLocations)().locations

    @property
    def position(self):
        return self.waypoints[-1].pose.position

    def wait_for_position(self, x, y, z):
        wait_until(
            lambda: self.waypoints and rosslt.untracked(self.position) == Point(x, y, z),
            'the waypoint ({}, {}, {})'.format(x, y, z),
        )

    def robot_at(self, x, y, z):
        transform = TransformStamped(child_frame_id='quadcopter')
        transform.header.frame_id, transform.header.stamp = 'world', rospy.Time.now()
        transform.transform.translation = Point(x, y, z)
        transform.transform.rotation.w = 1.0
        self.tf.sendTransform(transform)

    def test_the_waypoint_in_force_is_published_with_its_numbers_as_sources(self):
        self.wait_for_position(2.0, 1.0, 1.5)
        waypoint = self.waypoints[-1]
        self.assertEqual(waypoint.header.frame_id, 'world')
        self.assertEqual(waypoint.pose.orientation.w, 1.0)
        self.assertEqual([source.node for source in rosslt.sources(waypoint)], [NODE] * 3)

    def test_locations_tell_the_file_the_line_and_the_column_of_each_number(self):
        self.assertEqual(
            [(location.file, location.line, location.column, location.value) for location in self.locations()],
            [
                (str(self.script), *place)
                for place in (
                    (2, 6, '2.0'),
                    (2, 11, '1.0'),
                    (2, 16, '1.5'),
                    (3, 6, '0.1'),
                    (4, 6, '-1.0'),
                    (4, 10, '2.0'),
                    (4, 13, '0.5'),
                )
            ],
        )

    def test_forcing_a_waypoint_rewrites_the_script_and_moves_that_waypoint(self):
        stamp = self.waypoints[-1].header.stamp
        rosslt.force_value(self.position, Point(2.0, -0.75, 3.14159))
        self.assertEqual(self.script.read_text(), TOUR.replace('1.0', '-0.75').replace('1.5', '3.142'))
        self.wait_for_position(2.0, -0.75, 3.142)
        self.assertEqual(self.waypoints[-1].header.stamp, stamp, 'it is the same waypoint')

    def test_undo_takes_the_change_back(self):
        rosslt.force_value(self.position.x, 5.0)
        call = ['rosservice', 'call', NODE + '/rosslt/change_sources', '{undo: true}']
        subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
        self.assertEqual(self.script.read_text(), TOUR)

    def test_the_next_step_comes_when_the_robot_has_arrived(self):
        self.wait_for_position(2.0, 1.0, 1.5)
        wait_until(
            lambda: self.robot_at(2.0, 1.0, 1.5) or rosslt.untracked(self.position) == Point(-1.0, 2.0, 0.5),
            'the next waypoint',
        )
        wait_until(
            lambda: self.robot_at(-1.0, 2.0, 0.5) or rosslt.untracked(self.position) == Point(2.0, 1.0, 1.5),
            'the first one again',
        )

    def test_it_is_warned_where_nobody_says_where_the_robot_is(self):
        text = 'no tf from world to quadcopter: it is not known whether the robot has reached a waypoint'
        wait_until(
            lambda: [entry for entry in self.log if entry.level == Log.WARN and entry.msg.startswith(text)],
            'the warning that there is no tf',
            30.0,
        )

    def test_an_error_is_in_the_log_with_file_line_and_column_and_the_last_good_script_stays(self):
        self.script.write_text(TOUR + 'goto(1, 2\n')
        where = '{}:5:5: '.format(self.script)
        wait_until(lambda: [entry for entry in self.log if entry.msg.startswith(where)], 'the error at ' + where)
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'has to be corrected first'):
            rosslt.force_value(self.position.x, 3.0)
        self.script.write_text(TOUR + 'goto(1, 2, 3)\n')
        wait_until(lambda: len(self.locations()) == 10, 'the mended script')

    def test_ids_are_the_same_after_a_restart_even_of_a_script_that_has_been_changed(self):
        rosslt.force_value(self.position.x, -12.5)
        self.script.write_text('goto(0, 0, 0)\n' + self.script.read_text())
        self.wait_for_position(0.0, 0.0, 0.0)
        before = {(location.id, location.line, location.column) for location in self.locations()}
        kept = wait_until(lambda: rospy.get_param(NODE + '/rosslt_script', None), 'what is remembered')
        wait_until(lambda: len(rospy.get_param(NODE + '/rosslt_script')['names']) == len(before), kept)
        self.node.kill()
        self.node.wait()
        self.start()
        self.assertEqual({(location.id, location.line, location.column) for location in self.locations()}, before)

    def test_it_says_what_is_wrong_and_ends_where_there_is_no_script(self):
        for options, text in (
            ([], 'the parameter /none/file has to name a file'),
            (['_file:=/nowhere/tour.script'], '/nowhere/tour.script: it cannot be read'),
            (['_file:={}'.format(self.script), '_precision:=0'], '/none/precision is 0'),
        ):
            done = subprocess.run(
                ['rosrun', 'rosslt', 'interactive_script', '__name:=none', *options],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=60,
                check=False,
                env=dict(os.environ, ROS_LOG_DIR=str(self.script.parent)),
            )
            self.assertEqual(done.returncode, 1)
            self.assertIn(text, done.stdout)


if __name__ == '__main__':
    rosslt.init_node('script_node')
    rostest.rosrun('rosslt', 'script_node', ScriptNode, sys.argv)
