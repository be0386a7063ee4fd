"""Results as functions of several sources: their residuals and their slopes."""

import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from ..accelerator import CORE
from ..annotations import Value
from ..graph import UNDEFINED, Graph
from ..sources import Source
from ..tolerances import almost_meets
from .budget import WORK_OF_A_SLOPE, Budget, Trial
from .least_squares import HUGE, Rows
from .periods import Periods

Goal = Tuple[str, Value, Value]
"""`(path, tracked value, wanted value)`."""

Point = List[float]
"""A value for each unknown."""


class Equation(NamedTuple):
    """An equation: the value of a node and the value wanted of it.

    Attributes:
        place: the node's index in the graph.
        wanted: the wanted value.
        unit: the weight of a difference of 1.
    """

    place: int
    wanted: Value
    unit: float


class Equations:
    """Results of a graph as functions of several sources that hold numbers.

    Args:
        graph: holds the results.
        goals: `(path, tracked value, wanted value)` each.
        unknowns: the sources to change.
        budget: the work that solving may take.
        base: the values of the graph's nodes while nothing changes; the present ones by default.

    Raises:
        OverflowError, TypeError: a result is a whole number that no float holds, or no real number.
    """

    def __init__(
        self, graph: Graph, goals: List[Goal], unknowns: List[Source], budget: Budget, base: Optional[List[Value]]
    ) -> None:
        self._graph = graph
        self._unknowns = unknowns
        self._roots = [graph.index[id(value)] for _, value, _ in goals]
        self._wanted = [wanted for _, _, wanted in goals]
        self._budget = budget
        base = graph.plain() if base is None else base
        self._trial = Trial(graph, unknowns, self._roots, base, budget)
        self._size = size_of(goals)
        self._present = [float(base[root]) for root in self._roots]
        self._equations = [
            Equation(root, float(wanted), _unit(wanted, at, 1e-6 * self._size))
            for root, wanted, at in zip(self._roots, self._wanted, self._present)
        ]
        self._occurrences = [graph.occurrences[source] for source in unknowns]
        self._columns = {source: column for column, source in enumerate(unknowns)}
        self._below: Dict[int, List[int]] = {}
        self._periods_found: Optional[Periods] = None
        self.start = [float(base[graph.occurrences[source][0]]) for source in unknowns]
        is_one = all(
            base[at] == start for source, start in zip(unknowns, self.start) for at in graph.occurrences[source]
        )
        self._tried_last: List[Tuple[Point, Optional[List[Value]]]] = [(list(self.start), base)] if is_one else []

    @property
    def _periods(self) -> Periods:
        if self._periods_found is None:
            self._periods_found = Periods(self._trial)
        return self._periods_found

    def _tried(self, x: Point) -> Optional[List[Value]]:
        """The nodes' values at a point; None if one is not defined, or the point is not finite."""
        for known, values in self._tried_last:
            if x == known:
                return values
        if not all(map(math.isfinite, x)):
            self._budget.spend(len(x))
            return None
        values = self._trial.tried(dict(zip(self._unknowns, x)))
        self._tried_last = [(list(x), values), *self._tried_last[:1]]
        return values

    def _missing(self, values: Optional[List[Value]], equations: Sequence[Equation]) -> Optional[List[float]]:
        """By how much each node's value is too small, in its unit; None if one is not defined."""
        if values is None:
            return None
        try:
            missing = [float((wanted - values[place]) * unit) for place, wanted, unit in equations]
        except UNDEFINED:
            return None
        return missing if all(math.isfinite(part) for part in missing) else None

    def _jacobian(self, values: List[Value], equations: Sequence[Equation]) -> Rows:
        """The slopes of each node's value, in its unit, for each unknown; without zeros.

        Raises:
            OverflowError: no float holds one.
        """
        places = [equation.place for equation in equations]
        known = self._jacobian_of_tape(values, places, equations)
        if known is not None:
            return known
        rows = []
        for row, equation in zip(self._slopes(values, places), equations):
            weighed = {column: float(slope * equation.unit) for column, slope in sorted(row.items())}
            rows.append({column: slope for column, slope in weighed.items() if slope})
        if not all(math.isfinite(slope) for row in rows for slope in row.values()):
            raise OverflowError('a slope that no float holds')
        return rows

    def _jacobian_of_tape(
        self, values: List[Value], places: List[int], equations: Sequence[Equation]
    ) -> Optional[Rows]:
        """`_jacobian` by the compiled core, None if it does not know all operations or the way to the sources."""
        tape, width = self._trial.tape, len(self._unknowns)
        is_forwards = width < len(places)
        if tape is None or min(width, len(places)) >= HUGE:
            return None
        below = None
        if not is_forwards:
            missing = not self._below.keys() >= set(places)
            operands = self._trial.operands() if missing else {}
            below = [self._below_of(place, operands) for place in places]
        self._budget.spend(self._trial.work * WORK_OF_A_SLOPE)
        self._budget.spend(2 * sum(map(len, below)) if below is not None else width * len(self._trial.steps))
        units = [equation.unit for equation in equations]
        rows: Rows = CORE.tape_slopes(tape, values, self._occurrences, places, units, below)
        return rows

    def _below_of(self, place: int, partials: Dict[int, tuple]) -> List[int]:
        if place not in self._below:
            self._below[place] = self._graph.below(place, partials)
        return self._below[place]

    def _slopes(self, values: List[Value], places: List[int]) -> Rows:
        """The slopes of nodes for each unknown, at such values."""
        partials = self._trial.partials(values)
        rows: Rows = [{} for _ in places]
        if len(self._unknowns) < len(places):
            self._budget.spend(len(self._unknowns) * len(partials))
            for column, source in enumerate(self._unknowns):
                rise = self._graph.tangent(source, partials, 1.0)
                for row, place in zip(rows, places):
                    row[column] = rise.get(place, 0)
        else:
            for row, place in zip(rows, places):
                below = self._below_of(place, partials)
                self._budget.spend(2 * len(below))
                for source, slope in self._graph.gradient(place, partials, below, 1.0).items():
                    if source in self._columns:
                        row[self._columns[source]] = slope
        return rows


def _unit(wanted: Value, present: Value, least: float) -> float:
    """Return the weight of a difference: one over the larger size of the wanted and the present value."""
    try:
        size = max(abs(float(wanted)), abs(float(present)), least)
    except UNDEFINED:
        return 1.0
    return 1.0 / size if 1e-300 < size < math.inf else 1.0


def size_of(goals: List[Goal]) -> float:
    """The largest of the present values and targets, by which rounding errors of a result near 0 are judged."""
    return max(
        (abs(part) for _, value, wanted in goals if not isinstance(value, str) for part in (value._plain, wanted)),
        default=1.0,
    )


def missed(graph: Graph, goals: List[Goal], values: Optional[List[Value]]) -> Optional[Tuple[Goal, Value]]:
    """The first goal that is not met by such values of the nodes, with its result; None if all are met."""
    if values is None:
        return goals[0], math.nan
    size = size_of(goals)
    for goal in goals:
        result = values[graph.index[id(goal[1])]]
        if not almost_meets(result, goal[2], size):
            return goal, result
    return None
