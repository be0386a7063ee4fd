"""Writes the provenance of a message as bytes.

The tables come first, then the instructions of what is not affine, then the fields in three columns: which leaf, made
of which sources, with which coefficients.
"""

import itertools
import operator
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.codec.expressions import TERM_LIMIT, are_too_many, packed_instructions, register
from rosslt.messages.codec.table_writer import TableWriter, Unencodable, Unknown
from rosslt.messages.codec.varint import packed
from rosslt.messages.codec.wire_format import (
    BYTES_LIMIT,
    FIELD_LIMIT,
    HAS_COEFFICIENTS,
    HAS_INSTRUCTIONS,
    IDENTITY,
    INSTRUCTION_LIMIT,
    SAMPLED,
    VERSION,
)
from rosslt.messages.fault_log import warn_once
from rosslt.messages.fields import TYPE_OF_KIND, Message, Scalar
from rosslt.messages.walkers import walkers
from rosslt.values import AFFINE, SOURCE, UNKNOWN, Source, affine, disassemble, linearized, sources, untracked

Leaf = Tuple[int, Any, str]
"""The index of a tracked leaf, its value and its kind, as the walkers collect them."""

_INDEX, _VALUE = operator.itemgetter(0), operator.itemgetter(1)

Terms = Sequence[Tuple[Source, Any, Any]]
"""The sources of an affine value, each with its value and its slope."""


class Encoding(NamedTuple):
    """The provenance of a message that was sent."""

    leaves: List[Leaf]
    """The leaves that it is of."""
    full_history: bool
    data: bytes

    def is_of(self, leaves: List[Leaf], full_history: bool) -> bool:
        """Return whether it is of the very same leaves: a message that is filled once and sent again has them."""
        is_alike = self.full_history is full_history and len(leaves) == len(self.leaves)
        return (
            is_alike
            and all(map(operator.is_, map(_VALUE, leaves), map(_VALUE, self.leaves)))
            and all(map(operator.eq, map(_INDEX, leaves), map(_INDEX, self.leaves)))
        )


