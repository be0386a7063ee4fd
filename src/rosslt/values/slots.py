"""Slots: the places in which Python keeps values, and their exchange for other values at one moment."""

import collections
import types
from typing import Any, List

from .accelerator import CORE


def exchange(rows: List[tuple]) -> List[bool]:
    """Put other values into slots, if these still hold what is expected.

    Args:
        rows: `(owner, key, expected object, other object)` of each slot. The owner is a dict or array, by key or index;
            a cell, by None; a class, message or other object, by the name of an attribute; or a frame, by the name of
            a local variable, which needs the compiled core. Or it is a list or deque, by None: then the objects are a
            tuple of elements, and `{id of one of them: other element}`, wherever these stand.

    Returns:
        Whether each was exchanged; of a list or deque, whether any of the elements was.

    The compiled core does all in one step that no other thread can interrupt.
    """
    return [_exchange(*row) for row in rows]


_names_of: Any = vars(type)['__dict__'].__get__


def _exchange(owner: Any, key: Any, expected: Any, value: Any) -> bool:
    kind = type(owner)  # its class, which `isinstance` would ask the owner itself for
    try:
        if issubclass(kind, types.CellType):
            if owner.cell_contents is not expected:
                return False
            owner.cell_contents = value
        elif issubclass(kind, dict):
            if dict.get(owner, key) is not expected:
                return False
            dict.__setitem__(owner, key, value)
        elif issubclass(kind, type):
            if _names_of(owner).get(key) is not expected:
                return False
            type.__setattr__(owner, key, value)
        elif isinstance(key, str):
            if issubclass(kind, types.FrameType) or object.__getattribute__(owner, key) is not expected:
                return False
            object.__setattr__(owner, key, value)
        elif key is None:
            base: Any = list if issubclass(kind, list) else collections.deque
            found = [(index, one) for index, one in enumerate(base.__iter__(owner)) if id(one) in value]
            for index, one in found:
                base.__setitem__(owner, index, value[id(one)])
            return bool(found)
        else:
            if owner[key] is not expected:
                return False
            owner[key] = value
    except (LookupError, AttributeError, TypeError, ValueError):  # it is gone, or takes nothing
        return False
    return True


KEEPS_LOCALS = CORE is not None
"""Whether `exchange` changes local variables of running functions."""

if CORE is not None:
    exchange = CORE.exchange
