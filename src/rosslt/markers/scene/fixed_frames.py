"""Handles on the fixed frames of robots whose numbers `rosslt launch` owns: `robot_state_publisher`, which nobody
tracks, sends them, and is started again when the `<origin>` of a fixed joint has changed.

What it does is known: a frame is where the `<origin>` has it. That counts only if the transform that it has sent agrees
with the text of the robot.
"""

import functools
import json
import math
import threading
from typing import Any, Collection, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from rosslt import files, node, values
from rosslt.markers.geometry import AXES, PoseTuple, Rotation, Vector, are_same_rotation, normalized
from rosslt.markers.scene.handle import Axes, CanChange, Handle, Motions, RankOf, Ring, Settings, has_source
from rosslt.markers.scene.handles import tracked_targets
from rosslt.markers.scene.kinematics import turned
from rosslt.markers.scene.marker import COLOR
from rosslt.markers.scene.rotations import SMALL, is_upright
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.shapes import axes, sphere

#: The size of the ball relative to that on a pose: the ball on a link, which may be at the same place, is larger, and
#: the axes stand out of that.
BALL = 0.5

#: The width of the axes, in metres.
LINE_WIDTH = 0.01

#: The difference of quaternions that the formulas of `robot_state_publisher` make, of their product from 1.
ROUNDING = 1e-12

#: As `handle.rank`: it gives way to a marker at the same position.
RANK = 2

_LISTING = '/rosslt/list_locations'


class FixedFrameHandle(Handle):
    """A frame that is fixed to another one, moved by the numbers of an `<origin>`.

    Args:
        name: as that of a Handle.
        frame: the one that it is fixed to.
        rotation: how it is turned in that.
        position: x, y and z, tracked if they can be changed.
        roll_pitch_yaw: the angles of the `<origin>`, in radians, all tracked or none.
        settings: those of all handles.
    """

    __slots__ = ('_roll_pitch_yaw', '_settings', 'position')
    position: Tuple[Any, ...]
    takes_restart = True

    def __init__(
        self,
        name: str,
        frame: str,
        rotation: Rotation,
        position: Sequence[Any],
        roll_pitch_yaw: Sequence[Any],
        settings: Settings,
    ) -> None:
        self.position, self._roll_pitch_yaw, self._settings = tuple(position), tuple(roll_pitch_yaw), settings
        x, y, z = map(float, position)
        numbers, ball = [*position, *roll_pitch_yaw], BALL * settings.ball_size
        draw_key = frame, ball, tuple(map(has_source, numbers))
        shapes = functools.partial(_shapes, ball, 2.0 * settings.ball_size)
        super().__init__(name, frame, (x, y, z, *rotation), 2.5 * ball, draw_key, numbers, shapes, RANK)

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The targets of a drag to a pose."""
        pairs: List[Tuple[Any, float]] = []
        if moved:
            pairs += zip(self.position, pose[: 2 if self._settings.is_planar else 3])
        if turned:
            x, y, z, w = pose[3:]
            roll, pitch, yaw = map(float, self._roll_pitch_yaw)
            pairs += zip(self._roll_pitch_yaw, roll_pitch_yaw_of((x, y, z, w), (roll, pitch, yaw)))
        return tracked_targets(pairs)

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which its numbers move it; they are changed although that takes a restart."""
        del can_change, rank_of
        x, y, z = map(has_source, self.position)
        ways: Axes = (x, y, z and not self._settings.is_planar)
        rings = tuple([Ring(name, axis) for name, axis in zip('xyz', AXES)])
        if not all(map(has_source, self._roll_pitch_yaw)):
            rings = ()
        if self._settings.is_planar:
            rings = tuple([ring for ring in rings if is_upright(ring, self.pose[3:])])
        return Motions(ways, is_in_frame=True, arrows=ways, rings=rings)


def _shapes(ball: float, length: float) -> List[Any]:
    return [sphere(ball, COLOR), axes(length, LINE_WIDTH)]


