"""Handles on messages that are not Markers but are shown in RViz: one row of a table for each type.

RViz draws most of them without a size, or with one that is set in RViz itself; the handles on them are balls.
"""

import math
from typing import Callable, Dict, Iterator, NamedTuple, Optional, Sequence, Tuple, Type, Union

import genpy
import roslib.message
import rospy
from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
)
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from tf2_msgs.msg import TFMessage

from rosslt.markers.geometry import IDENTITY, PoseTuple
from rosslt.markers.scene.handle import Handle, Settings, has_source
from rosslt.markers.scene.handles import PointHandle, PoseHandle
from rosslt.markers.scene.joints import joint_state
from rosslt.markers.scene.marker import COLOR, marker_handles
from rosslt.markers.scene.shapes import axes, line, pose_tuple, sphere

#: The size of arrows and rings relative to the ball that they surround.
ARROWS_TO_BALL = 2.5

#: The size of a ball on one of many poses, relative to the ball on a single pose.
ONE_OF_MANY = 0.5

#: The size of the ball on a PointStamped: larger than RViz's own sphere there, which is 0.4 m across.
OVER_POINT = 2.1

#: The width of lines and axes, in metres, and the color of lines, as RViz has them for a Path.
LINE_WIDTH, LINE_COLOR = 0.03, (0.1, 0.9, 0.1)

#: The opacity of a ball on a pose, which has axes or an arrow of its own.
SEE_THROUGH = 0.6

#: Handles that give way to a marker at the same position.
RANK = 2

#: The time for which RViz shows a frame that is broadcast no more, in seconds.
FRAME_TIMEOUT = 15

ORIGIN: PoseTuple = (0.0, 0.0, 0.0, *IDENTITY)

#: (name, the handle of that name, or None if it has none)
Named = Tuple[str, Optional[Handle]]


class MessageKind(NamedTuple):
    """The handles of a type of message.

    Attributes:
        handles: gives (name, its Handle or None) for each thing in a message of a topic.
        is_partial: whether a message speaks of some of the things only, and the others stay.
        lifetime: for how long things of a topic stay that no message speaks of; 0 for ever. It matters where
            `is_partial`.
    """

    handles: Callable[[str, genpy.Message, Settings], Iterator[Named]]
    is_partial: bool = False
    lifetime: Callable[[str], rospy.Duration] = lambda topic: rospy.Duration()


def pose_stamped(topic: str, message: PoseStamped, settings: Settings) -> Iterator[Named]:
    """A PoseStamped: one handle, with arrows."""
    yield topic, _on_pose(topic, message.header.frame_id, message.pose, settings, has_arrows=True)


def pose_with_covariance(
    topic: str, message: Union[PoseWithCovarianceStamped, Odometry], settings: Settings
) -> Iterator[Named]:
    """A pose with its covariance, and an Odometry, which has a twist as well: one handle, with arrows."""
    yield topic, _on_pose(topic, message.header.frame_id, message.pose.pose, settings, has_arrows=True)


def occupancy_grid(topic: str, message: OccupancyGrid, settings: Settings) -> Iterator[Named]:
    """An OccupancyGrid: one handle on its origin, the corner of its first cell, with arrows."""
    yield topic, _on_pose(topic, message.header.frame_id, message.info.origin, settings, has_arrows=True)


def point_stamped(topic: str, message: PointStamped, settings: Settings) -> Iterator[Named]:
    """A PointStamped: one handle."""
    yield topic, _on_point(topic, message.header.frame_id, message.point, settings, OVER_POINT)


def pose_array(topic: str, message: PoseArray, settings: Settings) -> Iterator[Named]:
    """A PoseArray: a handle for each tracked pose."""
    for index, pose in enumerate(message.poses):
        name = '{}:poses[{}]'.format(topic, index)
        yield name, _on_pose(name, message.header.frame_id, pose, settings, ONE_OF_MANY)


def path(topic: str, message: Path, settings: Settings) -> Iterator[Named]:
    """A Path: a handle for each tracked pose, in the frame of the path."""
    poses = [stamped.pose for stamped in message.poses]
    yield from pose_array(topic, PoseArray(message.header, poses), settings)
    yield from _line(topic, message.header.frame_id, [pose.position for pose in poses], settings)


def polygon_stamped(topic: str, message: PolygonStamped, settings: Settings) -> Iterator[Named]:
    """A PolygonStamped: a handle for each tracked corner."""
    for index, point in enumerate(message.polygon.points):
        name = '{}:points[{}]'.format(topic, index)
        yield name, _on_point(name, message.header.frame_id, point, settings)
    points = message.polygon.points
    yield from _line(topic, message.header.frame_id, [*points, *points[:1]], settings)


