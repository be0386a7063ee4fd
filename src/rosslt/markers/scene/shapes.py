"""Shapes to grab, as Markers, and the colors that they have."""

from typing import Any, Iterable, Sequence, Tuple

from geometry_msgs.msg import Point, Pose
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from rosslt.markers.geometry import AXES, PoseTuple, Vector, normalized

#: Red, green and blue for x, y and z, as everywhere in RViz.
AXIS_COLORS: Tuple[Vector, ...] = ((0.8, 0.1, 0.1), (0.1, 0.7, 0.1), (0.15, 0.25, 0.9))


def pose_tuple(pose: Pose) -> Tuple[Any, ...]:
    """(x, y, z, qx, qy, qz, qw) of a geometry_msgs/Pose, tracked where they are."""
    position, orientation = pose.position, pose.orientation
    return (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)


def plain_pose(pose: Pose) -> PoseTuple:
    """(x, y, z, qx, qy, qz, qw) of a geometry_msgs/Pose, plain, the orientation of length 1."""
    x, y, z, *rotation = map(float, pose_tuple(pose))
    return (x, y, z, *normalized(*rotation))


def sphere(diameter: float, color: Sequence[float], alpha: float = 1.0) -> Marker:
    """A sphere."""
    shape = Marker(type=Marker.SPHERE)
    shape.scale.x = shape.scale.y = shape.scale.z = diameter
    paint(shape, color, alpha)
    return shape


def cube(side: float, color: Sequence[float]) -> Marker:
    """A cube."""
    shape = sphere(side, color)
    shape.type = Marker.CUBE
    return shape


def line(points: Iterable[Vector], width: float, color: Sequence[float]) -> Marker:
    """A line through points."""
    shape = Marker(type=Marker.LINE_STRIP, points=[Point(*map(float, point)) for point in points])
    shape.pose.orientation.w = 1.0
    shape.scale.x = width
    paint(shape, color)
    return shape


def axes(length: float, width: float) -> Marker:
    """The axes of a thing: x red, y green, z blue."""
    shape = line([], width, AXIS_COLORS[0])
    shape.type = Marker.LINE_LIST
    for axis, color in zip(AXES, AXIS_COLORS):
        shape.points += [Point(), Point(*[length * part for part in axis])]
        shape.colors += [ColorRGBA(*color, 1.0)] * 2
    return shape


def paint(shape: Marker, color: Sequence[float], alpha: float = 1.0) -> None:
    """Give a shape a color (red, green, blue)."""
    shape.color.r, shape.color.g, shape.color.b = color
    shape.color.a = alpha
