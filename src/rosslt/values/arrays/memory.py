"""The provenance of the elements of an array, which its views share: an element is found by its address."""

import itertools
import math
from typing import Any, Dict, Optional

import numpy

from ..operations import LAZY
from ..recording import spend
from ..tracked import new
from .graph import OF_ARRAY, SERIAL, Gathering, Node
from .numbers import CLASSES, PYTHON_NUMBERS, of_numpy, rounding_of, same_number, with_tracked

_CODE = numpy.dtype(numpy.int64)


class Memory:
    """The provenance of the elements of an array, which all its views share.

    An element has a code, which says where in which entry it is found. The code of a plain element is 0, so a large
    array with few written elements uses little memory. Threads may write and read at the same time.

    Args:
        root: the plain array, whose elements follow each other in the memory.
        node: how it was made; None if nothing in it has provenance yet.

    Attributes:
        root: the same.
        entries: nodes and tracked numbers of Python by their serial numbers, in the order in which they were written.
        is_tracked: whether all elements come from entries.
    """

    __slots__ = ('_codes', '_serials', 'entries', 'is_tracked', 'root')

    def __init__(self, root: Any, node: Optional[Node] = None) -> None:
        self.root = root
        self.entries: Dict[int, Any] = {} if node is None else {1: node}
        self.is_tracked = node is not None
        self._serials = itertools.count(2)
        self._codes: Dict[str, Any] = {}

    def codes_of(self, view: Any) -> Any:
        """The codes of the elements of a view, 0 if they are plain. All views share the codes."""
        root = self.root
        if not self._codes:
            codes = numpy.zeros(root.size, _CODE)
            if self.entries:
                self._codes_at(root, codes)[...] = _codes_from(1, root.shape)
            self._codes.setdefault('all', codes)  # those of another thread, if it was first
        return self._codes_at(view, self._codes['all'])

    def code_at(self, view: Any, key: Any) -> int:
        """The code of one element of a view, by its index."""
        if type(key) is int and self._is_as_made(view):
            return key % self.root.size + SERIAL
        return int(view.codes[key])

    def _is_as_made(self, view: Any) -> bool:
        """Return True for the array as it was made: its elements are those of its only entry, in that order."""
        return not self._codes and view._is_whole and view.shape == self.root.shape

    def _codes_at(self, view: Any, codes: Any) -> Any:
        width = view.itemsize
        if not view.size or width != self.root.itemsize:  # the program has made it an array of other numbers
            return numpy.zeros(view.shape, _CODE)
        if view.size == codes.size and view.flags.forc:  # it is all of the memory, in order
            return codes.reshape(view.shape, order='C' if view.flags.c_contiguous else 'F')
        address, start = (one.__array_interface__['data'][0] for one in (view, self.root))
        strides = [stride // width * _CODE.itemsize for stride in view.strides]
        return numpy.ndarray(view.shape, _CODE, codes, (address - start) // width * _CODE.itemsize, strides)

    def node_of(self, view: Any) -> Optional[Node]:
        """Return the node of the elements of a view; None if all of them are plain."""
        if not self.entries:
            return None
        if self._is_as_made(view):
            whole: Node = self.entries[1]
            return whole
        return self.gathered(view.codes, view)

    def gathered(self, codes: Any, numbers: Any) -> Optional[Node]:
        """Return the node of an array of elements with such codes; None if they are plain, or not recorded."""
        if not (self.is_tracked or codes.any()) or not spend(OF_ARRAY):
            return None
        call = Gathering(codes.copy(), numpy.array(numbers), self.entries)
        return Node(call, list(call.entries.values()), numbers, numbers.size)

    def write(self, codes: Any, key: Any, made: Any) -> None:
        """Set the provenance of what was written to some elements.

        Args:
            codes: of a view.
            key: the index of what was written; a mask of the shape of a node chooses among that node's elements.
            made: a node, a tracked number of Python, or None for plain numbers.
        """
        if made is None:
            self.is_tracked = False
            codes[key] = 0
            return
        if len(self.entries) > 2 * self.root.size + 16:
            known = list(self.entries)  # taken first: an entry is added after its codes
            for serial in set(known).difference(numpy.unique(self._codes['all'] // SERIAL).tolist()):
                self.entries.pop(serial, None)
        serial = next(self._serials)
        if type(made) is Node:
            fresh = _codes_from(serial, made.shape)
            is_mask = isinstance(key, numpy.ndarray) and key.dtype.kind == 'b' and key.shape == made.shape
            codes[key] = fresh[key] if is_mask else fresh
        else:
            codes[key] = serial * SERIAL
        self.entries[serial] = made

    def read(self, number: Any, code: int) -> Any:
        """A number that was read from the array, of NumPy or of Python, with the provenance of an element."""
        entry = self.entries.get(code // SERIAL) if code else None
        return number if entry is None else lazy_number(number, entry, code % SERIAL, self.root.dtype.type)


def _codes_from(serial: int, shape: Any) -> Any:
    return numpy.arange(serial * SERIAL, serial * SERIAL + math.prod(shape)).reshape(shape)


def lazy_number(number: Any, entry: Any, index: int, kind: Any) -> Any:
    """A number with the provenance of an element, which is looked up when it is needed.

    Args:
        number: of NumPy or of Python, whose class can have provenance.
        entry: a node, or the tracked number itself.
        index: the index of the element in the node.
        kind: the class of the numbers of the array.
    """
    is_numpy = type(number) in CLASSES
    known = entry
    if type(entry) is Node:
        known = entry.known[index] if entry.known is not None else LAZY
        if type(known) in PYTHON_NUMBERS and known._plain != number:  # they differ by rounding
            known = LAZY
    if known is not LAZY:
        return with_tracked(number, known) if is_numpy else same_number(number, known, rounding_of(kind))
    if is_numpy:
        return of_numpy(number, new(number.item(), (LAZY, entry, index), entry.size))
    return new(number, (LAZY, entry, index), entry.size)
