"""Tracked values in NumPy's arithmetic. NumPy itself is only used once the caller brings an array or a ufunc.

The tracked numbers define `__array_ufunc__` (NEP 13), so NumPy hands them its operators and functions: `np.sin(x)`,
`array * x`, `np.float32(2) * x`. One case it does not hand on: since NumPy 1.23 the operators of `np.float64` compute
at once with a subclass of float, so `np.float64(2) * x` is plain (docs/values.md says what to do).

Arrays of objects hold tracked numbers themselves, and NumPy computes with them element by element. All others are
computed by `arrays`.
"""

import sys
from typing import Any, Callable, List

from .operations import BY_CODE, Operation
from .tracked import plain

BY_UFUNC = {name: row for row in BY_CODE.values() for name in row.numpy}

#: The ufuncs without a row that NumPy computes of objects by arithmetic, or by choosing one. The others compare,
#: count or look at bits, and give plain results.
ON_OBJECTS = frozenset(
    ('conjugate', 'fmax', 'fmin', 'matmul', 'maximum', 'minimum', 'positive', 'reciprocal', 'square')
)


def is_array(x: Any) -> bool:
    """Return True if `x` is a NumPy array, or a number of NumPy with provenance; does not import NumPy."""
    return hasattr(x, '__array_ufunc__') and is_of_numpy(x)


def is_of_numpy(x: Any) -> bool:
    """Return True if `x` is a NumPy array or number, whose operators give NumPy's: `x / np.float64(0)` is infinite."""
    return hasattr(x, 'dtype') and hasattr(x, 'astype')


LOADERS: List[Callable[[], Any]] = []
"""The function that loads `arrays`, which imports this file; the room says it."""


def compute(ufunc: Any, method: str, operands: Any, options: Any) -> Any:
    """Call a ufunc with tracked numbers among its operands: see `arrays.calling.compute`."""
    return LOADERS[0]().compute(ufunc, method, operands, options)


def _has_objects(operands: Any) -> bool:
    return any(is_array(operand) and operand.dtype == object for operand in operands)


def broadcast(apply: Callable[..., Any], operation: Operation, *operands: Any) -> Any:
    """An operation on each element of arrays, broadcast as in NumPy: an array, or a number."""
    numpy = sys.modules['numpy']
    if operation.numpy and not _has_objects(operands):
        return compute(getattr(numpy, operation.numpy[0]), '__call__', operands, {})
    if operation.numpy and any(numpy.iscomplexobj(operand) for operand in operands):
        return getattr(numpy, operation.numpy[0])(*[plain(operand) for operand in operands])

    def computed(*scalars: Any) -> Any:
        result = apply(operation, *scalars)
        # Of a complex number among objects, for instance, nothing is recorded.
        return operation.forward(*[plain(scalar) for scalar in scalars]) if result is NotImplemented else result

    each = numpy.frompyfunc(computed, len(operands), 1)
    return each(*[boxed(numpy, operand) for operand in operands])


def boxed(numpy: Any, operand: Any) -> Any:
    """An operand as an object array, in which a tracked scalar stays itself."""
    if is_array(operand) and operand.shape:
        return numpy.array(operand.tolist(), dtype=object).reshape(operand.shape)
    if isinstance(operand, (list, tuple)):
        return numpy.array(operand, dtype=object)
    box = numpy.empty((), dtype=object)
    # A scalar of NumPy would hand its operators back to the ufunc that is computed here, without end.
    box[()] = operand.item() if is_array(operand) else operand
    return box


def array_ufunc(apply: Callable[..., Any]) -> Callable[..., Any]:
    """The method that NumPy calls for a ufunc with a tracked scalar among its operands."""

    def called(self: Any, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if not _has_objects(inputs):
            return compute(ufunc, method, inputs, options)
        numpy = sys.modules['numpy']
        row = BY_UFUNC.get(ufunc.__name__)
        if method != 'at' and (row is not None or ufunc.__name__ in ON_OBJECTS):
            try:
                if row is not None and row.arity == len(inputs) and method == '__call__' and not options:
                    return broadcast(apply, row, *inputs)
                return getattr(ufunc, method)(*[boxed(numpy, operand) for operand in inputs], **options)
            except TypeError:
                # A plain array to write to cannot hold provenance.
                pass
        return getattr(ufunc, method)(*[plain(operand) for operand in inputs], **options)

    return called
