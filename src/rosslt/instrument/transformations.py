"""The functions of `tf.transformations`, keeping provenance.

They are tf's own: a second copy of the module, which computes with the `numpy` and the `math` that keep provenance. It
is used if an argument has provenance and operations are recorded; everything else is left to the original.
"""

import functools
import types
from typing import Any, Dict, List

from rosslt import values
from rosslt.instrument import functions
from rosslt.instrument.functions import to_float

arrays = values.numpy_arrays()


def tracked_functions(original: types.ModuleType, tracking_numpy: object, tracking_math: object) -> Dict[str, Any]:
    """The functions of tf's module by name.

    Args:
        original: `tf.transformations`.
        tracking_numpy, tracking_math: those that keep provenance.
    """
    assert original.__file__ is not None
    copy = types.ModuleType(original.__name__)
    copy.__file__ = original.__file__
    with open(original.__file__, 'rb') as file:
        exec(compile(file.read(), original.__file__, 'exec', dont_inherit=True), copy.__dict__)
    copy.numpy, copy.math, copy.float = tracking_numpy, tracking_math, to_float  # type: ignore[attr-defined]
    copy.quaternion_from_euler = _quaternion_from_euler(original)  # type: ignore[attr-defined]
    return {
        name: _either(getattr(original, name), function)
        for name, function in vars(copy).items()
        if isinstance(function, types.FunctionType) and not name.startswith('_') and hasattr(original, name)
    }


def _either(original: Any, tracked: Any) -> Any:
    @functools.wraps(original)
    def function(*arguments: Any, **options: Any) -> Any:
        if not arrays.holds_tracked((*arguments, *options.values()) if options else arguments):
            return original(*arguments, **options)
        if not values.spend(0):
            return original(*arrays.plain(arguments), **arrays.plain(options))
        return values.timed(tracked, *arguments, **options)

    return function


def _product(one: Any, other: Any) -> Any:
    """The product of two numbers, plain if it is 0 whatever a source says: the x and y of a turn about z."""
    if one == 0.0 and type(one) not in arrays.PYTHON_NUMBERS:
        return one * float(other)
    if other == 0.0 and type(other) not in arrays.PYTHON_NUMBERS:
        return float(one) * other
    return one * other


def _quaternion_from_euler(original: types.ModuleType) -> Any:
    """tf's `quaternion_from_euler`, which nodes call most, for numbers: it goes in the same order, and leaves plain
    what no source moves."""

    def quaternion_from_euler(ai: Any, aj: Any, ak: Any, axes: Any = 'sxyz') -> Any:
        try:
            i, parity, repetition, frame = original._AXES2TUPLE[axes.lower()]
        except (AttributeError, KeyError):
            original._TUPLE2AXES[axes]
            i, parity, repetition, frame = axes
        following = original._NEXT_AXIS
        j, k = following[i + parity], following[i - parity + 1]
        ai, aj, ak = map(arrays.python_number, (ai, aj, ak))
        if frame:
            ai, ak = ak, ai
        if parity:
            aj = -aj
        cos, sin = functions.MATH['cos'], functions.MATH['sin']
        (ci, si), (cj, sj), (ck, sk) = [(cos(half), sin(half)) for half in (ai / 2.0, aj / 2.0, ak / 2.0)]
        cc, cs, sc, ss = _product(ci, ck), _product(ci, sk), _product(si, ck), _product(si, sk)
        parts: List[Any] = [None] * 4
        if repetition:
            parts[i], parts[j], parts[k] = _product(cj, cs + sc), _product(sj, cc + ss), _product(sj, cs - sc)
            parts[3] = _product(cj, cc - ss)
        else:
            parts[i] = _product(cj, sc) - _product(sj, cs)
            parts[j] = _product(cj, ss) + _product(sj, cc)
            parts[k] = _product(cj, cs) - _product(sj, sc)
            parts[3] = _product(cj, cc) + _product(sj, ss)
        if parity:
            parts[j] *= -1
        return arrays.of_list(parts, float)

    return quaternion_from_euler
