"""NumPy's functions for arrays that keep provenance, and the `numpy` that a node's own code gets."""

import functools
from typing import Any, Callable, Dict, List, Tuple

import numpy

from rosslt import values
from rosslt.instrument import cells, functions, scalars
from rosslt.instrument.array_arguments import plain
from rosslt.instrument.array_makers import makers
from rosslt.instrument.array_numbers import CLASSES, TRACKED, WITH_PROVENANCE
from rosslt.instrument.array_writing import written_by
from rosslt.instrument.arrays import (
    LARGEST,
    ArrayWithProvenance,
    any_tracked,
    compute,
    each,
    filled,
    only_tracked,
    provenance_of,
    with_provenance,
)
from rosslt.instrument.losses import LOSSES

_sqrt = values.MATH['sqrt']


def _objects(x: Any) -> Any:
    """An argument with the tracked values in arrays of objects."""
    if isinstance(x, numpy.ndarray) or type(x) in WITH_PROVENANCE or (type(x) in (list, tuple) and any_tracked(x)):
        return filled(plain(x), provenance_of(x))
    return x


def _besides(x: Any) -> Any:
    """An argument with its provenance alone, in an array of objects with None elsewhere."""
    if isinstance(x, numpy.ndarray):
        beside = provenance_of(x)
        return beside if beside is not None else numpy.empty(x.shape, dtype=object)
    if type(x) in (list, tuple):
        if any(isinstance(part, numpy.ndarray) for part in x):
            return [_besides(part) for part in x]
        beside = provenance_of(x)
        return beside if beside is not None else numpy.empty(numpy.shape(x), dtype=object)
    return provenance_of(x)


def _moved(function: Any, arguments: Any, options: Any) -> Any:
    """Of a function that only puts elements elsewhere."""
    first = arguments[0]
    first = _beside_array(first) if type(first) in (list, tuple) else _besides(first)
    return function(first, *plain(list(arguments[1:])), **plain(options))


def _all_moved(function: Any, arguments: Any, options: Any) -> Any:
    """Of a function that puts the elements of several arrays elsewhere."""
    first = arguments[0]
    if function is numpy.block:
        return function(_beside_each(first))
    if type(first) in (list, tuple) and function not in (numpy.append, numpy.insert):
        return function([_beside_array(part) for part in first], *plain(list(arguments[1:])), **plain(options))
    places = arguments[1:2] if function is numpy.insert else ()
    rest = arguments[2:] if function is numpy.insert else arguments[1:]
    return function(_beside_array(first), *plain(list(places)), *map(_beside_array, rest), **plain(options))


def _beside_each(x: Any) -> Any:
    return [_beside_each(part) for part in x] if type(x) is list else _beside_array(x)


def _beside_array(x: Any) -> numpy.ndarray:
    """The provenance of a number, a list or an array, in an array of objects of its shape with None elsewhere."""
    made = numpy.empty(numpy.shape(plain(x)), dtype=object)
    beside = provenance_of(x)
    if beside is not None:
        made[...] = beside
    return made


def _added(function: Any, arguments: Any, options: Any) -> Any:
    """Of a function that adds and multiplies, which does so with objects too."""
    options = {key: value for key, value in options.items() if key not in ('dtype', 'out')}
    return only_tracked(function(*map(_objects, arguments), **plain(options)))


def _as_of_values(function: Any, arguments: Any, options: Any) -> Any:
    """Of a function for which the room `values` has one of arrays of tracked values."""
    made = values.numpy_functions()[function.__name__](*map(_objects, arguments), **plain(options))
    return only_tracked(numpy.asarray(made, dtype=object)) if numpy.ndim(made) else only_tracked(made)


def _product_of_several(function: Any, arguments: Any, options: Any) -> Any:
    """Of `numpy.linalg.multi_dot` and `matrix_power`."""
    first, *rest = arguments
    matrices = [_objects(one) for one in first] if function is numpy.linalg.multi_dot else [_objects(first)] * rest[0]
    return only_tracked(functools.reduce(numpy.dot, matrices)) if matrices else None


