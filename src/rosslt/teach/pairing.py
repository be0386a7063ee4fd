"""Pairing: which number of a field is to become which number of another one.

Numbers go to those of the same name: x to x, and the position of a joint to that of the joint. An array without names
goes to one of the same length.
"""

from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy

from rosslt import messages, node, values
from rosslt.node import Heard
from rosslt.teach.devices import JOINTS, POSITION, NotTaught, is_number

#: The types of parts of a message that say when and where it was made.
ABOUT = ('std_msgs/Header', 'Header', 'time', 'duration')

QUATERNION = 'geometry_msgs/Quaternion'

#: Names of what joints have beside positions.
OTHERS = ('velocity', 'velocities', 'acceleration', 'accelerations', 'effort', 'efforts')

#: The most names that a text gives.
MOST = 5


class Field(NamedTuple):
    """A field of a topic, a joint of it, or a location.

    Attributes:
        topic: its full name; NODE#ID of a location, which no topic is called.
        path: of the field in its messages; '' for the whole message.
        joint: the name of the joint of a JointState that is meant; '' for all.
        place: of the location; None for a topic.
    """

    topic: str
    path: str
    joint: str = ''
    place: Optional[node.Place] = None

    @classmethod
    def of_location(cls, place: node.Place) -> 'Field':
        """A location, as the field of the messages that a LocationReader makes of it."""
        return cls(str(place.source), 'data', place=place)

    @property
    def name(self) -> str:
        """The field as people write it."""
        if self.place is not None:
            return self.place.name
        return self.topic + (f':{self.joint}' if self.joint else f'/{self.path}' if self.path else '')

    def shown(self, path: str) -> str:
        """A part of its messages as people write it."""
        return self.name if self.place is not None else f'{self.topic}/{path.replace(".", "/")}'


class NotYet(NotTaught):
    """The messages so far do not suffice; later ones may."""


class Pair(NamedTuple):
    """A number that is to become another one.

    Attributes:
        path: of the number in its message.
        name: what it is called in texts.
        number: the one that was measured.
    """

    path: str
    name: str
    number: float


def paired(wanted: Field, heard: Heard, measured: Field, others: Sequence[Heard]) -> Tuple[List[Pair], List[str]]:
    """The numbers of a field, each with the one that was measured, and what is left out.

    Args:
        wanted, heard: the field that is to change, and a message of its topic.
        measured, others: the field that it is to become, and the latest messages of its topic: that of each of its
            publishers, and of each set of joints.

    Raises:
        NotTaught: they do not fit together.
        NotYet: no joint is in both, or a number is not finite, so far.
    """
    part, type_, path = meant_part(wanted, heard.message)
    for field, message, other in ((wanted, heard.message, measured), (measured, others[0].message, wanted)):
        last = other.path.split('/')[-1].split('.')[-1].partition('[')[0]
        if message._type == JOINTS and not field.path and last in OTHERS:
            raise NotTaught(f'{field.topic} stands for its positions, and {other.name} is none: name a field of it')
    with_names = [one for one in others if joint_names(one.message, part_of(measured, one.message)[2])]
    if wanted.joint and not measured.joint and with_names and part_of(measured, with_names[0].message)[1].endswith(']'):
        measured = measured._replace(joint=wanted.joint)
    if measured.joint:
        others = _with_joint(measured, with_names)
    names = joint_names(heard.message, path)
    if names and type_.endswith(']') and with_names and not measured.joint:
        pairs, left_out = _of_joints(wanted, names, part, path, measured, with_names)
    else:
        pairs, left_out = _by_name(wanted, part, type_, path, heard.message, measured, others), []
    return [_as_held(pair, heard.message) for pair in pairs], left_out


def _with_joint(measured: Field, others: Sequence[Heard]) -> List[Heard]:
    """The message that has the joint that is meant."""
    found = {one.publisher: one for one in others if measured.joint in _joints_of(measured, one.message)}
    if not found:
        heard = [name for one in others for name in _joints_of(measured, one.message)]
        raise NotYet(no_joint(measured, heard, ' that was heard in the last second'))
    if len(found) > 1:
        raise NotTaught(f'{" and ".join(sorted(found))} both send the joint {measured.joint} on {measured.topic}')
    return list(found.values())


