"""Handles on the joints of a robot: a ring for each that turns, a ball that slides for each that slides.

A JointState says how far each joint has turned; where the joints are, `robot_description` says (URDF).
"""

import functools
import math
from typing import Any, Dict, Iterator, List, Optional, Tuple

import rospy
from sensor_msgs.msg import JointState

from rosslt import node, values
from rosslt.markers.geometry import (
    IDENTITY,
    PoseTuple,
    Rotation,
    Vector,
    inverse,
    normalized,
    onto,
    product,
    rotate_vector,
)
from rosslt.markers.scene.handle import CanChange, Handle, Motions, RankOf, Ring, Settings, has_source
from rosslt.markers.scene.marker import COLOR
from rosslt.markers.scene.shapes import sphere


class JointHandle(Handle):
    """A handle that turns or slides a joint of a robot: a ball on the joint.

    Args:
        name: as that of a Handle.
        joint: where it is.
        value: how far it has turned, in radians, or slid, in metres; tracked.
        size: the diameter of its ball, in metres.
    """

    __slots__ = ('_axis', '_joint', '_start', '_value')

    def __init__(self, name: str, joint: node.Joint, value: Any, size: float) -> None:
        self._joint, self._value = joint, value
        x, y, z = joint.position
        self._start = _rotation(*joint.roll_pitch_yaw)
        self._axis = rotate_vector(self._start, joint.axis)
        if joint.is_turning:
            rotation = product(self._start, _around(joint.axis, float(value)))
        else:
            # Its x axis, along which the ball moves, lies along that of the joint.
            rotation = product(self._start, onto(joint.axis))
            x, y, z = (a + float(value) * b for a, b in zip((x, y, z), self._axis))
        pose = x, y, z, *normalized(*rotation)
        super().__init__(
            name, joint.parent, pose, 2.5 * size, (joint, size), [value], lambda: [sphere(size, COLOR)], rank=2
        )

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The target of a drag to a pose."""
        if not (turned if self._joint.is_turning else moved):
            return [], []
        if self._joint.is_turning:
            return [self._value], [self.turn(pose, float(self._value))]
        way = sum((a - b) * c for a, b, c in zip(pose[:3], self._joint.position, self._axis))
        return [self._value], [way]

    def turn(self, pose: PoseTuple, near: Optional[float] = None) -> float:
        """How far a joint that turns has turned at a pose."""
        if not self._joint.is_turning:
            return 0.0
        x, y, z, w = product(inverse(self._start), pose[3:])
        angle = 2.0 * math.atan2(sum(a * b for a, b in zip((x, y, z), self._joint.axis)), w)
        near = float(self._value) if near is None else near
        return near + math.remainder(angle - near, 2.0 * math.pi)

    def limited(self, targets: List[float], turn: float) -> Tuple[List[float], str]:
        """The target within the limits of the joint, and which limit stops it."""
        joint, wanted = self._joint, turn if self._joint.is_turning else targets[0]
        kept = joint.kept(wanted, float(self._value))
        if kept == wanted:
            return [wanted], ''
        word, limit = ('maximum', joint.upper) if kept < wanted else ('minimum', joint.lower)
        where = 'at' if values.is_same(kept, limit) else 'beyond'
        return [kept], f'{joint.name} is {where} its {word} {limit!r} in robot_description'

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """A ring around its axis, or a way along it."""
        del rank_of
        is_free = can_change(self._value)
        if self._joint.is_turning:
            return Motions((False, False, False), rings=(Ring('joint', self._axis),) if is_free else ())
        return Motions((is_free, False, False))


def joint_state(topic: str, message: JointState, settings: Settings) -> Iterator[Tuple[str, Optional[Handle]]]:
    """A JointState: a handle for each joint whose position is tracked."""
    tracked = [(name, value) for name, value in zip(message.name, message.position) if has_source(value)]
    joints = _joints_for(topic) if tracked else {}
    for name, value in tracked:
        key = '{}:{}'.format(topic, name)
        is_there = name in joints and math.isfinite(value)
        yield key, JointHandle(key, joints[name], value, 0.5 * settings.ball_size) if is_there else None


#: Asks the master, but no more once there is one.
_description_for = functools.lru_cache(maxsize=None)(node.description_for)


def _joints_for(topic: str) -> Dict[str, node.Joint]:
    """{name: Joint} of the robot that a topic is about, empty if there is no description of it."""
    try:
        parameter = _description_for(topic)
    except LookupError:
        return {}
    description = rospy.get_param_cached(parameter, '')
    return node.joints_in(parameter, description) if description else {}


def _around(axis: Vector, angle: float) -> Rotation:
    x, y, z = (part * math.sin(angle / 2) for part in axis)
    return x, y, z, math.cos(angle / 2)


def _rotation(roll: float, pitch: float, yaw: float) -> Rotation:
    turns = zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (roll, pitch, yaw))
    result = IDENTITY
    for axis, angle in turns:
        result = product(_around(axis, angle), result)
    return result