def _norm(function: Any, arguments: Any, options: Any) -> Any:
    axis = options.get('axis')
    if (len(arguments) > 1 and arguments[1] is not None) or options.get('ord') is not None:
        return None
    objects = _objects(arguments[0])
    if axis is None:
        return only_tracked(_sqrt(sum(part * part for part in objects.reshape(-1))))
    squares = numpy.add.reduce(objects * objects, axis=axis, keepdims=bool(options.get('keepdims')))
    return only_tracked(numpy.frompyfunc(_sqrt, 1, 1)(squares))


def _cross(function: Any, arguments: Any, options: Any) -> Any:
    if options or len(arguments) != 2:
        return None
    a, b = map(_objects, map(_as_array, arguments))
    if a.shape[-1:] != (3,) or b.shape[-1:] != (3,):
        return None
    a, b = numpy.broadcast_arrays(a, b)
    made = numpy.empty(a.shape, dtype=object)
    for place in range(3):
        one, other = (place + 1) % 3, (place + 2) % 3
        made[..., place] = a[..., one] * b[..., other] - a[..., other] * b[..., one]
    return only_tracked(made)


def _as_array(x: Any) -> Any:
    return x if isinstance(x, numpy.ndarray) or any_tracked(x) else numpy.asarray(x)


def _inverse(function: Any, arguments: Any, options: Any) -> Any:
    rows = _objects(arguments[0])
    if rows.ndim != 2 or rows.shape[0] > 6:
        return None
    size = rows.shape[0]
    return only_tracked(_solved(rows.tolist(), numpy.identity(size).tolist()))


def _solution(function: Any, arguments: Any, options: Any) -> Any:
    rows, right = (
        _objects(arguments[0]),
        _objects(numpy.asarray(arguments[1]) if isinstance(arguments[1], list) else arguments[1]),
    )
    if rows.ndim != 2 or rows.shape[0] > 6 or right.ndim > 2:
        return None
    columns = right.reshape(right.shape[0], -1).tolist()
    return only_tracked(_solved(rows.tolist(), columns)).reshape(right.shape)


def _solved(rows: List[List[Any]], right: List[List[Any]]) -> numpy.ndarray:
    """The solution of linear equations by elimination, the largest pivot first."""
    size = len(rows)
    table: List[Any] = [list(row) + list(other) for row, other in zip(rows, right)]
    for place in range(size):
        pivot = max(range(place, size), key=lambda row: abs(float(table[row][place])))
        table[place], table[pivot] = table[pivot], table[place]
        head = table[place][place]
        table[place] = [part / head for part in table[place]]
        for row in range(size):
            factor = table[row][place]
            if row != place and not (type(factor) not in TRACKED and factor == 0):
                table[row] = [part - factor * other for part, other in zip(table[row], table[place])]
    made = numpy.empty((size, len(right[0])), dtype=object)
    for place, solved in enumerate(table):
        made[place, :] = solved[size:]
    return made


def _determinant(function: Any, arguments: Any, options: Any) -> Any:
    rows = _objects(arguments[0])
    if rows.ndim != 2 or rows.shape[0] > 4:
        return None

    def minor(matrix: Any) -> Any:
        if len(matrix) == 1:
            return matrix[0][0]
        return sum(
            (-1) ** column * head * minor([row[:column] + row[column + 1 :] for row in matrix[1:]])
            for column, head in enumerate(matrix[0])
        )

    return only_tracked(minor(rows.tolist()))


def _clipped(function: Any, arguments: Any, options: Any) -> Any:
    x, low, high = (list(arguments) + [None, None])[:3]
    low, high = options.get('a_min', low), options.get('a_max', high)

    def clip(value: Any, least: Any, most: Any) -> Any:
        if least is not None and value < least:
            value = least
        return most if most is not None and value > most else value

    return each(clip, [plain(x), plain(low), plain(high)], [provenance_of(x), provenance_of(low), provenance_of(high)])


