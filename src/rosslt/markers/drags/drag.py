"""A drag: a user moves a handle, from the press of the button to its release."""

import math
import time
from typing import Any, Callable, Collection, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from rosslt import node, values
from rosslt.markers.geometry import PoseTuple, are_same_rotation
from rosslt.markers.scene.handle import Handle, has_source

#: The rounding error of 32-bit numbers, relative to their size or 1.
NOISE = 1e-6


class Drag:
    """A hand on a handle, and what it has done so far.

    Args:
        handle: the handle that the hand holds.
        timeout: how long the owners of sources may take to answer, in seconds.
        hand: whose hand it is, if a view is shown to several people.

    Attributes:
        held: the sources of the thing that the hand has taken hold of. It changes no others.
        chosen: those of them that a person has chosen. If there are any, it changes these alone.
        in_place: {name: (thing, its pose)} of things that are to stay in place, and share sources with it: as the last
            message has each while it has its frame and its sources, and where it is to stay.
        shared: of each number of the thing, the sources that moved other things as well.
        pose: where the hand has it now.
        start: where the hand took hold of it.
        asked: the last pose that the sources have been asked for; None if they have to be asked again.
        thing: what the hand has, as the last message has it that shows it where its sources bring it. This is what is
            solved: the node may have gone on to the next of its targets, or may move it.
        went_on: how far its node has moved it meanwhile, or is from it to what it shows instead; 0 for not at all.
        doubt: the message's that shows it elsewhere than its sources bring it, since when they are others: either its
            node has gone on, or it computes it in another way now. If the sources get the values of `thing` back, the
            next message tells.
        has_ways: whether its node is known to compute it in other ways for other values of its sources.
        solved: the latest message's when its sources were last asked for.
        is_exact: whether the last answer reaches the pose, and is not the nearest one.
        due: before when they are not asked again.
        heard: when the hand last did something.
        turn: how far the hand has turned it, as in `Handle.turn`, also more than once around.
        fault: why it asks for nothing more, or None.
        unlike: why its node does not do what was learned of it, if its provenance is from there; '' if it does.
        refusal: the error of the last request, or None.
        request: its changes: one request, in the histories of the owners as well.
        goes_back: whether what it has changed is to be taken back as it is over.
        followed: {Source: value} of the last answer that brought the handle to where the hand was.
    """

    def __init__(self, handle: Handle, timeout: float, hand: str = '') -> None:
        self.handle, self.request, self.hand = handle, node.ChangeRequest(timeout), hand
        self.held: Set[values.Source] = set(values.sources(list(handle.tracked)))
        self.chosen: Collection[values.Source] = ()
        self.in_place: Dict[str, Tuple[Handle, PoseTuple]] = {}
        self.shared: Sequence[Collection[values.Source]] = ()
        self.thing = self.solved = handle
        self.went_on = 0.0
        self.doubt: Optional[Handle] = None
        self.has_ways = False
        self.pose: PoseTuple = handle.pose
        self.asked: Optional[PoseTuple] = handle.pose
        self.start: PoseTuple = handle.pose
        self.turn = handle.turn(handle.pose)
        self.is_moved = self.is_turned = self.is_over = self.goes_back = False
        self.is_exact = False
        self.heard, self.due = time.monotonic(), 0.0
        self.fault: Optional[str] = None
        self.unlike = ''
        if handle.basis is not None:
            handle.basis.begin()
            self.learn(handle)
        self.refusal: Optional[Exception] = None
        self.followed: Dict[values.Source, Any] = {}

    def begin(self, frame: str, pose: PoseTuple) -> None:
        """The hand took hold of it at this pose; a moving thing may have left the pose of the last message."""
        if self._is_sound(frame, pose):
            self.start = self.asked = self.pose = self.handle.settled(self.start, pose, NOISE)
            self.turn = self.handle.turn(self.pose)

    def move(self, frame: str, pose: PoseTuple) -> None:
        """The hand is at a pose now."""
        if not self._is_sound(frame, pose):
            return
        self.pose = self.handle.settled(self.start, pose, NOISE)
        self.turn = self.handle.turn(self.pose, self.turn)
        # Only coordinates that the hand has changed are asked for, also when they return to their start.
        self.is_moved = self.is_moved or self.pose[:3] != self.start[:3]
        self.is_turned = self.is_turned or not are_same_rotation(self.pose[3:], self.start[3:], NOISE**2)

    def leave_in_place(self, handles: Iterable[Handle]) -> None:
        """Leave other things where they are now."""
        for one in handles:
            if one.name != self.handle.name and not self.held.isdisjoint(values.sources(list(one.tracked))):
                self.in_place[one.name] = one, one.pose

    def targets_in_place(self, handle_of: Callable[[str], Optional[Handle]]) -> Tuple[List[Any], List[float]]:
        """The targets of the things that are to stay in place, as in `wanted`.

        What its node moves stays where that has moved it to. What is gone, or has left for other sources or for another
        frame, counts as it was last.

        Args:
            handle_of: gives a handle as a message has it now.
        """
        numbers: List[Any] = []
        targets: List[float] = []
        for name, (known, pose) in self.in_place.items():
            shown = handle_of(name)
            if shown is not None and shown is not known and _is_same_thing(known, shown):
                is_moved = not _is_there(_way(known, shown), shown) and _sources(known) == _sources(shown)
                known, pose = self.in_place[name] = shown, shown.pose if is_moved else pose
            tracked, there = known.wanted(pose, True, True)
            numbers += tracked
            targets += there
        return numbers, targets

    def wanted(self, handle: Handle, pose: PoseTuple) -> Tuple[List[Any], List[float], str]:
        """The targets of this drag to a pose, for the handle as a message has it now.

        Returns:
            ([tracked value], [what it should become], what to tell of a limit of the thing that was met, or '').
        """
        tracked, targets = handle.wanted(pose, self.is_moved, self.is_turned)
        # The limits are those at the start of the drag: a thing that was beyond them can go back there with the hand.
        targets, limit = self.handle.limited(targets, self.turn) if tracked else ([], '')
        reached = [(value, target) for value, target in zip(tracked, targets) if self._reaches(value)]
        return [value for value, _ in reached], [target for _, target in reached], limit if reached else ''

    def take(self, handle: Handle) -> None:
        """A message shows the thing: where its sources bring it, or its node has moved it, or shows another one."""
        if handle is self.thing or self.has_left(values.sources(list(handle.tracked))) or self.misfit(handle):
            return
        if handle.basis is not None:
            self.learn(handle)
            return
        way = _way(self.thing, handle)
        is_there = _is_there(way, handle)
        is_told = _sources(handle) == _sources(self.thing)
        self.has_ways = self.has_ways or (is_there and is_told and self.doubt is not None)
        if is_there or (self.has_ways and not is_told):
            self.thing, self.went_on, self.doubt = handle, 0.0, None
        elif is_told or self.went_on:
            self.went_on, self.doubt = way, None
        else:
            self.doubt = handle

    def learn(self, handle: Handle) -> bool:
        """Correct what was learned of the node of a thing, if its provenance is from there, by a message that shows the
        thing; False if the message tells nothing, as the node is still on the way from former inputs."""
        if handle.basis is None:
            return True
        readings = node.Expression(list(handle.tracked)).readings
        is_present = not self.request.after or self.request.shown_by(readings) is node.Shown.NEW
        if not (is_present and handle.basis.is_settled):
            return False
        try:
            handle.basis.correct()
        except values.NotInvertible as error:
            self.unlike = f'{handle.basis.publisher}: {error}'
            return False
        self.thing, self.went_on, self.doubt = handle, 0.0, None
        return True

    def give_up_doubt(self) -> None:
        """Nothing tells any more what its node has done: a thing that has gone on is not brought anywhere else."""
        if self.doubt is not None:
            self.went_on, self.doubt = _way(self.thing, self.doubt), None

    def before_doubt(self, doubt: Handle) -> Optional[Dict[values.Source, Any]]:
        """{Source: value} of what this drag has to give back so that a message tells; None if others have changed
        sources as well."""
        then, now = _sources(self.thing), _sources(doubt)
        changed = {source: value for source, value in then.items() if now.get(source, value) != value}
        return then if changed.keys() <= self.request.after.keys() else None

    def goes_beyond_choice(self, handle: Handle, pose: PoseTuple) -> bool:
        """Return whether the hand has also moved what the chosen sources do not reach."""
        tracked, targets = handle.wanted(pose, self.is_moved, self.is_turned)
        _, start = handle.wanted(self.start, self.is_moved, self.is_turned)
        rows = zip(tracked, targets, start)
        return any(not self._reaches(value) and not values.is_same(now, then) for value, now, then in rows)

    def _reaches(self, value: Any) -> bool:
        return not self.chosen or not set(self.chosen).isdisjoint(values.sources(value))

    def misfit(self, handle: Handle) -> Optional[str]:
        """Why a pose of this drag means nothing for a handle of the same name in a later message, or None."""
        if handle.frame.lstrip('/') != self.handle.frame.lstrip('/'):
            return 'it is in the frame {} now instead of {}'.format(handle.frame, self.handle.frame)
        # An element of a list is named by its index: if elements were added or removed, the name means another.
        is_another = handle.name.endswith(']') and self.held != set(values.sources(list(handle.tracked)))
        return 'another thing has taken its place' if is_another else None

    def has_left(self, sources: Sequence[values.Source]) -> bool:
        """Return whether a thing with these sources lacks one of those that it had when the hand took hold of it: its
        node has gone on to the next of its targets, say."""
        return bool(sources) and not self.held <= set(sources)

    def _is_sound(self, frame: str, pose: PoseTuple) -> bool:
        """Return whether a reported pose can be used; `fault` says what is wrong with it."""
        if frame.lstrip('/') != self.handle.frame.lstrip('/'):
            self.fault = 'its pose is reported in the frame {} instead of {}'.format(frame, self.handle.frame)
            return False
        if not all(map(math.isfinite, pose)):
            self.fault = 'its pose is not finite'
            return False
        return True


