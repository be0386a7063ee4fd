"""Provenance as the C++ library reads it: see `header`."""

import math
import re
from typing import Any, List, Optional, Sequence

from rosslt.messages.location_header.header import FUNCTIONS, TO_ROS2, Location, LocationHeader, PaperIds
from rosslt.values import (
    AFFINE,
    CONSTANT,
    SOURCE,
    Source,
    affine,
    assemble,
    disassemble,
    is_tracked,
    leaves,
    linearized,
    sources,
    untracked,
)


def to_paper_header(message: Any, ids: PaperIds) -> LocationHeader:
    """The provenance of a message's tracked leaves, as the C++ library has it.

    A leaf that its expressions cannot express (for example because the slope of its left-most source is 0) is left out.

    Args:
        message: any message.
        ids: of the bridge.
    """
    header = LocationHeader([], [])
    for path, leaf in leaves(message):
        if is_tracked(leaf):
            found = sources(leaf)
            expression = _expression(leaf, found[0]) if found else None
            if expression is not None:
                header.paths.append(_paper_path(path, message))
                header.locations.append(Location(found[0].node, ids.number(found[0]), expression))
    return header


def _paper_path(path: str, message: Any) -> str:
    if path == 'data' and len(message.__slots__) == 1:
        return '.'
    return '/'.join(TO_ROS2.get(part, part) for part in re.split(r'[.\[\]]+', path) if part)


def _expression(leaf: Any, source: Source) -> Optional[str]:
    """What makes a leaf of its left-most source, all else taken as constant; None if there is no such expression."""
    terms = affine(leaf)
    if terms:
        return _line(leaf, *terms[0][1:])
    instructions, (root,) = disassemble([leaf])
    tokens = _path_tokens(instructions, root)
    if tokens is not None:
        return ''.join(token + ';' for token in tokens)
    for other, value, slope in linearized(leaf):
        if other == source and not isinstance(leaf, str) and not isinstance(value, str):
            return _line(leaf, value, slope)
    return None


def _line(leaf: Any, value: Any, slope: Any) -> Optional[str]:
    """A line through the present values, with all digits."""
    rest = untracked(leaf) - slope * value
    if not slope or not math.isfinite(rest) or not math.isfinite(slope):
        return None
    return ('%r;*;' % slope if slope != 1 else '') + ('%r;+;' % rest if rest else '')


def _literal(value: Any) -> Optional[str]:
    """A constant as a token; None if it cannot be one."""
    if isinstance(value, str):
        # The C++ library takes the first '";' for the end of a text.
        return None if '"' in value or ';' in value else '"%s"' % value
    if isinstance(value, bool) or not math.isfinite(value):
        return None
    return repr(value)


def _path_tokens(instructions: Sequence[tuple], root: int) -> Optional[List[str]]:
    """The tokens along the way from an instruction to its left-most source; None if one of them has none."""
    made = assemble(instructions)
    tokens: List[str] = []
    at = root
    while instructions[at][0] != SOURCE:
        operation, *operands = instructions[at]
        if operation in (CONSTANT, AFFINE):
            return None
        inner = next(index for index in operands if is_tracked(made[index]))
        if operation.arity == 1:
            step = {'neg': ['-1', '*'], 'float': []}.get(operation.name)
            if step is None:
                if operation.name not in FUNCTIONS:
                    return None
                step = [operation.name]
        else:
            other = _literal(untracked(made[operands[1] if inner == operands[0] else operands[0]]))
            if other is None or operation.symbol not in tuple('+-*/'):
                return None
            step = [other] + (['swap'] if inner != operands[0] else []) + [operation.symbol]
        # What is done last stands last: the way leads back from it.
        tokens[:0] = step
        at = inner
    return tokens
