"""Expressions that are not affine: instructions as bytes, each naming earlier ones by their distance.

A value's form of record says by which instructions it travels (`values.disassemble`), so that a new form needs nothing
here. What comes from outside is never trusted to be quick or small: the expressions of a message are computed when one
of them is first needed, operation by operation with a bound on each result.
"""

import math
import struct
from typing import Any, Callable, Dict, List, Optional, Sequence

from rosslt.messages.codec.table_reader import ReceivedTables
from rosslt.messages.codec.table_writer import TableWriter, Unencodable, checked
from rosslt.messages.codec.varint import Reader, packed, packed_strings, unzigzagged, zigzag
from rosslt.messages.codec.wire_format import (
    EXACT,
    FALSE,
    FLOAT,
    FROM_SOURCE,
    INSTRUCTION_LIMIT,
    INT,
    INT_LIMIT,
    LINEAR,
    OPERATION,
    STRING,
    TRUE,
)
from rosslt.messages.fault_log import warn_once
from rosslt.messages.fields import Scalar
from rosslt.messages.walkers import TRACKED
from rosslt.values import AFFINE, CONSTANT, OPERATIONS, SOURCE, Operation, assemble, untracked

TERM_LIMIT = 4 * INSTRUCTION_LIMIT
"""The most terms of all affine parts of a message."""


TEXT_LIMIT = 1 << 16
"""The longest text that an expression may make on its way."""

TEXTS_LIMIT = 1 << 20
"""The most characters that all texts on the way may have together."""

_LARGEST = 1e80
"""Bounds the results of operations on integers on the way."""


def are_too_many(instructions: Sequence[tuple]) -> bool:
    """Return True if instructions, or the terms of their affine parts, exceed the limits that readers enforce."""
    return (
        len(instructions) > INSTRUCTION_LIMIT
        or sum([len(instruction[2]) for instruction in instructions if instruction[0] == AFFINE]) > TERM_LIMIT
    )


def packed_instructions(instructions: Sequence[tuple], tables: TableWriter, numbers: Dict[object, int]) -> bytes:
    """Instructions as bytes.

    Args:
        instructions: as from `values.disassemble`, made known to the tables by `register`.
        tables: the tables of the message.
        numbers: the numbers of the coefficients.
    """
    parts: List[bytes] = []
    varints = [len(instructions)]

    def add(value: float, of_float: int, of_int: int) -> None:
        if isinstance(value, float):
            parts.append(packed([*varints, of_float]) + struct.pack('<d', value))
            varints.clear()
        else:
            varints.extend((of_int, zigzag(value)))

    for at, (kind, *operands) in enumerate(instructions):
        if kind == SOURCE:
            varints += FROM_SOURCE, tables.reading(*operands)
        elif kind == CONSTANT or (kind == AFFINE and not operands[1]):
            value = operands[0]
            if type(value) is str:
                parts.append(packed([*varints, STRING]) + packed_strings([value]))
                varints.clear()
            elif type(value) is bool:
                varints.append(TRUE if value else FALSE)
            else:
                add(value, FLOAT, INT)
        elif kind == AFFINE:
            value, terms, is_exact = operands
            code = EXACT if is_exact else LINEAR
            add(value, code, code + 1)
            varints.append(len(terms))
            for index, slope in terms:
                varints += at - index, numbers[tables.coefficient(slope)]
        else:
            varints.append(OPERATION + kind.code)
            varints += [at - index for index in operands]
    return b''.join([*parts, packed(varints)])


def register(instructions: Sequence[tuple], tables: TableWriter) -> None:
    """Make the sources and coefficients of instructions known to the tables.

    Raises:
        Unencodable: something in them cannot be sent.
    """
    for kind, *operands in instructions:
        if kind == SOURCE:
            tables.reading(*operands)
        elif kind == CONSTANT:
            checked(operands[0])
        elif kind == AFFINE:
            value, terms, _ = operands
            checked(value)
            for index, slope in terms:
                if not (type(value) in (float, int) and type(instructions[index][2]) in (float, int)):
                    raise Unencodable('its expression was too long, and texts and bools have no slopes')
                tables.coefficient(slope)


