"""Expressions that were received, and the values that they make.

What comes from outside is never trusted to be quick or small: the expressions of a message are computed when one of
them is first needed, operation by operation with a bound on each result.
"""

import math
from typing import Any, Callable, Dict, List, Optional, Sequence

from rosslt.messages.codec.expressions import ReceivedInstructions
from rosslt.messages.codec.table_reader import ReceivedTables
from rosslt.messages.fault_log import warn_once
from rosslt.messages.walkers import TRACKED
from rosslt.values import Operation, assemble, untracked

TEXT_LIMIT = 1 << 16
"""The longest text that an expression may make on its way."""

TEXTS_LIMIT = 1 << 20
"""The most characters that all texts on the way may have together."""

_LARGEST = 1e80
"""Bounds the results of operations on integers on the way."""


class ReceivedExpressions:
    """The expressions of one provenance that came from outside.

    Args:
        instructions: as they were read.
        tables: those in front of them.
    """

    def __init__(self, instructions: ReceivedInstructions, tables: ReceivedTables) -> None:
        self._instructions, self._tables = instructions, tables
        self._made: Optional[List[Any]] = None
        self._faults: Dict[int, Exception] = {}

    def value(self, index: int, expected: Any, kind: str) -> Any:
        """The tracked value that an instruction makes; `()`, no provenance, where it does not make the field's.

        Args:
            index: of the instruction.
            expected: the field's value.
            kind: the field's, as `fields.kind_of` gives it.
        """
        if self._made is None:
            self._made = computed(self._instructions.resolved(self._tables), self._faults)
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
    """The values that instructions make, where computing them takes neither long nor much memory.

    Args:
        instructions: as `expressions.ReceivedInstructions.resolved` gives them.
        faults: gets the error of each instruction that makes no finite scalar in that way, by its index, and of those
            over it; the value of these is None.
    """
    characters = 0

    def check(operation: Operation, operands: Sequence[Any]) -> None:
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


def _text_size(operation: Operation, operands: Sequence[Any], kinds: Any) -> int:
    if operation.symbol == '*':
        size = math.prod(len(each) if type(each) is str else max(each, 0) for each in operands)
    elif operation.symbol == '+' and kinds == {str}:
        size = sum(map(len, operands))
    else:
        raise ValueError('%s of a text' % operation.name)  # such as formatting by %
    if size > TEXT_LIMIT:
        raise ValueError('%s makes a text of %d characters' % (operation.name, size))
    return size


def agrees(made: Any, expected: Any, kind: str) -> bool:
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
