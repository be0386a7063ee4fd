"""The tracked leaves of a message: found, and replaced in a copy."""

import copy
from typing import Any, Dict, Iterable, List, Sequence, Tuple

from rosslt.messages.fields import Message
from rosslt.messages.walkers import END, TRACKED, walkers

#: The classes of what nobody can change.
_UNCHANGED = TRACKED | {float, int, bool, str, bytes}


Located = Tuple[Any, Any, Any, str]
"""A located leaf: its owner, its key in the owner, its value and its kind."""

LocatedArray = Tuple[Any, str, Any, List[Any]]
"""A located array of scalars: its owner, its name in the owner, the array, and a copy that its leaves refer to."""


def tracked_fields(message: Message) -> List[Tuple[int, Any, str]]:
    """The tracked leaves of a message: of each its index, its value, and its kind as of `fields.kind_of`."""
    found: List[Tuple[int, Any, str]] = []
    walkers(message.__class__).collect(message, 0, found)
    return found


def has_tracked_leaf(message: Message) -> bool:
    """Return whether a leaf of a message is tracked; the first one that is found ends the search."""
    found: List[Tuple[int, Any, str]] = []
    walkers(message.__class__).collect(message, 0, found, 0)
    return bool(found)


def locate(message: Message, wanted: Sequence[int], arrays: List[LocatedArray]) -> List[Located]:
    """Find leaves of a message by their indices; those beyond its end are left out.

    Args:
        message: any ROS message.
        wanted: their indices, which rise, and END.
        arrays: is extended by the arrays of scalars with such leaves; the owner of a leaf in one of them is the copy.
    """
    found: List[Located] = []
    walkers(message.__class__).locate(message, 0, wanted, 0, found.append, arrays.append)
    return found


def put_located(found: Sequence[Located], values: Iterable[object], arrays: Sequence[LocatedArray]) -> None:
    """Write other values to located leaves, also to those in copied arrays."""
    for (owner, key, _, _), value in zip(found, values):
        if type(owner) is list:
            owner[key] = value
        else:
            setattr(owner, key, value)
    for owner, name, array, items in arrays:
        setattr(owner, name, _like(array, items))


def _like(array: Any, items: List[object]) -> Any:
    """Convert items to an array of the given array's type if it can hold tracked values, else to a list."""
    if type(array) is tuple:
        return tuple(items)
    if hasattr(array, 'dtype'):
        found = array.astype(object)
        found[:] = items
        return found
    return items


def with_leaves(message: Message, replaced: Dict[int, object]) -> Message:
    """A copy of a message in which some leaves are other ones. The message is not changed, nor is anything in it.

    Args:
        message: any ROS message.
        replaced: `{index: value}`, with indices as of `tracked_fields`; `{}` for a plain copy.
    """
    result = _copied(message)
    set_leaves(result, replaced)
    return result


def set_leaves(message: Message, replaced: Dict[int, Any]) -> None:
    """Replace some leaves of a message.

    Args:
        message: any ROS message; it is changed.
        replaced: `{index: value}`, with indices as of `tracked_fields`.
    """
    arrays: List[LocatedArray] = []
    indices = sorted(replaced)
    found = locate(message, [*indices, END], arrays)
    put_located(found, map(replaced.__getitem__, indices), arrays)


def _copied_message(message: Message) -> Message:
    # `copy.copy` takes five times as long; only messages of classes that somebody has derived have more than fields.
    made = copy.copy(message) if hasattr(message, '__dict__') else message.__class__.__new__(message.__class__)
    for name in message.__slots__:
        value = getattr(message, name)
        setattr(made, name, value if type(value) in _UNCHANGED else _copied(value))
    if hasattr(message, '_connection_header'):
        made._connection_header = message._connection_header
    return made


def _copied(part: Message) -> Message:
    """A copy of a message, or of what a field of one holds, that shares nothing with it which can be changed."""
    if type(part) in _UNCHANGED:
        return part
    if hasattr(part, '_slot_types') and hasattr(part, '_type'):
        return _copied_message(part)
    if isinstance(part, (list, tuple)) and part and hasattr(part[0], '_slot_types'):
        return [_copied(item) for item in part]
    return copy.copy(part)  # lists, arrays and times, of which rospy's look like messages
