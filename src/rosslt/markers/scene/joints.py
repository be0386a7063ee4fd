"""Handles on the joints of a robot: a ring for each that turns, a ball that slides for each that slides.

A JointState says how far each joint has turned; where the joints are, `robot_description` says (URDF).
"""

import functools
import math
from typing import Any, Dict, Iterator, List, Optional, Tuple

import rospy
from sensor_msgs.msg import JointState

from rosslt import node, values
from rosslt.markers.geometry import PoseTuple, inverse, onto, product, rotate_vector
from rosslt.markers.scene.handle import BODY, POINTS, CanChange, Handle, Motions, RankOf, Ring, Settings, has_source
from rosslt.markers.scene.kinematics import behind
from rosslt.markers.scene.links import LinkHandle, RobotHandle, RobotPose, link_name
from rosslt.markers.scene.marker import COLOR
from rosslt.markers.scene.shapes import sphere


class JointHandle(RobotHandle):
    """A handle that turns or slides a joint of a robot: a ball on the joint.

    The ring of a link that has a handle of its own is a part of that.

    Args:
        pose: of the robot.
        joint: what it is.
    """

    __slots__ = ('_joint', '_start', '_value', 'level')

    def __init__(self, pose: RobotPose, joint: node.Joint) -> None:
        self._pose, self._joint, self._value = pose, joint, pose.position(joint)
        self._start = pose.plain.joint(joint)
        place, is_of_link = behind(self._start, joint, float(self._value)), False
        if joint.is_turning:
            is_of_link = pose.has_handle(joint.child)
        else:
            # Its x axis, along which the ball moves, lies along that of the joint.
            place = place._replace(rotation=product(place.rotation, onto(joint.axis)))
        self.level = POINTS if is_of_link else BODY
        size = 0.5 * pose.settings.ball_size
        super().__init__(
            '{}:{}'.format(pose.topic, joint.name),
            place.frame,
            place.pose,
            2.5 * size,
            (joint, size, place.frame),
            [self._value],
            lambda: [sphere(size, COLOR)],
            thing=link_name(pose.topic, joint.child) if is_of_link else '',
        )

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The target of a drag to a pose."""
        if self._joint.is_turning:
            return ([self._value], [self.turn(pose, float(self._value))]) if turned else ([], [])
        axis = rotate_vector(self._start.rotation, self._joint.axis)
        position = sum((a - b) * c for a, b, c in zip(pose, self._start.position, axis))
        return ([self._value], [position]) if moved else ([], [])

    def turn(self, pose: PoseTuple, near: Optional[float] = None) -> float:
        """Return the angle by which a joint has turned at a pose."""
        if not self._joint.is_turning:
            return 0.0
        x, y, z, w = product(inverse(self._start.rotation), pose[3:])
        angle = 2.0 * math.atan2(sum(a * b for a, b in zip((x, y, z), self._joint.axis)), w)
        near = float(self._value) if near is None else near
        return near + math.remainder(angle - near, 2.0 * math.pi)

    def limited(self, targets: List[float], turn: float) -> Tuple[List[float], str]:
        """The target within the limits of the joint, and which limit stops it."""
        kept, told = kept_within(self._joint, turn if self._joint.is_turning else targets[0], float(self._value))
        return [kept], told

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """A ring around its axis, or a way along it."""
        del rank_of
        is_free = can_change(self._value)
        if self._joint.is_turning:
            rings = (Ring('joint', self._joint.axis, is_in_frame=False),) if is_free else ()
            return Motions((False, False, False), rings=rings)
        return Motions((is_free, False, False))


def kept_within(joint: node.Joint, wanted: float, present: float) -> Tuple[float, str]:
    """The position of a joint within its limits, and which limit stops it, '' for none."""
    kept = joint.kept(wanted, present)
    if kept == wanted:
        return wanted, ''
    word, limit = ('maximum', joint.upper) if kept < wanted else ('minimum', joint.lower)
    where = 'at' if values.is_same(kept, limit) else 'beyond'
    return kept, f'{joint.name} is {where} its {word} {limit!r} in robot_description'


def joint_state(topic: str, message: JointState, settings: Settings) -> Iterator[Tuple[str, Optional[Handle]]]:
    """A JointState: a handle for each joint that has a tracked position, and for each link that such joints move.

    As for `robot_state_publisher`, the first position of a joint counts, and a message of other lengths does not. What
    a message does not move is another's.
    """
    if not any(map(has_source, message.position)) or len(message.name) != len(message.position):
        return
    robot, former = robot_for(topic), _FORMER.get(topic)
    if former is not None and former is not robot:
        yield from [('{}:{}'.format(topic, name), None) for name in former.joints]
        yield from [(link_name(topic, link), None) for link in {**former.holding, **former.shapes}]
    _FORMER[topic] = robot
    named = zip(reversed(message.name), reversed(message.position))
    pose = RobotPose(topic, robot, {name: value for name, value in named if math.isfinite(value)}, settings)
    for joint in robot.joints.values():
        position = pose.position(joint)
        if position is not None:
            yield '{}:{}'.format(topic, joint.name), JointHandle(pose, joint) if has_source(position) else None
    # a view that draws the robot draws also what does not move
    for link in {**robot.holding, **(robot.shapes if settings.draws_all else {})}:
        place = pose.plain.link(link)
        if pose.has_handle(link) and (place.moved_by or (settings.draws_all and place.frame not in robot.holding)):
            handle = LinkHandle(pose, link)
            yield handle.name, handle if handle.tracked or settings.draws_all else None


#: {topic: the robot that it was about before}.
_FORMER: Dict[str, node.Robot] = {}

#: Asks the master, but no more once there is one.
_description_for = functools.lru_cache(maxsize=None)(node.description_for)


def robot_for(topic: str) -> node.Robot:
    """The robot that a topic is about, one without joints if there is no description of it."""
    try:
        parameter = _description_for(topic)
    except LookupError:
        return node.NO_ROBOT
    description = rospy.get_param_cached(parameter, '')
    return node.robot_in(parameter, description) if description else node.NO_ROBOT
