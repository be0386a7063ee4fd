"""Expressions that are not affine, as instructions on the wire, each naming earlier ones by their distance.

This module writes them, `graphs` reads them.
"""

import struct
from typing import Any, Dict, List, Optional, Sequence

from rosslt.messages.columns import packed, packed_strings, zigzag
from rosslt.messages.tables import FALSE, FLOAT, INT, STRING, TRUE, Tables, checked
from rosslt.values import AFFINE, CONSTANT, SOURCE, Operation

INSTRUCTION_LIMIT = 10000
"""The most instructions of a message. What has more is sent linearized."""

FROM_SOURCE, EXACT, LINEAR, OPERATION = 0, 6, 8, 16
"""The codes of instructions beside those of constants, 1 to 5: a source, affine parts with a float (7 and 9: with an
integer), and operations, whose own codes follow."""


def packed_instructions(instructions: Sequence[tuple], tables: Tables, numbers: Dict[Any, int]) -> bytes:
    """Instructions as bytes.

    Args:
        instructions: as from `values.disassemble`, made known to the tables by `register`.
        tables: those of the message.
        numbers: of the coefficients.
    """
    parts = [packed([len(instructions)])]
    for at, (kind, *operands) in enumerate(instructions):
        if kind == SOURCE:
            parts.append(packed([FROM_SOURCE, tables.reading(*operands)]))
        elif kind == CONSTANT:
            parts.append(_packed_constant(operands[0]))
        elif kind == AFFINE:
            value, terms, is_exact = operands
            code = (EXACT if is_exact else LINEAR) + (type(value) is int)
            parts.append(
                packed([code])
                + (packed([zigzag(value)]) if type(value) is int else struct.pack('<d', value))
                + packed([len(terms)])
            )
            for index, slope in terms:
                parts.append(packed([at - index, numbers[tables.coefficient(slope)]]))
        else:
            parts.append(packed([OPERATION + kind.code] + [at - index for index in operands]))
    return b''.join(parts)


def _packed_constant(value: Any) -> bytes:
    if type(value) is float:
        return packed([FLOAT]) + struct.pack('<d', value)
    if type(value) is int:
        return packed([INT, zigzag(value)])
    if type(value) is str:
        return packed([STRING]) + packed_strings([value])
    return packed([TRUE if value else FALSE])


def register(instructions: Sequence[tuple], tables: Tables) -> None:
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
            checked(operands[0])
            for _, slope in operands[1]:
                tables.coefficient(slope)


def linearizations(instructions: Sequence[tuple], roots: Sequence[int]) -> List[Optional[Dict[int, Any]]]:
    """What the instructions at `roots` come to near their present values.

    Args:
        instructions: as from `values.disassemble`.
        roots: indices.

    Returns:
        For each root the slope over each instruction that is a source; None where it has no slopes.
    """
    values: List[Any] = []
    slopes: List[Optional[Dict[int, Any]]] = []
    for at, (kind, *operands) in enumerate(instructions):
        if kind == SOURCE:
            values.append(operands[1])
            slopes.append({at: 1})
        elif kind in (CONSTANT, AFFINE):
            values.append(operands[0])
            slopes.append(dict(operands[1]) if kind == AFFINE else {})
        else:
            arguments = [values[index] for index in operands]
            values.append(kind.forward(*arguments))
            slopes.append(_chained(kind, arguments, [slopes[index] for index in operands]))
    return [slopes[root] for root in roots]


def _chained(
    operation: Operation, arguments: Sequence[Any], slopes: Sequence[Optional[Dict[int, Any]]]
) -> Optional[Dict[int, Any]]:
    """The slopes of an operation's result, of those of its operands."""
    total: Dict[int, Any] = {}
    for place, inner in enumerate(slopes):
        if inner is None:
            return None
        if inner:
            try:
                factor = (
                    operation.left.slope(arguments[0], None)
                    if operation.both is None
                    else operation.both.slope[place](*arguments)
                )
            except (ArithmeticError, TypeError, ValueError):
                return None
            for source, slope in inner.items():
                total[source] = total.get(source, 0) + slope * factor
    return total
