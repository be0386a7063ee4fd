"""The tables in front of a provenance as they are read, each number in them checked."""

import itertools
from typing import Any, Container, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.codec.varint import Reader, unzigzagged
from rosslt.messages.codec.wire_format import (
    FALSE,
    FLOAT,
    HAS_COEFFICIENTS,
    HAS_LISTS,
    HAS_VALUES,
    INT,
    INT_LIMIT,
    LISTED_LIMIT,
    NO_VALUE,
    STRING,
    TABLE_LIMIT,
    TRUE,
)
from rosslt.values import Source


class SourceTable:
    """The sources of a provenance.

    Attributes:
        nodes: the names of nodes.
        source_nodes: for each source the number of its node.
        ids: the location ids, 6 bytes each.
    """

    __slots__ = ('_alike', 'ids', 'nodes', 'source_nodes')

    def __init__(self, nodes: Sequence[str], source_nodes: Sequence[int], ids: bytes) -> None:
        self.nodes, self.source_nodes, self.ids = nodes, source_nodes, ids
        self._alike: Optional[Sequence[int]] = None

    def alike(self) -> Sequence[int]:
        """A number for each source, shared by equal sources, as a table may name a source twice."""
        if self._alike is None:
            named: Dict[Tuple[str, bytes], int] = {}
            ids = [self.ids[at : at + 6] for at in range(0, len(self.ids), 6)]
            keys = zip(map(self.nodes.__getitem__, self.source_nodes), ids)
            self._alike = list(map(named.setdefault, keys, range(self.size)))
        return self._alike

    @property
    def size(self) -> int:
        """The number of sources."""
        return len(self.source_nodes)

    def source(self, number: int) -> Source:
        """A source by its number."""
        location_id = int.from_bytes(self.ids[6 * number : 6 * number + 6], 'little')
        return Source(self.nodes[self.source_nodes[number]], location_id)


class ReceivedTables(NamedTuple):
    """The tables of a provenance that came from outside."""

    sources: SourceTable
    values: Sequence[Any]
    """The value of each source; None if no value was sent."""
    coefficients: Sequence[Any]
    """The coefficients, from number 1; number 0 is None."""
    source_lists: Sequence[Tuple[int, ...]]
    slope_lists: Sequence[Tuple[int, ...]]

    def numbers(self, origin: int, slope: int) -> Tuple[Sequence[int], Sequence[int]]:
        """The numbers of the sources of a field that is a sum, and those of their coefficients."""
        if origin < self.sources.size:
            return (origin,), (slope,)
        return self.source_lists[origin - self.sources.size], self.slope_lists[slope - len(self.coefficients)]

    def origins_of(self, kinds: Container[type]) -> List[bool]:
        """Return a flag for each source, then one for each list of sources: True if all of its values have one of some
        types. The origin number of a field is an index of this list."""
        singles = [type(value) in kinds for value in self.values]
        return singles + [all(map(singles.__getitem__, each)) for each in self.source_lists]

    def whole_slopes(self) -> List[bool]:
        """Return a flag for each coefficient, then one for each list of coefficients: True if all are integers."""
        singles = [type(slope) is int for slope in self.coefficients]
        return singles + [all(map(singles.__getitem__, each)) for each in self.slope_lists]


def read_tables(reader: Reader, flags: int) -> ReceivedTables:
    """The tables that come next.

    Raises:
        BadHeader: they are not right.
    """
    sources = _read_sources(reader)
    values: Sequence[Any] = (None,) * sources.size
    if flags & HAS_VALUES:
        kinds = reader.column(sources.size, 'kinds of values')
        values = _read_values(reader, kinds)
    coefficients: List[Any] = [None]
    if flags & HAS_COEFFICIENTS:
        counts = [reader.number('the number of coefficients', TABLE_LIMIT) for _ in range(3)]
        coefficients += reader.floats(counts[0], 'a coefficient')
        coefficients += map(float, unzigzagged(reader.column(counts[1], 'coefficients')))
        coefficients += unzigzagged(reader.column(counts[2], 'coefficients'))
        if counts[1] or counts[2]:
            _check_integers(reader, coefficients[1 + counts[0] :])
    source_lists: List[Tuple[int, ...]] = []
    slope_lists: List[Tuple[int, ...]] = []
    if flags & HAS_LISTS:
        counts = [reader.number('the number of lists', TABLE_LIMIT) for _ in range(2)]
        source_lists = _read_lists(reader, counts[0], sources.size, 0, 'sources')
        _check_sources_differ(reader, source_lists, sources)
        slope_lists = _read_lists(reader, counts[1], len(coefficients), 1, 'coefficients')
    return ReceivedTables(sources, values, coefficients, source_lists, slope_lists)


def _read_sources(reader: Reader) -> SourceTable:
    nodes = reader.strings(reader.number('the number of nodes', TABLE_LIMIT), 'nodes')
    count = reader.number('the number of sources', TABLE_LIMIT)
    source_nodes = reader.column(count, 'nodes of sources')
    if count and max(source_nodes) >= len(nodes):
        raise reader.fail('found a source of node %d of %d', max(source_nodes), len(nodes))
    return SourceTable(nodes, source_nodes, reader.bytes(6 * count, 'location ids'))


def _check_integers(reader: Reader, numbers: Sequence[Any]) -> None:
    for number in (min(numbers), max(numbers)) if numbers else ():
        if not -INT_LIMIT < number < INT_LIMIT:
            raise reader.fail('found the integer %d, of more than 64 bits', number)


def _read_values(reader: Reader, kinds: Sequence[int]) -> List[Any]:
    counts = {kind: list(kinds).count(kind) for kind in set(kinds)}
    unknown = sorted(set(counts) - set(range(TRUE + 1)))
    if unknown:
        raise reader.fail('found a value of the unknown kind %d', unknown[0])
    floats = iter(reader.floats(counts.get(FLOAT, 0), "a source's value"))
    ints = unzigzagged(reader.column(counts.get(INT, 0), 'values'))
    _check_integers(reader, ints)
    strings = iter(reader.strings(counts.get(STRING, 0), 'values'))
    following: Dict[int, Iterator[Any]] = {
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
    numbers = reader.column(total, 'lists of ' + what)
    if total and not start <= min(numbers) <= max(numbers) < end:
        raise reader.fail('found a list of %s with number %d of %d', what, max(numbers), end)
    following = iter(numbers)
    return [tuple(itertools.islice(following, size)) for size in sizes]


def _check_sources_differ(reader: Reader, lists: Sequence[Tuple[int, ...]], sources: SourceTable) -> None:
    """Check that no list names a source twice: a sum has one slope for each of its sources."""
    if not lists:
        return
    alike = sources.alike()
    for each in lists:
        if len(set(map(alike.__getitem__, each))) < len(each):
            raise reader.fail('found a list of sources with the same source twice')
