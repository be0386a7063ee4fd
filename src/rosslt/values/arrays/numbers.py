"""The numbers that NumPy gives, with provenance: subclasses of `numpy.float64`, `float32` and `int64`.

Each is NumPy's own number, with its attributes, its operators and its errors, and knows the tracked float or int that
it is (`tracked`). It is a tracked value itself, so that messages, solving and the like take it as any other.
"""

import math
import operator
from typing import Any, Callable, Dict

import numpy

from ..functions import to_float, to_int
from ..operations.table import POWER
from ..operators import FAST
from ..recording import OF_PYTHON, spend
from ..tracked import CLASSES as PYTHON_CLASSES
from ..tracked import TRACKED, add_class, lazy

ROUNDING = 1e-9
"""The maximal relative difference between a number that NumPy computed and the one that its expression gives."""

ROUNDING_32 = 1e-6
"""The same for numbers of 32 bits."""

PYTHON_NUMBERS = frozenset((PYTHON_CLASSES[float], PYTHON_CLASSES[int]))
OF_NUMPY = 4 * OF_PYTHON
"""How many operations of the compiled core take as long as one of NumPy's numbers that is recorded."""

_FLOAT = PYTHON_CLASSES[float]
Number = Any
"""A number of Python or NumPy, with provenance or without."""


def _itself(self: Number, *_: Any) -> Number:
    return self


def _of_tracked(name: str) -> property:
    return property(lambda self: getattr(self.tracked, name), lambda self, value: setattr(self.tracked, name, value))


def _class_of(kind: Any) -> Any:
    """The class of such numbers. Calling it gives a number of NumPy, whose class must be its first base: NumPy itself
    looks there."""
    attributes = {
        '__slots__': ('tracked',),
        '__class__': property(lambda self: kind),
        '__new__': lambda cls, *arguments: kind(*arguments),
        '__copy__': _itself,
        '__deepcopy__': _itself,
        '__reduce_ex__': lambda self, protocol: self.tracked.__reduce_ex__(protocol),
        'plain': property(lambda self: kind(self.tracked._plain), doc="NumPy's own number, without provenance."),
        # What the room asks of a tracked value.
        **{name: _of_tracked(name) for name in ('_plain', '_record', '_size', '_fold')},
    }
    return type(kind.__name__, (kind,), attributes)


#: {class of NumPy's numbers: the class of those with provenance}.
CLASSES: Dict[Any, Any] = {kind: _class_of(kind) for kind in (numpy.float64, numpy.float32, numpy.int64)}
NUMPY_NUMBERS = frozenset(CLASSES.values())
WITH_PROVENANCE = PYTHON_NUMBERS | NUMPY_NUMBERS


def python_number(number: Number) -> Number:
    """A number of NumPy as Python's, tracked if it has provenance; anything else as it is."""
    if type(number) in NUMPY_NUMBERS:
        return number.tracked
    return number.item() if isinstance(number, numpy.generic) else number


def rounding_of(kind: Any) -> float:
    """The maximal relative difference between numbers of a class of NumPy's and what their expressions give."""
    return ROUNDING_32 if kind is numpy.float32 else ROUNDING


def same_number(number: Number, tracked: Number, rounding: float = ROUNDING) -> Number:
    """The tracked value of a plain number, of the same kind; the plain number if the two differ.

    Args:
        number: of Python or NumPy.
        tracked: a tracked number of Python that is equal to it except for rounding, or anything else.
        rounding: by how much they may differ, relative to them.
    """
    if type(tracked) not in PYTHON_NUMBERS:
        return number
    made = tracked._plain
    if made == number and (made or math.copysign(1, made) == math.copysign(1, number)):
        is_float = isinstance(number, (float, numpy.floating))
        if (type(made) is float) is is_float:
            return tracked
        return to_float(tracked) if is_float else to_int(tracked)
    if abs(made - number) <= rounding * max(abs(made), abs(number)):
        (rounded,) = lazy([python_number(number)], [lambda _: tracked])
        return rounded
    return number


def with_tracked(number: Number, tracked: Number) -> Number:
    """A number of NumPy with its provenance, if its class can have one and the tracked number is the same."""
    kind = type(number)
    if kind not in CLASSES:
        return number
    if type(tracked) is not _FLOAT or kind is not numpy.float64 or tracked._plain != number or not number:
        tracked = same_number(number, tracked, rounding_of(kind))
    return of_numpy(number, tracked) if type(tracked) in PYTHON_NUMBERS else number


def of_numpy(number: Number, tracked: Number) -> Number:
    """A number of NumPy as the tracked number of Python that it is."""
    kind: Any = type(number)
    made = kind.__new__(CLASSES[kind], number)
    made.tracked = tracked
    return made


