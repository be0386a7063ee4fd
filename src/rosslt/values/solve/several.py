"""Solving several results together: Gauss-Newton with the table's slopes, damped, from the present values.

Of all source values that give the results, those nearest the present ones are taken (Euclidean, in the sources' units):
dragging the tip of an arm, of which only the forward kinematics is known, turns its joints as little as it can.
"""

import math
from typing import Any, Callable, Dict, List, Optional, Tuple

from ..errors import NotInvertible
from ..explain import brief
from ..graph import Graph
from ..sources import Source, describe_source
from .least_squares import least_norm
from .one import almost_meets, meets

ROUNDS = 60
DAMPINGS = (0.0, 1e-9, 1e-6, 1e-4, 1e-2, 1.0, 100.0)
STIRS = (0.0, 1e-2, 0.1, 1.0)
"""By how much the start is moved, in turn, where the slopes at the present values lead nowhere (a straight arm)."""

Goal = Tuple[str, Any, Any]


class System:
    """Results of a graph as functions of several float sources.

    Args:
        goals: `(path, tracked value, wanted value)` each.
        unknowns: the sources to change.
    """

    def __init__(self, graph: Graph, goals: List[Goal], unknowns: List[Source], freedom: Any) -> None:
        self._graph = graph
        self._goals = goals
        self._unknowns = unknowns
        self._roots = [graph.index[id(value)] for _, value, _ in goals]
        self._wanted = [wanted for _, _, wanted in goals]
        self._depends = graph.depending(unknowns)
        last = max(self._roots)
        self._steps = [step for step in graph.steps(self._depends) if step[0] <= last]
        self._limits = [freedom.limits(source) for source in unknowns]
        self._base = graph.plain()
        self._size = size_of(goals)
        self.start = [float(self._base[graph.occurrences[source][0]]) for source in unknowns]

    def solution(self) -> Optional[List[float]]:
        """The unknowns' values that give all results, None where none were found."""
        for stir in STIRS:
            start = [
                self._clamped(
                    place, value + stir * max(1.0, abs(value)) * math.cos(1.0 + 2.4 * place) if stir else value
                )
                for place, value in enumerate(self.start)
            ]
            found = self._descent(start)
            if found is not None:
                return self._nearer(found)
        return None

    def accepts(self, x: List[float]) -> bool:
        """Whether such values give all results."""
        values = self._at(x)
        return values is not None and all(
            almost_meets(values[root], wanted, self._size) for root, wanted in zip(self._roots, self._wanted)
        )

    def _clamped(self, place: int, value: float) -> float:
        low, high = self._limits[place]
        return min(max(value, low), high)

    def _at(self, x: List[float]) -> Optional[List[Any]]:
        values = list(self._base)
        try:
            self._graph.run(self._steps, values, dict(zip(self._unknowns, x)))
        except (ArithmeticError, ValueError, TypeError):
            return None
        return values

    def _missing(self, values: Optional[List[Any]]) -> Optional[List[float]]:
        if values is None:
            return None
        try:
            missing = [float(wanted - values[root]) for root, wanted in zip(self._roots, self._wanted)]
        except (ArithmeticError, TypeError):
            return None
        return missing if all(math.isfinite(part) for part in missing) else None

    def _jacobian(self, values: List[Any]) -> List[List[float]]:
        if len(self._unknowns) >= len(self._roots):
            rows = [self._graph.gradient(root, values, self._depends) for root in self._roots]
            return [[float(row.get(source, 0)) for source in self._unknowns] for row in rows]
        columns = []
        for source in self._unknowns:
            rise, _ = self._graph.tangent(values, self._graph.depending([source]), max(self._roots))
            columns.append([float(rise[root]) for root in self._roots])
        return [list(row) for row in zip(*columns)]

    def _step(self, x: List[float], values: List[Any], missing: List[float], damping: float) -> List[float]:
        """A step towards the results; an unknown at a bound that it would leave stays there."""
        jacobian = self._jacobian(values)
        held: set = set()
        while True:
            free = [[0.0 if place in held else part for place, part in enumerate(row)] for row in jacobian]
            step = least_norm(free, missing, damping)
            leaving = {
                place
                for place, part in enumerate(step)
                if part
                and place not in held
                and (x[place] >= self._limits[place][1] if part > 0 else x[place] <= self._limits[place][0])
            }
            if not leaving:
                return step
            held |= leaving

    def _descent(self, x: List[float]) -> Optional[List[float]]:
        values = self._at(x)
        missing = self._missing(values)
        level = 0
        for _ in range(ROUNDS):
            if values is None or missing is None or not any(missing):
                break
            size = math.hypot(*missing)
            for attempt in range(level, len(DAMPINGS)):
                try:
                    step = self._step(x, values, missing, DAMPINGS[attempt])
                except (ArithmeticError, ValueError):
                    continue
                ahead = [self._clamped(place, value + part) for place, (value, part) in enumerate(zip(x, step))]
                seen = self._at(ahead)
                left = self._missing(seen)
                if left is not None and math.hypot(*left) < size:
                    level = max(0, attempt - 1)
                    x, values, missing = ahead, seen, left
                    break
            else:
                break
        return x if self.accepts(x) else None

    def _nearer(self, x: List[float]) -> List[float]:
        """The solution nearest the start, from one that is near: each round steps from the start itself, along the
        slopes at the solution so far."""
        for _ in range(ROUNDS):
            values = self._at(x)
            missing = self._missing(values)
            if values is None or missing is None:
                break
            gone = [value - start for value, start in zip(x, self.start)]
            try:
                jacobian = self._jacobian(values)
                needed = [
                    part + sum(slope * way for slope, way in zip(row, gone)) for part, row in zip(missing, jacobian)
                ]
                step = self._step(self.start, values, needed, 0.0)
            except (ArithmeticError, ValueError):
                break
            found = self._descent(
                [self._clamped(place, start + part) for place, (start, part) in enumerate(zip(self.start, step))]
            )
            if found is None or self._way(found) >= self._way(x) * (1 - 1e-6):
                break
            x = found
        return x

    def _way(self, x: List[float]) -> float:
        return math.dist(x, self.start)


