"""Expressions as one readable line, shortened in the middle if they are long."""

from typing import Dict

from .annotations import Value
from .graph import Graph
from .operations import AFFINE
from .operations.notation import Text
from .tracked import TRACKED

LONGEST = 400
"""The most characters of an explanation, roughly."""


def explain(x: Value) -> str:
    """Describe a value on one line: its expression in infix, with the value, file and line of each source.

    Args:
        x: a tracked value; anything else is described by its repr.

    Returns:
        For instance `2 * (0.3 [waypoints.script:3:12] + 1)`. A part that was folded to coefficients reads as a sum of
        products; one that was cut to its linearization, and is only right near the present values, reads
        `linearized(...)`, or `partly linearized: ...` if that part is left out. Numbers are rounded to seven digits.
    """
    return _text(x, LONGEST)


def brief(x: Value) -> str:
    """`explain`, short enough for an error message."""
    return _text(x, LONGEST // 4)


def _text(x: Value, longest: int) -> str:
    if type(x) not in TRACKED:
        return repr(x)
    graph = Graph([x])
    texts: Dict[int, Text] = {}
    for node, (form, first, second) in zip(graph.nodes, graph.records):
        operands = [texts[id(operand)] for operand in form.operands(first, second)]
        text, precedence = form.text(node._plain, first, second, operands)
        texts[id(node)] = _shortened(text, longest), precedence
    text = texts[id(x)][0]
    is_exact = 'linearized(' in text or all(form is not AFFINE or second for form, _, second in graph.records)
    return text if is_exact else 'partly linearized: ' + text


def _shortened(text: str, longest: int) -> str:
    if len(text) <= longest:
        return text
    brackets = len(text) - len(text.lstrip('('))
    inner = text[max(0, brackets - 3) :]
    if len(inner) <= longest:
        return inner
    end = longest // 2 - 5
    return '%s ... %s' % (inner[: longest // 2].rstrip(' .'), inner[-end:].lstrip(' .'))
