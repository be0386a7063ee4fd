"""The functions of `tf.transformations`, keeping provenance.

They are tf's own: a second copy of the module, which computes with the `numpy` and the `math` that keep provenance. It is
used where an argument has provenance; everything else is left to the original.
"""

import functools
import types
from typing import Any, Dict

from rosslt import values
from rosslt.instrument.array_functions import plain
from rosslt.instrument.arrays import TrackedArray, any_tracked
from rosslt.instrument.functions import to_float

_TRACKED = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int))


def tracked_functions(original: types.ModuleType, numpy: Any, math: Any) -> Dict[str, Any]:
    """The functions of tf's module by name.

    Args:
        original: `tf.transformations`.
        numpy, math: those that keep provenance.
    """
    assert original.__file__ is not None
    copy = types.ModuleType(original.__name__)
    copy.__file__ = original.__file__
    with open(original.__file__, 'rb') as file:
        exec(compile(file.read(), original.__file__, 'exec', dont_inherit=True), copy.__dict__)
    copy.numpy, copy.math, copy.float = numpy, math, to_float  # type: ignore[attr-defined]
    return {
        name: _either(getattr(original, name), function)
        for name, function in vars(copy).items()
        if isinstance(function, types.FunctionType) and not name.startswith('_') and hasattr(original, name)
    }


def _either(original: Any, tracked: Any) -> Any:
    @functools.wraps(original)
    def function(*arguments: Any, **options: Any) -> Any:
        for one in (*arguments, *options.values()) if options else arguments:
            kind = type(one)
            if (
                kind in _TRACKED
                or (kind is TrackedArray and one.has_provenance)
                or (kind in (list, tuple) and any_tracked(one))
            ):
                try:
                    return tracked(*arguments, **options)
                except TypeError:  # it does with a number what only NumPy's numbers can
                    return original(*map(plain, arguments), **plain(options))
        return original(*arguments, **options)

    return function
