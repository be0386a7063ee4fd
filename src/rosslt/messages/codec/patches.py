"""What other source values change in a provenance, and in the leaves that it is of, without making the message.

The provenances of a topic mostly differ in their floats only. What has to be computed for other source values, and
which bytes change, is worked out once for all of them, as a `Patch`. It gives what `values.reapply` and `encode` would.
"""

import functools
import struct
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt.messages.codec.decoder import ReceivedParts, read_parts
from rosslt.messages.codec.expressions import ReceivedInstructions
from rosslt.messages.codec.received_expressions import TEXTS_LIMIT, agrees, bounded_size
from rosslt.messages.codec.table_reader import ReceivedTables
from rosslt.messages.codec.templates import are_finite
from rosslt.messages.codec.varint import packed, packed_strings, zigzag
from rosslt.messages.codec.wire_format import FALSE, IDENTITY, TRUE
from rosslt.messages.fields import TYPE_OF_KIND
from rosslt.values import AFFINE, CONSTANT, SOURCE, Operation, Source

FLOAT = struct.Struct('<d')
_NARROW = struct.Struct('<f')
_NUMBERS = (float, int)

Terms = Sequence[Tuple[int, int]]
"""The cells of sources, each with that of its coefficient."""

Step = Tuple[int, Any, Any, Optional[int], type]
"""`(cell, forward, first, second, type)`: an operation on one cell or two, and the type of its result; or
`(cell, None, terms, None, type)`: a sum."""


class Unfit(Exception):
    """A message has to be decoded as a whole to be changed; the error says why."""


class Replaced(NamedTuple):
    """Bytes of a provenance, from one place to another, and what stands there then."""

    start: int
    end: int
    data: bytes


class PatchedLeaf(NamedTuple):
    """A leaf that depends on what changes."""

    leaf: int
    """Its index."""
    root: Optional[int]
    """The cell of the source that it is, or of the instruction that makes it; None for a sum."""
    terms: Optional[Terms]
    """Of a sum, those that change."""
    is_single: bool
    """Whether it is a sum of one term, or its source."""


class Patch:
    """What other source values change in all provenances that differ from a certain one in their floats only.

    Args:
        data: a provenance.
        changes: `{Source: value}`.

    Attributes:
        leaves: those that depend on what changes, their indices rising.
        wanted: the indices of all leaves that are tracked, rising.
        sums: of each of them that is a sum, whether all its parts are whole numbers.
        replaced: bytes that are the same in all these provenances then, and are others now, from the last one to the
            first.
        is_linearized: whether an expression was cut to its slopes.

    Raises:
        BadHeader: the form of the provenance is not right.
        Unfit: what changes does not keep its type, or cannot be computed.
    """

    def __init__(self, data: bytes, changes: Mapping[Source, Any]) -> None:
        parts = read_parts(data)
        cells = _Cells(data, parts, changes)
        self._unpack_floats, self._unpack_around = _splitters(len(data), cells.floats_at)
        self._around = self._unpack_around(data)
        self._rest, self._changed = cells.rest, list(cells.changed.items())
        self._steps, self._changed_steps, self._moving = cells.steps, cells.changed_steps, cells.moving
        self.wanted = tuple(parts.fields.wanted[:-1])
        self.sums = dict(cells.sums())
        self.leaves = list(cells.leaves())
        self.replaced = sorted(_replaced(data, parts.tables, changes), reverse=True)
        self.is_linearized = any(kind == AFFINE and not rest[-1] for kind, *rest in cells.instructions)

    def match(self, data: bytes) -> Optional[Sequence[float]]:
        """The floats of a provenance of the same length; None where it differs in more than these."""
        if self._unpack_around(data) != self._around:
            return None
        floats = self._unpack_floats(data)
        return floats if are_finite(floats, ()) else None

    def computed(
        self, floats: Sequence[float], present: Sequence[Any], kinds: Sequence[str]
    ) -> Tuple[List[Any], List[Tuple[int, float]]]:
        """What the leaves become.

        Args:
            floats: as of `match`.
            present: what the leaves are.
            kinds: of each leaf, as of `fields.kind_of`.

        Returns:
            The value of each leaf; and `(start, value)` of further floats in the provenance that are others then.

        Raises:
            Unfit: the message has to be decoded as a whole.
        """
        cells = [*floats, *self._rest]
        try:
            for cell, forward, first, second, kind in self._steps:
                value = forward(cells[first]) if second is None else forward(cells[first], cells[second])
                if value - value or type(value) is not kind:
                    raise Unfit('an operation gives %r' % (value,))
                cells[cell] = value
            changed = cells[:]
            for cell, value in self._changed:
                changed[cell] = value
            for cell, forward, first, second, kind in self._changed_steps:
                if forward is None:
                    value = summed(cells[cell], first, cells, changed)
                elif second is None:
                    value = forward(changed[first])
                else:
                    value = forward(changed[first], changed[second])
                if value - value or type(value) is not kind:
                    raise Unfit('an operation gives %r then' % (value,))
                changed[cell] = value
            found = [
                _checked(_leaf_value(leaf, value, kind, cells, changed), kind)
                for leaf, value, kind in zip(self.leaves, present, kinds)
            ]
        except (ArithmeticError, ValueError, TypeError) as error:
            raise Unfit(str(error)) from error
        return found, [(start, changed[cell]) for start, cell in self._moving]


