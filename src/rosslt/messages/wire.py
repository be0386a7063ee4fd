"""The wire format, version 1: the provenance of a message's tracked fields as bytes.

`docs/wire_format.md` describes every byte. The tables come first, then the instructions of what is not affine, then the
fields in three columns: which leaf, made of which sources, with which coefficients. This module writes it, `received`
reads it.
"""

import functools
from typing import Any, Dict, List, Optional, Sequence, Tuple

from rosslt.messages.columns import packed
from rosslt.messages.instructions import INSTRUCTION_LIMIT, having_sources, packed_instructions, register
from rosslt.messages.layout import TYPE_OF_KIND
from rosslt.messages.outlines import Field, Numbered, Outline, Parts, Terms, numbered
from rosslt.messages.reports import warn_once
from rosslt.messages.straight import searches
from rosslt.messages.tables import HAS_COEFFICIENTS, HAS_GRAPH, Tables, Unencodable
from rosslt.messages.walkers import PLAIN, TRACKED, walkers
from rosslt.values import AFFINE, SOURCE, Source, affine, disassemble, linearized, origins, untracked

VERSION = 1

BYTES_LIMIT = 1 << 20
"""The longest provenance of a message."""

FIELD_LIMIT = 1 << 16
"""The most tracked leaves of a message."""

IDENTITY = 0
"""In the place of the number of a field's coefficients: the field is its source."""

Leaf = Tuple[int, Any, str]
"""The index of a tracked leaf, its value and its kind, as the walkers collect them."""

_KIND_OF = {tracked: kind for kind, plain in TYPE_OF_KIND.items() for tracked in TRACKED if PLAIN[tracked] is plain}

RECENT_FIELDS = 64
"""The most fields of a message of whose provenance the outline is remembered for the next one."""


