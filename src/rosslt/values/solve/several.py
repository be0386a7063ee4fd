"""Several sources at once: Gauss-Newton with exact slopes in a trust region, from the present values.

Of all source values that give the results, those nearest the present ones are taken (Euclidean, in the sources' scales):
dragging the tip of an arm, of which only the forward kinematics is known, turns its joints as little as it can.
"""

import math
import random
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from ..closeness import ROUNDING, almost_meets, is_at
from ..graph import Graph
from ..operations.table import DIVIDE
from ..sources import Source
from .budget import UNDEFINED, Budget, Exhausted, Trial
from .least_squares import Rows, shortest_step, work_of_step
from .one import undone
from .periods import has_periods, periods, turns_too_many

ROUNDS = 50
DAMPINGS = (0.0, 1e-8, 1e-5, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e3)
STIRS = (1e-2, 0.1, 0.5)
"""By how much the start is moved, in turn, where the slopes at the present values lead nowhere (a straight arm)."""

RADII = (0.3, 1.0, 2.0, 3.0)
"""How far from the present values the later starts lie, in turn."""

FIRST_DAMPING, LAST_DAMPING = 1e-3, 1e9
MOST_APPROACHES = 200
"""How a descent to what cannot be met is damped, and how many steps it takes at most."""

MOST_STARTS = 120
FOLLOWED_STEPS = 8
"""In how many steps the results are moved along the straight way to what is wanted."""

ENOUGH_DEAD_ENDS = 12
"""So many starts that end in the same place short of the target show that it is out of reach."""

FIRST_RADIUS = 1.0
"""How far the first step may go, in the sources' scales or sizes, unless the results follow it as a line does."""

MET = 1e-10
"""Results that miss no more than this part of their size are met; what is left to do is to polish them."""

STRAIGHT = 1e-3
"""Where a step leaves no more than this part of what was missing, the results follow the slopes as a line does."""

SHORT_WAY = 0.25
"""A source that moves by no more than this is not looked at for whole periods."""

LONG = 2.0
"""An answer that is so many times as far away as the slopes promise is worth a look for a nearer one."""

Goal = Tuple[str, Any, Any]
Point = List[float]


class Descent(NamedTuple):
    """Where a descent ended: the point, and how much is missing there."""

    x: Point
    size: float


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