def _resolved(instruction: tuple, tables: ReceivedTables) -> tuple:
    kind = instruction[0]
    if kind == SOURCE:
        return kind, tables.sources.source(instruction[1]), tables.values[instruction[1]]
    if kind == AFFINE:
        _, value, terms, is_exact = instruction
        return kind, value, tuple([(index, tables.coefficients[number]) for index, number in terms]), is_exact
    return instruction


def read_instructions(reader: Reader, tables: ReceivedTables) -> List[tuple]:
    """The instructions that come next, in terms of the tables: `(SOURCE, number of the source)`, `(CONSTANT, value)`,
    `(AFFINE, value, ((index, number of the coefficient), ...), is_exact)` or `(Operation, index, ...)`.

    Raises:
        BadHeader: they have not the form of instructions.
    """
    return _InstructionReader(reader, tables).instructions()


_NO_NUMBER = -1


class _InstructionReader:
    """Reads the instructions of one provenance."""

    def __init__(self, reader: Reader, tables: ReceivedTables) -> None:
        self._reader = reader
        self._tables = tables
        self._read: List[tuple] = []
        self._numbers: List[int] = []  # of each instruction that of the source, if it is one with a number
        self._terms_left = TERM_LIMIT

    def instructions(self) -> List[tuple]:
        reader = self._reader
        for _ in range(reader.number('the number of instructions', INSTRUCTION_LIMIT)):
            code = reader.number('the code of an instruction', 1 << 16)
            number = _NO_NUMBER
            if code == FROM_SOURCE:
                self._read.append(self._source())
                if type(self._tables.values[self._read[-1][1]]) in (float, int):
                    number = self._read[-1][1]
            elif code in (FLOAT, INT, STRING, FALSE, TRUE):
                self._read.append((CONSTANT, self._constant(code)))
            elif code in (EXACT, EXACT + 1, LINEAR, LINEAR + 1):
                self._read.append(self._affine(code))
            else:
                self._read.append(self._operation(code - OPERATION))
            self._numbers.append(number)
        return self._read

    def _source(self) -> tuple:
        tables = self._tables
        number = self._reader.number('the number of a source', tables.sources.size - 1)
        if tables.values[number] is None:
            raise self._reader.fail('found an instruction with source %d, which has no value', number)
        return SOURCE, number

    def _constant(self, code: int) -> Any:
        if code == FLOAT:
            return self._reader.floats(1, 'a constant')[0]
        if code == INT:
            value = unzigzagged(self._reader.column(1, 'a constant'))[0]
            if not -INT_LIMIT < value < INT_LIMIT:
                raise self._reader.fail('found the integer %d, of more than 64 bits', value)
            return value
        if code == STRING:
            return self._reader.strings(1, 'a constant')[0]
        return code == TRUE

    def _affine(self, code: int) -> tuple:
        reader, tables, at = self._reader, self._tables, len(self._read)
        value = self._constant(FLOAT if code in (EXACT, LINEAR) else INT)
        size = reader.number('the number of terms', min(at, self._terms_left))
        self._terms_left -= size
        numbers = reader.column(2 * size, 'the terms of an affine part')
        indices, slopes = [at - distance for distance in numbers[::2]], numbers[1::2]
        for index in (min(indices), max(indices)) if size else ():
            if not 0 <= index < at:
                raise reader.fail('found the distance of an operand %d, the limit is %d', at - index, at)
        found = list(map(self._numbers.__getitem__, indices))
        if _NO_NUMBER in found:
            index = indices[found.index(_NO_NUMBER)]
            raise reader.fail('found an affine part over instruction %d, which is not the number of a source', index)
        for slope in (min(slopes), max(slopes)) if size else ():
            if not 0 < slope < len(tables.coefficients):
                raise reader.fail('found an affine part with coefficient %d of %d', slope, len(tables.coefficients) - 1)
        if len(set(map(tables.sources.alike().__getitem__, found))) < size:
            raise reader.fail('found an affine part with two terms of one source')
        return AFFINE, value, tuple(zip(indices, slopes)), code < LINEAR

    def _operation(self, code: int) -> tuple:
        reader, at = self._reader, len(self._read)
        operation = OPERATIONS.get(code)
        if operation is None:
            raise reader.fail('found the unknown operation %d', code)
        first = reader.number('the distance of an operand', at)
        second = reader.number('the distance of an operand', at) if operation.arity == 2 else None
        if not first or second == 0:
            raise reader.fail('found an operation on itself')
        return (operation, at - first) if second is None else (operation, at - first, at - second)


