"""The leaves of a message: found, and replaced."""

from typing import Any, Dict, Iterable, List, Sequence, Tuple

from rosslt.messages.fields import Message
from rosslt.messages.walkers import END, walkers

Located = Tuple[Any, Any, Any, str]
"""A located leaf: its owner, its key in the owner, its value and its kind."""

LocatedArray = Tuple[Any, str, Any, List[Any]]
"""A located array of scalars: its owner, its name in the owner, the array, and a copy that its leaves refer to."""


def tracked_fields(message: Message) -> List[Tuple[int, Any, str]]:
    """The tracked leaves of a message: of each its index, its value, and its kind as in `fields.kind_of`."""
    found: List[Tuple[int, Any, str]] = []
    walkers(message.__class__).collect(message, 0, found)
    return found


def has_tracked_leaf(message: Message) -> bool:
    """Return whether a leaf of a message is tracked; the first one that is found ends the search."""
    found: List[Tuple[int, Any, str]] = []
    walkers(message.__class__).collect(message, 0, found, 0)
    return bool(found)


def leaf_count(message: Message) -> int:
    """Return the number of leaves of a message."""
    count: int = walkers(message.__class__).collect(message, 0, [], -1)
    return count


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


def set_leaves(message: Message, replaced: Dict[int, Any]) -> None:
    """Replace some leaves of a message.

    Args:
        message: any ROS message; it is changed.
        replaced: `{index: value}`, with indices as in `tracked_fields`.
    """
    arrays: List[LocatedArray] = []
    indices = sorted(replaced)
    found = locate(message, [*indices, END], arrays)
    put_located(found, map(replaced.__getitem__, indices), arrays)
