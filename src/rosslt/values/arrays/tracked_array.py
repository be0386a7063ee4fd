"""Arrays of NumPy's own floats and ints that know where their elements come from.

Whatever computes with a `TrackedArray` gets the numbers that it would get without provenance, to the last bit: NumPy
computes them. An operation is one node of the graph (`graph.Node`). An
element is looked up when it is read; a number that was written past this class differs from the value of its
expression, and so is plain.
"""

from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy

from ..recording import OF_PYTHON, spend
from ..tracked import TRACKED
from .graph import MAX_COPIED, MAX_SIZE, OF_ARRAY, Call, Node, report
from .memory import Memory
from .numbers import CLASSES, PYTHON_NUMBERS, WITH_PROVENANCE, plain_number, python_number

Argument = Any
"""What NumPy's functions take, or give."""

_ARRAY: Any = numpy.ndarray
_MARK = object()


class TrackedArray(numpy.ndarray):
    """An array of floats or ints with the provenance of its elements. Made by `array`, and by NumPy of others."""

    __class__: Any = property(lambda self: numpy.ndarray)
    _memory: Optional[Memory] = None
    _codes: Any = None
    _is_whole = False
    #: Called after elements have followed a change of their sources: the object that is made of them follows, too.
    followed: Optional[Callable[[], None]] = None

    def __array_finalize__(self, original: Any) -> None:
        # A masked array of such elements has their attributes, and shows other memory.
        memory = original._memory if type(original) is TrackedArray else None
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
        return of_list(numbers, self.dtype, self.shape)

    def forget(self) -> None:
        """Cut the elements off from where they come from, in all views of them."""
        if self.has_provenance:
            self.write_provenance(..., None)

    def write_provenance(self, key: Any, made: Any) -> None:
        """Set the provenance of what was written to some elements: see `Memory.write`."""
        memory = self._memory
        if memory is not None and (made is not None or memory.entries):
            try:
                memory.write(self.codes, key, made)
            except Exception as error:  # of whatever type: the program goes on
                report(self.write_provenance, error)
                memory.entries.clear()

    def follow(self, pairs: Sequence[Tuple[Tuple[int, ...], Any]]) -> None:
        """Set elements to the values that they have after a change, recorded in any case.

        Args:
            pairs: `(index, value)` of each.
        """
        numbers = plain(self)
        for at, value in pairs:
            numbers[at] = plain(value)
            self.write_provenance(at, provenance_of(value))
        if self.followed is not None:
            self.followed()

    def write_as(self, write: Callable[[Any, Callable[[Argument], Any]], Any]) -> None:
        """Set the provenance of what was written to some elements in any way: it is written once more, to marks.

        Args:
            write: `write(marks, of)` writes to an array of objects what `of` makes of the program's arguments.
        """
        if self._memory is None:
            return
        marks = numpy.full(self.shape, _MARK, object)
        try:
            write(marks, _with_objects)
            mask = numpy.array([one is not _MARK for one in marks.ravel().tolist()], bool).reshape(self.shape)
            self.write_provenance(mask, node_of_list(marks[mask].tolist(), plain(self)[mask]))
        except Exception as error:  # of whatever type: what was written is not known
            report(write, error)
            self.forget()

    def __getitem__(self, key: Any) -> Any:
        found = _ARRAY.__getitem__(self, key)
        memory = self._memory
        if type(found) is TrackedArray:
            return found if found._memory is not None else self._moved(found, lambda codes: codes[plain(key)])
        if memory is None or not memory.entries or type(found) not in CLASSES or not spend(OF_PYTHON):
            return found
        return memory.read(found, memory.code_at(self, plain(key)))

    def _moved(self, found: Any, move: Callable[[Any], Any]) -> Any:
        """A copy of some elements with their provenance.

        Args:
            found: the copy.
            move: does to the codes of this array what made the copy.
        """
        made, memory = found.view(numpy.ndarray), self._memory
        return with_node(made, memory.gathered(move(self.codes), made)) if memory and memory.entries else made

    def __setitem__(self, key: Any, value: Any) -> None:
        if self._memory is None:
            super().__setitem__(key, plain(value))
            return
        made = provenance_of(value) if holds_tracked(value) and spend(OF_ARRAY) else None
        super().__setitem__(key, plain(value))
        self.write_provenance(plain(key), made)

    def __copy__(self, _: Any = None) -> 'TrackedArray':
        return self.copy('K')

    __deepcopy__ = __copy__

    def __reduce_ex__(self, protocol: Any) -> Any:
        if not self.has_provenance:
            return plain(self).__reduce_ex__(protocol)
        return of_list, (self.ravel().tolist(), self.dtype, self.shape)

    def __repr__(self) -> str:
        return repr(plain(self))

    def tolist(self) -> Any:
        """Override the method of `numpy.ndarray`: tracked elements become tracked numbers of Python."""
        return self._listed(super().tolist(), self.codes.tolist()) if self.has_provenance else super().tolist()

    def _listed(self, numbers: Any, codes: Any) -> Any:
        if type(numbers) is list:
            return [self._listed(*pair) for pair in zip(numbers, codes)]
        assert self._memory is not None
        return self._memory.read(numbers, codes)

    def item(self, *index: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        found = super().item(*plain(index))
        return self._listed(found, self.codes.item(*plain(index))) if self.has_provenance else found

    def astype(self, dtype: Any, *arguments: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        numbers = plain(self)
        made = numbers.astype(dtype, *arguments, **options)
        if made is numbers:
            return self
        if made.dtype == object and self.has_provenance:
            made[...] = numpy.array([*self.reshape(-1).tolist(), None], object)[:-1].reshape(self.shape)
            return made
        node = provenance_of(self)
        # Numbers of 32 bits would be too coarse to be differentiated.
        target = numpy.dtype(float) if made.dtype.kind == 'f' else made.dtype
        return made if node is None else with_node(made, Node(Call(converted, (node, target), {}), [node], made))

    def copy(self, order: Any = 'C') -> Any:
        """Override the method of `numpy.ndarray` to keep provenance, or the readiness to have some."""
        if self.has_provenance:
            return self._moved(super().copy(order), lambda codes: codes)
        return receptive(plain(self).copy(order))

    def view(self, *arguments: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray`: a view of the same bytes as other numbers is plain."""
        found = _ARRAY.view(self, *arguments, **options)
        return found if type(found) is not TrackedArray or found.dtype == self.dtype else plain(found)

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
        """Override the attribute of `numpy.ndarray`: a view in one dimension if there is one.

        If there is none, writes would go unnoticed, so the elements are made plain.
        """
        if self.flags.c_contiguous:
            return self.reshape(-1)
        self.forget()
        return plain(self).flat

    @flat.setter
    def flat(self, values: Any) -> None:
        plain(self).flat = plain(values)
        self.write_as(lambda marks, of: setattr(marks, 'flat', of(values)))

    def resize(self, *shape: Any, refcheck: bool = True) -> None:
        """Override the method of `numpy.ndarray`, which resizes no view, as this is one: the elements are cut off."""
        if self._memory is None or not self._is_whole:
            numpy.ndarray.resize(self, *shape, refcheck=refcheck)  # which says that it is a view
        made = plain(self).copy('K')
        made.resize(*shape, refcheck=refcheck)
        self._memory = self._codes = None
        self.__setstate__((1, made.shape, made.dtype, made.flags.fnc, made.tobytes('A')))


def converted(x: Any, dtype: Any) -> Any:
    return x if x.dtype == object else x.astype(dtype)


def _unboxed(x: Any) -> Any:
    """The object in an array without axes: NumPy's methods write it as it is."""
    return x.item() if isinstance(x, numpy.ndarray) and x.dtype == object and not x.shape else x


def _moving(name: str, original: Any) -> Callable[..., Any]:
    """A method that gives a view or a copy of some elements."""

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        found = original(self, *plain(arguments), **plain(options))
        if type(found) is not TrackedArray or found._memory is not None:
            return found
        return self._moved(found, lambda codes: getattr(codes, name)(*plain(arguments), **plain(options)))

    return method


def _computing(name: str, _: Any) -> Callable[..., Any]:
    """A method that does what the function of that name does."""
    return lambda self, *arguments, **options: getattr(numpy, name)(self, *arguments, **options)


def _writing(name: str, original: Any) -> Callable[..., Any]:
    """A method that writes what it is given to some elements."""

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        result = original(self, *plain(arguments), **plain(options))
        self.write_as(lambda marks, of: getattr(marks, name)(*map(_unboxed, of(arguments)), **of(options)))
        return result

    return method


def _rewriting(name: str, original: Any) -> Callable[..., Any]:
    """A method that orders the elements as the function of that name does, or changes their bytes if there is none."""
    function = getattr(numpy, name, None)

    def method(self: TrackedArray, *arguments: Any, **options: Any) -> Any:
        made = provenance_of(function(self, *arguments, **options)) if function and self.has_provenance else None
        result = original(self, *plain(arguments), **plain(options))
        self.write_provenance(..., made)
        return result

    return method


for _make, _names in (
    (_moving, 'reshape ravel flatten take repeat compress'),
    (_computing, 'cumsum cumprod dot trace mean round std var ptp'),
    (_writing, 'put itemset'),
    (_rewriting, 'sort partition byteswap setfield'),
):
    for _name in _names.split():
        if hasattr(numpy.ndarray, _name):  # not every NumPy has all of them
            _method = _make(_name, getattr(numpy.ndarray, _name))
            _method.__name__ = _name
            setattr(TrackedArray, _name, _method)


def plain(x: Argument) -> Any:
    """An argument without provenance, at any depth of lists and dicts."""
    kind = type(x)
    if kind is TrackedArray:
        return _ARRAY.view(x, numpy.ndarray)
    if kind in (list, tuple):
        return kind([plain(part) for part in x])
    if kind is dict:
        return {name: plain(part) for name, part in x.items()}
    return plain_number(x) if kind in TRACKED else x


def holds_tracked(x: Argument) -> bool:
    """Return True for a tracked number or array, and for a list or tuple that holds one at any depth."""
    kind = type(x)
    if kind in WITH_PROVENANCE:
        return True
    if kind is TrackedArray:
        return bool(x.has_provenance)
    return kind in (list, tuple) and any(map(holds_tracked, x))


def _with_objects(x: Argument) -> Any:
    """An argument that is written to an array of objects, with its tracked numbers; what may be an index is plain."""
    if type(x) is dict:
        return {name: _with_objects(part) for name, part in x.items()}
    if type(x) is tuple:
        return tuple(map(_with_objects, x))
    numbers = plain(x)
    if not holds_tracked(x) or numpy.asarray(numbers).dtype.kind != 'f':
        return numbers
    node = provenance_of(of_list(x, None))
    return numbers if node is None else node.objects(lambda number: number)


def provenance_of(value: Argument) -> Any:
    """The node of an array or of a list of numbers, or the tracked number of Python; None for anything plain."""
    kind = type(value)
    if kind in WITH_PROVENANCE:
        return python_number(value)
    try:
        if kind is TrackedArray:
            return value._memory and value._memory.node_of(value)
        if kind in (list, tuple) and holds_tracked(value):
            return node_of_list(value, numpy.asarray(plain(value)))
    except ValueError:
        pass  # of lists of different lengths NumPy makes no array
    except Exception as error:  # of whatever type: the program goes on
        report(provenance_of, error)
    return None


def node_of_list(numbers: Argument, result: Any) -> Optional[Node]:
    """The node of the array that NumPy makes of a list with tracked numbers or arrays."""
    elements: List[Any] = []
    _flatten(numbers, elements)
    operands = [element for element in elements if type(element) in PYTHON_NUMBERS]
    if not operands or len(elements) != result.size or result.dtype.kind not in 'iuf':
        return None
    node = Node(None, operands, result)
    node.keep(elements)
    return node


def of_list(numbers: Argument, dtype: Any, shape: Any = None) -> Any:
    """The array of a list of numbers, at any depth."""
    made = numpy.array(plain(numbers), dtype)
    made = made if shape is None else made.reshape(shape)
    return with_node(made, node_of_list([numbers], made))


def _flatten(numbers: Argument, elements: List[Any]) -> None:
    for part in numbers:
        if type(part) in PYTHON_NUMBERS or type(part) is float:  # most are
            elements.append(part)
        elif type(part) in (list, tuple):
            _flatten(part, elements)
        elif isinstance(part, numpy.ndarray):
            _flatten([part.tolist()], elements)
        else:
            elements.append(python_number(part))


def with_node(made: Any, node: Optional[Node]) -> Any:
    """A plain array with the provenance that a node says; itself if there is none, or no class for it."""
    if node is None or node.size > MAX_SIZE or type(made) is not numpy.ndarray or made.dtype.kind not in 'iuf':
        return made
    if not made.flags.forc:
        if made.size > MAX_COPIED:
            return made
        is_writeable = made.flags.writeable
        made = made.copy('K')
        made.setflags(write=is_writeable)
    return of_memory(made, Memory(made, node))


def receptive(made: Any) -> Any:
    """A plain array as one that tracked numbers can be written to."""
    if type(made) is not numpy.ndarray or made.dtype.kind not in 'iuf' or made.base is not None:
        return made
    return of_memory(made, Memory(made))


def of_memory(made: Any, memory: Memory) -> TrackedArray:
    array: TrackedArray = made.view(TrackedArray)
    array._memory = memory
    array._is_whole = made is memory.root
    return array
