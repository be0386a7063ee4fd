"""Provenance like one that was met before, but for its numbers.

What moves sends the same provenance again and again, with other coefficients and other values of its sources: floats,
in two blocks. All that is around them was written, or checked, the first time.
"""

import struct
from typing import Any, Collection, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.columns import is_whole
from rosslt.values import Source

Terms = Sequence[Tuple[Source, Any, Any]]

Field = Tuple[int, Optional[Source], Terms]
"""What the wire says of one affine leaf: its index, and its source where it is that itself, else None and its terms."""


class Parts(NamedTuple):
    """A provenance in parts: its two blocks of floats, and the bytes before, between and behind them."""

    head: bytes
    values: Sequence[float]
    """Of sources, as far as they are floats."""
    middle: bytes
    slopes: Sequence[float]
    """Coefficients, as far as they are written as floats."""
    tail: bytes

    def joined(self) -> bytes:
        """The provenance."""
        return b''.join(
            (
                self.head,
                struct.pack('<%dd' % len(self.values), *self.values),
                self.middle,
                struct.pack('<%dd' % len(self.slopes), *self.slopes),
                self.tail,
            )
        )


class Outline:
    """All of a provenance but its floats.

    Args:
        parts: of one that has it.
    """

    def __init__(self, parts: Parts) -> None:
        self._around = parts.head, parts.middle, parts.tail
        self._slopes_at = len(parts.values) + 2
        form = struct.Struct(
            '<%ds%dd%ds%dd%ds'
            % (len(parts.head), len(parts.values), len(parts.middle), len(parts.slopes), len(parts.tail))
        )
        self._pack, self._unpack = form.pack, form.unpack

    def filled(self, values: Sequence[float], slopes: Sequence[float]) -> bytes:
        """The provenance with those floats."""
        head, middle, tail = self._around
        return self._pack(head, *values, middle, *slopes, tail)

    def floats(self, data: bytes) -> Optional[Tuple[Sequence[float], Sequence[float]]]:
        """The values and the coefficients of a provenance of the same length; None where it has another outline, or
        floats that are not finite."""
        parts = self._unpack(data)
        at = self._slopes_at
        values, slopes = parts[1 : at - 1], parts[at:-1]
        if (parts[0], parts[at - 1], parts[-1]) == self._around and are_finite(values, slopes):
            return values, slopes
        return None


def are_finite(values: Collection[float], slopes: Collection[float]) -> bool:
    """Whether floats are finite; False as well where their sum is not."""
    total = sum(values) + sum(slopes)
    return total - total == 0


class Numbered(tuple):
    """Affine fields with numbers in the places of their floats: where these are equal, so are the outlines of their
    provenances.

    Attributes:
        fields: with their floats.
        values: of sources, each reading once, in order of appearance.
        slopes: coefficients that are written as floats, each once, in order of appearance.
    """

    fields: Sequence[Field]
    values: List[float]
    slopes: List[float]


def numbered(fields: Sequence[Field]) -> Optional[Numbered]:
    """Take the floats out of fields; None where there is something else in their place, or they are not finite."""
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
                add((slope, type(slope)))
            elif slope:
                add(numbers.setdefault(slope, len(numbers)))
            else:
                return None
    if not are_finite(values, numbers):
        return None
    result = Numbered(key)
    result.fields, result.values, result.slopes = fields, values, list(numbers)
    return result