def _chosen(function: Any, arguments: Any, options: Any) -> Any:
    if len(arguments) != 3:
        return None
    condition, one, other = arguments
    return numpy.where(plain(condition), _beside_array(one), _beside_array(other))


def _largest(function: Any, arguments: Any, options: Any) -> Any:
    """Of `numpy.max` and `numpy.min` of a list."""
    ufunc = numpy.maximum if function in (numpy.max, numpy.amax) else numpy.minimum
    return provenance_of(
        compute(
            ufunc,
            'reduce',
            (with_provenance(numpy.asarray(plain(arguments[0])), provenance_of(arguments[0])),),
            {'axis': None, **options},
        )
    )


def _interpolated(function: Any, arguments: Any, options: Any) -> Any:
    if options or len(arguments) != 3:
        return None
    x, places, heights = arguments
    known = numpy.asarray(plain(places), dtype=float)
    known_objects, objects = (
        filled(numpy.asarray(plain(one)), provenance_of(one)).tolist() for one in (places, heights)
    )

    def at(value: Any) -> Any:
        after = int(numpy.searchsorted(known, plain(value), side='right'))
        if after == 0 or after == len(known):
            return objects[min(after, len(known) - 1)]
        before = after - 1
        slope = (objects[after] - objects[before]) / (known_objects[after] - known_objects[before])
        return objects[before] + slope * (value - known_objects[before])

    return only_tracked(numpy.frompyfunc(at, 1, 1)(filled(numpy.asarray(plain(x)), provenance_of(x))))


def _polynomial(function: Any, arguments: Any, options: Any) -> Any:
    if options or len(arguments) != 2:
        return None
    result: Any = 0.0
    x = _objects(arguments[1])
    for factor in _objects(arguments[0]).tolist() if provenance_of(arguments[0]) is not None else plain(arguments[0]):
        result = result * x + factor
    return only_tracked(result)


def _meshed(function: Any, arguments: Any, options: Any) -> Any:
    return numpy.meshgrid(*[_besides(one) for one in arguments], **plain(options))


def _sorted(function: Any, arguments: Any, options: Any) -> Any:
    order = numpy.argsort(plain(arguments[0]), **plain(options))
    return numpy.take_along_axis(_besides(arguments[0]), order, options.get('axis', -1))


def _rounded(function: Any, arguments: Any, options: Any) -> Any:
    decimals = plain(options.get('decimals', arguments[1] if len(arguments) > 1 else 0))
    return each(lambda x: round(x, decimals), [plain(arguments[0])], [provenance_of(arguments[0])])


