"""NumPy's functions that make arrays, of numbers and lists with provenance too."""

import functools
import types
from typing import Any, Callable, Dict

import numpy

from rosslt.instrument.array_arguments import plain
from rosslt.instrument.arrays import (
    LARGEST,
    ArrayWithProvenance,
    any_tracked,
    provenance_of,
    with_provenance,
)

_MISSING = object()


def _made_array(original: Any) -> Any:
    """`numpy.array` and its like."""

    @functools.wraps(original, updated=())
    def array(thing: Any = _MISSING, *arguments: Any, **options: Any) -> Any:
        if thing is _MISSING:
            name = 'object' if original is numpy.array else 'a'
            return array(options.pop(name), **options) if name in options else original(**options)
        if type(thing) is not ArrayWithProvenance and not any_tracked((thing,)):
            return original(thing, *arguments, **options)
        given = plain(thing)
        made = original(given, *arguments, **options)
        if made is given:
            return thing
        if made.dtype == object:
            return original(thing, *arguments, **options)
        beside = provenance_of(thing)
        if beside is None or numpy.size(beside) != made.size:
            return with_provenance(made, None)
        if not isinstance(beside, numpy.ndarray) or not numpy.shares_memory(made, thing):
            beside = numpy.array(beside, dtype=object)
        return with_provenance(made, beside.reshape(made.shape))

    return array


def _made_empty(original: Any) -> Any:
    """`numpy.zeros` and its like: what they make is there to be written to."""

    @functools.wraps(original, updated=())
    def empty(*arguments: Any, **options: Any) -> Any:
        made = original(*[plain(one) for one in arguments], **plain(options))
        if made.dtype.char in 'dfb' and made.size <= LARGEST:
            return made.view(ArrayWithProvenance)
        return made

    return empty


def _full(original: Any) -> Any:
    @functools.wraps(original, updated=())
    def full(*arguments: Any, **options: Any) -> Any:
        made = original(*map(plain, arguments), **plain(options))
        value = options['fill_value'] if 'fill_value' in options else arguments[1]
        beside = provenance_of(value)
        if beside is None:
            return made
        box = numpy.empty(made.shape, dtype=object)
        box[...] = beside
        return with_provenance(made, box)

    return full


def makers() -> Dict[str, Any]:
    """Return the replacements of `numpy` functions that make arrays (`array`, `zeros`), {name: function}."""
    found: Dict[str, Any] = {}
    for name in ('array', 'asarray', 'asanyarray', 'asfarray', 'ascontiguousarray'):
        if hasattr(numpy, name):
            found[name] = _made_array(getattr(numpy, name))
    for name in ('zeros', 'ones', 'empty', 'identity', 'eye', 'zeros_like', 'ones_like', 'empty_like'):
        found[name] = _made_empty(getattr(numpy, name))
    for name in ('full', 'full_like'):
        found[name] = _full(getattr(numpy, name))
    return {name: builtin_like(getattr(numpy, name), function) for name, function in found.items()}


class _Builtin:
    """A Python function that replaces a C function: as an attribute of a class, it does not become a method."""

    def __init__(self, original: Any, function: Callable[..., Any]) -> None:
        self._function = function
        functools.update_wrapper(self, original, updated=())

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self._function(*arguments, **options)


def builtin_like(original: Any, function: Callable[..., Any]) -> Any:
    """Wrap a replacement so that, as a class attribute, it becomes a method only if the original does."""
    return function if isinstance(original, types.FunctionType) else _Builtin(original, function)
