"""The joints of robots, as `robot_description` (URDF) has them: where they are, how far they may move, and what hangs
on them."""

import functools
import math
from typing import Any, Dict, FrozenSet, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import rosgraph.names
import rospy

from rosslt import messages, values

NAME = 'robot_description'
TURNING = ('revolute', 'continuous')
SLIDING = ('prismatic',)
FIXED = 'fixed'

_Triple = Tuple[float, float, float]


class Mimic(NamedTuple):
    """The position of a joint if it follows another one: that one's times a factor, and a number more."""

    joint: str
    multiplier: float
    offset: float


class Joint(NamedTuple):
    """A joint of a robot.

    Attributes:
        name: as in a JointState.
        parent: the link, and frame, that it is fixed to.
        child: the link that hangs on it.
        position: where it is in the frame of its parent, for position 0.
        roll_pitch_yaw: how it is turned in that frame, for position 0.
        axis: around or along which it moves, in its own coordinates; of length 1.
        is_turning: whether it turns; if not, it slides, or is fixed.
        is_fixed: whether it does not move.
        lower, upper: its limits, in radians or metres; infinite if there are none.
        mimic: what it follows; None if it moves by itself.
    """

    name: str
    parent: str
    child: str
    position: _Triple
    roll_pitch_yaw: _Triple
    axis: _Triple
    is_turning: bool
    is_fixed: bool = False
    lower: float = -math.inf
    upper: float = math.inf
    mimic: Optional[Mimic] = None

    def kept(self, position: float, present: float) -> float:
        """The nearest allowed position: one within the limits, or, for a joint that is beyond them, on the way back."""
        return min(max(position, min(self.lower, present)), max(self.upper, present))


class Shape(NamedTuple):
    """The shape of a part of a link.

    Attributes:
        kind: one of `box`, `cylinder`, `sphere` and `mesh`.
        size: along x, y and z in metres; of a mesh, its scale.
        mesh: where the mesh is, as an address of a package or a file.
        position, roll_pitch_yaw: where it is in the frame of its link.
        color: red, green and blue, from 0 to 1; None if the URDF says none.
    """

    kind: str
    size: _Triple
    mesh: str
    position: _Triple
    roll_pitch_yaw: _Triple
    color: Optional[_Triple]


class Robot(NamedTuple):
    """A robot.

    Attributes:
        joints: {name: Joint} of those that turn or slide.
        holding: {link: the Joint that it hangs on}, fixed ones included.
        shapes: {link: how it looks}, of those that have a shape.
        ends: the links that nothing hangs on.
    """

    joints: Dict[str, Joint]
    holding: Dict[str, Joint]
    shapes: Dict[str, Tuple[Shape, ...]]
    ends: FrozenSet[str]


NO_ROBOT = Robot({}, {}, {}, frozenset())


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


def robot_in(parameter: str, description: object) -> Robot:
    """The robot of a description; one without joints, with an error in the log, if it cannot be read.

    Args:
        parameter: the name of the parameter.
        description: its value.
    """
    try:
        return read_robot(str(description))
    except (ElementTree.ParseError, ValueError) as error:
        rospy.logerr_throttle(60, f'{parameter} cannot be read: {error}')
        return NO_ROBOT


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
    joints = robot_in(description, rospy.get_param(description)).joints
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


def check_number(topic: str, message: messages.Message, path: str, value: float) -> None:
    """Check that a number of a message may have a value.

    Args:
        topic, message, path: where it is.
        value: what it would be.

    Raises:
        ValueError: its type does not hold it.
        values.NotInvertible: it is beyond the limits of a joint.
    """
    part, type_ = messages.part_at(message, path)
    messages.check_range(part, type_, value)
    check_joint_limits(topic, message, path, value)


