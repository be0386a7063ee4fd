"""The tracked leaves of a message: found, and replaced in a copy."""

import copy
from typing import Any, Dict, List, Optional, Tuple

from rosslt.messages.codegen.walkers import END, TRACKED, walkers

#: The classes of what nobody can change.
_UNCHANGED = TRACKED | {float, int, bool, str, bytes}


def tracked_fields(message: Any) -> List[Tuple[int, Any, str]]:
    """The tracked leaves of a message: of each its index, its value, and its kind as of `fields.kind_of`."""
    found: List[Tuple[int, Any, str]] = []
    walkers(message.__class__).collect(message, 0, found)
    return found


def tracked_leaves(message: Any) -> List[Tuple[int, Any]]:
    """The tracked leaves of a message, as `(index, value)`: the index among the flattened fields of the type."""
    return [(index, value) for index, value, _ in tracked_fields(message)]


def located(
    message: Any, indices: List[int], arrays: Optional[List[Tuple[Any, str, Any, List[Any]]]] = None
) -> List[Tuple[Any, Any, Any, str]]:
    """Where the leaves of a message with these rising indices are, as `walkers` have it: `(owner, key, value, kind)`.

    Args:
        message: any ROS message.
        indices: of the leaves.
        arrays: is extended by the arrays of scalars with such leaves, `(owner, name, array, copy)`; the owner of a leaf
            in one of them is the copy.
    """
    found: List[Tuple[Any, Any, Any, str]] = []
    arrays = [] if arrays is None else arrays
    walkers(message.__class__).locate(message, 0, [*indices, END], 0, found.append, arrays.append)
    return found


def with_leaves(message: Any, replaced: Dict[int, Any]) -> Any:
    """A copy of a message in which some leaves are other ones. The message is not changed, nor is anything in it.

    Args:
        message: any ROS message.
        replaced: `{index: value}`, with indices as of `tracked_leaves`; `{}` for a plain copy.
    """
    result = _copied(message)
    set_leaves(result, replaced)
    return result


def set_leaves(message: Any, replaced: Dict[int, Any]) -> None:
    """Replace some leaves of a message.

    Args:
        message: any ROS message; it is changed.
        replaced: `{index: value}`, with indices as of `tracked_leaves`.
    """
    arrays: List[Tuple[Any, str, Any, List[Any]]] = []
    indices = sorted(replaced)
    found = located(message, indices, arrays)
    for index, (owner, key, _, _) in zip(indices, found):
        if type(owner) is list:
            owner[key] = replaced[index]
        else:
            setattr(owner, key, replaced[index])
    for owner, name, _, items in arrays:
        setattr(owner, name, items)


def _copied_message(message: Any) -> Any:
    # `copy.copy` takes five times as long; only messages of classes that somebody has derived have more than fields.
    made = copy.copy(message) if hasattr(message, '__dict__') else message.__class__.__new__(message.__class__)
    for name in message.__slots__:
        value = getattr(message, name)
        setattr(made, name, value if type(value) in _UNCHANGED else _copied(value))
    if hasattr(message, '_connection_header'):
        made._connection_header = message._connection_header
    return made


def _copied(part: Any) -> Any:
    """A copy of a message, or of what a field of one holds, that shares nothing with it which can be changed."""
    if type(part) in _UNCHANGED:
        return part
    if hasattr(part, '_slot_types') and hasattr(part, '_type'):
        return _copied_message(part)
    if isinstance(part, (list, tuple)) and part and hasattr(part[0], '_slot_types'):
        return [_copied(item) for item in part]
    return copy.copy(part)  # lists, arrays and times, of which rospy's look like messages