def encode(message: Any, full_history: bool = False) -> bytes:
    """The provenance of a message's tracked leaves.

    Args:
        message: any ROS message.
        full_history: send expressions as they were recorded, for explaining, instead of what they come to; a message
            with more than INSTRUCTION_LIMIT operations is sent without.

    Returns:
        b'' where no leaf is tracked. A leaf whose provenance cannot be sent (see docs/messages.md) is left out, with a
        warning on rosout.
    """
    straight = searches(message.__class__)
    gathered = straight.gather(message) if straight else None
    if gathered:
        which, values = gathered
        sources = origins(values)
        if sources is not None and len(sources) <= RECENT_FIELDS:
            data = _of_sources(message._type, which, sources)
            if len(data) <= BYTES_LIMIT:
                return data
        found = [(index, value, _KIND_OF[type(value)]) for index, value in zip(_indices(which), values)]
    else:
        found = []
        walkers(message.__class__).collect(message, 0, found.append)
    if len(found) > FIELD_LIMIT:
        warn_once(
            (message._type, FIELD_LIMIT),
            'a %s has %d tracked leaves, of which the first %d stay so',
            message._type,
            len(found),
            FIELD_LIMIT,
        )
        del found[FIELD_LIMIT:]
    while found:
        data = _encoded(message._type, found, full_history)
        if len(data) <= BYTES_LIMIT:
            return data
        warn_once(
            (message._type, BYTES_LIMIT),
            'a %s has more than %d bytes of provenance: only the first half of its leaves stays tracked',
            message._type,
            BYTES_LIMIT,
        )
        del found[len(found) // 2 :]
    return b''


def provenance_to_send(message: Any, full_history: bool = False) -> bytes:
    """`encode`, for a message that must be sent in any case: b'' with a warning on rosout where encoding fails in a way
    that no check foresaw."""
    try:
        return encode(message, full_history)
    except Exception as error:
        fault = 'a %s is sent untracked: encoding its provenance failed with %s: %s'
        warn_once((message._type, type(error)), fault, message._type, type(error).__name__, error)
        return b''


@functools.lru_cache(maxsize=256)
def _of_sources(message_type: str, which: int, sources: Sequence[Source]) -> bytes:
    """`_encoded`, remembered, for leaves that are their sources themselves: those with `1 << index` in `which`."""
    fields = [(index, source, ()) for index, source in zip(_indices(which), sources)]
    return _Encoder(message_type).encoded(fields, (), False)


@functools.lru_cache(maxsize=256)
def _indices(which: int) -> List[int]:
    """The places of the bits in a sum."""
    return [index for index in range(which.bit_length()) if which >> index & 1]


def fits(kind: str, terms: Terms) -> bool:
    """Whether affine terms give values of a field's kind: only integers make integers."""
    if kind in 'df':
        return True
    return kind == 'i' and all(type(value) is int and type(slope) is int for _, value, slope in terms)


def _is_same(value: Any, leaf: Any) -> bool:
    return value == leaf or (value != value and leaf != leaf)


def _encoded(message_type: str, leaves: Sequence[Leaf], full_history: bool) -> bytes:
    """The provenance of tracked leaves, whatever its size."""
    fields: List[Field] = []
    expressions: List[Leaf] = []
    for leaf in leaves:
        terms = None if full_history else _affine(leaf[1])
        if terms is None or (terms and not fits(leaf[2], terms)):
            expressions.append(leaf)
        elif terms:
            fields.append(_field(leaf, terms))
    if not (fields or expressions):
        return b''
    if not expressions and len(fields) <= RECENT_FIELDS:
        return _like_recently(message_type, fields)
    return _Encoder(message_type).encoded(fields, expressions, full_history)


def _affine(value: Any) -> Optional[Terms]:
    """`values.affine`; None as well where the slopes are larger than any float."""
    try:
        return affine(value)
    except ArithmeticError:
        return None


def _field(leaf: Leaf, terms: Terms) -> Field:
    """What the wire says of an affine leaf."""
    index, value, kind = leaf
    if len(terms) == 1:
        source, at, slope = terms[0]
        if slope == 1 and type(at) is TYPE_OF_KIND[kind] and _is_same(at, value):
            return index, source, ()
    return index, None, terms


def _like_recently(message_type: str, fields: List[Field]) -> bytes:
    """`_Encoder.encoded` in the outline of an earlier message: a publisher mostly says what it said before, with other
    numbers where something moves."""
    found = numbered(fields)
    if found is not None:
        outline, order = _recent_outline(message_type, found)
        if outline is not None:
            return outline.filled([found.values[place] for place in order] if order else found.values, found.slopes)
    return _Encoder(message_type).encoded(fields, (), False)


@functools.lru_cache(maxsize=256)
def _recent_outline(message_type: str, found: Numbered) -> Tuple[Optional[Outline], Optional[Sequence[int]]]:
    """The outline of fields, and in which order the values of sources come in it, where that is another one; None where
    a field is left out of it."""
    encoder = _Encoder(message_type)
    encoder.add_fields(found.fields)
    if len(encoder.fields) < len(found.fields):
        return None, None
    numbers = encoder.tables.readings()
    order = sorted(range(len(numbers)), key=numbers.__getitem__)
    return Outline(encoder.parts()), None if order == sorted(order) else order


class _Encoder:
    """Writes the provenance of one message."""

    def __init__(self, message_type: str) -> None:
        self._message_type = message_type
        self.tables = Tables()
        # Of each field its leaf, the number of its source and the key of its coefficient; or the numbers of the lists
        # of both, and True.
        self.fields: List[Tuple[int, int, Any, bool]] = []
        self._instructions: List[tuple] = []
        self._roots: Dict[int, int] = {}

    def encoded(self, fields: Sequence[Field], expressions: Sequence[Leaf], full_history: bool) -> bytes:
        self.add_fields(fields)
        if expressions:
            instructions, roots = disassemble(leaf for _, leaf, _ in expressions)
            if len(instructions) > INSTRUCTION_LIMIT:
                if full_history:
                    return _encoded(self._message_type, expressions, False)
                expressions, instructions, roots = self._linearized(expressions)
            self._add_expressions(expressions, instructions, roots)
        return self.parts().joined() if self.fields or self._roots else b''

    def add_fields(self, fields: Sequence[Field]) -> None:
        for field in fields:
            try:
                self._add_field(field)
            except Unencodable as error:
                self._leave_out(field[0], error)

    def _leave_out(self, index: int, error: Unencodable) -> None:
        fault = str(error)
        warn_once(
            (self._message_type, fault), 'leaf %d of a %s is sent untracked: %s', index, self._message_type, fault
        )

    def _add_field(self, field: Field) -> None:
        tables = self.tables
        index, itself, terms = field
        if itself is not None:
            self.fields.append((index, tables.source(itself), None, False))
        elif len(terms) == 1:
            source, value, slope = terms[0]
            self.fields.append((index, tables.reading(source, value), tables.coefficient(slope), False))
        else:
            numbers, keys = tables.lists(
                tuple([tables.reading(source, value) for source, value, _ in terms]),
                tuple([tables.coefficient(slope) for _, _, slope in terms]),
            )
            self.fields.append((index, numbers, keys, True))

    def _linearized(self, leaves: Sequence[Leaf]) -> Tuple[List[Leaf], List[tuple], List[int]]:
        """A linearization of each leaf, in place of the instructions that are too many."""
        shorter: List[tuple] = []
        places: Dict[Any, int] = {}
        kept, ends = [], []
        for index, leaf, kind in leaves:
            value = untracked(leaf)
            terms = [term for term in linearized(leaf) if type(term[1]) in (float, int)]
            if not terms or type(value) not in (float, int) or len(shorter) + len(terms) >= INSTRUCTION_LIMIT:
                self._leave_out(index, Unencodable('its expression is too long'))
                continue
            numbers = []
            for source, at, _ in terms:
                key = source, type(at), repr(at)
                if key not in places:
                    places[key] = len(shorter)
                    shorter.append((SOURCE, source, at))
                numbers.append(places[key])
            kept.append((index, leaf, kind))
            ends.append(len(shorter))
            slopes = [slope for _, _, slope in terms]
            shorter.append((AFFINE, value, tuple(zip(numbers, slopes)), False))
        return kept, shorter, ends

    def _add_expressions(self, leaves: Sequence[Leaf], instructions: List[tuple], roots: Sequence[int]) -> None:
        try:
            register(instructions, self.tables)
        except Unencodable:
            leaves = [leaf for leaf in leaves if self._is_sendable(leaf)]
            instructions, roots = disassemble(leaf for _, leaf, _ in leaves)
            try:
                register(instructions, self.tables)
            except Unencodable as error:
                for index, _, _ in leaves:
                    self._leave_out(index, error)
                return
        has_source = having_sources(instructions)
        for (index, leaf, kind), root in zip(leaves, roots):
            code, *operands = instructions[root]
            if not has_source[root]:
                continue  # What was received with it was refused.
            if code == SOURCE and type(operands[1]) is TYPE_OF_KIND[kind] and _is_same(operands[1], leaf):
                self.fields.append((index, self.tables.source(operands[0]), None, False))
            else:
                self._roots[index] = root
        if self._roots:
            self._instructions = instructions

    def _is_sendable(self, leaf: Leaf) -> bool:
        try:
            register(disassemble([leaf[1]])[0], Tables())
        except Unencodable as error:
            self._leave_out(leaf[0], error)
            return False
        return True

    def parts(self) -> Parts:
        """The provenance of all that was added."""
        tables = self.tables
        numbers = tables.number_coefficients()
        numbers[None] = IDENTITY
        # Lists come behind the single ones, of which there are as many as there are by now.
        sources, slopes = tables.source_count, 1 + tables.coefficient_count
        fields = [
            (index, sources + origin, slopes + slope) if is_list else (index, origin, numbers[slope])
            for index, origin, slope, is_list in self.fields
        ]
        instructions = sources + tables.source_list_count
        fields += [(index, instructions + root, IDENTITY) for index, root in self._roots.items()]
        fields.sort()
        flags = tables.flags() | (HAS_GRAPH if self._instructions else 0)
        tail = [packed_instructions(self._instructions, tables, numbers)] if self._instructions else []
        indices = [index for index, _, _ in fields]
        tail += [
            packed([len(fields)]),
            packed([index - before - 1 for index, before in zip(indices, [-1, *indices])]),
            packed([origin for _, origin, _ in fields]),
        ]
        if flags & HAS_COEFFICIENTS:
            tail.append(packed([slope for _, _, slope in fields]))
        parts = tables.parts()
        return parts._replace(head=bytes((VERSION, flags)) + parts.head, tail=parts.tail + b''.join(tail))