def _splitters(size: int, floats_at: Sequence[int]) -> Tuple[Callable[[bytes], Any], Callable[[bytes], Any]]:
    """What takes the floats, and the bytes around them, from data of that size."""
    floats, around, end = '<', '<', 0
    for at in floats_at:
        if at > end:
            floats += '%dx' % (at - end)
            around += '%ds' % (at - end)
        floats += 'd'
        around += '8x'
        end = at + 8
    return struct.Struct('%s%dx' % (floats, size - end)).unpack, struct.Struct('%s%ds' % (around, size - end)).unpack


def summed(value: Any, terms: Terms, cells: Sequence[Any], changed: Sequence[Any]) -> Any:
    """A sum for changed sources, as the form of such a record has it."""
    for source, slope in terms:
        if changed[source] != cells[source]:
            value = value + cells[slope] * (changed[source] - cells[source])
    return value


def _leaf_value(leaf: PatchedLeaf, value: Any, kind: str, cells: Sequence[Any], changed: Sequence[Any]) -> Any:
    """What a leaf becomes, as `lazy` makes its provenance of what it is.

    Raises:
        Unfit: the provenance does not make what it is.
    """
    root, terms = leaf.root, leaf.terms
    if root is not None:
        if leaf.is_single:
            return changed[root]
        made = cells[root]
        if not agrees(made, value, kind):
            raise Unfit('it makes %.60r' % made)
        if terms is None:
            if kind not in 'df' or made == value or (kind == 'f' and _NARROW.unpack(_NARROW.pack(made))[0] == value):
                return changed[root]
            return changed[root] + (value - made)
    assert terms is not None
    if leaf.is_single:
        ((source, slope),) = terms
        at = cells[source]
        if cells[slope] == 1 and at == value and type(at) is type(value):
            return changed[source]
    return summed(value, terms, cells, changed)


def _checked(value: Any, kind: str) -> Any:
    """A value that a leaf of that kind can become.

    Raises:
        Unfit: it cannot, or not without being converted.
    """
    fits = type(value) is TYPE_OF_KIND[kind] or (type(value) is int and kind in 'df')
    if fits and (kind == 's' or value - value == 0):
        return value
    raise Unfit('a leaf would be %.60r' % (value,))


def _changed_values(tables: ReceivedTables, changes: Mapping[Source, Any]) -> Iterator[Tuple[int, Any]]:
    """The numbers of the sources that change, and their values then."""
    for number in range(tables.sources.size):
        source = tables.sources.source(number)
        if source in changes:
            yield number, changes[source]


