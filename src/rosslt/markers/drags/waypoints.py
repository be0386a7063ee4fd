"""Which values of its sources bring a thing to one waypoint after the other, without a change of any."""

from typing import Any, Callable, Collection, Dict, List, Mapping, Optional, Sequence

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
    start = poses[0]
    is_moved = any(pose[:3] != start[:3] for pose in poses)
    is_turned = any(not are_same_rotation(pose[3:], start[3:]) for pose in poses)
    turn = handle.turn(start)
    last: Optional[Mapping[values.Source, Any]] = None
    found: List[Dict[values.Source, Any]] = []
    changed: Dict[values.Source, None] = {}
    for number, pose in enumerate(poses[1:], 1):
        turn = handle.turn(pose, turn)
        tracked, targets = handle.wanted(pose, is_moved, is_turned)
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
        if limit or plan.gap > resolution:
            why = limit or wording.limit(plan.stops or {}, name_of)
            whole = ', '.join(f'{name_of(source)} takes whole numbers only' for source in plan.whole)
            reason = wording.short_numbers(why or whole or f'it is {plan.gap} off')
            raise values.NotInvertible(f'waypoint {number} cannot be reached: {reason}')
        last = plan.after
        found.append({**plan.before, **plan.after})
        changed.update(dict.fromkeys(source for source, value in plan.after.items() if value != plan.before[source]))
    return [{source: one[source] for source in changed} for one in found]
