"""Finds what a node has made of its locations in a round, and goes on with after they have changed: the target of a leg
that has begun, a message that it sends again."""

import gc
import types
from typing import Any, List, Mapping, Tuple

import genpy

from rosslt import values
from rosslt.messages import Scalar
from rosslt.node.memory.walk import Slot, Walk, numbers_in

#: The maximal number of tracked numbers that are looked at: of more, the node would notice the time that it takes.
MOST_NUMBERS = 20000


def outdated(present: Mapping[values.Source, Scalar]) -> List[str]:
    """Name what in this node's memory holds results of other values of sources.

    Args:
        present: the values that the sources have.

    Returns:
        Each name once: `target`, `x of a geometry_msgs/Point`; none if the node has more than MOST_NUMBERS.
    """
    if not _outdated(present):
        return []
    gc.collect()  # what nothing refers to any more may be among them
    return _outdated(present)


def _outdated(present: Mapping[values.Source, Scalar]) -> List[str]:
    walk = Walk(has_sent=False)
    held: List[Tuple[str, Any]] = [(_name_of(slot), slot.value) for slot in walk.slots]
    numbers = numbers_in([value for _, value in held])
    referred = [(reference(), noted) for reference, noted in walk.arrays]
    arrays = [(array, noted) for array, noted in referred if array is not None]
    if len(numbers) + sum(array.size for array, _ in arrays) > MOST_NUMBERS:
        return []
    for array, noted in arrays:
        elements = tuple(element for _, element in noted.unwritten(array))
        held.append(('an array', elements))
        numbers += elements
    former = {
        id(number)
        for number, other in zip(numbers, _evaluated(numbers, present))
        if not values.is_same(values.plain_scalar(number), other)
    }
    found = (name for name, value in held if any(id(number) in former for number in numbers_in([value])))
    return list(dict.fromkeys(found))


def _evaluated(numbers: List[Any], present: Mapping[values.Source, Scalar]) -> List[Any]:
    """Evaluate numbers with the present values; None for one that has no value then."""
    try:
        return list(values.evaluate(numbers, present))
    except Exception:  # a user's operation may raise any
        return [None] if len(numbers) == 1 else [one for number in numbers for one in _evaluated([number], present)]


def _name_of(slot: Slot) -> str:
    """Return the name of a slot for people."""
    owner, name = slot.owner(), slot.key
    if isinstance(owner, genpy.Message):
        return f'{name} of a {owner._type}'
    if type(name) is str and type(owner) is not types.FunctionType:
        return name
    return f'a {type(owner).__name__}'
