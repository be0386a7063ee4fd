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
import weakref
from typing import Any, Callable, ClassVar, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple

import genpy
import rospy

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
        self._generators: List[Any] = []  # weak references
        self._by_source: Optional[Dict[Source, List[int]]] = None  # the indices of slots
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
        walk = _Walk()
        self._slots, self._arrays, self._generators = walk.slots, walk.arrays, walk.generators
        self._by_source = None

    def _depending(self, changes: Mapping[Source, Any]) -> List[int]:
        """The indices of the slots whose values depend on sources."""
        if self._by_source is None:
            # Looking at sources makes literals known, which may be changed by that: by what an earlier run has left.
            values.sources([number for slot in self._slots for number in _numbers_in(slot.value)])
            self._by_source = {}
            for index, slot in enumerate(self._slots):
                for source in values.sources(list(_numbers_in(slot.value))):
                    self._by_source.setdefault(source, []).append(index)
        return sorted({index for source in changes for index in self._by_source.get(source, ())})

    def following(self, changes: Mapping[Source, Any]) -> Following:
        """What the configuration becomes of other values of its sources.

        Raises:
            Refused: a part of it has no value then.
        """
        if not changes:
            return Following([], [])
        try:
            return self._following(changes)
        except (Refused, RuntimeError, AttributeError, LookupError, MemoryError) as error:
            raise Refused(str(error)) from error

    def _following(self, changes: Mapping[Source, Any]) -> Following:
        with self._lock:
            if not self.has_begun:
                self._note()
            depending = self._depending(changes)
            self._forget_what_is_gone()
            depending = [index for index in depending if self._slots[index] is not _STATE]
            slots = list(zip(depending, _reapplied([self._slots[index].value for index in depending], changes)))
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
                self._slots[index] = Slot(owner, key, value) if is_done else _STATE
                if is_done:
                    owners.add(id(owner))
            for index, pairs in following.arrays:
                array, noted = self._arrays[index]
                unwritten = {at for at, _ in noted.unwritten(array)}
                for at, value in pairs:
                    if at in unwritten:
                        array[at] = value
                self._arrays[index] = array, values.numpy_arrays().Noted(array)
                owners.add(id(array))
        self.changed(owners)

    def _forget_what_is_gone(self) -> None:
        """Forget the local variables of functions and generators that have ended."""
        generators = [one for one in (reference() for reference in self._generators) if one is not None]
        frames = {id(frame) for frame in _running()} | {id(one.gi_frame) for one in generators}
        self._slots = [
            _STATE if type(slot.owner) is types.FrameType and id(slot.owner) not in frames else slot
            for slot in self._slots
        ]


_REFERENCES = 3
"""How many references there are to the local variables of a frame if nobody else has them: its own, that of who looks,
and that of who counts."""

_STATE = Slot(None, None, None)
"""Instead of a slot that the node has set since, or that is gone."""

MEMORY = Memory()
"""The memory of this process."""


def _fitting(owner: Any, key: Any, before: Any, value: Any) -> Any:
    """A value as its slot takes it: a whole number if it is a field of whole numbers of a message.

    A text instead of a number, or a number instead of a text, is not taken: the node would not get far with it.
    """
    plain, other = values.plain_scalar(before), values.plain_scalar(value)
    if (type(plain) is str) is not (type(other) is str):
        return before
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


def _numbers_in(value: Any) -> List[Any]:
    """The tracked scalars of one, or of a tuple that holds some at any depth."""
    found, waiting, seen = [], [value], set()
    while waiting:
        part = waiting.pop()
        if type(part) in values.TRACKED_CLASSES:
            found.append(part)
        elif issubclass(type(part), tuple) and id(part) not in seen:
            seen.add(id(part))
            waiting += tuple.__iter__(part)
    return found


