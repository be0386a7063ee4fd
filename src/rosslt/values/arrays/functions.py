"""NumPy's functions, keeping provenance: those that need a version of their own, and a wrapper for all others."""

import functools
from typing import Any, Callable, Dict, List

import numpy as np

from ..numpy_ufuncs import boxed
from ..tracked import TRACKED, plain
from . import linear_algebra  # noqa: F401, registers its functions
from .statistics import corrcoef, cov
from .tracked_array import (
    REPLACEMENTS,
    TrackedArray,
    array,
    each,
    holds_tracked,
    plain_array,
    replaces,
    unwrapped,
    wrapped,
)

MAX_STORED = 4096
"""`zeros`, `ones` and their like make arrays that take tracked values up to this many elements: a pose, a matrix or a
list of waypoints, but no image."""


NUMPY_LINSPACE: Any = np.linspace  # whose annotations leave out what it is given here


def keeping_provenance(function: Callable[..., Any]) -> Callable[..., Any]:
    """NumPy's function as one that keeps provenance: arguments that hold tracked values become `TrackedArray`s.

    Without such arguments it is NumPy's function itself that is called.
    """

    replacement = REPLACEMENTS.get(function, function)

    @functools.wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        if not any(map(holds_tracked, args)) and not any(map(holds_tracked, kwargs.values())):
            return function(*args, **kwargs)
        result = wrapped(replacement(*map(as_array, args), **{key: as_array(part) for key, part in kwargs.items()}))
        return result[()] if isinstance(result, TrackedArray) and result.shape == () else result

    return called


def as_array(x: Any) -> Any:
    """A value that holds tracked ones as a `TrackedArray`; lists of arrays stay lists."""
    if isinstance(x, (list, tuple)) and any(isinstance(part, np.ndarray) for part in x):
        return type(x)(as_array(part) for part in x)
    return array(x) if holds_tracked(x) else x


