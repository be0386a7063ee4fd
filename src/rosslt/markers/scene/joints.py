"""Handles on the joints of a robot: a ring for each that turns, a ball that slides for each that slides.

A JointState says how far each joint has turned; where the joints are, `robot_description` says (URDF).
"""

import functools
import math
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import rospy
from sensor_msgs.msg import JointState

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
from rosslt.markers.scene.handle import CanChange, Handle, Motions, Ring, Settings, has_source
from rosslt.markers.scene.marker import COLOR
from rosslt.markers.scene.shapes import sphere

TURNING = ('revolute', 'continuous')
SLIDING = ('prismatic',)


class Joint(NamedTuple):
    """A joint of a robot.

    Attributes:
        parent: the link, and frame, that it is fixed to.
        origin: where it is in that frame, for position 0.
        axis: around or along which it moves, in its own coordinates; of length 1.
        is_turning: whether it turns or slides.
    """

    parent: str
    origin: PoseTuple
    axis: Vector
    is_turning: bool


class JointHandle(Handle):
    """A handle that turns or slides a joint of a robot: a ball on the joint.

    Args:
        name: as that of a Handle.
        joint: where it is.
        value: how far it has turned, in radians, or slid, in metres; tracked.
        size: the diameter of its ball, in metres.
    """

    __slots__ = ('_axis', '_joint', '_start', '_value')

    def __init__(self, name: str, joint: Joint, value: Any, size: float) -> None:
        self._joint, self._value = joint, value
        x, y, z = joint.origin[:3]
        self._start = joint.origin[3:]
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
            x, y, z, w = product(inverse(self._start), pose[3:])
            angle = 2.0 * math.atan2(sum(a * b for a, b in zip((x, y, z), self._joint.axis)), w)
            # The turn nearest the present one: joints turn further than once around.
            present = float(self._value)
            return [self._value], [present + math.remainder(angle - present, 2.0 * math.pi)]
        way = sum((a - b) * c for a, b, c in zip(pose[:3], self._joint.origin[:3], self._axis))
        return [self._value], [way]

    def motions(self, can_change: CanChange) -> Motions:
        """A ring around its axis, or a way along it."""
        is_free = can_change(self._value)
        if self._joint.is_turning:
            return Motions((False, False, False), rings=(Ring('joint', self._axis),) if is_free else ())
        return Motions((is_free, False, False))


def robot_joints() -> Dict[str, Joint]:
    """{name: Joint} of `robot_description`, empty where there is none."""
    text = rospy.get_param_cached('robot_description', '')
    try:
        return read_joints(text) if text else {}
    except (ElementTree.ParseError, ValueError) as error:
        rospy.logerr_throttle(60, 'robot_description cannot be read: %s', error)
        return {}


@functools.lru_cache(maxsize=1)
def read_joints(urdf: str) -> Dict[str, Joint]:
    """The joints of a URDF that turn or slide, by name.

    Raises:
        ElementTree.ParseError, ValueError: it is no URDF.
    """
    found = {}
    for element in ElementTree.fromstring(urdf).iter('joint'):
        kind, parent = element.get('type'), element.find('parent')
        if parent is None or kind not in TURNING + SLIDING:
            continue
        origin, axis = element.find('origin'), element.find('axis')
        x, y, z = _numbers(origin, 'xyz', (0.0, 0.0, 0.0))
        rotation = _roll_pitch_yaw(*_numbers(origin, 'rpy', (0.0, 0.0, 0.0)))
        direction = _numbers(axis, 'xyz', (1.0, 0.0, 0.0))
        length = math.sqrt(sum(part * part for part in direction))
        if length == 0.0:
            raise ValueError('the axis of the joint {} has no direction'.format(element.get('name')))
        a, b, c = (part / length for part in direction)
        found[element.get('name', '')] = Joint(parent.get('link', ''), (x, y, z, *rotation), (a, b, c), kind in TURNING)
    return found


def joint_state(topic: str, message: JointState, settings: Settings) -> Iterator[Tuple[str, Optional[Handle]]]:
    """A JointState: a handle for each joint whose position is tracked."""
    tracked = [(name, value) for name, value in zip(message.name, message.position) if has_source(value)]
    joints = robot_joints() if tracked else {}
    for name, value in tracked:
        key = '{}:{}'.format(topic, name)
        is_there = name in joints and math.isfinite(value)
        yield key, JointHandle(key, joints[name], value, 0.5 * settings.ball_size) if is_there else None


def _numbers(element: Optional[ElementTree.Element], attribute: str, default: Sequence[float]) -> Sequence[float]:
    text = None if element is None else element.get(attribute)
    return default if text is None else [float(part) for part in text.split()]


def _around(axis: Vector, angle: float) -> Rotation:
    x, y, z = (part * math.sin(angle / 2) for part in axis)
    return x, y, z, math.cos(angle / 2)


def _roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Rotation:
    turns = zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (roll, pitch, yaw))
    result = IDENTITY
    for axis, angle in turns:
        result = product(_around(axis, angle), result)
    return result
