"""The `numpy` that rewritten code gets: NumPy's functions, keeping provenance."""

from typing import Any, Dict

import numpy

from rosslt import values
from rosslt.instrument import cells, functions
from rosslt.instrument.losses import LOSSES

arrays = values.numpy_arrays()


def numpy_functions() -> Dict[str, Any]:
    """Return the replacements of `numpy` functions, {name: function}."""
    return dict(arrays.replacements(numpy))


def linalg_functions() -> Dict[str, Any]:
    """Return the replacements of functions of `numpy.linalg`, {name: function}."""
    return dict(arrays.replacements(numpy.linalg))


def _reduced(value: Any, protocol: Any) -> Any:
    return arrays.plain(value).__reduce_ex__(protocol)


def look_like_numpy() -> None:
    """Have arrays and numbers with provenance look like NumPy's own in texts, in pickles and to `type`, be cut where
    they carry a state on, and be noticed where they lose their provenance."""
    functions.see_tracked_beside(numpy.float64)
    for cls, kind in ((arrays.TrackedArray, numpy.ndarray), *[(cls, kind) for kind, cls in arrays.CLASSES.items()]):
        functions.show_as_plain(cls, kind, _reduced)
        cells.strip_by(cls, arrays.plain)
    for kind in arrays.CLASSES:
        functions.convert_by(kind, arrays.conversion(kind))
    if LOSSES.computed not in arrays.LOST:
        arrays.LOST.append(LOSSES.computed)