def _is_same_thing(known: Handle, shown: Handle) -> bool:
    """Return whether a later message has a thing in the same frame, with the same sources."""
    of_known, of_shown = values.sources(list(known.tracked)), values.sources(list(shown.tracked))
    return known.frame.lstrip('/') == shown.frame.lstrip('/') and set(of_known) == set(of_shown)


def _is_there(way: float, shown: Handle) -> bool:
    """Return whether a later message, which shows a thing that far from there, has it where its sources bring it."""
    return way <= NOISE * max(1.0, *map(abs, map(float, shown.tracked)))


def _sources(handle: Handle) -> Dict[values.Source, Any]:
    return values.source_values(list(handle.tracked))


def _way(known: Handle, shown: Handle) -> float:
    """Return how far a later message shows a thing from the place that its sources give it; 0 if that is not known."""
    numbers = list(map(float, shown.tracked))
    if len(known.tracked) != len(numbers):
        return 0.0
    try:
        expected = list(map(float, values.evaluate(list(known.tracked), _sources(shown))))
    except Exception:  # of whatever type: a user's operation may raise any, and a root may be a complex number
        return 0.0
    places = len(numbers) if shown.position is None else sum(map(has_source, shown.position))
    turned = [-part for part in numbers[places:]]  # a quaternion and its negative are the same rotation
    turn = min(math.dist(expected[places:], numbers[places:]), math.dist(expected[places:], turned))
    return max(math.dist(expected[:places], numbers[:places]), turn)
