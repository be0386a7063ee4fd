"""The operators and methods of NumPy's numbers with provenance: NumPy computes, and the provenance stands beside it."""

import operator
from typing import Any, Callable

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import CLASSES, WITH_PROVENANCE, python_number, with_tracked
from rosslt.instrument.arrays import ARRAYS, ArrayWithProvenance, compute, plain_operand

_BINARY = {
    'add': numpy.add,
    'sub': numpy.subtract,
    'mul': numpy.multiply,
    'truediv': numpy.true_divide,
    'floordiv': numpy.floor_divide,
    'mod': numpy.remainder,
    'pow': numpy.power,
}


def _recorded(number: Any, function: Callable[..., Any], *operands: Any) -> Any:
    """Add to a number that NumPy computed the provenance of the same function of tracked numbers."""
    if type(number) not in CLASSES:
        return number
    try:
        tracked = function(*map(python_number, operands))
    except (ArithmeticError, TypeError, ValueError):  # where NumPy warns, or computes with other numbers than Python's
        return number
    return with_tracked(number, tracked)


def _give_operators(kind: Any, name: str, ufunc: Any) -> None:
    computed, reflected = getattr(kind, f'__{name}__'), getattr(kind, f'__r{name}__')
    recorded = getattr(operator, name)
    # A list is repeated by a whole number.
    arrays = ARRAYS - {list, tuple} if name == 'mul' else ARRAYS

    def forward(self: Any, other: Any, *modulus: Any) -> Any:
        if type(other) in arrays:
            return compute(ufunc, '__call__', (self, other), {})
        number = other if type(other) is type(self) else plain_operand(other)
        return _recorded(computed(self, number, *modulus), recorded, self, other)

    def backward(self: Any, other: Any) -> Any:
        if type(other) in arrays:
            return compute(ufunc, '__call__', (other, self), {})
        return _recorded(reflected(self, plain_operand(other)), recorded, other, self)

    _give(kind, f'__{name}__', forward)
    _give(kind, f'__r{name}__', backward)


def _give_unary(kind: Any, name: str, recorded: Callable[..., Any]) -> None:
    computed = getattr(kind, name)
    _give(kind, name, lambda self, *arguments: _recorded(computed(self, *arguments), recorded, self, *arguments))


def _give(kind: Any, name: str, method: Any) -> None:
    method.__name__ = name
    setattr(CLASSES[kind], name, method)


def _rounded(number: Any, digits: Any = None, _: Any = None) -> Any:
    return round(number, digits)


def _itself(number: Any, *_: Any) -> Any:
    return number


def _divmod(self: Any, other: Any) -> Any:
    return self // other, self % other


def _reflected_divmod(self: Any, other: Any) -> Any:
    return other // self, other % self


def _round(self: Any, digits: Any = None) -> Any:
    """A whole number of Python, as of NumPy's numbers, or a number of NumPy with so many digits."""
    return round(self.tracked) if digits is None else self.round(digits)


def _astype(self: Any, dtype: Any, *arguments: Any, **options: Any) -> Any:
    """Override the method of `numpy.generic` to keep provenance."""
    return _converted(self.plain.astype(dtype, *arguments, **options), self.tracked)


def _converted(number: Any, tracked: Any) -> Any:
    return _recorded(number, values.to_int if isinstance(number, numpy.integer) else _itself, tracked)


def conversion(kind: Any) -> Any:
    """`numpy.float64` or another class of NumPy's numbers as a function that keeps provenance."""

    def convert(x: Any = 0, *arguments: Any, **options: Any) -> Any:
        if type(x) not in WITH_PROVENANCE:
            return kind(x, *arguments, **options)
        return _converted(kind(plain_operand(x)), python_number(x))

    return convert


def _item(self: Any, *arguments: Any) -> Any:
    """Override the method of `numpy.generic`: return Python's number, tracked."""
    self.plain.item(*arguments)
    return self.tracked


def _complete(kind: Any, cls: Any) -> None:
    for name, ufunc in _BINARY.items():
        _give_operators(kind, name, ufunc)
    for name, recorded in (('__neg__', operator.neg), ('__pos__', _itself), ('__abs__', abs), ('round', _rounded)):
        _give_unary(kind, name, recorded)
    for name in ('copy', 'squeeze', 'conj', 'conjugate', 'sum', 'mean', 'min', 'max', 'prod'):
        _give_unary(kind, name, _itself)
    cls.__divmod__, cls.__rdivmod__, cls.__round__ = _divmod, _reflected_divmod, _round
    cls.astype, cls.item, cls.tolist = _astype, _item, _item
    cls.real = cls.T = property(_itself)
    cls.__array_ufunc__ = ArrayWithProvenance.__array_ufunc__


for _kind, _class in CLASSES.items():
    _complete(_kind, _class)
