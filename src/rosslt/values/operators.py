"""Gives the tracked classes their operators, conversions and NumPy methods, from the rows of the table."""

from typing import Any, Callable, Optional, Tuple

from .accelerator import CORE
from .affine import LIMIT, MAX_SHARED_SIZE, affine_of_python, joint_size
from .annotations import Value
from .graph import slopes_or_zeros
from .instructions import assemble, disassemble
from .numpy_ufuncs import array_ufunc, broadcast, is_array, is_of_numpy
from .operations import AFFINE, BY_CODE, FUNCTION, LAZY, SOURCE, Operation
from .operations import table as ops
from .recording import ALLOWANCE, apply, shorten_and_count, spend
from .sources import Source, UnnamedSource
from .tracked import (
    CREATE,
    TRACKED,
    TrackedBool,
    TrackedFloat,
    TrackedInt,
    TrackedStr,
    new_of_python,
    plain,
    plain_scalar,
    resolve,
)

NUMBERS: Tuple[Any, ...] = (TrackedFloat, TrackedInt, TrackedBool)
WHOLE: Tuple[Any, ...] = (TrackedInt, TrackedBool)
TEXT: Any = TrackedStr

FAST = {
    'add': ops.ADD,
    'sub': ops.SUBTRACT,
    'mul': ops.MULTIPLY,
    'truediv': ops.DIVIDE,
    'floordiv': ops.FLOOR_DIVIDE,
    'mod': ops.REMAINDER,
}
"""The operators that make a float of two floats."""

BITWISE = {'and': ops.AND, 'or': ops.OR, 'xor': ops.XOR}

TEMPLATE = """
def __{name}__(self, other):
    if type(other) is float:
        value = self._plain {symbol} other
        if not spend(1):
            return value
        result = create(value)
        result._plain = value
        result._record = (left, self, other)
        size = result._size = self._size + 1
        if size > {limit}:
            shorten_and_count(result)
        return result
    if type(other) is TrackedFloat:
        value = self._plain {symbol} other._plain
        if not spend(1):
            return value
        result = create(value)
        result._plain = value
        result._record = (both, self, other)
        size = result._size = joint_size(self._size, other._size)
        if size > {limit}:
            shorten_and_count(result)
        return result
    return compute(self, other)

def __r{name}__(self, other):
    if type(other) is float:
        value = other {symbol} self._plain
        if not spend(1):
            return value
        result = create(value)
        result._plain = value
        result._record = (right, self, other)
        size = result._size = self._size + 1
        if size > {limit}:
            shorten_and_count(result)
        return result
    return operate(operation, other, self)
"""
"""`operate`, written out for floats: this saves a call, and `self._plain + other` is Python's fast addition."""


def give_fast_operator(name: str, operation: Operation) -> None:
    """Give TrackedFloat an operator and its reflection, compiled from the template."""
    methods = dict(
        TrackedFloat=TrackedFloat,
        create=CREATE[float],
        joint_size=joint_size,
        shorten_and_count=shorten_and_count,
        spend=spend,
        operate=operate,
        compute=computing(name, operation),
        operation=operation,
        left=operation.left,
        right=operation.right,
        both=operation.both,
    )
    exec(TEMPLATE.format(name=name, symbol=operation.symbol, limit=LIMIT), methods)
    for method in ('__%s__' % name, '__r%s__' % name):
        setattr(TrackedFloat, method, methods[method])


def computing(name: str, operation: Operation) -> Callable[[Value, Value], Value]:
    """A function of two operands that computes and records an operator.

    It gives way to the right operand if Python asks that first: a subclass with a reflected operator of its own.
    If nothing more is recorded, the result is the program's own: of plain numbers, whatever their classes.
    """
    reflected, forward = '__r%s__' % name, operation.forward

    def compute(a: Value, b: Value) -> Value:
        if not spend(0):
            return forward(plain(a), plain(b))
        kind, left = type(b), type(a).__base__ or object
        is_other = type(a) in NUMBERS and issubclass(kind, left) and kind not in TRACKED and not hasattr(kind, 'dtype')
        if is_other and getattr(kind, reflected) is not getattr(left, reflected):
            return NotImplemented
        return operate(operation, a, b)

    return compute


