"""Recording operations: each makes a tracked value that knows its operands, and keeps its expression in a limit."""

from typing import Any, Sequence

from .affine import LIMIT, shorten
from .numpy_ufuncs import broadcast, is_array
from .operations import Operation
from .operations.table import MOST_COMPUTED, TooLong
from .tracked import CLASSES, TRACKED, new, plain_scalar

MAX_SHARED_SIZE = 16
"""The most that the smaller of two operands adds to the size of a result. Operands mostly share their past; adding
up their sizes would count it twice at every step, and so pass the limit in no time."""


def make(value: Any, record: tuple, size: int) -> Any:
    """The tracked value with that record; `value` itself if its type cannot be tracked (a complex number)."""
    if type(value) not in CLASSES:
        return value
    result = new(value, record, size)
    if size > LIMIT:
        shorten(result)
    return result


def joint_size(first: int, second: int) -> int:
    """The size of a result of two tracked operands of such sizes.

    A size below zero says how many operations may still come before a fold of many terms is worth making again (see
    `affine.shorten`); the result stands as near to that as the nearer operand.
    """
    small, large = (first, second) if first < second else (second, first)
    if small >= 0:
        return large + min(small, MAX_SHARED_SIZE) + 1
    return (large if large < 0 else small + min(large, MAX_SHARED_SIZE)) + 1


def size_of(operands: Sequence[Any]) -> int:
    """The size of a result of tracked operands."""
    size = operands[0]._size + 1
    for operand in operands[1:]:
        size = joint_size(size, operand._size)
    return int(size)


def apply(operation: Operation, first: Any, second: Any = None) -> Any:
    """Apply an operation: the result is tracked if an operand is, an array if one is, NotImplemented for other types.

    It is plain where its expression is too long to be solved and sent: the program computes it as it does without
    provenance.

    Raises:
        ArithmeticError, ValueError, TypeError: as the operation itself does.
        OverflowError: the result is a text or a power of whole numbers that takes too long to be computed.
    """
    try:
        return apply_and_record(operation, first, second)
    except TooLong as error:
        if error.size > MOST_COMPUTED:
            raise
        return error.compute()


def apply_and_record(operation: Operation, first: Any, second: Any = None) -> Any:
    """Apply an operation and record it, to rebuild an expression recorded elsewhere; `TooLong` is raised."""
    if operation.arity == 1:
        if isinstance(first, str) and not operation.on_text:
            raise TypeError('%s of a text' % operation.name)
        if type(first) in TRACKED:
            return make(operation.forward(first._plain), (operation.left, first, None), first._size + 1)
        if is_array(first):
            return broadcast(apply, operation, first)
        return operation.forward(first)
    a, b = plain_scalar(first), plain_scalar(second)
    if a is None or b is None:
        return broadcast(apply, operation, first, second) if is_array(first) or is_array(second) else NotImplemented
    if (type(a) is str or type(b) is str) and not operation.on_text:
        return NotImplemented
    value = operation.forward(a, b)
    if type(first) in TRACKED:
        if type(second) in TRACKED:
            return make(value, (operation.both, first, second), joint_size(first._size, second._size))
        return make(value, (operation.left, first, b), first._size + 1)
    return make(value, (operation.right, second, a), second._size + 1) if type(second) in TRACKED else value
