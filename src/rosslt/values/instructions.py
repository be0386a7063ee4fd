"""Expressions as flat lists of instructions, for the wire and for pickle.

An instruction is a tuple: `(SOURCE, Source, value)`, `(CONSTANT, value)`, `(AFFINE, value, ((index, slope), ...),
is_exact)` over earlier instructions that are sources, or `(Operation, index, ...)` with the indices of its
operands among the earlier instructions.
"""

from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple

from .graph import Graph
from .operations import AFFINE as RECORD_AFFINE
from .operations import SOURCE as RECORD_SOURCE
from .operations import Operation
from .operations.table import MOST_BITS
from .tracked import TRACKED, apply, make

SOURCE, CONSTANT, AFFINE = 'source', 'constant', 'affine'


def disassemble(xs: Iterable[Any]) -> Tuple[List[tuple], List[int]]:
    """The instructions that make several values, shared parts once, operands before their users.

    Args:
        xs: tracked or plain scalars.

    Returns:
        The instructions, and for each value the index of the one that makes it.
    """
    roots = list(xs)
    instructions: List[tuple] = []
    index: Dict[Any, int] = {}

    def constant(value: Any) -> int:
        key = type(value), repr(value)
        if key not in index:
            index[key] = len(instructions)
            instructions.append((CONSTANT, value))
        return index[key]

    graph = Graph(root for root in roots if type(root) in TRACKED)
    for node, (form, first, second) in zip(graph.nodes, graph.records):
        instruction: tuple
        if form is RECORD_SOURCE:
            key = type(node._plain), repr(node._plain), first
            if key in index:
                index[id(node)] = index[key]
                continue
            index[key] = len(instructions)
            instruction = SOURCE, first, node._plain
        elif form is RECORD_AFFINE:
            instruction = AFFINE, node._plain, tuple((index[id(leaf)], slope) for leaf, slope in first), second
        elif form.operation.arity == 1:
            instruction = form.operation, index[id(first)]
        elif form.position == 0:
            instruction = form.operation, index[id(first)], constant(second)
        elif form.position == 1:
            instruction = form.operation, constant(second), index[id(first)]
        else:
            instruction = form.operation, index[id(first)], index[id(second)]
        index[id(node)] = len(instructions)
        instructions.append(instruction)
    return instructions, [index[id(root)] if type(root) in TRACKED else constant(root) for root in roots]


def assemble(
    instructions: Iterable[tuple], check: Optional[Callable[[Operation, List[Any]], None]] = None
) -> List[Any]:
    """The values that instructions make, in their order; constants come back plain.

    Args:
        instructions: as from `disassemble`; the caller has checked counts and indices.
        check: `check(operation, operands)` is called before each operation; what it raises refuses the instructions.

    Raises:
        TypeError, ValueError, ArithmeticError, IndexError: the instructions do not fit each other, or make a
            number or text that no message holds.
    """
    made: List[Any] = []
    for instruction in instructions:
        kind = instruction[0]
        if isinstance(kind, Operation):
            operands = [made[index] for index in instruction[1:]]
            if check is not None:
                check(kind, operands)
            value = apply(kind, *operands)
            if value is NotImplemented:
                raise TypeError('%s of such operands' % kind.name)
            _check_size(value)
        elif kind == SOURCE:
            value = make(instruction[2], (RECORD_SOURCE, instruction[1], None), 1)
        elif kind == CONSTANT:
            value = instruction[1]
        else:
            terms = tuple([(made[index], slope) for index, slope in instruction[2]])
            value = make(instruction[1], (RECORD_AFFINE, terms, instruction[3]), len(terms) + 1)
        made.append(value)
    return made


def _check_size(value: Any) -> None:
    """Refuse what only grows: a few squarings make a whole number that fills the memory."""
    size = len(value) if isinstance(value, str) else value.bit_length() if isinstance(value, int) else 0
    if size > MOST_BITS:
        raise OverflowError('a value of size %d' % size)
