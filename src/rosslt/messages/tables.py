"""The tables in front of a provenance: nodes, sources with their values, coefficients, and lists of both.

What several fields share stands here once, and the fields name it by its number. `Tables` writes them, `ReadTables`
reads and checks them; `docs/wire_format.md` says what each byte is.
"""

import itertools
import math
from typing import Any, Dict, List, Sequence, Tuple

from rosslt.messages.columns import Reader, is_whole, packed, packed_strings, unzigzag, zigzag
from rosslt.messages.outlines import Parts
from rosslt.values import Error, Source

TABLE_LIMIT = 1 << 15
"""The most entries of any table."""

LISTED_LIMIT = 1 << 16
"""The most numbers in the lists of sources together, and in those of coefficients."""

INT_LIMIT = 1 << 64
"""Integers on the wire are smaller than that, with either sign: all that ROS has, signed or not."""

HAS_VALUES, HAS_COEFFICIENTS, HAS_LISTS, HAS_GRAPH = 1, 2, 4, 8
"""The flags in the second byte: which parts follow."""

NO_VALUE, FLOAT, INT, STRING, FALSE, TRUE = range(6)
"""The kinds of a source's value, and of a constant."""


class Unencodable(Error):
    """The provenance of one value cannot be sent; the error says why."""


def checked(value: Any) -> Any:
    """A value that can be sent, as it is.

    Raises:
        Unencodable: it is infinite, NaN, too large an integer, or no scalar.
    """
    kind = type(value)
    if kind is float:
        if not math.isfinite(value):
            raise Unencodable('its provenance holds %r, which is not finite' % value)
    elif kind is int:
        if not -INT_LIMIT < value < INT_LIMIT:
            raise Unencodable('its provenance holds an integer of %d bits' % value.bit_length())
    elif kind is str:
        try:
            value.encode('utf-8')
        except UnicodeEncodeError as error:
            raise Unencodable('its provenance holds a text that is not Unicode') from error
    elif kind is not bool:
        raise Unencodable('its provenance holds a %s' % kind.__name__)
    return value


def _key(value: Any) -> Any:
    """What tells a value from all others: 0.0 and -0.0 are equal, and so are 1, 1.0 and True."""
    kind = type(value)
    return (kind, value) if value or kind is not float else (kind, str(value))


