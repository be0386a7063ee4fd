"""The memory of this node: what it set up before its first round follows the locations that it was made of.

A node reads a number once and keeps it, or what it computed of it: in an attribute, a global, a list, a message, a
closure, a default argument, a local variable of a running function. What these slots hold when the first round begins
is the node's *configuration*. At a change, each slot that still holds the very same object gets the value that its
expression has now. A slot that holds another object has become part of the node's *state*, which goes on as it is.

`rounds` says when the first round begins. Until then a change reaches all that is there.
"""

import builtins
import collections
import contextlib
import functools
import gc
import sys
import threading
import types
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple

import genpy

from rosslt import values
from rosslt.node.json_scalars import Refused
from rosslt.node.own_code import is_own_module
from rosslt.values import Slot, Source

_INTEGERS = {'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64', 'byte', 'char'}
#: Classes of other modules whose objects hold what a program puts there.
_NAMESPACES = {('types', 'SimpleNamespace'), ('argparse', 'Namespace')}


class Following(NamedTuple):
    """What slots get at a change.

    Attributes:
        slots: `(index of the slot, its other value)` of those that depend on what changes.
        arrays: `(index of the array, [(index of an element, its other value), ...])`.
    """

    slots: List[Tuple[int, Any]]
    arrays: List[Tuple[int, List[Tuple[Tuple[int, ...], Any]]]]


class Memory:
    """The configuration of this process, which is one node.

    Attributes:
        has_begun: whether the first round has begun.
        changes: how many changes there were.
        begins: called once, when the first round has begun.
        changed: called after each change with the ids of the owners whose slots were set.
    """

    def __init__(self) -> None:
        self.has_begun = False
        self.changes = 0
        self.begins: List[Callable[[], None]] = []
        self.changed: Callable[[Set[int]], None] = lambda owners: None
        self._slots: List[Slot] = []
        self._arrays: List[Tuple[Any, Any]] = []  # each with what it held
        self._generators: List[types.GeneratorType] = []
        self._lock = threading.RLock()

    def begin(self) -> None:
        """Note the configuration: the first round begins."""
        with self._lock:
            if self.has_begun:
                return
            self._note()
            self.has_begun = True
        for function in self.begins:
            function()

    def _note(self) -> None:
        walk = _Walk()
        self._slots, self._arrays, self._generators = walk.slots, walk.arrays, walk.generators

    def following(self, changes: Mapping[Source, Any]) -> Following:
        """What the configuration becomes of other values of its sources.

        Raises:
            Refused: a part of it has no value then.
        """
        if not changes:
            return Following([], [])
        with self._lock:
            if not self.has_begun:
                self._note()
            self._forget_what_is_gone()
            # Looking at sources makes literals known, which may be changed by that: by what an earlier run has left.
            values.sources([number for slot in self._slots for number in _numbers_in(slot.value)])
            slots = [
                (index, value)
                for index, value in enumerate(_reapplied([slot.value for slot in self._slots], changes))
                if value is not self._slots[index].value
            ]
            arrays = []
            for index, (array, noted) in enumerate(self._arrays):
                elements = noted.unwritten(array)
                others = _reapplied([element for _, element in elements], changes)
                pairs = [(at, other) for (at, one), other in zip(elements, others) if other is not one]
                if pairs:
                    arrays.append((index, pairs))
            return Following(slots, arrays)

    def follow(self, following: Following, readings: Mapping[int, Any]) -> None:
        """Set the slots, all at one moment.

        Args:
            following: as it was before the change.
            readings: {id of a reading: the one that the location gives now}.
        """
        with self._lock:
            self.changes += 1
            rows = []
            for index, value in following.slots:
                owner, key, before = self._slots[index]
                value = readings.get(id(before), value)
                rows.append((owner, key, before, _fitting(owner, key, before, value)))
            owners = set()
            for (index, _), row, is_done in zip(following.slots, rows, values.exchange(rows)):
                owner, key, before, value = row
                if is_done:
                    self._slots[index] = Slot(owner, key, value)
                    owners.add(id(owner))
            for index, pairs in following.arrays:
                array, _ = self._arrays[index]
                for at, value in pairs:
                    array[at] = value
                self._arrays[index] = array, values.numpy_arrays().Noted(array)
                owners.add(id(array))
        self.changed(owners)

    def _forget_what_is_gone(self) -> None:
        """Forget the local variables of functions and generators that have ended."""
        self._generators = [one for one in self._generators if one.gi_frame is not None]
        frames = {id(frame) for frame in _running()} | {id(one.gi_frame) for one in self._generators}
        self._slots = [
            slot for slot in self._slots if type(slot.owner) is not types.FrameType or id(slot.owner) in frames
        ]


