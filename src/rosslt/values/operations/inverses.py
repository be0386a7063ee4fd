"""Choosing among the operands that give a wanted result: the one nearest the present operand.

The inverses of the table that are more than a formula. Each raises NoPreimage if there is no such operand.
"""

import math
import statistics
from fractions import Fraction
from typing import Callable, Iterable

from ..annotations import Value
from ..tolerances import is_rounded

TURN = 2 * math.pi
_NORMAL = statistics.NormalDist()


class NoPreimage(ValueError):
    """No operand gives the wanted result; the message says why, as a part of a sentence."""


def refuse(reason: str, *values: Value) -> Value:
    """Raise NoPreimage with that reason."""
    raise NoPreimage(reason % values if values else reason)


def ratio(a: Value, b: Value) -> Value:
    """`a / b`, exact for whole numbers, infinite for b = 0."""
    if b == 0:
        return math.inf
    return Fraction(a, b) if isinstance(a, int) and isinstance(b, int) else a / b


def nearest(present: Value, candidates: Iterable[Value], holds: Callable[[Value], bool], reason: str) -> Value:
    """The candidate nearest the present operand among those that hold, the first of several equally near."""
    fitting = [candidate for candidate in candidates if holds(candidate)]
    return min(fitting, key=lambda candidate: abs(candidate - present)) if fitting else refuse(reason)


def in_period(present: float, period: float, *bases: float) -> float:
    """The value nearest the present one among all `base + n * period`."""
    shifted = [base + period * round((present - base) / period) for base in bases]
    return min(shifted, key=lambda value: abs(value - present))


def within(present: Value, one_end: Value, other_end: Value, holds: Callable[[Value], bool], reason: str) -> Value:
    """The value nearest the present one for which `holds`, as it does between the ends.

    Whether it holds at an end itself is tried out: ends may be excluded, or rounded to the wrong side.

    Args:
        present: if it is an int, so is the answer.
        one_end, other_end: in any order; either may be infinite.
    """
    if holds(present):
        return present
    low, high = min(one_end, other_end), max(one_end, other_end)
    end, inward = (low, 1) if present <= low else (high, -1)
    if isinstance(present, int):
        start = math.ceil(end) if inward > 0 else math.floor(end)
        return nearest(present, (start, start + inward, start + 2 * inward), holds, reason)
    end = float(end)
    reach = min(float(high) - float(low), max(1.0, abs(end)))
    for shift in [0.0] + [2.0**-n for n in range(54, 0, -1)]:
        if holds(end + inward * shift * reach):
            return end + inward * shift * reach
    return refuse(reason)