@functools.lru_cache
def read_robot(urdf: str) -> Robot:
    """The robot of a URDF. Links that hang on a joint of another kind, as a floating one, hang on nothing here.

    Raises:
        ElementTree.ParseError, ValueError: it is no URDF.
    """
    root = ElementTree.fromstring(urdf)
    found = [_joint(element) for element in root.iter('joint') if _is_joint(element)]
    holding: Dict[str, Joint] = {}
    for joint in found:
        other = holding.setdefault(joint.child, joint) if joint.child else joint
        if other is not joint:
            raise ValueError(f'the link {joint.child} hangs on two joints, {other.name} and {joint.name}')
    for link in holding:
        above, on = {link}, holding[link].parent
        while on in holding:
            if on in above:
                raise ValueError(f'the link {on} hangs on itself')
            above.add(on)
            on = holding[on].parent
    parents = {joint.parent for joint in found}
    colors = {_attribute(one, 'name'): color for one in root.iter('material') for color in [_color(one)] if color}
    shapes = {link.get('name', ''): tuple(_shapes(link, colors)) for link in root.iter('link')}
    moving = {joint.name: joint for joint in found if not joint.is_fixed}
    ends = frozenset(link for link in holding if link not in parents)
    return Robot(moving, holding, {link: found for link, found in shapes.items() if found}, ends)


def _is_joint(element: ElementTree.Element) -> bool:
    return element.get('type') in (*TURNING, *SLIDING, FIXED) and element.find('parent') is not None


def _joint(element: ElementTree.Element) -> Joint:
    kind, name = element.get('type'), element.get('name', '')
    parent, child = (_attribute(element.find(which), 'link') for which in ('parent', 'child'))
    origin, mimic = element.find('origin'), element.find('mimic')
    x, y, z = _numbers(origin, 'xyz', (0.0, 0.0, 0.0))
    roll, pitch, yaw = _numbers(origin, 'rpy', (0.0, 0.0, 0.0))
    if not all(map(math.isfinite, (x, y, z, roll, pitch, yaw))):
        raise ValueError(f'the origin of the joint {name} is not finite')
    # exporters write the axis 0, 0, 0 of a fixed joint
    direction = (1.0, 0.0, 0.0) if kind == FIXED else _numbers(element.find('axis'), 'xyz', (1.0, 0.0, 0.0))
    length = math.sqrt(sum(part * part for part in direction))
    if length == 0.0:
        raise ValueError(f'the axis of the joint {name} has no direction')
    a, b, c = (part / length for part in direction)
    lower, upper = (-math.inf, math.inf) if kind in ('continuous', FIXED) else _limits(element)
    if not lower <= upper:
        raise ValueError(f'the lower limit {lower!r} of the joint {name} is above the upper limit {upper!r}')
    follows = None
    if mimic is not None:
        (multiplier,), (offset,) = _numbers(mimic, 'multiplier', (1.0,)), _numbers(mimic, 'offset', (0.0,))
        follows = Mimic(_attribute(mimic, 'joint'), multiplier, offset)
    place = (x, y, z), (roll, pitch, yaw), (a, b, c)
    return Joint(name, parent, child, *place, kind in TURNING, kind == FIXED, lower, upper, follows)


def _shapes(link: ElementTree.Element, colors: Dict[str, _Triple]) -> Iterator[Shape]:
    for visual in link.iter('visual'):
        origin, geometry, material = visual.find('origin'), visual.find('geometry'), visual.find('material')
        form = None if geometry is None else next(iter(geometry), None)
        if form is None:
            continue
        if form.tag == 'sphere':
            (radius,) = _numbers(form, 'radius', (0.0,))
            size = [2.0 * radius] * 3
        elif form.tag == 'cylinder':
            (radius,), (length,) = _numbers(form, 'radius', (0.0,)), _numbers(form, 'length', (0.0,))
            size = [2.0 * radius, 2.0 * radius, length]
        elif form.tag in ('box', 'mesh'):
            size = list(_numbers(form, 'size' if form.tag == 'box' else 'scale', (1.0, 1.0, 1.0)))
        else:
            continue
        color = (_color(material) if material is not None else None) or colors.get(_attribute(material, 'name'))
        (a, b, c), (x, y, z) = size, _numbers(origin, 'xyz', (0.0, 0.0, 0.0))
        roll, pitch, yaw = _numbers(origin, 'rpy', (0.0, 0.0, 0.0))
        yield Shape(form.tag, (a, b, c), _attribute(form, 'filename'), (x, y, z), (roll, pitch, yaw), color)


def _color(material: ElementTree.Element) -> Optional[_Triple]:
    color = material.find('color')
    if color is None:
        return None
    red, green, blue, *_ = _numbers(color, 'rgba', (0.5, 0.5, 0.5, 1.0))
    return red, green, blue


def _attribute(element: Optional[ElementTree.Element], name: str) -> str:
    return '' if element is None else element.get(name, '')


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
