"""The `numpy` that rewritten code gets: NumPy's functions, keeping provenance."""

import sys
from typing import Any, Set, Tuple

import numpy
import rospy

from rosslt import values
from rosslt.instrument import cells, functions, starts
from rosslt.instrument.losses import LOSSES

arrays = values.numpy_arrays()


def _reduced(value: object, protocol: object) -> Any:
    return arrays.plain(value).__reduce_ex__(protocol)


_told: Set[Tuple[str, type]] = set()


def _unrecorded(name: str, error: Exception) -> None:
    """A call of NumPy could not be recorded: `doctor` names the line, and rosout the error, once for each kind."""
    if (name, type(error)) not in _told:
        _told.add((name, type(error)))
        rospy.logwarn('rosslt does not track a result of %s: %s: %s', name, type(error).__name__, error)
    if LOSSES.is_watched:
        LOSSES.note(sys._getframe(1))


def look_like_numpy() -> None:
    """Have arrays and numbers with provenance look like NumPy's own in texts, in pickles and to `type`, be cut where
    they carry a state on, and be noticed where they lose their provenance."""
    functions.see_tracked_beside(numpy.float64)
    for cls, kind in ((arrays.TrackedArray, numpy.ndarray), *[(cls, kind) for kind, cls in arrays.CLASSES.items()]):
        functions.show_as_plain(cls, kind, _reduced)
        cells.strip_by(cls, arrays.plain)
    starts.see_arrays(arrays.TrackedArray)
    for kind in arrays.CLASSES:
        functions.convert_by(kind, arrays.conversion(kind))
    if LOSSES.computed not in arrays.LOST:
        arrays.LOST.append(LOSSES.computed)
        arrays.FAULTS.append(_unrecorded)