MEMORY = Memory()
"""The memory of this process."""


def _fitting(owner: Any, key: Any, before: Any, value: Any) -> Any:
    """A value as its slot takes it: a whole number if it is a field of whole numbers of a message.

    What is no whole number stays as it was: the node could not send it.
    """
    if isinstance(owner, genpy.Message) and type(values.plain_scalar(value)) is float:
        kind = dict(zip(owner.__slots__, owner._slot_types)).get(key)
        if kind in _INTEGERS:
            whole = values.to_int(value)
            return whole if whole == value else before
    return value


def _reapplied(kept: List[Any], changes: Mapping[Source, Any]) -> List[Any]:
    """Values, numbers or tuples, as they are after changes: the same objects if they do not depend on them.

    Raises:
        Refused: one has no value.
    """
    leaves: Dict[int, Any] = {}
    for value in kept:
        for leaf in _numbers_in(value):
            leaves[id(leaf)] = leaf
    try:
        others = values.reapply(list(leaves.values()), changes)
    except (ArithmeticError, ValueError, TypeError):
        others = [_reapplied_alone(leaf, changes) for leaf in leaves.values()]
    by_id = {id(leaf): _alike(leaf, other) for leaf, other in zip(leaves.values(), others)}
    return [_rebuilt(value, by_id) for value in kept]


def _reapplied_alone(leaf: Any, changes: Mapping[Source, Any]) -> Any:
    try:
        return values.reapply(leaf, changes)
    except (ArithmeticError, ValueError, TypeError) as error:
        raise Refused(f'{values.explain(leaf)}, which the node keeps, would have no value: {error}') from None


def _alike(before: Any, value: Any) -> Any:
    """A value of the class of the one before: NumPy's number instead of one of NumPy's."""
    kind = type(before)
    if type(value) is kind or not hasattr(before, 'tracked'):
        return value
    base: Any = kind.__base__
    return values.numpy_arrays().with_tracked(base(values.untracked(value)), value)


def _numbers_in(value: Any) -> Iterator[Any]:
    """The tracked scalars of one, or of a tuple that holds some."""
    if type(value) in values.TRACKED_CLASSES:
        yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from _numbers_in(part)


def _rebuilt(value: Any, others: Mapping[int, Any]) -> Any:
    """A number or tuple with other numbers in it; the same object if nothing in it is another one."""
    if not isinstance(value, tuple):
        return others.get(id(value), value)
    parts = [_rebuilt(part, others) for part in value]
    if all(map(lambda part, before: part is before, parts, value)):
        return value
    return type(value)(*parts) if hasattr(value, '_fields') else type(value)(parts)


def _running() -> Iterator[types.FrameType]:
    """The frames of the node's own functions that are running, without those of callbacks.

    What rospy or another package calls in a thread is a round of its own. In the main thread, all count.
    """
    main = threading.main_thread().ident
    for thread, frame in list(sys._current_frames().items()):
        stack = []
        outer: Optional[types.FrameType] = frame
        while outer is not None:
            stack.append(outer)
            outer = outer.f_back
        for one in reversed(stack):
            if one.f_globals.get('__name__') == 'threading':
                continue
            if is_own_module(one.f_globals):
                if one.f_code.co_name != '<module>':
                    yield one
            elif thread != main:
                break


