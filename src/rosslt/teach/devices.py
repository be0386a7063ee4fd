"""Devices: when the hand holds, and by how much it moves from one message to the next.

To add a type of device, add a class and a row to the table DEVICES.
"""

import contextlib
import math
import time
from typing import Any, Callable, Dict, FrozenSet, List, NamedTuple, Optional, Sequence, Tuple, Type

import genpy
import rosgraph
import roslib.message
import rospy
import tf2_ros
from geometry_msgs.msg import Point, Pose, PoseStamped
from tf2_msgs.msg import TFMessage

from rosslt import messages, values
from rosslt.markers import geometry
from rosslt.markers.geometry import Vector
from rosslt.teach.turning import rotation_vector, scaled

#: The deflection of a stick below which it is at rest, of 1.
DEAD_ZONE = 0.1

#: The period in which the master is asked for a device that is not there yet, in seconds.
PERIOD = 0.2

#: What a device may move: along the axes of the frame that the thing is in, and around them.
WAYS = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')

#: What the name of a device begins with that is a frame of tf.
TF = 'tf:'

#: The type of the messages of joints, and the field of it that stands for it.
JOINTS, POSITION = 'sensor_msgs/JointState', 'position'

STILL: Vector = (0.0, 0.0, 0.0)

#: The least difference that a hand can make, in the unit of the device: metres, radians, or that of a knob.
RESOLUTION = 1e-3


class NotTaught(values.Error):
    """There is no such thing or device, or they do not fit together."""


class Unusable(Exception):
    """A message that moves nothing; the text says why."""


class Options(NamedTuple):
    """The options that a user has chosen for a device.

    Attributes:
        axes: the numbers of the axes of a Joy that are x, y and z; the first one turns a number.
        speed: that of a Joy whose stick is pushed as far as it goes, in metres per second; of numbers, in their units.
        deadman: the number of the button of a Joy that is pressed as long as the hand holds.
        max_step: how far a device may move, or turn, a thing from one message to the next, in metres and radians, or
            the unit of a knob, before it is scaled.
        turn: the numbers of the axes of a Joy that are roll, pitch and yaw; empty if it turns nothing.
        turn_speed: that of a Joy whose stick is pushed as far as it goes, in radians per second.
        expo: how much of the deflection of a stick is its third power, from 0 to 1.
        smooth: the time constant of the filter for poses at rest, in seconds; 0 for none.
        only: what the device may move, of WAYS.
        scale: how many metres the thing moves by, for one of the device; of numbers, in their units.
        snap: of what the coordinates of the thing, or the numbers, are multiples, in metres or their units; 0 for any.
        reference: the frame that the pose of a frame of tf is in; '' for the one that the thing is in.
        joints: the names of joints that a JointState may move; none for all.
    """

    axes: Tuple[int, ...] = (0, 1, 2)
    speed: float = 0.5
    deadman: int = 0
    max_step: float = 0.1
    turn: Tuple[int, ...] = ()
    turn_speed: float = 0.5
    expo: float = 0.0
    smooth: float = 15.0
    only: FrozenSet[str] = frozenset(WAYS)
    scale: float = 1.0
    snap: float = 0.0
    reference: str = ''
    joints: FrozenSet[str] = frozenset()


class Step(NamedTuple):
    """A movement.

    Attributes:
        move: in metres.
        turn: the axis of a rotation, as long as its angle in radians.
    """

    move: Vector
    turn: Vector = STILL


