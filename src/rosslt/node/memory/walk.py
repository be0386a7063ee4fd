"""Walks once over all that is the node's own, and notes the places that hold something tracked.

It runs none of the node's own code: classes are asked through what Python itself keeps of them, which no metaclass,
property or `__getattribute__` can stand in for. Other threads go on meanwhile: each container is read as it is at
one moment.
"""

import builtins
import collections
import functools
import gc
import itertools
import math
import sys
import threading
import types
import weakref
from typing import Any, Callable, ClassVar, Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

import genpy

from rosslt import values
from rosslt.node.memory.holders import Holder, is_foreign, module_of
from rosslt.node.memory.own_code import is_own_module

#: What gives an owner, as in `values.exchange`; None if it is gone.
Reference = Callable[[], Any]
_Look = Callable[[Any], None]

_names_of: Any = vars(type)['__dict__'].__get__
_bases_of: Any = vars(type)['__mro__'].__get__
_name_of: Any = vars(type)['__name__'].__get__

_FRAMES = {types.GeneratorType: 'gi_frame', types.CoroutineType: 'cr_frame', types.AsyncGeneratorType: 'ag_frame'}

_REFERENCES = 3
"""How many references there are to the local variables of a frame if nobody else has them: its own, that of who looks,
and that of who counts."""


class Slot:
    """A place that holds something tracked.

    Attributes:
        owner: gives its owner.
        key: as in `values.exchange`.
        value: the number, or the tuple with some in it; for a list or deque, a tuple of those of its elements.
    """

    __slots__ = ('key', 'owner', 'value')

    def __init__(self, owner: Reference, key: Any, value: Any) -> None:
        self.owner, self.key, self.value = owner, key, value


