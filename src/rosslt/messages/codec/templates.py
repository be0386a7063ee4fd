"""Templates of encoded provenance: all of its bytes but the floats.

What moves sends the same provenance again and again, with other coefficients and other values of its sources: floats,
in two blocks. The bytes around them are written, and checked, once.
"""

import struct
from typing import Any, Collection, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.codec.varint import is_whole
from rosslt.values import Source

Terms = Sequence[Tuple[Source, Any, Any]]

AffineField = Tuple[int, Optional[Source], Terms]
"""An affine leaf on the wire: its index, and its source if it equals a source, else None and its terms."""


class Parts(NamedTuple):
    """A provenance in parts: its two blocks of floats, and the bytes before, between and behind them."""

    head: bytes
    values: Sequence[float]
    """The values of sources that are floats."""
    middle: bytes
    slopes: Sequence[float]
    """The coefficients that are written as floats."""
    tail: bytes

    def joined(self) -> bytes:
        """The provenance."""
        return Template(self.head, len(self.values), self.middle, len(self.slopes), self.tail).fill(
            self.values, self.slopes
        )


class Template:
    """All of a provenance but its floats.

    Args:
        head, middle, tail: the bytes before, between and behind the two blocks of floats.
        value_count, slope_count: the numbers of floats in the blocks.
    """

    __slots__ = ('_around', '_pack', '_size', '_slopes_at', '_unpack')

    def __init__(self, head: bytes, value_count: int, middle: bytes, slope_count: int, tail: bytes) -> None:
        self._around = head, middle, tail
        self._slopes_at = value_count + 2
        form = struct.Struct('<%ds%dd%ds%dd%ds' % (len(head), value_count, len(middle), slope_count, len(tail)))
        self._pack, self._unpack, self._size = form.pack, form.unpack, form.size

    @classmethod
    def cut(cls, data: bytes, values_at: int, value_count: int, slopes_at: int, slope_count: int) -> 'Template':
        """The template of a provenance whose blocks of floats begin at these bytes.

        Raises:
            ValueError: the blocks overlap or are not within the data, so that it would be no template of that.
        """
        values_to, slopes_to = values_at + 8 * value_count, slopes_at + 8 * slope_count
        if not 0 <= values_at <= values_to <= slopes_at <= slopes_to <= len(data):
            raise ValueError(
                'floats at bytes %d to %d and %d to %d of %d' % (values_at, values_to, slopes_at, slopes_to, len(data))
            )
        return cls(data[:values_at], value_count, data[values_to:slopes_at], slope_count, data[slopes_to:])

    def fill(self, values: Sequence[float], slopes: Sequence[float]) -> bytes:
        """The provenance with those floats."""
        head, middle, tail = self._around
        return self._pack(head, *values, middle, *slopes, tail)

    def match(self, data: bytes) -> Optional[Tuple[Sequence[float], Sequence[float]]]:
        """The values and the coefficients in a provenance; None where it differs in anything else, or where they are
        not finite."""
        if len(data) != self._size:
            return None
        parts = self._unpack(data)
        at = self._slopes_at
        values, slopes = parts[1 : at - 1], parts[at:-1]
        if (parts[0], parts[at - 1], parts[-1]) == self._around and are_finite(values, slopes):
            return values, slopes
        return None


def are_finite(values: Collection[float], slopes: Collection[float]) -> bool:
    """Return True if all floats and their sum are finite."""
    total = sum(values) + sum(slopes)
    return total - total == 0


class Shape(NamedTuple):
    """Affine fields apart from their floats: where the keys of two are equal, one template serves both."""

    key: Tuple[Any, ...]
    """The fields with numbers instead of their floats."""
    values: List[float]
    """The values of sources, each reading once, in order of appearance."""
    slopes: List[float]
    """Coefficients that are written as floats, each once, in order of appearance."""


def shape_of(fields: Sequence[AffineField]) -> Optional[Shape]:
    """Return the shape of fields; None if their terms hold numbers other than floats, or floats that are not finite."""
    key: List[Any] = []
    add = key.append
    readings: Dict[Any, int] = {}
    numbers: Dict[float, int] = {}
    values: List[float] = []
    for index, itself, terms in fields:
        add(index)
        if itself is not None:
            add(itself)
            continue
        add(len(terms))
        for source, value, slope in terms:
            number = readings.get(source)
            if number is None or values[number] is not value:
                if type(value) is not float:
                    return None
                reading = source, value or repr(value)  # 0.0 and -0.0 are equal
                if reading not in readings:
                    readings[reading] = readings[source] = len(values)
                    values.append(value)
                    add(source)
                else:
                    add(readings[reading])
            else:
                add(number)
            if type(slope) is float and not slope.is_integer():
                add(numbers.setdefault(slope, len(numbers)))
            elif type(slope) is not float or is_whole(slope):
                add((slope, type(slope)))  # written as an integer, which is no part of the blocks
            elif slope:
                add(numbers.setdefault(slope, len(numbers)))
            else:
                return None
    if not are_finite(values, numbers):
        return None
    return Shape(tuple(key), values, list(numbers))
