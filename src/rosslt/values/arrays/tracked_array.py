"""An array that may hold tracked values and that NumPy's own functions work on.

A plain object array holds tracked values too, but NumPy refuses to invert it or to ask whether it is finite.
`TrackedArray` is an object array that takes part in NumPy's two documented protocols: `__array_ufunc__` (NEP 13) for
ufuncs and operators, `__array_function__` (NEP 18) for all other functions. Where a function knows no objects and has
no version here that keeps provenance, it gets the plain numbers, and the result is plain.
"""

from typing import Any, Callable, Dict, Iterable, Mapping

import numpy as np

from ..numpy_ufuncs import BY_UFUNC, broadcast
from ..recording import apply
from ..tracked import TRACKED, plain

REPLACEMENTS: Dict[Any, Callable[..., Any]] = {}
"""`{NumPy's function: the function that keeps provenance}`; see `replaces`."""


def replaces(*functions: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function that stands for NumPy's functions where one of their arguments is a `TrackedArray`."""

    def register(replacement: Callable[..., Any]) -> Callable[..., Any]:
        REPLACEMENTS.update(dict.fromkeys(functions, replacement))
        return replacement

    return register


class TrackedArray(np.ndarray):
    """An object array whose elements may be tracked values; made by `array`, and by slicing and arithmetic."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        row = BY_UFUNC.get(ufunc.__name__)
        if row is not None and row.arity == len(inputs) and method == '__call__' and not options:
            return wrapped(broadcast(apply, row, *[unwrapped(operand) for operand in inputs]))
        function = getattr(ufunc, method)
        return with_objects_or_plain(function, inputs, options)

    def __array_function__(
        self, func: Any, types: Iterable[Any], args: Iterable[Any], kwargs: Mapping[str, Any]
    ) -> Any:
        replacement = REPLACEMENTS.get(func)
        if replacement is not None:
            return wrapped(replacement(*args, **kwargs))
        return with_objects_or_plain(func, args, kwargs)

    def astype(self, dtype: Any, *args: Any, **kwargs: Any) -> Any:
        """The array with another type of elements; of any but objects a plain one."""
        return wrapped(unwrapped(self).astype(dtype, *args, **kwargs))

    def __reduce__(self) -> Any:
        return array, (self.tolist(),)


def with_objects_or_plain(function: Callable[..., Any], args: Iterable[Any], kwargs: Mapping[str, Any]) -> Any:
    """Call NumPy's function with object arrays; with plain numbers where it takes no objects."""
    try:
        result = function(*each(unwrapped, list(args)), **each(unwrapped, dict(kwargs)))
    except TypeError:
        # A predicate (isfinite), a computation in floats (fft), or an array of floats to write to.
        result = function(*each(plain_array, list(args)), **each(plain_array, dict(kwargs)))
    return wrapped(result)


def each(change: Callable[[Any], Any], x: Any) -> Any:
    """Arguments with `change` applied to the arrays and scalars among them, lists and tuples included."""
    if type(x) in (list, tuple):
        return type(x)(each(change, part) for part in x)
    if type(x) is dict:
        return {key: each(change, part) for key, part in x.items()}
    return change(x)


def unwrapped(x: Any) -> Any:
    """A `TrackedArray` as an ordinary object array that shares its elements; anything else as it is."""
    return x.view(np.ndarray) if isinstance(x, TrackedArray) else x


def wrapped(x: Any) -> Any:
    """An object array as a `TrackedArray` that shares its elements, also within a tuple or list."""
    if isinstance(x, (tuple, list)) and any(isinstance(part, np.ndarray) for part in x):
        return type(x)(*map(wrapped, x)) if hasattr(x, '_fields') else type(x)(map(wrapped, x))
    if not isinstance(x, np.ndarray):
        return x
    if x.dtype == object:
        return x.view(TrackedArray)
    return unwrapped(x)


def plain_array(x: Any) -> Any:
    """Tracked scalars and arrays of them as plain ones; an object array of numbers as an array of floats or ints."""
    if isinstance(x, np.ndarray) and x.dtype == object:
        return np.array([plain(element) for element in x.flat]).reshape(x.shape)
    return plain(x)


def holds_tracked(x: Any) -> bool:
    """Return True for a tracked value, and for a list, tuple or object array that holds one."""
    if type(x) in TRACKED:
        return True
    if isinstance(x, (list, tuple)):
        return any(map(holds_tracked, x))
    return isinstance(x, np.ndarray) and x.dtype == object and any(type(element) in TRACKED for element in x.flat)


def array(x: Any, dtype: Any = None, **options: Any) -> Any:
    """numpy.array, keeping provenance: a `TrackedArray` where `x` holds tracked values, else NumPy's array.

    Args:
        x: a scalar, list, tuple or array, nested as they may be.
        dtype: a type other than float and object gives a plain array.
        options: as numpy.array takes them.
    """
    if not holds_tracked(x) or dtype not in (None, float, np.float64, object):
        return np.array(each(unwrapped, x), dtype=dtype, **options)
    if isinstance(x, np.ndarray):
        return np.array(unwrapped(x), dtype=object, **options).view(TrackedArray)
    # The shape is that of the plain numbers; NumPy would look into what it takes for a sequence.
    shape = np.array(each(plain, x), dtype=object).shape
    result = np.empty(shape, object)
    result[...] = as_objects(x)
    return result.view(TrackedArray)


def as_objects(x: Any) -> Any:
    """Nested lists and arrays as nested lists of Python scalars, tracked ones as they are."""
    if isinstance(x, (list, tuple)):
        return [as_objects(part) for part in x]
    return x.tolist() if isinstance(x, (np.ndarray, np.generic)) else x
