"""The functions of `tf.transformations`, keeping provenance.

They are tf's own: a second copy of the module, which computes with the `numpy` and the `math` that keep provenance. It
is used where an argument has provenance; everything else is left to the original.
"""

import functools
import math
import types
from typing import Any, Dict, List, Tuple

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import TRACKED, python_number
from rosslt.instrument.arrays import any_tracked, with_provenance
from rosslt.instrument.functions import to_float

#: So many angles are remembered with their sines.
_MOST_HALVES = 64


def tracked_functions(original: types.ModuleType, tracking_numpy: Any, tracking_math: Any) -> Dict[str, Any]:
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
    copy.quaternion_from_euler = _QuaternionFromEuler(original)  # type: ignore[attr-defined]
    return {
        name: _either(getattr(original, name), function)
        for name, function in vars(copy).items()
        if isinstance(function, (types.FunctionType, _QuaternionFromEuler))
        and not name.startswith('_')
        and hasattr(original, name)
    }


def _either(original: Any, tracked: Any) -> Any:
    @functools.wraps(original)
    def function(*arguments: Any, **options: Any) -> Any:
        if not any_tracked((*arguments, *options.values()) if options else arguments):
            return original(*arguments, **options)
        return tracked(*arguments, **options)

    return function


def _product(one: Any, other: Any) -> Any:
    """The product of two numbers, plain where it is 0 whatever a source says: the x and y of a turn about z."""
    if one == 0.0 and type(one) not in TRACKED:
        return one * float(other)
    if other == 0.0 and type(other) not in TRACKED:
        return float(one) * other
    return one * other


class _QuaternionFromEuler:
    """tf's `quaternion_from_euler`, which nodes call most: with the same numbers, as it goes in the same order, and the
    sines of angles that stand still computed once.

    Args:
        original: `tf.transformations`, for its tables of axes.
    """

    def __init__(self, original: Any) -> None:
        self._axes, self._next, self._names = original._AXES2TUPLE, original._NEXT_AXIS, original._TUPLE2AXES
        self._halves: Dict[int, Tuple[Any, Any, Any]] = {}

    def __call__(self, ai: Any, aj: Any, ak: Any, axes: Any = 'sxyz') -> Any:
        try:
            i, parity, repetition, frame = self._axes[axes.lower()]
        except (AttributeError, KeyError):
            self._names[axes]
            i, parity, repetition, frame = axes
        j, k = self._next[i + parity], self._next[i - parity + 1]
        ai, aj, ak = python_number(ai), python_number(aj), python_number(ak)
        if frame:
            ai, ak = ak, ai
        if parity:
            aj = -aj
        ci, si = self._of_half(ai)
        cj, sj = self._of_half(aj)
        ck, sk = self._of_half(ak)
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
        beside = numpy.empty(4, dtype=object)
        beside[:] = [part if type(part) in TRACKED else None for part in parts]
        return with_provenance(numpy.array([float(part) for part in parts]), beside)

    def _of_half(self, angle: Any) -> Tuple[Any, Any]:
        """The cosine and the sine of half an angle."""
        if type(angle) not in TRACKED:
            half = angle / 2.0
            return math.cos(half), math.sin(half)
        known = self._halves.get(id(angle))
        if known is None:
            if len(self._halves) >= _MOST_HALVES:
                self._halves.clear()
            half = angle / 2.0
            known = self._halves[id(angle)] = angle, values.MATH['cos'](half), values.MATH['sin'](half)
        return known[1], known[2]