class System:
    """Results of a graph as functions of several sources that hold numbers.

    Args:
        graph: holds the results.
        goals: `(path, tracked value, wanted value)` each.
        unknowns: the sources to change.
        freedom: what limits them (`choice.Freedom`).
        budget: what solving may cost.
        base: the values of the graph's nodes while nothing changes; the present ones by default.
    """

    def __init__(
        self,
        graph: Graph,
        goals: List[Goal],
        unknowns: List[Source],
        freedom: Any,
        budget: Budget,
        base: Optional[List[Any]] = None,
    ) -> None:
        self._graph = graph
        self._unknowns = unknowns
        self._column = {source: column for column, source in enumerate(unknowns)}
        self._roots = [graph.index[id(value)] for _, value, _ in goals]
        self._wanted = [wanted for _, _, wanted in goals]
        self._budget = budget
        base = graph.plain() if base is None else base
        self._trial = Trial(graph, unknowns, self._roots, base, budget)
        self._limits = [freedom.limits(source) for source in unknowns]
        self._scales = [freedom.scale(source) for source in unknowns]
        self._size = size_of(goals)
        self._present = [base[root] for root in self._roots]
        self._equations = [
            Equation(root, wanted, _unit(wanted, at, 1e-6 * self._size))
            for root, wanted, at in zip(self._roots, self._wanted, self._present)
        ]
        self._below: Dict[int, List[int]] = {}
        self._promised = 0.0
        """How far away the answer is, as the first step taken promises."""
        self.start = [float(base[graph.occurrences[source][0]]) for source in unknowns]

    def solution(self) -> Optional[Point]:
        """The unknowns' values that give all results, None where none were found."""
        best: Optional[Point] = None
        dead_ends: Dict[str, int] = {}
        found = 0
        try:
            for end in self._ends():
                if not self.accepts(end.x):
                    key = '%.3g' % end.size
                    dead_ends[key] = dead_ends.get(key, 0) + 1
                    if dead_ends[key] >= ENOUGH_DEAD_ENDS and best is None:
                        break
                    continue
                x = self._nearer(self._unwound(end.x))
                best = x if best is None or self._way(x) < self._way(best) else best
                found += 1
                if self._way(best) <= LONG * self._promised or found > 3:
                    break
        except Exhausted:
            pass
        return None if best is None else self._tidied(best)

    def _ends(self) -> Iterator[Descent]:
        """Where descents end, those of the results as they are and those of what is left of them when their outermost
        operations are undone, which has no poles and does not saturate."""
        for start in self._starts():
            end = self._descend(start, self._equations)
            if end is not None:
                yield end
            undone_equations = self._undone(start)
            if undone_equations is None:
                continue
            end = self._descend(start, undone_equations)
            if end is not None and end.size < 1e-6:
                end = self._descend(end.x, self._equations)
                if end is not None:
                    yield end

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

    def closest(self) -> Point:
        """The unknowns' values that bring the results nearest to what is wanted, in the results' own units.

        Where the slopes at the present values lead nowhere, it is tried from beside them (a straight arm).
        """
        self._equations = [equation._replace(unit=1.0) for equation in self._equations]
        best, least = self.start, math.inf
        try:
            for stir in (0.0,) + STIRS[:2]:
                end = self._approach(self._stirred(stir) if stir else self.start)
                if end is not None and end.size < least * (1 - 1e-12):
                    if stir and end.size >= self._distance_at_start() * (1 - 1e-9):
                        continue
                    best, least = end.x, end.size
                if best != self.start:
                    break
        except Exhausted:
            pass
        return best

    def _distance_at_start(self) -> float:
        missing = self._missing(self._tried(self.start), self._equations)
        return math.inf if missing is None else math.hypot(*missing)

    def _approach(self, x: Point) -> Optional[Descent]:
        """Where a point moves to that comes nearer to what is wanted with every step (Levenberg-Marquardt)."""
        values = self._tried(x)
        missing = self._missing(values, self._equations)
        if values is None or missing is None:
            return None
        size, damping = math.hypot(*missing), FIRST_DAMPING
        for _ in range(MOST_APPROACHES):
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
            # The gain against the one that the slopes promise, which a step that goes too far does not keep.
            foretold = [
                part - sum([slope * way[place] for place, slope in row.items()]) for part, row in zip(missing, rows)
            ]
            promised = size - math.hypot(*foretold)
            gain = size - math.hypot(*left)
            if not gain > 0.1 * promised:
                if damping > LAST_DAMPING:
                    break
                damping *= 4
                continue
            if gain > 0.7 * promised:
                damping = max(damping / 4, 1e-12)
            x, values, missing, size = ahead, there, left, size - gain
            if not size or gain <= 1e-15 * size:
                break
        return Descent(x, size)

    def accepts(self, x: Point) -> bool:
        """Whether such values give all results."""
        values = self._tried(x)
        return values is not None and self._are_met(values, self._wanted)

    def _are_met(self, values: List[Any], wanted: Sequence[Any]) -> bool:
        return all(almost_meets(values[root], goal, self._size) for root, goal in zip(self._roots, wanted))

    def _starts(self) -> Iterator[Point]:
        """Where descents begin: at the present values, near them, along the way to the target, then further away."""
        yield self.start
        for stir in STIRS:
            yield self._stirred(stir)
        followed = self._followed()
        if followed is not None:
            yield followed
        chance = random.Random(1)
        for number in range(MOST_STARTS):
            radius = RADII[number % len(RADII)]
            start = []
            for value, (low, high), scale in zip(self.start, self._limits, self._scales):
                if number % 2 and math.isfinite(high - low):
                    start.append(chance.uniform(low, high))
                else:
                    reach = scale if number % 3 else max(scale, abs(value))
                    start.append(min(max(value + reach * chance.uniform(-radius, radius), low), high))
            yield start

    def _stirred(self, stir: float) -> Point:
        return [
            self._clamped(place, value + stir * max(scale, abs(value)) * math.cos(1.0 + 2.4 * place))
            for place, (value, scale) in enumerate(zip(self.start, self._scales))
        ]

    def _followed(self) -> Optional[Point]:
        """Where the unknowns come to when the results are moved to what is wanted in small steps."""
        x: Point = self.start
        for number in range(1, FOLLOWED_STEPS):
            part = number / FOLLOWED_STEPS
            equations = [
                equation._replace(wanted=at + part * (equation.wanted - at))
                for at, equation in zip(self._present, self._equations)
            ]
            end = self._descend(x, equations, rounds=6)
            if end is None:
                break
            x = end.x
        return x

    def _clamped(self, place: int, value: float) -> float:
        low, high = self._limits[place]
        return min(max(value, low), high)

    def _tried(self, x: Point) -> Optional[List[Any]]:
        return self._trial.tried(dict(zip(self._unknowns, x)))

    def _missing(self, values: Optional[List[Any]], equations: Sequence[Equation]) -> Optional[List[float]]:
        """By how much each node's value is too small, in its unit; None where one is not defined."""
        if values is None:
            return None
        try:
            missing = [
                float((wanted - values[place] if other is None else wanted + factor * values[other] - values[place]) * unit)
                for place, wanted, unit, other, factor in equations
            ]
        except UNDEFINED:
            return None
        return missing if all([math.isfinite(part) for part in missing]) else None

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

    def _step(self, x: Point, rows: Rows, missing: List[float], damping: float, by_row: bool = True) -> Point:
        """A step towards the results; an unknown at a bound that it would leave stays there."""
        self._budget.spend(work_of_step(rows, len(x)))
        while True:
            step = shortest_step(rows, missing, self._scales, damping, by_row)
            leaving = {
                place
                for place, (part, value, (low, high)) in enumerate(zip(step, x, self._limits))
                if part and (value >= high if part > 0 else value <= low)
            }
            if not leaving:
                return step
            rows = [{place: slope for place, slope in row.items() if place not in leaving} for row in rows]

    def _length(self, step: Point) -> float:
        return math.hypot(*[part / scale for part, scale in zip(step, self._scales)])

    def _descend(self, x: Point, equations: Sequence[Equation], rounds: int = ROUNDS) -> Optional[Descent]:
        """Where steps that each bring the results nearer lead from a point; None where they are not defined there.

        Args:
            x: where to begin.
            equations: what is to be met.
            rounds: the most steps.
        """
        values = self._tried(x)
        missing = self._missing(values, equations)
        if values is None or missing is None:
            return None
        size = math.hypot(*missing)
        radius = FIRST_RADIUS * max([1.0] + [abs(value) / scale for value, scale in zip(x, self._scales)])
        level = 0
        slow = 0
        rows: Rows = []
        for _ in range(rounds):
            if not size:
                break
            try:
                # The slopes of the round before do where they foretold the results that well.
                rows = rows or self._jacobian(values, equations)
            except Exhausted:
                raise
            except UNDEFINED:
                break
            # What is met is polished, without a search for a better way.
            for attempt in range(level, len(DAMPINGS)) if size > MET else (0,):
                try:
                    step = self._step(x, rows, missing, DAMPINGS[attempt])
                except Exhausted:
                    raise
                except UNDEFINED:
                    continue
                length = self._length(step)
                if not 0 < length < math.inf:
                    continue
                self._promised = self._promised or length
                if length > radius and attempt == level:
                    # As good as a line: however far it is.
                    ahead, there, left = self._ahead(x, step, 1.0, equations)
                    if left is not None and math.hypot(*left) <= STRAIGHT * size:
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
            if size - gain > STRAIGHT * size:
                rows = []
            x, values, missing, size = ahead, there, left, size - gain
            slow = slow + 1 if gain < 1e-3 * size else 0
            if slow > 6:
                break
        return Descent(x, size)

    def _ahead(
        self, x: Point, step: Point, part: float, equations: Sequence[Equation]
    ) -> Tuple[Point, Optional[List[Any]], Optional[List[float]]]:
        """Where a part of a step leads: the point, the nodes' values and what is missing."""
        ahead = [self._clamped(place, value + part * way) for place, (value, way) in enumerate(zip(x, step))]
        there = self._tried(ahead)
        return ahead, there, self._missing(there, equations)

    def _unwound(self, x: Point) -> Point:
        """The same answer with each unknown within half a period of its present value, where that is an answer, too."""
        far = [place for place, value in enumerate(x) if abs(value - self.start[place]) > SHORT_WAY]
        if not far or not has_periods(self._graph):
            return x
        values = self._tried(x)
        if values is None:
            return x
        partials = self._trial.partials(values)
        for place in far:
            self._budget.spend(len(partials))
            rise = self._graph.tangent(self._unknowns[place], partials)
            for period in periods(self._graph, values, rise):
                turns = turns_too_many(self.start[place], x[place], period)
                if not turns:
                    continue
                turned = list(x)
                turned[place] = self._clamped(place, x[place] - turns * period)
                if abs(turned[place] - self.start[place]) >= abs(x[place] - self.start[place]):
                    continue
                end = self._descend(turned, self._equations, rounds=3)
                if end is not None and self.accepts(end.x) and self._way(end.x) < self._way(x):
                    x = end.x
        return x

    def _nearer(self, x: Point) -> Point:
        """The solution nearest the start, from one that is near: each round steps from the start itself, along the
        slopes at the solution so far."""
        if len(self._unknowns) <= len(self._roots):
            return x
        try:
            for _ in range(ROUNDS):
                values = self._tried(x)
                missing = self._missing(values, self._equations)
                if values is None or missing is None:
                    break
                gone = [value - start for value, start in zip(x, self.start)]
                rows = self._jacobian(values, self._equations)
                needed = [
                    part + sum([slope * gone[place] for place, slope in row.items()])
                    for part, row in zip(missing, rows)
                ]
                step = self._step(self.start, rows, needed, 0.0)
                end = self._descend(
                    [self._clamped(place, start + part) for place, (start, part) in enumerate(zip(self.start, step))],
                    self._equations,
                )
                if end is None or not self.accepts(end.x) or self._way(end.x) >= self._way(x) * (1 - 1e-6):
                    break
                x = end.x
        except UNDEFINED:
            pass
        return x

    def _tidied(self, x: Point) -> Point:
        """The answer without what rounding did: what moved by no more stays where it was, what is so near a bound is
        at it, as far as that is an answer, too."""
        way = self._way(x)
        tidy = []
        for value, start, scale, (low, high) in zip(x, self.start, self._scales, self._limits):
            if abs(value - start) <= ROUNDING * max(abs(start), way * scale):
                value = start
            elif is_at(value, low) or is_at(value, high):
                value = low if is_at(value, low) else high
            tidy.append(value)
        if tidy == x:
            return x
        try:
            return tidy if self.accepts(tidy) else x
        except Exhausted:
            return x

    def _way(self, x: Point) -> float:
        return self._length([value - start for value, start in zip(x, self.start)])


def _unit(wanted: Any, present: Any, least: float) -> float:
    """What a difference counts of a value that is and becomes so large."""
    size = max(abs(float(wanted)), abs(float(present)), least)
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