def _replaced(data: bytes, tables: ReceivedTables, changes: Mapping[Source, Any]) -> Iterator[Replaced]:
    """The bytes of changed values in the table of sources.

    Raises:
        Unfit: the kinds of the values are written in more bytes than they take.
    """
    blocks, values = tables.blocks, list(tables.values)
    others = set()
    for number, value in _changed_values(tables, changes):
        if values[number] is None:
            continue
        if type(value) is float:
            at = blocks.values_at + 8 * list(blocks.value_numbers).index(number)
            yield Replaced(at, at + 8, FLOAT.pack(value))
        elif type(value) is bool:
            at = blocks.values_at - tables.sources.size + number
            if data[at] not in (TRUE, FALSE) or max(data[at : blocks.values_at]) > 127:
                raise Unfit('a kind of more than a byte')
            yield Replaced(at, at + 1, bytes([TRUE if value else FALSE]))
        else:
            others.add(number)
            values[number] = value
    if others:
        start = blocks.values_at + 8 * len(blocks.value_numbers)
        new = packed([zigzag(value) for value in values if type(value) is int])
        new += packed_strings([value for value in values if type(value) is str])
        yield Replaced(start, blocks.values_to, new)


class _Cells:
    """The numbers of a provenance and of its results, as *cells* of a list: its floats, then a cell for the result of
    each instruction, then all that is equal in provenances that differ in their floats only.

    Attributes:
        floats_at: where the floats begin.
        instructions: as they were read.
        rest: the cells behind the floats, as far as they are known.
        changed: `{cell: value}` as far as that is the same in all these provenances.
        steps: the operations that depend on floats.
        changed_steps: the operations and sums that depend on what changes, too.
        moving: `(start, cell)` of the floats that are others then.
    """

    def __init__(self, data: bytes, parts: ReceivedParts, changes: Mapping[Source, Any]) -> None:
        tables, instructions = parts.tables, parts.instructions or ReceivedInstructions([], [])
        blocks = tables.blocks
        self._parts = parts
        self.instructions = instructions.read
        self.floats_at = [
            *range(blocks.values_at, blocks.values_at + 8 * len(blocks.value_numbers), 8),
            *range(blocks.slopes_at, blocks.slopes_at + 8 * blocks.slope_count, 8),
            *instructions.floats_at,
        ]
        self._results_from = len(self.floats_at)
        self._present: List[Any] = [FLOAT.unpack_from(data, at)[0] for at in self.floats_at]
        self._present += [None] * len(self.instructions)
        self._fixed_from = len(self._present)
        self._then = self._present[:]  # the same with the changes
        value_count = len(blocks.value_numbers)
        self._sources = self._of_table(tables.values, blocks.value_numbers, 0)
        self._slopes = self._of_table(tables.coefficients, range(1, 1 + blocks.slope_count), value_count)
        self.changed: Dict[int, Any] = {}
        self._depending: Set[int] = set()
        for number, value in _changed_values(tables, changes):
            known = tables.values[number]
            if known is not None and type(known) is not type(value):
                raise Unfit('a source has the value %r, not %r' % (known, value))
            self._depend(self._sources[number], value)
            self.changed[self._sources[number]] = value
        self.steps: List[Step] = []
        self.changed_steps: List[Step] = []
        self.moving: List[Tuple[int, int]] = []
        self._characters = 0
        self._floats = iter(range(value_count + blocks.slope_count, self._results_from))
        self._made: List[int] = []
        for at, instruction in enumerate(self.instructions):
            self._made.append(self._cell_of(self._results_from + at, instruction))
        self.rest = self._present[self._results_from :]

    def _of_table(self, numbers: Sequence[Any], floats: Sequence[int], first: int) -> List[int]:
        """The cell of each number of a table; those that are floats in the data have cells from `first` on."""
        of_floats = dict(zip(floats, range(first, first + len(floats))))
        return [of_floats[place] if place in of_floats else self._fixed(number) for place, number in enumerate(numbers)]

    def _fixed(self, value: Any) -> int:
        self._present.append(value)
        self._then.append(value)
        return len(self._present) - 1

    def _depend(self, cell: int, then: Any) -> None:
        self._depending.add(cell)
        self._then[cell] = then

    def _cell_of(self, result: int, instruction: tuple) -> int:
        """The cell that has what an instruction makes, which is `result` where it depends on floats."""
        kind = instruction[0]
        if kind == SOURCE:
            return self._sources[instruction[1]]
        if kind == CONSTANT:
            return next(self._floats) if type(instruction[1]) is float else self._fixed(instruction[1])
        if kind == AFFINE:
            return self._cell_of_sum(instruction)
        return self._cell_of_operation(result, kind, [self._made[place] for place in instruction[1:]])

    def _cell_of_sum(self, instruction: tuple) -> int:
        value, moving = instruction[1], self._moving_terms(instruction)
        if type(value) is not float:
            if moving:
                raise Unfit('a sum of whole numbers in an expression')
            return self._fixed(value)
        cell = next(self._floats)
        if moving:
            self.changed_steps.append((cell, None, moving, None, float))
            self.moving.append((self.floats_at[cell], cell))
            self._depend(cell, summed(value, moving, self._present, self._then))
        return cell

    def _moving_terms(self, instruction: tuple) -> Terms:
        """Of the terms of a sum those that change."""
        return self._those_that_move([(self._made[place], self._slopes[number]) for place, number in instruction[2]])

    def _those_that_move(self, terms: Terms) -> Terms:
        return [(source, slope) for source, slope in terms if source in self._depending]

    def _cell_of_operation(self, result: int, row: Operation, operands: List[int]) -> int:
        now = [self._present[cell] for cell in operands]
        value = self._applied(row, now)
        is_fixed = min(operands) >= self._fixed_from
        if is_fixed:
            result = self._fixed(value)
        else:
            if type(value) is str:
                raise Unfit('a text that depends on a float')
            forward = row.forward if float in map(type, now) else functools.partial(_bounded, row)
            step = result, forward, operands[0], operands[1] if row.arity == 2 else None, type(value)
            self.steps.append(step)
            self._present[result] = self._then[result] = value
        if not self._depending.isdisjoint(operands):
            then = self._applied(row, [self._then[cell] for cell in operands])
            if type(then) is not type(value):
                raise Unfit('an operation gives %r then, not %r' % (then, value))
            self._depend(result, then)
            if is_fixed:
                self.changed[result] = then
            else:
                self.changed_steps.append(step)
        return result

    def _applied(self, row: Operation, operands: List[Any]) -> Any:
        """The result of an operation on plain values, in the bounds of `received_expressions`."""
        if any(type(operand) is str for operand in operands) and not row.on_text:
            raise Unfit('%s of a text' % row.name)
        try:
            self._characters += bounded_size(row, operands)
            value = row.forward(*operands) if self._characters <= TEXTS_LIMIT else None
        except (ArithmeticError, ValueError, TypeError) as error:
            raise Unfit(str(error)) from error
        if type(value) not in TYPE_OF_KIND.values() or (type(value) is float and value - value):
            raise Unfit('an operation gives %.60r' % (value,))
        return value

    def sums(self) -> Iterator[Tuple[int, bool]]:
        """Of the leaves that are sums, whether all their parts are whole numbers."""
        tables, fields = self._parts.tables, self._parts.fields
        for index, origin, slope in zip(fields.wanted, fields.origins, fields.slopes):
            if slope != IDENTITY:
                numbers, slopes = tables.numbers(origin, slope)
                kinds = {type(tables.values[number]) for number in numbers}
                if not kinds.issubset(_NUMBERS):
                    raise Unfit('a sum of something else than numbers')
                yield index, kinds == {int} and all(type(tables.coefficients[each]) is int for each in slopes)

    def leaves(self) -> Iterator[PatchedLeaf]:
        """Those that depend on what changes."""
        tables, fields = self._parts.tables, self._parts.fields
        for index, origin, slope in zip(fields.wanted, fields.origins, fields.slopes):
            if slope != IDENTITY:
                numbers, slopes = tables.numbers(origin, slope)
                terms = [(self._sources[number], self._slopes[each]) for number, each in zip(numbers, slopes)]
                if self._those_that_move(terms):
                    yield PatchedLeaf(index, None, self._those_that_move(terms), len(terms) == 1)
            elif origin < tables.sources.size:
                if self._sources[origin] in self._depending:
                    yield PatchedLeaf(index, self._sources[origin], None, True)
            else:
                place = origin - tables.sources.size - len(tables.source_lists)
                if self._made[place] in self._depending:
                    instruction = self.instructions[place]
                    moving = self._moving_terms(instruction) if instruction[0] == AFFINE else None
                    yield PatchedLeaf(index, self._made[place], moving, False)


def _bounded(row: Operation, *operands: Any) -> Any:
    """The result of an operation on whole numbers, which could be large."""
    bounded_size(row, operands)
    return row.forward(*operands)