def _median(function: Any, arguments: Any, options: Any) -> Any:
    if options or len(arguments) != 1:
        return None
    numbers = sorted(_objects(arguments[0]).reshape(-1).tolist())
    low, high = numbers[(len(numbers) - 1) // 2], numbers[len(numbers) // 2]
    return only_tracked(low if len(numbers) % 2 else (low + high) / 2)


def _spread(function: Any, arguments: Any, options: Any) -> Any:
    """Of `numpy.var` and `numpy.std` of all elements."""
    if options or len(arguments) != 1:
        return None
    numbers = _objects(arguments[0]).reshape(-1).tolist()
    mean = sum(numbers) / len(numbers)
    variance = sum((one - mean) * (one - mean) for one in numbers) / len(numbers)
    return only_tracked(_sqrt(variance) if function is numpy.std else variance)


_RULES: Dict[Any, Callable[..., Any]] = {}
_RULED: List[str] = []
for _rule, _names in {
    _moved: 'array_split atleast_1d atleast_2d atleast_3d broadcast_to copy delete diag diagflat diagonal '
    'expand_dims flip fliplr flipud moveaxis ravel repeat reshape resize roll rollaxis rot90 split '
    'squeeze swapaxes take tile transpose tril triu vsplit hsplit trim_zeros',
    _all_moved: 'append column_stack concatenate dstack hstack insert stack vstack block',
    _cross: 'cross',
    _added: 'cumprod cumsum diff dot inner kron mean nansum outer prod sum trace vdot average ediff1d '
    'convolve correlate tensordot trapz',
    _clipped: 'clip',
    _chosen: 'where',
    _rounded: 'round around round_',
    _largest: 'max min amax amin',
    _interpolated: 'interp',
    _polynomial: 'polyval',
    _meshed: 'meshgrid',
    _sorted: 'sort',
    _median: 'median',
    _spread: 'std var',
    _as_of_values: 'einsum',
}.items():
    _RULES.update((getattr(numpy, name), _rule) for name in _names.split() if hasattr(numpy, name))
    _RULED += _names.split()
_RULES[numpy.linalg.norm] = _norm
_RULES[numpy.linalg.inv] = _inverse
_RULES[numpy.linalg.solve] = _solution
_RULES[numpy.linalg.det] = _determinant
_RULES[numpy.linalg.multi_dot] = _RULES[numpy.linalg.matrix_power] = _product_of_several


def call(function: Any, arguments: Tuple[Any, ...], options: Dict[str, Any]) -> Any:
    """What a function of NumPy gives: NumPy's own numbers, and their provenance beside them where it is known."""
    result = function(*[plain(one) for one in arguments], **plain(options))
    rule = _RULES.get(function)
    out = options.get('out')
    for written in (out, written_by(function, arguments, options)):
        if isinstance(written, ArrayWithProvenance):
            written.write_beside(None)
    if rule is None or values.RECORDING.is_paused or getattr(result, 'size', 1) > LARGEST:
        LOSSES.computed(result, (arguments, options))
        return result
    try:
        beside = rule(function, arguments, options)
    except (ArithmeticError, ValueError, TypeError, IndexError, AttributeError, numpy.linalg.LinAlgError):
        return result
    if beside is None:
        return result
    if isinstance(result, (list, tuple)):
        return type(result)([with_provenance(one, part) for one, part in zip(result, beside)])
    if isinstance(out, ArrayWithProvenance):
        out.write_beside(beside)
        return out
    return with_provenance(result, beside)


def _noticing(function: Any) -> Any:
    """A function of NumPy that also looks for tracked numbers in lists, and among its arguments themselves."""

    @functools.wraps(function, updated=())
    def noticing(*arguments: Any, **options: Any) -> Any:
        for one in arguments:
            kind = type(one)
            if kind in WITH_PROVENANCE or (kind in (list, tuple) and any_tracked(one)):
                return call(function, arguments, options)
        return function(*arguments, **options)

    return noticing


def numpy_functions() -> Dict[str, Any]:
    """What a node's own code gets in place of functions of `numpy`, by name."""
    ruled = {name: _noticing(getattr(numpy, name)) for name in _RULED if getattr(numpy, name, None) in _RULES}
    return {**ruled, **makers()}


def linalg_functions() -> Dict[str, Any]:
    """The same of `numpy.linalg`."""
    return {
        name: _noticing(getattr(numpy.linalg, name))
        for name in ('norm', 'inv', 'solve', 'det', 'multi_dot', 'matrix_power')
    }


def _array_function(_array: Any, function: Any, _types: Any, arguments: Any, options: Any) -> Any:
    return call(function, arguments, options)


# It completes the class, as NEP 18 has it: `arrays` knows the operators alone.
ArrayWithProvenance.__array_function__ = _array_function  # type: ignore[method-assign, assignment]


def keep_provenance_in_numpy() -> None:
    """Have tracked numbers and plain arrays make arrays of floats, as NumPy does, not of objects."""
    values.compute_ufuncs_with(compute)
    functions.see_tracked_beside(numpy.float64)
    functions.show_as_plain(ArrayWithProvenance, numpy.ndarray)
    cells.strip_by(ArrayWithProvenance, plain)
    for kind, with_provenance_of in CLASSES.items():
        values.add_class(with_provenance_of)
        functions.show_as_plain(with_provenance_of, kind)
        functions.convert_by(kind, scalars.conversion(kind))
        cells.strip_by(with_provenance_of, plain)