def give_operator(cls: type, name: str, operation: Operation) -> None:
    """Give a class an operator and its reflection."""
    compute = computing(name, operation)

    def method(self: Value, other: Value) -> Value:
        return compute(self, other)

    def reflected(self: Value, other: Value) -> Value:
        return operate(operation, other, self)

    setattr(cls, '__%s__' % name, method)
    setattr(cls, '__r%s__' % name, reflected)


def give_bitwise(cls: type, name: str, operation: Operation) -> None:
    """Give a class of whole numbers an operator of bits and its reflection."""

    def method(self: Value, other: Value) -> Value:
        return apply(operation, self, other) if isinstance(other, int) or is_array(other) else NotImplemented

    def reflected(self: Value, other: Value) -> Value:
        return apply(operation, other, self) if isinstance(other, int) or is_array(other) else NotImplemented

    setattr(cls, '__%s__' % name, method)
    setattr(cls, '__r%s__' % name, reflected)


def give_method(cls: type, name: str, operation: Operation) -> None:
    """Give a class a method that applies an operation to it and what else it is called with."""

    def method(self: Value, *others: Value) -> Value:
        return apply(operation, self, *others)

    setattr(cls, name, method)


def operate(operation: Operation, first: Value, second: Value) -> Value:
    """The result of an operator: as in `apply`, and of NumPy's numbers what NumPy makes of them."""
    if is_of_numpy(second) or is_of_numpy(first):
        # A number of NumPy with provenance has operators of its own.
        return NotImplemented if type(second) in TRACKED else broadcast(apply, operation, first, second)
    return apply(operation, first, second)


def power(self: Value, other: Value, modulo: Optional[int] = None) -> Value:
    """`self ** other`; with a modulus it is number theory, whose results are plain."""
    return operate(ops.POWER, self, other) if modulo is None else pow(self._plain, plain(other), plain(modulo))


def floor_and_rest(self: Value, other: Value) -> Value:
    """divmod(self, other)."""
    if not is_of_numpy(other):
        divisor = plain_scalar(other)
        if divisor is None:
            return NotImplemented
        divmod(self._plain, divisor)  # which raises what Python raises
    return self // other, self % other


def reflected_floor_and_rest(self: Value, other: Value) -> Value:
    """divmod(other, self)."""
    if not is_of_numpy(other):
        dividend = plain_scalar(other)
        if dividend is None:
            return NotImplemented
        divmod(dividend, self._plain)
    return other // self, other % self


def rounded(self: Value, digits: Value = None) -> Value:
    """round(self, digits)."""
    count = plain(digits)
    if count is None:
        return apply(ops.ROUND, self)
    return apply(ops.ROUND_TO, self, count) if type(count) is int else round(self._plain, count)


def product(self: Value, other: Value) -> Value:
    """`self * other` of a whole number, which may repeat a text or a list."""
    if isinstance(other, (bytes, bytearray, list, tuple)):
        return self._plain * other
    return reflected_product(self, other)


def reflected_product(self: Value, other: Value) -> Value:
    """`other * self` of a whole number, which may repeat a text. Lists repeat themselves, in place with `*=`."""
    return apply(ops.REPEAT, other, self) if isinstance(other, str) else multiply(self, other)


multiply = computing('mul', ops.MULTIPLY)


def joined(self: Value, other: Value) -> Value:
    """`self + other` of texts."""
    return apply(ops.CONCATENATE, self, other) if isinstance(other, str) else NotImplemented


def joined_behind(self: Value, other: Value) -> Value:
    """`other + self` of texts."""
    return apply(ops.CONCATENATE, other, self) if isinstance(other, str) else NotImplemented


