"""The one table of operations: all that rosslt knows about arithmetic stands in its rows.

A row gives the operation's name and symbol, its forward function, and for each operand its inverse and
its slope. Recording, evaluating, solving, explaining, the wire format and `rosslt.math` read this table; a
new operation is one row. The letters in the rows: `a` and `b` are the operands' present values, `y` is the
wanted result. An inverse returns the operand that gives `y`, the one nearest its present value if
there are several, and raises ValueError, ArithmeticError or OverflowError if there is none.
"""

import functools
import math
import operator
from fractions import Fraction
from math import inf
from typing import Callable, NoReturn

from ..annotations import Value
from ..tolerances import is_same
from .inverses import (
    TURN,
    angle_adjacent,
    angle_opposite,
    base,
    divided,
    dividend,
    erf_slope,
    exponent,
    floor_divisor,
    in_period,
    inverse_erf,
    inverse_erfc,
    leg,
    modulus,
    refuse,
    repeated,
    times,
    within,
    without,
    without_beginning,
)
from .row import operation


def _no_slope(*operands: Value) -> NoReturn:
    raise ValueError('there is no slope')


NO_SLOPE = (_no_slope, _no_slope)
HALF = Fraction(1, 2)
QUARTER = TURN / 4

MOST_BITS = 2**16
MOST_DIGITS = 10**4
"""Limits for exponents, counts and digits that a solver tries, so that it does not fill the memory."""


MOST_COMPUTED = 2**26
"""The most bits or characters of a result of tracked operands: an edited script with `9 ** 9 ** 9` would not end
otherwise."""


class TooLong(OverflowError):
    """A whole number or a text is longer than a solver may try and a message may hold.

    Attributes:
        size: how many bits or characters it has at most.
        compute: gives it nevertheless, as plain Python does.
    """

    def __init__(self, message: str, size: int, compute: Callable[[], Value]) -> None:
        super().__init__(message)
        self.size = size
        self.compute = compute


def power(a: Value, b: Value) -> Value:
    """`a ** b`, refused for whole numbers too long for a solver to try."""
    if isinstance(a, int) and isinstance(b, int) and a.bit_length() * b > MOST_BITS and a not in (1, -1):
        size = a.bit_length() * b
        raise TooLong('a power of so many digits is too large', size, functools.partial(operator.pow, a, b))
    return a**b


def repetition(a: str, b: int) -> str:
    """`a * b`, refused for texts that are too long for a message."""
    size = len(a) * b
    if size > MOST_BITS:
        raise TooLong('a text of %d characters is too large' % size, size, functools.partial(operator.mul, a, b))
    return a * b


def rounded_to(a: Value, digits: int) -> Value:
    """round(a, digits)."""
    return round(a, max(digits, -MOST_DIGITS))


def half_unit(digits: int) -> Value:
    """Half of the last decimal digit that rounding to so many digits keeps."""
    return 10 ** min(-digits, MOST_DIGITS) // 2 if digits < 0 else 0.5 * 10.0**-digits


def cube_root(a: float) -> float:
    """The real cube root (`math.cbrt` came with Python 3.11)."""
    root = math.copysign(abs(a) ** (1 / 3), a)
    return root - (root - a / (root * root)) / 3 if root and math.isfinite(root) else root


# A formula sheet, formatted by hand.
# fmt: off

ADD = operation(
    1, 'add', operator.add, symbol='+', precedence=10, affine=('a', 'b', 'ab'), commutes=True, numpy='add',
    inverse=(lambda y, a, b: y - b, lambda y, a, b: y - a),
    slope=(lambda a, b: 1, lambda a, b: 1))

SUBTRACT = operation(
    2, 'sub', operator.sub, symbol='-', precedence=10, affine=('a', 'b', 'ab'), numpy='subtract',
    inverse=(lambda y, a, b: y + b, lambda y, a, b: a - y),
    slope=(lambda a, b: 1, lambda a, b: -1))

MULTIPLY = operation(
    3, 'mul', operator.mul, symbol='*', precedence=11, affine=('a', 'b'), commutes=True, numpy='multiply',
    inverse=(lambda y, a, b: y / b, lambda y, a, b: y / a),
    slope=(lambda a, b: b, lambda a, b: a))

