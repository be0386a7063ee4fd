"""Cuts a state off from what it began with, as it is stepped for the first time in a round.

self.x = HOME                             before that, self.x is configuration, and follows a change of HOME
while not rospy.is_shutdown():
    self.x += 0.1                         from here on, no change of HOME reaches it in this run
"""

import types
from typing import Any, Dict, List, Tuple

import genpy

from rosslt import node, values
from rosslt.instrument.cells import plain


class _Starts(Dict[values.Source, bool]):
    """{source: whether it takes effect at the next start only}, as it was when a state that began with it was stepped.

    If it does, the state keeps it, so that whoever asks is told its name.
    """

    def __missing__(self, source: values.Source) -> bool:
        self[source] = found = node.is_late(source)
        return found


_STARTS = _Starts()
_arrays: List[type] = []


def see_arrays(kind: type) -> None:
    """Have `cut_off` also know a class of arrays with provenance."""
    if kind not in _arrays:
        _arrays.append(kind)


def cut_off(owner: Any, key: Any) -> Any:
    """Have an attribute or element lose the provenance of its start, which a statement steps next.

    Args:
        owner: of the attribute or element.
        key: the name of the attribute; the key or index, in a tuple of its own, of the element.

    Returns:
        The owner.
    """
    if not node.MEMORY.has_begun:
        return owner
    place, key, value = _element(owner, *key) if type(key) is tuple else _attribute(owner, key)
    kind = type(value)
    if kind is float or kind is int:
        return owner
    is_array = _is_array(value)
    if not (value.has_provenance if is_array else id(kind) in map(id, values.TRACKED_CLASSES)):
        return owner
    sources = values.sources(value)
    if all(map(_STARTS.get, sources)):
        return owner
    # Without it in its place, it is known whether anything else keeps what it began with.
    if is_array:
        before = value.copy()
        value.forget()
    else:
        stripped = plain(value)
        _put(place, key, value, stripped)
    if all(map(_STARTS.__getitem__, sources)):
        if is_array:
            value[...] = before
        else:
            _put(place, key, stripped, value)
    return owner


def _is_array(thing: Any) -> bool:
    return any(type(thing) is kind for kind in _arrays)


def _put(place: Any, key: Any, before: Any, value: Any) -> None:
    if type(place) is list or _is_array(place):
        place[key] = value
    else:
        values.exchange([(place, key, before, value)])


def _attribute(owner: Any, name: str) -> Tuple[Any, Any, Any]:
    """(owner, key, value) of an attribute, as `values.exchange` takes it; no value if code of the node gives it."""
    kind = type(owner)
    if issubclass(kind, genpy.Message):
        return owner, name, getattr(owner, name, None) if name in kind.__slots__ else None
    try:
        held = object.__getattribute__(owner, '__dict__')
        if name in held:
            return (owner if isinstance(owner, type) else held), name, held[name]
    except AttributeError:  # it has slots alone
        pass
    member = next((vars(one)[name] for one in kind.__mro__ if name in vars(one)), None)
    return owner, name, getattr(owner, name, None) if type(member) is types.MemberDescriptorType else None


def _element(owner: Any, key: Any) -> Tuple[Any, Any, Any]:
    try:
        if type(owner) is dict:
            return owner, key, owner.get(key)
        if type(owner) is list or (_is_array(owner) and owner.has_provenance):
            return owner, key, owner[key]
    except (LookupError, TypeError):  # the statement says so
        pass
    return owner, key, None
