#!/usr/bin/env python3
"""A kite that circles in the wind: the tf frame of a node that knows nothing of rosslt."""

import math

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf.transformations import quaternion_from_euler

rospy.init_node('kite')
broadcaster = tf2_ros.TransformBroadcaster()

kite = TransformStamped()
kite.header.frame_id = rospy.get_param('~parent', 'world')
kite.child_frame_id = 'kite'

east = -2.5
north = 1.5

while not rospy.is_shutdown():
    now = rospy.Time.now()
    t = now.to_sec() * 0.5

    kite.transform.translation.x = east + 0.25 * math.cos(t * 0.4)
    kite.transform.translation.y = north
    kite.transform.translation.z = 1.0 + 0.5 * math.sin(t * 0.4)

    q = quaternion_from_euler(0.0, 0.0, 0.6 * math.sin(t * 0.3))
    kite.transform.rotation.x = q[0]
    kite.transform.rotation.y = q[1]
    kite.transform.rotation.z = q[2]
    kite.transform.rotation.w = q[3]

    kite.header.stamp = now
    broadcaster.sendTransform(kite)
    rospy.sleep(0.02)