class _Walk:
    """One walk over all that is the node's own.

    Attributes:
        slots: those that hold something tracked.
        arrays: the arrays that do, each with what it holds.
        generators: those that are under way.
    """

    def __init__(self) -> None:
        self.slots: List[Slot] = []
        self.arrays: List[Tuple[Any, Any]] = []
        self.generators: List[types.GeneratorType] = []
        self._waiting: List[Any] = []
        self._seen: Set[int] = {id(vars(builtins))}
        self._own_classes: Dict[type, bool] = {}
        self._own_names = {
            name: is_own_module(vars(module))
            for name, module in list(sys.modules.items())
            if isinstance(module, types.ModuleType)
        }
        self._waiting += [vars(sys.modules[name]) for name, is_own in self._own_names.items() if is_own]
        if values.KEEPS_LOCALS:
            self._waiting += _running()
        self._waiting += [thing for thing in gc.get_objects() if self._is_root(thing)]
        while self._waiting:
            thing = self._waiting.pop()
            if id(thing) not in self._seen:
                self._seen.add(id(thing))
                self._look_into(thing)

    def _is_root(self, thing: Any) -> bool:
        kind = type(thing)
        if kind is types.FunctionType:
            return is_own_module(thing.__globals__)
        if issubclass(kind, type):
            return self._own_names.get(getattr(thing, '__module__', ''), False)
        return self._is_of_own_class(kind)

    def _is_of_own_class(self, kind: type) -> bool:
        known = self._own_classes.get(kind)
        if known is None:
            known = issubclass(kind, genpy.Message) or any(
                self._own_names.get(getattr(one, '__module__', ''), False) for one in kind.__mro__
            )
            self._own_classes[kind] = known
        return known

    def _look_into(self, thing: Any) -> None:
        kind = type(thing)
        if issubclass(kind, dict):
            self._hold(thing, list(thing.items()))
        elif issubclass(kind, (list, collections.deque)):
            self._hold(thing, list(enumerate(list(thing))))
        elif kind is types.FrameType:
            self._hold(thing, list(thing.f_locals.items()))
        elif kind is types.FunctionType:
            self._waiting += thing.__closure__ or ()
            self._waiting += [thing.__kwdefaults__, thing.__dict__]
            self._hold(thing, [('__defaults__', thing.__defaults__)])
        elif kind is types.GeneratorType:
            if thing.gi_frame is not None and values.KEEPS_LOCALS:
                self.generators.append(thing)
                self._waiting.append(thing.gi_frame)
        elif kind is types.CellType:
            with contextlib.suppress(ValueError):  # it is empty
                self._hold(thing, [(None, thing.cell_contents)])
        elif issubclass(kind, type):
            self._hold(thing, list(vars(thing).items()))
        elif issubclass(kind, functools.partial):
            self._waiting += [thing.func, thing.args, thing.keywords]
        elif issubclass(kind, types.MethodType):
            self._waiting += [thing.__func__, thing.__self__]
        elif issubclass(kind, genpy.Message):
            self._hold(thing, [(name, getattr(thing, name)) for name in thing.__slots__ if hasattr(thing, name)])
        elif getattr(thing, 'has_provenance', False) is True:
            self.arrays.append((thing, values.numpy_arrays().Noted(thing)))
        elif kind.__module__ == 'numpy' and getattr(getattr(thing, 'dtype', None), 'char', '') == 'O':
            self._hold(thing, [(index, thing[index]) for index in values.numpy_arrays().indices(thing)])
        if (kind.__module__, kind.__name__) in _NAMESPACES or (
            self._is_of_own_class(kind) and not issubclass(kind, type)
        ):
            self._hold_attributes(thing, kind)

    def _hold_attributes(self, thing: Any, kind: type) -> None:
        held = getattr(thing, '__dict__', None)
        if type(held) is dict:
            self._waiting.append(held)
        if issubclass(kind, genpy.Message):
            return
        for one in kind.__mro__:
            for name in [name for name, slot in vars(one).items() if type(slot) is types.MemberDescriptorType]:
                with contextlib.suppress(AttributeError):  # it holds nothing
                    self._hold(thing, [(name, object.__getattribute__(thing, name))])

    def _hold(self, owner: Any, items: List[Tuple[Any, Any]]) -> None:
        for key, value in items:
            kind = type(value)
            if kind in values.TRACKED_CLASSES:
                self.slots.append(Slot(owner, key, value))
            elif issubclass(kind, tuple):
                if any(True for _ in _numbers_in(value)):
                    self.slots.append(Slot(owner, key, value))
                self._waiting += value
            elif kind not in _ATOMS and (not _is_of_rospy(kind) or hasattr(kind, 'has_provenance')):
                self._waiting.append(value)


def _is_of_rospy(kind: type) -> bool:
    return str(getattr(kind, '__module__', '')).partition('.')[0] in ('rospy', 'rosslt')


_ATOMS = {float, int, str, bool, bytes, type(None), complex, types.ModuleType, types.BuiltinFunctionType}
