"""Numbers of variable length (varints), strings and floats as bytes, in columns.

A varint holds seven bits a byte, the lowest first, with the highest bit set on all bytes but the last. Columns of
varints are quick to read in Python: if each takes one byte, the bytes themselves are the column.
"""

import math
import struct
from typing import List, Optional, Sequence, Tuple

import numpy

from rosslt.messages.errors import BadHeader

VARINT_LIMIT = 10
"""The most bytes that a varint takes: 64 bits and the sign that `zigzag` adds."""

LONG_COLUMN = 256
"""Columns of so many varints are read by NumPy, if they are not bytes."""

SMALL = 1 << 32
"""Floats without a fraction below that are sent as integers."""


def zigzag(number: int) -> int:
    """A signed integer as an unsigned one, small if it is near 0: 0, -1, 1, -2 become 0, 1, 2, 3."""
    return number * 2 if number >= 0 else -number * 2 - 1


def unzigzagged(numbers: Sequence[int]) -> List[int]:
    """The inverse of `zigzag` of each."""
    return [number >> 1 ^ -(number & 1) for number in numbers]


def is_whole(number: float) -> bool:
    """Return True for a float that is sent as an integer. Negative zero is not: it would lose its sign."""
    return number.is_integer() and -SMALL < number < SMALL and (number != 0 or math.copysign(1, number) > 0)


def packed(numbers: Sequence[int]) -> bytes:
    """Numbers, 0 and above, as varints."""
    if not numbers or max(numbers) < 128:
        return bytes(numbers)
    data = bytearray()
    for number in numbers:
        while number > 127:
            data.append(number & 127 | 128)
            number >>= 7
        data.append(number)
    return bytes(data)


class Reader:
    """Reads columns from bytes, and checks each length against the remaining data before using it."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def fail(self, what: str, *arguments: object) -> BadHeader:
        """The error to raise: `what`, and how far the reading came."""
        return BadHeader(
            'bad provenance: %s, before byte %d of %d'
            % (what % arguments, min(self.at, len(self.data)), len(self.data))
        )

    def bytes(self, size: int, what: str) -> bytes:
        """The next `size` bytes."""
        end = self.at + size
        if end > len(self.data):
            raise self.fail('found %d bytes of %s, expected %d', len(self.data) - self.at, what, size)
        self.at, start = end, self.at
        return self.data[start:end]

    def number(self, what: str, limit: int) -> int:
        """The next varint, at most `limit`."""
        found = self.column(1, what)[0]
        if found > limit:
            raise self.fail('found %s %d, the limit is %d', what, found, limit)
        return found

    def column(self, count: int, what: str) -> Sequence[int]:
        """The next `count` varints."""
        start = self.at
        chunk = self.data[start : start + count]
        if len(chunk) < count:
            raise self.fail('found %d bytes of %s, expected %d or more', len(chunk), what, count)
        if not count or max(chunk) < 128:
            self.at += count
            return chunk
        if count >= LONG_COLUMN:
            found = self._long_column(count)
            if found is not None:
                return found
        numbers: List[int] = []
        data, size = self.data, len(self.data)
        at = start
        while len(numbers) < count:
            number = shift = 0
            while True:
                if at >= size:
                    self.at = at
                    raise self.fail('found %d of %d of %s', len(numbers), count, what)
                byte = data[at]
                at += 1
                number |= (byte & 127) << shift
                if byte < 128:
                    break
                shift += 7
                if shift >= 7 * VARINT_LIMIT:
                    self.at = at
                    raise self.fail('found a number of more than %d bytes in %s', VARINT_LIMIT, what)
            numbers.append(number)
        self.at = at
        return numbers

    def _long_column(self, count: int) -> Optional[List[int]]:
        """The next `count` varints; None if one of them is not right."""
        room = min(len(self.data) - self.at, VARINT_LIMIT * count)
        part = numpy.frombuffer(self.data, numpy.uint8, room, self.at)
        ends = numpy.flatnonzero(part < 128)[:count]
        if len(ends) < count:
            return None
        starts = numpy.concatenate(([0], ends[:-1] + 1))
        sizes = ends - starts + 1
        if sizes.max() > VARINT_LIMIT:
            return None
        low = numpy.zeros(count, numpy.uint64)
        for place in range(min(sizes.max(), VARINT_LIMIT - 1)):
            longer = sizes > place
            low[longer] |= (part[starts[longer] + place] & 127).astype(numpy.uint64) << numpy.uint64(7 * place)
        numbers: List[int] = low.tolist()
        longest = numpy.flatnonzero(sizes == VARINT_LIMIT)  # of up to 70 bits
        for index, highest in zip(longest.tolist(), part[ends[longest]].tolist()):
            numbers[index] |= highest << 7 * (VARINT_LIMIT - 1)
        self.at += int(ends[-1]) + 1
        return numbers

    def floats(self, count: int, what: str) -> Tuple[float, ...]:
        """The next `count` floats of 64 bits, all of them finite."""
        numbers = struct.unpack('<%dd' % count, self.bytes(8 * count, what))
        if not all(map(math.isfinite, numbers)):
            raise self.fail('found %s that is not finite', what)
        return numbers

    def strings(self, count: int, what: str) -> Sequence[str]:
        """The next `count` strings: a column of their lengths, then their UTF-8."""
        texts = []
        for size in self.column(count, what):
            try:
                texts.append(self.bytes(size, what).decode('utf-8'))
            except UnicodeDecodeError as error:
                raise self.fail('found %s that is not UTF-8 (%s)', what, error.reason) from error
        return texts


def packed_strings(texts: Sequence[str]) -> bytes:
    """Pack texts for `Reader.strings`: their lengths, then their bytes."""
    encoded = [text.encode('utf-8') for text in texts]
    return packed([len(text) for text in encoded]) + b''.join(encoded)
