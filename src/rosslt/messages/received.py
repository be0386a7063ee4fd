"""Provenance that was received: checked, and put onto the fields of its message.

Nothing in it is believed. Its form is checked as a whole before any field is touched; what it says of a field is
decoded when somebody first asks for that field's provenance.
"""

import functools
import itertools
from typing import Any, List, Optional, Sequence, Tuple

from rosslt.messages.columns import BadHeader, Reader
from rosslt.messages.graphs import Graph
from rosslt.messages.outlines import Outline, Parts
from rosslt.messages.straight import Load, Placer, straight_placer
from rosslt.messages.tables import HAS_COEFFICIENTS, HAS_GRAPH, HAS_LISTS, HAS_VALUES, ReadTables
from rosslt.messages.walkers import END, PLAIN, walkers
from rosslt.messages.wire import BYTES_LIMIT, FIELD_LIMIT, IDENTITY, VERSION, fits
from rosslt.values import Source, lazy, untracked

RECENT_BYTES = 1024
"""The longest provenance that is remembered for the next message."""

RECENT_OUTLINES = 4
"""The most outlines of one length that are remembered for a message class."""

Located = Tuple[Any, Any, Any, str]
"""Where a leaf is, its owner and the key in that; its value and its kind, as the walkers locate them."""


def attach(message: Any, data: bytes) -> None:
    """Put the provenance in `data` onto the fields of a message.

    Everything is checked first, except that the result of an expression which is not affine is computed when it is
    first asked for: if it is not the field's value, that field has no source, and rosout says so.

    Args:
        message: as received; leaves that are named in `data` become tracked, others stay as they are. Arrays of bytes
            and tuples with tracked elements become lists and tuples, NumPy arrays become arrays of objects.
        data: as `encode` gave it; b'' changes nothing.

    Raises:
        BadHeader: the data is not right, or does not fit the message; the message is as it was.
    """
    if not data:
        return
    data = bytes(data)
    if len(data) <= RECENT_BYTES:
        header, placer, loads = _recently_received(message.__class__, data)
        if placer is not None and placer.place(message, loads):
            return
    else:
        header = ReceivedHeader(data)
    wanted = header.wanted
    found: List[Located] = []
    arrays: List[Tuple[Any, str, Any, List[Any]]] = []
    more = iter(wanted).__next__
    walkers(message.__class__).locate(message, 0, more(), more, found.append, arrays.append)
    if wanted[len(found)] != END:
        raise BadHeader(
            'bad provenance: found one of leaf %d, which the %s does not have' % (wanted[len(found)], message._type)
        )
    tracked = header.tracked(found)
    for (owner, key, _, _), value in zip(found, tracked):
        if type(owner) is list:
            owner[key] = value
        else:
            setattr(owner, key, value)
    for owner, name, array, copy in arrays:
        setattr(owner, name, _like(array, copy))


@functools.lru_cache(maxsize=256)
def _recently_received(message_class: type, data: bytes) -> 'Tuple[ReceivedHeader, Optional[Placer], Sequence[Load]]':
    """A header, and what places its fields straight, with their loads, where that is possible. They are remembered:
    publishers mostly say what they have said in the message before."""
    header, placer = _header_and_placer(message_class, data)
    return header, placer, header.loads(placer.kinds) if placer else ()


def _header_and_placer(message_class: type, data: bytes) -> 'Tuple[ReceivedHeader, Optional[Placer]]':
    """A header, and what places its fields straight: from one that was checked before, where it differs from that in
    its floats only."""
    known = _recent_outlines(message_class, len(data), data[-4:])
    for outline, header, placer in known:
        floats = outline.floats(data)
        if floats is not None:
            return header.with_floats(*floats), placer
    header = ReceivedHeader(data)
    placer = header.placer(message_class)
    if header.is_affine:
        known.insert(0, (Outline(header.parts(data)), header, placer))
        del known[RECENT_OUTLINES:]
    return header, placer


@functools.lru_cache(maxsize=128)
def _recent_outlines(
    message_class: type,
    size: int,
    end: bytes,
) -> 'List[Tuple[Outline, ReceivedHeader, Optional[Placer]]]':
    """The list, to be kept, of the outlines of provenances of that size with that end, which is behind all floats."""
    return []


def _like(array: Any, items: List[Any]) -> Any:
    """Items as an array of the same sort, where that can hold tracked values: a list otherwise."""
    if type(array) is tuple:
        return tuple(items)
    if hasattr(array, 'dtype'):
        found = array.astype(object)
        found[:] = items
        return found
    return items