def size_of(goals: List[Goal]) -> float:
    """The size of what is being moved, from where and to where: next to 0, no result can come nearer than a small part
    of that."""
    return max(
        (abs(part) for _, value, wanted in goals if not isinstance(value, str) for part in (value._plain, wanted)),
        default=1.0,
    )


def solve_together(
    graph: Graph,
    goals: List[Goal],
    freedom: Any,
    solve_one: Callable[..., Dict[Source, Any]],
) -> Dict[Source, Any]:
    """The source values that give all of several results that share sources.

    Float sources move together. Where they do not suffice (texts, whole numbers, bools), the results are solved one
    after the other, each by a source that none before it used.

    Raises:
        NotInvertible: no values were found that give all; the result that stays away is named.
    """
    concerned = list(Graph(value for _, value, _ in goals).occurrences)
    floats = [
        source
        for source in concerned
        if freedom.allows(source)
        and all(type(graph.nodes[place]._plain) is float for place in graph.occurrences[source])
    ]
    if floats and not any(isinstance(wanted, str) for _, _, wanted in goals):
        for rank in sorted(set(map(freedom.rank, floats))):
            unknowns = [source for source in floats if freedom.rank(source) <= rank]
            found = System(graph, goals, unknowns, freedom).solution()
            if found is not None:
                return dict(zip(unknowns, found))
    changes: Dict[Source, Any] = {}
    for path, value, wanted in goals:
        root = graph.index[id(value)]
        values = graph.tried(changes)
        if values is None or not meets(values[root], wanted):
            try:
                changes.update(solve_one(graph, value, wanted, freedom, changes))
            except NotInvertible as reason:
                raise NotInvertible(
                    '%s, with the others as wanted' % reason if not path else '%s: %s' % (path, reason)
                ) from None
    values = graph.tried(changes)
    for path, value, wanted in goals:
        result = values[graph.index[id(value)]] if values else math.nan
        if not almost_meets(result, wanted, size_of(goals)):
            raise NotInvertible(
                'cannot make %s %s become %r together with the others: %s would make it %r'
                % (
                    path,
                    brief(value),
                    wanted,
                    ', '.join('%s = %r' % (describe_source(source), new) for source, new in changes.items()),
                    result,
                )
            )
    return changes
