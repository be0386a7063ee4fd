"""The ways in which the sources of a quaternion can turn it."""

from typing import Any, List, Sequence, Tuple

import numpy

from rosslt import values
from rosslt.markers.geometry import AXES, Vector, inverse, normalized, product, rotate_vector

#: Rates below this are treated as 0.
SMALL = 1e-6


def turnable_directions(orientation: Sequence[Any]) -> List[Tuple[str, Vector]]:
    """The directions around which the sources of a quaternion can turn it.

    Args:
        orientation: x, y, z and w, tracked or not.

    Returns:
        [(name, unit vector in the frame)]: the frame's own axes that can be turned around; where there is
        none, those of the thing; else just the directions that the sources turn it around.
    """
    tracked = [part for part in orientation if values.is_tracked(part)]
    if not tracked:
        return []
    x, y, z, w = map(float, orientation)
    rotation = normalized(x, y, z, w)
    rates = []
    for rate in values.slopes(tracked).values():
        known = iter(rate)
        change = tuple(next(known) if values.is_tracked(part) else 0.0 for part in orientation)
        spin = numpy.array(product(change, inverse(rotation))[:3])
        if numpy.linalg.norm(spin) > SMALL:
            rates.append(spin / numpy.linalg.norm(spin))
    if not rates:
        return []
    span = numpy.array(rates).T
    for names, axes in (('xyz', AXES), ('uvw', tuple(rotate_vector(rotation, axis) for axis in AXES))):
        found = [(name, axis) for name, axis in zip(names, axes) if _is_in(span, numpy.array(axis))]
        if found:
            return found
    return [('source_%d' % index, (float(spin[0]), float(spin[1]), float(spin[2]))) for index, spin in enumerate(rates)]


def _is_in(span: Any, axis: Any) -> bool:
    weights = numpy.linalg.lstsq(span, axis, rcond=SMALL)[0]
    return bool(numpy.linalg.norm(span @ weights - axis) < 1e-3)