class Tables:
    """Collects what the fields of one message need, and gives it numbers.

    The numbers of coefficients are known last, as they stand in the order of how they are written; until then a
    coefficient has a key.
    """

    def __init__(self) -> None:
        self._nodes: Dict[str, int] = {}
        self._sources: List[Tuple[int, int]] = []
        self._values: List[Any] = []
        self._first: Dict[Source, int] = {}
        self._readings: Dict[Any, int] = {}
        self._coefficients: Dict[Any, Any] = {}
        self._source_lists: Dict[Tuple[int, ...], int] = {}
        self._slope_lists: Dict[Tuple[Any, ...], int] = {}
        self._listed = 0

    def _add(self, source: Source, value: Any) -> int:
        if not 0 <= source.location_id < 1 << 48:
            raise Unencodable('its location id %d is not of 48 bits' % source.location_id)
        if len(self._sources) == TABLE_LIMIT:
            raise Unencodable('the message has too many sources')
        checked(source.node)
        self._sources.append((self._nodes.setdefault(source.node, len(self._nodes)), source.location_id))
        self._values.append(value)
        return len(self._sources) - 1

    def source(self, source: Source) -> int:
        """The number of a source, for a field that is the source itself and so has its value."""
        number = self._first.get(source)
        if number is None:
            number = self._first[source] = self._add(source, None)
        return number

    def reading(self, source: Source, value: Any) -> int:
        """The number of a source with a value, as a message may hold two readings of one source."""
        key = (source, _key(value))
        number = self._readings.get(key)
        if number is None:
            checked(value)
            number = self._first.get(source)
            if number is None or self._values[number] is not None:
                number = self._add(source, value)
                self._first.setdefault(source, number)
            else:
                self._values[number] = value
            self._readings[key] = number
        return number

    def coefficient(self, slope: Any) -> Any:
        """The key of a coefficient."""
        key = _key(slope)
        if key not in self._coefficients:
            if type(slope) is not float and type(slope) is not int:
                raise Unencodable('its slope is a %s' % type(slope).__name__)
            if len(self._coefficients) == TABLE_LIMIT:
                raise Unencodable('the message has too many coefficients')
            self._coefficients[key] = checked(slope)
        return key

    def lists(self, numbers: Tuple[int, ...], keys: Tuple[Any, ...]) -> Tuple[int, int]:
        """The numbers, among the lists, of one of sources and one of the keys of their coefficients."""
        if numbers not in self._source_lists or keys not in self._slope_lists:
            self._listed += len(numbers)
            if self._listed > LISTED_LIMIT:
                raise Unencodable('the message has too many lists of sources')
        return (
            self._source_lists.setdefault(numbers, len(self._source_lists)),
            self._slope_lists.setdefault(keys, len(self._slope_lists)),
        )

    def number_coefficients(self) -> Dict[Any, int]:
        """Give the coefficients their numbers, from 1: by the way in which they are written."""
        floats, whole, ints = [], [], []
        for key, slope in self._coefficients.items():
            if type(slope) is int:
                ints.append(key)
            elif is_whole(slope):
                whole.append(key)
            else:
                floats.append(key)
        self._written = (
            [self._coefficients[key] for key in floats],
            [zigzag(int(self._coefficients[key])) for key in whole],
            [zigzag(self._coefficients[key]) for key in ints],
        )
        self._numbers = {key: number for number, key in enumerate(floats + whole + ints, 1)}
        return self._numbers

    @property
    def source_count(self) -> int:
        return len(self._sources)

    @property
    def source_list_count(self) -> int:
        return len(self._source_lists)

    @property
    def coefficient_count(self) -> int:
        return len(self._coefficients)

    def flags(self) -> int:
        """The flags of the parts that are there."""
        return (
            (HAS_VALUES if any(value is not None for value in self._values) else 0)
            | (HAS_COEFFICIENTS if self._coefficients else 0)
            | (HAS_LISTS if self._source_lists else 0)
        )

    def readings(self) -> List[int]:
        """The numbers of the sources with values, in order of appearance."""
        return list(self._readings.values())

    def parts(self) -> Parts:
        """The tables, after `number_coefficients`."""
        flags = self.flags()
        floats, whole, ints = self._written
        head = [
            packed([len(self._nodes)]),
            packed_strings(list(self._nodes)),
            packed([len(self._sources)]),
            packed([node for node, _ in self._sources]),
            b''.join([location.to_bytes(6, 'little') for _, location in self._sources]),
        ]
        middle, tail = [], []
        if flags & HAS_VALUES:
            head.append(packed([_kind_of_value(value) for value in self._values]))
            middle += [
                packed([zigzag(value) for value in self._values if type(value) is int]),
                packed_strings([value for value in self._values if type(value) is str]),
            ]
        if flags & HAS_COEFFICIENTS:
            middle.append(packed([len(floats), len(whole), len(ints)]))
            tail += [packed(whole), packed(ints)]
        if flags & HAS_LISTS:
            tail += [
                packed([len(self._source_lists), len(self._slope_lists)]),
                packed([len(numbers) for numbers in self._source_lists]),
                packed([number for numbers in self._source_lists for number in numbers]),
                packed([len(keys) for keys in self._slope_lists]),
                packed([self._numbers[key] for keys in self._slope_lists for key in keys]),
            ]
        return Parts(
            b''.join(head),
            [value for value in self._values if type(value) is float],
            b''.join(middle),
            floats,
            b''.join(tail),
        )


def _kind_of_value(value: Any) -> int:
    if type(value) is bool:
        return TRUE if value else FALSE
    return NO_VALUE if value is None else {float: FLOAT, int: INT, str: STRING}[type(value)]


