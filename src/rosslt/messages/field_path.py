"""Parts of messages by the paths that people write: `pose/position/x`, `points[3].x`; what a part can hold, and whether
it is as wanted.

A part goes together with its ROS type: a `float32` can come no nearer to a wanted number than 32 bits allow.
"""

import math
import re
import struct
from typing import Any, Iterable, Iterator, List, Optional, Tuple, Union

import genpy

from rosslt import values
from rosslt.messages.fields import SCALARS, Message, Scalar, kind_of, limits_of

#: The distance of neighbouring 32-bit floats, relative to their size.
FLOAT32 = 2.0**-23

_SINGLE = struct.Struct('<f')


class NoSuchPart(LookupError):
    """A message has no part at a path.

    Attributes:
        part: the last part on the way that there is.
        step: the name or index that it does not have.
        where: the path of that part.
    """

    def __init__(self, part: Message, step: Union[str, int], where: str) -> None:
        super().__init__(
            '{} has no {}'.format(where or getattr(part, '_type', 'it'), f'[{step}]' if isinstance(step, int) else step)
        )
        self.part, self.step, self.where = part, step, where


def topic_in(text: str, topics: Iterable[str]) -> Optional[str]:
    """The longest of some topics that TOPIC[/FIELD] equals or begins with, None if there is none."""
    found = [name for name in topics if _is_below(text, name)]
    return max(found, key=len) if found else None


def path_steps(path: str) -> List[Union[str, int]]:
    """The steps of a path: names and indices.

    Raises:
        ValueError: it is not a path.
    """
    found = re.findall(r'(\w+)|\[(\d+)\]', path)
    if re.sub(r'\w+|\[\d+\]|[./]', '', path):
        raise ValueError(f'{path!r} is not a field: give names with / or . between, and [INDEX] for an array')
    return [int(index) if index else name for name, index in found]


def part_at(message: Message, path: str) -> Tuple[Any, str]:
    """The part of a message at a path and its ROS type; the message itself at ''.

    Raises:
        ValueError: it is not a path.
        NoSuchPart: the message has no such part.
    """
    part, type_, walked = message, message._type, ''
    for step in path_steps(path):
        if isinstance(step, int):
            if not type_.endswith(']') or step >= len(part):
                raise NoSuchPart(part, step, walked)
            part, type_ = part[step], type_[: type_.rindex('[')]
            walked += f'[{step}]'
        else:
            names = list(getattr(part, '__slots__', ()))
            if step not in names or type_.endswith(']'):
                raise NoSuchPart(part, step, walked)
            part, type_ = getattr(part, step), _types(part)[names.index(step)]
            walked += f'.{step}' if walked else step
    return part, type_


def check_range(part: Message, type_: str, wanted: Message) -> None:
    """Check that a target has no number beyond those of its field: the node that sends the message would fail.

    Args:
        part, type_: as `part_at` gives them.
        wanted: as in `is_reached`.

    Raises:
        ValueError: it has one, or another shape.
    """
    for _, target, kind in _paired(part, wanted, type_):
        letter = SCALARS.get(kind)
        if letter is None or kind == 'bool' or not isinstance(target, (int, float)) or target - target != 0:
            continue
        is_whole = kind_of(kind) == 'i'
        try:
            struct.pack('<' + letter, int(target) if is_whole else target)
        except (struct.error, OverflowError):
            holds = '{} to {}'.format(*limits_of(kind)) if is_whole else f'numbers of {kind[-2:]} bits'
            article = 'an' if kind.startswith('int') else 'a'
            raise ValueError(f'the field is {article} {kind}, which holds {holds}, found {target!r}') from None


def is_reached(part: Message, wanted: Message, type_: str = '', within: float = 0.0) -> bool:
    """Return True if a part of a message equals its target, up to rounding.

    Args:
        part: a scalar, a message or an array of them.
        wanted: the target, in the same shape; None for parts that may have any value.
        type_: the part's ROS type.
        within: by how much a number may differ beside that, relative to its target.

    Raises:
        ValueError: the target has another shape.
    """
    return all(_is_met(leaf, target, kind, within) for leaf, target, kind in _paired(part, wanted, type_))