def _encoded_within_limit(message: Message, leaves: List[Leaf], full_history: bool) -> bytes:
    found, data = leaves, b''
    while found:
        try:
            data = _encoded(message._type, found, full_history)
        except Unknown:
            return SAMPLED
        if len(data) <= BYTES_LIMIT:
            break
        found, data = found[: len(found) // 2], b''
    if len(found) < len(leaves):
        warn_once(
            (message._type, BYTES_LIMIT),
            'a message of type %s has more than %d bytes of provenance: only its first %d tracked leaves are sent with '
            'theirs',
            message._type,
            BYTES_LIMIT,
            len(found),
        )
    return data


def sent_fields(message: Message) -> List[Leaf]:
    """The tracked leaves of a message whose provenance can be sent.

    A message may grow each time that it is sent: leaves beyond the limit are not looked at.
    """
    found: List[Leaf] = []
    walkers(message.__class__).collect(message, 0, found, FIELD_LIMIT)
    if len(found) > FIELD_LIMIT:
        warn_once(
            (message._type, FIELD_LIMIT),
            'a message of type %s has more than %d tracked leaves: those after these are sent without provenance',
            message._type,
            FIELD_LIMIT,
        )
        del found[FIELD_LIMIT:]
    return found


def encode(message: Message, full_history: bool = False) -> bytes:
    """The provenance of a message's tracked leaves.

    Args:
        message: any ROS message.
        full_history: send expressions as they were recorded, for explaining, instead of what they come to; a message
            with more than INSTRUCTION_LIMIT operations is sent without.

    Returns:
        b'' if no leaf is tracked, SAMPLED if one depends on `values.UNKNOWN`. A leaf whose provenance cannot be sent
        (see docs/messages.md) is left out, with a warning on rosout, and so are all if encoding them fails in a way
        that no check foresaw: a message must be sent in any case.
    """
    return encoding_to_send(message, full_history, None).data


def encoding_to_send(
    message: Message, full_history: bool, before: Optional[Encoding], cuts_unknown: bool = False
) -> Encoding:
    """`encode`, with what it is of; `before` itself if it is of the same leaves.

    Args:
        cuts_unknown: send what depends on what is not known as plain.
    """
    try:
        leaves = sent_fields(message)
        if cuts_unknown:
            leaves = [leaf for leaf in leaves if UNKNOWN not in sources(leaf[1])]
        if before is not None and before.is_of(leaves, full_history):
            return before
        return Encoding(leaves, full_history, _encoded_within_limit(message, leaves, full_history))
    except Exception as error:
        fault = 'a message of type %s is sent untracked: encoding its provenance failed with %s: %s'
        warn_once((message._type, type(error)), fault, message._type, type(error).__name__, error)
        return Encoding([], full_history, b'')


def fits(kind: str, terms: Sequence[Tuple[object, object, object]]) -> bool:
    """Return True if affine terms give values of a field's kind: an integer field needs integer terms."""
    if kind in 'df':
        return True
    return kind == 'i' and all(type(value) is int and type(slope) is int for _, value, slope in terms)


def _is_same(value: object, leaf: object) -> bool:
    return value == leaf or (value != value and leaf != leaf)


def _encoded(message_type: str, leaves: List[Leaf], full_history: bool) -> bytes:
    """The provenance of tracked leaves, whatever its size."""
    encoder = _Encoder(message_type)
    expressions: List[Leaf] = []
    for leaf in leaves:
        terms = None if full_history else _affine(leaf[1])
        if terms is None or (terms and not fits(leaf[2], terms)):
            expressions.append(leaf)
        elif terms:
            encoder.add_affine(leaf, terms)
    if expressions and not encoder.add_expressions(expressions, full_history):
        return _encoded(message_type, leaves, False)
    return encoder.encoded()


def _columns_of(fields: Sequence[Tuple[int, int, int]], has_coefficients: bool) -> bytes:
    """The columns of fields, their leaves rising."""
    indices, origins, slopes = zip(*fields)
    gaps = [index - before - 1 for index, before in zip(indices, (-1, *indices))]
    columns = packed([len(fields)]) + packed(gaps) + packed(origins)
    return columns + packed(slopes) if has_coefficients else columns


def _affine(value: Scalar) -> Optional[Terms]:
    """`values.affine`; None as well if the slopes are larger than any float."""
    try:
        return affine(value)
    except ArithmeticError:
        return None


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

    def add_affine(self, leaf: Leaf, terms: Terms) -> None:
        """Add a leaf that is affine in its sources."""
        tables = self.tables
        index, value, kind = leaf
        try:
            if len(terms) > 1:
                readings = tuple([tables.reading(source, at) for source, at, _ in terms])
                keys = tuple([tables.coefficient(slope) for _, _, slope in terms])
                self.fields.append((index, *tables.lists(readings, keys), True))
                return
            source, at, slope = terms[0]
            if slope == 1 and type(at) is TYPE_OF_KIND[kind] and _is_same(at, value):
                self.fields.append((index, tables.source(source), None, False))
            else:
                self.fields.append((index, tables.reading(source, at), tables.coefficient(slope), False))
        except Unencodable as error:
            self._leave_out(index, error)

    def add_expressions(self, leaves: Sequence[Leaf], full_history: bool) -> bool:
        """Add leaves that are sent as instructions; returns False if the full history of them is too long."""
        instructions, roots = disassemble(leaf for _, leaf, _ in leaves)
        if any(kind == AFFINE and not rest[1] for kind, *rest in instructions):
            # A value was received with a provenance that does not make it: it is plain, unless it has a different
            # source.
            leaves = [leaf for leaf in leaves if sources([leaf[1]])]
            instructions, roots = disassemble(leaf for _, leaf, _ in leaves)
        if are_too_many(instructions):
            if full_history:
                return False
            leaves, instructions, roots = self._linearized(leaves)
        self._add_expressions(leaves, instructions, roots)
        return True

    def _leave_out(self, index: int, error: Unencodable) -> None:
        fault = str(error)
        warn_once(
            (self._message_type, fault),
            'leaf %d of a message of type %s is sent untracked: %s',
            index,
            self._message_type,
            fault,
        )

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
        for (index, leaf, kind), root in zip(leaves, roots):
            code, *operands = instructions[root]
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

    def encoded(self) -> bytes:
        """The provenance of all that was added; b'' if that is nothing."""
        if not (self.fields or self._roots):
            return b''
        tables = self.tables
        sorted_keys = tables.sorted_coefficients()
        numbers = {key: number for number, key in enumerate([None, *itertools.chain(*sorted_keys)], IDENTITY)}
        # The numbers of lists follow those of the single coefficients, whose count is fixed at this point.
        sources, lists, coefficients = tables.counts()
        fields = [
            (index, sources + origin, 1 + coefficients + slope) if is_list else (index, origin, numbers[slope])
            for index, origin, slope, is_list in self.fields
        ]
        fields += [(index, sources + lists + root, IDENTITY) for index, root in self._roots.items()]
        fields.sort()
        flags = tables.flags() | (HAS_INSTRUCTIONS if self._instructions else 0)
        parts = [bytes((VERSION, flags)), tables.packed(sorted_keys, numbers)]
        if self._instructions:
            parts.append(packed_instructions(self._instructions, tables, numbers))
        parts.append(_columns_of(fields, bool(flags & HAS_COEFFICIENTS)))
        return b''.join(parts)
