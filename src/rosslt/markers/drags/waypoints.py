"""Finds values of its sources that bring a thing to a pose, or to one waypoint after the other, without changing
any."""

from typing import Any, Callable, Collection, Dict, List, Mapping, Optional, Sequence, Tuple

from rosslt import values
from rosslt.markers.drags import changes, joint_limits, wording
from rosslt.markers.geometry import PoseTuple, are_same_rotation
from rosslt.markers.scene.handle import Handle


def solve_waypoints(
    handle: Handle,
    poses: Sequence[PoseTuple],
    shared: Sequence[Collection[values.Source]],
    resolution: float,
    timeout: float,
    name_of: Callable[[values.Source], str],
) -> List[Dict[values.Source, Any]]:
    """Solve for a thing at waypoints, as a drag to each of them would.

    Args:
        handle: of the thing, as a message has it.
        poses: where it was taken hold of, and then the waypoints.
        shared: as of `Directory.held`.
        resolution: as in `changes.plan`.
        timeout: how long the owners of sources may take to answer, in seconds.
        name_of: what a source is called, for people.

    Returns:
        {Source: value} for each waypoint, of the sources that are changed at any of them.

    Raises:
        values.Error: a waypoint cannot be reached; it says why.
    """
    moved, turned = _differing(poses)
    turn = handle.turn(poses[0])
    last: Optional[Mapping[values.Source, Any]] = None
    found: List[Dict[values.Source, Any]] = []
    changed: Dict[values.Source, None] = {}
    for number, pose in enumerate(poses[1:], 1):
        turn = handle.turn(pose, turn)
        wanted = handle.wanted(pose, moved, turned)
        plan, reason = _plan(handle, wanted, turn, last, shared, resolution, timeout, name_of)
        if reason:
            raise values.NotInvertible(f'waypoint {number} cannot be reached: {reason}')
        last = plan.after
        found.append({**plan.before, **plan.after})
        changed.update(dict.fromkeys(source for source, value in plan.after.items() if value != plan.before[source]))
    return [{source: one[source] for source in changed} for one in found]


def plan_drag(
    handle: Handle,
    start: PoseTuple,
    end: PoseTuple,
    shared: Sequence[Collection[values.Source]],
    resolution: float,
    timeout: float,
    name_of: Callable[[values.Source], str],
) -> Tuple[changes.Plan, str]:
    """Plan what a drag of a thing from one pose to another changes, and say why it ends before that, '' if it does not.

    Args:
        handle, shared, resolution, timeout, name_of: as of `solve_waypoints`.

    Raises:
        values.Error: nothing brings it there; it says why.
    """
    moved, turned = _differing([start, end])
    turn = handle.turn(end, handle.turn(start))
    return _plan(handle, handle.wanted(end, moved, turned), turn, None, shared, resolution, timeout, name_of)


def _differing(poses: Sequence[PoseTuple]) -> Tuple[bool, bool]:
    """Return whether some poses differ in their positions, and whether in their orientations."""
    start = poses[0]
    is_moved = any(pose[:3] != start[:3] for pose in poses)
    return is_moved, any(not are_same_rotation(pose[3:], start[3:]) for pose in poses)


def _plan(
    handle: Handle,
    wanted: Tuple[List[Any], List[float]],
    turn: float,
    last: Optional[Mapping[values.Source, Any]],
    shared: Sequence[Collection[values.Source]],
    resolution: float,
    timeout: float,
    name_of: Callable[[values.Source], str],
) -> Tuple[changes.Plan, str]:
    tracked, targets = wanted
    if not tracked:
        raise values.NotInvertible('it has no numbers that go there')
    targets, limit = handle.limited(targets, turn)
    plan = changes.plan(
        tracked,
        targets,
        timeout=timeout,
        last=last,
        may_leap=True,
        resolution=resolution,
        thing=handle.tracked,
        shared=shared,
        limited=handle.limits,
    )
    joint_limits.check(handle.limits, plan.after)
    if handle.basis is not None:
        handle.basis.check(plan.after)
    if not (limit or plan.gap > resolution):
        return plan, ''
    why = limit or wording.limit(plan.stops or {}, name_of)
    whole = ', '.join(f'{name_of(source)} takes whole numbers only' for source in plan.whole)
    return plan, wording.short_numbers(why or whole or f'it is {plan.gap} off')
