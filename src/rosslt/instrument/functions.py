"""`math` and the conversions of a node's own code: for plain numbers as they are, keeping provenance for others."""

import math
from typing import Any, Callable, Dict

from rosslt import values

_TRACKED = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int, bool))


def keeping(original: Callable[..., Any], tracked: Callable[..., Any]) -> Callable[..., Any]:
    """The function that gives plain arguments to one function, and others to another one."""

    def function(*arguments: Any, **options: Any) -> Any:
        for argument in arguments:
            if type(argument) in _TRACKED or isinstance(argument, (list, tuple)):
                return tracked(*arguments, **options)
        return original(*arguments, **options)

    return _named_as(original, function)


def _keeping_one(original: Callable[[Any], Any], tracked: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def function(x: Any, *others: Any) -> Any:
        if type(x) in _TRACKED:
            return tracked(x, *others)
        return original(x, *others)

    return _named_as(original, function)


def _named_as(original: Any, function: Any) -> Any:
    function.__name__ = function.__qualname__ = original.__name__
    function.__doc__ = original.__doc__
    function.__module__ = original.__module__
    return function


_SEVERAL = {'atan2', 'copysign', 'dist', 'fmod', 'fsum', 'hypot', 'log', 'pow', 'prod', 'remainder', 'ldexp', 'isclose'}

#: The functions of `math` that keep provenance, by name.
MATH: Dict[str, Any] = {
    name: (keeping if name in _SEVERAL else _keeping_one)(getattr(math, name), function)
    for name, function in values.MATH.items()
    if hasattr(math, name) and function is not getattr(math, name)
}


def to_float(x: Any) -> Any:
    """`float(x)`, keeping provenance."""
    return values.to_float(x) if type(x) in _TRACKED else float(x)


def to_int(x: Any) -> Any:
    """`int(x)`, keeping provenance."""
    return values.to_int(x) if type(x) in _TRACKED else int(x)
