#!/usr/bin/env python3
"""Plans how the quadcopter gets to a waypoint, and sends it along: a quadratic Bezier curve in ~duration seconds."""

import contextlib

import rospy
import tf2_ros
from geometry_msgs.msg import Point, Pose, PoseStamped
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

RATE = 50  # Hz
POINTS_SHOWN = 11


class Bezier:
    """A quadratic Bezier curve from b0 to b2, passed in tau seconds."""

    def __init__(self, b0, b1, b2, tau):
        self.b0, self.b1, self.b2, self.tau = b0, b1, b2, tau

    def point(self, t):
        if t <= 0:
            return self.b0
        if t >= self.tau:
            return self.b2
        t /= self.tau
        x = t * t * self.b2.x + 2 * t * (1 - t) * self.b1.x + (1 - t) * (1 - t) * self.b0.x
        y = t * t * self.b2.y + 2 * t * (1 - t) * self.b1.y + (1 - t) * (1 - t) * self.b0.y
        z = t * t * self.b2.z + 2 * t * (1 - t) * self.b1.z + (1 - t) * (1 - t) * self.b0.z
        return Point(x, y, z)


def midpoint(a, b):
    return Point((a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2)


def marker(name, kind, size, color):
    result = Marker(ns=name, type=kind, action=Marker.ADD, color=ColorRGBA(*color))
    result.header.frame_id = 'world'
    result.pose.orientation.w = 1.0
    result.scale.x = result.scale.y = result.scale.z = size
    return result


def drawn(curve):
    """The curve as a line, its control point and its end point."""
    line = marker('curve', Marker.LINE_STRIP, 0.04, (0.3, 0.7, 1.0, 1.0))
    line.points = [curve.point(curve.tau * i / (POINTS_SHOWN - 1)) for i in range(POINTS_SHOWN)]
    control = marker('control', Marker.CUBE, 0.24, (0.6, 0.4, 0.9, 0.7))
    control.pose.position = curve.b1
    end = marker('end', Marker.SPHERE, 0.3, (1.0, 0.6, 0.1, 0.8))
    end.pose.position = curve.b2
    return MarkerArray([line, control, end])


class Planner:
    def __init__(self):
        self.tau = rospy.get_param('~duration', 4.0)
        self.tf = tf2_ros.Buffer()
        tf2_ros.TransformListener(self.tf)
        self.poses = rospy.Publisher('trajectory', Pose, queue_size=10)
        self.markers = rospy.Publisher('trajectory_markers', MarkerArray, queue_size=10, latch=True)
        self.waypoint = self.planned = self.curve = self.start = self.departure = None
        rospy.Subscriber('waypoint', PoseStamped, self.take_waypoint)

    def take_waypoint(self, waypoint):
        self.waypoint = waypoint

    def plan(self, waypoint, now):
        """Plan anew; a waypoint that has been moved meanwhile has the stamp it had, and its flight goes on."""
        if self.planned is None or waypoint.header.stamp != self.planned.header.stamp:
            at = self.tf.lookup_transform('world', 'quadcopter', rospy.Time()).transform.translation
            self.start, self.departure = Point(at.x, at.y, at.z), now
        end = waypoint.pose.position
        self.curve = Bezier(self.start, midpoint(self.start, end), end, self.tau)
        self.planned = waypoint
        self.markers.publish(drawn(self.curve))

    def fly(self):
        now, waypoint = rospy.Time.now(), self.waypoint
        if waypoint is not self.planned:
            try:
                self.plan(waypoint, now)
            except tf2_ros.TransformException as error:
                rospy.logwarn_throttle(5, 'where is the quadcopter? %s', error)
        if self.curve is not None:
            self.departure = min(self.departure, now)  # simulated time may begin anew
            pose = Pose(position=self.curve.point((now - self.departure).to_sec()))
            pose.orientation.w = 1.0
            self.poses.publish(pose)

    def run(self):
        rate = rospy.Rate(RATE, reset=True)
        while not rospy.is_shutdown():
            self.fly()
            rate.sleep()


if __name__ == '__main__':
    rospy.init_node('slt_trajectory')
    with contextlib.suppress(rospy.ROSInterruptException):
        Planner().run()
