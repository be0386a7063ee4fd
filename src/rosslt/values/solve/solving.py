"""Solving: the source values that make results equal their targets (paper, IV.A, `force_value`).

Two laws hold. *PutGet*: evaluating with the answer gives the target, to a relative 1e-9, exactly for whole
numbers, bools and texts. *GetPut*: solving for the present value changes nothing. Every answer is checked before it
is returned.
"""

import contextlib
import itertools
import math
from typing import (
    Any,
    Collection,
    Dict,
    Iterator,
    List,
    Mapping,
    Optional,
    Tuple,
)

from ..accelerator import CORE
from ..annotations import Value
from ..errors import NotInvertible, NotTracked
from ..explain import brief
from ..graph import UNDEFINED, Graph, evaluate
from ..operations.inverses import refuse
from ..sources import UNKNOWN, Source, describe_source
from ..tolerances import RELATIVE, is_same, meets
from ..tracked import TRACKED, plain_scalar
from ..tree import paired
from .budget import Budget
from .components import connected
from .equations import Goal, missed
from .freedom import Bounds, Freedom, Rank, rank_of
from .scalar import Attempt, written
from .system import System

MOST_ROUNDINGS = 16
"""The most combinations of rounding whole numbers up or down."""


def solve(
    value: Value,
    target: Value,
    source: Optional[Source] = None,
    *,
    sources: Optional[Collection[Source]] = None,
    bounds: Optional[Bounds] = None,
    read_only: Collection[Source] = (),
    rank: Optional[Rank] = None,
    weights: Optional[Mapping[Source, float]] = None,
    restarts: bool = True,
) -> Dict[Source, Value]:
    """Find the source values that make a tracked value become a target.

    Args:
        value: a tracked scalar, or a message, sequence, dict or object array holding tracked leaves.
        target: plain, same shape; in the unit of `value`. In a message or sequence, None leaves a part free.
        source: change this Source alone; by default the first in order of appearance that can.
        sources: change no other than these.
        bounds: `{Source: (minimum or None, maximum or None)}` in the units of the sources.
        read_only: sources to pass over.
        rank: `{Source: rank}`, or a function of a Source; 0 for those that are missing. A source is changed only
            if those of lower rank cannot give the target.
        weights: `{Source: how hard it is to move}`, greater than 0. Of sources of one rank, those of less weight are
            tried first, and if several change together, they move further. There, a source
            that has none moves the further the wider its bounds are, or, without bounds, the larger it is; 1 stands
            for one without bounds whose size is below 2 pi.
        restarts: whether several leaves that cannot be solved for from near the present values are solved for from
            others within the bounds: in a fixed order, up to the first answer.

    Returns:
        `{Source: new value}`. For a scalar one source, with its present value if the target is the present
        value; several only if none of them alone can give the target. For several leaves the sources that
        change, by the smallest change (Euclidean) if several would do; a leaf that shares no source with
        another is solved as a scalar. `{}` if nothing has to change and the sources' present values are not
        known, as two readings of one source differ.

    Raises:
        NotTracked: nothing in `value` has a source.
        NotInvertible: no value of the sources gives the target, or none was found within the work that a solve may
            take; the operation or the bound is named.
        ValueError: the target has another shape than the value, or a weight is not greater than 0.
    """
    only = [source] if source is not None else None if sources is None else list(sources)
    if weights and not all(weight > 0 for weight in weights.values()):
        raise ValueError('weights are greater than 0, found %r' % (dict(weights),))
    freedom = Freedom(only, bounds or {}, read_only, rank_of(rank), weights or {}, restarts)
    if CORE is not None and only is None:
        # A chain of operations on one source, which is what most values are; ranks and weights do not matter.
        answer: Any = CORE.solve_chain(value, target, RELATIVE)
        is_found = answer is not None and answer is not NotImplemented
        if is_found and all(map(freedom.takes, answer, answer.values())):
            return dict(answer)
    if source is not None and source in read_only:
        raise NotInvertible('cannot change %s: it is read-only' % describe_source(source))
    if type(value) in TRACKED:
        return solve_one(value, target, freedom, {})
    return _solve_parts(value, target, freedom)


