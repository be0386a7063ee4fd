"""Plans of drags: the new values of sources that bring a thing to the pose that a drag asks for."""

import contextlib
import math
from typing import Any, Collection, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from rosslt import node, values
from rosslt.markers.drags import joint_limits
from rosslt.markers.scene.handle import Limited

#: The significant digits of a float that are tried, of 17 that it may need.
DIGITS = 13

#: Into how many parts the way to an answer is divided to see whether it is a leap.
PARTS = 8

#: By how much more what is held in place counts than what is pulled, if both cannot be where they are wanted.
FIRMNESS = 1000.0

#: The rounding error of a distance, relative to it, and where it is 0.
ROUNDING = 1e-9


class Plan(NamedTuple):
    """The planned values of sources.

    Attributes:
        before: {Source: present value}.
        after: {Source: new value}.
        gap: the distance from the target that remains.
        stops: {Source: a bound that it has come to, such as 'maximum 4.5'}.
        is_exact: whether the values become their targets.
        whole: the sources that take whole numbers only, and have become the nearest ones.
    """

    before: Dict[values.Source, Any]
    after: Dict[values.Source, Any]
    gap: float = 0.0
    stops: Optional[Dict[values.Source, str]] = None
    is_exact: bool = True

    @property
    def whole(self) -> List[values.Source]:
        return [] if self.is_exact else [source for source, value in self.after.items() if type(value) is int]


def plan(
    tracked: Sequence[Any],
    targets: Sequence[float],
    chosen: Collection[values.Source] = (),
    timeout: float = 1.0,
    began: Optional[Mapping[values.Source, Any]] = None,
    last: Optional[Mapping[values.Source, Any]] = None,
    may_leap: bool = False,
    resolution: float = 0.0,
    thing: Optional[Sequence[Any]] = None,
    shared: Sequence[Collection[values.Source]] = (),
    limited: Sequence[Limited] = (),
    in_place: Tuple[Sequence[Any], Sequence[float]] = ((), ()),
    takes_restart: bool = False,
) -> Plan:
    """Plan the values of sources that bring tracked values to their targets, or as near as they can come.

    Args:
        tracked, targets: tracked values and as many numbers.
        chosen: change these sources alone; by default those of `thing` that are not `held`.
        timeout: how long to wait for the bounds from the owners, in seconds.
        began: {Source: value} where the drag began, of the sources that it has changed. The plan is made from there, so
            that a hand that comes back brings them back.
        last: {Source: value} of the last answer of this drag that brought the values to their targets, to be followed
            without a jump; by default the present values.
        may_leap: whether an answer that can only be reached by a jump is one, too.
        resolution: the least difference that the hand can make, in the unit of the tracked values: floats become as
            round as that allows.
        thing: the tracked numbers of the thing as the hand took hold of it; by default any source changes.
        shared: of each of these, as of `Directory.held`.
        limited: numbers that are to stay within limits, as far as bounds of sources say so.
        takes_restart: whether sources change whose changes take effect at the next start of a node.
        in_place: tracked values that are to stay, each `FIRMNESS` times as firmly as the others go, and where they are.

    Raises:
        values.NotInvertible: the sources cannot bring the values any nearer.
    """
    tracked, targets = [*tracked, *in_place[0]], [*targets, *in_place[1]]
    firmness = [1.0] * (len(tracked) - len(in_place[0])) + [FIRMNESS] * len(in_place[0])
    here = last or values.source_values(tracked)
    if began:
        tracked = values.reapply(list(tracked), began)
    present = values.source_values(tracked)
    limits = node.limits(list(present), timeout)
    if takes_restart:
        limits['read_only'] = [one for one in limits['read_only'] if not node.directory().at_next_start(one)]
    limits['bounds'] = joint_limits.narrowed(limits['bounds'], limited)
    if thing is not None and not chosen:
        held = node.directory().held(thing, shared)
        chosen = [source for source in values.sources(thing) if source not in held]
    if chosen:
        limits['read_only'] = [*limits['read_only'], *(source for source in present if source not in chosen)]
    try:
        after = values.continued(tracked, targets, here, **limits)
        if not may_leap and _leaps(values.reapply(list(tracked), here), targets, after):
            raise values.NotInvertible('the values come there by a leap alone')
        return Plan(present, _rounded(after, present, tracked, resolution, limits))
    except values.NotInvertible:
        if may_leap:
            with contextlib.suppress(values.NotInvertible):
                after = values.solve(list(tracked), list(targets), **limits)
                return Plan(present, _rounded(after, present, tracked, resolution, limits))
        # As near as it comes from the last good values.
        tracked = values.reapply(list(tracked), here)
        began_here = values.source_values(tracked)
        firm = [value if by == 1.0 else value * by for value, by in zip(tracked, firmness)]
        firm_targets = [target * by for target, by in zip(targets, firmness)]
        after, gap = values.nearest(firm, firm_targets, **limits)
        if not may_leap and _leaps(tracked, targets, after):
            raise
        after = _shortened(after, began_here, firm, firm_targets, gap + 0.5 * resolution)
        after = _rounded(after, began_here, tracked, resolution, limits)
        # Changes that the drag has made already are part of the answer, also if nothing comes nearer.
        moved = last or {source: value for source, value in here.items() if value != present.get(source, value)}
        after = {**moved, **after}
        stops = _stops({**present, **after}, limits['bounds'])
        if not after and not stops:
            raise
        return Plan(present, after, gap, stops, is_exact=False)