def recorded(number: Number, function: Callable[..., Any], *operands: Number) -> Number:
    """A number that NumPy computed, with the provenance of the same function of tracked numbers."""
    if type(number) not in CLASSES or not spend(OF_NUMPY):
        return number
    try:
        return with_tracked(number, python_number(function(*map(python_number, operands))))
    except Exception:  # if NumPy warns, or computes with other numbers than Python's
        return number


def plain_number(x: Number) -> Number:
    """A number without provenance; anything else as it is."""
    kind = type(x)
    return x.plain if kind in NUMPY_NUMBERS else x._plain if kind in TRACKED else x


BINARY = {name: getattr(numpy, row.numpy[0]) for name, row in {**FAST, 'pow': POWER}.items()}
"""The ufuncs of Python's operators."""


def _give_operators(kind: Any, name: str, ufunc: Any, compute: Callable[..., Any], arrays: Any) -> None:
    computed, reflected = getattr(kind, f'__{name}__'), getattr(kind, f'__r{name}__')
    of_tracked = getattr(operator, name)
    if name == 'mul':
        arrays = arrays - {list, tuple}  # a list is repeated by a whole number

    def forward(self: Number, other: Any, *modulus: Any) -> Any:
        if type(other) in arrays:
            return compute(ufunc, '__call__', (self, other), {})
        number = other if type(other) is type(self) else plain_number(other)
        return recorded(computed(self, number, *modulus), of_tracked, self, other)

    def backward(self: Number, other: Any) -> Any:
        if type(other) in arrays:
            return compute(ufunc, '__call__', (other, self), {})
        return recorded(reflected(self, plain_number(other)), of_tracked, other, self)

    _give(kind, f'__{name}__', forward)
    _give(kind, f'__r{name}__', backward)


def _give(kind: Any, name: str, method: Callable[..., Any]) -> None:
    method.__name__ = name
    setattr(CLASSES[kind], name, method)


def _give_unary(kind: Any, name: str, of_tracked: Callable[..., Any]) -> None:
    computed = getattr(kind, name)

    def method(self: Number, *arguments: Any, **options: Any) -> Any:
        made = computed(self, *map(plain_number, arguments), **options)
        return recorded(made, of_tracked, self, *arguments, *options.values())

    _give(kind, name, method)


def _astype(self: Number, dtype: Any, *arguments: Any, **options: Any) -> Number:
    """Override the method of `numpy.generic` to keep provenance."""
    return _converted(self.plain.astype(dtype, *arguments, **options), self.tracked)


def _converted(number: Number, tracked: Number) -> Number:
    return recorded(number, to_int if isinstance(number, numpy.integer) else _itself, tracked)


def conversion(kind: Any) -> Callable[..., Any]:
    """`numpy.float64` or another class of NumPy's numbers as a function that keeps provenance."""

    def convert(x: Any = 0, *arguments: Any, **options: Any) -> Any:
        if type(x) not in WITH_PROVENANCE:
            return kind(x, *arguments, **options)
        return _converted(kind(plain_number(x)), python_number(x))

    return convert


def _item(self: Number, *arguments: Any) -> Number:
    """Override the method of `numpy.generic`: return Python's number, tracked."""
    self.plain.item(*arguments)
    return self.tracked


def complete(compute: Callable[..., Any], arrays: Any, array_ufunc: Callable[..., Any]) -> None:
    """Give the classes their operators and methods, and have the room know them as tracked values.

    Args:
        compute: calls a ufunc of arrays.
        arrays: the classes of operands that it is called with.
        array_ufunc: the method of that protocol.
    """
    for kind, cls in CLASSES.items():
        for name, ufunc in BINARY.items():
            _give_operators(kind, name, ufunc, compute, arrays)
        for name, of_tracked in (('__neg__', operator.neg), ('__pos__', _itself), ('__abs__', abs)):
            _give_unary(kind, name, of_tracked)
        _give_unary(kind, 'round', lambda number, digits=None, _=None: round(number, digits))
        for name in ('copy', 'squeeze', 'conj', 'conjugate'):
            _give_unary(kind, name, _itself)
        cls.__divmod__ = lambda self, other: (self // other, self % other)
        cls.__rdivmod__ = lambda self, other: (other // self, other % self)
        cls.__round__ = lambda self, digits=None: round(self.tracked) if digits is None else self.round(digits)
        cls.astype, cls.item, cls.tolist = _astype, _item, _item
        cls.real = cls.T = property(_itself)
        cls.__array_ufunc__ = array_ufunc
        add_class(cls)
