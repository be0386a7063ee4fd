"""The numbers that are read from arrays, with their provenance: Python's floats and ints, and NumPy's `float32`.

A number of 64 bits is a tracked float or int. One of 32 bits computes in as many bits, so it stays one of NumPy's: a
`Float32`, which knows the tracked float that it is in a message.
"""

import copy
import math
import operator
from typing import Any, Callable

import numpy

from rosslt import values

TRACKED = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int))

#: How far a number computed by NumPy may be from the same one computed by `math`, against its size.
ROUNDING = 1e-9

#: The same of 32 bits.
ROUNDING_32 = 1e-6


def python_number(number: Any) -> Any:
    """A number of NumPy as Python's."""
    return number.item() if hasattr(number, 'item') else number


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


class Float32(numpy.float32):
    """A `numpy.float32` with provenance. Made by `float32`.

    Args:
        number: the number.
        tracked: the tracked float of the same number; without, it is one of NumPy's own.
    """

    def __new__(cls, number: Any = 0, tracked: Any = None) -> Any:
        if tracked is None:
            return numpy.float32(_plain(number))
        new: Any = numpy.float32.__new__
        made = new(cls, number)
        made.tracked = tracked
        return made

    tracked: Any
    has_provenance = True
    #: Whether there is any in this process.
    is_used = False

    @property
    def plain(self) -> Any:
        """It without provenance."""
        return numpy.float32(self)

    def __copy__(self) -> 'Float32':
        return self

    def __deepcopy__(self, _: Any) -> 'Float32':
        return self

    def astype(self, dtype: Any, *arguments: Any, **options: Any) -> Any:
        """As of `numpy.float32`; floats of 64 and 32 bits keep their provenance."""
        kind = numpy.dtype(dtype).char
        if kind == 'f':
            return self
        return self.tracked if kind == 'd' else self.plain.astype(dtype, *arguments, **options)

    def item(self, *arguments: Any) -> Any:
        """As of `numpy.float32`; the tracked float."""
        super().item(*arguments)
        return self.tracked

    def tolist(self) -> Any:
        """As of `numpy.float32`; the tracked float."""
        return self.tracked


def float32(number: Any, tracked: Any) -> Any:
    """A number of 32 bits with its provenance, where it has one.

    Args:
        number: a `numpy.float32`.
        tracked: what it was rounded from.
    """
    found = same_number(number, tracked, ROUNDING_32)
    if type(found) not in TRACKED or values.RECORDING.is_paused:
        return number
    Float32.is_used = True
    return Float32(number, values.to_float(found))


def to_float32(x: Any) -> Any:
    """`numpy.float32(x)`, keeping provenance."""
    made: Any = numpy.float32(_plain(x))
    tracked = x.tracked if type(x) is Float32 else x
    return float32(made, tracked) if type(tracked) in TRACKED and isinstance(made, numpy.float32) else made


def _operator(name: str) -> Callable[..., Any]:
    computed, recorded = getattr(numpy.float32, f'__{name}__'), getattr(operator, name)

    def binary(self: Float32, other: Any) -> Any:
        return _with_provenance(computed(self.plain, _plain(other)), recorded, self, other)

    return _named(binary, name)


def _reflected(name: str) -> Callable[..., Any]:
    computed, recorded = getattr(numpy.float32, f'__r{name}__'), getattr(operator, name)

    def binary(self: Float32, other: Any) -> Any:
        return _with_provenance(computed(self.plain, _plain(other)), recorded, other, self)

    return _named(binary, 'r' + name)


def _unary(name: str) -> Callable[..., Any]:
    computed, recorded = getattr(numpy.float32, f'__{name}__'), getattr(operator, name)

    def unary(self: Float32) -> Any:
        return _with_provenance(computed(self.plain), recorded, self)

    return _named(unary, name)


def _named(function: Any, name: str) -> Any:
    function.__name__ = f'__{name}__'
    return function


def _plain(operand: Any) -> Any:
    if type(operand) is Float32:
        return operand.plain
    return operand._plain if type(operand) in TRACKED else operand


def _with_provenance(number: Any, recorded: Callable[..., Any], *operands: Any) -> Any:
    """What NumPy has computed, with the provenance of the same operation on tracked floats."""
    if not isinstance(number, numpy.floating) or values.RECORDING.is_paused:
        return number
    try:
        tracked = recorded(*[one.tracked if type(one) is Float32 else python_number(one) for one in operands])
    except (ArithmeticError, TypeError, ValueError):
        return number
    return float32(number, tracked) if type(number) is numpy.float32 else same_number(number, tracked)


for _name in ('add', 'sub', 'mul', 'truediv', 'floordiv', 'mod', 'pow'):
    setattr(Float32, f'__{_name}__', _operator(_name))
    setattr(Float32, f'__r{_name}__', _reflected(_name))
for _name in ('neg', 'pos', 'abs'):
    setattr(Float32, f'__{_name}__', _unary(_name))


def with_python_numbers(message: Any) -> Any:
    """A message, or what a field of one holds, with tracked floats in place of numbers of 32 bits that have provenance.

    Returns:
        It itself where it has none, else a copy.
    """
    return _converted(message) if Float32.is_used else message


def _converted(thing: Any) -> Any:
    if type(thing) is Float32:
        return thing.tracked
    if type(thing) in (list, tuple):
        kinds = set(map(type, thing))
        if Float32 in kinds or any(hasattr(kind, '_slot_types') for kind in kinds):
            parts = list(map(_converted, thing))
            if any(map(operator.is_not, parts, thing)):
                return parts
        return thing
    made = thing
    if hasattr(thing, '_slot_types'):
        for name in thing.__slots__:
            value = getattr(thing, name)
            part = _converted(value)
            if part is not value:
                made = copy.copy(thing) if made is thing else made
                setattr(made, name, part)
    return made
