"""NumPy's functions for arrays that keep provenance, and the `numpy` that a node's own code gets."""

import contextlib
import functools
from typing import Any, Callable, Dict, List, Tuple

import numpy

from rosslt import values
from rosslt.instrument import cells, functions, scalars
from rosslt.instrument.array_arguments import plain
from rosslt.instrument.array_makers import builtin_like, makers
from rosslt.instrument.array_numbers import CLASSES, WITH_PROVENANCE, python_number
from rosslt.instrument.array_writing import written_by
from rosslt.instrument.arrays import (
    LARGEST,
    ArrayWithProvenance,
    any_tracked,
    compute,
    filled,
    only_tracked,
    provenance_of,
    with_provenance,
)
from rosslt.instrument.losses import LOSSES

#: The most columns of a matrix of which the inverse, the determinant and the like keep provenance.
LARGEST_MATRIX = 6


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
    """Return the provenance of a result that only moves elements of its first argument (reshape, transpose)."""
    first = arguments[0]
    first = _beside_array(first) if type(first) in (list, tuple) else _besides(first)
    return function(first, *plain(list(arguments[1:])), **plain(options))


def _all_moved(function: Any, arguments: Any, options: Any) -> Any:
    """Return the provenance of a result that moves elements of several arrays (concatenate, insert)."""
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
    """Return the provenance of sums and products: the function itself, called with arrays of tracked objects."""
    options = {key: value for key, value in options.items() if key != 'dtype'}
    return only_tracked(function(*map(_objects, arguments), **plain(options)))


def _as_of_values(function: Any, arguments: Any, options: Any) -> Any:
    """Return the provenance of a result by the counterpart of the function in `rosslt.values`."""
    is_algebra = function.__module__ == 'numpy.linalg'
    matrices = arguments[0] if function is numpy.linalg.multi_dot else arguments[:1]
    if is_algebra and function is not numpy.linalg.norm and max(map(_width, matrices)) > LARGEST_MATRIX:
        return None
    made = values.numpy_functions()['linalg.' * is_algebra + function.__name__](
        *map(_operand, arguments), **{name: _operand(x) for name, x in options.items() if name != 'dtype'}
    )
    return only_tracked(numpy.asarray(made, dtype=object) if numpy.ndim(made) else made)


def _width(matrix: Any) -> int:
    return max(numpy.shape(plain(matrix))[-2:])


def _operand(x: Any) -> Any:
    """An argument for a function of the room `values`."""
    if type(x) in (list, tuple) and any(isinstance(part, numpy.ndarray) for part in x):
        return [_objects(part) for part in x]
    return python_number(x) if type(x) in WITH_PROVENANCE else _objects(x)


def _chosen(function: Any, arguments: Any, options: Any) -> Any:
    if len(arguments) != 3:
        return None
    condition, one, other = arguments
    return numpy.where(plain(condition), _beside_array(one), _beside_array(other))


def _largest(function: Any, arguments: Any, options: Any) -> Any:
    """Return the provenance of `numpy.max` or `numpy.min` of a list."""
    ufunc = numpy.maximum if function in (numpy.max, numpy.amax) else numpy.minimum
    return provenance_of(
        compute(
            ufunc,
            'reduce',
            (with_provenance(numpy.asarray(plain(arguments[0])), provenance_of(arguments[0])),),
            {'axis': None, **options},
        )
    )


def _meshed(function: Any, arguments: Any, options: Any) -> Any:
    return numpy.meshgrid(*[_besides(one) for one in arguments], **plain(options))


def _sorted(function: Any, arguments: Any, options: Any) -> Any:
    order = numpy.argsort(plain(arguments[0]), **plain(options))
    return numpy.take_along_axis(_besides(arguments[0]), order, options.get('axis', -1))