def _of_joints(
    wanted: Field, names: Sequence[str], part: Sequence[Any], path: str, measured: Field, others: Sequence[Heard]
) -> Tuple[List[Pair], List[str]]:
    found: Dict[str, Tuple[float, str]] = {}
    for one in others:
        array, type_, at = part_of(measured, one.message)
        if not type_.endswith(']'):
            raise _misfit(wanted, 'an array', measured, type_)
        for name, number in zip(joint_names(one.message, at), values.untracked(array)):
            if found.get(name, (0.0, one.publisher))[1] != one.publisher:
                raise NotTaught(f'{found[name][1]} and {one.publisher} both send the joint {name} on {measured.topic}')
            found[name] = float(number), one.publisher
    own = list(zip(names, range(len(part))))
    pairs = [
        Pair(f'{path}[{index}]', f'{wanted.shown(path)}[{index}] ({name})', found[name][0])
        for name, index in own
        if name in found
    ]
    if not pairs:
        raise NotYet(
            f'no joint of {wanted.topic} ({few([name for name, _ in own])}) is among those of {measured.topic} '
            f'that were heard in the last second ({few(sorted(found))}): name a joint in both alike'
        )
    missing = [name for name, _ in own if name not in found]
    return pairs, [f'{few(missing)} of {wanted.topic} stays: {measured.topic} does not name it'] if missing else []


def _by_name(
    wanted: Field,
    part: Any,
    type_: str,
    path: str,
    message: genpy.Message,
    measured: Field,
    others: Sequence[Heard],
) -> List[Pair]:
    if len(others) > 1:
        who = ' and '.join(sorted({one.publisher for one in others}))
        raise NotTaught(f'{who} send {measured.topic}, and it is not known whose is meant: have one send another topic')
    (other,) = others
    theirs, other_type, at = meant_part(measured, other.message)
    frames = _frame(message, path), _frame(other.message, at)
    if all(frames) and frames[0] != frames[1] and JOINTS not in (message._type, other.message._type):
        raise NotTaught(
            f'{measured.topic} is in the frame {frames[1]!r} and {wanted.topic} in {frames[0]!r}, and frames are not '
            f'converted: have it measured in {frames[0]!r}'
        )
    numbers, found = dict(_numbers(part, type_)), dict(_numbers(theirs, other_type))
    if type_.endswith(']') and other_type.endswith(']') and len(part) != len(theirs):
        raise NotTaught(
            f'{wanted.name} has {len(part)} elements and {measured.name} has {len(theirs)}: match an element alone, '
            f'as {wanted.name}[0]={measured.name}[0]'
        )
    for field, here, has, lacks, there in (
        (wanted, type_, numbers, found, measured),
        (measured, other_type, found, numbers, wanted),
    ):
        if not has:
            raise NotTaught(f'{field.name} is a {here}, and has no number')
        more = [name or 'a number' for name in has if name not in lacks]
        if more:
            raise NotTaught(
                f'{wanted.name} is a {type_} and {measured.name} a {other_type}: {field.name} has {few(more)}, which '
                f'{there.name} does not have; match the numbers that both have'
            )
    signs = _signs(part, type_, numbers, found)
    paths = {name: _joined(path, name) for name in numbers}
    return [
        Pair(at, wanted.name if wanted.joint else wanted.shown(at), signs.get(name, 1.0) * found[name])
        for name, at in paths.items()
    ]


def _signs(part: Any, type_: str, numbers: Dict[str, float], found: Dict[str, float]) -> Dict[str, float]:
    """-1 for the numbers of quaternions that are the same rotation, and nearer, with all their signs changed."""
    signs: Dict[str, float] = {}
    for name in numbers:
        outer, _, last = name.rpartition('.')
        if last == 'w' and (messages.part_at(part, outer)[1] if outer else type_) == QUATERNION:
            four = [_joined(outer, axis) for axis in 'xyzw']
            if sum(numbers[one] * found[one] for one in four) < 0.0:
                signs.update(dict.fromkeys(four, -1.0))
    return signs


