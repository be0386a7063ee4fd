"""Solving along a path: a hand moves the target little by little, and no source may jump or drift.

If each step were solved from the one before, the joints of a redundant arm would be elsewhere when the hand is back
where it began. If each step were solved from the beginning, the joints would jump whenever a different answer becomes
the nearer one. So the answer is the one that the straight way from the beginning leads to, which depends on the target
alone. If that would be a jump, it is the one that the last answer leads to, drawn towards the first.

A hand means few numbers: as many sources move as the results have degrees of freedom, three for a point and one for a
ring, and the other sources are held. If these do not suffice, all move.
"""

import math
from typing import Collection, Dict, Iterator, List, Mapping, Optional, Sequence

from ..annotations import Value
from ..errors import NotInvertible
from ..graph import UNDEFINED, Graph
from ..sources import Source
from ..tolerances import RELATIVE
from .budget import Budget
from .components import connected
from .equations import Goal, Point
from .freedom import Bounds, Freedom, Rank, rank_of
from .least_squares import shortest_step
from .periods import turns_too_many
from .solving import holds_floats, solve, solve_one, target_of, tracked_parts
from .system import FOLLOWED_STEPS, System

JUMP = 5.0
"""A step is a jump if it is this many times as long as its slopes predict."""

SINGULAR = 1e-10
"""The damping of directions in which the results hardly move, for the length that the slopes predict."""

HALF_TURN = math.pi
"""An unknown that is further than this, in radians, from where it was is looked at for whole periods."""

CATCH_UP = 1.5
"""By how many times the way that the hand asks for it is drawn at most."""


