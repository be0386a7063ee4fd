"""Sensitivity of results to sources, and the nearest answers to targets that cannot be met exactly.

`solve` answers exactly or not at all. A drag with the mouse may ask for a target just beyond reach, or for a quaternion
that was rounded to 32 bits.
"""

import math
from typing import Any, Collection, Dict, List, Mapping, Optional, Sequence, Tuple

from ..annotations import Value
from ..graph import UNDEFINED, Graph, evaluate
from ..sources import Source
from ..tracked import TRACKED
from .budget import Budget
from .freedom import Bounds, Freedom, Rank, rank_of
from .system import System


def source_values(xs: Sequence[Value]) -> Dict[Source, Value]:
    """The sources of several values, each with its value as the first of them that has it knows it.

    Args:
        xs: tracked scalars; plain ones have no sources.
    """
    graph = Graph(x for x in xs if type(x) in TRACKED)
    return {source: graph.nodes[places[0]]._plain for source, places in graph.occurrences.items()}


def slopes(xs: Sequence[Value]) -> Dict[Source, Tuple[float, ...]]:
    """The first derivatives of several values at the present ones.

    Args:
        xs: tracked or plain numbers.

    Returns:
        `{Source: (slope of xs[0], slope of xs[1], ...)}`, in order of appearance, for each source that holds a float or
        a whole number; in the units of the values per unit of the source. A slope is 0 if a value does not depend on
        the source, or if it has no slope or none that a float holds.
    """
    graph = Graph(x for x in xs if type(x) in TRACKED)
    partials = graph.partials(graph.steps(), graph.plain())
    found: Dict[Source, List[float]] = {
        source: [0.0] * len(xs) for source in graph.occurrences if _is_number(graph, source)
    }
    for number, x in enumerate(xs):
        if type(x) not in TRACKED:
            continue
        root = graph.index[id(x)]
        for source, slope in graph.gradient(root, partials, graph.below(root, partials)).items():
            if source in found:
                found[source][number] = _as_float(slope)
    return {source: tuple(row) for source, row in found.items()}


def effects(
    x: Value, *, bounds: Optional[Bounds] = None, weights: Optional[Mapping[Source, float]] = None
) -> Dict[Source, float]:
    """By how much each source moves a number for its size, which is its slope times the scale of the source.

    Args:
        x: a tracked number.
        bounds, weights: as in `solve`, which say the scales.

    Returns:
        `{Source: effect}`, the strongest first, in the unit of `x`; never negative.
    """
    freedom = Freedom(None, bounds or {}, (), lambda source: 0, weights or {})
    present = source_values([x])
    found = {source: abs(slope) * freedom.scale(source, present[source]) for source, (slope,) in slopes([x]).items()}
    return dict(sorted(found.items(), key=lambda one: -one[1]))


def nearest(
    xs: Sequence[Value],
    targets: Sequence[float],
    *,
    bounds: Optional[Bounds] = None,
    read_only: Collection[Source] = (),
    sources: Optional[Collection[Source]] = None,
    rank: Optional[Rank] = None,
    weights: Optional[Mapping[Source, float]] = None,
) -> Tuple[Dict[Source, Value], float]:
    """The source values that bring several results as near to their targets as they come from the present values.

    Args:
        xs: tracked numbers; plain ones stay as they are.
        targets: as many numbers, in the units of `xs`.
        bounds: `{Source: (minimum or None, maximum or None)}`; a source that is stopped by one has exactly that value.
        read_only: sources that may not change.
        sources: change no other than these.
        rank: as in `solve`; those of a higher rank change only if those of lower ranks come no nearer.
        weights: `{Source: how hard it is to move}`, as in `solve`.

    Returns:
        `{Source: new value}` of the sources that change, `{}` if nothing comes nearer, and the Euclidean distance of
        the results from the targets that remains. Texts and bools stay; whole numbers are rounded at the end.
    """
    if len(xs) != len(targets):
        raise ValueError('%d values and %d targets' % (len(xs), len(targets)))
    freedom = Freedom(sources, bounds or {}, read_only, rank_of(rank), weights or {})
    goals = [('', x, float(target)) for x, target in zip(xs, targets) if type(x) in TRACKED]
    graph = Graph(x for _, x, _ in goals)
    movable = [source for source in graph.occurrences if freedom.allows(source) and _is_number(graph, source)]
    present = _distance(xs, targets, {})
    for level in sorted(set(map(freedom.rank, movable))):
        unknowns = [source for source in movable if freedom.rank(source) <= level]
        try:
            found = System(graph, goals, unknowns, freedom, Budget.of(graph)).closest()
        except UNDEFINED:
            continue  # there is a result that no float holds
        changes: Dict[Source, Value] = {}
        for source, value in zip(unknowns, found):
            old = graph.nodes[graph.occurrences[source][0]]._plain
            new = _whole(value, old, *freedom.limits(source)) if isinstance(old, int) else value
            if new != old:
                changes[source] = new
        distance = _distance(xs, targets, changes)
        if distance < present:
            return changes, distance
    return {}, present


def _whole(value: float, old: int, low: Value, high: Value) -> int:
    """The whole number nearest a value within bounds; the old one if there is none between them."""
    least = math.ceil(low) if low > -math.inf else low
    most = math.floor(high) if high < math.inf else high
    return min(max(round(value), least), most) if least <= most else old


def _is_number(graph: Graph, source: Source) -> bool:
    return all(type(graph.nodes[place]._plain) in (float, int) for place in graph.occurrences[source])


def _as_float(slope: Any) -> float:
    try:
        return float(slope)
    except OverflowError:
        return 0.0


def _distance(xs: Sequence[Value], targets: Sequence[float], changes: Dict[Source, Value]) -> float:
    try:
        missing = [float(target - evaluate(x, changes)) for x, target in zip(xs, targets)]
    except UNDEFINED:
        return float('inf')
    return sum(part * part for part in missing) ** 0.5
