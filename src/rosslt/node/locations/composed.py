"""Messages, lists and dicts that are given to `location()`: one location for each of their leaves."""

import copy
import functools
from typing import Any, Callable, Dict, List, Tuple

from rosslt import values
from rosslt.messages import Message
from rosslt.node.locations.call_sites import word_of
from rosslt.node.locations.location import Location, Readable

_Read = Callable[[], Any]

_Leaf = Callable[[Any, Tuple[str, ...]], Location]
"""Makes the location of a leaf from its value and the names on the way to it."""


class _Composed:
    """Several locations that are read together.

    Args:
        read: makes a new message, list or dict of their present values.
        locations: these locations.
    """

    __slots__ = ('_locations', '_read')

    def __init__(self, read: _Read, locations: List[Location]) -> None:
        self._read = read
        self._locations = locations

    @property
    def tracked(self) -> Any:
        return self._read()

    def read_in_round(self) -> None:
        for location in self._locations:
            location.read_in_round()


def readable(literal: object, leaf: _Leaf) -> Readable:
    """The Readable of a literal: its location if it is a scalar.

    Args:
        literal: a float, int, str or bool; or a message, list or dict of them.
        leaf: makes the location of each leaf.

    Raises:
        TypeError: it, or a part of it, is something else.
    """
    plain = values.plain_scalar(literal)
    if plain is not None:
        return leaf(plain, ())
    locations: List[Location] = []

    def kept(value: object, path: Tuple[str, ...]) -> Location:
        locations.append(leaf(value, path))
        return locations[-1]

    return _Composed(_reader(literal, (), kept), locations)


def _reader(literal: object, path: Tuple[str, ...], leaf: _Leaf) -> _Read:
    """The function that reads a literal: a scalar's location, or a new container with the readings of its parts."""
    plain = values.plain_scalar(literal)
    if plain is not None:
        location = leaf(plain, path)
        return lambda: location.tracked
    if isinstance(literal, dict):
        branches = {key: _reader(part, (*path, word_of(key)), leaf) for key, part in literal.items()}
        return functools.partial(_read_dict, copy.copy(literal), branches)
    if isinstance(literal, (list, tuple)):
        names = getattr(literal, '_fields', None) or map(str, range(len(literal)))  # those of a namedtuple
        make = getattr(literal, '_make', type(literal))
        parts = [_reader(part, (*path, name), leaf) for name, part in zip(names, literal)]
        return lambda: make([read() for read in parts])
    if hasattr(literal, '_slot_types'):
        return _message_reader(literal, path, leaf)
    raise TypeError(
        f'what is of type {type(literal).__name__} cannot be a location: give a float, int, str or bool, or a '
        'message, list or dict of them'
    )


def _read_dict(pattern: Dict[object, object], branches: Dict[object, _Read]) -> Any:
    fresh = copy.copy(pattern)  # an OrderedDict, or a defaultdict, is given back as such
    for key, read in branches.items():
        fresh[key] = read()
    return fresh


def _message_reader(message: Message, path: Tuple[str, ...], leaf: _Leaf) -> _Read:
    pattern = copy.deepcopy(message)
    parts: List[Tuple[str, _Read]] = []
    for field, kind in zip(message.__slots__, message._slot_types):
        part = getattr(message, field)
        if kind.startswith(('time', 'duration')):
            parts.append((field, functools.partial(copy.deepcopy, part)))
        elif kind.startswith(('uint8[', 'char[')) or (message._type, field) == ('std_msgs/Header', 'seq'):
            continue
        else:
            parts.append((field, _reader(part, (*path, field), leaf)))

    def read() -> Any:
        fresh = copy.copy(pattern)
        for field, read_field in parts:
            setattr(fresh, field, read_field())
        return fresh

    return read
