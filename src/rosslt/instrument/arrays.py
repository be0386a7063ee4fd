"""NumPy arrays whose elements keep provenance.

An `ArrayWithProvenance` is an ordinary array of floats or ints: all that computes with it gets the numbers that it
would get without provenance, to the last bit. Beside them stands an array of objects of the same shape, the tracked
values, None where an element has no provenance. Views share it as they share the numbers. An element is read as its
tracked value if that still has the number which stands in the array; where something has written to the numbers past
this class, it has lost its provenance, and nothing else.

An element of an array of 32 or 8 bits is read as NumPy's own `float32` or `int8`, since that computes in as many bits:
the first with provenance (`array_numbers`), the second without. In a message, and in a list that is made of the array,
it is a Python number, and has its provenance.
"""

import math
import operator
from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import (
    CLASSES,
    NUMPY_NUMBERS,
    ROUNDING,
    ROUNDING_32,
    TRACKED,
    WITH_PROVENANCE,
    python_number,
    same_number,
    with_tracked,
)

#: Larger arrays are data, of which no single number is tracked.
LARGEST = 1024

#: The types of arrays that have provenance: floats of 64 and 32 bits, ints of 64, and of 8 as the cells of maps are.
TYPES = 'dflqb'
#: The types of arrays whose elements are read with provenance.
_READ = 'dflq'


def _product(a: Any, b: Any) -> Any:
    """A product, without provenance where it is 0 whatever the other factor is: most of a matrix is such."""
    if (type(a) not in TRACKED and a == 0) or (type(b) not in TRACKED and b == 0):
        return 0.0
    return a * b


#: Operations on tracked numbers, by the name of the ufunc.
_OPERATORS: Dict[str, Callable[..., Any]] = {
    'multiply': _product,
    'add': operator.add,
    'subtract': operator.sub,
    'divide': operator.truediv,
    'true_divide': operator.truediv,
    'floor_divide': operator.floordiv,
    'remainder': operator.mod,
    'power': operator.pow,
    'float_power': operator.pow,
    'negative': operator.neg,
    'positive': operator.pos,
    'absolute': abs,
    'square': lambda x: x * x,
    'reciprocal': lambda x: 1 / x,
    'maximum': lambda a, b: a if a >= b else b,
    'minimum': lambda a, b: a if a <= b else b,
    'fmax': lambda a, b: a if a >= b else b,
    'fmin': lambda a, b: a if a <= b else b,
    'deg2rad': values.MATH['radians'],
    'rad2deg': values.MATH['degrees'],
    'arcsin': values.MATH['asin'],
    'arccos': values.MATH['acos'],
    'arctan': values.MATH['atan'],
    'arctan2': values.MATH['atan2'],
    'arcsinh': values.MATH['asinh'],
    'arccosh': values.MATH['acosh'],
    'arctanh': values.MATH['atanh'],
}
_SAME_NAMES = (
    'sin',
    'cos',
    'tan',
    'sinh',
    'cosh',
    'tanh',
    'exp',
    'expm1',
    'log',
    'log2',
    'log10',
    'log1p',
    'sqrt',
    'hypot',
    'degrees',
    'radians',
    'fabs',
    'copysign',
    'fmod',
    'floor',
    'ceil',
    'trunc',
)
_OPERATORS.update((name, values.MATH[name]) for name in _SAME_NAMES if name in values.MATH)


