"""Solving: what the sources must become so that a result becomes what is wanted (paper, IV.A, `force_value`).

Two laws hold. *PutGet*: evaluating with the answer gives the target, to a relative 1e-9, exactly for whole
numbers, bools and texts. *GetPut*: solving for the present value changes nothing. Every answer is checked before it
is returned.
"""

import math
from typing import Any, Callable, Collection, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple, Union

from ..errors import NotInvertible, NotTracked
from ..explain import brief
from ..graph import Graph
from ..operations import SOURCE
from ..operations.inverses import NoPreimage, refuse
from ..operations.table import ADD, DIVIDE, MULTIPLY, SUBTRACT
from ..sources import Source, describe_source
from ..tracked import TRACKED, TrackedFloat, scalar
from ..tree import paired
from .one import Attempt
from .several import solve_together

Bounds = Mapping[Source, Tuple[Any, Any]]
Rank = Union[Mapping[Source, int], Callable[[Source], int]]

PLUS, MINUS, TIMES, OVER = ADD.left, SUBTRACT.left, MULTIPLY.left, DIVIDE.left


class Freedom(NamedTuple):
    """Which sources may change, and how far.

    Attributes:
        only: the sources that may change, None for any.
        bounds: `{Source: (minimum or None, maximum or None)}`.
        read_only: sources that may not change.
        rank: gives each source's rank; one of a higher rank changes only where those of lower ranks do not suffice.
    """

    only: Optional[Collection[Source]]
    bounds: Bounds
    read_only: Collection[Source]
    rank: Callable[[Source], int]

    def allows(self, source: Source) -> bool:
        """Whether a source may change at all."""
        return source not in self.read_only and (self.only is None or source in self.only)

    def ranked(self, sources: Iterable[Source]) -> List[Source]:
        """Sources in the order in which they are tried: by rank, and in the order given within a rank."""
        return sorted(sources, key=self.rank)

    def limits(self, source: Source) -> Tuple[float, float]:
        """A source's minimum and maximum, infinite where there is none."""
        low, high = self.bounds.get(source, (None, None))
        return -math.inf if low is None else low, math.inf if high is None else high

    def check(self, source: Source, value: Any) -> None:
        """Refuse a value that is out of bounds, naming the bound."""
        if source in self.bounds and not isinstance(value, str):
            low, high = self.limits(source)
            if value < low:
                raise OutOfBounds('{source} would have to be %r, below its minimum %r' % (value, low))
            if value > high:
                raise OutOfBounds('{source} would have to be %r, above its maximum %r' % (value, high))

    def starts(self, source: Source) -> List[Any]:
        """Where else to look for an answer within the bounds: at either, and in the middle."""
        low, high = self.limits(source)
        ends = [end for end in (low, high) if math.isfinite(end)]
        return ends + [type(ends[0])((low + high) / 2)] if len(ends) == 2 else ends


class OutOfBounds(NoPreimage):
    """The answer found is beyond a bound; there may be another one within."""


def solve(
    value: Any,
    target: Any,
    source: Optional[Source] = None,
    *,
    sources: Optional[Collection[Source]] = None,
    bounds: Optional[Bounds] = None,
    read_only: Collection[Source] = (),
    rank: Optional[Rank] = None,
) -> Dict[Source, Any]:
    """Find the source values that make a tracked value become a target.

    Args:
        value: a tracked scalar, or a message, sequence, dict or object array holding tracked leaves.
        target: plain, same shape; in the unit of `value`. In a message or sequence, None leaves a part free.
        source: change this Source alone; by default the first in order of appearance that can.
        sources: change no other than these.
        bounds: `{Source: (minimum or None, maximum or None)}` in the units of the sources.
        read_only: sources to pass over.
        rank: `{Source: rank}`, or a function of a Source; 0 for those that are missing. A source is changed only
            where those of lower rank cannot give the target.

    Returns:
        `{Source: new value}`. For a scalar one source, with its present value if the target is the present
        value. For several leaves the sources that change, by the smallest change (Euclidean) where
        several would do; a leaf that shares no source with another is solved as a scalar.

    Raises:
        NotTracked: nothing in `value` has a source.
        NotInvertible: no value of the sources gives the target; the operation or the bound is named.
        ValueError: the target has another shape than the value.
    """
    if type(value) is TrackedFloat and source is None and sources is None and not bounds and not read_only:
        # A chain has one source, so that ranks do not matter.
        answer = _along_chain(value, target)
        if answer is not None:
            return answer
    only = sources if source is None else [source]
    freedom = Freedom(only, bounds or {}, read_only, _rank_of(rank))
    if source is not None and source in read_only:
        raise NotInvertible('cannot change %s: it is read-only' % describe_source(source))
    if type(value) in TRACKED:
        graph = Graph([value])
        return solve_one(graph, value, target, freedom, {})
    return _solve_parts(value, target, freedom)