def target_of(value: Value, target: Value) -> Value:
    """A target as a plain value of a type that fits the value's.

    Raises:
        NotInvertible: a text for a number, a number for a text, or no finite number.
    """
    wanted = plain_scalar(target)
    if wanted is None or isinstance(wanted, str) != isinstance(value, str):
        raise NotInvertible(
            'cannot make %s become %r: it is a %s'
            % (brief(value), target, 'text' if isinstance(value, str) else 'number')
        )
    if isinstance(wanted, float) and not math.isfinite(wanted):
        raise NotInvertible('cannot make %s become %r: no source may hold what is not finite' % (brief(value), wanted))
    if not isinstance(value._plain, float) and isinstance(wanted, float):
        if not wanted.is_integer():
            raise NotInvertible('cannot make %s become %r: it is a whole number' % (brief(value), wanted))
        wanted = int(wanted)
    if isinstance(value._plain, bool) and wanted not in (0, 1):
        raise NotInvertible('cannot make %s become %r: it is True or False' % (brief(value), wanted))
    return wanted


def solve_one(
    value: Value, target: Value, freedom: Freedom, changes: Mapping[Source, Value], budget: Optional[Budget] = None
) -> Dict[Source, Value]:
    """Solve for one tracked value by one source, the first that can (left bias), else by several.

    Args:
        changes: values that other sources take on meanwhile; they are not changed again.
        budget: the work that it may take.

    Raises:
        NotTracked, NotInvertible: as `solve`.
    """
    graph = Graph([value])
    root = len(graph.nodes) - 1
    wanted = target_of(value, target)
    candidates = list(graph.occurrences)
    if not candidates:
        raise NotTracked('%s has no source' % brief(value))
    if freedom.only is not None and not any(source in candidates for source in freedom.only):
        raise NotInvertible(
            'cannot make %s become %s: it does not depend on %s'
            % (brief(value), written(target), ' or '.join(describe_source(source) for source in freedom.only))
        )
    budget = Budget.of(graph) if budget is None else budget
    reasons: List[str] = []
    try:
        base = graph.values(changes) if changes else graph.plain()
    except UNDEFINED:
        base = []
        reasons.append('it is not defined once the others are as wanted')
    free = [
        source
        for source in freedom.ranked(candidates)
        if source not in changes and (freedom.only is None or source in freedom.only)
    ]
    if len(free) > 1 and base:
        free = _without_noise(graph, root, base, free, freedom)
    alone = budget.share(0.8 if len(free) > 1 else 1.0)
    try:
        for source in free if base else ():
            share = alone.share(0.5)
            try:
                if source == UNKNOWN or source in freedom.read_only:
                    refuse('{source} is read-only')
                attempt = Attempt(graph, root, source, base, freedom.limits(source), share, wanted)
                return {source: attempt.answer()}
            except UNDEFINED as reason:
                text = str(reason).replace('{source}', describe_source(source))
                if text not in reasons:
                    reasons.append(text)
            alone.refund(share)
            if alone.left < 1:
                break
    finally:
        budget.refund(alone)
    if base and wanted == base[root]:
        kept = _unchanged(graph, root, base, [source for source in free if freedom.allows(source)])
        if kept is not None:
            return kept
    movable = [source for source in free if freedom.allows(source) and _holds_number(graph, source)]
    if base and len(movable) > 1 and not isinstance(wanted, str):
        goals = [('', value, wanted)]
        found = _moved_together(graph, goals, movable, freedom, budget, base)
        if found is None:
            found = _moved_with_whole(graph, goals, movable, freedom, budget, base)
        if found is not None:
            return {source: new for source, new in found.items() if not _is_present(graph, source, new)}
    raise NotInvertible(
        'cannot make %s become %s: %s'
        % (brief(value), written(target), '; '.join(reasons[:4]) or 'the other targets fix all that it comes from')
    )


