"""Leaps: answers in which a small movement of the mouse would move a source far.

It happens near singular places (an arrow that points at the eye), and where an equation has many answers of which the
near one has just gone. Such an answer is not applied while the mouse moves.
"""

from typing import Any, Dict, Optional, Sequence

import numpy

from rosslt import values
from rosslt.markers.geometry import distance, inverse, product

#: Where on the way from the present source values to the new ones the slopes are looked at.
ON_THE_WAY = (0.25, 0.5, 0.75)

#: Directions in which results move less than this, against the one in which they move most, count as stuck.
SINGULAR = 1e-3


class Guard:
    """Watches how far the hand and the sources move in one drag.

    Args:
        limit: how many times as far as so far, in relation to the hand, a source may move in one step;
            how many times its size, or the longest step so far, a handle may; and how many times as far as the slopes
            on the way account for all sources may.
        size: of the handle, in metres.
    """

    def __init__(self, limit: float, size: float) -> None:
        self._limit, self._size = limit, size
        self._longest_step = size
        self._ratios: Dict[values.Source, float] = {}  # Source -> the most that it has moved for each metre of the hand

    def leap(
        self,
        start: Sequence[float],
        end: Sequence[float],
        before: Dict[values.Source, Any],
        after: Dict[values.Source, Any],
        tracked: Sequence[Any],
    ) -> Optional[Any]:
        """The source that would move by far more than the hand, or None; what is not a leap is remembered.

        Args:
            start, end: of this step of the hand, (x, y, z, qx, qy, qz, qw).
            before, after: {Source: value} at these; `after` has those that change.
            tracked: the values that the hand moves.
        """
        moved = {
            source: abs(float(value) - float(before[source]))
            for source, value in after.items()
            if _is_number(value) and _is_number(before.get(source)) and value != before[source]
        }
        if not moved:
            return None
        step = hand_step(start, end)
        ratios = {source: way / max(step, 1e-3 * self._size) for source, way in moved.items()}
        for source, ratio in ratios.items():
            if source in self._ratios and ratio > self._limit * self._ratios[source]:
                return source
        if step > self._limit * self._longest_step or self._is_elsewhere(tracked, before, after, moved):
            return max(moved, key=lambda source: moved[source])
        self._longest_step = max(self._longest_step, step)
        for source, ratio in ratios.items():
            self._ratios[source] = max(ratio, self._ratios.get(source, 0.0))
        return None

    def _is_elsewhere(
        self,
        tracked: Sequence[Any],
        before: Dict[values.Source, Any],
        after: Dict[values.Source, Any],
        moved: Dict[values.Source, float],
    ) -> bool:
        """Whether the answer is on another branch: the slopes on the way there account for a much shorter one."""
        there = {**before, **after}
        try:
            change = numpy.array(
                [float(values.evaluate(one, there)) - float(values.evaluate(one, before)) for one in tracked]
            )
            lengths = [self._accounted(tracked, before, there, moved, part, change) for part in ON_THE_WAY]
        except (ArithmeticError, ValueError):
            return True
        way = float(numpy.linalg.norm(list(moved.values())))
        return way > self._limit * float(numpy.median(lengths))

    def _accounted(
        self,
        tracked: Sequence[Any],
        before: Dict[values.Source, Any],
        there: Dict[values.Source, Any],
        moved: Dict[values.Source, float],
        part: float,
        change: Any,
    ) -> float:
        """How far the sources have to go for a change of the results, by the slopes at a part of the way."""
        here = {source: before[source] + part * (there[source] - before[source]) for source in moved}
        rates = values.slopes([values.reapply(one, {**before, **here}) for one in tracked])
        jacobian = numpy.array([rates[source] for source in moved if source in rates]).T
        if jacobian.size == 0:
            return 0.0
        return float(numpy.linalg.norm(numpy.linalg.pinv(jacobian, rcond=SINGULAR) @ change))


def hand_step(start: Sequence[float], end: Sequence[float]) -> float:
    """How far a hand has moved, in metres or, where it turns, in radians."""
    turn = product(end[3:], inverse(start[3:]))
    return distance(start[:3], end[:3]) + 2.0 * distance(turn[:3], (0.0, 0.0, 0.0))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
