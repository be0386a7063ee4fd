"""Descents: steps from a point that each bring the results nearer to what is wanted.

Gauss-Newton in a trust region for what can be met, Levenberg-Marquardt for what cannot.
"""

import math
from typing import List, NamedTuple, Optional, Sequence, Tuple

from ..annotations import Value
from ..graph import UNDEFINED, Graph
from ..sources import Source
from .budget import Budget, Exhausted
from .equations import Equation, Equations, Goal, Point
from .freedom import in_floats
from .least_squares import Rows, shortest_step, work_of_step

ROUNDS = 50

DAMPINGS = (0.0, 1e-6, 1e-3, 0.03, 1.0, 30.0)

CONVERGED = 1e-10
"""Results that miss by at most this part of their size are met, and only polished further."""

EXACT = 2.0**-51
"""Below this root mean square of the differences, only roundings differ."""

NEARLY_LINEAR = 1e-3
"""The results are nearly linear if a step leaves at most this part of the difference."""


class Descent(NamedTuple):
    """The end of a descent: the point, and the size of the remaining differences."""

    x: Point
    size: float


class Descents(Equations):
    """Equations whose unknowns have limits and scales, and steps towards what is wanted.

    Args:
        graph, goals, unknowns, budget, base: as of `Equations`.
        freedom: the constraints on the unknowns (`freedom.Freedom`).
    """

    def __init__(
        self,
        graph: Graph,
        goals: List[Goal],
        unknowns: List[Source],
        freedom: Value,
        budget: Budget,
        base: Optional[List[Value]] = None,
    ) -> None:
        super().__init__(graph, goals, unknowns, budget, base)
        self._limits = [in_floats(freedom.limits(source)) for source in unknowns]
        self._scales = [freedom.scale(source, value) for source, value in zip(unknowns, self.start)]
        self.start = [self._clamped(place, value) for place, value in enumerate(self.start)]

    def _clamped(self, place: int, value: float) -> float:
        low, high = self._limits[place]
        return min(max(value, low), high)

    def _leaves(self, place: int, value: float, way: float) -> bool:
        """Return True if a step would move an unknown at its bound out of bounds."""
        low, high = self._limits[place]
        return value >= high if way > 0 else way < 0 and value <= low

    def _length(self, step: Point) -> float:
        return math.hypot(*[part / scale for part, scale in zip(step, self._scales)])

    def _step(self, x: Point, rows: Rows, missing: List[float], damping: float, by_row: bool = True) -> Point:
        """A step towards the results; an unknown at a bound that it would leave stays there."""
        self._budget.spend(work_of_step(rows, len(x)))
        # With more results than unknowns, one that hardly moves must not count as much as the others.
        by_row = by_row and len(rows) <= len(x)
        at_bounds = [place for place, (value, (low, high)) in enumerate(zip(x, self._limits)) if not low < value < high]
        if not at_bounds:
            return shortest_step(rows, missing, self._scales, damping, by_row)
        downhill = dict.fromkeys(at_bounds, 0.0)
        for row, part in zip(rows, missing):
            for place in at_bounds:
                downhill[place] += row.get(place, 0.0) * part
        held = {place for place in at_bounds if self._leaves(place, x[place], downhill[place])}
        while True:
            free = [{place: slope for place, slope in row.items() if place not in held} for row in rows]
            step = shortest_step(free, missing, self._scales, damping, by_row)
            leaving = [place for place in at_bounds if self._leaves(place, x[place], step[place])]
            if not leaving:
                return step
            # Unknowns are held one by one: without one of them the others may come back.
            held.add(max(leaving, key=lambda place: abs(step[place]) / self._scales[place]))

    def _descend(self, x: Point, equations: Sequence[Equation], rounds: int = ROUNDS) -> Optional[Descent]:
        """Descend from a point in steps that each bring the results nearer; None if they are undefined at that point.

        Args:
            x: the first point.
            equations: the equations to meet.
            rounds: the largest number of steps.
        """
        values = self._tried(x)
        missing = self._missing(values, equations)
        if values is None or missing is None:
            return None
        size = math.hypot(*missing)
        radius = max([1.0] + [abs(value) / scale for value, scale in zip(x, self._scales)])
        level = 0
        slow = 0
        rows: Rows = []
        for _ in range(rounds):
            if size <= EXACT * math.sqrt(len(equations)):
                break
            try:
                # The slopes of the last round are used again if they predicted the results well.
                rows = rows or self._jacobian(values, equations)
            except Exhausted:
                raise
            except UNDEFINED:
                break
            # Results that are met are polished with undamped steps only.
            for attempt in range(level, len(DAMPINGS)) if size > CONVERGED else (0,):
                try:
                    step = self._step(x, rows, missing, DAMPINGS[attempt])
                except Exhausted:
                    raise
                except UNDEFINED:
                    continue
                length = self._length(step)
                if not 0 < length < math.inf:
                    continue
                if length > radius and attempt == level:
                    # The results are nearly linear: the step may be long.
                    ahead, there, left = self._ahead(x, step, 1.0, equations)
                    if left is not None and math.hypot(*left) <= NEARLY_LINEAR * size:
                        break
                ahead, there, left = self._ahead(x, step, min(1.0, radius / length), equations)
                if left is not None and math.hypot(*left) < size:
                    if length > radius:
                        radius *= 2
                    break
            else:
                break
            if there is None or left is None:
                break
            level = max(0, attempt - 1)
            gain = size - math.hypot(*left)
            if size - gain > max(NEARLY_LINEAR * size, CONVERGED):
                rows = []
            if size < CONVERGED and gain < 0.1 * size:
                x, size = ahead, size - gain
                break
            x, values, missing, size = ahead, there, left, size - gain
            slow = slow + 1 if gain < 0.01 * size else 0
            if slow > 6:
                break
        return Descent(x, size)

    def _ahead(
        self, x: Point, step: Point, part: float, equations: Sequence[Equation]
    ) -> Tuple[Point, Optional[List[Value]], Optional[List[float]]]:
        """Take a part of a step: return the new point, the nodes' values and the remaining differences."""
        ahead = [self._clamped(place, value + part * way) for place, (value, way) in enumerate(zip(x, step))]
        there = self._tried(ahead)
        return ahead, there, self._missing(there, equations)

    def _approach(self, x: Point) -> Optional[Descent]:
        """Minimize the differences from a point with the Levenberg-Marquardt method."""
        values = self._tried(x)
        missing = self._missing(values, self._equations)
        if values is None or missing is None:
            return None
        size, damping = math.hypot(*missing), DAMPINGS[2]
        for _ in range(4 * ROUNDS):
            try:
                rows = self._jacobian(values, self._equations)
                step = self._step(x, rows, missing, damping, by_row=False)
                ahead, there, left = self._ahead(x, step, 1.0, self._equations)
            except Exhausted:
                break
            except UNDEFINED:
                damping *= 4
                continue
            way = [value - before for value, before in zip(ahead, x)]
            if self._length(way) <= 1e-12 * max([1.0] + [abs(value) / scale for value, scale in zip(x, self._scales)]):
                break
            if there is None or left is None:
                damping *= 4
                continue
            # A step that is too long gains less than the slopes predict.
            foretold = [
                part - sum([slope * way[place] for place, slope in row.items()]) for part, row in zip(missing, rows)
            ]
            promised = size - math.hypot(*foretold)
            gain = size - math.hypot(*left)
            if not gain > 0.1 * promised:
                if damping > 1e9:
                    break
                damping *= 4
                continue
            if gain > 0.7 * promised:
                damping = max(damping / 4, 1e-12)
            x, values, missing, size = ahead, there, left, size - gain
            if not size or gain <= 1e-15 * size:
                break
        return Descent(x, size)
