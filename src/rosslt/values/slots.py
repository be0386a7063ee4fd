"""Slots: the places in which Python keeps values, and their exchange for other values at one moment."""

import types
from typing import Any, List, NamedTuple

from .accelerator import CORE


class Slot(NamedTuple):
    """A place that holds a value.

    Attributes:
        owner: a dict, list, deque or array, by key or index; a cell; a class, message or other object, by the name of
            an attribute; or a frame, by the name of a local variable.
        key: the key, index or name; None for a cell.
        value: the object that it holds.
    """

    owner: Any
    key: Any
    value: Any


def exchange(rows: List[tuple]) -> List[bool]:
    """Put other values into slots, if these still hold what is expected.

    Args:
        rows: `(owner, key, expected object, other object)` of each slot, as of `Slot`. A local variable needs the
            compiled core, which does all in one step that no other thread can interrupt.

    Returns:
        Whether each was exchanged.
    """
    return [_exchange(*row) for row in rows]


def _exchange(owner: Any, key: Any, expected: Any, value: Any) -> bool:
    try:
        if isinstance(owner, types.CellType):
            if owner.cell_contents is not expected:
                return False
            owner.cell_contents = value
        elif isinstance(owner, dict):
            if dict.get(owner, key) is not expected:
                return False
            dict.__setitem__(owner, key, value)
        elif isinstance(owner, type):
            if vars(owner).get(key) is not expected:
                return False
            type.__setattr__(owner, key, value)
        elif isinstance(key, str):
            if isinstance(owner, types.FrameType) or object.__getattribute__(owner, key) is not expected:
                return False
            object.__setattr__(owner, key, value)
        else:
            kind: Any = list if isinstance(owner, list) else type(owner)
            if kind.__getitem__(owner, key) is not expected:
                return False
            kind.__setitem__(owner, key, value)
    except (LookupError, AttributeError, TypeError, ValueError):  # it is gone, or takes nothing
        return False
    return True


KEEPS_LOCALS = CORE is not None
"""Whether `exchange` changes local variables of running functions."""

if CORE is not None:
    exchange = CORE.exchange