class Device:
    """A device, by the type of its messages.

    Args:
        options: what a user has chosen for it.
    """

    #: Whether it can turn things.
    turns = False

    #: Whether it is in a hand that trembles.
    trembles = False

    def __init__(self, options: Options) -> None:
        self._options = options

    def read(self, message: genpy.Message) -> Optional[genpy.Message]:
        """Read a message of the topic; None if it says nothing new of the device."""
        return message

    def holds(self, message: genpy.Message) -> bool:
        """Return whether the hand holds."""
        raise NotImplementedError

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """All numbers that a step is made of.

        Raises:
            Unusable: the message does not have them.
        """
        raise NotImplementedError

    def step(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Step:
        """The movement from one message to the next, so many seconds later.

        Raises:
            Unusable: they do not say it.
        """
        raise NotImplementedError


class Joystick(Device):
    """A sensor_msgs/Joy: how far a stick is pushed is a velocity, and a button that is pressed holds."""

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self.turns = bool(options.turn)

    def holds(self, message: genpy.Message) -> bool:
        """Return whether the button is pressed; one that the joystick does not have is not."""
        return any(message.buttons[self._options.deadman : self._options.deadman + 1])

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """The deflections of the axes that move, and of those that turn."""
        axes = (*self._options.axes, *self._options.turn)
        for axis in axes:
            if axis >= len(message.axes):
                raise Unusable(f'it has {len(message.axes)} axes, and no axis {axis}')
        return [message.axes[axis] for axis in axes]

    def step(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Step:
        """Multiply what the deflections count by the speeds and the time."""
        x, y, z, *turn = map(self.counted, self.numbers(now))
        roll, pitch, yaw = turn or STILL
        return Step(
            scaled((x, y, z), self._options.speed * seconds),
            scaled((roll, pitch, yaw), self._options.turn_speed * seconds),
        )

    def counted(self, deflection: float) -> float:
        """Count a deflection: none near the middle, from there on as much as it exceeds it, and 1 at the stop."""
        beyond = math.copysign(max(abs(deflection) - DEAD_ZONE, 0.0) / (1.0 - DEAD_ZONE), deflection)
        return (1.0 - self._options.expo) * beyond + self._options.expo * beyond**3


class Numbers(Device):
    """A device whose numbers move as many others, which go as its own go; the hand holds as long as messages come."""

    trembles = True

    #: The path of the field that has its numbers.
    path = ''

    def holds(self, message: genpy.Message) -> bool:
        """Return True: each message says where the hand is."""
        return True

    @property
    def resolution(self) -> float:
        """The least difference that a hand can make, in the unit of what it moves."""
        return RESOLUTION * self._options.scale

    def ways(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Sequence[float]:
        """How far each number goes from one message to the next, so many seconds later; raises as `numbers` does."""
        del seconds
        return [b - a for a, b in zip(self.numbers(before), self.numbers(now))]


class Stick(Numbers):
    """An axis of a sensor_msgs/Joy that moves one number: its deflection is a velocity, and a pressed button holds."""

    trembles = False

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._joystick = Joystick(options._replace(axes=options.axes[:1], turn=()))

    def holds(self, message: genpy.Message) -> bool:
        """Return whether the button is pressed."""
        return self._joystick.holds(message)

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """The deflection of the axis."""
        return self._joystick.numbers(message)

    def ways(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Sequence[float]:
        """Multiply what the deflection counts by the speed and the time."""
        (deflection,) = self.numbers(now)
        return [self._joystick.counted(deflection) * self._options.speed * seconds]


class Knob(Numbers):
    """A number in messages of any type.

    Args:
        path: of the number in its messages.
        options: what a user has chosen for it.
    """

    def __init__(self, path: str, options: Options) -> None:
        super().__init__(options)
        self.path = path

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """The number."""
        try:
            part, type_ = messages.part_at(message, self.path)
        except (messages.NoSuchPart, ValueError) as error:
            raise Unusable(str(error)) from None
        if not is_number(part):
            raise Unusable(f'{self.path} is a {type_}, and no number')
        return [float(part)]


class Joints(Numbers):
    """A sensor_msgs/JointState: each joint moves the one of the same name, by its position.

    Attributes:
        names: of the joints that it moves; messages that lack one of them say nothing of the device.
    """

    path = POSITION

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self.names: Sequence[str] = ()

    def may_move(self, name: str) -> bool:
        """Return whether a user lets it move a joint of that name."""
        return not self._options.joints or name in self._options.joints

    def read(self, message: genpy.Message) -> Optional[genpy.Message]:
        """The message; None if another publisher sends it, of other joints."""
        return message if set(self.names) <= set(message.name) else None

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """The positions of the joints."""
        if len(message.position) != len(message.name):
            raise Unusable(f'it has {len(message.name)} names, and {len(message.position)} positions')
        positions = dict(zip(message.name, message.position))
        return [positions[name] for name in self.names]


class Velocity(Device):
    """A geometry_msgs/Twist: one that is not zero holds."""

    turns = True

    def holds(self, message: genpy.Message) -> bool:
        """Return whether it is a movement."""
        return any(self.numbers(message))

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """Both velocities."""
        return [*_vector(message.linear), *_vector(message.angular)]

    def step(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Step:
        """The velocity times the time."""
        return Step(scaled(_vector(now.linear), seconds), scaled(_vector(now.angular), seconds))


class Tracker(Device):
    """A geometry_msgs/PoseStamped: the hand goes as the pose goes, and holds as long as messages come."""

    turns = True
    trembles = True

    def holds(self, message: genpy.Message) -> bool:
        """Return True: each message says where the hand is."""
        return True

    def numbers(self, message: genpy.Message) -> Sequence[float]:
        """The pose."""
        pose = message.pose
        return [*_vector(pose.position), *_vector(pose.orientation), pose.orientation.w]

    def step(self, before: genpy.Message, now: genpy.Message, seconds: float) -> Step:
        """The difference of the poses."""
        if before.header.frame_id != now.header.frame_id:
            raise Unusable(f'it comes in the frame {now.header.frame_id!r} instead of {before.header.frame_id!r}')
        start, end = self.numbers(before), self.numbers(now)
        x, y, z = (b - a for a, b in zip(start[:3], end[:3]))
        turn = geometry.product(_rotation(end), geometry.inverse(_rotation(start)))
        return Step((x, y, z), rotation_vector(turn))


class Frame(Tracker):
    """A frame of tf: the hand goes as its pose in the frame of reference does, and holds as long as newer ones come.

    tf2's own buffer looks them up, as provenance is of no use here. It gets what moves as the hand does, one message
    after the other, so that no step is left out.

    Args:
        frame: its name.
        options: what the user has chosen for it.
    """

    def __init__(self, frame: str, options: Options) -> None:
        super().__init__(options)
        self._frame, self._reference = frame, options.reference.lstrip('/')
        self._buffer, self._newest = tf2_ros.BufferCore(), rospy.Time()

    def begin(self, reference: str, timeout: float) -> None:
        """Wait for the frame.

        Args:
            reference: the frame of reference, unless the user has chosen one.
            timeout: how long to wait, in seconds.

        Raises:
            NotTaught: tf does not have it.
        """
        self._reference = self._reference or reference.lstrip('/')
        rospy.Subscriber('/tf_static', TFMessage, self._keep, self._buffer.set_transform_static)
        moving = rospy.Subscriber('/tf', TFMessage, self._keep, self._buffer.set_transform)
        end = time.monotonic() + timeout
        try:
            while not rospy.is_shutdown():
                with contextlib.suppress(tf2_ros.TransformException):
                    self._look_up()
                    break
                if time.monotonic() > end:
                    raise NotTaught(f'tf has no pose of {self._frame} in {self._reference}')
                time.sleep(PERIOD)
        finally:
            moving.unregister()

    def read(self, message: genpy.Message) -> Optional[genpy.Message]:
        """The newest pose of the frame, after a message of tf; None if it was read before, or never changes."""
        self._keep(message, self._buffer.set_transform)
        try:
            found = self._look_up()
        except tf2_ros.TransformException:
            return None
        if found.header.stamp == self._newest:
            return None
        self._newest = found.header.stamp
        move, turn = found.transform.translation, found.transform.rotation
        return PoseStamped(found.header, Pose(Point(move.x, move.y, move.z), turn))

    def _keep(self, message: genpy.Message, add: Callable[[genpy.Message, str], None]) -> None:
        for transform in message.transforms:
            add(transform, '')

    def _look_up(self) -> Any:
        return self._buffer.lookup_transform_core(self._reference, self._frame, rospy.Time())


#: The class for each type of message that a device may send.
DEVICES: Dict[str, Type[Device]] = {
    'geometry_msgs/PoseStamped': Tracker,
    'geometry_msgs/Twist': Velocity,
    JOINTS: Joints,
    'sensor_msgs/Joy': Joystick,
}


def device(name: str, options: Options, timeout: float) -> Tuple[Device, str, Type[genpy.Message]]:
    """A device, the topic that it sends on, and the class of its messages.

    Args:
        name: the full name of its topic, with the path of a field for a knob; or TF and a frame.
        options: what the user has chosen.
        timeout: how long to wait for somebody to send there, in seconds.

    Raises:
        NotTaught: there is none, or it is of a type that no device has.
    """
    if name.startswith(TF):
        return Frame(name[len(TF) :].lstrip('/'), options), '/tf', TFMessage
    master, end = rosgraph.Master('/rosslt_teach'), time.monotonic() + timeout
    while True:
        types = {topic: kind for topic, kind in master.getPublishedTopics('/') if kind != '*'}
        topic = messages.topic_in(name, types)
        if topic is not None or time.monotonic() > end:
            break
        time.sleep(PERIOD)
    if topic is None:
        there = sorted(topic for topic, kind in types.items() if kind in DEVICES)
        raise NotTaught(f'nobody publishes {name}; of types that a device has, there are: ' + _list(there))
    kind, path = types[topic], name[len(topic) :].strip('/.')
    message_class = roslib.message.get_message_class(kind)
    if message_class is None:
        raise NotTaught(f'{topic} has the type {kind}, which is not installed here')
    if path and (kind, path) != (JOINTS, POSITION):
        return Knob(path, options), topic, message_class
    if kind not in DEVICES:
        raise NotTaught(
            f'{name} is a {kind}, and no device; devices are: {_list(sorted(DEVICES))}, and any number, as {name}/FIELD'
        )
    return DEVICES[kind](options), topic, message_class


def is_number(part: Any) -> bool:
    """Return whether a part of a message is a number."""
    return isinstance(values.untracked(part), (int, float)) and not isinstance(values.untracked(part), bool)


def _rotation(numbers: Sequence[float]) -> geometry.Rotation:
    return geometry.normalized(numbers[3], numbers[4], numbers[5], numbers[6])


def _vector(part: Any) -> Vector:
    return part.x, part.y, part.z


def _list(names: List[str]) -> str:
    return ', '.join(names) or 'none'
