"""Handles on what is no Marker but stands in RViz all the same: stamped poses, points, paths and polygons.

RViz draws them without a size, or with one that is set in RViz itself; the handles on them are spheres.
"""

import math

from rosslt.markers import controls
from rosslt.markers.geometry import IDENTITY
from rosslt.markers.handles import PointHandle, PoseHandle, can_change

#: How large the handles are of what has no size of its own, in metres.
SIZE = 0.5

#: A little larger than the sphere that RViz draws at a PointStamped, unless it is told otherwise.
POINT_SIZE = 0.42

#: The color of handles of what has no color of its own: (red, green, blue).
COLOR = (1.0, 0.6, 0.1)
ORIGIN = (0.0, 0.0, 0.0, *IDENTITY)


def pose_stamped(topic, message):
    """A PoseStamped: one handle, with arrows."""
    return _pose_handles(topic, message.header.frame_id, message.pose, SIZE, has_arrows=True)


def point_stamped(topic, message):
    """A PointStamped: one handle."""
    return _point_handles(topic, message.header.frame_id, message.point, POINT_SIZE)


def pose_array(topic, message):
    """A PoseArray: a handle for each tracked pose."""
    for index, pose in enumerate(message.poses):
        yield from _pose_handles('{}:poses[{}]'.format(topic, index), message.header.frame_id, pose, 0.5 * SIZE)


def path(topic, message):
    """A Path: a handle for each tracked pose, in the frame of the path."""
    for index, stamped in enumerate(message.poses):
        yield from _pose_handles('{}:poses[{}]'.format(topic, index), message.header.frame_id, stamped.pose, 0.5 * SIZE)


def polygon_stamped(topic, message):
    """A PolygonStamped: a handle for each tracked corner."""
    for index, point in enumerate(message.polygon.points):
        yield from _point_handles('{}:points[{}]'.format(topic, index), message.header.frame_id, point, 0.4 * SIZE)


#: The function for each type of message.
BY_TYPE = {
    'geometry_msgs/PointStamped': point_stamped,
    'geometry_msgs/PolygonStamped': polygon_stamped,
    'geometry_msgs/PoseArray': pose_array,
    'geometry_msgs/PoseStamped': pose_stamped,
    'nav_msgs/Path': path,
}


def _pose_handles(name, frame, pose, size, has_arrows=False):
    numbers = controls.pose_tuple(pose)
    if any(map(can_change, numbers)) and all(map(math.isfinite, numbers)):
        yield PoseHandle(name, frame, pose, size, None, lambda: [controls.sphere(0.4 * size, COLOR)], has_arrows)


def _point_handles(name, frame, point, size):
    numbers = (point.x, point.y, point.z)
    if any(map(can_change, numbers)) and all(map(math.isfinite, numbers)):
        yield PointHandle(name, frame, ORIGIN, point, size, COLOR)
