"""Writes the provenance of a message as bytes.

The tables come first, then the instructions of what is not affine, then the fields in three columns: which leaf, made
of which sources, with which coefficients.
"""

import functools
import itertools
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.codec.bounded_cache import BoundedCache
from rosslt.messages.codec.expressions import (
    TERM_LIMIT,
    are_too_many,
    packed_instructions,
    register,
    without_sources,
)
from rosslt.messages.codec.table_writer import TableWriter, Unencodable
from rosslt.messages.codec.templates import AffineField, Parts, Shape, Template, Terms, shape_of
from rosslt.messages.codec.varint import packed
from rosslt.messages.codec.wire_format import (
    BYTES_LIMIT,
    FIELD_LIMIT,
    HAS_COEFFICIENTS,
    HAS_INSTRUCTIONS,
    IDENTITY,
    INSTRUCTION_LIMIT,
    VERSION,
)
from rosslt.messages.codegen.walkers import TRACKED, walkers
from rosslt.messages.fault_log import warn_once
from rosslt.messages.fields import TYPE_OF_KIND
from rosslt.values import (
    AFFINE,
    SOURCE,
    affine,
    disassemble,
    each_leaf,
    linearized,
    untracked,
)

Leaf = Tuple[int, Any, str]
"""The index of a tracked leaf, its value and its kind, as the walkers collect them."""