def frames(topic: str, message: TFMessage, settings: Settings) -> Iterator[Named]:
    """A TFMessage: a handle for each tracked frame, in its parent frame. Each broadcaster sends its own frames."""
    for transform in message.transforms:
        name = '{}:{}'.format(topic, transform.child_frame_id)
        pose = Pose(transform.transform.translation, transform.transform.rotation)
        yield name, _on_pose(name, transform.header.frame_id, pose, settings, has_arrows=True)


def frame_lifetime(topic: str) -> rospy.Duration:
    """The time that frames stay when they are broadcast no more, as in RViz; static ones are broadcast once."""
    return rospy.Duration(0 if topic.endswith('tf_static') else FRAME_TIMEOUT)


def action_goal(topic: str, message: genpy.Message, settings: Settings) -> Iterator[Named]:
    """The goal of an action, MoveBaseActionGoal for one: a handle on each tracked PoseStamped that it holds."""
    goal = message.goal
    for field, kind in zip(goal.__slots__, goal._slot_types):
        if kind == 'geometry_msgs/PoseStamped':
            name, stamped = '{}:{}'.format(topic, field), getattr(goal, field)
            yield name, _on_pose(name, stamped.header.frame_id, stamped.pose, settings, has_arrows=True)


#: The row for each type of message.
KINDS: Dict[str, MessageKind] = {
    'geometry_msgs/PointStamped': MessageKind(point_stamped),
    'geometry_msgs/PolygonStamped': MessageKind(polygon_stamped),
    'geometry_msgs/PoseArray': MessageKind(pose_array),
    'geometry_msgs/PoseStamped': MessageKind(pose_stamped),
    'geometry_msgs/PoseWithCovarianceStamped': MessageKind(pose_with_covariance),
    'nav_msgs/OccupancyGrid': MessageKind(occupancy_grid),
    'nav_msgs/Odometry': MessageKind(pose_with_covariance),
    'nav_msgs/Path': MessageKind(path),
    'sensor_msgs/JointState': MessageKind(joint_state, is_partial=True),
    'tf2_msgs/TFMessage': MessageKind(frames, is_partial=True, lifetime=frame_lifetime),
}

ACTION_GOAL = MessageKind(action_goal)


def kind_of(message_class: Type[genpy.Message]) -> Optional[MessageKind]:
    """The row for a class of messages; None for classes that RViz does not show."""
    row = KINDS.get(message_class._type)
    if row is None and message_class._type.endswith('ActionGoal'):
        fields = dict(zip(message_class.__slots__, message_class._slot_types))
        goal_class = roslib.message.get_message_class(fields.get('goal', ''))
        if goal_class is not None and 'geometry_msgs/PoseStamped' in goal_class._slot_types:
            return ACTION_GOAL
    return row


def _on_pose(
    name: str, frame: str, pose: Pose, settings: Settings, part: float = 1.0, has_arrows: bool = False
) -> Optional[PoseHandle]:
    numbers = pose_tuple(pose)
    if not any(map(has_source, numbers)) or not all(map(math.isfinite, numbers)):
        return None
    ball = part * settings.ball_size
    return PoseHandle(
        name,
        frame,
        pose,
        ARROWS_TO_BALL * ball,
        ball,
        lambda: [sphere(ball, COLOR, SEE_THROUGH), *([axes(2.0 * ball, LINE_WIDTH)] if settings.draws_all else [])],
        has_arrows,
        settings.is_planar,
        RANK,
    )


def _line(topic: str, frame: str, points: Sequence[Union[Point, Point32]], settings: Settings) -> Iterator[Named]:
    """The line through points, at least one of them tracked, for views that do not draw it by themselves."""
    numbers = [(point.x, point.y, point.z) for point in points]
    if not settings.draws_all or not any(has_source(number) for point in numbers for number in point):
        return
    marker = line([point for point in numbers if all(map(math.isfinite, point))], LINE_WIDTH, LINE_COLOR)
    marker.header.frame_id = frame
    for handle in marker_handles('{}:line'.format(topic), marker, False, settings):
        yield handle.name, handle


def _on_point(
    name: str, frame: str, point: Union[Point, Point32], settings: Settings, part: float = 1.0
) -> Optional[PointHandle]:
    numbers = (point.x, point.y, point.z)
    if not any(map(has_source, numbers)) or not all(map(math.isfinite, numbers)):
        return None
    return PointHandle(name, frame, ORIGIN, point, part * settings.ball_size, COLOR, settings.is_planar, RANK)
