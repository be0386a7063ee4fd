"""The ways in which the sources of a quaternion can turn it."""

import math
from typing import Any, Dict, List, Sequence, Tuple

from rosslt import values
from rosslt.markers.geometry import AXES, Vector, inverse, normalized, product, rotate_vector
from rosslt.markers.scene.handle import Ring

#: Rates, and lengths of directions, below these are treated as 0.
SMALL, NEARLY_SMALL = 1e-6, 1e-3

#: The turn by each source, in radians, after which it is looked around which axes it still turns the thing.
NUDGE = 0.1

#: To how many digits a direction is given that is an axis neither of the frame nor of the thing.
DIGITS = 4


def rings_of(orientation: Sequence[Any]) -> Tuple[Tuple[Ring, ...], bool]:
    """A ring for each independent way in which the sources of a quaternion can turn it; and whether these rings last
    while it turns.

    Axes of the frame come first, then those of the thing, both as far as the sources turn it around them in the
    orientations near by, too; then the directions that the sources turn it around at present.

    Args:
        orientation: x, y, z and w, tracked or not.
    """
    spins = _spins(orientation)
    if not spins:
        return (), True
    rotation = normalized(*map(float, orientation))
    nudged = {
        source: value + NUDGE / math.hypot(*spins[source])
        for source, value in values.source_values(list(orientation)).items()
        if source in spins and isinstance(value, float)
    }
    near_by = values.reapply(list(orientation), nudged)
    turned, turning = normalized(*map(float, near_by)), _spins(near_by)
    in_frame = _Span(spins.values()), _Span(turning.values())
    in_thing = _Span(_seen_from(rotation, spins)), _Span(_seen_from(turned, turning))
    candidates = [
        (Ring(name, axis), axis) for name, axis in zip('xyz', AXES) if all(span.has(axis) for span in in_frame)
    ]
    candidates += [
        (Ring(name, axis, is_in_frame=False), rotate_vector(rotation, axis))
        for name, axis in zip('uvw', AXES)
        if all(span.has(axis) for span in in_thing)
    ]
    lasting = len(candidates)
    for index, spin in enumerate(spins.values()):
        length = math.hypot(*spin)
        x, y, z = (round(part / length, DIGITS) + 0.0 for part in spin)
        candidates.append((Ring('source_%d' % index, (x, y, z)), spin))
    taken = _Span(())
    chosen = [index for index, (_, direction) in enumerate(candidates) if taken.add(direction)]
    are_lasting = all(index < lasting for index in chosen) and len(chosen) == in_frame[1].rank
    return tuple([candidates[index][0] for index in chosen]), are_lasting


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


def _seen_from(rotation: Sequence[float], spins: Dict[values.Source, Vector]) -> List[Vector]:
    """Directions in the coordinates of a thing."""
    return [rotate_vector(inverse(rotation), spin) for spin in spins.values()]


class _Span:
    """The directions that some directions span."""

    def __init__(self, directions: Any) -> None:
        self._basis: List[List[float]] = []
        for direction in directions:
            self.add(direction)

    @property
    def rank(self) -> int:
        """The number of independent directions."""
        return len(self._basis)

    def has(self, direction: Sequence[float]) -> bool:
        """True for a direction among them."""
        return math.hypot(*self._rest(direction)) < NEARLY_SMALL

    def add(self, direction: Sequence[float]) -> bool:
        """Add a direction; False where it is among them already."""
        rest = self._rest(direction)
        length = math.hypot(*rest)
        if length < NEARLY_SMALL:
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
