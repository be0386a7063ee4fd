#!/usr/bin/env python3
"""What slt_visualization watches: topics of all types that RViz shows, as publishers and markers come and go."""

import subprocess
import sys
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    TransformStamped,
)
from nav_msgs.msg import Path
from rosslt.msg import MarkerArrayTracked, MarkerTracked, PoseStampedTracked
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

import rosslt
from support.hand import Hand, wait_until

WAIT = 30.0  # s, enough for a busy machine

#: Publishes one tracked marker on a topic until it is killed.
PUBLISHER = """
import sys
import rospy
from visualization_msgs.msg import Marker
import rosslt
rosslt.init_node('mortal')
publisher = rosslt.Publisher(sys.argv[1], Marker, queue_size=1, latch=True)
marker = Marker(ns='mortal')
marker.header.frame_id = 'world'
marker.pose.position.x = rosslt.location(1.0, name='x')
marker.scale.x = marker.scale.y = marker.scale.z = marker.pose.orientation.w = 1.0
publisher.publish(marker)
rospy.spin()
"""


def x(name, value=1.0):
    return rosslt.location(value, name=name)


def cube(number=0, **fields):
    marker = Marker(ns='cubes', id=number, type=Marker.CUBE, **fields)
    marker.header.frame_id = 'world'
    marker.pose.position.x = rosslt.location(1.0, name='cube_x')
    marker.scale.x = marker.scale.y = marker.scale.z = marker.pose.orientation.w = 1.0
    return marker


def pose():
    result = Pose()
    result.position.x = rosslt.location(1.0, name='pose_x')
    return result


WORLD = Header(frame_id='world')


