"""The functions of `math` that keep provenance, made from the rows of the table; `rosslt.math` hands them on.

Of plain numbers each gives what `math` gives; of NumPy arrays it works on every element.
"""

import functools
import math
from typing import Any, Callable, Dict, Iterable, Tuple

from .accelerator import CORE, Decorated, documented
from .annotations import Function, Value
from .numpy_ufuncs import is_array
from .operations import BY_CODE, Operation
from .operations import table as ops
from .recording import apply
from .tracked import TRACKED, plain


def function(operation: Operation) -> Function:
    """A row of the table as a function."""
    if operation.arity == 1:

        def applied(x: Value) -> Value:
            return apply(operation, x)
    else:

        def applied(x: Value, y: Value) -> Value:  # type: ignore[misc]
            result = apply(operation, x, y)
            return operation.forward(x, y) if result is NotImplemented else result

    applied.__name__ = applied.__qualname__ = operation.name
    applied.__doc__ = 'math.%s, keeping provenance.' % operation.name
    return recorder(operation)(applied)


def recorder(operation: Operation) -> Callable[[Decorated], Decorated]:
    """A decorator for a function that keeps provenance: the compiled core, if there is one, does it for tracked
    numbers; the function itself is called with anything else.

    Args:
        operation: a row of the table, which is what the function does with as many numbers as that takes.
    """

    def decorated(function: Decorated) -> Decorated:
        if CORE is None:
            return function
        forms = operation.left, operation.right, operation.both
        name, doc = function.__name__, documented(function)
        made: Decorated = CORE.recorder(operation.forward, forms, operation.arity, function, name, doc)
        return made

    return decorated


def keeping(of_plain: Function, of_tracked: Function, of_others: Function) -> Function:
    """A function that calls `of_plain` with numbers and texts, and `of_tracked` if an argument may have provenance.

    Args:
        of_plain: is called with floats, ints and texts; the function is called as it is.
        of_tracked: is called if an argument is tracked, or a list or tuple.
        of_others: is called if one is of any other class, also beside those.
    """

    if CORE is not None:
        made: Function = CORE.keeping(of_plain, of_tracked, of_others, of_plain.__name__, _signed(of_plain))
        return made

    def function(*arguments: Value, **options: Value) -> Value:
        called = of_plain
        for argument in arguments:
            if isinstance(argument, str) or type(argument) in (float, int):
                continue
            if type(argument) not in TRACKED and not isinstance(argument, (list, tuple)):
                return of_others(*arguments, **options)
            called = of_tracked
        return called(*arguments, **options)

    function.__name__ = function.__qualname__ = of_plain.__name__
    function.__doc__ = of_plain.__doc__
    function.__module__ = of_plain.__module__
    return function


def _signed(function: Function) -> str:
    """The docstring of a compiled function behind its signature, the form from which CPython reads both."""
    signature = getattr(function, '__text_signature__', None)
    return ('%s%s\n--\n\n' % (function.__name__, signature) if signature else '') + (function.__doc__ or '')


def reflecting(
    plain: Callable[[Any, Any], Any], reflected: Callable[[Any, Any], Any], kinds: Dict[Any, Tuple[Any, ...]]
) -> Callable[[Value, Value], Value]:
    """An operator that asks a tracked number on the right first if the left operand takes it for a plain one.

    Args:
        plain: the operator.
        reflected: is asked first; if it returns NotImplemented, `plain` computes.
        kinds: {class of the left operand: the classes of tracked floats and ints that it takes for plain numbers}
    """
    if CORE is not None:
        made: Callable[[Value, Value], Value] = CORE.reflecting(plain, reflected, kinds, plain.__name__, _signed(plain))
        return made

    def function(left: Value, right: Value) -> Value:
        if type(right) in TRACKED and type(right) in kinds.get(type(left), ()):
            result = reflected(left, right)
            if result is not NotImplemented:
                return result
        return plain(left, right)

    function.__name__ = function.__qualname__ = plain.__name__
    return function