def _without_noise(graph: Graph, root: int, base: List[Value], sources: List[Source], freedom: Freedom) -> List[Source]:
    """The sources without those of which rounding alone has left an influence beside the others.

    sin(pi) is 1.2e-16 in floats: a number that it is multiplied by would have to become huge.
    """
    partials = graph.partials(graph.steps(), base)
    slopes = graph.gradient(root, partials, graph.below(root, partials))
    effects: Dict[Source, float] = {}
    for source in sources:
        present = _present(graph, source)
        if type(present) in (float, int) and freedom.allows(source):
            with contextlib.suppress(OverflowError):
                effects[source] = abs(slopes.get(source, 0.0)) * freedom.scale(source, float(present))
    least = RELATIVE * max(effects.values(), default=0.0)
    return [source for source in sources if not 0.0 < effects.get(source, 0.0) < least]


def _unchanged(graph: Graph, root: int, base: List[Value], sources: List[Source]) -> Optional[Dict[Source, Value]]:
    """The answer that changes nothing: the first source with its present value, `{}` if that is not known."""
    for source in sources:
        first, *others = [graph.nodes[place]._plain for place in graph.occurrences[source]]
        if all(other == first for other in others):
            return {source: first}
    return {} if sources else None


def _holds_number(graph: Graph, source: Source) -> bool:
    return all(type(graph.nodes[place]._plain) in (float, int, bool) for place in graph.occurrences[source])


def holds_floats(graph: Graph, source: Source) -> bool:
    """Return True if a source holds a float."""
    return all(type(graph.nodes[place]._plain) is float for place in graph.occurrences[source])


def _moved_together(
    graph: Graph,
    goals: List[Goal],
    sources: List[Source],
    freedom: Freedom,
    budget: Budget,
    base: Optional[List[Value]] = None,
) -> Optional[Dict[Source, Value]]:
    """Values of several float sources that give all goals, those of low rank first; None if none were found."""
    floats = [source for source in sources if not _is_whole(graph, source)]
    for rank in sorted(set(map(freedom.rank, floats))):
        unknowns = [source for source in floats if freedom.rank(source) <= rank]
        for moving in _first_without(_out_of_bounds(graph, unknowns, freedom, base), unknowns):
            share = budget.share(0.7)
            found = _solution(graph, goals, moving, freedom, share, base)
            budget.refund(share)
            if found is not None:
                return dict(zip(moving, found))
    return None


def _restarted(
    graph: Graph, goals: List[Goal], sources: List[Source], freedom: Freedom
) -> Optional[Dict[Source, Value]]:
    """Values of all float sources that give all goals, searched for anywhere within the bounds."""
    unknowns = [source for source in sources if not _is_whole(graph, source)]
    if len(unknowns) < 2:
        return None
    try:
        found = System(graph, goals, unknowns, freedom, Budget.of_restarts(graph)).restarted()
    except UNDEFINED:
        return None
    return None if found is None else dict(zip(unknowns, found))


def _out_of_bounds(graph: Graph, sources: List[Source], freedom: Freedom, base: Optional[List[Value]]) -> List[Source]:
    """The sources whose present values are out of their bounds: if they move, they have to move back at once."""
    found = []
    for source in sources if freedom.bounds else ():
        low, high = freedom.limits(source)
        place = graph.occurrences[source][0]
        if not low <= (_present(graph, source) if base is None else base[place]) <= high:
            found.append(source)
    return found


def _first_without(some: List[Source], sources: List[Source]) -> Iterator[List[Source]]:
    """The sources without those, then with all."""
    if some:
        rest = [source for source in sources if source not in some]
        if rest:
            yield rest
    yield sources