def dividend(y: Value, a: Value, b: Value) -> Value:
    """The `a` with `a // b == y`."""
    return within(a, y * b, (y + 1) * b, lambda v: v // b == y, '// takes whole values')


def floor_divisor(y: Value, a: Value, b: Value) -> Value:
    """The `b` with `a // b == y`."""
    sign = 1 if (a >= 0) == (y >= 0) else -1
    least, most = ratio(abs(a), max(abs(y), abs(y + 1))), ratio(abs(a), min(abs(y), abs(y + 1)))
    return within(b, sign * least, sign * most, lambda v: v != 0 and a // v == y, 'no divisor gives that quotient')


def divided(y: Value, a: Value, b: Value, rest: Callable[[Value, Value], Value]) -> Value:
    """The `a` with `rest(a, b) == y`, where `rest` is one of the remainders."""
    if is_rounded(rest(a, b), y):
        return a
    base = a - rest(a, b) + y
    return nearest(
        a,
        (base, base - b, base + b, y),
        lambda v: is_rounded(rest(v, b), y) or _rounded(rest, v, b, y),
        'such a remainder is not possible for that divisor',
    )


def _rounded(rest: Callable[[Value, Value], Value], v: Value, b: Value, y: Value) -> bool:
    # Near a multiple of b the last bit of v decides on which side of the jump the remainder falls.
    return isinstance(v, float) and abs(rest(v, b) - y) <= 4e-16 * max(abs(v), abs(b))


def modulus(y: Value, a: Value, b: Value, rest: Callable[[Value, Value], Value]) -> Value:
    """The `b` with `rest(a, b) == y`."""
    if is_rounded(rest(a, b), y):
        return b
    if a == y:
        return within(
            b,
            math.copysign(abs(a) if isinstance(a, float) else 1, b) and a,
            a * 2,
            lambda v: v != 0 and rest(a, v) == y,
            'no divisor gives that remainder',
        )
    turns = round(ratio(a - y, b))
    counts = {count for n in (turns, 0) for count in (n - 1, n, n + 1)} - {0}
    return nearest(
        b,
        sorted(ratio(a - y, count) for count in counts),
        lambda v: is_rounded(rest(a, v), y) or (isinstance(v, float) and abs(rest(a, v) - y) <= 4e-16 * abs(a)),
        'no divisor gives that remainder',
    )


def whole_root(y: int, n: int) -> Value:
    """The n-th root of a whole number y >= 0, exact if it is whole."""
    if n > y.bit_length():
        return y if y < 2 else y ** (1 / n)
    low, high = 0, 1 << (y.bit_length() // n + 1)
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if middle**n < y else (low, middle)
    return low if low**n == y else y ** (1 / n)


def base(y: Value, a: Value, b: Value) -> Value:
    """The `a` with `a ** b == y`, of the two the one with the present sign."""
    if b == 0:
        return refuse('anything to the power 0 is 1')
    if y == 0:
        return 0 * a if b > 0 else refuse('no number to a negative power is 0')
    even, odd = b % 2 == 0, b % 2 == 1
    if y < 0 and not odd:
        return refuse('a power with exponent %r is not negative', b)
    size = whole_root(abs(y), b) if isinstance(y, int) and isinstance(b, int) and b > 0 else abs(y) ** (1 / b)
    return -size if y < 0 or (even and a < 0) else size


def exponent(y: Value, a: Value, b: Value) -> Value:
    """The `b` with `a ** b == y`."""
    if a in (0, 1, -1) or y == 0:
        return nearest(b, (b, 0, 1, 2), lambda v: not (a == 0 > v) and a**v == y, 'powers of %r take few values' % a)
    exact = math.log(abs(y)) / math.log(abs(a))
    whole = round(exact)
    if is_rounded(a**whole, y):
        return whole
    return exact if a > 0 and y > 0 else refuse('a power of %r is not %r', a, y)


def angle_opposite(y: float, a: float, b: float) -> float:
    """The `a` with `atan2(a, b) == y`."""
    if b == 0:
        return within(
            a,
            0.0,
            math.copysign(math.inf, y),
            lambda v: is_rounded(math.atan2(v, b), y),
            'atan2(_, 0) is a quarter turn',
        )
    return nearest(
        a,
        (b * math.tan(y), 0.0, -0.0),
        lambda v: is_rounded(math.atan2(v, b), y),
        'that direction is on the other side of %r' % b,
    )


def angle_adjacent(y: float, a: float, b: float) -> float:
    """The `b` with `atan2(a, b) == y`."""
    if a == 0:
        return nearest(
            b,
            (abs(b) or 1.0, -abs(b) or -1.0),
            lambda v: is_rounded(math.atan2(a, v), y),
            'atan2(0, _) is 0 or half a turn',
        )
    return nearest(
        b,
        (a / (math.tan(y) or math.inf), 0.0),
        lambda v: is_rounded(math.atan2(a, v), y),
        'that direction is on the other side of %r' % a,
    )


def leg(y: float, a: float, b: float) -> float:
    """The `a` with `hypot(a, b) == y`, of the present sign."""
    b = abs(b)
    if y < b:
        return refuse('hypot is at least %r, its other side', b)
    return math.copysign(math.sqrt(y - b) * math.sqrt(y + b), a)


def inverse_erf(y: float) -> float:
    """The `x` with `erf(x) == y`, for |y| < 1."""
    if abs(y) >= 1:
        return refuse('erf takes values in (-1, 1)')
    if abs(y) > 0.5:
        return math.copysign(inverse_erfc(1 - abs(y)), y)
    x = _NORMAL.inv_cdf((y + 1) / 2) / math.sqrt(2)
    return x + (y - math.erf(x)) / erf_slope(x)


def inverse_erfc(y: float) -> float:
    """The `x` with `erfc(x) == y`, for 0 < y < 2."""
    return -_NORMAL.inv_cdf(y / 2) / math.sqrt(2) if 0 < y < 2 else refuse('erfc takes values in (0, 2)')


def erf_slope(x: float) -> float:
    """The derivative of erf."""
    return 2 / math.sqrt(math.pi) * math.exp(-x * x)


def without(y: str, a: str, b: str) -> str:
    """The beginning `a` of the text y that ends in b."""
    return y[: len(y) - len(b)] if y.endswith(b) else refuse('%r does not end with %r', y, b)


def without_beginning(y: str, a: str, b: str) -> str:
    """The end `b` of the text y that begins with a."""
    return y[len(a) :] if y.startswith(a) else refuse('%r does not begin with %r', y, a)


def repeated(y: str, a: str, b: int) -> str:
    """The `a` with `a * b == y`."""
    part = y[: len(y) // b] if b > 0 else ''
    return part if len(part) * b == len(y) and part * b == y else refuse('%r is not a text repeated %r times', y, b)


def times(y: str, a: str, b: int) -> int:
    """The `b` with `a * b == y`."""
    if len(a) * b == len(y) and a * b == y:
        return b
    count = len(y) // len(a) if a else 0
    return count if a * count == y else refuse('%r is not a repetition of %r', y, a)