def roll_pitch_yaw_of(rotation: Rotation, near: Vector) -> Vector:
    """The angles of a URDF's `rpy` that give a rotation, in radians.

    Of all that do, those nearest to others: the same rotation has another pitch on the other side of the vertical, and,
    if the pitch is a right angle, any roll.

    Args:
        rotation: a quaternion (x, y, z, w) of length 1.
        near: roll, pitch and yaw.
    """
    x, y, z, w = rotation
    down, up = math.hypot(x + z, w - y), math.hypot(z - x, w + y)
    # half of yaw and roll together, and of their difference
    both, apart = math.atan2(x + z, w - y), math.atan2(z - x, w + y)
    present_both, present_apart = 0.5 * (near[2] + near[0]), 0.5 * (near[2] - near[0])
    if down < SMALL:
        both, apart = present_both, present_apart + math.remainder(apart - present_apart, math.pi)
    elif up < SMALL:
        both, apart = present_both + math.remainder(both - present_both, math.pi), present_apart
    pitch = 2.0 * math.atan2(up, down) - 0.5 * math.pi
    roll, yaw = both - apart, both + apart
    ways = (roll, pitch, yaw), (roll + math.pi, math.pi - pitch, yaw + math.pi)
    found = [
        tuple([here + math.remainder(angle - here, 2.0 * math.pi) for angle, here in zip(way, near)]) for way in ways
    ]
    roll, pitch, yaw = min(found, key=lambda one: math.dist(one, near))
    return roll, pitch, yaw


class _Frame(NamedTuple):
    """A transform that a publisher has sent.

    Attributes:
        topic: where.
        transform: the message.
    """

    topic: str
    transform: TransformStamped