def part_of(field: Field, message: genpy.Message) -> Tuple[Any, str, str]:
    """A field of a message, its type and its path: the positions of a JointState stand for it."""
    path = field.path or (POSITION if message._type == JOINTS else '')
    try:
        part, type_ = messages.part_at(message, path)
    except messages.NoSuchPart as missing:
        raise NotTaught(f'{field.topic} has no field {path}: {missing}') from None
    return part, type_, path.strip('/').replace('/', '.')


def meant_part(field: Field, message: genpy.Message) -> Tuple[Any, str, str]:
    """As `part_of`, but of a joint its position.

    Raises:
        NotTaught: there is no such field.
        NotYet: the message does not have the joint.
    """
    part, type_, path = part_of(field, message)
    if not field.joint:
        return part, type_, path
    joints = _joints_of(field, message)
    if field.joint not in joints:
        raise NotYet(no_joint(field, list(joints)))
    path = f'{path}[{joints[field.joint]}]'
    return (*messages.part_at(message, path), path)


def _joints_of(field: Field, message: genpy.Message) -> Dict[str, int]:
    """{name of a joint: where the field has its number}, of the joints that have one."""
    part, _, path = part_of(field, message)
    return dict(zip(joint_names(message, path), range(len(part))))


def no_joint(field: Field, names: Sequence[str], when: str = '') -> str:
    """Say that there is no such joint, and which there are."""
    return f'{field.topic} has no joint {field.joint}{when}; it has: {", ".join(names) or "none"}'


def joint_names(message: genpy.Message, path: str) -> List[str]:
    """The names of the joints that an array of a message has numbers of; none if the message does not name them."""
    names: Any = []
    for part in _around(message, path):
        names = getattr(part, 'joint_names', names)
    if message._type == JOINTS:
        names = message.name
    return [str(values.untracked(name)) for name in names]


def _frame(message: genpy.Message, path: str) -> str:
    """The frame of a part of a message, '' if the message does not say it."""
    frame = ''
    for part in _around(message, path):
        frame = getattr(getattr(part, 'header', None), 'frame_id', frame)
    return str(values.untracked(frame)).lstrip('/')


def _around(message: genpy.Message, path: str) -> Iterator[Any]:
    """A message, the part of it that a path goes to, and those on the way."""
    at = ''
    yield message
    for step in messages.path_steps(path):
        at = _joined(at, f'[{step}]' if isinstance(step, int) else step)
        yield messages.part_at(message, at)[0]


def _numbers(part: Any, type_: str, path: str = '') -> Iterator[Tuple[str, float]]:
    if type_ in ABOUT:
        return
    if hasattr(part, '_slot_types'):
        for name, kind in zip(part.__slots__, part._slot_types):
            yield from _numbers(getattr(part, name), kind, _joined(path, name))
    elif type_.endswith(']') and not isinstance(part, bytes):
        for index, one in enumerate(part):
            yield from _numbers(one, type_[: type_.rindex('[')], f'{path}[{index}]')
    else:
        plain = values.untracked(part)
        if is_number(plain) and type_ != 'bool':
            yield path, plain


def _as_held(pair: Pair, message: genpy.Message) -> Pair:
    kind = messages.part_at(message, pair.path)[1]
    if pair.number - pair.number != 0:
        raise NotYet(f'{pair.name} cannot become {pair.number!r}, which was measured: it is not finite')
    if messages.kind_of(kind) != 'i':
        return pair._replace(number=float(pair.number))
    try:
        messages.as_held(pair.number, 'i')
        return pair._replace(number=int(pair.number))
    except ValueError as error:
        raise NotTaught(f'{pair.name} cannot become what was measured: {error}') from None


def _joined(path: str, name: str) -> str:
    return path + name if not path or name.startswith('[') or not name else f'{path}.{name}'


def _misfit(wanted: Field, what: str, measured: Field, type_: str) -> NotTaught:
    return NotTaught(f'{wanted.name} is {what}, and {measured.name} a {type_}')


def few(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    more = [f'{len(names) - MOST} more'] if len(names) > MOST else []
    return ', '.join([*names[:MOST], *more]) or 'none'
