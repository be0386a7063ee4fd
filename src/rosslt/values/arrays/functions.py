"""NumPy's functions for those who ask for them by name: they see tracked numbers in lists and among their arguments.

NumPy itself asks nobody if it is given lists and numbers, and arrays that are made of them are plain.
"""

import functools
import types
from typing import Any, Callable, Dict

import numpy

from ..recording import spend
from .calling import RECEPTIVE, call, compute
from .graph import OF_ARRAY
from .tracked_array import Argument, TrackedArray, holds_tracked, node_of_list, of_list, plain, receptive, with_node


class _Builtin(functools.partial):
    """A Python function that replaces a C function: as an attribute of a class, it does not become a method."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__['__wrapped__'], name)


def replacing(original: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a replacement so that, as a class attribute, it becomes a method only if the original does."""
    wrap = functools.wraps(original, updated=())
    return wrap if isinstance(original, types.FunctionType) else lambda function: wrap(_Builtin(function))


def _noticing(function: Any) -> Any:
    """A function of NumPy that keeps provenance, whatever it is given; with plain arguments it is called as it is."""
    is_receptive = function in RECEPTIVE

    @replacing(function)
    def noticing(*arguments: Argument, **options: Argument) -> Any:
        for one in (*arguments, *options.values()) if options else arguments:
            if holds_tracked(one):
                if not isinstance(function, numpy.ufunc):
                    return call(function, arguments, options)
                if options or len(arguments) != function.nin:
                    # NumPy hands them on, with `out` wherever it takes it, if it is given no lists.
                    return function(*map(_array_of_list, arguments), **options)
                return compute(function, '__call__', arguments, {})
        made = function(*arguments, **options)
        return receptive(made) if is_receptive else made

    return noticing


def _array_of_list(x: Argument) -> Argument:
    return of_list(x, None) if type(x) in (list, tuple) and holds_tracked(x) else x


def _making_array(original: Any) -> Any:
    """`numpy.array` and its like."""

    name = 'object' if original is numpy.array else 'a'

    @replacing(original)
    def array(*arguments: Any, **options: Any) -> Any:
        if not arguments and name in options:
            arguments = (options.pop(name),)
        thing, rest = arguments[0] if arguments else None, arguments[1:]
        if type(thing) is not TrackedArray and not holds_tracked(thing):
            return original(*arguments, **options)
        if type(thing) is TrackedArray:
            made = call(original, arguments, options)
            return receptive(made) if type(made) is numpy.ndarray else made
        made = original(plain(thing), *rest, **plain(options))
        if not isinstance(made, numpy.ndarray):  # made by the class of `like`
            return made
        if made.dtype == object:
            return original(thing, *rest, **options)
        return with_node(made, node_of_list([thing], made)) if spend(OF_ARRAY) else made

    return array


def replacements(module: types.ModuleType) -> Dict[str, Any]:
    """The functions of `numpy`, or of a part of it, as ones that keep provenance: {name: function}."""
    found = {}
    for name in dir(module):
        function = getattr(module, name)
        if not name.startswith('_') and isinstance(function, (types.FunctionType, types.BuiltinFunctionType)):
            is_array = name in ('array', 'asarray', 'asanyarray', 'asfarray', 'ascontiguousarray')
            found[name] = _making_array(function) if is_array else _noticing(function)
    return found


def _taking_objects(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that treats arrays of objects as arrays of their elements."""

    @replacing(function)
    def called(*arguments: Argument, **options: Argument) -> Any:
        return function(*map(_of_objects, arguments), **{name: _of_objects(one) for name, one in options.items()})

    return called


def _of_objects(x: Argument) -> Argument:
    is_tracked = isinstance(x, numpy.ndarray) and x.dtype == object and x.ndim and holds_tracked(x.tolist())
    return _ARRAY(x.tolist()) if is_tracked else x


def _functions() -> Dict[str, Any]:
    """`{name: function}`, and the same for the names of `numpy.linalg` with that in front of them."""
    linalg = {'linalg.' + name: function for name, function in replacements(numpy.linalg).items()}
    ufuncs = {name: _noticing(one) for name, one in vars(numpy).items() if isinstance(one, numpy.ufunc)}
    return {name: _taking_objects(one) for name, one in {**replacements(numpy), **linalg, **ufuncs}.items()}


_ARRAY = _making_array(numpy.array)
FUNCTIONS = _functions()
"""The functions of NumPy by name (`dot`, `linalg.inv`), each keeping provenance."""