class Watching(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.hand = Hand()

    def publisher(self, topic, message_class):
        publisher = rosslt.Publisher(topic, message_class, queue_size=10, latch=True)
        self.addCleanup(publisher.unregister)
        return publisher

    def assert_shown(self, *names, within=WAIT):
        wait_until(
            lambda: set(names) <= self.hand.names(),
            lambda: 'all of {}; there are {}'.format(names, sorted(self.hand.names())),
            within,
        )

    def assert_gone(self, *names, within=WAIT):
        wait_until(lambda: not set(names) & self.hand.names(), 'none of {}'.format(names), within)

    def test_topics_of_all_marker_types_are_found(self):
        for topic, message_class, message in (
            ('one', Marker, cube()),
            ('several', MarkerArray, MarkerArray([cube(0), cube(1)])),
            ('one_tracked', MarkerTracked, cube()),
            ('several_tracked', MarkerArrayTracked, MarkerArray([cube(0), cube(1)])),
        ):
            with self.subTest(topic):
                self.publisher(topic, message_class).publish(message)
                self.assert_shown('/{}:cubes:0'.format(topic))

    def test_other_things_that_rviz_shows_have_handles_too(self):
        for topic, message_class, message, name in (
            ('pose', PoseStamped, PoseStamped(WORLD, pose()), '/pose'),
            ('pose_tracked', PoseStampedTracked, PoseStamped(WORLD, pose()), '/pose_tracked'),
            ('point', PointStamped, PointStamped(WORLD, Point(1.0, x('point_y'), 0.0)), '/point'),
            ('poses', PoseArray, PoseArray(WORLD, [Pose(), pose()]), '/poses:poses[1]'),
            ('path', Path, Path(WORLD, [PoseStamped(), PoseStamped(WORLD, pose())]), '/path:poses[1]'),
            (
                'polygon',
                PolygonStamped,
                PolygonStamped(WORLD, Polygon([Point32(), Point32(x('corner'), 0.0, 0.0)])),
                '/polygon:points[1]',
            ),
        ):
            with self.subTest(topic):
                self.publisher(topic, message_class).publish(message)
                self.assert_shown(name)
                self.assertEqual(
                    {one for one in self.hand.names() if one.partition(':')[0] == '/' + topic},
                    {name},
                    'what is not tracked has no handle',
                )

    def broadcast(self, topic, frame):
        """Send a tracked frame over and over, as a broadcaster does."""
        publisher = self.publisher(topic, TFMessage)

        def send(_event):
            transform = TransformStamped(header=Header(frame_id='world', stamp=rospy.Time.now()), child_frame_id=frame)
            transform.transform.translation.x = rosslt.location(1.0, name=frame + '_x')
            transform.transform.rotation.w = 1.0
            publisher.publish(TFMessage([transform]))

        timer = rospy.Timer(rospy.Duration(0.05), send)
        self.addCleanup(timer.shutdown)

    def test_frames_that_are_broadcast_can_be_dragged(self):
        for topic, frame in (('/tf', 'tool'), ('/tf_static', 'camera')):
            with self.subTest(topic):
                name = '{}:{}'.format(topic, frame)
                self.broadcast(topic, frame)
                self.hand.drag(name, dx=0.5)
                wait_until(lambda name=name: abs(self.hand.position(name)[0] - 1.5) < 1e-5, name + ' to follow')
                self.assertAlmostEqual(rospy.get_param('/check_watching/rosslt/{}_x'.format(frame)), 1.5, places=5)

    def test_a_topic_that_goes_takes_its_handles_along(self):
        publisher = rosslt.Publisher('passing', Marker, queue_size=1, latch=True)
        publisher.publish(cube())
        self.assert_shown('/passing:cubes:0')
        publisher.unregister()
        self.assert_gone('/passing:cubes:0')

    def test_what_a_killed_publisher_showed_goes(self):
        # Another publisher stays, so the topic itself stays.
        self.publisher('shared', Marker).publish(cube())
        process = subprocess.Popen([sys.executable, '-c', PUBLISHER, 'shared'])
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.assert_shown('/shared:mortal:0', '/shared:cubes:0')
        process.kill()
        self.assert_gone('/shared:mortal:0')
        self.assertIn('/shared:cubes:0', self.hand.names())

    def test_delete_and_delete_all_take_handles_away(self):
        publisher = self.publisher('deleting', MarkerArray)
        publisher.publish([cube(0), cube(1), cube(2)])
        self.assert_shown('/deleting:cubes:0', '/deleting:cubes:1', '/deleting:cubes:2')
        publisher.publish(
            [Marker(ns='cubes', id=1, action=Marker.DELETE), Marker(ns='others', id=0, action=Marker.DELETE)]
        )
        self.assert_gone('/deleting:cubes:1')
        self.assert_shown('/deleting:cubes:0', '/deleting:cubes:2')
        publisher.publish([Marker(action=Marker.DELETEALL)])
        self.assert_gone('/deleting:cubes:0', '/deleting:cubes:2')

    def test_what_is_deleted_and_added_again_in_one_message_is_not_inserted_anew(self):
        publisher = self.publisher('renewing', MarkerArray)
        publisher.publish([cube(0)])
        self.assert_shown('/renewing:cubes:0')
        del self.hand.inserts[:]
        for _ in range(5):
            publisher.publish([Marker(action=Marker.DELETEALL), cube(0)])
            time.sleep(0.1)
        self.assertNotIn('/renewing:cubes:0', self.hand.inserts)

    def test_bad_markers_are_left_out_and_the_rest_is_shown(self):
        publisher = self.publisher('faulty', MarkerArray)
        infinite, frameless, unknown = cube(0), cube(1), cube(2)
        infinite.pose.position.y = float('nan')
        frameless.header.frame_id = ''
        unknown.type = 77
        publisher.publish([infinite, frameless, unknown, cube(3, action=9), cube(4)])
        self.assert_shown('/faulty:cubes:4')
        self.assertEqual({name for name in self.hand.names() if name.startswith('/faulty:')}, {'/faulty:cubes:4'})


if __name__ == '__main__':
    rosslt.init_node('check_watching')
    rostest.rosrun('rosslt', 'watching', Watching)