class FixedFrames:
    """Shows a handle on each fixed frame whose numbers are known.

    Args:
        scene: shows the handles.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._heard: Dict[str, Dict[str, _Frame]] = {}  # by the frame, and by who has sent it
        # By the frame: on which topic its handle is shown, and what that was made of.
        self._shown: Dict[str, Tuple[str, Tuple[Any, ...]]] = {}
        self._launches: List[str] = []
        self._robots: Dict[str, List[str]] = {}  # of those who send frames: the parameters that they have read
        self._lock = threading.Lock()  # messages come while the master is looked at

    def look(self, services: Sequence[str]) -> None:
        """Take in which robots have numbers that can be changed.

        Args:
            services: the names of all.
        """
        launches = [name[: -len(_LISTING)] for name in services if name.endswith(_LISTING)]
        launches = [name for name in launches if name.rpartition('/')[2].startswith(node.LAUNCH + '_')]
        if not launches and not self._launches:
            return
        robots = _robots_read(json.loads(str(rospy.get_param_cached(files.ORIGINS, '{}')))) if launches else {}
        with self._lock:
            self._launches, self._robots = launches, robots
            for frame in list(self._heard):
                self._show(frame)

    def take(self, heard: node.Heard) -> None:
        """Note the frames in a message; of those that are sent again and again, only those of robots."""
        if heard.message._type != TFMessage._type:
            return
        if not heard.topic.endswith('tf_static') and heard.publisher not in self._robots:
            return
        with self._lock:
            for transform in heard.message.transforms:
                frame = transform.child_frame_id.lstrip('/')
                self._heard.setdefault(frame, {})[heard.publisher] = _Frame(heard.topic, transform)
                self._show(frame)

    def keep_publishers(self, topic: str, publishers: Collection[str]) -> None:
        """Forget what others than these have sent on a topic."""
        with self._lock:
            for frame, found in list(self._heard.items()):
                gone = [name for name, one in found.items() if one.topic == topic and name not in publishers]
                for name in gone:
                    del found[name]
                if gone:
                    self._shown.pop(frame, None)
                    self._show(frame)
                if not found:
                    del self._heard[frame]

    def _show(self, frame: str) -> None:
        """Show a handle on a frame, or none any more. One that a hand holds, or has dropped, waits for the next
        message."""
        found = self._heard[frame]
        known = [name for name in found if name in self._robots]
        if not known and frame not in self._shown:
            return
        topic, before = self._shown.get(frame, (next(iter(found.values())).topic, None))
        publisher = ''
        basis: Tuple[Any, ...] = ()
        handle: Optional[FixedFrameHandle] = None
        if len(found) == 1 and known:
            (publisher,), (one,) = found, found.values()
            texts = {name: str(rospy.get_param_cached(name, '')) for name in self._robots[publisher]}
            origins = [self._origin_of(name, text, one.transform) for name, text in texts.items()]
            certain = [origin for origin in origins if origin is not None]
            basis = one.transform, texts, [origin.owner for origin in certain]
            if len(certain) == 1 and basis != before:
                topic, handle = one.topic, self._handle(one, certain[0])
        if basis != before and self._scene.show_frame(topic, frame, handle, publisher):
            self._shown[frame] = topic, basis

    def _handle(self, one: _Frame, origin: '_Origin') -> FixedFrameHandle:
        sent = one.transform.transform.rotation
        rotation = normalized(*map(float, (sent.x, sent.y, sent.z, sent.w)))
        name = f'{one.topic}:{one.transform.child_frame_id}'
        settings, parent = self._scene.settings, one.transform.header.frame_id
        return FixedFrameHandle(name, parent, rotation, origin.position, origin.roll_pitch_yaw, settings)

    def _origin_of(self, parameter: str, text: str, transform: TransformStamped) -> Optional['_Origin']:
        """The numbers that a transform comes from; None if that is not certain, or if there are none."""
        joints = list(_joints_of(node.robot_in(parameter, text), transform)) if text else []
        if len(joints) != 1 or not _agrees(joints[0], transform):
            return None
        (joint,) = joints
        names = {(attribute, index): f'{joint.name}/{attribute}/{index}' for attribute in _ATTRIBUTES for index in _ALL}
        numbers = _numbers_in(text)
        given = {key: name for key, name in names.items() if name in numbers}
        if any(numbers[name] != _number_of(joint, *key) for key, name in given.items()):
            return None
        ids = [node.location_id(f'{parameter}/{name}') for name in given.values()]
        owners = [one for one in self._launches if ids and self._owns(one, ids)]
        if len(owners) != 1:
            return None
        tracked = {
            key: values.track(numbers[name], values.Source(owners[0], one))
            for (key, name), one in zip(given.items(), ids)
        }
        position, angles = (
            [tracked.get((one, index), _number_of(joint, one, index)) for index in _ALL] for one in _ATTRIBUTES
        )
        return _Origin(owners[0], position, angles)

    @staticmethod
    def _owns(owner: str, ids: Sequence[int]) -> bool:
        """Return whether a node has all of some locations, as far as it is known; it is asked if it is not."""
        sources = [values.Source(owner, one) for one in ids]
        node.directory().look_up(sources)
        return all(node.directory().of(source) for source in sources)


class _Origin(NamedTuple):
    """The numbers of an `<origin>`, tracked if the text says them.

    Attributes:
        owner: the node that changes them.
        position: x, y and z, in metres.
        roll_pitch_yaw: the angles, in radians.
    """

    owner: str
    position: List[Any]
    roll_pitch_yaw: List[Any]


_ATTRIBUTES, _ALL = ('xyz', 'rpy'), (0, 1, 2)


def _number_of(joint: node.Joint, attribute: str, index: int) -> float:
    return (joint.position if attribute == 'xyz' else joint.roll_pitch_yaw)[index]


def _robots_read(origins: Mapping[str, Mapping[str, Any]]) -> Dict[str, List[str]]:
    """{node that sends frames: the parameters whose robot it has read}, as `rosslt launch` has noted it."""
    found: Dict[str, List[str]] = {}
    for parameter, origin in origins.items():
        for publisher in origin.get('publishers', ()):
            found.setdefault(publisher, []).append(parameter)
    return found


def _joints_of(robot: node.Robot, transform: TransformStamped) -> Iterator[node.Joint]:
    """The fixed joints that a transform can be, with any `tf_prefix` in front of both frames."""
    parent, child = transform.header.frame_id.lstrip('/'), transform.child_frame_id.lstrip('/')
    words = child.split('/')
    for count in range(len(words)):
        prefix = ''.join(f'{word}/' for word in words[:count])
        joint = robot.holding.get(child[len(prefix) :])
        if joint is not None and joint.is_fixed and parent == prefix + joint.parent:
            yield joint


def _agrees(joint: node.Joint, transform: TransformStamped) -> bool:
    """Return whether a transform is the `<origin>` of a joint."""
    there, turn = transform.transform.translation, transform.transform.rotation
    is_there = all(values.is_same(one, other) for one, other in zip((there.x, there.y, there.z), joint.position))
    rotation = normalized(*map(float, (turn.x, turn.y, turn.z, turn.w)))
    return is_there and are_same_rotation(rotation, turned(joint.roll_pitch_yaw), ROUNDING)


@functools.lru_cache(maxsize=8)
def _numbers_in(text: str) -> Dict[str, float]:
    """{name: number} of a URDF; none if it cannot be changed."""
    try:
        return {one.name: one.value for one in files.urdf_numbers(text.encode('utf-8'))}
    except ValueError:
        return {}
