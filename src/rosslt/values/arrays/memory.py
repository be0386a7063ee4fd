"""The provenance of the elements of an array, which its views share: an element is found by its address."""

import bisect
import math
from typing import Any, List, Optional

import numpy

from ..operations import LAZY
from ..recording import spend
from ..tracked import new
from .graph import OF_ARRAY, Gathering, Node
from .numbers import CLASSES, of_numpy, rounding_of, same_number, with_tracked

_CODE = numpy.dtype(numpy.int64)


class Memory:
    """The provenance of the elements of an array, which all its views share.

    The elements of entries have codes: those of an entry follow each other, from its start on. The
    code of a plain element is 0, so that of a large array that is written in few places little memory is used.

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
        self.starts = [1]
        self.is_tracked = node is not None
        self._codes: Any = None

    def codes_of(self, view: Any) -> Any:
        """The codes of the elements of a view, 0 where they are plain. All views see what is written to them."""
        root = self.root
        if self._codes is None:
            self._codes = numpy.zeros(root.size, _CODE)
            if self.entries:
                self._codes_at(root)[...] = numpy.arange(1, root.size + 1).reshape(root.shape)
        return self._codes_at(view)

    def code_at(self, view: Any, key: Any) -> int:
        """The code of one element of a view, by its index."""
        if type(key) is int and self._is_as_made(view):
            return key % self.root.size + 1
        return int(view.codes[key])

    def _is_as_made(self, view: Any) -> bool:
        """Return True for the array as it was made: its elements are those of its only entry, in that order."""
        return self._codes is None and view._is_whole and view.shape == self.root.shape

    def _codes_at(self, view: Any) -> Any:
        width = view.itemsize
        if not view.size or width != self.root.itemsize:  # the program has made it an array of other numbers
            return numpy.zeros(view.shape, _CODE)
        offset = _address(view) - _address(self.root)
        strides = [stride // width * _CODE.itemsize for stride in view.strides]
        return numpy.ndarray(view.shape, _CODE, self._codes, offset // width * _CODE.itemsize, strides)

    def node_of(self, view: Any) -> Optional[Node]:
        """Return the node of the elements of a view; None if all of them are plain."""
        if not self.entries:
            return None
        if self._is_as_made(view):
            whole: Node = self.entries[0]
            return whole
        return self.gathered(view.codes, view)

    def gathered(self, codes: Any, numbers: Any) -> Optional[Node]:
        """Return the node of an array of elements with such codes; None if all of them are plain."""
        if not self.is_tracked and not codes.any():
            return None
        spend(OF_ARRAY)
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
            codes[key] = 0
            return
        if len(self.entries) > 2 * self.root.size + 16:
            self._forget_overwritten()
        start = 1
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
        entries, starts, begin = [], [], 1
        for used in numpy.unique(at[flat > 0]).tolist():
            entry = self.entries[used]
            entries.append(entry)
            starts.append(begin)
            chosen = at == used
            flat[chosen] += begin - self.starts[used]
            begin += math.prod(entry.shape) if type(entry) is Node else 1
        self.entries, self.starts = entries, starts or [1]

    def read(self, number: Any, code: int) -> Any:
        """A number that was read from the array, of NumPy or of Python, with the provenance of an element."""
        if not code:
            return number
        at = bisect.bisect(self.starts, code) - 1 if len(self.entries) > 1 else 0
        return lazy_number(number, self.entries[at], code - self.starts[at], self.root.dtype.type)


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