def _rank_of(rank: Optional[Rank]) -> Callable[[Source], int]:
    if rank is None:
        return lambda source: 0
    if isinstance(rank, Mapping):
        ranks = rank
        return lambda source: ranks.get(source, 0)
    return rank


def _along_chain(value: Any, target: Any) -> Optional[Dict[Source, float]]:
    """The answer for a chain of operations on one float source; None where that is not so simple.

    The four operations that most chains consist of are written out, which saves two calls each; what they do is
    what the table says.
    """
    if type(target) is not float:
        return None
    records = []
    wanted = target
    record = value._record
    try:
        while True:
            form, first, second = record
            if form is PLUS:
                wanted = wanted - second
            elif form is TIMES:
                wanted = wanted / second
            elif form is MINUS:
                wanted = wanted + second
            elif form is OVER:
                wanted = wanted * second
            elif form.single_operand:
                wanted = form.inverse(wanted, first._plain, second)
            else:
                break
            records.append(record)
            record = first._record
        leaf = records[-1][1] if records else value
        if form is not SOURCE or type(leaf) is not TrackedFloat or type(wanted) is not float:
            return None
        if target == value._plain:
            return {first: leaf._plain}
        found = wanted
        for form, _, second in reversed(records):
            if form is PLUS:
                found = found + second
            elif form is TIMES:
                found = found * second
            elif form is MINUS:
                found = found - second
            elif form is OVER:
                found = found / second
            else:
                found = form.forward(found, second)
        meets = type(found) is float and abs(found - target) <= 1e-9 * abs(target) and wanted - wanted == 0
        return {first: wanted} if meets else None
    except (ArithmeticError, ValueError, TypeError):
        return None


def target_of(value: Any, target: Any) -> Any:
    """A target as a plain value of a type that fits the value's.

    Raises:
        NotInvertible: a text for a number, a number for a text, or no finite number.
    """
    wanted = scalar(target)
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


def solve_one(graph: Graph, value: Any, target: Any, freedom: Freedom, changes: Dict[Source, Any]) -> Dict[Source, Any]:
    """Solve for one tracked value of a graph by one source, the first that can (left bias).

    Args:
        changes: values that other sources take on meanwhile; they are not changed again.

    Raises:
        NotTracked, NotInvertible: as `solve`.
    """
    root = graph.index[id(value)]
    wanted = target_of(value, target)
    candidates = list(graph.occurrences) if len(graph.nodes) == root + 1 else list(Graph([value]).occurrences)
    if not candidates:
        raise NotTracked('%s has no source' % brief(value))
    if freedom.only is not None and not any(source in candidates for source in freedom.only):
        raise NotInvertible(
            'cannot make %s become %r: it does not depend on %s'
            % (brief(value), target, ' or '.join(describe_source(source) for source in freedom.only))
        )
    reasons = []
    for candidate in freedom.ranked(candidates):
        if candidate in changes or (freedom.only is not None and candidate not in freedom.only):
            continue
        try:
            if candidate in freedom.read_only:
                refuse('{source} is read-only')
            return {candidate: _within_bounds(Attempt(graph, root, candidate, changes), wanted, candidate, freedom)}
        except NoPreimage as reason:
            text = str(reason).replace('{source}', describe_source(candidate))
            if text not in reasons:
                reasons.append(text)
    if wanted == value._plain and not changes:
        for candidate in filter(freedom.allows, candidates):
            values = graph.tried({candidate: _present(graph, candidate)})
            if values and values[root] == wanted:
                return {candidate: _present(graph, candidate)}
    raise NotInvertible(
        'cannot make %s become %r: %s'
        % (brief(value), target, '; '.join(reasons[:4]) or 'all its sources are needed otherwise')
    )


