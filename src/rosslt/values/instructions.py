"""Expressions as flat lists of instructions, for the wire and for pickle.

An instruction is a tuple: `(SOURCE, Source, value)`, `(CONSTANT, value)`, `(AFFINE, value, ((index, slope), ...),
is_exact)` over earlier instructions that are sources, or `(Operation, index, ...)` with the indices of its
operands among the earlier instructions.
"""

import math
from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple

from .affine import folded
from .annotations import Value
from .graph import Graph
from .operations import AFFINE as RECORD_AFFINE
from .operations import AFFINE_INSTRUCTION as AFFINE
from .operations import CONSTANT_INSTRUCTION as CONSTANT
from .operations import SOURCE as RECORD_SOURCE
from .operations import SOURCE_INSTRUCTION as SOURCE
from .operations import Operation
from .operations.table import MOST_BITS
from .recording import apply_and_record, make
from .tracked import TRACKED


def disassemble(xs: Iterable[Value]) -> Tuple[List[tuple], List[int]]:
    """The instructions that make several values, shared parts once, operands before their users.

    Args:
        xs: tracked or plain scalars.

    Returns:
        The instructions, and for each value the index of the one that makes it.
    """
    roots = list(xs)
    instructions: List[tuple] = []
    index: Dict[Any, int] = {}
    linearized = False

    def added(key: Any, instruction: tuple) -> int:
        if key not in index:
            index[key] = len(instructions)
            instructions.append(instruction)
        return index[key]

    def constant(value: Value) -> int:
        return added((type(value), repr(value)), (CONSTANT, value))

    def source(node: Value) -> int:
        named = node._record[1]
        return added((type(node._plain), repr(node._plain), named), (SOURCE, named, node._plain))

    graph = Graph(root for root in roots if type(root) in TRACKED)
    for node, (form, first, second) in zip(graph.nodes, graph.records):
        if form is RECORD_SOURCE:
            index[id(node)] = source(node)
            continue
        places = [index[id(operand)] for operand in form.operands(first, second)]
        instruction = form.instruction(node._plain, first, second, places, constant)
        if instruction is None:
            linearized = True
            _, terms, exact = folded(node)
            instruction = AFFINE, node._plain, tuple([(source(leaf), slope) for leaf, slope in terms]), exact
        index[id(node)] = len(instructions)
        instructions.append(instruction)
    places = [index[id(root)] if type(root) in TRACKED else constant(root) for root in roots]
    return _needed(instructions, places) if linearized else (instructions, places)


def _needed(instructions: List[tuple], roots: List[int]) -> Tuple[List[tuple], List[int]]:
    """Only those instructions that the roots need: nothing below a linearization but its sources."""
    needed = set(roots)
    for place in range(len(instructions) - 1, -1, -1):
        if place in needed:
            needed.update(_operands(instructions[place]))
    moved = {place: number for number, place in enumerate(sorted(needed))}
    return [_moved(instructions[place], moved) for place in sorted(needed)], [moved[place] for place in roots]


def _operands(instruction: tuple) -> Iterable[int]:
    if isinstance(instruction[0], Operation):
        return instruction[1:]
    return [place for place, _ in instruction[2]] if instruction[0] == AFFINE else ()


def _moved(instruction: tuple, moved: Dict[int, int]) -> tuple:
    if isinstance(instruction[0], Operation):
        return (instruction[0], *[moved[place] for place in instruction[1:]])
    if instruction[0] == AFFINE:
        kind, value, terms, exact = instruction
        return kind, value, tuple([(moved[place], slope) for place, slope in terms]), exact
    return instruction


def assemble(
    instructions: Iterable[tuple],
    check: Optional[Callable[[Operation, List[Value]], None]] = None,
    faults: Optional[Dict[int, Exception]] = None,
) -> List[Value]:
    """The values that instructions make, in their order; constants come back plain.

    Args:
        instructions: as from `disassemble`; the caller has checked counts and indices.
        check: `check(operation, operands)` is called before each operation; what it raises refuses the operation.
        faults: gets the error of each instruction that makes no finite scalar, by its index, and of those over
            it; the value of these is None. Without it, the first error is raised, and infinite values are values.

    Raises:
        TypeError, ValueError, ArithmeticError, IndexError: the instructions do not fit each other, or make a
            number or text that no message holds.
    """
    made: List[Value] = []
    for at, instruction in enumerate(instructions):
        if faults is None:
            made.append(_made(instruction, made, check))
            continue
        fault = next((faults[place] for place in _operands(instruction) if place in faults), None) if faults else None
        if fault is None:
            try:
                value = _made(instruction, made, check)
                if not isinstance(value, (float, int, str)) or (isinstance(value, float) and not math.isfinite(value)):
                    raise ValueError('an operation gives %r' % (value,))
            except Exception as error:
                # Any exception class: the instructions come from outside.
                fault = error.with_traceback(None)
        if fault is not None:
            faults[at], value = fault, None
        made.append(value)
    return made


def _made(instruction: tuple, made: List[Value], check: Optional[Callable[[Operation, List[Value]], None]]) -> Value:
    """The value that an instruction makes of those before it."""
    kind = instruction[0]
    if isinstance(kind, Operation):
        operands = [made[index] for index in instruction[1:]]
        if check is not None:
            check(kind, operands)
        value = apply_and_record(kind, *operands)
        if value is NotImplemented:
            raise TypeError('%s of such operands' % kind.name)
        _check_size(value)
        return value
    if kind == SOURCE:
        return make(instruction[2], (RECORD_SOURCE, instruction[1], None), 1)
    if kind == CONSTANT:
        return instruction[1]
    terms = tuple([(made[index], slope) for index, slope in instruction[2]])
    return make(instruction[1], (RECORD_AFFINE, terms, instruction[3]), 1)


def _check_size(value: Value) -> None:
    """Refuse operations that only make numbers longer: a few squarings give an integer that fills the memory."""
    size = len(value) if isinstance(value, str) else value.bit_length() if isinstance(value, int) else 0
    if size > MOST_BITS:
        raise OverflowError('a value of size %d' % size)
