"""The memory of this node: what it set up before its first round follows the locations that it was made of.

A node reads a number once and keeps it, or a result of it: in an attribute, a global, a list, a message, a
closure, a default argument, a local variable of a running function. What these slots hold when the first round begins
is the node's *configuration*. At a change, each slot that still holds the very same object gets the value that its
expression has now. A slot that holds another object has become part of the node's *state*, which goes on as it is.

`rounds` says when the first round begins. Until then a change reaches all that is there.
"""

import collections
import contextlib
import math
import threading
import types
from typing import Any, Callable, Collection, Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

import genpy
import rospy

from rosslt import messages, values
from rosslt.node.json_scalars import Refused
from rosslt.node.memory.holders import Holder
from rosslt.node.memory.walk import Reference, Slot, Walk, elements_of, numbers_in, running
from rosslt.values import Source


class Following(NamedTuple):
    """The new values of slots at a change.

    Attributes:
        slots: `(slot, its other value)` of those that depend on what changes.
        arrays: `(the number of the array, the array, [(index of an element, its other value), ...])`.
        waiting: the changes that some do not follow yet, as an array would get another shape.
        held_back: the sources of those.
    """

    slots: List[Tuple[Slot, Any]]
    arrays: List[Tuple[int, Any, List[Tuple[Tuple[int, ...], Any]]]]
    waiting: Mapping[Source, messages.Scalar] = types.MappingProxyType({})
    held_back: Collection[Source] = frozenset()


class Memory:
    """The configuration of this process, which is one node.

    Attributes:
        has_begun: whether the first round has begun.
        changes: how many changes there were.
        begins: called once, when the first round has begun.
        changed: called after each change with the ids of the owners whose slots were set.
        held_back: the sources of which something is left as it is, as an array would get another shape.
        is_over: called with the owner and the key of a slot: whether the program is known not to read it any more.
    """

    def __init__(self) -> None:
        self.has_begun = False
        self.changes = 0
        self.begins: List[Callable[[], None]] = []
        self.changed: Callable[[Set[int]], None] = lambda owners: None
        self.held_back: Collection[Source] = frozenset()
        self._waiting: Mapping[Source, messages.Scalar] = {}
        self.is_over: Callable[[Any, Any], bool] = lambda owner, key: False
        self._slots: List[Slot] = []
        self._arrays: List[Tuple[Reference, Any]] = []  # each with what it held
        self._frames: Dict[int, types.FrameType] = {}
        self._holders: List[Holder] = []
        self._by_source: Optional[Dict[Source, List[Slot]]] = None
        self._lock = threading.RLock()

    def begin(self) -> None:
        """Note the configuration: the first round begins."""
        with self._lock:
            if self.has_begun:
                return
            self.has_begun = True
            try:
                self._note()
            except Exception as error:  # of what the node keeps: it goes on as it would by itself
                rospy.logerr('what this node keeps follows no change: %s: %s', type(error).__name__, error)
        for function in self.begins:
            function()

    def _note(self) -> None:
        walk = Walk()
        self._slots, self._arrays, self._frames, self._holders = walk.slots, walk.arrays, walk.frames, walk.holders
        self._by_source = None

    def _depending(self, sources: Collection[Source]) -> List[Slot]:
        """The slots whose values depend on sources, without those that are gone."""
        if self._by_source is None:
            # Looking at sources makes literals known, which may be changed by that: by what an earlier run has left.
            values.sources(numbers_in(slot.value for slot in self._slots))
            self._by_source = {}
            for slot in self._slots:
                for source in values.sources(numbers_in([slot.value])):
                    self._by_source.setdefault(source, []).append(slot)
        found = {id(slot): slot for source in sources for slot in self._by_source.get(source, ())}
        return [slot for slot in found.values() if slot.owner() is not None]

    def kept(self, sources: Collection[Source]) -> Set[Source]:
        """Return those of several sources of which a slot or array, that may be read yet, still holds a result."""
        with self._lock:
            self._forget_what_has_ended()
            read = [slot for slot in self._depending(sources) if not self.is_over(slot.owner(), slot.key)]
            held = [number for slot in read for number in _held(slot)]
            for reference, noted in self._arrays:
                held += [element for _, element in _unwritten(reference(), noted)]
            return set(sources).intersection(values.sources(held))

    def holders_of(self, sources: Collection[Source]) -> Dict[Source, List[str]]:
        """{source: what holds a result of it that follows no change, as `stops (itertools.cycle)`}."""
        found: Dict[Source, List[str]] = {}
        with self._lock:
            following = {id(slot.owner()) for slot in self._slots}
            for holder in self._holders:
                for source in holder.sources(following):
                    found.setdefault(source, []).append(holder.text)
        return {source: found[source] for source in sources if source in found}

    def following(self, changes: Mapping[Source, messages.Scalar]) -> Following:
        """Compute the configuration for other values of its sources.

        What is computed of an array that would get another shape is left as it is, until the shape is the same again.

        Raises:
            Refused: a part of it has no value then.
        """
        if not changes:
            return Following([], [], self._waiting, self.held_back)
        try:
            return self._following(changes)
        except (Refused, RuntimeError, AttributeError, LookupError, MemoryError) as error:
            raise Refused(str(error)) from error

    def _following(self, changes: Mapping[Source, messages.Scalar]) -> Following:
        with self._lock:
            if not self.has_begun:
                self._note()
            self._forget_what_has_ended()
            changes = {**self._waiting, **changes}
            depending = self._depending(changes)
            pairs_of_slots = list(zip(depending, _reapplied([slot.value for slot in depending], changes)))
            slots = [(slot, other) for slot, other in pairs_of_slots if other is not _LEFT]
            left = numbers_in(slot.value for slot, other in pairs_of_slots if other is _LEFT)
            arrays = []
            for number, (reference, noted) in enumerate(self._arrays):
                array = reference()
                elements = _unwritten(array, noted)
                others = _reapplied([element for _, element in elements], changes, is_array=True)
                if any(other is _LEFT for other in others):
                    left += [element for _, element in elements]
                    continue
                pairs = [(at, other) for (at, one), other in zip(elements, others) if other is not one]
                if pairs:
                    arrays.append((number, array, pairs))
            return Following(slots, arrays, changes if left else {}, frozenset(values.sources(left)))

    def follow(self, following: Following, readings: Mapping[int, object]) -> None:
        """Set the slots, all at one moment.

        Args:
            following: as it was before the change.
            readings: {id of a reading: the one that the location gives now}.
        """
        with self._lock:
            self.changes += 1
            self._waiting, self.held_back = following.waiting, following.held_back
            rows = [_row(slot, value, readings) for slot, value in following.slots]
            owners = set()
            for (slot, _), (owner, _, _, value), is_done in zip(following.slots, rows, values.exchange(rows)):
                if is_done:
                    slot.value = _left_in(owner, value) if type(value) is dict else value
                    owners.add(id(owner))
                else:
                    slot.owner, slot.value = _gone, None
            for number, array, pairs in following.arrays:
                reference, noted = self._arrays[number]
                unwritten = {at for at, _ in _unwritten(array, noted)}
                array.follow([(at, value) for at, value in pairs if at in unwritten])
                self._arrays[number] = reference, values.numpy_arrays().Noted(array)
                owners.add(id(array))
        self.changed(owners)

    def _forget_what_has_ended(self) -> None:
        """Forget the local variables of functions that have ended, and the arrays that are gone."""
        for ended in self._frames.keys() - set(map(id, running())):
            del self._frames[ended]
        self._arrays = [pair for pair in self._arrays if pair[0]() is not None]


