"""Expressions that are not affine, as instructions on the wire, each naming earlier ones by their distance.

This module writes them, `graphs` reads them.
"""

import struct
from typing import Any, Dict, List, Sequence

from rosslt.messages.columns import packed, packed_strings, zigzag
from rosslt.messages.tables import FALSE, FLOAT, INT, STRING, TRUE, Tables, Unencodable, checked
from rosslt.values import AFFINE, CONSTANT, SOURCE

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
            if not terms:
                parts.append(_packed_constant(value))
                continue
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
            value, terms, _ = operands
            checked(value)
            for index, slope in terms:
                if not (type(value) in (float, int) and type(instructions[index][2]) in (float, int)):
                    raise Unencodable('its expression was too long, and texts and bools have no slopes')
                tables.coefficient(slope)


def having_sources(instructions: Sequence[tuple]) -> List[bool]:
    """For each instruction, whether its value has a source."""
    found: List[bool] = []
    for kind, *operands in instructions:
        if kind == AFFINE:
            found.append(bool(operands[1]))
        else:
            found.append(kind == SOURCE or (kind != CONSTANT and any(found[index] for index in operands)))
    return found
