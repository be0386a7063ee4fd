"""Finds what holds results of locations in objects that no change reaches, because they are not the node's own:
`itertools.cycle(WAYPOINTS)`, a `queue.Queue` of goals, the results of `functools.lru_cache`.
"""

import collections
import functools
import gc
import itertools
import queue
import sys
import types
from typing import Any, Collection, List, Set

from rosslt import values

_CACHED = type(functools.lru_cache(maxsize=None)(len))
"""The class of functions that keep their results: they have the name of what they were made of."""


def _links_of_results() -> List[type]:
    """The class of what a cached function of limited size keeps a result in."""
    cached = functools.lru_cache(maxsize=2)(len)
    cached('')
    kept = [one for one in gc.get_referents(cached) if type(one) is dict]
    return [type(link) for one in kept for link in one.values() if type(link).__module__ == 'functools']


_ITERATORS = (
    *(itertools.cycle, itertools.chain, itertools.islice, enumerate, filter, map, reversed, zip),
    *map(type, (iter([]), iter(()), iter(set()))),
)
_HOLDING = (*_ITERATORS, _CACHED, types.MappingProxyType, set, frozenset, queue.Queue)
"""The classes that are known to hold what a node puts there. Any other object may lead to all that there is."""

_LOOKED_INTO = (*_HOLDING, list, tuple, dict, collections.deque, *_links_of_results())

_REFERENCES = 2
"""How many references there are to an object that only its Holder has: the Holder's, and that of who counts."""

_module_of: Any = vars(type)['__module__'].__get__


def is_foreign(kind: type) -> bool:
    """Return whether the objects of a class, which is not the node's own, are known to hold what a node puts there."""
    return issubclass(kind, _HOLDING)


class Holder:
    """An object that is not the node's own, to which something of that refers.

    Args:
        name: of what refers to it, as of an attribute; '' if it has none.
        thing: the object.

    Attributes:
        text: what people call it: `stops (itertools.cycle)`.
    """

    def __init__(self, name: str, thing: object) -> None:
        self._thing: Any = thing
        kind = type(thing)
        module = module_of(kind)
        called = kind.__name__.lstrip('_') if module in ('', 'builtins') else f'{module}.{kind.__name__.lstrip("_")}'
        if kind is _CACHED:
            name = name or str(getattr(thing, '__name__', ''))
        self.text = f'{name} ({called})' if name else called

    @property
    def is_made_of_numbers(self) -> bool:
        """True if it holds tracked numbers, or gets at some, or keeps what a function returns: what is only on its way
        through it later, as in a queue of messages, does not count."""
        return type(self._thing) is _CACHED or bool(_held_in(self._thing, set()))

    def sources(self, following: Set[int]) -> Collection[values.Source]:
        """The sources of the numbers that it holds, also by way of others.

        Args:
            following: the ids of objects into which changes go.
        """
        if sys.getrefcount(self._thing) <= _REFERENCES:  # the node has let go of it
            self._thing = None
        return values.sources(_held_in(self._thing, following))


def module_of(kind: type) -> str:
    """The name of the module of a class; '' if it has none, as a class that `type` makes in a text without a name."""
    try:
        module = _module_of(kind)
    except AttributeError:
        return ''
    return module if type(module) is str else ''


def _held_in(thing: object, following: Set[int]) -> List[Any]:
    found, waiting, seen = [], [thing], set(following)
    tracked = set(map(id, values.TRACKED_CLASSES))
    while waiting:
        one = waiting.pop()
        if id(one) not in seen:
            seen.add(id(one))
            if id(type(one)) in tracked:
                found.append(one)
            elif issubclass(type(one), _LOOKED_INTO):  # not `isinstance`, which asks the object for its class
                waiting += gc.get_referents(one)
    return found