class ReceivedExpressions:
    """The expressions of one provenance that came from outside.

    Args:
        instructions: as `read_instructions` gives them.
        tables: those in front of them.
    """

    def __init__(self, instructions: Sequence[tuple], tables: ReceivedTables) -> None:
        self._instructions, self._tables = instructions, tables
        self._made: Optional[List[Any]] = None
        self._faults: Dict[int, Exception] = {}

    def value(self, index: int, expected: Scalar, kind: str) -> Any:
        """The tracked value that an instruction makes; `()`, no provenance, if it does not make the field's.

        Args:
            index: of the instruction.
            expected: the field's value.
            kind: the field's, as `fields.kind_of` gives it.
        """
        if self._made is None:
            self._made = computed([_resolved(each, self._tables) for each in self._instructions], self._faults)
        made, error = self._made[index], self._faults.get(index)
        if error is not None:
            # Raised here, it would reach the code that reads the value, which did not send the message.
            fault = str(error) or type(error).__name__
        elif type(made) in TRACKED and agrees(made, expected, kind):
            return made
        else:
            fault = 'it makes %.60r' % made
        warn_once(fault, 'bad provenance: a field that holds %.60r is delivered untracked: %s', expected, fault)
        return ()


def computed(instructions: Sequence[tuple], faults: Dict[int, Exception]) -> List[Any]:
    """The values that instructions make, if computing them takes neither long nor much memory.

    Args:
        instructions: for `values.assemble`.
        faults: gets the error of each instruction that makes no finite scalar in that way, by its index, and of those
            over it; the value of these is None.
    """
    characters = 0

    def check(operation: Operation, operands: Sequence[object]) -> None:
        nonlocal characters
        characters += bounded_size(operation, [untracked(operand) for operand in operands])
        if characters > TEXTS_LIMIT:
            raise ValueError('the texts on its way have more than %d characters' % TEXTS_LIMIT)

    return assemble(instructions, check, faults)


def bounded_size(operation: Operation, operands: Sequence[Any]) -> int:
    """The number of characters that an operation on plain operands makes, 0 for a number.

    Raises:
        ValueError: the result is too large to be computed.
        ArithmeticError, TypeError: as the operation itself.
    """
    kinds = {type(operand) for operand in operands}
    if str in kinds and operation.arity == 2:
        return _text_size(operation, operands, kinds)
    if kinds <= {int, bool}:
        # Only on integers can one operation take for ever. The same on floats tells how large the result is.
        forward: Callable[..., Any] = operation.forward
        try:
            size = abs(forward(*map(float, operands)))
        except TypeError:
            size = max(map(abs, operands)) if operation.symbol is None else 0
            size = size if size <= 1100 else math.inf
        if not size <= _LARGEST:
            raise ValueError('%s of %s is too large' % (operation.name, ', '.join(map(str, operands))))
    return 0


def _text_size(operation: Operation, operands: Sequence[Any], kinds: object) -> int:
    if operation.symbol == '*':
        size = math.prod(len(each) if type(each) is str else max(each, 0) for each in operands)
    elif operation.symbol == '+' and kinds == {str}:
        size = sum(map(len, operands))
    else:
        raise ValueError('%s of a text' % operation.name)  # such as formatting by %
    if size > TEXT_LIMIT:
        raise ValueError('%s makes a text of %d characters' % (operation.name, size))
    return size


def agrees(made: Scalar, expected: Any, kind: str) -> bool:
    """Return True if a computed value equals the value of a field, up to rounding.

    A field of 32 bits rounds, and the last digits of a sine differ from one machine to another. The tolerances are
    wider than those of `values.is_same`, as the numbers may have been large on the way.
    """
    if kind == 's' or isinstance(made, str):
        return isinstance(made, str) and made == expected
    if kind == 'b':
        return bool(made) == expected
    if kind == 'i':
        return made == expected
    tolerance = 1e-6 if kind == 'f' else 1e-9
    return math.isclose(made, expected, rel_tol=tolerance, abs_tol=tolerance) or made == expected
