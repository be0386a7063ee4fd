"""Recording operations: each makes a tracked value that knows its operands, and keeps its expression in a limit.

Operations of a program are recorded as long as its allowance lasts; results beyond it are plain. The allowance is
unlimited unless `limit_recording` is called. Decoding and evaluating anew do not count.
"""

import sys
import time
from typing import Any, Callable, Dict, Mapping

from .accelerator import CORE
from .affine import LIMIT, joint_size, shorten, size_of
from .annotations import Value
from .graph import Graph, check_changes
from .numpy_ufuncs import broadcast, is_array
from .operations import Operation, Record
from .operations.table import ADD, MOST_COMPUTED, TooLong
from .sources import Source
from .tracked import CLASSES, TRACKED, new, plain_scalar
from .tree import rebuilt, scalars

OPERATION = 1.2e-7
"""The CPU time in seconds that is counted for an operation of the compiled core, with what frees its memory again."""

OF_PYTHON = 20
"""How many of these one takes that is recorded in Python."""


class Allowance:
    """The number of operations that may still be recorded.

    Attributes:
        left: that number; 0 if recording has stopped.
        refill: the function that `limit_recording` was given.
    """

    def __init__(self) -> None:
        self.left = sys.maxsize
        self.refill: Callable[[int], int] = lambda overdrawn: sys.maxsize

    def allow(self, count: int) -> int:
        """Replace the allowance; returns what was left of the old one."""
        left, self.left = self.left, count
        return left

    def spend(self, count: int) -> bool:
        """Use up so many operations; False if no more may be recorded."""
        if self.left > count:
            self.left -= count
        elif self.left:
            overdrawn = count - self.left
            self.left = sys.maxsize  # what refilling does is not counted
            self.left = self.refill(overdrawn)
        return self.left > 0


ALLOWANCE = Allowance()
allow, spend = ALLOWANCE.allow, ALLOWANCE.spend
if CORE is not None:
    allow, spend = CORE.allow, CORE.spend


def limit_recording(refill: Callable[[int], int]) -> None:
    """Limit how many operations a program records.

    Args:
        refill: is called now, and whenever an allowance is used up, with the number of operations beyond it. It returns
            how many more may be recorded, 0 to record none until `allow` is called.
    """
    ALLOWANCE.refill = refill
    allow(refill(0))


def timed(function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Call a function of which the time counts, too, and not only the operations that it records."""
    start = time.thread_time()
    try:
        return function(*arguments, **options)
    finally:
        spend(1 + round((time.thread_time() - start) / OPERATION))


def shorten_and_count(value: Value) -> None:
    """Keep a value's expression within the limit, at the expense of the allowance."""
    timed(shorten, value)


def make(value: Value, record: Record, size: int) -> Value:
    """The tracked value with that record; `value` itself if its type cannot be tracked (a complex number)."""
    if type(value) not in CLASSES:
        return value
    result = new(value, record, size)
    if size > LIMIT:
        shorten_and_count(result)
    return result


def _make_if_allowed(value: Value, record: Record, size: int) -> Value:
    return make(value, record, size) if spend(OF_PYTHON) else value


def apply(operation: Operation, first: Value, second: Value = None) -> Value:
    """Apply an operation: the result is tracked if an operand is, an array if one is, NotImplemented for other types.

    It is plain where its expression is too long to be solved and sent, and where the allowance is used up: the program
    computes it as it does without provenance.

    Raises:
        ArithmeticError, ValueError, TypeError: as the operation itself does.
        OverflowError: the result is a text or a power of whole numbers that takes too long to be computed.
    """
    try:
        return apply_and_record(operation, first, second, _make_if_allowed)
    except TooLong as error:
        if error.size > MOST_COMPUTED:
            raise
        return error.compute()


def apply_and_record(
    operation: Operation, first: Value, second: Value = None, make: Callable[[Value, tuple, int], Value] = make
) -> Value:
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


def reapply(x: Value, changes: Mapping[Source, Value]) -> Value:
    """Evaluate `x` for other source values (paper, IV.A); the result is tracked, unlike that of `evaluate`.

    Args:
        x: a tracked value, or a message, list or dict holding such; it is not changed.
        changes: `{Source: value}`; sources that are missing keep their values.

    Returns:
        The tracked value, or a copy of the message, list or dict holding tracked values. A leaf that does not depend on
        the changes is the same object.

    Raises:
        TypeError: a key of `changes` is no Source, or as the operations themselves do.
        ArithmeticError, ValueError: as the operations themselves do for such values.
    """
    check_changes(changes)
    found = scalars(x)
    graph = Graph([leaf for leaf in found if type(leaf) in TRACKED])
    depends, values = graph.depending(changes), graph.plain()
    graph.run(graph.steps(depends), values, changes)
    made: Dict[int, Value] = {}
    for node, (form, first, second), value, is_other in zip(graph.nodes, graph.records, values, depends):
        operands = [made[id(operand)] for operand in form.operands(first, second)] if is_other else []
        if not is_other:
            made[id(node)] = node
        elif all(type(operand) in TRACKED for operand in operands):
            size = size_of(operands) if operands else 1
            made[id(node)] = make(value, form.with_operands(first, second, operands), size)
        else:
            made[id(node)] = value  # of an operand that is a complex number there
    results = iter([made.get(id(leaf), leaf) for leaf in found])
    return rebuilt(x, lambda _: next(results))


def whole(x: Value) -> Value:
    """Return the number as an int if it has no fraction, with the same record."""
    value = plain_scalar(x)
    if type(x) not in TRACKED or type(value) is not float or not value.is_integer():
        return x
    return make(int(value), x._record, x._size)


def widened(x: Value) -> Value:
    """`x + 0` of a tracked number, recorded in any case: a whole number that may become a fraction is read so."""
    return apply_and_record(ADD, x, 0)