MAX_TEMPLATE_FIELDS = 64
"""The most fields of a message whose template is remembered for the next one."""


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
    found = sent_fields(message)
    count, data = len(found), b''
    while found:
        data = _encoded(message._type, found, full_history)
        if len(data) <= BYTES_LIMIT:
            break
        del found[len(found) // 2 :]
        data = b''
    if len(found) < count:
        warn_once(
            (message._type, BYTES_LIMIT),
            'a %s has more than %d bytes of provenance: it is sent without that of %s and of all leaves after it',
            message._type,
            BYTES_LIMIT,
            _Path(message, len(found)),
        )
    return data


def sent_fields(message: Any) -> List[Leaf]:
    """The tracked leaves of a message whose provenance can be sent.

    A message may be larger with each time that it is sent: what is beyond the limit is not looked at.
    """
    found: List[Leaf] = []
    walkers(message.__class__).collect(message, 0, found, FIELD_LIMIT)
    if len(found) > FIELD_LIMIT:
        warn_once(
            (message._type, FIELD_LIMIT),
            'a %s has more than %d tracked leaves: %s and all after it are sent without provenance',
            message._type,
            FIELD_LIMIT,
            _Path(message, FIELD_LIMIT),
        )
        del found[FIELD_LIMIT:]
    return found


class _Path:
    """The path of a message's tracked leaf by its number among them, looked for where it is printed."""

    def __init__(self, message: Any, number: int) -> None:
        self._message = message
        self._number = number

    def __str__(self) -> str:
        return self._path

    @functools.cached_property
    def _path(self) -> str:
        tracked = (path for path, leaf in each_leaf(self._message) if type(leaf) in TRACKED)
        return next(itertools.islice(tracked, self._number, None))


def provenance_to_send(message: Any, full_history: bool = False) -> bytes:
    """`encode`, for a message that must be sent in any case: b'' with a warning on rosout where encoding fails in a way
    that no check foresaw."""
    try:
        return encode(message, full_history)
    except Exception as error:
        fault = 'a %s is sent untracked: encoding its provenance failed with %s: %s'
        warn_once((message._type, type(error)), fault, message._type, type(error).__name__, error)
        return b''


def fits(kind: str, terms: Sequence[Tuple[Any, Any, Any]]) -> bool:
    """Return True if affine terms give values of a field's kind: an integer field needs integer terms."""
    if kind in 'df':
        return True
    return kind == 'i' and all(type(value) is int and type(slope) is int for _, value, slope in terms)


def _is_same(value: Any, leaf: Any) -> bool:
    return value == leaf or (value != value and leaf != leaf)


def _encoded(message_type: str, leaves: List[Leaf], full_history: bool) -> bytes:
    """The provenance of tracked leaves, whatever its size."""
    fields: List[AffineField] = []
    expressions: List[Leaf] = []
    for leaf in leaves:
        terms = None if full_history else _affine(leaf[1])
        if terms is None or (terms and not fits(leaf[2], terms)):
            expressions.append(leaf)
        elif terms:
            fields.append(_field(leaf, terms))
    if not (fields or expressions):
        return b''
    if not expressions and len(fields) <= MAX_TEMPLATE_FIELDS:
        return _encoded_affine(message_type, fields)
    return _Encoder(message_type).encoded(fields, expressions, full_history)


def _columns_of(fields: Sequence[Tuple[int, int, int]], has_coefficients: bool) -> bytes:
    """The columns of fields, their leaves rising."""
    indices = [index for index, _, _ in fields]
    columns = packed([len(fields)]) + packed([index - before - 1 for index, before in zip(indices, [-1, *indices])])
    columns += packed([origin for _, origin, _ in fields])
    return columns + packed([slope for _, _, slope in fields]) if has_coefficients else columns


def _affine(value: Any) -> Optional[Terms]:
    """`values.affine`; None as well where the slopes are larger than any float."""
    try:
        return affine(value)
    except ArithmeticError:
        return None


def _field(leaf: Leaf, terms: Terms) -> AffineField:
    """Convert an affine leaf to its form on the wire: one source, or a list of terms."""
    index, value, kind = leaf
    if len(terms) == 1:
        source, at, slope = terms[0]
        if slope == 1 and type(at) is TYPE_OF_KIND[kind] and _is_same(at, value):
            return index, source, ()
    return index, None, terms


class _KnownTemplate(NamedTuple):
    """The template of fields of one shape."""

    template: Optional[Template]
    """None where a field cannot be sent; then each message logs a warning."""
    order: Optional[Tuple[int, ...]]
    """In which order the values of sources come in it; None where that is the order of their appearance."""

    def fill(self, shape: Shape) -> bytes:
        """The provenance of fields of that shape."""
        assert self.template is not None
        values = shape.values if self.order is None else [shape.values[place] for place in self.order]
        return self.template.fill(values, shape.slopes)


_known_templates: BoundedCache[_KnownTemplate] = BoundedCache(256)


def _encoded_affine(message_type: str, fields: List[AffineField]) -> bytes:
    """`_Encoder.encoded` for affine fields, by the template of an earlier message where there is one.

    A publisher mostly says what it said before, with other numbers where something moves.
    """
    shape = shape_of(fields)
    if shape is not None:
        key = message_type, shape.key
        known = _known_templates.get(key)
        if known is None:
            known = _template_for(message_type, fields)
            _known_templates.put(key, known)
        if known.template is not None:
            return known.fill(shape)
    return _Encoder(message_type).encoded(fields, (), False)


def _template_for(message_type: str, fields: List[AffineField]) -> _KnownTemplate:
    """The template of the provenance of these fields."""
    encoder = _Encoder(message_type)
    encoder.add_fields(fields)
    if len(encoder.fields) < len(fields):
        return _KnownTemplate(None, None)
    numbers = encoder.tables.readings()
    order = tuple(sorted(range(len(numbers)), key=numbers.__getitem__))
    parts = encoder.parts()
    template = Template(parts.head, len(parts.values), parts.middle, len(parts.slopes), parts.tail)
    return _KnownTemplate(template, None if order == tuple(range(len(numbers))) else order)


class _Encoder:
    """Writes the provenance of one message."""

    def __init__(self, message_type: str) -> None:
        self._message_type = message_type
        self.tables = TableWriter()
        # For each field: its leaf, the number of its source, the key of its coefficient and False; or the numbers of
        # the lists of both, and True.
        self.fields: List[Tuple[int, int, Any, bool]] = []
        self._instructions: List[tuple] = []
        self._roots: Dict[int, int] = {}

    def encoded(self, fields: Sequence[AffineField], expressions: Sequence[Leaf], full_history: bool) -> bytes:
        self.add_fields(fields)
        if expressions:
            instructions, roots = disassemble(leaf for _, leaf, _ in expressions)
            if are_too_many(instructions):
                if full_history:
                    return _encoded(self._message_type, list(expressions), False)
                expressions, instructions, roots = self._linearized(expressions)
            self._add_expressions(expressions, instructions, roots)
        return self.parts().joined() if self.fields or self._roots else b''

    def add_fields(self, fields: Sequence[AffineField]) -> None:
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

    def _add_field(self, field: AffineField) -> None:
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
        """Linearize each leaf, as the exact expressions have too many instructions to be sent."""
        shorter: List[tuple] = []
        places: Dict[Any, int] = {}
        kept, ends, terms_left = [], [], TERM_LIMIT
        for index, leaf, kind in leaves:
            value = untracked(leaf)
            try:
                terms = [term for term in linearized(leaf) if type(term[1]) in (float, int)]
            except ArithmeticError:
                terms = []  # its slopes are larger than any float
            is_short = len(shorter) + len(terms) < INSTRUCTION_LIMIT and len(terms) <= terms_left
            if not (terms and is_short) or type(value) not in (float, int):
                self._leave_out(index, Unencodable('its expression is too long'))
                continue
            terms_left -= len(terms)
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
        sourceless = without_sources(instructions)
        for (index, leaf, kind), root in zip(leaves, roots):
            code, *operands = instructions[root]
            if root in sourceless:
                continue  # its received provenance was refused
            if code == SOURCE and type(operands[1]) is TYPE_OF_KIND[kind] and _is_same(operands[1], leaf):
                self.fields.append((index, self.tables.source(operands[0]), None, False))
            else:
                self._roots[index] = root
        if self._roots:
            self._instructions = instructions

    def _is_sendable(self, leaf: Leaf) -> bool:
        try:
            register(disassemble([leaf[1]])[0], TableWriter())
        except Unencodable as error:
            self._leave_out(leaf[0], error)
            return False
        return True

    def parts(self) -> Parts:
        """The provenance of all that was added."""
        tables = self.tables
        numbers = tables.coefficient_numbers()
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
        flags = tables.flags() | (HAS_INSTRUCTIONS if self._instructions else 0)
        tail = [packed_instructions(self._instructions, tables, numbers)] if self._instructions else []
        tail.append(_columns_of(fields, bool(flags & HAS_COEFFICIENTS)))
        parts = tables.parts(numbers)
        return parts._replace(head=bytes((VERSION, flags)) + parts.head, tail=parts.tail + b''.join(tail))