def _float_of(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that rounds, as NumPy has it: it gives a float."""
    return lambda x: values.to_float(function(x))


_OPERATORS.update((name, _float_of(values.MATH[name])) for name in ('floor', 'ceil', 'trunc'))

_SUMMED = {name: numpy.frompyfunc(_OPERATORS[name], 2, 1) for name in ('add', 'multiply', 'maximum', 'minimum')}
_IN_LINE = {'matmul'}


class ArrayWithProvenance(numpy.ndarray):
    """An array of floats or ints with the provenance of its elements. Made by `with_provenance` and by arithmetic.

    `array_writing` completes it with the other ways to write to it, `array_functions` with NumPy's functions.
    """

    __class__: Any = property(lambda self: numpy.ndarray)
    _beside: Optional[numpy.ndarray] = None

    def __array_finalize__(self, original: Any) -> None:
        self._beside = None

    @property
    def has_provenance(self) -> bool:
        """True if any element may have provenance."""
        return self._beside is not None

    def _made_beside(self) -> numpy.ndarray:
        if self._beside is None:
            self._beside = numpy.empty(self.shape, dtype=object)
        return self._beside

    def write_beside(self, beside: Any) -> None:
        """Give the elements other provenance, in all views of them."""
        if isinstance(beside, numpy.ndarray) and beside.shape == self.shape:
            self._made_beside()[...] = beside
        elif self._beside is not None:
            self._beside[...] = None

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        beside = self._beside
        if isinstance(found, ArrayWithProvenance):
            if beside is None:
                # What is written to a view must be seen here as well.
                beside = self._made_beside()
            part = beside[_plain_key(key)]
            found._beside = part if part.shape == found.shape else None
            return found
        if beside is None or self.dtype.char not in _READ:
            return found
        return with_tracked(found, beside[_plain_key(key)])

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(key, plain_operand(value))
        beside = provenance_of(value)
        if beside is not None:
            self._made_beside()[_plain_key(key)] = beside
        elif self._beside is not None:
            self._beside[_plain_key(key)] = None

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return compute(ufunc, method, inputs, options)

    def __copy__(self) -> 'ArrayWithProvenance':
        return self.copy('K')

    def __deepcopy__(self, _: Any) -> 'ArrayWithProvenance':
        return self.copy('K')

    def __reduce_ex__(self, protocol: Any) -> Any:
        return self.view(numpy.ndarray).__reduce_ex__(protocol)

    def copy(self, order: Any = 'C') -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        return with_provenance(
            self.view(numpy.ndarray).copy(order), None if self._beside is None else self._beside.copy()
        )

    def __repr__(self) -> str:
        return repr(self.view(numpy.ndarray))

    def tolist(self) -> Any:
        """Override the method of `numpy.ndarray`: tracked elements become tracked numbers."""
        if self._beside is None:
            return super().tolist()
        if not self.ndim:
            return self._number(super().tolist(), self._beside[()])
        if self.ndim == 1:
            return [self._number(*pair) for pair in zip(super().tolist(), self._beside)]
        return [part.tolist() for part in self]

    def item(self, *place: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        found = super().item(*place)
        return found if self._beside is None else self._number(found, self._beside.item(*place))

    def _number(self, number: Any, tracked: Any) -> Any:
        """Return an element as a Python number, with its provenance if the tracked value equals it."""
        return same_number(number, tracked, ROUNDING_32 if self.dtype.char == 'f' else ROUNDING)

    def astype(self, dtype: Any, *arguments: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        made = self.view(numpy.ndarray).astype(dtype, *arguments, **options)
        return with_provenance(made, self._beside)

    def fill(self, value: Any) -> None:
        """Override the method of `numpy.ndarray` to keep provenance."""
        self[...] = value

    def _called(self, name: str, *arguments: Any, **options: Any) -> Any:
        return getattr(numpy, name)(self, *arguments, **options)

    @property
    def T(self) -> Any:  # noqa: N802 (NumPy's name)
        """Override the method of `numpy.ndarray` to keep provenance."""
        return numpy.transpose(self)

    def reshape(self, *shape: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        return numpy.reshape(self, shape[0] if len(shape) == 1 else shape, **options)

    def transpose(self, *axes: Any) -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        return numpy.transpose(self, *([axes] if len(axes) > 1 else axes))

    def clip(self, *bounds: Any, **options: Any) -> Any:
        """Override the method of `numpy.ndarray`, which takes one bound alone, too."""
        low = options.pop('min', bounds[0] if bounds else None)
        high = options.pop('max', bounds[1] if len(bounds) > 1 else None)
        return numpy.clip(self, low, high, *bounds[2:], **options)

    def flatten(self, order: Any = 'C') -> Any:
        """Override the method of `numpy.ndarray` to keep provenance."""
        return numpy.ravel(self, order).copy()


def _method(name: str) -> Callable[..., Any]:
    def method(self: ArrayWithProvenance, *arguments: Any, **options: Any) -> Any:
        return self._called(name, *arguments, **options)

    method.__name__ = name
    return method


_METHODS = (
    'cumsum',
    'cumprod',
    'diagonal',
    'dot',
    'ravel',
    'repeat',
    'squeeze',
    'swapaxes',
    'take',
    'trace',
    'mean',
    'round',
)
for _name in _METHODS:
    setattr(ArrayWithProvenance, _name, _method(_name))


#: The types of operands whose elements can be read without side effects.
_OPERANDS = (numpy.ndarray, numpy.generic, list, tuple, float, int)
#: The classes of what is computed element by element.
ARRAYS = frozenset({numpy.ndarray, ArrayWithProvenance, list, tuple})


def with_provenance(array: Any, beside: Optional[numpy.ndarray]) -> Any:
    """An array with its provenance beside it; as it is where it can have none.

    Args:
        array: a plain array, or a scalar.
        beside: the tracked values, of the same shape, None where there is none.
    """
    if not isinstance(array, numpy.ndarray):
        tracked = beside[()] if isinstance(beside, numpy.ndarray) else beside
        return with_tracked(array, tracked)
    if type(array) not in ARRAYS or array.dtype.char not in TYPES or array.size > LARGEST:
        return array
    made = array.view(ArrayWithProvenance)
    if type(beside) in TRACKED and not array.ndim:
        made._made_beside()[()] = beside
    elif isinstance(beside, numpy.ndarray) and beside.shape == array.shape:
        made._beside = beside
    return made


def provenance_of(value: Any) -> Any:
    """The tracked values in what an array may be made from: one, an array of them with None in between, or None."""
    kind = type(value)
    if kind in TRACKED:
        return value
    if kind is ArrayWithProvenance:
        return value._beside
    if kind in NUMPY_NUMBERS:
        return value.tracked
    if kind in (list, tuple) and any_tracked(value):
        elements = list(_flat(value))
        if len(elements) == len(value):
            beside = numpy.empty(len(elements), dtype=object)
            beside[:] = [python_number(one) if type(one) in WITH_PROVENANCE else None for one in elements]
            return beside
        try:
            shape = numpy.shape(plain_operand(value))
        except ValueError:  # lists of several lengths
            return None
        beside = numpy.empty(len(elements), dtype=object)
        for index, element in enumerate(elements):
            if type(element) in WITH_PROVENANCE:
                beside[index] = python_number(element)
        return beside.reshape(shape) if beside.size == int(numpy.prod(shape)) else None
    return None


def any_tracked(value: Any) -> bool:
    """Return whether any element of a list, at any depth, has provenance."""
    for part in value:
        kind = type(part)
        if kind in WITH_PROVENANCE or (kind in (list, tuple) and any_tracked(part)):
            return True
        if kind is ArrayWithProvenance and part._beside is not None:
            return True
    return False


def _flat(value: Any) -> Iterable[Any]:
    for part in value:
        if isinstance(part, (list, tuple)):
            yield from _flat(part)
        elif isinstance(part, ArrayWithProvenance):
            whole = part.tolist()
            yield from _flat(whole) if isinstance(whole, list) else [whole]
        elif isinstance(part, numpy.ndarray):
            yield from part.ravel()
        else:
            yield part


def plain_operand(value: Any) -> Any:
    """Return an operand without provenance: a plain number, a plain array, or a list of these."""
    if type(value) in TRACKED:
        return value._plain
    if type(value) is ArrayWithProvenance:
        return value.view(numpy.ndarray)
    if type(value) in NUMPY_NUMBERS:
        return value.plain
    if type(value) in (list, tuple):
        return [plain_operand(part) for part in value]
    return value


def _plain_key(key: Any) -> Any:
    if type(key) is tuple:
        return tuple(_plain_key(part) for part in key)
    return key.view(numpy.ndarray) if type(key) is ArrayWithProvenance else key


def compute(ufunc: Any, method: str, inputs: Tuple[Any, ...], options: Dict[str, Any]) -> Any:
    """Call a ufunc: the result has NumPy's own numbers, with the provenance of the operands."""
    plain = [plain_operand(one) for one in inputs]
    if method == '__call__' and not options and ARRAYS.isdisjoint(map(type, inputs)):
        number = ufunc(*plain)
        if type(number) not in CLASSES or ufunc.__name__ not in _OPERATORS:
            return number
        return with_tracked(number, _of_tracked(_OPERATORS[ufunc.__name__], tuple(map(python_number, inputs))))
    out = options.get('out')
    if out is not None:
        options = dict(options, out=tuple([plain_operand(one) for one in out]))
    # The provenance is read first: an operation with `out` may overwrite its operands.
    besides = [provenance_of(one) for one in inputs]
    beside = None
    if any(one is not None for one in besides) and method != 'at':
        beside = _computed(ufunc, method, plain, besides, options)
    result = getattr(ufunc, method)(*plain, **options)
    if out is not None:
        for one in out:
            if isinstance(one, ArrayWithProvenance):
                one.write_beside(beside if len(out) == 1 else None)
        written = {id(plain_one): one for one, plain_one in zip(out, options['out'])}
        return tuple([written.get(id(one), one) for one in result]) if len(out) > 1 else written.get(id(result), result)
    return result if beside is None or isinstance(result, tuple) else with_provenance(result, beside)


def _computed(ufunc: Any, method: str, plain: List[Any], besides: List[Any], options: Dict[str, Any]) -> Any:
    name = ufunc.__name__
    kept = {key: value for key, value in options.items() if key != 'out'}
    if not all(isinstance(one, _OPERANDS) for one in plain):
        return None
    try:
        if method == '__call__' and not kept and name in _OPERATORS:
            return each(_OPERATORS[name], plain, besides)
        if max(map(numpy.size, plain)) > LARGEST:
            return None
        if method == 'reduce' and name in _SUMMED:
            if kept.pop('where', True) is not True or not set(kept) <= {'axis', 'keepdims', 'dtype'}:
                return None  # NumPy leaves elements out, or begins with another number
            objects = filled(plain[0], besides[0])
            kept.pop('dtype', None)
            return only_tracked(_SUMMED[name].reduce(objects, **kept))
        if method == '__call__' and not kept and name in _IN_LINE:
            return only_tracked(numpy.dot(filled(plain[0], besides[0]), filled(plain[1], besides[1])))
    except (ArithmeticError, ValueError, TypeError):
        pass
    return None


def each(function: Callable[..., Any], plain: List[Any], besides: List[Any]) -> Any:
    """A function of numbers on each element: what it gives where one of them is tracked, None elsewhere and of large
    arrays."""
    shape = numpy.broadcast(*plain).shape
    if math.prod(shape) > LARGEST:
        return None
    columns = [_column(one, beside, shape) for one, beside in zip(plain, besides)]
    made = [_of_tracked(function, operands) for operands in zip(*columns)]
    if not shape:
        return made[0]
    found = numpy.empty(len(made), dtype=object)
    found[:] = made
    return found.reshape(shape)


def _column(plain: Any, beside: Any, shape: Tuple[int, ...]) -> List[Any]:
    """The elements of an operand that is broadcast, tracked where they have provenance."""
    if type(plain) not in ARRAYS:
        return [python_number(plain) if beside is None else beside] * math.prod(shape)
    array = numpy.asarray(plain)
    if array.shape != shape:
        array = numpy.broadcast_to(array, shape)
        beside = beside if beside is None else numpy.broadcast_to(_boxed(beside), shape)
    numbers: List[Any] = array.ravel().tolist()
    if beside is None:
        return numbers
    return [number if one is None else one for number, one in zip(numbers, _boxed(beside).ravel().tolist())]


def _boxed(beside: Any) -> Any:
    if isinstance(beside, numpy.ndarray):
        return beside
    box = numpy.empty((), dtype=object)
    box[()] = beside
    return box


def _of_tracked(function: Callable[..., Any], operands: Tuple[Any, ...]) -> Any:
    """Call a function; return its result if an operand and the result are tracked, None otherwise."""
    if not TRACKED.isdisjoint(map(type, operands)):
        try:
            return _only_tracked(function(*operands))
        except (ArithmeticError, ValueError, TypeError):
            return None
    return None


def filled(plain: Any, beside: Any) -> numpy.ndarray:
    """An array of objects: the tracked values, and the plain ones where there is none."""
    if type(beside) in TRACKED:
        return _boxed(beside)
    objects = numpy.asarray(plain).astype(object)
    if beside is not None:
        flat, tracked = objects.reshape(-1), beside.reshape(-1)
        for index in range(flat.size):
            if tracked[index] is not None:
                flat[index] = tracked[index]
        objects = flat.reshape(objects.shape)
    return objects


def _only_tracked(value: Any) -> Any:
    return python_number(value) if type(value) in WITH_PROVENANCE else None


_EACH_ONLY_TRACKED = numpy.frompyfunc(_only_tracked, 1, 1)


def only_tracked(objects: Any) -> Any:
    """An array of objects with None for each element that is not tracked."""
    if not isinstance(objects, numpy.ndarray):
        return _only_tracked(objects)
    return _EACH_ONLY_TRACKED(objects)
