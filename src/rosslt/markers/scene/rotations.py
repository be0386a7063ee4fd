"""The ways in which the sources of a quaternion can turn it."""

import math
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from rosslt import values
from rosslt.markers.geometry import AXES, Rotation, Vector, inverse, normalized, product, rotate_vector
from rosslt.markers.scene.fillers import without_fillers
from rosslt.markers.scene.handle import RankOf, Ring

#: Rates, and lengths of directions, below this are treated as 0.
SMALL = 1e-6


def rings_of(orientation: Sequence[Any], rank_of: Optional[RankOf] = None) -> Tuple[Ring, ...]:
    """A ring for each independent way in which the sources of a quaternion turn it at present.

    Axes of the frame come first, then those of the thing, both as far as the sources turn it around them; then the
    directions that single sources turn it around.

    Args:
        orientation: x, y, z and w, tracked or not.
        rank_of: as in `Handle.motions`.
    """
    by_source = _spins(orientation)
    if rank_of is not None:
        by_source = without_fillers(by_source, values.source_values(list(orientation)), rank_of)
    return rings_around(normalized(*map(float, orientation)), list(by_source.values()))


def rings_around(rotation: Rotation, spins: List[Vector]) -> Tuple[Ring, ...]:
    """Return the rings as `rings_of` does, given how the thing is turned, and the directions in the frame that it can
    be turned around."""
    turned_around, taken = _Span(), _Span()
    count = sum([turned_around.add(spin) for spin in spins])
    rings: List[Ring] = []
    for ring, axis in _candidates(rotation, spins):
        if len(rings) == count:
            break
        if turned_around.has(axis) and taken.add(axis):
            rings.append(ring)
    return tuple(rings)


def is_upright(ring: Ring, rotation: Rotation) -> bool:
    """Return whether a ring goes around z of the frame, given how the thing is turned."""
    return math.isclose(abs(rotate_vector(ring.orientation(rotation), AXES[0])[2]), 1.0)


def _candidates(rotation: Rotation, spins: List[Vector]) -> Iterator[Tuple[Ring, Vector]]:
    """Rings, and the axes in the frame that they go around, the best ones first."""
    for name, axis in zip('xyz', AXES):
        yield Ring(name, axis), axis
    for name, axis in zip('uvw', AXES):
        yield Ring(name, axis, is_in_frame=False), rotate_vector(rotation, axis)
    for index, spin in enumerate(spins):
        length = math.hypot(*spin)
        x, y, z = (round(part / length, 9) + 0.0 for part in spin)
        yield Ring('source_%d' % index, (x, y, z)), spin


def _spins(orientation: Sequence[Any]) -> Dict[values.Source, Vector]:
    """The direction around which each source turns a quaternion, in the frame; as long as the turn is fast."""
    rotation = normalized(*map(float, orientation))
    tracked = [part for part in orientation if values.is_tracked(part)]
    found = {}
    for source, rates in values.slopes(tracked).items():
        known = iter(rates)
        change = [next(known) if values.is_tracked(part) else 0.0 for part in orientation]
        x, y, z, _ = product(change, inverse(rotation))
        if math.hypot(x, y, z) > SMALL:
            found[source] = x, y, z
    return found


class _Span:
    """The directions that some directions span."""

    def __init__(self) -> None:
        self._basis: List[List[float]] = []

    def has(self, direction: Sequence[float]) -> bool:
        """True for a direction among them."""
        return math.hypot(*self._rest(direction)) < SMALL

    def add(self, direction: Sequence[float]) -> bool:
        """Add a direction; False if it is among them already."""
        rest = self._rest(direction)
        length = math.hypot(*rest)
        if length < SMALL:
            return False
        self._basis.append([part / length for part in rest])
        return True

    def _rest(self, direction: Sequence[float]) -> List[float]:
        """The part of a direction, made of length 1, at a right angle to all of them."""
        length = math.hypot(*direction)
        rest = [part / length for part in direction]
        for axis in self._basis:
            along = sum(a * b for a, b in zip(rest, axis))
            rest = [a - along * b for a, b in zip(rest, axis)]
        return rest
