"""The arguments of NumPy's functions without provenance."""

from typing import Any

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import Float32
from rosslt.instrument.arrays import ArrayWithProvenance

#: The classes of tracked values.
WITH_PROVENANCE = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int, bool, str))


def plain(x: Any) -> Any:
    """An argument without provenance, at any depth of lists."""
    if isinstance(x, ArrayWithProvenance):
        return x.view(numpy.ndarray)
    if type(x) is Float32:
        return x.plain
    if isinstance(x, (list, tuple)) and not hasattr(x, '_fields') and type(x) in (list, tuple):
        return type(x)([plain(part) for part in x])
    if isinstance(x, dict):
        return {key: plain(part) for key, part in x.items()}
    return values.untracked(x) if type(x) in WITH_PROVENANCE else x