def _unwritten(array: Any, noted: Any) -> List[Tuple[Tuple[int, ...], Any]]:
    """The elements of an array that the node has not written since it was noted; none if the array is gone."""
    return [] if array is None else noted.unwritten(array)


def _gone() -> None:
    """Stands for the owner of a slot that the node has set since."""


MEMORY = Memory()
"""The memory of this process."""


def _row(slot: Slot, value: Any, readings: Mapping[int, object]) -> Tuple[Any, Any, Any, Any]:
    """A row of `values.exchange` that gives a slot a value, or instead of a reading the one that there is now."""
    owner, key, before = slot.owner(), slot.key, slot.value
    if not _has_elements(owner):
        return owner, key, before, _fitting(owner, key, before, readings.get(id(before), value))
    others = {id(one): _fitting(owner, key, one, readings.get(id(one), other)) for one, other in zip(before, value)}
    return owner, key, before, others


def _has_elements(owner: object) -> bool:
    return issubclass(type(owner), (list, collections.deque))


def _left_in(owner: object, others: Dict[int, object]) -> Tuple[Any, ...]:
    """Return the new elements that a list or deque now has: the node may have removed some before."""
    held = set(map(id, elements_of(owner)))
    return tuple(other for other in others.values() if id(other) in held)


def _held(slot: Slot) -> List[Any]:
    """The tracked numbers that a slot still holds of those that were noted."""
    owner = slot.owner()
    if _has_elements(owner):
        return numbers_in(_left_in(owner, {id(one): one for one in slot.value}))
    # an exchange for itself tells whether it is still there
    return numbers_in([slot.value]) if values.exchange([(owner, slot.key, slot.value, slot.value)])[0] else []


