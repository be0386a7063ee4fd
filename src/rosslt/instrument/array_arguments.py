"""The arguments of NumPy's functions without provenance."""

from typing import Any

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import NUMPY_NUMBERS
from rosslt.instrument.arrays import ArrayWithProvenance


def plain(x: Any) -> Any:
    """An argument without provenance, at any depth of lists."""
    if isinstance(x, ArrayWithProvenance):
        return x.view(numpy.ndarray)
    if type(x) in NUMPY_NUMBERS:
        return x.plain
    if type(x) in (list, tuple):
        return type(x)([plain(part) for part in x])
    if isinstance(x, dict):
        return {key: plain(part) for key, part in x.items()}
    return values.untracked(x) if type(x) in values.TRACKED_CLASSES else x
