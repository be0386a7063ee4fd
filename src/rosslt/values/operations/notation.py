"""Writes expressions for people: infix, with as few brackets as Python needs."""

from typing import Any, Sequence, Tuple

from ..annotations import Value

FUNCTION = 20
"""The precedence of texts without operators, which need no brackets: numbers, names, calls."""

LEAF = FUNCTION - 1
"""The precedence of a source: only a minus in front of it needs brackets, as its text begins with its value."""

SUM, PRODUCT, MINUS, POWER = 10, 11, 12, 13
"""The precedences of `+ -`, `* /`, unary minus and `**`."""

Text = Tuple[str, int]
"""A text and the precedence of its outermost operation."""


def literal(value: Value) -> Text:
    """A number or text as a person writes it."""
    text = repr(value)
    if isinstance(value, float) and len(text.lstrip('-')) > 9:
        text = '%.7g' % value
    return text, MINUS if text.startswith('-') else FUNCTION


def applied(row: Any, operands: Sequence[Text]) -> Text:
    """An operation of the table on operands."""
    if row.symbol is None:
        return '%s(%s)' % (row.shown_as, ', '.join(text for text, _ in operands)), FUNCTION
    if row.arity == 1:
        ((text, strength),) = operands
        return row.symbol + (text if strength in (FUNCTION, POWER) else '(%s)' % text), row.precedence
    return infix(row.symbol, row.precedence, *operands)


def infix(symbol: str, level: int, first: Text, second: Text) -> Text:
    """Two operands around a symbol of that precedence."""
    (left, a), (right, b) = first, second
    if level == SUM and b == MINUS and right[1:2] != '(':
        symbol, right, b = '-' if symbol == '+' else '+', right[1:], FUNCTION
    left_needs, right_needs = (level + 1, level) if level == POWER else (level, level + 1)
    if level == POWER and left.startswith('-'):
        a = min(a, MINUS)
    text = ' '.join((left if a >= left_needs else '(%s)' % left, symbol, right if b >= right_needs else '(%s)' % right))
    return text, level


def sum_of_terms(value: Value, terms: Sequence[Tuple[str, Value, Value]]) -> Text:
    """Write an affine expression of some leaves as a sum of products.

    Args:
        value: the present value of the expression.
        terms: each leaf's text, its present value and its slope.
    """
    text: Text = ('', 0)
    constant, size = value, abs(value) if not isinstance(value, str) else 0
    for leaf_text, at, slope in terms:
        leaf, factor = (leaf_text, LEAF), -slope if text[0] and slope < 0 else slope
        part = leaf if factor == 1 else infix('*', PRODUCT, literal(factor), leaf)
        text = infix('-' if slope < 0 else '+', SUM, text, part) if text[0] else part
        try:
            constant = constant - slope * at
            size = max(size, abs(slope * at))
        except (OverflowError, TypeError):
            break
    if not text[0]:
        return literal(value)
    return infix('+', SUM, text, literal(constant)) if abs(constant) > 1e-12 * size else text
