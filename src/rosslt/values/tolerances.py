"""When two numbers are treated as equal: every tolerance of solving is here.

Whole numbers, bools and texts are equal or they are not; only floats are compared with a tolerance.
"""

import math

from .annotations import Value

RELATIVE = 1e-9
"""The relative error that the law PutGet allows for a result."""

ROUNDING = 1e-12
"""The relative error that the rounding of a few operations makes, and for values of size 1 the absolute one allowed
next to 0, if a relative one is impossible."""

ULPS = 8 * 2.0**-52
"""The relative distance of a source from its bound that a few roundings make."""


def meets(found: Value, wanted: Value) -> bool:
    """Return True if a result is the wanted one: equal, or a float within a relative 1e-9 of it."""
    if found == wanted:
        return True
    try:
        return isinstance(found, float) and abs(found - wanted) <= RELATIVE * abs(wanted)
    except (OverflowError, TypeError):
        return False


def almost_meets(found: Value, wanted: Value, size: Value) -> bool:
    """`meets`, or as near as rounding lets a result come that was of ordinary size.

    The difference of two numbers near 1 cannot be made 1e-17, and a marker is not dragged to within less than a
    picometre.

    Args:
        found, wanted: the result that there is, and the one that should be.
        size: the size of what the result was.
    """
    if meets(found, wanted):
        return True
    try:
        return isinstance(found, float) and abs(found - wanted) <= ROUNDING * min(1.0, abs(size))
    except (OverflowError, TypeError):
        return False


def is_rounded(found: Value, wanted: Value) -> bool:
    """Return True if an operation's result equals the wanted one: floats up to rounding, whole numbers exactly."""
    return found == wanted or (isinstance(found, float) and math.isclose(found, wanted, rel_tol=ROUNDING))


def is_same(present: Value, wanted: Value) -> bool:
    """Return True if two values are equal: numbers up to rounding, texts and lists exactly."""
    try:
        return bool(present == wanted) or math.isclose(present, wanted, rel_tol=RELATIVE, abs_tol=ROUNDING)
    except (TypeError, ValueError):
        both = hasattr(present, '__len__') and hasattr(wanted, '__len__')
        return both and list(present) == list(wanted)


def is_at(value: float, bound: float) -> bool:
    """Return True if a source's value is within a few roundings of a bound."""
    return abs(value - bound) <= ULPS * abs(value)