class Path(System):
    """Equations whose solutions follow each other along a path. `start` is where it began."""

    def continued(self, last: Point) -> Optional[Point]:
        """The solution that the last one leads to, as near as it comes to the beginning; None if there is none."""
        for x in self._candidates(last):
            if self.accepts(x) and self.is_continuous(last, x):
                return x
        return None

    def _candidates(self, last: Point) -> Iterator[Point]:
        """Solutions in the order in which they are taken, if they are not jumps.

        The first two depend on the target alone, so they come back where it does.
        """
        yield self._turned(self.start, last)
        straight = self._followed()
        met = straight and self._descend(straight, self._equations)
        goal = self._turned(met.x, last) if met else self.start
        if met:
            yield goal
        end = self._descend(last, self._equations)
        if end is not None and self.accepts(end.x):
            yield self._drawn(end.x, goal, CATCH_UP * self._between(end.x, last))
            yield end.x

    def _turned(self, x: Point, last: Point) -> Point:
        """A point turned by whole periods to where it is nearest the last one: a hand that has gone around the base of
        an arm has turned its first joint once."""
        far = [place for place, value in enumerate(x) if abs(value - last[place]) > HALF_TURN]
        if not far or not self._periods:
            return x
        values = self._tried(x)
        if values is None:
            return x
        for place, found in zip(far, self._periods.of([self._unknowns[place] for place in far], values)):
            for period in found:
                turned = list(x)
                turned[place] -= turns_too_many(last[place], x[place], period) * period
                low, high = self._limits[place]
                if turned != x and low <= turned[place] <= high and self._as_before(turned, values):
                    x = turned
                    break
        return x

    def _as_before(self, x: Point, before: List[Value]) -> bool:
        """Return True if a point gives the same results as given values of the nodes."""
        values = self._tried(x)
        return values is not None and self._are_met(values, [before[root] for root in self._roots])

    def _between(self, one: Point, other: Point) -> float:
        return self._length([a - b for a, b in zip(one, other)])

    def _drawn(self, x: Point, goal: Point, most: float) -> Point:
        """A solution drawn towards a point along the solutions, by no more than so much."""
        if len(self._unknowns) <= len(self._roots):
            return x
        for _ in range(FOLLOWED_STEPS):
            values = self._tried(x)
            if values is None:
                break
            whole = [to - value for to, value in zip(goal, x)]
            rows = self._jacobian(values, self._equations)
            try:
                lost = self._step(x, rows, [_along(row, whole) for row in rows], 0.0)
            except UNDEFINED:
                break
            way = [part - across for part, across in zip(whole, lost)]
            length = self._length(way)
            if length <= RELATIVE * self._length(whole):
                break
            part = min(1.0, most / length)
            ahead = [self._clamped(place, value + part * step) for place, (value, step) in enumerate(zip(x, way))]
            end = self._descend(ahead, self._equations, rounds=6)
            if end is None or not self.accepts(end.x) or self._between(end.x, goal) >= self._length(whole):
                break
            most -= self._between(end.x, x)
            x = end.x
            if most <= 0:
                break
        return x

    def is_continuous(self, last: Point, x: Point) -> bool:
        """Return True if the slopes between two points explain the distance between them, so that it is no jump: those
        of the unknowns that differ, as the others are held, also if they would need to move less."""
        way = [value - old for value, old in zip(x, last)]
        length = self._length(way)
        if length <= RELATIVE * max([1.0] + [abs(value) / scale for value, scale in zip(x, self._scales)]):
            return True
        before, after = self._tried(last), self._tried(x)
        if before is None or after is None:
            return False
        moved = [(after[equation.place] - before[equation.place]) * equation.unit for equation in self._equations]
        asked = []
        for number in range(5):
            values = self._tried([old + number / 4 * step for old, step in zip(last, way)])
            if values is None:
                return False
            rows = [
                {place: slope for place, slope in row.items() if way[place]}
                for row in self._jacobian(values, self._equations)
            ]
            try:
                asked.append(self._length(shortest_step(rows, moved, self._scales, SINGULAR)))
            except UNDEFINED:
                return False
        return length <= JUMP * sorted(asked)[len(asked) // 2]

    def is_on_the_way(self, last: Point, x: Point) -> bool:
        """Return True if a point is on a way without a jump from the last one to what one result should become."""
        before, after = self._tried(last), self._tried(x)
        if before is None or after is None:
            return False
        (equation,) = self._equations
        gone, left = after[equation.place] - before[equation.place], equation.wanted - after[equation.place]
        return bool(gone * left > 0) and self.is_continuous(last, x)


def _along(row: Mapping[int, float], way: Sequence[float]) -> float:
    return sum([slope * way[place] for place, slope in row.items()])


def continued(
    xs: Sequence[Value],
    targets: Sequence[Value],
    last: Mapping[Source, Value],
    *,
    sources: Optional[Collection[Source]] = None,
    bounds: Optional[Bounds] = None,
    read_only: Collection[Source] = (),
    rank: Optional[Rank] = None,
    weights: Optional[Mapping[Source, float]] = None,
) -> Dict[Source, Value]:
    """The next answer on a path of targets, without a jump from the last one, and without drift.

    Args:
        xs: tracked scalars with the source values that they had where the path began; plain ones stay.
        targets: as many values.
        last: `{Source: value}` of the last answer on this path, `{}` at its beginning.
        sources, bounds, read_only, rank, weights: as in `solve`.

    Returns:
        `{Source: new value}` of all sources that differ from the beginning. On a path that comes back to where it began
        that is `{}`.

    Raises:
        NotTracked, NotInvertible: as in `solve`; also if there are answers, but none that the last one leads to.
            The previous values should then stay, and `last` too.
    """
    options: Dict[str, Value] = {
        'sources': sources,
        'bounds': bounds,
        'read_only': read_only,
        'rank': rank,
        'weights': weights,
        'restarts': False,
    }
    freedom = Freedom(None if sources is None else list(sources), bounds or {}, read_only, rank_of(rank), weights or {})
    goals = [(path, x, target_of(x, wanted)) for path, x, wanted in tracked_parts(list(xs), list(targets))]
    if not last:
        return _tidied(goals, freedom, solve(list(xs), list(targets), **{**options, 'restarts': True}))
    graph = Graph(x for _, x, _ in goals)
    answer: Dict[Source, Value] = {}
    for group in connected(graph, goals, freedom):
        answer.update(_tidied(group, freedom, _group_continued(group, freedom, last, options)))
    return answer


def _tidied(goals: List[Goal], freedom: Freedom, answer: Dict[Source, Value]) -> Dict[Source, Value]:
    """An answer without what rounding did to its floats."""
    graph = Graph(x for _, x, _ in goals)
    floats = [source for source in answer if holds_floats(graph, source)]
    if not floats:
        return answer
    rest = {source: value for source, value in answer.items() if source not in floats}
    try:
        system = System(graph, goals, floats, freedom, Budget.of(graph), graph.values(rest))
        return _changed(graph, {**rest, **dict(zip(floats, system.tidied([answer[source] for source in floats])))})
    except UNDEFINED:
        return answer


def _group_continued(
    goals: List[Goal], freedom: Freedom, last: Mapping[Source, Value], options: Dict[str, Value]
) -> Dict[Source, Value]:
    """Continue the last answer without a jump, for a group of results that share sources."""
    graph = Graph(x for _, x, _ in goals)
    here = _changed(graph, {source: last[source] for source in graph.occurrences if source in last})
    movable = [source for source in freedom.ranked(graph.occurrences) if freedom.allows(source)]
    floats = [source for source in movable if holds_floats(graph, source)]
    anew: Dict[Source, Value] = {}
    reason: Optional[NotInvertible] = None
    if len(goals) == 1 or len(floats) < len(movable):
        try:
            anew = solve([x for _, x, _ in goals], [wanted for _, _, wanted in goals], **options)
        except NotInvertible as error:
            reason = error
        if reason is None and not (set(floats) >= set(anew) and set(floats) >= set(here)):
            return anew  # Whole numbers move in jumps.
    path = _path(graph, goals, floats, freedom)
    if path is None or not floats:
        if reason is not None:
            raise reason
        return anew
    x: Point = [float(here.get(source, start)) for source, start in zip(floats, path.start)]
    try:
        if len(goals) > 1:
            for unknowns in _moved_first(graph, goals, floats, freedom):
                part = path if len(unknowns) == len(floats) else _path(graph, goals, unknowns, freedom)
                if part is None:
                    continue
                found = part.continued([x[floats.index(source)] for source in unknowns])
                if found is not None:
                    new = {**dict(zip(floats, path.start)), **dict(zip(unknowns, found))}
                    if path.is_continuous(x, [new[source] for source in floats]):
                        return _changed(graph, new)
        elif reason is None and path.is_continuous(x, [float(anew.get(s, b)) for s, b in zip(floats, path.start)]):
            return anew
        else:
            return _one_more(graph, goals[0], floats, freedom, here, path)
    except UNDEFINED:
        pass
    raise reason or NotInvertible('there is no answer that the last one leads to without a jump')


def _moved_first(graph: Graph, goals: List[Goal], floats: List[Source], freedom: Freedom) -> Iterator[List[Source]]:
    """The sources as they are tried in turn: those of low rank first, of these as few as suffice, then all."""
    for level in sorted(set(map(freedom.rank, floats))):
        unknowns = [source for source in floats if freedom.rank(source) <= level]
        path = _path(graph, goals, unknowns, freedom)
        few = [] if path is None else path.fewest()
        if few:
            yield few
        if len(few) < len(unknowns):
            yield unknowns


def _one_more(
    graph: Graph, goal: Goal, floats: List[Source], freedom: Freedom, here: Mapping[Source, Value], path: Path
) -> Dict[Source, Value]:
    """Move a second source when the first is at its limit; on the way back, the second one moves first, as far as to
    where it began."""
    _, value, wanted = goal
    x = [float(here.get(source, start)) for source, start in zip(floats, path.start)]
    reason: Optional[NotInvertible] = None
    for source in sorted(floats, key=lambda one: one not in here or -floats.index(one)):
        others = {one: new for one, new in here.items() if one != source}
        back = [float(others.get(one, start)) for one, start in zip(floats, path.start)]
        if source in here and path.is_on_the_way(x, back):
            return _one_more(graph, goal, floats, freedom, others, path)
        try:
            found = solve_one(value, wanted, freedom._replace(only=[source]), others)
        except NotInvertible as error:
            reason = reason or error
            continue
        new = {**others, **found}
        if path.is_continuous(x, [float(new.get(one, start)) for one, start in zip(floats, path.start)]):
            return _changed(graph, new)
    raise reason or NotInvertible('there is no answer that the last one leads to without a jump')


def _path(graph: Graph, goals: List[Goal], unknowns: List[Source], freedom: Freedom) -> Optional[Path]:
    try:
        return Path(graph, goals, unknowns, freedom, Budget.of(graph))
    except UNDEFINED:
        return None


def _changed(graph: Graph, new: Mapping[Source, Value]) -> Dict[Source, Value]:
    """The values that differ from those in the graph."""
    return {
        source: value
        for source, value in new.items()
        if any(graph.nodes[place]._plain != value for place in graph.occurrences[source])
    }
