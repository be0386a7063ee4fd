"""Arrays of NumPy's own floats and ints that know where their elements come from.

Whatever computes with a `TrackedArray` gets the numbers that it would get without provenance, to the last bit: NumPy
computes them. One `Memory` holds the provenance for all views of an array; where an element of a view is found in it,
its address says, so every way to make a view is known. An operation is one node of the graph (`graph.Node`). An
element is looked up when it is read; a number that was written past this class is another one than its expression
gives, and so is plain.
"""

import bisect
import math
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

import numpy

from ..affine import LIMIT
from ..operations import LAZY
from ..recording import OF_PYTHON, spend
from ..tracked import new
from .graph import ELEMENTWISE, MAX_COPIED, Call, Gathering, Node, of_elements, shortened
from .numbers import (
    CLASSES,
    WITH_PROVENANCE,
    complete,
    of_numpy,
    plain_number,
    python_number,
    recorded,
    rounding_of,
    same_number,
    with_tracked,
)

Argument = Any
"""What NumPy's functions take, or give."""

_ARRAY: Any = numpy.ndarray
_NO_VALUE = getattr(numpy, '_NoValue', None)
_NUMBERS = (float, int, numpy.generic)
_CODE = numpy.dtype(numpy.int64)

#: What a function may take beside arrays and lists and be called again with.
_CONSTANTS = (type(None), bool, int, float, str, type, numpy.dtype, numpy.generic, slice, type(Ellipsis))