def storage(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes an array of floats as one that makes an array which takes tracked values."""

    @functools.wraps(function)
    def made(*args: Any, **kwargs: Any) -> Any:
        result = function(*args, **kwargs)
        if result.dtype != np.float64 or result.size > MAX_STORED:
            return result
        return result.astype(object).view(TrackedArray)

    return made


def full(shape: Any, fill_value: Any, dtype: Any = None, order: str = 'C') -> Any:
    """numpy.full, keeping provenance."""
    if not holds_tracked(fill_value):
        return storage(np.full)(shape, fill_value, dtype, order)
    result = np.empty(shape, object)
    result[...] = unwrapped(array(fill_value))
    return result.view(TrackedArray)


def arange(*args: Any, **kwargs: Any) -> Any:
    """numpy.arange, keeping provenance; how many elements there are stays."""
    present = np.arange(*map(plain, args), **each(plain, kwargs))
    names = ('stop',) if len(args) == 1 and 'stop' not in kwargs else ('start', 'stop', 'step')
    given = {**kwargs, **dict(zip(names, args))}
    start, step = given.get('start', 0), given.get('step', 1)
    if not holds_tracked((start, step)):
        return present
    return array([start + place * step for place in range(len(present))]) if len(present) else present


def linspace(
    start: Any, stop: Any, num: int = 50, endpoint: bool = True, retstep: bool = False, dtype: Any = None, axis: int = 0
) -> Any:
    """numpy.linspace, keeping provenance."""
    if not holds_tracked((start, stop)):
        return NUMPY_LINSPACE(start, stop, num, endpoint, retstep, dtype, axis)
    start, stop = (array(end) if isinstance(end, (list, tuple)) else end for end in (start, stop))
    intervals = num - 1 if endpoint else num
    step = (stop - start) / intervals if intervals > 0 else np.nan
    points: List[Any] = [start + place * step if place else start + 0.0 for place in range(num)]
    if endpoint and num > 1:
        points[-1] = stop + 0.0
    result = np.stack(points, axis) if isinstance(step, np.ndarray) else array(points)
    return (result, step) if retstep else result


@replaces(np.interp)
def interp(x: Any, xp: Any, fp: Any, left: Any = None, right: Any = None, period: Any = None) -> Any:
    """numpy.interp, keeping provenance: of the point, and of the points between which it lies."""
    if not holds_tracked((x, xp, fp, left, right)):
        return np.interp(x, xp, fp, left, right, period)
    known, values = ([x if type(x) in TRACKED else float(x) for x in np.ravel(unwrapped(array(of)))] for of in (xp, fp))
    if len(known) != len(values):
        raise ValueError('fp and xp are not of the same length.')
    if period is not None:
        period = abs(period)
        x, known = (
            np.mod(array(x), period) if isinstance(x, (list, np.ndarray)) else x % period,
            [a % period for a in known],
        )
        order = sorted(range(len(known)), key=known.__getitem__)
        known, values = [known[place] for place in order], [values[place] for place in order]
        known = [known[-1] - period, *known, known[0] + period]
        values = [values[-1], *values, values[0]]
    inner = [float(a) for a in known]

    def at(point: Any) -> Any:
        if point != point:
            return point
        place = int(np.searchsorted(inner, float(point), side='right')) - 1
        if place < 0:
            return values[0] if left is None else left
        if point > inner[-1]:
            return values[-1] if right is None else right
        if place == len(inner) - 1:
            return values[-1]
        slope = (values[place + 1] - values[place]) / (known[place + 1] - known[place])
        found = values[place] + (point - known[place]) * slope
        if found == found:
            return found
        # Beside an infinite value, as NumPy: at a point its value, else what the line from the next one gives.
        return values[place] if point == known[place] else values[place + 1] + (point - known[place + 1]) * slope

    if not isinstance(x, (list, tuple, np.ndarray)):
        return at(x)
    points = unwrapped(array(x))
    return array([at(point) for point in points.flat]).reshape(points.shape)


@replaces(np.einsum)
def einsum(subscripts: str, *operands: Any, **options: Any) -> Any:
    """numpy.einsum, keeping provenance; an ellipsis and operands in a list form give plain results."""
    if not holds_tracked(operands):
        return np.einsum(subscripts, *operands, **options)
    if not isinstance(subscripts, str) or '.' in subscripts:
        return np.einsum(subscripts, *map(plain_array, operands), **options)
    given, arrow, result = subscripts.replace(' ', '').partition('->')
    terms = given.split(',')
    if not arrow:
        result = ''.join(sorted(label for label in set(given) - {','} if given.count(label) == 1))
    labels = result + ''.join(sorted(set(given) - set(result) - {','}))
    product: Any = None
    for term, operand in zip(terms, operands):
        factor = unwrapped(array(operand)).astype(object)
        for label in sorted(set(term)):
            while term.count(label) > 1:  # a label met twice is a diagonal, whose axis comes last
                first, second = term.index(label), term.index(label, term.index(label) + 1)
                factor = np.diagonal(factor, 0, first, second)
                term = term[:first] + term[first + 1 : second] + term[second + 1 :] + label
        factor = factor.transpose(sorted(range(len(term)), key=lambda axis: labels.index(term[axis])))
        factor = factor.reshape(
            [factor.shape[sorted(term, key=labels.index).index(one)] if one in term else 1 for one in labels]
        )
        product = factor if product is None else product * factor
    return np.sum(product, axis=tuple(range(len(result), len(labels)))) if len(labels) > len(result) else product


@replaces(np.cross)
def cross(a: Any, b: Any, axisa: int = -1, axisb: int = -1, axisc: int = -1, axis: Any = None) -> Any:
    """numpy.cross, keeping provenance."""
    if not holds_tracked((a, b)):
        return np.cross(a, b, axisa, axisb, axisc, axis)
    if axis is not None:
        axisa = axisb = axisc = axis
    a, b = (np.moveaxis(unwrapped(array(x)).astype(object), at, -1) for x, at in ((a, axisa), (b, axisb)))
    if not {a.shape[-1], b.shape[-1]} <= {2, 3}:
        raise ValueError('incompatible dimensions for cross product\n(dimension must be 2 or 3)')
    (a0, a1, a2), (b0, b1, b2) = ([*np.moveaxis(x, -1, 0), 0][:3] for x in (a, b))
    if a.shape[-1] == b.shape[-1] == 2:
        return a0 * b1 - a1 * b0
    parts = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    result = np.empty((*np.broadcast(*[boxed(np, part) for part in parts]).shape, 3), object)
    for place, part in enumerate(parts):
        result[..., place] = part
    return np.moveaxis(result, -1, axisc)


@replaces(np.polyval)
def polyval(p: Any, x: Any) -> Any:
    """numpy.polyval, keeping provenance."""
    x = unwrapped(array(x)).astype(object)
    return functools.reduce(lambda total, coefficient: total * x + coefficient, list(p), 0 * x)


@replaces(np.median)
def median(a: Any, axis: Any = None, *args: Any, **kwargs: Any) -> Any:
    """numpy.median, keeping provenance: that of the middle element, or of the two, or of a NaN, which is the median of
    what it is among."""
    if args or kwargs or not holds_tracked(a):
        return np.median(plain_array(array(a)), axis, *args, **kwargs)
    ordered = np.sort(unwrapped(array(a)), axis=axis)
    ordered = ordered if axis is None else np.moveaxis(ordered, axis, 0)
    middle = len(ordered) // 2
    result = ordered[middle] + 0.0 if len(ordered) % 2 else (ordered[middle - 1] + ordered[middle]) / 2
    is_nan = np.frompyfunc(lambda x: x != x, 1, 1)(ordered).astype(bool)
    if not is_nan.any():
        return result
    nans = np.take_along_axis(ordered, np.argmax(is_nan, axis=0)[None], 0)[0]
    return np.where(is_nan.any(axis=0), nans, result) if isinstance(result, np.ndarray) else nans


@replaces(np.round, np.around)
def around(a: Any, decimals: int = 0, out: Any = None) -> Any:
    """numpy.round, keeping provenance."""
    if out is not None or not holds_tracked(a):
        return np.around(plain_array(array(a)), decimals, out)
    return np.frompyfunc(lambda x: round(x, decimals), 1, 1)(boxed(np, unwrapped(array(a))))


@replaces(np.clip)
def clip(a: Any, a_min: Any, a_max: Any, *args: Any, **kwargs: Any) -> Any:
    """numpy.clip, keeping provenance: of the number itself, or of the end that it is set to."""
    if args or kwargs or not holds_tracked((a, a_min, a_max)):
        return np.clip(each(plain_array, a), plain_array(a_min), plain_array(a_max), *args, **kwargs)

    def at(value: Any, low: Any, high: Any) -> Any:
        value = low if low is not None and value < low else value
        return high if high is not None and value > high else value

    return np.frompyfunc(at, 3, 1)(*[boxed(np, unwrapped(operand)) for operand in (a, a_min, a_max)])


@replaces(np.where)
def where(condition: Any, *choices: Any) -> Any:
    """numpy.where, keeping provenance."""
    condition = plain_array(array(condition))
    return np.where(condition, *[boxed(np, unwrapped(choice)) for choice in choices])


def question(name: str) -> Callable[..., Any]:
    """A ufunc that is a predicate of numbers; its result is plain."""
    ufunc = getattr(np, name)

    @functools.wraps(ufunc)
    def asked(x: Any, *args: Any, **kwargs: Any) -> Any:
        return ufunc(plain_array(array(x)) if holds_tracked(x) else x, *args, **kwargs)

    return asked


def _functions() -> Dict[str, Any]:
    """`{name: function}`, and the same for the names of `numpy.linalg` with that in front of them."""
    made: Dict[str, Any] = {
        name: keeping_provenance(getattr(np, name))
        for name in [*np.__all__, 'abs', 'max', 'min']  # these three are not in all lists of NumPy's names
        if callable(getattr(np, name, None)) and not isinstance(getattr(np, name), type)
    }
    made.update({name: storage(getattr(np, name)) for name in ('zeros', 'ones', 'empty', 'identity', 'eye')})
    made.update({name: question(name) for name in ('isfinite', 'isnan', 'isinf', 'signbit')})
    own = (array, full, arange, linspace, interp, einsum, cross, median, polyval, around, clip, where, cov, corrcoef)
    made.update({function.__name__: wrapping(function) for function in own})
    made['asarray'] = made['asanyarray'] = made['array']
    made['round'] = made['around']
    for name in np.linalg.__all__:
        made['linalg.' + name] = keeping_provenance(getattr(np.linalg, name))
    return made


def wrapping(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of this module whose object arrays are `TrackedArray`s, and whose scalars are none."""

    @functools.wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        result = wrapped(function(*args, **kwargs))
        return (
            result[()] if isinstance(result, TrackedArray) and result.shape == () and function is not array else result
        )

    return called


FUNCTIONS = _functions()
"""NumPy's public functions by name (`dot`, `linalg.inv`), each keeping provenance. What has no version here that does,
and takes no objects (`fft`, `linalg.eig`, `linalg.svd`), gets the plain numbers and gives plain results."""