def _moved_with_whole(
    graph: Graph,
    goals: List[Goal],
    sources: List[Source],
    freedom: Freedom,
    budget: Budget,
    base: Optional[List[Value]] = None,
) -> Optional[Dict[Source, Value]]:
    """Move several sources, some of them whole numbers: round these, then solve for the floats again."""
    whole = [source for source in sources if _is_whole(graph, source)]
    floats = [source for source in sources if source not in whole]
    truths = [source for source in whole if type(_present(graph, source)) is bool]
    freedom = freedom._replace(bounds={**freedom.bounds, **dict.fromkeys(truths, (0, 1))})
    share = budget.share(0.5)
    found = _solution(graph, goals, floats + whole, freedom, share, base) if whole else None
    budget.refund(share)
    if found is None:
        return None
    changes = _changes_of(graph, base)
    limits = [freedom.limits(source) for source in whole]
    for rounded in itertools.islice(_roundings(found[len(floats) :]), MOST_ROUNDINGS):
        if not all(low <= new <= high for new, (low, high) in zip(rounded, limits)):
            continue
        answer = {source: bool(new) if source in truths else new for source, new in zip(whole, rounded)}
        values = _values(graph, {**changes, **answer})
        if values is None:
            continue
        if floats:
            share = budget.share(0.5)
            rest = _solution(graph, goals, floats, freedom, share, values)
            budget.refund(share)
            if rest is not None:
                return {**answer, **dict(zip(floats, rest))}
        elif missed(graph, goals, values) is None:
            return answer
    return None


def _roundings(numbers: List[float]) -> Iterator[Tuple[int, ...]]:
    """Whole numbers near some numbers, all rounded to the nearest first, then with one and more of them to the other
    side, the nearer ones to a half first."""
    sides = []
    for number in numbers:
        nearest = round(number)
        sides.append((nearest, nearest + (1 if number > nearest else -1)))
    order = sorted(range(len(numbers)), key=lambda at: abs(numbers[at] - sides[at][1]))
    for count in range(len(numbers) + 1):
        for turned in itertools.combinations(order, count):
            yield tuple([sides[at][at in turned] for at in range(len(numbers))])


def _solution(
    graph: Graph,
    goals: List[Goal],
    unknowns: List[Source],
    freedom: Freedom,
    budget: Budget,
    base: Optional[List[Value]],
) -> Optional[List[float]]:
    """The unknowns' values that give all goals, None if none were found, or if no float holds what there is."""
    try:
        return System(graph, goals, unknowns, freedom, budget, base).solution()
    except UNDEFINED:
        return None


def _present(graph: Graph, source: Source) -> Value:
    return graph.nodes[graph.occurrences[source][0]]._plain


def _is_whole(graph: Graph, source: Source) -> bool:
    return type(_present(graph, source)) in (int, bool)


def _changes_of(graph: Graph, base: Optional[List[Value]]) -> Dict[Source, Value]:
    """The source values that differ from the present ones in the values of a graph's nodes."""
    if base is None:
        return {}
    return {
        source: base[places[0]]
        for source, places in graph.occurrences.items()
        if any(base[place] != graph.nodes[place]._plain for place in places)
    }


def _solve_parts(value: Value, target: Value, freedom: Freedom) -> Dict[Source, Value]:
    """Solve for the leaves of a message, sequence, dict or array together."""
    tracked = tracked_parts(value, target)
    if not tracked:
        raise NotTracked('nothing in it has a source')
    return _solve_tracked(tracked, freedom)


def tracked_parts(value: Value, target: Value) -> List[Goal]:
    """The tracked leaves of a message, sequence, dict or array, each with its path and its target as it was given.

    Raises:
        NotInvertible: a plain leaf is not its target.
        ValueError: the shapes differ.
    """
    tracked = []
    for path, leaf, wanted in paired(value, target):
        if type(leaf) in TRACKED:
            tracked.append((path, leaf, wanted))
        elif not is_same(leaf, wanted):
            raise NotInvertible('cannot make %s become %r: it has no source, and is %r' % (path, wanted, leaf))
    return tracked


