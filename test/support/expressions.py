"""Random expressions over random sources, for the laws: shared parts, several sources, sources met more than once."""

import math

from hypothesis import strategies as st

from rosslt import Source, is_tracked, track
from rosslt.values import OPERATIONS
from rosslt.values.recording import apply

SOURCES = [Source('/node', number) for number in range(3)]
EXTREMES = [0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, -1e-300, 1e300, -1e300, 2.0**53, 0.1, math.pi]
HUGE = [10**40 + 7, -(3**100), 2**64, 2**63 - 1]

ordinary = st.integers(-100_000, 100_000).map(lambda x: x / 1000)
floats = ordinary | st.sampled_from(EXTREMES) | st.floats(allow_nan=False, allow_infinity=False)
ints = st.integers(-20, 20) | st.sampled_from(HUGE)
numbers = ordinary | ordinary | floats | st.integers(-20, 20) | ints | st.booleans()
texts = st.text('abc_/', max_size=6)
scalars = numbers | numbers | numbers | texts

ROWS = sorted(OPERATIONS.values(), key=lambda row: row.code)
ARITHMETIC = [row for row in ROWS if row.symbol and row.name not in ('and', 'or', 'xor', 'concat', 'repeat')]
steps = st.tuples(st.sampled_from(ROWS) | st.sampled_from(ARITHMETIC), st.integers(0, 30), st.integers(0, 30), scalars)


def usable(value):
    """Whether a value may be the operand of the next step: finite, and not so long that it slows the test."""
    if isinstance(value, str):
        return len(value) < 50
    return (
        isinstance(value, (int, float))
        and value - value == 0
        and (isinstance(value, float) or value.bit_length() < 1000)
    )


def applied(row, *operands):
    """The result of a row, None where it is not defined there."""
    if row.name in ('power', 'ldexp', 'repeat') and any(abs(x) > 50 for x in operands if isinstance(x, (int, float))):
        return None
    try:
        result = apply(row, *operands)
    except (ArithmeticError, ValueError, TypeError):
        return None
    return result if is_tracked(result) and usable(result) else None


def grown(values, choices):
    """The values that steps make of the first ones, each from any that were there before it."""
    pool = list(values)
    for row, first, second, constant in choices:
        operand = pool[-1 - first % len(pool)]
        if row.arity == 1:
            made = applied(row, operand)
        elif second % 3 == 0:
            made = applied(row, operand, pool[-1 - (second // 3) % len(pool)])
        elif second % 3 == 1:
            made = applied(row, operand, constant)
        else:
            made = applied(row, constant, operand)
        if made is not None:
            pool.append(made)
    return pool


LINEAR = [row for row in ROWS if row.name in ('add', 'sub', 'mul', 'truediv', 'neg')]
linear_steps = st.tuples(st.sampled_from(LINEAR), st.integers(0, 30), st.integers(0, 30), ordinary)


@st.composite
def linear_expressions(draw):
    """Random tracked values, most of them affine in their sources, of ordinary size."""
    values = draw(st.lists(ordinary, min_size=1, max_size=3))
    sources = [track(value, source) for value, source in zip(values, SOURCES)]
    return grown(sources, draw(st.lists(linear_steps, max_size=6)))[-1]


@st.composite
def pools(draw, leaves=scalars, most=8):
    """Some values of an expression, the sources first, those that depend on most last."""
    values = draw(st.lists(leaves, min_size=1, max_size=3))
    return grown([track(value, source) for value, source in zip(values, SOURCES)], draw(st.lists(steps, max_size=most)))


def expressions(leaves=scalars, most=8):
    """Random tracked values."""
    return pools(leaves, most).map(lambda pool: pool[-1])