def stripper(function: Decorated) -> Decorated:
    """A decorator for a function that gives a value without provenance, and plain numbers and texts as they are: the
    compiled core, if there is one, does it for floats and ints."""
    if CORE is None:
        return function
    made: Decorated = CORE.stripper(function, function.__name__, documented(function))
    return made


@recorder(ops.LOG)
def log(x: Value, base: Value = None) -> Value:
    """math.log, keeping provenance: the natural logarithm, or the one to a base."""
    return apply(ops.LOG, x) if base is None else apply(ops.LOG_TO, x, base)


@recorder(ops.HYPOT)
def hypot(*coordinates: Value) -> Value:
    """math.hypot, keeping provenance: the Euclidean length of any number of coordinates."""
    if not _any_tracked(coordinates):
        return math.hypot(*coordinates)
    if len(coordinates) == 1:
        return apply(ops.FABS, coordinates[0])
    return functools.reduce(functools.partial(apply, ops.HYPOT), coordinates)


def dist(p: Iterable[Value], q: Iterable[Value]) -> Value:
    """math.dist, keeping provenance: the distance of two points of the same dimension."""
    p, q = list(p), list(q)
    if not _any_tracked(p + q):
        return math.dist(p, q)
    if len(p) != len(q):
        raise ValueError('both points must have the same number of dimensions')
    return hypot(*[a - b for a, b in zip(p, q)])


def fsum(numbers: Iterable[Value]) -> Value:
    """math.fsum, keeping provenance; with a tracked number among them it adds from left to right, and rounds so."""
    numbers = list(numbers)
    return apply(ops.TO_FLOAT, sum(numbers)) if _any_tracked(numbers) else math.fsum(numbers)


def prod(numbers: Iterable[Value], *, start: Value = 1) -> Value:
    """math.prod, keeping provenance."""
    factors = [start, *numbers]
    if type(start) is int and start == 1 and len(factors) > 1 and not isinstance(plain(factors[1]), bool):
        factors = factors[1:]  # 1 times a number is that number itself, but of a bool it is an int
    return functools.reduce(lambda a, b: a * b, factors)


def modf(x: Value) -> Tuple[Value, Value]:
    """math.modf, keeping provenance: the fraction and the whole part, both floats with the sign of x; of an infinite x,
    both are plain."""
    if type(x) not in TRACKED or math.isinf(x):
        return math.modf(plain(x))
    rest = apply(ops.FMOD, x, 1.0)
    whole = x - rest
    return rest, whole if whole else apply(ops.COPYSIGN, whole, x)


@recorder(ops.TRUNCATE)
def to_int(x: Value) -> Value:
    """int(x), keeping provenance: a number towards zero to a whole one."""
    return apply(ops.TRUNCATE, x) if type(x) in TRACKED or is_array(x) else int(x)


@recorder(ops.TO_FLOAT)
def to_float(x: Value) -> Value:
    """float(x), keeping provenance."""
    return apply(ops.TO_FLOAT, x) if type(x) in TRACKED or is_array(x) else float(x)


def to_bool(x: Value) -> Value:
    """bool(x), keeping provenance: whether a number is not 0, or a text not empty."""
    return apply(ops.TO_BOOL, x) if type(x) in TRACKED or is_array(x) else bool(x)


def _any_tracked(numbers: Iterable[Value]) -> bool:
    return any(type(number) in TRACKED for number in numbers)


def _namespace() -> Dict[str, Value]:
    names = {name: thing for name, thing in vars(math).items() if not name.startswith('_')}
    names.update(
        (row.name, function(row)) for row in BY_CODE.values() if row.name in names or row in (ops.CBRT, ops.EXP2)
    )
    for composed in (log, hypot, dist, fsum, prod, modf):
        names[composed.__name__] = composed
    for name, thing in names.items():
        if thing is not getattr(math, name, None):
            thing.__module__ = 'rosslt.math'  # where pickle finds it
    return names


MATH = _namespace()
"""All names of `math`, bound to functions that keep provenance if there are any. `gamma`, `lgamma`, `frexp` and the
functions of whole numbers (`gcd`, `comb`, `factorial`, ...) are those of `math`, and give plain numbers."""
