"""The elements of an array at one moment, to know later which of them nobody has written since."""

from typing import Any, List, Tuple

import numpy

from .tracked_array import TrackedArray, plain

Index = Tuple[int, ...]


class Noted:
    """The elements of an array at one moment.

    Args:
        array: with provenance.
    """

    def __init__(self, array: TrackedArray) -> None:
        self._memory = array._memory
        self._codes = array.codes.copy()
        self._numbers = plain(array).copy()

    def unwritten(self, array: TrackedArray) -> List[Tuple[Index, Any]]:
        """The elements with provenance that still are what they were: `(index, tracked number of Python)`."""
        if array._memory is not self._memory or array.shape != self._numbers.shape or not array.has_provenance:
            return []
        kind = f'V{array.itemsize}'
        is_same = (array.codes == self._codes) & (self._codes != 0)
        is_same &= numpy.ascontiguousarray(plain(array)).view(kind) == self._numbers.copy('C').view(kind)
        found = ((index, array.item(index)) for index in map(tuple, numpy.argwhere(is_same).tolist()))
        return [(index, number) for index, number in found if hasattr(number, '_record')]
