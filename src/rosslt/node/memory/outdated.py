"""Finds what a node has made of its locations in a round, and goes on with after they have changed: the target of a leg
that has begun, a message that it sends again."""

import contextlib
import gc
import types
from typing import Any, Dict, List, Mapping, Sequence

import genpy

from rosslt import values
from rosslt.messages import Scalar
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.walk import Slot, Walk, items_of, numbers_in

#: The maximal number of tracked numbers that are looked at: of more, the node would notice the time that it takes.
MOST_NUMBERS = 5000


def outdated(present: Mapping[values.Source, Scalar]) -> List[str]:
    """Name what in this node's memory holds results of other values of sources.

    Args:
        present: the values that the sources have. Those that arrays wait for are passed over, as that is said of them.

    Returns:
        Each name once: `target`, `goal.x` of a message; none if the node has more than MOST_NUMBERS.
    """
    present = {source: value for source, value in present.items() if source not in MEMORY.held_back}
    if not present or not _outdated(present):
        return []
    gc.collect()  # what nothing refers to any more may be among them
    return _outdated(present)


def _outdated(present: Mapping[values.Source, Scalar]) -> List[str]:
    walk = Walk(has_sent=False, most=MOST_NUMBERS)
    numbers = numbers_in([slot.value for slot in walk.slots])
    referred = [(reference(), noted) for reference, noted in walk.arrays]
    arrays = [(array, noted) for array, noted in referred if array is not None]
    if len(numbers) + sum(array.size for array, _ in arrays) > MOST_NUMBERS:
        return []
    of_arrays = [element for array, noted in arrays for _, element in noted.unwritten(array)]
    numbers += of_arrays
    former = {
        id(number)
        for number, other in zip(numbers, _evaluated(numbers, present))
        if not values.is_same(values.plain_scalar(number), other)
    }
    found = _names([slot for slot in walk.slots if any(id(one) in former for one in numbers_in([slot.value]))])
    in_arrays = ['an array'] if any(id(element) in former for element in of_arrays) else []
    return list(dict.fromkeys([*found, *in_arrays]))


def _evaluated(numbers: List[Any], present: Mapping[values.Source, Scalar]) -> List[Any]:
    """Evaluate numbers with the present values; None for one that has no value then."""
    try:
        return list(values.evaluate(numbers, present))
    except Exception:  # a user's operation may raise any
        return [None] if len(numbers) == 1 else [one for number in numbers for one in _evaluated([number], present)]


def _names(slots: Sequence[Slot]) -> List[str]:
    """Return the names of slots for people."""
    owners = [slot.owner() for slot in slots]
    messages = {id(owner): owner for owner in owners if isinstance(owner, genpy.Message)}
    called: Dict[int, str] = {}
    for holder in gc.get_referrers(*messages.values()) if messages else ():
        for name, thing in items_of(_attributes_of(holder)):
            if id(thing) in messages and type(name) is str:
                called[id(thing)] = name
    return [_name_of(owner, slot.key, called.get(id(owner), '')) for owner, slot in zip(owners, slots)]


def _attributes_of(holder: Any) -> Any:
    if type(holder) is dict:
        return holder
    with contextlib.suppress(AttributeError):
        return object.__getattribute__(holder, '__dict__')
    return {}


def _name_of(owner: Any, name: Any, called: str) -> str:
    """Return the name of a slot for people.

    Args:
        called: the name of what holds the owner, if the owner is a message; '' if it is not known.
    """
    if isinstance(owner, genpy.Message):
        return f'{called}.{name}' if called else f'{name} of a {owner._type}'
    if type(name) is str and type(owner) is not types.FunctionType:
        return name
    return f'a {type(owner).__name__}'