def _solve_tracked(tracked: List[Goal], freedom: Freedom) -> Dict[Source, Value]:
    """Solve for several tracked leaves; those that share sources are solved together."""
    graph = Graph(leaf for _, leaf, _ in tracked)
    answer: Dict[Source, Value] = {}
    groups = connected(graph, tracked, freedom)
    for group in groups:
        if all(leaf._plain == wanted for _, leaf, wanted in group):
            continue
        if len(group) == 1:
            _, leaf, wanted = group[0]
            answer.update(solve_one(leaf, wanted, freedom, {}))
        else:
            goals = [(path, leaf, target_of(leaf, wanted)) for path, leaf, wanted in group]
            part = graph if len(groups) == 1 else Graph(leaf for _, leaf, _ in group)
            answer.update(_solve_together(part, goals, freedom))
    return {source: new for source, new in answer.items() if not _is_present(graph, source, new)}


def _is_present(graph: Graph, source: Source, value: Value) -> bool:
    # -0.0 is not 0.0: atan2 tells them apart
    return all(repr(graph.nodes[place]._plain) == repr(value) for place in graph.occurrences[source])


def _solve_together(graph: Graph, goals: List[Goal], freedom: Freedom) -> Dict[Source, Value]:
    """The source values that give all of several results that share sources.

    Float sources move together. If they do not suffice (texts, whole numbers, bools), the results are solved one
    after the other; if that does not do, either, whole numbers move together with the floats. At last, the floats are
    searched for from all over their bounds.

    Raises:
        NotInvertible: no values were found that give all; the result that stays away is named.
    """
    concerned = list(graph.occurrences)
    budget = Budget.of(graph)
    movable = [source for source in concerned if freedom.allows(source) and _holds_number(graph, source)]
    if any(isinstance(wanted, str) for _, _, wanted in goals):
        movable = []
    found = _moved_together(graph, goals, movable, freedom, budget)
    if found is not None and missed(graph, goals, _values(graph, found)) is None:
        return found
    try:
        return _one_after_the_other(graph, goals, freedom, budget)
    except NotInvertible:
        found = _moved_with_whole(graph, goals, movable, freedom, budget)
        if found is not None and missed(graph, goals, _values(graph, found)) is None:
            return found
        if freedom.restarts:
            found = _restarted(graph, goals, movable, freedom)
            if found is not None and missed(graph, goals, _values(graph, found)) is None:
                return found
        raise


def _one_after_the_other(graph: Graph, goals: List[Goal], freedom: Freedom, budget: Budget) -> Dict[Source, Value]:
    """Each goal by a source that none before it used."""
    changes: Dict[Source, Value] = {}
    for path, value, wanted in goals:
        if meets(_evaluated(value, changes), wanted):
            continue
        try:
            changes.update(solve_one(value, wanted, freedom, changes, budget))
        except NotInvertible as reason:
            raise NotInvertible(
                '%s, with the others as wanted' % reason if not path else '%s: %s' % (path, reason)
            ) from None
    first = missed(graph, goals, _values(graph, changes))
    if first is not None:
        (path, value, wanted), result = first
        raise NotInvertible(
            'cannot make %s %s become %s together with the others: %s would make it %s'
            % (
                path,
                brief(value),
                written(wanted),
                ', '.join('%s = %s' % (describe_source(one), written(new)) for one, new in list(changes.items())[:8]),
                written(result),
            )
        )
    return changes


def _evaluated(value: Value, changes: Mapping[Source, Value]) -> Value:
    try:
        return evaluate(value, changes)
    except UNDEFINED:
        return math.nan


def _values(graph: Graph, changes: Mapping[Source, Value]) -> Optional[List[Value]]:
    """The values of a graph's nodes with other source values, None if they are not defined."""
    try:
        return graph.values(changes)
    except UNDEFINED:
        return None