def _rebuilt(value: Any, others: Dict[int, Any]) -> Any:
    """A number or tuple with other numbers in it; the same object if nothing in it is another one.

    Args:
        others: {id of a number or tuple: the other one}; tuples are added, so that one object stays one.
    """
    waiting = [value]
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
            if hasattr(made, '__dict__'):
                vars(made).update(vars(part))
        waiting.pop()
    return others.get(id(value), value)


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
        generators: weak references to those that are under way.
    """

    def __init__(self) -> None:
        self.slots: List[Slot] = []
        self.arrays: List[Tuple[Any, Any]] = []
        self.generators: List[Any] = []
        self._waiting: List[Any] = []
        self._seen: Set[int] = {id(vars(builtins))}
        # By the ids of classes: a metaclass may have no hash.
        self._own_classes: Dict[int, bool] = {}
        self._looks: Dict[int, List[Callable[[Any], None]]] = {}
        self._tracked = set(map(id, values.TRACKED_CLASSES))
        self._own_names = {
            name: is_own_module(vars(module))
            for name, module in list(sys.modules.items())
            if isinstance(module, types.ModuleType)
        }
        self._waiting += [vars(sys.modules[name]) for name, is_own in self._own_names.items() if is_own]
        if values.KEEPS_LOCALS:
            self._waiting += _running()
        # There are some hundred thousand objects, of few classes.
        objects = gc.get_objects()
        classes = {id(kind): kind for kind in map(type, objects)}
        kinds = {number for number, kind in classes.items() if self._may_be_root(kind)}
        self._waiting += [thing for thing in objects if id(type(thing)) in kinds and self._is_root(thing)]
        del objects
        while self._waiting:
            thing = self._waiting.pop()
            if id(thing) not in self._seen:
                self._seen.add(id(thing))
                with contextlib.suppress(Exception):  # of an object that cannot be looked into
                    self._look_into(thing)

    def _may_be_root(self, kind: type) -> bool:
        return (
            kind in (types.FunctionType, types.GeneratorType) or issubclass(kind, type) or self._is_of_own_class(kind)
        )

    def _is_root(self, thing: Any) -> bool:
        kind = type(thing)
        if kind is types.GeneratorType:
            return thing.gi_frame is not None and is_own_module(thing.gi_frame.f_globals)
        if kind is types.FunctionType:
            return is_own_module(thing.__globals__)
        if issubclass(kind, type):
            return self._is_own_class(thing)
        return self._is_of_own_class(kind)

    def _is_of_own_class(self, kind: type) -> bool:
        known = self._own_classes.get(id(kind))
        if known is None:
            known = issubclass(kind, genpy.Message) or any(map(self._is_own_class, type.mro(kind)))
            self._own_classes[id(kind)] = known
        return known

    def _is_own_class(self, kind: type) -> bool:
        try:
            return self._own_names.get(type.__getattribute__(kind, '__module__'), False)
        except (AttributeError, TypeError):  # a class of its own kind
            return False

    def _look_into(self, thing: Any) -> None:
        kind = type(thing)
        looks = self._looks.get(id(kind))
        if looks is None:
            looks = self._looks[id(kind)] = self._looks_into(kind)
        for look in looks:
            look(thing)

    def _looks_into(self, kind: type) -> List[Callable[[Any], None]]:
        """What looks into the objects of a class."""
        for exact, look in self._OF_CLASSES.items():
            if kind is exact:
                return [getattr(self, look)]
        if issubclass(kind, type):
            return [lambda thing: self._hold(thing, vars(thing).items())]
        if issubclass(kind, genpy.Message):
            return [self._look_into_message]
        looks: List[Callable[[Any], None]] = []
        for base, look in self._OF_BASES.items():
            if issubclass(kind, base):
                looks.append(getattr(self, look))
        if hasattr(kind, 'has_provenance'):
            looks.append(self._look_into_tracked_array)
        elif kind.__module__ == 'numpy':
            looks.append(self._look_into_array)
        if (kind.__module__, kind.__name__) in _NAMESPACES or self._is_of_own_class(kind):
            looks.append(self._look_at_attributes)
        return looks

    def _look_into_dict(self, thing: Any) -> None:
        self._hold(thing, dict.items(thing))

    def _look_into_list(self, thing: Any) -> None:
        kind: Any = list if isinstance(thing, list) else collections.deque
        self._hold(thing, enumerate(list(kind.__iter__(thing))))

    def _look_into_tuple(self, thing: Any) -> None:
        self._waiting += tuple.__iter__(thing)

    def _look_into_message(self, thing: Any) -> None:
        self._hold(thing, [(name, getattr(thing, name)) for name in thing.__slots__ if hasattr(thing, name)])

    def _look_into_frame(self, thing: Any) -> None:
        held = thing.f_locals
        self._hold(thing, held.items())
        # Python would keep what it holds for as long as the function runs; nobody else has it.
        if sys.getrefcount(held) <= _REFERENCES:
            held.clear()

    def _look_into_function(self, thing: Any) -> None:
        self._waiting += thing.__closure__ or ()
        self._waiting += [thing.__kwdefaults__, thing.__dict__]
        self._hold(thing, [('__defaults__', thing.__defaults__)])

    def _look_into_generator(self, thing: Any) -> None:
        if thing.gi_frame is not None and values.KEEPS_LOCALS:
            self.generators.append(weakref.ref(thing))
            self._waiting.append(thing.gi_frame)

    def _look_into_cell(self, thing: Any) -> None:
        with contextlib.suppress(ValueError):  # it is empty
            self._hold(thing, [(None, thing.cell_contents)])

    def _look_into_partial(self, thing: Any) -> None:
        self._waiting += [thing.func, thing.args, thing.keywords]

    def _look_into_method(self, thing: Any) -> None:
        self._waiting += [thing.__func__, thing.__self__]

    def _look_into_tracked_array(self, thing: Any) -> None:
        if thing.has_provenance is True and thing.flags.writeable:
            self.arrays.append((thing, values.numpy_arrays().Noted(thing)))

    def _look_into_array(self, thing: Any) -> None:
        if getattr(getattr(thing, 'dtype', None), 'char', '') == 'O':
            self._hold(thing, [(index, thing[index]) for index in values.numpy_arrays().indices(thing)])

    _OF_CLASSES: ClassVar[Dict[type, str]] = {
        dict: '_look_into_dict',
        list: '_look_into_list',
        tuple: '_look_into_tuple',
        types.FrameType: '_look_into_frame',
        types.FunctionType: '_look_into_function',
        types.GeneratorType: '_look_into_generator',
        types.CellType: '_look_into_cell',
        types.MethodType: '_look_into_method',
    }
    _OF_BASES: ClassVar[Dict[type, str]] = {
        dict: '_look_into_dict',
        list: '_look_into_list',
        collections.deque: '_look_into_list',
        functools.partial: '_look_into_partial',
        tuple: '_look_into_tuple',
    }

    def _look_at_attributes(self, thing: Any) -> None:
        with contextlib.suppress(AttributeError):  # it has none
            self._waiting.append(object.__getattribute__(thing, '__dict__'))
        for one in type(thing).__mro__:
            for name in [name for name, slot in vars(one).items() if type(slot) is types.MemberDescriptorType]:
                with contextlib.suppress(AttributeError):  # it holds nothing
                    self._hold(thing, [(name, object.__getattribute__(thing, name))])

    def _hold(self, owner: Any, items: Iterable[Tuple[Any, Any]]) -> None:
        for key, value in list(items):
            kind = type(value)
            if id(kind) in _ATOMS:
                continue
            if id(kind) in self._tracked:
                self.slots.append(Slot(owner, key, value))
            elif issubclass(kind, tuple):
                if _numbers_in(value):
                    self.slots.append(Slot(owner, key, value))
                self._waiting.append(value)
            elif not _is_of_rospy(kind) or hasattr(kind, 'has_provenance'):
                self._waiting.append(value)


def _is_of_rospy(kind: type) -> bool:
    return str(getattr(kind, '__module__', '')).partition('.')[0] in ('rospy', 'rosslt')


_ATOMS = set(map(id, (float, int, str, bool, bytes, type(None), complex, types.ModuleType, types.BuiltinFunctionType)))
"""The ids of classes of objects in which nothing is kept."""
