"""The joints of robots, as `robot_description` (URDF) has them: where they are, and how far they may move."""

import functools
import math
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import rosgraph.names
import rospy

from rosslt import messages, values

NAME = 'robot_description'
TURNING = ('revolute', 'continuous')
SLIDING = ('prismatic',)

_Triple = Tuple[float, float, float]


class Joint(NamedTuple):
    """A joint of a robot.

    Attributes:
        name: as in a JointState.
        parent: the link, and frame, that it is fixed to.
        position: where it is in that frame, for position 0.
        roll_pitch_yaw: how it is turned in that frame, for position 0.
        axis: around or along which it moves, in its own coordinates; of length 1.
        is_turning: whether it turns or slides.
        lower, upper: its limits, in radians or metres; infinite if there are none.
    """

    name: str
    parent: str
    position: _Triple
    roll_pitch_yaw: _Triple
    axis: _Triple
    is_turning: bool
    lower: float = -math.inf
    upper: float = math.inf

    def kept(self, position: float, present: float) -> float:
        """The nearest allowed position: one within the limits, or, for a joint that is beyond them, on the way back."""
        return min(max(position, min(self.lower, present)), max(self.upper, present))


def description_for(topic: str) -> str:
    """The parameter that describes the robot whose joints a topic tells of.

    It is looked for in the namespace of the topic, then in those around it.

    Args:
        topic: its full name.

    Raises:
        LookupError: there is none.
    """
    namespace = topic
    while namespace != '/':
        namespace = rosgraph.names.namespace(namespace)
        if rospy.has_param(namespace + NAME):
            return str(namespace) + NAME
    raise LookupError(f'there is no {NAME} for {topic}')


def joints_in(parameter: str, description: object) -> Dict[str, Joint]:
    """{name: Joint} of a robot; empty, with an error in the log, if its description cannot be read.

    Args:
        parameter: the name of the parameter.
        description: its value.
    """
    try:
        return read_joints(str(description))
    except (ElementTree.ParseError, ValueError) as error:
        rospy.logerr_throttle(60, f'{parameter} cannot be read: {error}')
        return {}


def check_joint_limits(topic: str, message: messages.Message, path: str, wanted: object) -> None:
    """Check that the target for a part of a message moves no joint beyond its limits.

    Messages of other types than `JointState` tell of no joint.

    Args:
        topic: its full name.
        message: the latest one.
        path: of the part, '' for the message.
        wanted: of the part's shape; None for parts that may have any value.

    Raises:
        values.NotInvertible: it moves one beyond them.
    """
    positions = list(_positions(path, wanted)) if message._type == 'sensor_msgs/JointState' else []
    if not positions:
        return
    try:
        description = description_for(topic)
    except LookupError:
        return
    joints = joints_in(description, rospy.get_param(description))
    for index, position in positions:
        joint = joints.get(message.name[index]) if index < len(message.name) else None
        if joint is None or position is None:
            continue
        kept = joint.kept(position, values.untracked(message.position[index]))
        if kept != position:
            above = 'above' if kept < position else 'below'
            raise values.NotInvertible(
                f'{position!r} is {above} the limits of the joint {joint.name}, '
                f'which are {joint.lower!r} .. {joint.upper!r} in {description}'
            )


@functools.lru_cache
def read_joints(urdf: str) -> Dict[str, Joint]:
    """The joints of a URDF that turn or slide, by name.

    Raises:
        ElementTree.ParseError, ValueError: it is no URDF.
    """
    found = {}
    for element in ElementTree.fromstring(urdf).iter('joint'):
        kind, parent, name = element.get('type'), element.find('parent'), element.get('name', '')
        if parent is None or kind not in TURNING + SLIDING:
            continue
        origin = element.find('origin')
        x, y, z = _numbers(origin, 'xyz', (0.0, 0.0, 0.0))
        roll, pitch, yaw = _numbers(origin, 'rpy', (0.0, 0.0, 0.0))
        direction = _numbers(element.find('axis'), 'xyz', (1.0, 0.0, 0.0))
        length = math.sqrt(sum(part * part for part in direction))
        if length == 0.0:
            raise ValueError(f'the axis of the joint {name} has no direction')
        a, b, c = (part / length for part in direction)
        lower, upper = (-math.inf, math.inf) if kind == 'continuous' else _limits(element)
        if not lower <= upper:
            raise ValueError(f'the lower limit {lower!r} of the joint {name} is above the upper limit {upper!r}')
        found[name] = Joint(
            name, parent.get('link', ''), (x, y, z), (roll, pitch, yaw), (a, b, c), kind in TURNING, lower, upper
        )
    return found


def _limits(joint: ElementTree.Element) -> Tuple[float, float]:
    """The limits of a joint: a bound that its `limit` does not mention is 0; a safety controller may narrow them."""
    lower, upper = -math.inf, math.inf
    limit, safety = joint.find('limit'), joint.find('safety_controller')
    if limit is not None:
        (lower,), (upper,) = _numbers(limit, 'lower', (0.0,)), _numbers(limit, 'upper', (0.0,))
    (soft_lower,) = _numbers(safety, 'soft_lower_limit', (-math.inf,))
    (soft_upper,) = _numbers(safety, 'soft_upper_limit', (math.inf,))
    return max(lower, soft_lower), min(upper, soft_upper)


def _numbers(element: Optional[ElementTree.Element], attribute: str, default: Sequence[float]) -> Sequence[float]:
    text = None if element is None else element.get(attribute)
    return default if text is None else [float(part) for part in text.split()]


def _positions(path: str, wanted: Any) -> Iterator[Tuple[int, Any]]:
    """The indices of the positions in a target for a part of a JointState, each with its target."""
    steps: List[Any] = messages.path_steps(path)
    if not steps and wanted is not None:
        steps, wanted = ['position'], wanted.position
    if steps[:1] == ['position'] and wanted is not None:
        yield from [(steps[1], wanted)] if len(steps) > 1 else enumerate(wanted)