def to_request(found: Plan, applied: Dict[values.Source, Any]) -> Dict[values.Source, Any]:
    """{Source: new value} of those that have to be asked of the owners for a plan.

    Args:
        found: made from a message.
        applied: {Source: value} that the owners have taken on in this drag; the message may be older. A hand that has
            gone back to where it began wants them back, although the message says that they are there.
    """
    present = {**found.before, **{source: value for source, value in applied.items() if source in found.before}}
    wanted = {**found.before, **found.after}
    return {source: wanted[source] for source, value in present.items() if wanted[source] != value}


def _shortened(
    after: Dict[values.Source, Any],
    present: Dict[values.Source, Any],
    tracked: Sequence[Any],
    targets: Sequence[float],
    most: float,
) -> Dict[values.Source, Any]:
    """The nearest answer, or half the way to it, and so on, if that comes as near for a hand: the least of an
    exponential lies at infinity.

    Args:
        most: the distance from the targets that a hand cannot tell from that of the answer.
    """
    while after:
        half = {source: (present[source] + new) / 2.0 if type(new) is float else new for source, new in after.items()}
        if half == after or _distance(tracked, targets, half) > most:
            break
        after = half
    return after


def _distance(tracked: Sequence[Any], targets: Sequence[float], trial: Dict[values.Source, Any]) -> float:
    """Return how far source values leave tracked values from their targets; infinite if these have no value then."""
    try:
        return math.dist(list(map(float, values.evaluate(list(tracked), trial))), targets)
    except (ArithmeticError, ValueError):
        return math.inf


def _rounded(
    after: Dict[values.Source, Any],
    present: Dict[values.Source, Any],
    tracked: Sequence[Any],
    resolution: float,
    limits: Mapping[str, Any],
) -> Dict[values.Source, Any]:
    """The roundest floats that bring tracked values to within half a resolution of where an answer brings them.

    A hand means no more digits than it can see: 1.45 instead of 1.452682166528786. A float at a bound stays there. Each
    is moved by no more than its slopes allow, and than the answer itself moves it: 0 is as good as a whole turn, and as
    any angle if the radius is 0, and would be a jump. The floats that a value comes from share what it may move by.
    """
    bounds = {source: limits['bounds'].get(source, (None, None)) for source in after}
    floats = [source for source, value in after.items() if type(value) is float and value not in bounds[source]]
    exact = [float(value) for value in values.evaluate(list(tracked), after)]
    slopes = values.slopes(values.reapply(list(tracked), after))
    takers = [[source for source in floats if source in sources] for sources in map(values.sources, tracked)]
    for source in floats:
        # By how far each value may be off, once this float and those before it are round.
        allowed = [
            0.5 * resolution * (taking.index(source) + 1) / len(taking) if source in taking else math.inf
            for taking in takers
        ]
        low, high = (inf if bound is None else bound for bound, inf in zip(bounds[source], (-math.inf, math.inf)))
        for rounder in (0.0, *(float(f'{after[source]:.{digits}g}') for digits in range(1, DIGITS))):
            trial = {**after, source: rounder}
            way = abs(rounder - after[source])
            is_near = all(way * abs(slope) <= most for slope, most in zip(slopes[source], allowed))
            is_near = is_near and way <= abs(after[source] - present[source])
            if low <= rounder <= high and is_near and _are_within(allowed, tracked, trial, exact):
                after = trial
                break
    return after


def _are_within(
    distances: List[float], tracked: Sequence[Any], trial: Dict[values.Source, Any], exact: List[float]
) -> bool:
    """Return whether source values bring each of tracked values to within its distance of a number."""
    try:
        there = [float(value) for value in values.evaluate(list(tracked), trial)]
    except (ArithmeticError, ValueError):
        return False
    return all(abs(one - other) <= distance for one, other, distance in zip(there, exact, distances))


def _leaps(tracked: Sequence[Any], targets: Sequence[float], after: Mapping[values.Source, Any]) -> bool:
    """Return whether results are further from their targets than they are now somewhere on the way to an answer, as on
    the long way around an axis."""
    before = values.source_values(tracked)
    floats = {
        source: (before[source], new)
        for source, new in after.items()
        if isinstance(new, float) and isinstance(before[source], float)
    }
    most = math.dist(list(map(float, tracked)), targets)
    for part in range(1, PARTS):
        there = {source: old + (new - old) * part / PARTS for source, (old, new) in floats.items()}
        if not _distance(tracked, targets, there) <= max(most * (1.0 + ROUNDING), ROUNDING):
            return True
    return False


def _stops(found: Dict[values.Source, Any], bounds: Dict[values.Source, Tuple[Any, Any]]) -> Dict[values.Source, str]:
    stops = {}
    for source, (minimum, maximum) in bounds.items():
        for word, bound in (('minimum', minimum), ('maximum', maximum)):
            if bound is not None and source in found and found[source] == bound:
                stops[source] = '{} {!r}'.format(word, bound)
    return stops
