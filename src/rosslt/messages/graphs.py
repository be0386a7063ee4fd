"""Expressions that were received as instructions.

What comes from outside is never trusted to be quick or small: `Graph` checks the form when it is read, and computes the
values, when one is first needed, operation by operation with a bound on each result.
"""

import math
from typing import Any, Callable, List, Optional, Sequence

from rosslt.messages.columns import Reader, unzigzag
from rosslt.messages.instructions import EXACT, FROM_SOURCE, INSTRUCTION_LIMIT, LINEAR, OPERATION
from rosslt.messages.reports import warn_once
from rosslt.messages.tables import FALSE, FLOAT, INT, INT_LIMIT, STRING, TRUE, ReadTables
from rosslt.messages.walkers import PLAIN
from rosslt.values import AFFINE, CONSTANT, OPERATIONS, SOURCE, Operation, assemble

TEXT_LIMIT = 1 << 16
"""The longest text that an expression may make on its way."""

TEXTS_LIMIT = 1 << 20
"""The most characters that all texts on the way may have together."""

_LARGEST = 1e80
"""Bounds the results of operations on integers on the way."""


class Graph:
    """The instructions of a provenance that came from outside.

    Raises:
        BadHeader: they have not the form of instructions.
    """

    def __init__(self, reader: Reader, tables: ReadTables) -> None:
        self._tables = tables
        self._made: Optional[List[Any]] = None
        self._instructions: List[tuple] = []
        count = reader.number('the number of instructions', INSTRUCTION_LIMIT)
        terms_left = 4 * INSTRUCTION_LIMIT
        sources = set()
        for at in range(count):
            code = reader.number('the code of an instruction', 1 << 16)
            if code == FROM_SOURCE:
                number = reader.number('the number of a source', tables.source_count - 1)
                if tables.values[number] is None:
                    raise reader.fail('found an instruction with source %d, which has no value', number)
                sources.add(at)
                self._instructions.append((SOURCE, number))
            elif code in (FLOAT, INT, STRING, FALSE, TRUE):
                self._instructions.append((CONSTANT, _read_constant(reader, code)))
            elif code in (EXACT, EXACT + 1, LINEAR, LINEAR + 1):
                value = _read_constant(reader, FLOAT if code in (EXACT, LINEAR) else INT)
                terms = []
                size = reader.number('the number of terms', min(at, terms_left))
                terms_left -= size
                for _ in range(size):
                    index = at - reader.number('the distance of an operand', at)
                    if index not in sources or type(self._value_of(index)) not in (float, int):
                        raise reader.fail(
                            'found an affine part over instruction %d, which is no number of a source', index
                        )
                    slope = reader.number('the number of a coefficient', len(tables.coefficients) - 1)
                    if not slope:
                        raise reader.fail('found an affine part without a coefficient')
                    terms.append((index, tables.coefficients[slope]))
                if len({tables.source(self._instructions[index][1]) for index, _ in terms}) < len(terms):
                    raise reader.fail('found an affine part with two terms of one source')
                self._instructions.append((AFFINE, value, tuple(terms), code < LINEAR))
            else:
                operation = OPERATIONS.get(code - OPERATION)
                if operation is None:
                    raise reader.fail('found the unknown operation %d', code - OPERATION)
                distances = [reader.number('the distance of an operand', at) for _ in range(operation.arity)]
                if not all(distances):
                    raise reader.fail('found an operation on itself')
                self._instructions.append((operation,) + tuple(at - distance for distance in distances))
        self.count = count

    def _value_of(self, index: int) -> Any:
        return self._tables.values[self._instructions[index][1]]

    def value(self, index: int, expected: Any, kind: str) -> Any:
        """The tracked value that an instruction makes; `()`, no provenance, where it does not make the field's.

        Args:
            index: of the instruction.
            expected: the field's value.
            kind: the field's, as `layout.kind_of` gives it.
        """
        try:
            if self._made is None:
                self._compute()
                self._made = assemble(
                    [
                        (SOURCE, self._tables.source(one[1]), self._tables.values[one[1]]) if one[0] == SOURCE else one
                        for one in self._instructions
                    ]
                )
            made = self._made[index]
            if type(made) in PLAIN and agrees(made, expected, kind):
                return made
            fault = 'it makes %.60r' % made
        except (ArithmeticError, TypeError, ValueError, IndexError) as error:
            fault = str(error)
        warn_once(fault, 'bad provenance: a field that holds %.60r is delivered untracked: %s', expected, fault)
        return ()

    def _compute(self) -> None:
        """Compute all instructions once, bounded: `assemble` has nothing to fear after that."""
        values: List[Any] = []
        characters = 0
        for kind, *operands in self._instructions:
            if kind == SOURCE:
                values.append(self._tables.values[operands[0]])
            elif kind in (CONSTANT, AFFINE):
                values.append(operands[0])
            else:
                value = bounded(kind, [values[index] for index in operands])
                if type(value) is str:
                    characters += len(value)
                    if characters > TEXTS_LIMIT:
                        raise ValueError('the texts on its way have more than %d characters' % TEXTS_LIMIT)
                values.append(value)


def _read_constant(reader: Reader, code: int) -> Any:
    if code == FLOAT:
        return reader.floats(1, 'a constant')[0]
    if code == INT:
        value = unzigzag(reader.column(1, 'a constant')[0])
        if not -INT_LIMIT < value < INT_LIMIT:
            raise reader.fail('found the integer %d, of more than 64 bits', value)
        return value
    if code == STRING:
        return reader.strings(1, 'a constant')[0]
    return code == TRUE


def bounded(operation: Operation, operands: Sequence[Any]) -> Any:
    """The result of an operation, where computing it takes neither long nor much memory.

    Raises:
        ValueError: it does, or the result is no finite scalar.
        ArithmeticError, TypeError: as the operation itself.
    """
    forward: Callable[..., Any] = operation.forward
    kinds = {type(operand) for operand in operands}
    if str in kinds and operation.arity == 2:
        # What % does with a text is nobody's business here.
        if operation.symbol == '*':
            size = math.prod(len(each) if type(each) is str else max(each, 0) for each in operands)
        elif operation.symbol == '+' and kinds == {str}:
            size = sum(map(len, operands))
        else:
            raise ValueError('%s of a text' % operation.name)
        if size > TEXT_LIMIT:
            raise ValueError('%s makes a text of %d characters' % (operation.name, size))
    elif kinds <= {int, bool}:
        # Only on integers can one operation take for ever. The same on floats tells how large the result is.
        try:
            size = abs(forward(*map(float, operands)))
        except TypeError:
            size = max(map(abs, operands)) if operation.symbol is None else 0
            size = size if size <= 1100 else math.inf
        if not size <= _LARGEST:
            raise ValueError('%s of %s is too large' % (operation.name, ', '.join(map(str, operands))))
    result = forward(*operands)
    if type(result) not in (float, int, bool, str) or (type(result) is float and not math.isfinite(result)):
        raise ValueError('%s gives %r' % (operation.name, result))
    return result


def agrees(made: Any, expected: Any, kind: str) -> bool:
    """Whether a value is the one in a field, as far as fields and machines can agree.

    A field of 32 bits rounds, and the last digits of a sine differ from one machine to another.
    """
    if kind == 's' or isinstance(made, str):
        return isinstance(made, str) and made == expected
    if kind == 'b':
        return bool(made) == expected
    if kind == 'i':
        return made == expected
    tolerance = 1e-6 if kind == 'f' else 1e-9
    return math.isclose(made, expected, rel_tol=tolerance, abs_tol=tolerance) or made == expected
