#!/usr/bin/env python3
"""A simulated quadcopter: it is where it was sent DELAY seconds ago, tells so by tf, and shows itself."""

import collections
import contextlib

import rospy
import tf2_ros
from geometry_msgs.msg import Pose, Quaternion, TransformStamped
from visualization_msgs.msg import Marker

RATE = 50  # Hz
DELAY = 0.1  # s
MESH = 'package://rosslt/meshes/quadcopter.dae'
WIDTH = 0.64  # m


class Quadcopter:
    def __init__(self):
        self.pose = Pose(orientation=Quaternion(w=1.0))
        self.sent = collections.deque()  # (when, pose)
        self.tf = tf2_ros.TransformBroadcaster()
        self.markers = rospy.Publisher('quadcopter', Marker, queue_size=2)
        rospy.Subscriber('trajectory', Pose, self.take)

    def take(self, pose):
        self.sent.append((rospy.Time.now(), pose))

    def fly(self):
        now = rospy.Time.now()
        while self.sent and not 0 <= (now - self.sent[0][0]).to_sec() < DELAY:
            self.pose = self.sent.popleft()[1]
        self.tf.sendTransform(self.transform(now))
        self.markers.publish(self.marker())

    def transform(self, now):
        result = TransformStamped(child_frame_id='quadcopter')
        result.header.frame_id, result.header.stamp = 'world', now
        position, result.transform.rotation = self.pose.position, self.pose.orientation
        result.transform.translation.x = position.x
        result.transform.translation.y = position.y
        result.transform.translation.z = position.z
        return result

    def marker(self):
        result = Marker(ns='quadcopter', type=Marker.MESH_RESOURCE, action=Marker.ADD, pose=self.pose)
        result.header.frame_id = 'world'
        result.mesh_resource, result.mesh_use_embedded_materials = MESH, True
        result.scale.x = result.scale.y = result.scale.z = WIDTH
        return result

    def run(self):
        rate = rospy.Rate(RATE, reset=True)
        while not rospy.is_shutdown():
            self.fly()
            rate.sleep()


if __name__ == '__main__':
    rospy.init_node('slt_quad')
    with contextlib.suppress(rospy.ROSInterruptException):
        Quadcopter().run()
