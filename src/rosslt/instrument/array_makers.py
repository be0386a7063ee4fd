"""NumPy's functions that make arrays, of numbers and lists with provenance too."""

import functools
from typing import Any, Callable, Dict

import numpy

from rosslt import values
from rosslt.instrument.array_arguments import plain
from rosslt.instrument.array_numbers import WITH_PROVENANCE
from rosslt.instrument.arrays import (
    LARGEST,
    ArrayWithProvenance,
    any_tracked,
    only_tracked,
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
        if values.RECORDING.is_paused:
            return original(plain(thing), *arguments, **options)
        kind = type(thing)
        if kind is ArrayWithProvenance:
            beside = thing._beside
            made = original(thing.view(numpy.ndarray), *arguments, **options)
            if made.base is not thing and not numpy.shares_memory(made, thing) and beside is not None:
                beside = beside.copy()
            if beside is not None and beside.shape != made.shape:
                beside = beside.reshape(made.shape)
            return with_provenance(made, beside)
        if kind in WITH_PROVENANCE or (kind in (list, tuple) and any_tracked(thing)):
            made = original(plain(thing), *arguments, **options)
            beside = provenance_of(thing)
            if kind in WITH_PROVENANCE:
                box = numpy.empty(made.shape, dtype=object)
                box[...] = beside
                beside = box
            elif beside is not None and beside.shape != made.shape and beside.size == made.size:
                beside = beside.reshape(made.shape)
            return with_provenance(made, beside)
        return original(thing, *arguments, **options)

    return array


def _made_empty(original: Any) -> Any:
    """`numpy.zeros` and its like: what they make is there to be written to."""

    @functools.wraps(original, updated=())
    def empty(*arguments: Any, **options: Any) -> Any:
        made = original(*[plain(one) for one in arguments], **plain(options))
        if made.dtype.char in 'dfb' and made.size <= LARGEST and not values.RECORDING.is_paused:
            return made.view(ArrayWithProvenance)
        return made

    return empty


def _full(original: Any) -> Any:
    @functools.wraps(original, updated=())
    def full(*arguments: Any, **options: Any) -> Any:
        made = original(*map(plain, arguments), **plain(options))
        value = options['fill_value'] if 'fill_value' in options else arguments[1]
        beside = None if values.RECORDING.is_paused else provenance_of(value)
        if beside is None:
            return made
        box = numpy.empty(made.shape, dtype=object)
        box[...] = beside
        return with_provenance(made, box)

    return full


def _linspace(start: Any, stop: Any, num: Any = 50, *arguments: Any, **options: Any) -> Any:
    made = numpy.linspace(plain(start), plain(stop), plain(num), *arguments, **options)
    if values.RECORDING.is_paused or not (type(start) in WITH_PROVENANCE or type(stop) in WITH_PROVENANCE):
        return made
    if not isinstance(made, numpy.ndarray) or made.ndim != 1:
        return made
    steps = len(made) - 1 if options.get('endpoint', True) else len(made)
    return _between(made, lambda index: start + index * (stop - start) / steps if steps else start)


def _arange(*arguments: Any, **options: Any) -> Any:
    made = numpy.arange(*[plain(one) for one in arguments], **plain(options))
    places = ('stop',) if len(arguments) == 1 and 'stop' not in options else ('start', 'stop', 'step')
    given = {**options, **dict(zip(places, arguments))}
    start, step = given.get('start', 0), given.get('step', 1)
    if values.RECORDING.is_paused or not (type(start) in WITH_PROVENANCE or type(step) in WITH_PROVENANCE):
        return made
    return _between(made, lambda index: start + index * step)


def _between(made: numpy.ndarray, value_at: Callable[[int], Any]) -> Any:
    if made.size > LARGEST:
        return made
    beside = numpy.empty(made.shape, dtype=object)
    for index in range(len(made)):
        beside[index] = value_at(index)
    return with_provenance(made, only_tracked(beside))


def makers() -> Dict[str, Any]:
    """What a node's own code gets in place of these functions of `numpy`, by name."""
    found: Dict[str, Any] = {}
    for name in ('array', 'asarray', 'asanyarray', 'asfarray', 'ascontiguousarray'):
        if hasattr(numpy, name):
            found[name] = _made_array(getattr(numpy, name))
    for name in ('zeros', 'ones', 'empty', 'identity', 'eye', 'zeros_like', 'ones_like', 'empty_like'):
        found[name] = _made_empty(getattr(numpy, name))
    for name in ('full', 'full_like'):
        found[name] = _full(getattr(numpy, name))
    found['linspace'] = functools.wraps(numpy.linspace, updated=())(_linspace)
    found['arange'] = _named('arange', _arange)
    return found


def _named(name: str, function: Any) -> Any:
    function.__name__ = name
    function.__doc__ = getattr(numpy, name).__doc__
    return function
