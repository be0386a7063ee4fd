#!/usr/bin/env python3
"""Says where to fly."""

import rospy
from geometry_msgs.msg import PoseStamped

rospy.init_node('tour')
publisher = rospy.Publisher('waypoint', PoseStamped, queue_size=1)
waypoint = PoseStamped()
waypoint.header.frame_id = 'world'
waypoint.pose.orientation.w = 1.0
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    waypoint.pose.position.x = 2.0
    waypoint.pose.position.y = 1.0
    waypoint.pose.position.z = 1.5
    publisher.publish(waypoint)
    rate.sleep()
