"""The functions of `math` that keep provenance, made from the rows of the table; `rosslt.math` hands them on.

Of plain numbers each gives what `math` gives; of NumPy arrays it works on every element.
"""

import functools
import math
from typing import Any, Callable, Dict, Iterable, Tuple

from .numpy_ufuncs import is_array
from .operations import BY_CODE, Operation
from .operations import table as ops
from .recording import apply
from .tracked import TRACKED


def function(operation: Operation) -> Callable[..., Any]:
    """A row of the table as a function."""
    if operation.arity == 1:

        def applied(x: Any) -> Any:
            return apply(operation, x)
    else:

        def applied(x: Any, y: Any) -> Any:  # type: ignore[misc]
            result = apply(operation, x, y)
            return operation.forward(x, y) if result is NotImplemented else result

    applied.__name__ = applied.__qualname__ = operation.name
    applied.__doc__ = 'math.%s, keeping provenance.' % operation.name
    return applied


def log(x: Any, base: Any = None) -> Any:
    """math.log, keeping provenance: the natural logarithm, or the one to a base."""
    return apply(ops.LOG, x) if base is None else apply(ops.LOG_TO, x, base)


def hypot(*coordinates: Any) -> Any:
    """math.hypot, keeping provenance: the Euclidean length of any number of coordinates."""
    if not _any_tracked(coordinates):
        return math.hypot(*coordinates)
    if len(coordinates) == 1:
        return apply(ops.FABS, coordinates[0])
    return functools.reduce(functools.partial(apply, ops.HYPOT), coordinates)


def dist(p: Iterable[Any], q: Iterable[Any]) -> Any:
    """math.dist, keeping provenance: the distance of two points of the same dimension."""
    p, q = list(p), list(q)
    if not _any_tracked(p + q):
        return math.dist(p, q)
    if len(p) != len(q):
        raise ValueError('both points must have the same number of dimensions')
    return hypot(*[a - b for a, b in zip(p, q)])


def fsum(numbers: Iterable[Any]) -> Any:
    """math.fsum, keeping provenance; with a tracked number among them it adds from left to right, and rounds so."""
    numbers = list(numbers)
    return apply(ops.TO_FLOAT, sum(numbers)) if _any_tracked(numbers) else math.fsum(numbers)


def prod(numbers: Iterable[Any], *, start: Any = 1) -> Any:
    """math.prod, keeping provenance."""
    numbers = list(numbers)
    factors = numbers if numbers and start == 1 else [start] + numbers
    return functools.reduce(lambda a, b: a * b, factors)


def modf(x: Any) -> Tuple[Any, Any]:
    """math.modf, keeping provenance: the fraction and the whole part, both floats with the sign of x."""
    if type(x) not in TRACKED:
        return math.modf(x)
    rest = apply(ops.FMOD, x, 1.0)
    return rest, x - rest


def to_int(x: Any) -> Any:
    """int(x), keeping provenance: a number towards zero to a whole one."""
    return apply(ops.TRUNCATE, x) if type(x) in TRACKED or is_array(x) else int(x)


def to_float(x: Any) -> Any:
    """float(x), keeping provenance."""
    return apply(ops.TO_FLOAT, x) if type(x) in TRACKED or is_array(x) else float(x)


def to_bool(x: Any) -> Any:
    """bool(x), keeping provenance: whether a number is not 0, or a text not empty."""
    return apply(ops.TO_BOOL, x) if type(x) in TRACKED or is_array(x) else bool(x)


def _any_tracked(numbers: Iterable[Any]) -> bool:
    return any(type(number) in TRACKED for number in numbers)


def _namespace() -> Dict[str, Any]:
    names = {name: thing for name, thing in vars(math).items() if not name.startswith('_')}
    names.update(
        (row.name, function(row)) for row in BY_CODE.values() if row.name in names or row in (ops.CBRT, ops.EXP2)
    )
    for composed in (log, hypot, dist, fsum, prod, modf):
        names[composed.__name__] = composed
    return names


MATH = _namespace()
"""All names of `math`, with those functions in place that keep provenance. `gamma`, `lgamma`, `frexp` and the
functions of whole numbers (`gcd`, `comb`, `factorial`, ...) are those of `math`, and give plain numbers."""