class ReceivedHeader:
    """A provenance that came from outside, its form checked.

    Raises:
        BadHeader: the form is not right.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) > BYTES_LIMIT:
            raise BadHeader('bad provenance: found %d bytes, the limit is %d' % (len(data), BYTES_LIMIT))
        if data[:1] != bytes((VERSION,)):
            raise BadHeader('bad provenance: found version %s, expected %d' % (data[0] if data else 'none', VERSION))
        reader = Reader(data)
        reader.at = 1
        flags = reader.number('the flags', HAS_VALUES | HAS_COEFFICIENTS | HAS_LISTS | HAS_GRAPH)
        self._tables = tables = ReadTables(reader, flags)
        self._graph = Graph(reader, tables) if flags & HAS_GRAPH else None
        count = reader.number('the number of fields', FIELD_LIMIT)
        gaps = reader.column(count, 'leaves')
        # The sum of a gap and 1 for each, so that no leaf comes twice.
        self.wanted = [index - 1 for index in itertools.accumulate(map((1).__add__, gaps))]
        self.wanted.append(END)
        self._origins = reader.column(count, 'the sources of fields')
        self._slopes = reader.column(count, 'the coefficients of fields') if flags & HAS_COEFFICIENTS else bytes(count)
        if reader.at != len(data):
            raise reader.fail('found %d bytes more than expected', len(data) - reader.at)
        self._lists_from = tables.source_count
        self._graph_from = tables.source_count + len(tables.source_lists)
        if count and not (max(self._origins) < self._lists_from and max(self._slopes) < len(tables.coefficients)):
            self._check_numbers(reader)
        self._known_loads: Tuple[Sequence[str], List[Load]] = ((), [])
        self._is_numeric = not any(self._slopes) or self._has_numbers_only()

    def _check_numbers(self, reader: Reader) -> None:
        """Check the numbers of each field, where some name more than single sources."""
        tables = self._tables
        singles = len(tables.coefficients)
        if (
            len(set(map(len, tables.source_lists + tables.slope_lists))) == 1
            and min(self._origins) >= self._lists_from
            and max(self._origins) < self._graph_from
            and min(self._slopes) >= singles
            and max(self._slopes) < singles + len(tables.slope_lists)
        ):
            return  # All are lists, and these of one length.
        instructions = self._graph.count if self._graph else 0
        for index, origin, slope in zip(self.wanted, self._origins, self._slopes):
            if origin < self._lists_from:
                fits = slope < singles
            elif origin < self._graph_from:
                place = slope - singles
                fits = 0 <= place < len(tables.slope_lists) and len(tables.slope_lists[place]) == len(
                    tables.source_lists[origin - self._lists_from]
                )
            else:
                fits = origin - self._graph_from < instructions and slope == IDENTITY
            if not fits:
                raise reader.fail(
                    'found leaf %d with sources %d and coefficients %d, which there are not', index, origin, slope
                )

    def _has_numbers_only(self) -> bool:
        """Whether every source that stands with a coefficient has a number as its value."""
        others = {number for number, value in enumerate(self._tables.values) if type(value) not in (float, int)}
        return others.isdisjoint(itertools.chain.from_iterable(self._tables.source_lists)) and others.isdisjoint(
            origin for origin, slope in zip(self._origins, self._slopes) if slope != IDENTITY
        )

    def tracked(self, found: Sequence[Located]) -> List[Any]:
        """The tracked values of the located leaves.

        Raises:
            BadHeader: one has a provenance that makes no values of its type.
        """
        values = [value for _, _, value, _ in found]
        kinds = [kind for _, _, _, kind in found]
        if not self._is_numeric or set(map(type, values)) != {float} or not {'d', 'f'}.issuperset(kinds):
            values = self._checked(found)
        return lazy(values, self.loads(kinds))

    @property
    def is_affine(self) -> bool:
        """Whether there are no instructions, which have floats of their own."""
        return self._graph is None

    def parts(self, data: bytes) -> Parts:
        """The parts of the provenance that this was read from."""
        return self._tables.parts(data)

    def with_floats(self, values: Sequence[float], slopes: Sequence[float]) -> 'ReceivedHeader':
        """The same header with other floats, which are finite, as values and coefficients."""
        result = ReceivedHeader.__new__(ReceivedHeader)
        result.__dict__.update(self.__dict__, _tables=self._tables.with_floats(values, slopes), _known_loads=((), []))
        return result

    def placer(self, message_class: type) -> Optional[Placer]:
        """What places the fields straight; None where that is not possible."""
        return straight_placer(message_class, tuple(self.wanted[:-1])) if self._is_numeric else None

    def loads(self, kinds: Sequence[str]) -> List[Load]:
        """Of each field what makes its provenance, as `lazy` asks for it."""
        known, loads = self._known_loads
        if kinds != known:
            load = self._load
            loads = [
                functools.partial(load, origin, slope, kind)
                for origin, slope, kind in zip(self._origins, self._slopes, kinds)
            ]
            self._known_loads = kinds, loads
        return loads

    def _checked(self, found: Sequence[Located]) -> List[Any]:
        values = []
        for origin, slope, index, (_, _, value, kind) in zip(self._origins, self._slopes, self.wanted, found):
            if type(value) in PLAIN:
                value = untracked(value)
            if type(value) not in (float, int, bool, str):
                raise BadHeader(
                    'bad provenance: found one of leaf %d, which holds a %s' % (index, type(value).__name__)
                )
            if slope != IDENTITY:
                terms = self._terms(origin, slope)
                if not (all(type(at) in (float, int) for _, at, _ in terms) and fits(kind, terms)):
                    raise BadHeader(
                        'bad provenance: found leaf %d, which holds %.60r, as a sum that begins with %r '
                        'times %.60r' % (index, value, terms[0][2], terms[0][1])
                    )
            values.append(value)
        return values

    def _terms(self, origin: int, slope: int) -> List[Tuple[Source, Any, Any]]:
        tables = self._tables
        if origin < self._lists_from:
            numbers: Sequence[int] = (origin,)
            slopes: Sequence[int] = (slope,)
        else:
            numbers = tables.source_lists[origin - self._lists_from]
            slopes = tables.slope_lists[slope - len(tables.coefficients)]
        return [
            (tables.source(number), tables.values[number], tables.coefficients[each])
            for number, each in zip(numbers, slopes)
        ]

    def _load(self, origin: int, slope: int, kind: str, value: Any) -> Any:
        """The provenance of one field, when it is first asked for."""
        if origin >= self._graph_from:
            assert self._graph is not None
            return self._graph.value(origin - self._graph_from, value, kind)
        if slope == IDENTITY:
            return ((self._tables.source(origin), value, 1),)
        return self._terms(origin, slope)
