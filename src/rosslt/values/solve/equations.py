"""Results as functions of several sources: what is missing of them, their slopes, and what is left of them when
their outermost operations are undone."""

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from ..graph import Graph
from ..operations.table import DIVIDE
from ..sources import Source
from .budget import UNDEFINED, Budget, Trial
from .least_squares import Rows
from .one import undone

Goal = Tuple[str, Any, Any]
"""`(path, tracked value, wanted value)`."""

Point = List[float]
"""A value for each unknown."""


class Equation(NamedTuple):
    """A node's value that is wanted: `value == wanted + factor * other value`.

    Attributes:
        place: the node's place in the graph.
        wanted: what is wanted of it.
        unit: what a difference of 1 counts.
        other: the place of another node, None for none.
        factor: how often that one's value is added.
    """

    place: int
    wanted: Any
    unit: float
    other: Optional[int] = None
    factor: float = 0.0


class Equations:
    """Results of a graph as functions of several sources that hold numbers.

    Args:
        graph: holds the results.
        goals: `(path, tracked value, wanted value)` each.
        unknowns: the sources to change.
        budget: what solving may cost.
        base: the values of the graph's nodes while nothing changes; the present ones by default.

    Raises:
        OverflowError, TypeError: a result is a whole number that no float holds, or no real number.
    """

    def __init__(
        self, graph: Graph, goals: List[Goal], unknowns: List[Source], budget: Budget, base: Optional[List[Any]]
    ) -> None:
        self._graph = graph
        self._unknowns = unknowns
        self._column = {source: column for column, source in enumerate(unknowns)}
        self._roots = [graph.index[id(value)] for _, value, _ in goals]
        self._wanted = [wanted for _, _, wanted in goals]
        self._budget = budget
        base = graph.plain() if base is None else base
        self._trial = Trial(graph, unknowns, self._roots, base, budget, self._wanted)
        self._size = size_of(goals)
        self._present = [float(base[root]) for root in self._roots]
        self._equations = [
            Equation(root, float(wanted), _unit(wanted, at, 1e-6 * self._size))
            for root, wanted, at in zip(self._roots, self._wanted, self._present)
        ]
        self._below: Dict[int, List[int]] = {}
        self.start = [float(base[graph.occurrences[source][0]]) for source in unknowns]

    def _tried(self, x: Point) -> Optional[List[Any]]:
        """The nodes' values at a point; None where one is not defined, or the point is not finite."""
        if not all(map(math.isfinite, x)):
            return None
        return self._trial.tried(dict(zip(self._unknowns, x)))

    def _missing(self, values: Optional[List[Any]], equations: Sequence[Equation]) -> Optional[List[float]]:
        """By how much each node's value is too small, in its unit; None where one is not defined."""
        if values is None:
            return None
        try:
            missing = [
                float(
                    (wanted - values[place] if other is None else wanted + factor * values[other] - values[place])
                    * unit
                )
                for place, wanted, unit, other, factor in equations
            ]
        except UNDEFINED:
            return None
        return missing if all(math.isfinite(part) for part in missing) else None

    def _jacobian(self, values: List[Any], equations: Sequence[Equation]) -> Rows:
        """The slopes of each node's value, in its unit, for each unknown; without zeros."""
        partials = self._trial.partials(values)
        rows: Rows = [{} for _ in equations]
        terms = [(row, one.place, one.unit) for row, one in zip(rows, equations)]
        terms += [
            (row, one.other, -one.factor * one.unit) for row, one in zip(rows, equations) if one.other is not None
        ]
        if len(self._unknowns) * 4 < len(equations):
            self._budget.spend(len(self._unknowns) * len(partials))
            for column, source in enumerate(self._unknowns):
                rise = self._graph.tangent(source, partials)
                for row, place, unit in terms:
                    slope = rise.get(place)
                    if slope:
                        row[column] = row.get(column, 0.0) + _finite(slope * unit)
            return rows
        for row, place, unit in terms:
            below = self._below.get(place)
            if below is None:
                below = self._below[place] = self._graph.below(place, partials)
            self._budget.spend(2 * len(below))
            for source, slope in self._graph.gradient(place, partials, below).items():
                column_of = self._column.get(source)
                if slope and column_of is not None:
                    row[column_of] = row.get(column_of, 0.0) + _finite(slope * unit)
        return rows

    def _undone(self, x: Point) -> Optional[List[Equation]]:
        """The equations with the outermost operations undone, on the branches of a point, quotients as products.

        Returns:
            None where there is nothing to undo, or the results are not defined there.
        """
        values = self._tried(x)
        if values is None:
            return None
        equations = [self._undone_one(equation, values) for equation in self._equations]
        return None if equations == self._equations else equations

    def _undone_one(self, equation: Equation, values: List[Any]) -> Equation:
        records, index, depends = self._graph.records, self._graph.index, self._trial.depends
        place, wanted = equation.place, equation.wanted
        try:
            while True:
                form, first, second = records[place]
                if form.operation is None:
                    break
                a = index[id(first)]
                if form.single_operand:
                    wanted = float(undone(form, form.inverse, wanted, values[a], second))
                    place = a
                    continue
                b = index[id(second)]
                if depends[a] and depends[b]:
                    if form.operation is DIVIDE:
                        unit = _unit(values[a], wanted * values[b], 0.0)
                        return Equation(a, 0.0, unit, b, float(wanted))
                    break
                side = 0 if depends[a] else 1
                wanted = float(undone(form, form.inverse[side], wanted, values[a], values[b]))
                place = b if side else a
            return equation if place == equation.place else Equation(place, wanted, _unit(wanted, values[place], 0.0))
        except UNDEFINED:
            return equation if place == equation.place else Equation(place, wanted, _unit(wanted, values[place], 0.0))


def _unit(wanted: Any, present: Any, least: float) -> float:
    """What a difference counts of a value that is and becomes so large."""
    try:
        size = max(abs(float(wanted)), abs(float(present)), least)
    except UNDEFINED:
        return 1.0
    return 1.0 / size if 1e-300 < size < math.inf else 1.0


def _finite(slope: Any) -> float:
    slope = float(slope)
    if not math.isfinite(slope):
        raise OverflowError('a slope that no float holds')
    return slope


def size_of(goals: List[Goal]) -> float:
    """The size of what is being moved, from where and to where: next to 0, no result can come nearer than a small part
    of that."""
    return max(
        (abs(part) for _, value, wanted in goals if not isinstance(value, str) for part in (value._plain, wanted)),
        default=1.0,
    )