def as_held(value: Scalar, kind: str) -> Scalar:
    """A number as a field of a kind holds it, with its provenance: an int if the field takes whole numbers.

    Raises:
        ValueError, OverflowError: it is complex, or the field takes whole numbers and it is not whole.
    """
    plain = values.untracked(value)
    if isinstance(plain, complex):
        raise ValueError(f'it would be {plain!r}, which no field takes')
    if kind != 'i' or not isinstance(plain, float):
        return value
    whole = values.to_int(value)
    if whole != plain:
        raise ValueError(f'{plain!r} is not a whole number, and the field takes only those')
    return whole


def is_sent_as(value: Scalar, reading: Scalar) -> bool:
    """Return True if the value of a source that a message carries is this value, up to rounding or to 32 bits."""
    try:
        return values.is_same(value, reading) or _SINGLE.unpack(_SINGLE.pack(value)) == (reading,)
    except (OverflowError, struct.error):
        return False


def lacks(part: Message, wanted: Message, type_: str = '') -> List[float]:
    """How far each leaf of a part of a message is from its target: 0 if it is met, infinite if a text or a bool differs
    or a number is NaN.

    Args:
        part, wanted, type_: as in `is_reached`.

    Raises:
        ValueError: as in `is_reached`.
    """
    return [
        0.0 if _is_met(leaf, target, kind, 0.0) else distance(leaf, target)
        for leaf, target, kind in _paired(part, wanted, type_)
    ]


def distance(part: Message, wanted: Message) -> float:
    """Return the Euclidean distance of a part of a message from its target; infinite if a text or a bool differs."""
    total = 0.0
    for leaf, target, _ in _paired(part, wanted, ''):
        try:
            total = math.hypot(total, float(leaf) - float(target))
        except (TypeError, ValueError, OverflowError):
            total = total if values.untracked(leaf) == target else math.inf
    return total if total == total else math.inf


def _paired(part: Message, wanted: Message, type_: str) -> Iterator[Tuple[Any, Any, str]]:
    """The leaves beside those of a target, with their ROS types."""
    if wanted is None:
        return
    if hasattr(part, '_slot_types'):
        if list(getattr(wanted, '__slots__', ())) != list(part.__slots__):
            raise ValueError(f'the target of a message of type {part._type} must be one, too, found {wanted!r}')
        for name, kind in zip(part.__slots__, _types(part)):
            yield from _paired(getattr(part, name), getattr(wanted, name), kind)
    elif isinstance(part, (list, tuple)):
        if not isinstance(wanted, (list, tuple)):
            raise ValueError(f'the target of an array must be a list, found {wanted!r}')
        if len(part) != len(wanted):
            yield len(part), f'{len(wanted)} elements', ''
            return
        for one, target in zip(part, wanted):
            yield from _paired(one, target, type_.partition('[')[0])
    else:
        yield part, wanted, type_


def _is_met(leaf: object, wanted: Any, type_: str, within: float) -> bool:
    plain = values.untracked(leaf)
    if isinstance(plain, float) and isinstance(wanted, (int, float)):
        within = max(within, FLOAT32) if type_ == 'float32' else within
        return values.is_same(plain, wanted) or abs(plain - wanted) <= within * abs(wanted)
    try:
        return bool(plain == wanted)
    except ValueError:  # arrays of numbers
        return list(plain) == list(wanted)


def _types(message: Message) -> List[str]:
    if isinstance(message, genpy.Time):
        return ['uint32', 'uint32']  # genpy says int32
    types = list(getattr(message, '_slot_types', ()))  # others may have slots and no types
    return types if len(types) == len(message.__slots__) else [''] * len(message.__slots__)


def _is_below(path: str, name: str) -> bool:
    return path == name or (path.startswith(name) and path[len(name)] in '/.[')