class ReadTables:
    """The tables of a provenance that came from outside, each number in them checked.

    Attributes:
        values: of each source its value; None where there is none.
        coefficients: from number 1; number 0 is None.
    """

    def __init__(self, reader: Reader, flags: int) -> None:
        self._nodes = reader.strings(reader.number('the number of nodes', TABLE_LIMIT), 'nodes')
        self.source_count = reader.number('the number of sources', TABLE_LIMIT)
        self._source_nodes = reader.column(self.source_count, 'nodes of sources')
        if self.source_count and max(self._source_nodes) >= len(self._nodes):
            raise reader.fail('found a source of node %d of %d', max(self._source_nodes), len(self._nodes))
        self._ids = reader.bytes(6 * self.source_count, 'location ids')
        self.values: Sequence[Any] = (None,) * self.source_count
        self._float_values: Sequence[int] = ()
        self._values_at = reader.at
        if flags & HAS_VALUES:
            kinds = reader.column(self.source_count, 'kinds of values')
            self._float_values = [number for number, kind in enumerate(kinds) if kind == FLOAT]
            self._values_at = reader.at
            self.values = _read_values(reader, kinds)
        self.coefficients: List[Any] = [None]
        # Without coefficients, their block of floats is empty and begins where the values end.
        self._float_slopes, self._slopes_at = 0, reader.at
        if flags & HAS_COEFFICIENTS:
            counts = [reader.number('the number of coefficients', TABLE_LIMIT) for _ in range(3)]
            self._float_slopes, self._slopes_at = counts[0], reader.at
            self.coefficients += reader.floats(counts[0], 'a coefficient')
            self.coefficients += map(float, map(unzigzag, reader.column(counts[1], 'coefficients')))
            self.coefficients += map(unzigzag, reader.column(counts[2], 'coefficients'))
            if counts[1] or counts[2]:
                self._check_integers(reader, self.coefficients[1 + counts[0] :])
        self.source_lists: List[Tuple[int, ...]] = []
        self.slope_lists: List[Tuple[int, ...]] = []
        if flags & HAS_LISTS:
            counts = [reader.number('the number of lists', TABLE_LIMIT) for _ in range(2)]
            self.source_lists = _read_lists(reader, counts[0], self.source_count, 0, 'sources')
            self._check_lists(reader)
            self.slope_lists = _read_lists(reader, counts[1], len(self.coefficients), 1, 'coefficients')

    def parts(self, data: bytes) -> Parts:
        """The parts of the provenance that these tables were read from."""
        values_to = self._values_at + 8 * len(self._float_values)
        slopes_to = self._slopes_at + 8 * self._float_slopes
        return Parts(
            data[: self._values_at],
            [self.values[number] for number in self._float_values],
            data[values_to : self._slopes_at],
            self.coefficients[1 : 1 + self._float_slopes],
            data[slopes_to:],
        )

    def with_floats(self, values: Sequence[float], slopes: Sequence[float]) -> 'ReadTables':
        """The same tables with those floats as values and coefficients; they must be finite."""
        if len(values) < self.source_count:
            floats, values = values, list(self.values)
            for number, value in zip(self._float_values, floats):
                values[number] = value
        result = ReadTables.__new__(ReadTables)
        result.__dict__.update(
            self.__dict__, values=values, coefficients=[None, *slopes, *self.coefficients[1 + len(slopes) :]]
        )
        return result

    @staticmethod
    def _check_integers(reader: Reader, numbers: Sequence[Any]) -> None:
        for number in numbers:
            if not -INT_LIMIT < number < INT_LIMIT:
                raise reader.fail('found the integer %d, of more than 64 bits', number)

    def _check_lists(self, reader: Reader) -> None:
        """Check that no list names a source twice: a sum has one slope for each of its sources."""
        if not self.source_lists:
            return
        named: Dict[str, int] = {}
        names = [named.setdefault(node, number) for number, node in enumerate(self._nodes)]
        first: Dict[int, int] = {}
        firsts = [
            first.setdefault(
                names[node] << 48 | int.from_bytes(self._ids[6 * number : 6 * number + 6], 'little'), number
            )
            for number, node in enumerate(self._source_nodes)
        ]
        for each in self.source_lists:
            if len({firsts[number] for number in each}) < len(each):
                raise reader.fail('found a list of sources with the same source twice')

    def source(self, number: int) -> Source:
        """A source by its number."""
        return Source(
            self._nodes[self._source_nodes[number]], int.from_bytes(self._ids[6 * number : 6 * number + 6], 'little')
        )


def _read_values(reader: Reader, kinds: Sequence[int]) -> List[Any]:
    counts = {kind: list(kinds).count(kind) for kind in set(kinds)}
    unknown = sorted(set(counts) - set(range(TRUE + 1)))
    if unknown:
        raise reader.fail('found a value of the unknown kind %d', unknown[0])
    floats = iter(reader.floats(counts.get(FLOAT, 0), "a source's value"))
    ints = [unzigzag(number) for number in reader.column(counts.get(INT, 0), 'values')]
    ReadTables._check_integers(reader, ints)
    strings = iter(reader.strings(counts.get(STRING, 0), 'values'))
    following = {
        NO_VALUE: itertools.repeat(None),
        FLOAT: floats,
        INT: iter(ints),
        STRING: strings,
        FALSE: itertools.repeat(False),
        TRUE: itertools.repeat(True),
    }
    return [next(following[kind]) for kind in kinds]


def _read_lists(reader: Reader, count: int, end: int, start: int, what: str) -> List[Tuple[int, ...]]:
    sizes = reader.column(count, 'lengths of lists of ' + what)
    total = sum(sizes)
    if total > LISTED_LIMIT or (count and min(sizes) < 2):
        raise reader.fail('found lists of %d %s, the shortest of %d', total, what, min(sizes))
    numbers = iter(reader.column(total, 'lists of ' + what))
    lists = [tuple(itertools.islice(numbers, size)) for size in sizes]
    for each in lists:
        if not start <= min(each) <= max(each) < end:
            raise reader.fail('found a list of %s with number %d of %d', what, max(each), end)
    return lists
