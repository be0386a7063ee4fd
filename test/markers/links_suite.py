#!/usr/bin/env python3
"""A robot that nobody prepared is pulled by its links: the frames are robot_state_publisher's, a C++ node."""

import math
import sys
import unittest

import rospy
import rostest
import tf2_ros
from sensor_msgs.msg import JointState

import rosslt
from rosslt.markers.geometry import are_same_rotation, distance, rotate_vector
from support.hand import Hand, wait_until

TOPIC = '/joint_states:'
HAND, TOOL = TOPIC + 'link hand', TOPIC + 'link tool'
HOLDS = {**{f'j{number}': f'l{number}' for number in range(1, 7)}, 'j7': 'wrist'}
#: Where the shapes of the links have their middles.
GRIP, ELBOW_GRIP = (0.0, 0.0, 0.02), (0.04, 0.0, 0.0)
#: A hand asks for a place to half a millimetre in each coordinate.
NEAR = 1.5e-3  # m


class Links(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.hand, cls.buffer = Hand(), tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)

    def seen(self, link, grip=(0.0, 0.0, 0.0)):
        """Where robot_state_publisher has a point of a link now, and how the link is turned."""
        wait_until(lambda: self.buffer.can_transform('base', link, rospy.Time()), f'the frame {link}')
        place = self.buffer.lookup_transform('base', link, rospy.Time()).transform
        at, turned = place.translation, place.rotation
        rotation = (turned.x, turned.y, turned.z, turned.w)
        x, y, z = rotate_vector(rotation, grip)
        return (at.x + x, at.y + y, at.z + z), rotation

    def handle(self, name):
        pose = self.hand.marker(name).pose
        at, turned = pose.position, pose.orientation
        return (at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w)

    def assert_stands_at(self, name, link, grip=(0.0, 0.0, 0.0), turns=True):
        """A handle is where robot_state_publisher has a link, or a point of it."""

        def is_there():
            (at, turned), (seen_at, seen_turned) = self.handle(name), self.seen(link, grip)
            return distance(at, seen_at) < 1e-6 and (not turns or are_same_rotation(turned, seen_turned, 1e-9))

        wait_until(is_there, lambda: f'{name} at {self.handle(name)} to be where {link} is: {self.seen(link)}')

    def test_handles_stand_where_robot_state_publisher_has_the_links(self):
        for joint, link in HOLDS.items():
            self.assert_stands_at(TOPIC + joint, link)
        self.assert_stands_at(HAND, 'hand', GRIP)
        self.assert_stands_at(TOOL, 'tool')
        self.assert_stands_at(TOPIC + 'left', 'left_finger', turns=False)
        self.assert_stands_at(TOPIC + 'right', 'right_finger', turns=False)

    def pull(self, name, link, grip, by):
        self.assert_stands_at(name, link, grip)
        start, _ = self.seen(link, grip)
        self.hand.drag(name, **dict(zip(('dx', 'dy', 'dz'), by)))
        target = [a + b for a, b in zip(start, by)]
        wait_until(
            lambda: distance(self.seen(link, grip)[0], target) < NEAR,
            lambda: f'{link} to come to {target}; it is at {self.seen(link, grip)[0]}',
        )

    def test_the_hand_is_pulled_and_the_joints_before_it_follow(self):
        for by in ((0.05, 0.1, -0.15), (-0.1, 0.02, 0.1), (0.05, -0.12, 0.05)):
            self.pull(HAND, 'hand', GRIP, by)

    def behind_the_elbow(self):
        """The positions of the joints that do not move it."""
        state = rospy.wait_for_message('/joint_states', JointState)
        return [position for name, position in zip(state.name, state.position) if name not in ('j1', 'j2', 'j3')]

    def test_an_elbow_is_pulled_by_the_joints_before_it_alone(self):
        before, at = self.behind_the_elbow(), self.seen('l3', ELBOW_GRIP)[0]
        # around the base, where it can go
        radius, angle = math.hypot(at[0], at[1]), math.atan2(at[1], at[0]) + 0.2
        by = radius * math.cos(angle) - at[0], radius * math.sin(angle) - at[1], 0.0
        self.pull(TOPIC + 'link l3', 'l3', ELBOW_GRIP, by)
        self.assertEqual(before, self.behind_the_elbow())

    def test_a_hand_is_turned_by_the_joints_before_it(self):
        self.assert_stands_at(HAND, 'hand', GRIP)
        feedback = self.hand.press(HAND)
        x, y, z, w = self.handle(HAND)[1]
        half = 0.1
        turned = feedback.pose.orientation
        # about z of the frame
        turned.x, turned.y = math.cos(half) * x - math.sin(half) * y, math.cos(half) * y + math.sin(half) * x
        turned.z, turned.w = math.cos(half) * z + math.sin(half) * w, math.cos(half) * w - math.sin(half) * z
        wanted = (turned.x, turned.y, turned.z, turned.w)
        self.hand.move(feedback, orientation=turned, steps=3)
        self.hand.release(feedback)
        wait_until(
            lambda: are_same_rotation(self.seen('hand')[1], wanted, 1e-6),
            lambda: f'the hand to be turned to {wanted}: {self.seen("hand")}',
        )


if __name__ == '__main__':
    rosslt.init_node('check_links')
    rostest.rosrun('rosslt', 'links', Links, sys.argv)
