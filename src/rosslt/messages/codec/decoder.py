"""Reads provenance that was received: checks it, and puts it onto the fields of its message.

Nothing in it is believed. Its form is checked as a whole before any field is touched; the provenance of a field is
decoded when somebody first asks for it.
"""

import itertools
import operator
from typing import Any, Hashable, Iterable, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.codec.expressions import ReceivedExpressions, read_instructions
from rosslt.messages.codec.table_reader import ReceivedTables, read_tables
from rosslt.messages.codec.varint import Reader
from rosslt.messages.codec.wire_format import (
    BYTES_LIMIT,
    FIELD_LIMIT,
    HAS_COEFFICIENTS,
    HAS_INSTRUCTIONS,
    HAS_LISTS,
    HAS_VALUES,
    IDENTITY,
    SAMPLED,
    SUMMED_LIMIT,
    VERSION,
)
from rosslt.messages.errors import BadHeader
from rosslt.messages.fields import Message, Scalar
from rosslt.messages.leaves import Located, LocatedArray, leaf_count, locate, put_located
from rosslt.messages.walkers import BYTES_LIMIT as ARRAY_BYTES_LIMIT
from rosslt.messages.walkers import END, TRACKED
from rosslt.values import UNKNOWN, Source, lazy_of, untracked

SCALAR_TYPES = frozenset((float, int, bool, str))
"""The types of the plain values of leaves."""

_VALUE, _KIND = operator.itemgetter(2), operator.itemgetter(3)


class Readings(NamedTuple):
    """The values that the sources of a message had when it was computed."""

    sources: Hashable = ()
    """Equal where the sources are."""
    values: Sequence[Any] = ()
    leaves: Sequence[int] = ()
    """The indices of the tracked leaves, rising, and END."""


NO_READINGS = Readings()
"""Of a message that was sent plain between whole ones."""


def attach(message: Message, data: bytes) -> Optional[Readings]:
    """Put the provenance in `data` onto the fields of a message.

    Everything is checked first, except that the result of an expression which is not affine is computed when it is
    first asked for: if it is not the field's value, that field has no source, and rosout says so.

    Args:
        message: as received; leaves that are named in `data` become tracked, others stay as they are. Arrays of bytes
            and tuples with tracked elements become lists and tuples, NumPy arrays become arrays of objects.
        data: as `encode` gave it, or SAMPLED; b'' and SAMPLED change nothing.

    Returns:
        What its sources were; None for b'', NO_READINGS for SAMPLED.

    Raises:
        BadHeader: the data is not right, or does not fit the message; the message is as it was.
    """
    data = bytes(data)
    if not data or data == SAMPLED:
        return NO_READINGS if data else None
    header = read_header(data)
    arrays: List[LocatedArray] = []
    found = locate(message, header.wanted, arrays)
    missing = header.wanted[len(found)]
    if missing != END:
        raise BadHeader(
            'bad provenance: found one of leaf %d, which the %s does not have, or which is a byte of an array of more '
            'than %d' % (missing, message._type, ARRAY_BYTES_LIMIT)
        )
    put_located(found, header.tracked(found), arrays)
    return header.readings(found)


def make_unknown(message: Message, leaves: Optional[Sequence[int]] = None) -> None:
    """Have leaves of a message that came without provenance depend on `UNKNOWN`.

    Args:
        message: as received.
        leaves: as in `Readings`; by default all but those in arrays of bytes.
    """
    arrays: List[LocatedArray] = []
    found = locate(message, (*range(leaf_count(message)), END) if leaves is None else leaves, arrays)
    if leaves is None:
        arrays = [array for array in arrays if type(array[2]) is not bytes]
    put_located(found, lazy_of(list(map(_VALUE, found)), _not_known), arrays)


def _not_known(value: Scalar, _number: int) -> Any:
    return ((UNKNOWN, value, 1),)


class ReceivedFields(NamedTuple):
    """A header's description of its fields, without the values and coefficients."""

    wanted: Sequence[int]
    """The indices of the leaves, rising, and END."""
    origins: Sequence[int]
    """The number of the source, list of sources or instruction of each field."""
    slopes: Sequence[int]
    """The number of the coefficient or list of coefficients of each field."""


