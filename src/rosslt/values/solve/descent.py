"""Descents: steps from a point that each bring the results nearer to their targets.

Gauss-Newton in a trust region for targets that can be met, Levenberg-Marquardt for others.
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
DAMPINGS_TO_END = (*DAMPINGS, 1e3, 3e4, 1e6)
"""If results have their extremum short of the target, their slopes vanish, and steps along them grow without end."""


CONVERGED = 1e-10
"""Results that miss by at most this part of their size are met, and only polished further."""

EXACT = 2.0**-51
"""Below this root mean square of the differences, only roundings differ."""

STALLED = 1e-3
"""A descent ends with a step that gains no more than this part of the difference."""


class Descent(NamedTuple):
    """The end of a descent: the point, and the size of the remaining differences."""

    x: Point
    size: float


class Descents(Equations):
    """Equations whose unknowns have limits and scales, and steps towards the targets.

    Args:
        graph, goals, unknowns, budget, base: as in `Equations`.
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
        affine = graph.affine(self._trial.depends)
        self._is_affine = all(affine[root] for root in self._roots)
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

    def _descend(
        self, x: Point, equations: Sequence[Equation], rounds: int = ROUNDS, is_to_end: bool = False
    ) -> Optional[Descent]:
        """Descend from a point in steps that each bring the results nearer; None if they are undefined at that point.

        Args:
            x: the first point.
            equations: the equations to meet.
            rounds: the largest number of steps.
            is_to_end: whether it goes on to where the results come no nearer, as they cannot be met.
        """
        values = self._tried(x)
        missing = self._missing(values, equations)
        if values is None or missing is None:
            return None
        size = math.hypot(*missing)
        radius = self._radius(x)
        dampings = DAMPINGS_TO_END if is_to_end else DAMPINGS
        level = 0
        for _ in range(rounds):
            if size <= EXACT * math.sqrt(len(equations)):
                break
            try:
                rows = self._jacobian(values, equations)
            except Exhausted:
                raise
            except UNDEFINED:
                break
            for attempt in range(level, len(dampings)):
                try:
                    step = self._step(x, rows, missing, dampings[attempt], not is_to_end)
                except Exhausted:
                    raise
                except UNDEFINED:
                    continue
                length = self._length(step)
                if not 0 < length < math.inf:
                    continue
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
            x, values, missing, size = ahead, there, left, size - gain
            if gain <= (EXACT if is_to_end else STALLED) * size:
                break
        return Descent(x, size)

    def _radius(self, x: Point) -> float:
        """The length of the first step: the slopes at a point foretell results that are not affine only so far."""
        if self._is_affine:
            return math.inf
        return max([1.0] + [abs(value) / scale for value, scale in zip(x, self._scales)])

    def _ahead(
        self, x: Point, step: Point, part: float, equations: Sequence[Equation]
    ) -> Tuple[Point, Optional[List[Value]], Optional[List[float]]]:
        """Take a part of a step: return the new point, the nodes' values and the remaining differences."""
        ahead = [self._clamped(place, value + part * way) for place, (value, way) in enumerate(zip(x, step))]
        there = self._tried(ahead)
        return ahead, there, self._missing(there, equations)