class Walk:
    """A walk over all that is the node's own.

    Args:
        has_sent: look also into messages that nothing of the node's own refers to: latched ones, those on their way.
        most: end once there are more slots than this.

    Attributes:
        slots: the places that hold something tracked.
        arrays: weak references to the arrays that do, each with what it holds.
        frames: {id: frame} of the functions that are running and have such local variables.
        holders: what the node's own things refer to, is not looked into, and is made of tracked numbers.
    """

    def __init__(self, has_sent: bool = True, most: float = math.inf) -> None:
        self._has_sent = has_sent
        self.slots: List[Slot] = []
        self.arrays: List[Tuple[Reference, Any]] = []
        self.frames: Dict[int, types.FrameType] = {}
        self._waiting: List[Any] = []
        self._seen: Set[int] = {id(vars(builtins))}
        # By the ids of classes.
        self._kinds: Dict[int, type] = {}  # so that no other class gets the id of one
        self._own_classes: Dict[int, bool] = {}
        self._looks: Dict[int, Sequence[_Look]] = {}
        self._foreign_classes: Set[int] = set()
        self._foreign: Dict[int, Tuple[str, Any]] = {}  # by id, with the name by which it was found
        self._tracked = _ids_of_tracked()
        self._own_names = {
            name: is_own_module(vars(module))
            for name, module in items_of(sys.modules)
            if isinstance(module, types.ModuleType)
        }
        self._waiting += [vars(sys.modules[name]) for name, is_own in self._own_names.items() if is_own]
        if values.KEEPS_LOCALS:
            self._waiting += running()
        # There are some hundred thousand objects, of few classes.
        objects = gc.get_objects()
        self._kinds.update((id(kind), kind) for kind in map(type, objects))
        kinds = {number for number, kind in self._kinds.items() if self._may_be_root(kind)}
        self._waiting += [thing for thing in objects if id(type(thing)) in kinds and self._is_root(thing)]
        del objects
        while self._waiting and len(self.slots) <= most:
            thing = self._waiting.pop()
            if id(thing) not in self._seen:
                self._seen.add(id(thing))
                try:
                    for look in self._looks_of(type(thing)):
                        look(thing)
                except Exception:  # of an object that cannot be looked into
                    continue
        holders = [Holder(name, thing) for name, thing in self._foreign.values()]
        self._foreign.clear()  # the node may let go of them, and this walk lives until garbage is collected
        self.holders = [holder for holder in holders if holder.is_made_of_numbers]

    def _may_be_root(self, kind: type) -> bool:
        is_code = kind is types.FunctionType or any(kind is one for one in _FRAMES)
        is_left = issubclass(kind, genpy.Message) and not self._has_sent
        return is_code or issubclass(kind, type) or (self._is_of_own_class(kind) and not is_left)

    def _is_root(self, thing: Any) -> bool:
        kind = type(thing)
        if self._is_of_own_class(kind):
            return True
        if kind is types.FunctionType:
            return is_own_module(thing.__globals__)
        if issubclass(kind, type):
            return self._is_own_class(thing)
        frame = frame_of(thing)
        return frame is not None and is_own_module(frame.f_globals)

    def _is_of_own_class(self, kind: type) -> bool:
        known = self._own_classes.get(id(kind))
        if known is None:
            known = issubclass(kind, genpy.Message) or any(map(self._is_own_class, _bases_of(kind)))
            self._own_classes[id(kind)] = known
        return known

    def _is_own_class(self, kind: type) -> bool:
        return self._own_names.get(module_of(kind), False)

    def _looks_of(self, kind: type) -> Sequence[_Look]:
        """Return the functions that look into the objects of a class."""
        looks = self._looks.get(id(kind))
        if looks is None:
            self._kinds[id(kind)] = kind
            looks = self._looks[id(kind)] = list(self._looks_into(kind))
            if not looks and id(kind) not in self._tracked and is_foreign(kind):
                self._foreign_classes.add(id(kind))
        return looks

    def _looks_into(self, kind: type) -> Iterator[_Look]:
        for exact, look in self._OF_CLASSES.items():
            if kind is exact:
                yield getattr(self, look)
                return
        if issubclass(kind, type):
            yield self._look_into_class
            return
        if not _is_of_rospy(kind):
            yield from (getattr(self, look) for base, look in self._OF_BASES.items() if issubclass(kind, base))
        names = [(module_of(base), _name_of(base)) for base in _bases_of(kind)]
        if any('has_provenance' in _names_of(base) for base in _bases_of(kind)):
            yield self._look_into_tracked_array
        elif ('numpy', 'ndarray') in names:
            yield self._look_into_array
        if any('numbers_with_provenance' in _names_of(base) for base in _bases_of(kind)):
            yield self._look_into_numbers_of
        if self._is_of_own_class(kind) or any(name in names for name in _NAMESPACES):
            yield self._look_at_attributes(kind)

    def _look_into_dict(self, thing: Any) -> None:
        self._hold(thing, items_of(thing))

    def _look_into_list(self, thing: object) -> None:
        noted = self._noted(enumerate(elements_of(thing)))
        if noted:
            self.slots.append(Slot(_refer(thing), None, tuple(element for _, element in noted)))

    def _look_into_tuple(self, thing: Any) -> None:
        self._waiting += tuple.__iter__(thing)

    def _look_into_class(self, thing: object) -> None:
        self._hold(thing, items_of(_names_of(thing)))

    def _look_into_frame(self, thing: types.FrameType) -> None:
        self._look_into_locals(thing, self._refer_to_running)

    def _look_into_locals(self, frame: types.FrameType, refer: Callable[[Any], Reference]) -> None:
        held = frame.f_locals
        self._hold(frame, items_of(held), refer)
        # Python would keep what it holds for as long as the function runs; nobody else has it.
        if sys.getrefcount(held) <= _REFERENCES:
            held.clear()

    def _refer_to_running(self, frame: types.FrameType) -> Reference:
        self.frames[id(frame)] = frame
        return functools.partial(self.frames.get, id(frame))

    def _look_into_suspended(self, thing: object) -> None:
        frame, reference = frame_of(thing), weakref.ref(thing)
        if frame is not None and values.KEEPS_LOCALS and id(frame) not in self._seen:
            self._seen.add(id(frame))
            self._look_into_locals(frame, lambda _: lambda: frame_of(reference()))

    def _look_into_function(self, thing: Any) -> None:
        self._waiting += thing.__closure__ or ()
        self._waiting += [thing.__kwdefaults__, thing.__dict__]
        self._hold(thing, [('__defaults__', thing.__defaults__)])

    def _look_into_cell(self, thing: Any) -> None:
        self._hold(thing, [(None, thing.cell_contents)])

    def _look_into_partial(self, thing: Any) -> None:
        self._waiting += [thing.func, thing.args, thing.keywords]

    def _look_into_method(self, thing: Any) -> None:
        self._waiting += [thing.__func__, thing.__self__]

    def _look_into_tracked_array(self, thing: Any) -> None:
        if thing.has_provenance is True and thing.flags.writeable:
            self.arrays.append((weakref.ref(thing), values.numpy_arrays().Noted(thing)))

    def _look_into_numbers_of(self, thing: Any) -> None:
        self._waiting.append(getattr(thing, 'numbers_with_provenance', None))  # those of a subclass have none

    def _look_into_array(self, thing: Any) -> None:
        if thing.dtype.char == 'O':
            self._hold(thing, [(index, thing[index]) for index in itertools.product(*map(range, thing.shape))])

    _OF_CLASSES: ClassVar[Dict[type, str]] = {
        dict: '_look_into_dict',
        list: '_look_into_list',
        tuple: '_look_into_tuple',
        types.FrameType: '_look_into_frame',
        types.FunctionType: '_look_into_function',
        **dict.fromkeys(_FRAMES, '_look_into_suspended'),
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

    def _look_at_attributes(self, kind: type) -> _Look:
        """Return a function that looks at the attributes of the objects of a class."""
        names = {name: thing for one in reversed(_bases_of(kind)) for name, thing in items_of(_names_of(one))}
        attributes = names.pop('__dict__', None)
        has_attributes = type(attributes) in (types.GetSetDescriptorType, types.MemberDescriptorType)
        members = [(name, one) for name, one in names.items() if type(one) is types.MemberDescriptorType]

        def refer_to_attributes(thing: object) -> Reference:
            reference = _refer(thing)
            return lambda: None if reference() is None else attributes.__get__(reference())

        def look(thing: object) -> None:
            if has_attributes:
                self._hold(thing, items_of(attributes.__get__(thing)), refer_to_attributes)
            for name, member in members:
                try:
                    held = member.__get__(thing)
                except AttributeError:  # it holds nothing
                    continue
                self._hold(thing, [(name, held)])

        return look

    def _hold(
        self, owner: object, items: Iterable[Tuple[object, object]], refer: Optional[Callable[[Any], Reference]] = None
    ) -> None:
        noted = self._noted(items)
        if noted:
            reference = (refer or _refer)(owner)
            self.slots += [Slot(reference, key, value) for key, value in noted]

    def _noted(self, items: Iterable[Tuple[object, object]]) -> List[Tuple[Any, Any]]:
        """The tracked items; containers among the items are searched later."""
        noted = []
        for key, value in items:
            kind = type(value)
            looks = self._looks.get(id(kind))
            if looks is None:
                looks = self._looks_of(kind)
            if looks:
                self._waiting.append(value)
                if issubclass(kind, tuple) and numbers_in([value]):
                    noted.append((key, value))
            elif id(kind) in self._tracked:
                noted.append((key, value))
            elif id(kind) in self._foreign_classes:
                if type(key) is str or id(value) not in self._foreign:
                    self._foreign[id(value)] = key if type(key) is str else '', value
        return noted


_NAMESPACES = [
    *(('types', 'SimpleNamespace'), ('argparse', 'Namespace')),
    *(('collections', 'UserDict'), ('collections', 'UserList'), ('collections', 'ChainMap')),
]
"""Classes of other modules whose objects hold what a program puts there."""


def _is_of_rospy(kind: type) -> bool:
    """Return whether a class is one of rospy or rosslt: what its objects hold is not the node's own."""
    return module_of(kind).partition('.')[0] in ('rospy', 'rosslt')


def _refer(owner: object) -> Reference:
    """Refer to an owner, which is not kept alive for it if Python can do without."""
    try:
        return weakref.ref(owner)
    except TypeError:
        return lambda: owner


def frame_of(thing: object) -> Optional[types.FrameType]:
    """The frame of a generator or coroutine; None if it has ended, or is gone."""
    return None if thing is None else getattr(thing, _FRAMES[type(thing)])


def items_of(thing: Any) -> List[Tuple[Any, Any]]:
    """The items of a dict, or of the names of a class, as they are at one moment.

    Python may collect garbage between two of them, and a finalizer let another thread run, which may add others.
    """
    items = dict.items(thing) if issubclass(type(thing), dict) else thing.items()
    while True:
        try:
            return list(items)
        except RuntimeError:  # they have changed meanwhile
            continue


def elements_of(thing: object) -> List[Any]:
    """The elements of a list or deque."""
    kind: Any = list if issubclass(type(thing), list) else collections.deque
    return list(kind.__iter__(thing))


def _ids_of_tracked() -> Set[int]:
    """The ids of the classes of tracked scalars: another class may have a metaclass without a hash."""
    return set(map(id, values.TRACKED_CLASSES))


def numbers_in(held: Iterable[Any]) -> List[Any]:
    """The tracked scalars among values, and in those that are tuples at any depth; each object once."""
    found, waiting, seen, tracked = [], list(held), set(), _ids_of_tracked()
    while waiting:
        part = waiting.pop()
        if id(part) in seen:
            continue
        kind = type(part)
        if id(kind) in tracked:
            seen.add(id(part))
            found.append(part)
        elif issubclass(kind, tuple):
            seen.add(id(part))
            waiting += tuple.__iter__(part)
    return found


def running() -> Iterator[types.FrameType]:
    """The frames of the node's own functions that are running, without those of callbacks.

    A function that rospy or another package calls in a thread is a round of its own. In the main thread, all count.
    """
    main = threading.main_thread().ident
    for thread, stack in _stacks().items():
        for one in reversed(stack):
            if one.f_globals.get('__name__') == 'threading':
                continue
            if is_own_module(one.f_globals):
                if one.f_code.co_name != '<module>':
                    yield one
            elif thread != main:
                break


def _stacks() -> Dict[int, List[types.FrameType]]:
    """The frames of each thread, the inner ones first. Garbage is collected later: CPython before 3.11.5 holds a lock
    meanwhile for which a destructor may wait for ever (its issue 106883), and a destructor may let another thread end
    the function whose frame `f_back` is about to make."""
    found: Dict[int, List[types.FrameType]] = {}
    is_collected = gc.isenabled()
    gc.disable()
    try:
        for thread, frame in sys._current_frames().items():
            outer: Optional[types.FrameType] = frame
            stack = found[thread] = []
            while outer is not None:
                stack.append(outer)
                outer = outer.f_back
        return found
    finally:
        if is_collected:
            gc.enable()