_RULES: Dict[Any, Callable[..., Any]] = {}
_RULED: List[str] = []
for _rule, _names in {
    _moved: 'array_split atleast_1d atleast_2d atleast_3d broadcast_to copy delete diag diagflat diagonal '
    'expand_dims flip fliplr flipud moveaxis ravel repeat reshape resize roll rollaxis rot90 split '
    'squeeze swapaxes take tile transpose tril triu vsplit hsplit trim_zeros',
    _all_moved: 'append column_stack concatenate dstack hstack insert stack vstack block',
    _added: 'cumprod cumsum diff dot inner kron mean nansum outer prod sum trace vdot average ediff1d '
    'convolve correlate tensordot trapz',
    _chosen: 'where',
    _largest: 'max min amax amin',
    _meshed: 'meshgrid',
    _sorted: 'sort',
    _as_of_values: 'arange around clip corrcoef cov cross einsum interp linspace median polyval round round_ std var',
}.items():
    _RULES.update((getattr(numpy, name), _rule) for name in _names.split() if hasattr(numpy, name))
    _RULED += _names.split()
_ALGEBRA = ('norm', 'inv', 'solve', 'det', 'multi_dot', 'matrix_power', 'pinv')
_RULES.update((getattr(numpy.linalg, name), _as_of_values) for name in _ALGEBRA)


#: The exceptions of a rule that cannot compute a result which NumPy can.
_FAILING = (ArithmeticError, ValueError, TypeError, IndexError, AttributeError, numpy.linalg.LinAlgError)


def _size(x: Any) -> int:
    return x.size if isinstance(x, numpy.ndarray) else len(x) if type(x) in (list, tuple) else 1


def call(function: Any, arguments: Tuple[Any, ...], options: Dict[str, Any]) -> Any:
    """Call a function of NumPy: the result has NumPy's own numbers, with their provenance where it is known."""
    given, named = [plain(one) for one in arguments], plain(options)
    result = function(*given, **named)
    rule = _RULES.get(function)
    passed = zip((*arguments, *options.values()), (*given, *named.values()))
    is_given = [one for one, plain_one in passed if plain_one is result]
    for written in (written_by(function, arguments, options), *(is_given if rule is not _moved else ())):
        if isinstance(written, ArrayWithProvenance):
            written.write_beside(None)
    beside = None
    if rule is None or max(map(_size, (result, *given))) > LARGEST:
        LOSSES.computed(result, (arguments, options))
    else:
        with contextlib.suppress(*_FAILING):
            rest = [None if passed is result else one for one, passed in zip(arguments[1:], given[1:])]
            kept = {name: one for name, one in options.items() if named[name] is not result}
            beside = rule(function, (*arguments[:1], *rest), kept)
    if is_given:
        if beside is not None and isinstance(is_given[0], ArrayWithProvenance):
            is_given[0].write_beside(beside)
        return is_given[0]
    if beside is None:
        return result
    if isinstance(result, (list, tuple)):
        return type(result)([with_provenance(one, part) for one, part in zip(result, beside)])
    return with_provenance(result, beside)


def _noticing(function: Any) -> Any:
    """A function of NumPy that also looks for tracked numbers in lists, and among its arguments themselves."""

    @functools.wraps(function, updated=())
    def noticing(*arguments: Any, **options: Any) -> Any:
        for one in (*arguments, *options.values()) if options else arguments:
            kind = type(one)
            if kind in WITH_PROVENANCE or (kind in (list, tuple) and any_tracked(one)):
                return call(function, arguments, options)
        return function(*arguments, **options)

    return builtin_like(function, noticing)


def numpy_functions() -> Dict[str, Any]:
    """Return the replacements of `numpy` functions that rewritten code uses, {name: function}."""
    ruled = {name: _noticing(getattr(numpy, name)) for name in _RULED if getattr(numpy, name, None) in _RULES}
    return {**ruled, **makers()}


def linalg_functions() -> Dict[str, Any]:
    """Return the replacements of functions of `numpy.linalg` that rewritten code uses, {name: function}."""
    return {name: _noticing(getattr(numpy.linalg, name)) for name in _ALGEBRA}


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