class Memory:
    """The provenance of the elements of an array, which all its views share.

    The elements of entries have codes: those of an entry follow each other, from its start on.

    Args:
        root: the plain array, whose elements follow each other in the memory.
        node: how it was made; None where nothing in it has provenance yet.

    Attributes:
        root: the same.
        entries: nodes and tracked numbers of Python, in the order in which they were written.
        starts: the code of the first element of each entry.
        is_tracked: whether all elements come from entries.
    """

    __slots__ = ('_codes', 'entries', 'is_tracked', 'root', 'starts')

    def __init__(self, root: Any, node: Optional[Node] = None) -> None:
        self.root = root
        self.entries: List[Any] = [] if node is None else [node]
        self.starts = [0]
        self.is_tracked = node is not None
        self._codes: Any = None

    def codes_of(self, view: Any) -> Any:
        """The codes of the elements of a view, -1 where they are plain. All views see what is written to them."""
        root = self.root
        if self._codes is None:
            self._codes = numpy.empty(root.size, _CODE)
            of_root = self._codes_at(root)
            of_root[...] = numpy.arange(root.size).reshape(root.shape) if self.entries else -1
        return self._codes_at(view)

    def _codes_at(self, view: Any) -> Any:
        if not view.size:
            return numpy.empty(view.shape, _CODE)
        width = view.itemsize
        offset = _address(view) - _address(self.root)
        strides = [stride // width * _CODE.itemsize for stride in view.strides]
        return numpy.ndarray(view.shape, _CODE, self._codes, offset // width * _CODE.itemsize, strides)

    def node_of(self, view: Any) -> Optional[Node]:
        """How the elements of a view were made; None if all of them are plain."""
        if not self.entries:
            return None
        if view._is_whole and self._codes is None:
            whole: Node = self.entries[0]
            if view.shape == whole.shape:
                return whole
        return self.gathered(view.codes, view)

    def gathered(self, codes: Any, numbers: Any) -> Optional[Node]:
        """How an array of elements was made that have such codes; None if all of them are plain."""
        if not self.is_tracked and not (codes >= 0).any():
            return None
        call = Gathering(codes.copy(), numpy.array(numbers), self.starts, self.entries)
        return Node(call, list(call.entries.values()), numbers, numbers.size)

    def write(self, codes: Any, key: Any, made: Any) -> None:
        """Set the provenance of what was written to some elements.

        Args:
            codes: of a view.
            key: the index of what was written.
            made: a node, a tracked number of Python, or None for plain numbers.
        """
        if made is None:
            self.is_tracked = False
            codes[key] = -1
            return
        if len(self.entries) > 2 * self.root.size + 16:
            self._forget_overwritten()
        start = 0
        if self.entries:
            last = self.entries[-1]
            start = self.starts[-1] + (math.prod(last.shape) if type(last) is Node else 1)
        if self.entries:
            self.starts.append(start)
        # Nodes keep the lists of entries that they were made of, to which others may be added.
        self.entries.append(made)
        if type(made) is Node:
            codes[key] = numpy.arange(start, start + math.prod(made.shape)).reshape(made.shape)
        else:
            codes[key] = start

    def _forget_overwritten(self) -> None:
        flat = self._codes
        at = numpy.searchsorted(self.starts, flat, 'right') - 1
        entries, starts, begin = [], [], 0
        for used in numpy.unique(at[flat >= 0]).tolist():
            entry = self.entries[used]
            entries.append(entry)
            starts.append(begin)
            chosen = at == used
            flat[chosen] += begin - self.starts[used]
            begin += math.prod(entry.shape) if type(entry) is Node else 1
        self.entries, self.starts = entries, starts

    def read(self, number: Any, code: int) -> Any:
        """A number that was read from the array, of NumPy or of Python, with the provenance of an element."""
        if code < 0:
            return number
        at = bisect.bisect(self.starts, code) - 1 if len(self.entries) > 1 else 0
        entry = self.entries[at]
        return lazy_number(number, entry, code - self.starts[at], self.root.dtype.type)


def _address(array: Any) -> int:
    address: int = array.__array_interface__['data'][0]
    return address


def lazy_number(number: Any, entry: Any, index: int, kind: Any) -> Any:
    """A number with the provenance of an element, which is looked up when it is needed.

    Args:
        number: of NumPy or of Python, whose class can have provenance.
        entry: a node, or the tracked number itself.
        index: the index of the element in the node.
        kind: the class of the numbers of the array.
    """
    is_numpy = type(number) in CLASSES
    known = entry.known(index) if type(entry) is Node else entry
    if known is not LAZY:
        return with_tracked(number, known) if is_numpy else same_number(number, known, rounding_of(kind))
    if is_numpy:
        return of_numpy(number, new(number.item(), (LAZY, entry, index), entry.size))
    return new(number, (LAZY, entry, index), entry.size)


class TrackedArray(numpy.ndarray):
    """An array of floats or ints with the provenance of its elements. Made by `array`, and by NumPy of others."""

    __class__: Any = property(lambda self: numpy.ndarray)
    _memory: Optional[Memory] = None
    _codes: Any = None
    _is_whole = False

    def __array_finalize__(self, original: Any) -> None:
        memory = getattr(original, '_memory', None)
        if memory is not None:
            base = self.base
            is_view = base is not None and (base is original or base is original.base)
            if is_view and self.dtype == memory.root.dtype:
                self._memory = memory

    @property
    def has_provenance(self) -> bool:
        """True if any element may have provenance."""
        return self._memory is not None and bool(self._memory.entries)

    @property
    def codes(self) -> Any:
        """The codes of the elements in their memory."""
        assert self._memory is not None
        if self._codes is None or self._codes.shape != self.shape:
            self._codes = self._memory.codes_of(self)
        return self._codes

    def of(self, numbers: Any) -> Any:
        """The array of other numbers, in lists, of the same type."""
        return of_list(numbers, self.dtype)

    def forget(self) -> None:
        """Cut the elements off from where they come from, in all views of them."""
        if self.has_provenance:
            self.write_provenance(..., None)

    def write_provenance(self, key: Any, made: Any) -> None:
        """Set the provenance of what was written to some elements: see `Memory.write`."""
        if self._memory is not None and (made is not None or self._memory.entries):
            self._memory.write(self.codes, key, made)

    def __getitem__(self, key: Any) -> Any:
        found = _ARRAY.__getitem__(self, key)
        memory = self._memory
        if type(found) is TrackedArray:
            return found if found._memory is not None else self._moved(found, lambda codes: codes[plain(key)])
        if memory is None or not memory.entries or type(found) not in CLASSES or not spend(OF_PYTHON):
            return found
        return memory.read(found, int(self.codes[key if type(key) is int else plain(key)]))

    def _moved(self, found: Any, move: Callable[[Any], Any]) -> Any:
        """A copy of some elements with their provenance.

        Args:
            found: the copy.
            move: does to the codes of this array what made the copy.
        """
        memory = self._memory
        if memory is None or not memory.entries:
            return found.view(numpy.ndarray)
        return with_node(found.view(numpy.ndarray), memory.gathered(move(self.codes), found.view(numpy.ndarray)))

    def __setitem__(self, key: Any, value: Any) -> None:
        if self._memory is None:
            super().__setitem__(key, plain(value))
            return
        made = provenance_of(value)
        super().__setitem__(key, plain(value))
        self.write_provenance(plain(key), made)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Argument, **options: Argument) -> Any:
        return compute(ufunc, method, inputs, options)

    def __array_function__(
        self, function: Any, types: Iterable[Any], arguments: Iterable[Argument], options: Mapping[str, Argument]
    ) -> Any:
        return call(function, tuple(arguments), dict(options))

    def __copy__(self) -> 'TrackedArray':
        return self.copy('K')

    def __deepcopy__(self, _: Any) -> 'TrackedArray':
        return self.copy('K')

    def __reduce_ex__(self, protocol: Any) -> Any:
        return (of_list, (self.tolist(), self.dtype)) if self.has_provenance else plain(self).__reduce_ex__(protocol)

    def __repr__(self) -> str:
        return repr(plain(self))

    def tolist(self) -> Any:
        """Override the method of `numpy.ndarray`: tracked elements become tracked numbers of Python."""
        return self._listed(super().tolist(), self.codes) if self.has_provenance else super().tolist()

    def _listed(self, numbers: Any, codes: Any) -> Any:
        if type(numbers) is list:
            return [self._listed(*pair) for pair in zip(numbers, codes)]
        assert self._memory is not None
        return self._memory.read(numbers, int(codes))

    def item(self, *index: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        found = super().item(*plain(index))
        return self._listed(found, self.codes.item(*plain(index))) if self.has_provenance else found

    def astype(self, dtype: Any, *arguments: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        made = plain(self).astype(dtype, *arguments, **options)
        if made.dtype == object and self.has_provenance:
            made[...] = numpy.array([*self.reshape(-1).tolist(), None], object)[:-1].reshape(self.shape)
            return made
        node = provenance_of(self)
        # Numbers of 32 bits would be too coarse to be differentiated.
        target = numpy.dtype(float) if made.dtype.kind == 'f' else made.dtype
        return wrapped(made, Call(_converted, (node, target), {}), [node], 0) if node is not None else made

    def copy(self, order: Any = 'C') -> Any:
        """Override the method of `numpy.ndarray` to keep provenance, or the readiness to have some."""
        if self.has_provenance:
            return self._moved(super().copy(order), lambda codes: codes)
        return receptive(plain(self).copy(order))

    def fill(self, value: Any) -> None:
        """Override the method of `numpy.ndarray` to keep provenance."""
        self[...] = value

    def clip(self, *bounds: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray`, which takes one bound alone, too."""
        low = options.pop('min', bounds[0] if bounds else None)
        high = options.pop('max', bounds[1] if len(bounds) > 1 else None)
        return numpy.clip(self, low, high, *bounds[2:], **options)

    @property
    def flat(self) -> Any:
        """Override the attribute of `numpy.ndarray`: a view in one dimension where there is one. Elsewhere what is
        written would not be seen, so the elements are cut off."""
        if self.flags.c_contiguous:
            return self.reshape(-1)
        self.forget()
        return plain(self).flat

    @flat.setter
    def flat(self, values: Any) -> None:
        self.forget()
        plain(self).flat = plain(values)

    def resize(self, *shape: Any, refcheck: bool = True) -> None:
        """Override the method of `numpy.ndarray`, which resizes no view, as this is one: the elements are cut off."""
        if self._memory is None or self.size != self._memory.root.size:
            numpy.ndarray.resize(self, *shape, refcheck=refcheck)  # which says that it is a view
        made = plain(self).copy()
        made.resize(*shape, refcheck=False)
        self._memory = self._codes = None
        self.__setstate__((1, made.shape, made.dtype, False, made.tobytes()))


def _converted(x: Any, dtype: Any) -> Any:
    return x if x.dtype == object else x.astype(dtype)


def _moving(name: str) -> Callable[..., Any]:
    """A method that gives a view or a copy of some elements."""
    original = getattr(numpy.ndarray, name)

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        found = original(self, *plain(arguments), **plain(options))
        if type(found) is not TrackedArray or found._memory is not None:
            return found
        return self._moved(found, lambda codes: getattr(codes, name)(*plain(arguments), **plain(options)))

    method.__name__ = name
    return method


def _computing(name: str) -> Callable[..., Any]:
    """A method that does what the function of that name does."""

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        return getattr(numpy, name)(self, *arguments, **options)

    method.__name__ = name
    return method


def _writing(name: str) -> Callable[..., Any]:
    """A method that writes numbers without provenance."""
    original = getattr(numpy.ndarray, name)

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        self.forget()
        return original(self, *plain(arguments), **plain(options))

    method.__name__ = name
    return method


for _make, _names in (
    (_moving, 'reshape ravel flatten take repeat compress'),
    (_computing, 'cumsum cumprod dot trace mean round std var ptp'),
    (_writing, 'put sort partition itemset byteswap setfield'),
):
    for _name in _names.split():
        if hasattr(numpy.ndarray, _name):  # not every NumPy has all of them
            setattr(TrackedArray, _name, _make(_name))

ARRAYS = frozenset({numpy.ndarray, TrackedArray, list, tuple})
"""The classes of operands that are computed element by element."""


def plain(x: Argument) -> Any:
    """An argument without provenance, at any depth of lists and dicts."""
    kind = type(x)
    if kind is TrackedArray:
        return _ARRAY.view(x, numpy.ndarray)
    if kind in (list, tuple):
        return kind([plain(part) for part in x])
    if kind is dict:
        return {name: plain(part) for name, part in x.items()}
    return plain_number(x)


def holds_tracked(x: Argument) -> bool:
    """Return True for a tracked number or array, and for a list or tuple that holds one at any depth."""
    kind = type(x)
    if kind in WITH_PROVENANCE:
        return True
    if kind is TrackedArray:
        return bool(x.has_provenance)
    return kind in (list, tuple) and any(map(holds_tracked, x))


def provenance_of(value: Argument) -> Any:
    """The node of an array or of a list of numbers, or the tracked number of Python; None for anything plain."""
    kind = type(value)
    if kind in WITH_PROVENANCE:
        return python_number(value)
    if kind is TrackedArray:
        return value._memory and value._memory.node_of(value)
    if kind in (list, tuple) and holds_tracked(value):
        return node_of_list(value, numpy.asarray(plain(value)))
    return None


def node_of_list(numbers: Argument, result: Any) -> Optional[Node]:
    """The node of the array that NumPy makes of a list with tracked numbers or arrays."""
    elements: List[Any] = []
    _flatten(numbers, elements)
    is_known = len(elements) == result.size and result.dtype.kind in 'iuf' and holds_tracked(elements)
    return of_elements(elements, result) if is_known else None


def of_list(numbers: Argument, dtype: Any) -> Any:
    """The array of a list of numbers, at any depth."""
    made = numpy.array(plain(numbers), dtype)
    return with_node(made, node_of_list([numbers], made))


def _flatten(numbers: Argument, elements: List[Any]) -> None:
    for part in numbers:
        if type(part) is TrackedArray or isinstance(part, numpy.ndarray):
            part = part.tolist()
        if type(part) in (list, tuple):
            _flatten(part, elements)
        else:
            elements.append(python_number(part))


def with_node(made: Any, node: Optional[Node]) -> Any:
    """A plain array with the provenance that a node says; itself where there is none, or no class for it."""
    if node is None or type(made) is not numpy.ndarray or made.dtype.kind not in 'iuf':
        return made
    if node.size > LIMIT:
        node = shortened(node, made)
    if not made.flags.forc:
        made = made.copy('K')
        made = made if made.flags.forc else made.copy()
    return _of_memory(made, Memory(made, node))


def receptive(made: Any) -> Any:
    """A plain array as one that tracked numbers can be written to."""
    if type(made) is not numpy.ndarray or made.dtype.kind not in 'iuf' or made.base is not None:
        return made
    return _of_memory(made, Memory(made))


def _of_memory(made: Any, memory: Memory) -> TrackedArray:
    array: TrackedArray = made.view(TrackedArray)
    array._memory = memory
    array._is_whole = made is memory.root
    return array


def wrapped(result: Any, call: Call, operands: Sequence[Any], copied: int) -> Any:
    """A result of NumPy with its provenance: an array, a number, or a tuple or list of these.

    Args:
        result: what NumPy gives.
        call, operands, copied: as of `graph.Node`.
    """
    if type(result) in (list, tuple) or (isinstance(result, tuple) and hasattr(result, '_fields')):
        parts = [
            wrapped(part, Call(call.function, call.args, call.options, at), operands, copied)
            for at, part in enumerate(result)
        ]
        return type(result)(*parts) if hasattr(result, '_fields') else type(result)(parts)
    kind = type(result)
    if kind is not numpy.ndarray and kind not in CLASSES:
        return result
    if result.dtype.kind != 'f' and not _is_of_ints(call, operands):
        return result
    node = Node(call, operands, result, copied)
    if kind is numpy.ndarray:
        return with_node(result, node)
    if node.size > LIMIT:
        node = shortened(node, result)
    return lazy_number(result, node, 0, kind)


def _is_of_ints(call: Call, operands: Sequence[Any]) -> bool:
    """Return True if a function that gives whole numbers computes with such: they are no indices."""
    kinds = [operand.kind if type(operand) is Node else type(operand._plain) for operand in operands]
    name = getattr(call.function, '__name__', '')
    is_index = name.startswith('arg') or name in ('searchsorted', 'digitize', 'count_nonzero', 'bincount')
    is_of_ints = all(issubclass(kind, (int, numpy.integer)) for kind in kinds)
    return name == '_converted' or (is_of_ints and not is_index)


class _Captured:
    """The arguments of a call, as a node keeps them.

    Attributes:
        arrays: those of this class among them.
        operands: the nodes and tracked numbers in them.
        copied: how many elements were copied.
        is_whole: whether it may be called with them again.
    """

    def __init__(self) -> None:
        self.arrays: List[TrackedArray] = []
        self.operands: List[Any] = []
        self.copied = 0
        self.is_whole = True

    def __call__(self, x: Argument) -> Any:
        """An argument with nodes for arrays with provenance, and plain arrays copied: the program may change them."""
        kind = type(x)
        if kind in WITH_PROVENANCE or kind is TrackedArray:
            if kind is TrackedArray:
                self.arrays.append(x)
            made = provenance_of(x)
            if made is None:
                return self(plain(x))
            self.operands.append(made)
            return made
        if isinstance(x, numpy.ndarray):
            self.copied += x.size
            self.is_whole = self.is_whole and x.dtype.kind in 'biuf' and self.copied < MAX_COPIED
            return x.copy() if self.is_whole else x
        if kind in (list, tuple):
            if _is_of_numbers(x):
                made = provenance_of(x)
                if made is not None:
                    self.operands.append(made)
                    return made
            return kind([self(part) for part in x])
        self.is_whole = self.is_whole and (isinstance(x, _CONSTANTS) or x is _NO_VALUE)
        return x


def _is_of_numbers(x: Argument) -> bool:
    """Return True for a list that has tracked numbers, at any depth, and no arrays."""
    for part in x:
        kind = type(part)
        if kind in (list, tuple):
            if not _is_of_numbers(part):
                return False
        elif isinstance(part, numpy.ndarray):
            return False
    return holds_tracked(x)


def compute(ufunc: Any, method: str, inputs: Sequence[Argument], options: Dict[str, Argument]) -> Any:
    """Call a ufunc: the result has NumPy's own numbers, with the provenance of the operands."""
    if method != '__call__' or options or ufunc.nout != 1:
        return _compute(ufunc, method, inputs, options)
    numbers, args, operands = [], [], []
    copied = 0
    has_array = False
    for operand in inputs:
        kind = type(operand)
        number = operand
        if kind is TrackedArray:
            has_array = True
            number = _ARRAY.view(operand, numpy.ndarray)
            operand = operand._memory and operand._memory.node_of(operand)
            if operand is None:
                copied += number.size
                operand = number
            else:
                operands.append(operand)
        elif kind is numpy.ndarray:
            has_array = True
            copied += number.size
        elif kind in WITH_PROVENANCE:
            number = plain_number(operand)
            operand = python_number(operand)
            operands.append(operand)
        elif not isinstance(operand, _NUMBERS):
            return _compute(ufunc, method, inputs, options)
        numbers.append(number)
        args.append(operand)
    result = ufunc(*numbers)
    if not has_array:
        return recorded(result, _function_of(ufunc), *inputs)
    if not operands or copied >= MAX_COPIED or not spend(OF_PYTHON):
        return result
    # The program may change plain arrays.
    args = [arg.copy() if type(arg) is numpy.ndarray else arg for arg in args]
    return wrapped(result, Call(ufunc, args, {}), operands, copied)


def _compute(ufunc: Any, method: str, inputs: Sequence[Argument], options: Dict[str, Argument]) -> Any:
    """`compute` with methods, options and lists."""
    numbers = [plain(one) for one in inputs]
    out = options.pop('out', None)
    plain_options = plain(options)
    captured = _Captured()
    args: Sequence[Any] = ()
    # The provenance is taken first: an operation with `out` may overwrite its operands.
    if method != 'at' and not (out is not None and 'where' in options) and spend(OF_PYTHON):
        args = [captured(one) for one in inputs]
    function = ufunc if method == '__call__' else getattr(ufunc, method)
    if out is None:
        result = function(*numbers, **plain_options)
    else:
        result = function(*numbers, out=tuple(map(plain, out)), **plain_options)
    if method == 'at' and type(inputs[0]) is TrackedArray:
        inputs[0].forget()
    made = result
    if captured.operands and captured.is_whole:
        made = wrapped(result, Call(function, args, plain_options), captured.operands, captured.copied)
    if out is None:
        return made
    return _written(out, made) if type(made) is tuple else _written(out, (made,))[0]


def _function_of(ufunc: Any) -> Callable[..., Any]:
    return ELEMENTWISE.get(ufunc.__name__) or _OPERATORS.get(ufunc.__name__) or _no_function


def _no_function(*_: Any) -> None:
    return None


_OPERATORS: Dict[str, Callable[..., Any]] = {
    'add': lambda a, b: a + b,
    'subtract': lambda a, b: a - b,
    'divide': lambda a, b: a / b,
    'floor_divide': lambda a, b: a // b,
    'remainder': lambda a, b: a % b,
    'power': lambda a, b: a**b,
    'float_power': lambda a, b: a**b,
    'negative': lambda a: -a,
    'positive': lambda a: a,
    'absolute': abs,
    'square': lambda a: a * a,
    'reciprocal': lambda a: 1 / a,
    'maximum': lambda a, b: a if a >= b else b,
    'minimum': lambda a, b: a if a <= b else b,
    'fmax': lambda a, b: a if a >= b else b,
    'fmin': lambda a, b: a if a <= b else b,
    'conjugate': lambda a: a,
}


def _written(out: Sequence[Any], made: Sequence[Any]) -> Tuple[Any, ...]:
    """The arrays that results were written to, with the provenance of these."""
    for target, part in zip(out, made):
        if type(target) is TrackedArray:
            target.write_provenance(..., provenance_of(part) if target is not part else None)
    return tuple(out)


#: The functions that write to their first argument, and how that is called. What they write has no provenance.
_WRITING = {
    numpy.copyto: 'dst',
    numpy.put: 'a',
    numpy.place: 'arr',
    numpy.putmask: 'a',
    numpy.fill_diagonal: 'a',
    numpy.put_along_axis: 'arr',
}

_RECEPTIVE = {numpy.zeros_like, numpy.ones_like, numpy.empty_like}


LOST: List[Callable[[Any, Any], None]] = []
"""Are called with a plain result, and with the arguments that had provenance."""


def call(function: Any, arguments: Sequence[Argument], options: Dict[str, Argument]) -> Any:
    """Call a function of NumPy: the result has NumPy's own numbers, with their provenance where it is known."""
    captured = _Captured()
    args, named = [captured(one) for one in arguments], {name: captured(one) for name, one in options.items()}
    captured.is_whole = captured.is_whole and spend(OF_PYTHON)
    given, plain_named = [plain(one) for one in arguments], plain(options)
    result = function(*given, **plain_named)
    if function in _WRITING:
        target = arguments[0] if arguments else options[_WRITING[function]]
        if type(target) is TrackedArray:
            target.forget()
        return result
    if function in _RECEPTIVE:
        return receptive(result)
    target = None
    if isinstance(result, numpy.ndarray):
        if given and result is given[0]:
            return arguments[0]
        # It was written to an array that was given for that: nothing is computed of what was there.
        for at, one in enumerate(given):
            if one is result:
                target, args[at] = arguments[at], None
        if plain_named.get('out') is result:
            target, named['out'] = options['out'], None
    if target is None:
        result, is_view = _views(result, captured.arrays, given)
        if is_view:
            return result
    made = result
    if captured.operands and captured.is_whole:
        if getattr(getattr(result, 'dtype', None), 'kind', '') == 'f':
            named.pop('dtype', None)  # numbers of 32 bits would be too coarse to be differentiated
        made = wrapped(result, Call(function, args, named), captured.operands, captured.copied)
    if made is result and captured.operands:
        for tell in LOST:
            tell(result, (arguments, options))
    return made if target is None else _written([target], [made])[0]


def _views(result: Any, arrays: Sequence[TrackedArray], given: Sequence[Any]) -> Tuple[Any, bool]:
    """A result, or the results in a list, with the provenance of the arrays that it shows, and whether it shows some.

    Args:
        arrays: those with provenance that NumPy's function was given.
        given: its plain arguments.
    """
    if type(result) in (list, tuple):
        parts = [_views(part, arrays, given) for part in result]
        is_view = bool(parts) and all(is_view for _, is_view in parts)
        return (type(result)([part for part, _ in parts]), True) if is_view else (result, False)
    if not isinstance(result, numpy.ndarray) or result.base is None:
        return result, False
    for array in arrays:
        memory = array._memory
        if memory is not None and memory.root.dtype == result.dtype and numpy.may_share_memory(memory.root, result):
            return _of_memory(result, memory), True
    return result, any(isinstance(one, numpy.ndarray) and numpy.may_share_memory(one, result) for one in given)


complete(compute, ARRAYS, TrackedArray.__array_ufunc__)