def text_repeated(self: Value, count: Value) -> Value:
    """`self * count` of a text."""
    return apply(ops.REPEAT, self, count) if isinstance(count, int) else NotImplemented


def itself(self: Value, *_: Value) -> Value:
    """An immutable value is its own copy."""
    return self


def as_instructions(self: Value, protocol: int) -> Tuple[Value, Tuple[Value, int]]:
    """Reduce a value for pickle to a flat list of instructions, so that deep expressions do not recurse."""
    instructions, (index,) = disassemble([self])
    return from_instructions, (instructions, index)


def from_instructions(instructions: Value, index: int) -> Value:
    """The value that pickle kept."""
    return assemble(instructions)[index]


def complete_core() -> None:
    """Tell the compiled core which forms its arithmetic records, and which functions do the rest."""

    def fallback(name: str) -> Value:
        if name != 'mul':
            return computing(name, FAST[name])
        return lambda a, b: product(a, b) if type(a) is TrackedInt else times_whole(a, b)

    def times_whole(a: Value, b: Value) -> Value:
        return reflected_product(b, a) if type(b) is TrackedInt and type(a) is not TrackedFloat else multiply(a, b)

    rows = [*FAST.values(), ops.POWER]
    CORE.complete(
        tuple([form for row in rows for form in (row.left, row.right, row.both)]),
        (*map(fallback, FAST), power),
        ops.NEGATE.left,
        SOURCE,
        LAZY,
        shorten_and_count,
        resolve,
        new_of_python,
        (Source, UnnamedSource),
        TRACKED,
        AFFINE,
        slopes_or_zeros,
        ops.ABSOLUTE.left,
        affine_of_python,
        lambda overdrawn: ALLOWANCE.refill(overdrawn),
        ops.SIN.left,
        ops.COS.left,
        LIMIT,
        MAX_SHARED_SIZE,
    )


def give_all() -> None:
    """Complete the tracked classes."""
    if CORE is not None:
        complete_core()
    for name, row in FAST.items():
        if CORE is None:
            give_fast_operator(name, row)
            give_operator(TrackedInt, name, row)
        give_operator(TrackedBool, name, row)
    for name, row in BITWISE.items():
        for cls in WHOLE:
            give_bitwise(cls, name, row)
    for cls in WHOLE:
        cls.numerator = property(itself)
        if CORE is None or cls is TrackedBool:
            cls.__mul__, cls.__rmul__ = product, reflected_product
    for cls in NUMBERS:
        if CORE is None or cls is TrackedBool:
            give_operator(cls, 'pow', ops.POWER)
            cls.__pow__ = power
            give_method(cls, '__abs__', ops.ABSOLUTE)
            give_method(cls, '__neg__', ops.NEGATE)
        cls.__divmod__, cls.__rdivmod__ = floor_and_rest, reflected_floor_and_rest
        cls.__round__ = rounded
        cls.__pos__ = cls.conjugate = itself
        cls.real = property(itself)
        for name, row in (
            ('__trunc__', ops.TRUNCATE),
            ('__floor__', ops.FLOOR),
            ('__ceil__', ops.CEIL),
        ):
            give_method(cls, name, row)
        for row in BY_CODE.values():
            for name in row.numpy if row.precedence == FUNCTION else ():
                give_method(cls, name, row)
        cls.__array_ufunc__ = array_ufunc(apply)
    give_method(TrackedBool, '__pos__', ops.TRUNCATE)
    TrackedBool.real = TrackedBool.numerator = property(TrackedBool.__pos__)  # type: ignore[assignment]
    TEXT.__add__, TEXT.__radd__ = joined, joined_behind
    TEXT.__mul__ = TEXT.__rmul__ = text_repeated
    for tracked in TRACKED:
        for name in ('__copy__', '__deepcopy__'):
            setattr(tracked, name, itself)
        tracked.__reduce_ex__ = as_instructions


give_all()
