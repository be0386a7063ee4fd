"""The numbers that NumPy gives, with provenance: subclasses of `numpy.float64`, `float32` and `int64`.

Each is NumPy's own number, with its attributes, its operators and its errors, and knows the tracked float or int that
it is (`tracked`). It is a tracked value itself, so that messages, solving and the like take it as any other.
"""

import math
from typing import Any, Dict

import numpy

from rosslt import values

#: The classes of tracked floats and ints of Python.
TRACKED = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int))

#: The maximal relative difference between a number computed by NumPy and by `math`.
ROUNDING = 1e-9

#: The maximal relative difference between a 32-bit number and the tracked one.
ROUNDING_32 = 1e-6


def _pickled(self: Any, protocol: Any) -> Any:
    return self.plain.__reduce_ex__(protocol)


def _itself(self: Any, *_: Any) -> Any:
    return self


def _of_tracked(name: str) -> property:
    return property(lambda self: getattr(self.tracked, name), lambda self, value: setattr(self.tracked, name, value))


def _class_of(kind: Any) -> Any:
    """The class of such numbers, to which `scalars` gives its operators. Calling it gives a number of NumPy.

    NumPy's numbers must be its first base: NumPy itself looks there.

    Args:
        kind: the class of NumPy's own numbers.
    """
    attributes = {
        '__slots__': ('tracked',),
        '__class__': property(lambda self: kind),
        '__new__': lambda cls, *arguments: kind(*arguments),
        '__copy__': _itself,
        '__deepcopy__': _itself,
        '__reduce_ex__': _pickled,
        'plain': property(lambda self: kind(self.tracked._plain), doc="NumPy's own number, without provenance."),
        # What the room `values` asks of a tracked value.
        **{name: _of_tracked(name) for name in ('_plain', '_record', '_size', '_fold')},
    }
    return type(kind.__name__, (kind,), attributes)


#: {class of NumPy's numbers: the class of those with provenance}.
CLASSES: Dict[Any, Any] = {kind: _class_of(kind) for kind in (numpy.float64, numpy.float32, numpy.int64)}
NUMPY_NUMBERS = frozenset(CLASSES.values())

#: All classes of numbers with provenance.
WITH_PROVENANCE = TRACKED | NUMPY_NUMBERS


def python_number(number: Any) -> Any:
    """A number of NumPy as Python's, tracked where it has provenance; anything else as it is."""
    if type(number) in NUMPY_NUMBERS:
        return number.tracked
    return number.item() if isinstance(number, numpy.generic) else number


def same_number(number: Any, tracked: Any, rounding: float = ROUNDING) -> Any:
    """The number that stands in an array as a tracked one of the same kind, where it still is that."""
    if tracked is None or type(tracked) not in TRACKED:
        return number
    made = tracked._plain
    if made == number and (made or math.copysign(1, made) == math.copysign(1, number)):
        if type(made) is float:
            return tracked if isinstance(number, (float, numpy.floating)) else values.to_int(tracked)
        return values.to_float(tracked) if isinstance(number, (float, numpy.floating)) else tracked
    if abs(made - number) <= rounding * max(abs(made), abs(number)):
        (rounded,) = values.lazy([python_number(number)], [lambda _: tracked])
        return rounded
    return number


def with_tracked(number: Any, tracked: Any) -> Any:
    """A number of NumPy with its provenance, where it has one and its class can.

    Args:
        number: a scalar of NumPy.
        tracked: the tracked number of Python that is equal to it but for rounding, or None.
    """
    kind = type(number)
    if tracked is None or kind not in CLASSES:
        return number
    found = same_number(number, tracked, ROUNDING_32 if kind is numpy.float32 else ROUNDING)
    if type(found) not in TRACKED:
        return number
    new: Any = kind.__new__
    made = new(CLASSES[kind], number)
    made.tracked = found
    return made
