"""Expressions as a line for people: infix, with as few brackets as Python needs, shortened in the middle."""

from typing import Any, Dict, Tuple

from .graph import Graph
from .operations import AFFINE, FUNCTION, SOURCE
from .operations.table import ADD, MULTIPLY, NEGATE, POWER, SUBTRACT
from .sources import describe_source
from .tracked import TRACKED, plain

LONGEST = 400
"""The most characters of an explanation, roughly."""

LEAF = FUNCTION - 1
"""The precedence of a source: only a minus in front of it needs brackets, as its text begins with its value."""

Text = Tuple[str, int]


def explain(x: Any) -> str:
    """One readable line: what was done, in infix, and where each source is with its value.

    Args:
        x: a tracked value; of anything else its repr is the explanation.

    Returns:
        For instance `2 * (0.3 [waypoints.script:3:12] + 1)`. A part that was folded to coefficients reads as a sum of
        products; one that was cut to its linearization, and is only right near the present values, reads
        `linearized(...)`. Numbers are rounded to seven digits.
    """
    return _text(x, LONGEST)


def brief(x: Any) -> str:
    """`explain`, short enough for an error message."""
    return _text(x, LONGEST // 4)


def _text(x: Any, longest: int) -> str:
    if type(x) not in TRACKED:
        return repr(x)
    graph = Graph([x])
    texts: Dict[int, Text] = {}
    for node, (form, first, second) in zip(graph.nodes, graph.records):
        if form is SOURCE:
            text = '%s [%s]' % (literal(node._plain)[0], describe_source(first)), LEAF
        elif form is AFFINE:
            text = _sum(node, [(texts[id(leaf)], leaf, slope) for leaf, slope in first], second)
        else:
            operands = [texts[id(first)]]
            if form.position is None:
                operands.append(texts[id(second)])
            elif form.operation.arity == 2:
                operands.insert(1 - form.position, literal(second))
            text = _applied(form.operation, operands)
        texts[id(node)] = _shortened(text[0], longest), text[1]
    return texts[id(x)][0]


def literal(value: Any) -> Text:
    """A number or text as a person writes it."""
    text = repr(plain(value))
    if isinstance(value, float) and len(text.lstrip('-')) > 9:
        text = '%.7g' % value
    return text, NEGATE.precedence if text.startswith('-') else FUNCTION


def _applied(row: Any, operands: Any) -> Text:
    if row.symbol is None:
        return '%s(%s)' % (row.shown_as, ', '.join(text for text, _ in operands)), FUNCTION
    level = row.precedence
    if row.arity == 1:
        ((text, strength),) = operands
        return row.symbol + (text if strength in (FUNCTION, POWER.precedence) else '(%s)' % text), level
    (left, a), (right, b) = operands
    symbol = row.symbol
    if row in (ADD, SUBTRACT) and b == NEGATE.precedence and right[1:2] != '(':
        symbol, right, b = '+-'[row is ADD], right[1:], FUNCTION
    left_needs, right_needs = (level + 1, level) if row is POWER else (level, level + 1)
    if row is POWER and left.startswith('-'):
        a = min(a, NEGATE.precedence)
    return ' '.join(
        (left if a >= left_needs else '(%s)' % left, symbol, right if b >= right_needs else '(%s)' % right)
    ), level


def _sum(node: Any, terms: Any, exact: bool) -> Text:
    text: Text = ('', 0)
    constant, size = node._plain, abs(node._plain) if not isinstance(node, str) else 0
    for (leaf_text, _), leaf, slope in terms:
        part = (leaf_text, LEAF) if slope == 1 else _applied(MULTIPLY, [literal(slope), (leaf_text, LEAF)])
        if text[0] and slope < 0:
            part = (leaf_text, LEAF) if slope == -1 else _applied(MULTIPLY, [literal(-slope), (leaf_text, LEAF)])
        text = _applied(SUBTRACT if slope < 0 else ADD, [text, part]) if text[0] else part
        try:
            constant = constant - slope * leaf._plain
            size = max(size, abs(slope * leaf._plain))
        except (OverflowError, TypeError):
            break
    if not text[0]:
        text = literal(node)
    elif abs(constant) > 1e-12 * size:
        text = _applied(ADD, [text, literal(constant)])
    return text if exact else ('linearized(%s)' % text[0], FUNCTION)


def _shortened(text: str, longest: int) -> str:
    if len(text) <= longest:
        return text
    brackets = len(text) - len(text.lstrip('('))
    inner = text[max(0, brackets - 3) :]
    if len(inner) <= longest:
        return inner
    end = longest // 2 - 5
    return '%s ... %s' % (inner[: longest // 2].rstrip(' .'), inner[-end:].lstrip(' .'))