def _present(graph: Graph, source: Source) -> Any:
    return graph.nodes[graph.occurrences[source][0]]._plain


def _within_bounds(attempt: Attempt, wanted: Any, source: Source, freedom: Freedom) -> Any:
    answer = attempt.answer(wanted, attempt.present)
    if answer == attempt.present:
        return answer
    try:
        freedom.check(source, answer)
        return answer
    except OutOfBounds:
        for start in freedom.starts(source):
            try:
                answer = attempt.answer(wanted, start)
                freedom.check(source, answer)
                return answer
            except NoPreimage:
                continue
        raise


def _solve_parts(value: Any, target: Any, freedom: Freedom) -> Dict[Source, Any]:
    """Solve for the leaves of a message, sequence, dict or array together."""
    pairs = paired(value, target)
    tracked = [(path, leaf, wanted) for path, leaf, wanted in pairs if type(leaf) in TRACKED]
    if not tracked:
        raise NotTracked('nothing in it has a source')
    for path, leaf, wanted in pairs:
        if type(leaf) not in TRACKED and not _same(leaf, wanted):
            raise NotInvertible('cannot make %s become %r: it has no source, and is %r' % (path, wanted, leaf))
    graph = Graph(leaf for _, leaf, _ in tracked)
    answer: Dict[Source, Any] = {}
    for group in _apart(graph, tracked, freedom):
        if all(leaf._plain == wanted for _, leaf, wanted in group):
            continue
        if len(group) == 1:
            _, leaf, wanted = group[0]
            found = solve_one(graph, leaf, wanted, freedom, {})
        else:
            goals = [(path, leaf, target_of(leaf, wanted)) for path, leaf, wanted in group]
            found = solve_together(graph, goals, freedom, solve_one)
        answer.update(found)
    return {source: new for source, new in answer.items() if not _is_present(graph, source, new)}


def _same(leaf: Any, wanted: Any) -> bool:
    try:
        return bool(leaf == wanted) or math.isclose(leaf, wanted, rel_tol=1e-9, abs_tol=1e-12)
    except (TypeError, ValueError):
        return list(leaf) == list(wanted) if hasattr(leaf, '__len__') and hasattr(wanted, '__len__') else False


def _is_present(graph: Graph, source: Source, value: Any) -> bool:
    # -0.0 is not 0.0: atan2 tells them apart
    return all(repr(graph.nodes[place]._plain) == repr(value) for place in graph.occurrences[source])


def _apart(graph: Graph, goals: List[Tuple[str, Any, Any]], freedom: Freedom) -> List[List[Tuple[str, Any, Any]]]:
    """The goals in groups that share no source which may change."""
    bits = {source: 1 << place for place, source in enumerate(graph.occurrences)}
    free = {source: bit if freedom.allows(source) else 0 for source, bit in bits.items()}
    masks: List[int] = []
    for form, first, second in graph.records:
        if form is SOURCE:
            mask = free[first]
        elif form.operation is None:
            mask = 0
            for leaf, _ in first:
                mask |= masks[graph.index[id(leaf)]]
        else:
            mask = masks[graph.index[id(first)]]
            if not form.single_operand:
                mask |= masks[graph.index[id(second)]]
        masks.append(mask)
    groups: List[Tuple[int, List[Tuple[str, Any, Any]]]] = []
    for goal in goals:
        mask = masks[graph.index[id(goal[1])]]
        members: List[Tuple[str, Any, Any]] = []
        apart = []
        for other, others in groups:
            if other & mask:
                mask, members = mask | other, members + others
            else:
                apart.append((other, others))
        groups = apart + [(mask, members + [goal])]
    return [members for _, members in groups]