class ReceivedHeader:
    """A provenance that came from outside, its form checked (see `read_header`)."""

    def __init__(
        self, fields: ReceivedFields, tables: ReceivedTables, expressions: Optional[ReceivedExpressions]
    ) -> None:
        self.wanted = fields.wanted
        self._fields = fields
        self._tables = tables
        self._expressions = expressions
        self._expressions_from = tables.sources.size + len(tables.source_lists)
        self._kinds: Sequence[str] = ()

    def tracked(self, found: Sequence[Located]) -> List[Any]:
        """The tracked values of the located leaves.

        Raises:
            BadHeader: one has a provenance that makes no values of its type.
        """
        values = list(map(_VALUE, found))
        self._kinds = list(map(_KIND, found))
        if not SCALAR_TYPES.issuperset(map(type, values)):
            values = self._plain(values)
        if any(self._fields.slopes):
            self._check_sums(values)
        return lazy_of(values, self._load)

    def readings(self, found: Sequence[Located]) -> Readings:
        """The values of its sources; a source that a leaf is has the value of that leaf."""
        sources, values = self._tables.sources, self._tables.values
        if None in values:
            values = list(values)
            for origin, slope, value in zip(self._fields.origins, self._fields.slopes, map(_VALUE, found)):
                if slope == IDENTITY and origin < sources.size:
                    values[origin] = value
        return Readings((sources.ids, *sources.nodes), tuple(values), self.wanted)

    def _plain(self, found: Sequence[object]) -> List[Any]:
        """The scalars that leaves hold, without the provenance that they have already."""
        values = [untracked(value) if type(value) in TRACKED else value for value in found]
        for index, value in zip(self._fields.wanted, values):
            if type(value) not in SCALAR_TYPES:
                raise BadHeader(
                    'bad provenance: found one of leaf %d, which is of type %s' % (index, type(value).__name__)
                )
        return values

    def _check_sums(self, values: Sequence[object]) -> None:
        """Check that fields which are sums are sums of numbers, and those of integers, of integers with integers.

        Many fields may be sums of the same sources, of which there may be many: each list is looked at once.
        """
        fields, tables = self._fields, self._tables
        numbers, whole = tables.origins_of({float, int}), tables.origins_of({int})
        whole_slopes = tables.whole_slopes()
        for origin, slope, index, value, kind in zip(fields.origins, fields.slopes, fields.wanted, values, self._kinds):
            if slope == IDENTITY or (kind in 'df' and numbers[origin]):
                continue
            if not (kind == 'i' and whole[origin] and whole_slopes[slope]):
                (first, *_), (first_slope, *_) = tables.numbers(origin, slope)
                raise BadHeader(
                    'bad provenance: found leaf %d, which holds %.60r, as a sum that begins with %r times %.60r'
                    % (index, value, tables.coefficients[first_slope], tables.values[first])
                )

    def _terms(self, origin: int, slope: int) -> List[Tuple[Source, Any, Any]]:
        tables = self._tables
        numbers, slopes = tables.numbers(origin, slope)
        return [
            (tables.sources.source(number), tables.values[number], tables.coefficients[each])
            for number, each in zip(numbers, slopes)
        ]

    def _load(self, value: Scalar, number: int) -> Any:
        """The provenance of the field of that number, as `lazy_of` asks for it when it is first read."""
        origin, slope = self._fields.origins[number], self._fields.slopes[number]
        if origin >= self._expressions_from:
            assert self._expressions is not None
            return self._expressions.value(origin - self._expressions_from, value, self._kinds[number])
        if slope == IDENTITY:
            return ((self._tables.sources.source(origin), value, 1),)
        return self._terms(origin, slope)


def read_header(data: bytes) -> ReceivedHeader:
    """Check a provenance that came from outside.

    Raises:
        BadHeader: its form is not right.
    """
    if len(data) > BYTES_LIMIT:
        raise BadHeader('bad provenance: found %d bytes, the limit is %d' % (len(data), BYTES_LIMIT))
    if data[:1] != bytes((VERSION,)):
        raise BadHeader('bad provenance: found version %s, expected %d' % (data[0] if data else 'none', VERSION))
    reader = Reader(data)
    reader.at = 1
    flags = reader.number('the flags', HAS_VALUES | HAS_COEFFICIENTS | HAS_LISTS | HAS_INSTRUCTIONS)
    tables = read_tables(reader, flags)
    instructions = read_instructions(reader, tables) if flags & HAS_INSTRUCTIONS else []
    count = reader.number('the number of fields', FIELD_LIMIT)
    gaps = reader.column(count, 'leaves')
    # Each gap counts one more, so that no leaf comes twice.
    wanted = list(map(operator.add, itertools.accumulate(gaps), itertools.count()))
    origins = reader.column(count, 'the sources of fields')
    slopes = reader.column(count, 'the coefficients of fields') if flags & HAS_COEFFICIENTS else bytes(count)
    if reader.at != len(data):
        raise reader.fail('found %d bytes more than expected', len(data) - reader.at)
    _check_numbers(reader, tables, len(instructions), wanted, origins, slopes)
    expressions = ReceivedExpressions(instructions, tables) if instructions else None
    return ReceivedHeader(ReceivedFields((*wanted, END), origins, slopes), tables, expressions)


def _check_numbers(
    reader: Reader,
    tables: ReceivedTables,
    instruction_count: int,
    wanted: Iterable[int],
    origins: Sequence[int],
    slopes: Sequence[int],
) -> None:
    """Check the numbers of each field, if some name more than single sources, and count the terms of all sums."""
    singles = len(tables.coefficients)
    lists_from = tables.sources.size
    expressions_from = lists_from + len(tables.source_lists)
    summed = 0
    for index, origin, slope in zip(wanted, origins, slopes):
        if origin < lists_from:
            fits_table = slope < singles
        elif origin < expressions_from:
            place = slope - singles
            terms = len(tables.source_lists[origin - lists_from])
            summed += terms
            fits_table = 0 <= place < len(tables.slope_lists) and len(tables.slope_lists[place]) == terms
        else:
            fits_table = origin - expressions_from < instruction_count and slope == IDENTITY
        if not fits_table:
            raise reader.fail(
                'found leaf %d with sources %d and coefficients %d, which there are not', index, origin, slope
            )
    if summed > SUMMED_LIMIT:
        raise reader.fail('found fields that are sums of %d terms together, the limit is %d', summed, SUMMED_LIMIT)