def _fitting(owner: Any, key: Any, before: Any, value: Any) -> Any:
    """A value as its slot takes it: a whole number if it is a field of whole numbers of a message.

    A text instead of a number, or a number instead of a text, is not taken: the node would not get far with it.
    """
    if type(value) is type(before):
        return value
    plain, other = values.plain_scalar(before), values.plain_scalar(value)
    if (type(plain) is str) is not (type(other) is str):
        return before
    if issubclass(type(owner), genpy.Message) and type(other) is float:
        type_ = dict(zip(owner.__slots__, owner._slot_types)).get(key, 'float64')
        try:
            return messages.as_held(value, messages.kind_of(type_))
        except (OverflowError, ValueError):
            return before
    return value


def _reapplied(kept: List[object], changes: Mapping[Source, messages.Scalar], is_array: bool = False) -> List[Any]:
    """Values, numbers or tuples, as they are after changes: the same objects if they do not depend on them, and `_LEFT`
    for those that are computed of an array that would get another shape; for all elements of an array, or for none.

    Raises:
        Refused: one has no value.
    """
    leaves = numbers_in(kept)
    with values.keeping_shapes():
        try:
            others = values.reapply(leaves, changes)
        except values.OtherShape:
            others = [_LEFT] * len(leaves) if is_array else [_reapplied_alone(leaf, changes) for leaf in leaves]
        except (ArithmeticError, ValueError, TypeError):
            others = [_reapplied_alone(leaf, changes) for leaf in leaves]
    left = set()
    for leaf, other in zip(leaves, others):
        if other is _LEFT:
            left.add(id(leaf))
        elif other is not leaf and not _is_real(other) and _is_real(leaf):
            raise Refused(f'{values.explain(leaf)}, which the node keeps, would be {other}')
    known = {id(leaf): leaf if other is _LEFT else _alike(leaf, other) for leaf, other in zip(leaves, others)}
    rebuilt = _rebuilt(kept, known)
    if not left:
        return rebuilt
    return [
        _LEFT if any(id(number) in left for number in numbers_in([value])) else other
        for value, other in zip(kept, rebuilt)
    ]


#: Instead of another value: what is kept is left as it is.
_LEFT = object()


def _is_real(value: Any) -> bool:
    """Return False if a value is not-a-number, or complex."""
    plain = values.plain_scalar(value)
    return plain is not None and not (type(plain) is float and math.isnan(plain))


def _reapplied_alone(leaf: object, changes: Mapping[Source, messages.Scalar]) -> Any:
    try:
        return values.reapply(leaf, changes)
    except values.OtherShape:
        return _LEFT
    except (ArithmeticError, ValueError, TypeError) as error:
        raise Refused(f'{values.explain(leaf)}, which the node keeps, would have no value: {error}') from None


def _alike(before: object, value: object) -> Any:
    """A value of the class of the one before: NumPy's number for one of NumPy's, a whole number for an int."""
    if type(values.plain_scalar(before)) is int:
        value = values.whole(value)
    kind = type(before)
    if type(value) is kind or not hasattr(before, 'tracked'):
        return value
    base: Any = kind.__base__
    return values.numpy_arrays().with_tracked(base(values.untracked(value)), value)


def _rebuilt(held: Sequence[Any], others: Dict[int, Any]) -> List[Any]:
    """Numbers, and tuples with other numbers in them; the same objects if nothing in them has changed.

    Args:
        held: the numbers and tuples as they were.
        others: {id of a number or tuple: the other one}, of each number; tuples are added, so that one object stays
            one.
    """
    waiting = list(held)
    while waiting:
        part = waiting[-1]
        if id(part) in others or not issubclass(type(part), tuple):
            waiting.pop()
            continue
        inner = list(tuple.__iter__(part))
        missing = [one for one in inner if issubclass(type(one), tuple) and id(one) not in others]
        if missing:
            waiting += missing
            continue
        parts = [others.get(id(one), one) for one in inner]
        if all(one is before for one, before in zip(parts, inner)):
            others[id(part)] = part
        else:
            made = others[id(part)] = tuple.__new__(type(part), parts)
            with contextlib.suppress(AttributeError):  # it has no attributes
                object.__getattribute__(made, '__dict__').update(object.__getattribute__(part, '__dict__'))
        waiting.pop()
    return [others[id(value)] for value in held]