DIVIDE = operation(
    4, 'truediv', operator.truediv, symbol='/', precedence=11, affine=('a',), numpy='divide true_divide',
    inverse=(lambda y, a, b: y * b, lambda y, a, b: a / y),
    slope=(lambda a, b: 1 / b, lambda a, b: -a / b / b))

FLOOR_DIVIDE = operation(
    5, 'floordiv', operator.floordiv, symbol='//', precedence=11, numpy='floor_divide', stepped=True,
    inverse=(dividend, floor_divisor),
    slope=(lambda a, b: 0, lambda a, b: 0))

REMAINDER = operation(
    6, 'mod', operator.mod, symbol='%', precedence=11, numpy='remainder mod',
    inverse=(lambda y, a, b: divided(y, a, b, operator.mod), lambda y, a, b: modulus(y, a, b, operator.mod)),
    slope=(lambda a, b: 1, lambda a, b: -(a // b)))

POWER = operation(
    7, 'power', power, symbol='**', precedence=13, numpy='power float_power',
    inverse=(base, exponent),
    slope=(lambda a, b: b * a ** (b - 1), lambda a, b: a ** b * math.log(a) if a else 0.0))

NEGATE = operation(
    8, 'neg', operator.neg, symbol='-', precedence=12, affine=('a',), numpy='negative',
    inverse=(lambda y, a: -y,), slope=(lambda a: -1,))

ABSOLUTE = operation(
    9, 'abs', abs, image=(0, inf), numpy='absolute',
    inverse=(lambda y, a: y if a >= 0 else -y,), slope=(lambda a: 1 if a >= 0 else -1,))

# Numbers to whole numbers, and from one type to another.

ROUND = operation(
    10, 'round', round, numpy='rint', stepped=True,
    inverse=(lambda y, a: within(a, y - HALF, y + HALF, lambda v: round(v) == y, 'round takes whole values'),),
    slope=(lambda a: 0,))

ROUND_TO = operation(
    11, 'round_to', rounded_to, shown_as='round',
    inverse=(lambda y, a, b: within(a, y - half_unit(b), y + half_unit(b), lambda v: is_same(rounded_to(v, b), y),
                                    'round to %d digits does not give that' % b),
             lambda y, a, b: b if is_same(rounded_to(a, b), y) else refuse('a number of digits is not solved for')),
    slope=(lambda a, b: 0, lambda a, b: 0))

TRUNCATE = operation(
    12, 'trunc', math.trunc, numpy='trunc', shown_as='int', stepped=True,
    inverse=(lambda y, a: within(a, y - (y <= 0), y + (y >= 0), lambda v: math.trunc(v) == y,
                                 'int takes whole values'),),
    slope=(lambda a: 0,))

FLOOR = operation(
    13, 'floor', math.floor, numpy='floor', stepped=True,
    inverse=(lambda y, a: within(a, y, y + 1, lambda v: math.floor(v) == y, 'floor takes whole values'),),
    slope=(lambda a: 0,))

CEIL = operation(
    14, 'ceil', math.ceil, numpy='ceil', stepped=True,
    inverse=(lambda y, a: within(a, y - 1, y, lambda v: math.ceil(v) == y, 'ceil takes whole values'),),
    slope=(lambda a: 0,))

TO_FLOAT = operation(
    15, 'float', float, affine=('a',),
    inverse=(lambda y, a: y,), slope=(lambda a: 1,))

TO_BOOL = operation(
    16, 'bool', bool, on_text=True,
    inverse=(lambda y, a: a if bool(a) == y else int(y) if not isinstance(a, str) else '' if not y else
             refuse('any text would do'),),
    slope=(_no_slope,))

# Powers and logarithms.

SQRT = operation(
    20, 'sqrt', math.sqrt, image=(0, inf), numpy='sqrt',
    inverse=(lambda y, a: y * y,), slope=(lambda a: 0.5 / math.sqrt(a),))

CBRT = operation(
    21, 'cbrt', cube_root, numpy='cbrt',
    inverse=(lambda y, a: y * y * y,), slope=(lambda a: 1 / (3 * cube_root(a) ** 2),))

EXP = operation(
    22, 'exp', math.exp, image=(0, inf), numpy='exp',
    inverse=(lambda y, a: math.log(y),), slope=(lambda a: math.exp(a),))

EXP2 = operation(
    23, 'exp2', lambda a: math.pow(2.0, a), image=(0, inf), numpy='exp2',
    inverse=(lambda y, a: math.log2(y),), slope=(lambda a: math.pow(2.0, a) * math.log(2),))

EXPM1 = operation(
    24, 'expm1', math.expm1, image=(-1, inf), numpy='expm1',
    inverse=(lambda y, a: math.log1p(y),), slope=(lambda a: math.exp(a),))

LOG = operation(
    25, 'log', math.log, numpy='log',
    inverse=(lambda y, a: math.exp(y),), slope=(lambda a: 1 / a,))

LOG_TO = operation(
    26, 'log_to', math.log, shown_as='log',
    inverse=(lambda y, a, b: math.pow(b, y), lambda y, a, b: math.pow(a, 1 / y)),
    slope=(lambda a, b: 1 / (a * math.log(b)), lambda a, b: -math.log(a) / (b * math.log(b) ** 2)))

LOG2 = operation(
    27, 'log2', math.log2, numpy='log2',
    inverse=(lambda y, a: math.pow(2.0, y),), slope=(lambda a: 1 / (a * math.log(2)),))

LOG10 = operation(
    28, 'log10', math.log10, numpy='log10',
    inverse=(lambda y, a: math.pow(10.0, y),), slope=(lambda a: 1 / (a * math.log(10)),))

LOG1P = operation(
    29, 'log1p', math.log1p, numpy='log1p',
    inverse=(lambda y, a: math.expm1(y),), slope=(lambda a: 1 / (1 + a),))

FLOAT_POWER = operation(
    30, 'pow', math.pow,
    inverse=(lambda y, a, b: float(base(y, a, b)), lambda y, a, b: float(exponent(y, a, b))),
    slope=(lambda a, b: b * math.pow(a, b - 1), lambda a, b: math.pow(a, b) * math.log(a) if a else 0.0))

# Angles. A target angle is met on the turn of the present one.

SIN = operation(
    40, 'sin', math.sin, image=(-1, 1), numpy='sin',
    inverse=(lambda y, a: in_period(a, TURN, math.asin(y), math.pi - math.asin(y)),),
    slope=(lambda a: math.cos(a),))

COS = operation(
    41, 'cos', math.cos, image=(-1, 1), numpy='cos',
    inverse=(lambda y, a: in_period(a, TURN, math.acos(y), -math.acos(y)),),
    slope=(lambda a: -math.sin(a),))

TAN = operation(
    42, 'tan', math.tan, numpy='tan',
    inverse=(lambda y, a: in_period(a, math.pi, math.atan(y)),),
    slope=(lambda a: 1 + math.tan(a) ** 2,))

ASIN = operation(
    43, 'asin', math.asin, image=(-QUARTER, QUARTER), numpy='arcsin',
    inverse=(lambda y, a: math.sin(y),), slope=(lambda a: 1 / math.sqrt(1 - a * a),))

ACOS = operation(
    44, 'acos', math.acos, image=(0, math.pi), numpy='arccos',
    inverse=(lambda y, a: math.cos(y),), slope=(lambda a: -1 / math.sqrt(1 - a * a),))

ATAN = operation(
    45, 'atan', math.atan, image=(-QUARTER, QUARTER), numpy='arctan',
    inverse=(lambda y, a: math.tan(y),), slope=(lambda a: 1 / (1 + a * a),))

ATAN2 = operation(
    46, 'atan2', math.atan2, image=(-math.pi, math.pi), numpy='arctan2',
    inverse=(angle_opposite, angle_adjacent),
    slope=(lambda a, b: b / (a * a + b * b), lambda a, b: -a / (a * a + b * b)))

DEGREES = operation(
    47, 'degrees', math.degrees, affine=('a',), numpy='degrees rad2deg',
    inverse=(lambda y, a: math.radians(y),), slope=(lambda a: 180 / math.pi,))

RADIANS = operation(
    48, 'radians', math.radians, affine=('a',), numpy='radians deg2rad',
    inverse=(lambda y, a: math.degrees(y),), slope=(lambda a: math.pi / 180,))

SINH = operation(
    49, 'sinh', math.sinh, numpy='sinh',
    inverse=(lambda y, a: math.asinh(y),), slope=(lambda a: math.cosh(a),))

COSH = operation(
    50, 'cosh', math.cosh, image=(1, inf), numpy='cosh',
    inverse=(lambda y, a: math.copysign(math.acosh(y), a),), slope=(lambda a: math.sinh(a),))

TANH = operation(
    51, 'tanh', math.tanh, image=(-1, 1), numpy='tanh',
    inverse=(lambda y, a: math.atanh(y),), slope=(lambda a: 1 / math.cosh(a) ** 2,))

ASINH = operation(
    52, 'asinh', math.asinh, numpy='arcsinh',
    inverse=(lambda y, a: math.sinh(y),), slope=(lambda a: 1 / math.hypot(1, a),))

ACOSH = operation(
    53, 'acosh', math.acosh, image=(0, inf), numpy='arccosh',
    inverse=(lambda y, a: math.cosh(y),), slope=(lambda a: 1 / math.sqrt(a * a - 1),))

ATANH = operation(
    54, 'atanh', math.atanh, numpy='arctanh',
    inverse=(lambda y, a: math.tanh(y),), slope=(lambda a: 1 / (1 - a * a),))

HYPOT = operation(
    55, 'hypot', math.hypot, image=(0, inf), numpy='hypot',
    inverse=(leg, lambda y, a, b: leg(y, b, a)),
    slope=(lambda a, b: a / math.hypot(a, b), lambda a, b: b / math.hypot(a, b)))

# The rest of `math`.

FABS = operation(
    60, 'fabs', math.fabs, image=(0, inf), numpy='fabs',
    inverse=(lambda y, a: math.copysign(y, a),), slope=(lambda a: math.copysign(1, a),))

COPYSIGN = operation(
    61, 'copysign', math.copysign, numpy='copysign',
    inverse=(lambda y, a, b: math.copysign(y, a) if math.copysign(y, b) == y else
             refuse('copysign has the sign of %r', b),
             lambda y, a, b: math.copysign(b, y) if abs(y) == abs(a) else
             refuse('copysign has the size of %r', a)),
    slope=(lambda a, b: math.copysign(1, a) * math.copysign(1, b), lambda a, b: 0))

FMOD = operation(
    62, 'fmod', math.fmod, numpy='fmod',
    inverse=(lambda y, a, b: divided(y, a, b, math.fmod), lambda y, a, b: modulus(y, a, b, math.fmod)),
    slope=(lambda a, b: 1, lambda a, b: -math.trunc(a / b)))

IEEE_REMAINDER = operation(
    63, 'remainder', math.remainder,
    inverse=(lambda y, a, b: divided(y, a, b, math.remainder), lambda y, a, b: modulus(y, a, b, math.remainder)),
    slope=(lambda a, b: 1, lambda a, b: -round(a / b)))

LDEXP = operation(
    64, 'ldexp', math.ldexp, affine=('a',), numpy='ldexp',
    inverse=(lambda y, a, b: math.ldexp(y, -b), lambda y, a, b: exponent(y / a, 2.0, b)),
    slope=(lambda a, b: math.ldexp(1.0, b), lambda a, b: 0))

ERF = operation(
    65, 'erf', math.erf, image=(-1, 1),
    inverse=(lambda y, a: inverse_erf(y),), slope=(lambda a: erf_slope(a),))

ERFC = operation(
    66, 'erfc', math.erfc, image=(0, 2),
    inverse=(lambda y, a: inverse_erfc(y),), slope=(lambda a: -erf_slope(a),))

# Whole numbers and bools bit by bit; texts.

AND = operation(
    70, 'and', operator.and_, symbol='&', precedence=9, commutes=True, slope=NO_SLOPE,
    inverse=(lambda y, a, b: y | (a & ~b), lambda y, a, b: y | (b & ~a)))

OR = operation(
    71, 'or', operator.or_, symbol='|', precedence=7, commutes=True, slope=NO_SLOPE,
    inverse=(lambda y, a, b: (y & ~b) | (a & b), lambda y, a, b: (y & ~a) | (b & a)))

XOR = operation(
    72, 'xor', operator.xor, symbol='^', precedence=8, commutes=True, slope=NO_SLOPE,
    inverse=(lambda y, a, b: y ^ b, lambda y, a, b: y ^ a))

CONCATENATE = operation(
    80, 'concat', operator.concat, on_text=True, symbol='+', precedence=10, slope=NO_SLOPE,
    inverse=(without, without_beginning))

REPEAT = operation(
    81, 'repeat', repetition, on_text=True, symbol='*', precedence=11, slope=NO_SLOPE,
    inverse=(repeated, times))
