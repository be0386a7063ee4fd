"""All drags of a scene: which changes are requested while the mouse moves, and which messages are shown.

Movements of hands are only noted when they are reported. One thread of its own asks the owners, the newest
position first and as often as the rate allows, and waits for their answers.

The scene is called with the lock of the drags held, but never calls back, so that nobody waits for it long.
"""

import collections
import contextlib
import functools
import threading
import time
import traceback
from typing import Callable, Collection, Deque, Dict, Iterable, List, NamedTuple, Optional, Set, Tuple

import rospy

from rosslt import node, values
from rosslt.markers.drags import changes, joint_limits, wording
from rosslt.markers.drags.drag import Drag
from rosslt.markers.drags.drop_check import Drop
from rosslt.markers.drags.other_views import OtherViews
from rosslt.markers.faults import contained
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.scene import Scene

#: The time after which a hand of which nothing is heard has let go, in seconds. A view reports a hand several times a
#: second while a button is down.
SILENCE = 3.0

#: The period in which it is looked whether hands are heard, in seconds.
PERIOD = 0.5


#: What a person is told of a thing that is shown elsewhere than its sources bring it.
WENT_ON = 'its node has gone on meanwhile: what you took hold of follows your hand'


class Rules(NamedTuple):
    """Settings: when and how sources follow hands.

    Attributes:
        is_live: whether they follow while the mouse moves, or when the button is released.
        rate: how often they follow while it moves, in Hz.
        timeout: how long an owner may take to answer, in seconds.
        resolution: the least difference that a hand can make, in metres, radians and parts of a quaternion, or in the
            unit of a number: sources become as round as that allows, and what is that near is where it is wanted.
    """

    is_live: bool = True
    rate: float = 20.0
    timeout: float = 1.0
    resolution: float = 1e-3


class Drags:
    """All hands on the handles of a scene.

    Args:
        scene: has the handles.
        rules: how sources follow.
        name_of: what a source is called, for people.
        raised_since: the first new error in one of these nodes since a time, as `NodeErrors` says it.
        others: whose hands hold things as well; None if there are no others.

    Attributes:
        chosen: {name of a handle: the sources that its drags change, if any are chosen}.
        in_place: the names of handles that stay where they are while others are dragged.
    """

    def __init__(
        self,
        scene: Scene,
        rules: Rules,
        name_of: Callable[[values.Source], str],
        raised_since: Callable[[Collection[str], float], str] = lambda nodes, since: '',
        others: Optional[OtherViews] = None,
    ) -> None:
        self._scene, self._rules, self._name_of, self._raised_since = scene, rules, name_of, raised_since
        self._others = others
        self._held: Dict[str, Drag] = {}
        self._told: Dict[str, str] = {}  # what others know of it
        self._over: Deque[Drag] = collections.deque()
        self._drops: Dict[str, Drop] = {}  # by the names of handles
        self._wake = threading.Condition()
        self.chosen: Dict[str, Tuple[values.Source, ...]] = {}
        self.in_place: Set[str] = set()
        self._past: Dict[str, List[node.ChangeRequest]] = {}  # of the drags of each handle, by its name
        self._background = node.Callbacks('after drops')
        threading.Thread(target=self._work, name='drags', daemon=True).start()

    def chosen_for(self, handle: Handle) -> Tuple[values.Source, ...]:
        """The chosen sources that drags of a thing change; none if it does not come from all that were chosen, as the
        next target of a patrol need not."""
        chosen = self.chosen.get(handle.name, ())
        return chosen if set(chosen) <= set(values.sources(handle.tracked)) else ()

    def hold(self, name: str, hand: str = '', frame: str = '', pose: Optional[PoseTuple] = None) -> bool:
        """A hand takes hold of a handle; False if there is none, or another hand has it.

        Args:
            hand: whose it is, if one view shows the handle to several people.
            frame: the frame that the pose is in.
            pose: where the view showed it then; None for where the last message has it.
        """
        with self._wake:
            return self._drag_of(name, hand, frame, pose) is not None

    def move(self, name: str, frame: str, pose: PoseTuple, hand: str = '') -> bool:
        """A hand has moved a handle; False if another hand has it, as in `hold`.

        If it has not said that it takes hold, it does so here: RViz reports the pose first, and the press then.

        Args:
            frame: the frame that the pose is in.
            pose: where it stands now.
            hand: as in `hold`.
        """
        with self._wake:
            drag = self._drag_of(name, hand, frame, pose)
            if drag is not None:
                drag.move(frame, pose)
                self._wake.notify()
            return drag is not None

    def keep(self, name: str, hand: str = '') -> None:
        """A hand still holds a handle."""
        with self._wake:
            drag = self._held.get(name)
            if drag is not None and drag.hand == hand:
                drag.heard = time.monotonic()

    def release(self, name: str, frame: str, pose: PoseTuple, hand: str = '') -> bool:
        """A hand has let go of a handle; False if it did not have it."""
        with self._wake:
            drag = self._held.get(name)
            if drag is None or drag.hand != hand:
                return False
            drag.heard = time.monotonic()
            drag.move(frame, pose)
            self._end_for(name)
            self._wake.notify()
            return True

    def let_go_back(self, name: str, hand: str = '') -> None:
        """A hand has let go of a handle, if it had it, and what its drag has changed is taken back."""
        with self._wake:
            drag = self._held.get(name)
            if drag is not None and drag.hand == hand:
                drag.goes_back = True
                self._end_for(name)
                self._wake.notify()

    def undo(self, name: str) -> None:
        """Restore the values that the sources of a handle had before its last drag."""
        handle, past = self._scene.handle(name), self._past.get(name)
        if handle is None:
            return
        if not past:
            self._scene.say(handle, 'nothing to undo')
            return
        self._drops.pop(name, None)
        reason = self._undo(name)
        if reason:
            rospy.logwarn('%s: cannot undo: %s', name, reason)
            self._scene.say(handle, 'cannot undo: ' + reason)

    def _undo(self, name: str) -> str:
        """Take the last drag of a handle back; why that is not done, '' if it is."""
        past = self._past[name]
        reason = past[-1].take_back()
        if not past[-1].after:
            past.pop()
        return reason

    def _drag_of(self, name: str, hand: str, frame: str, pose: Optional[PoseTuple]) -> Optional[Drag]:
        """The drag of a hand, which begins at a pose if nobody has the handle; None if another hand has it."""
        drag = self._held.get(name)
        if drag is None:
            handle = self._scene.grasped(name, pose)
            if handle is None or (self._others is not None and name in self._others.held()):
                return None
            self._drops.pop(name, None)
            drag = self._held[name] = Drag(handle, self._rules.timeout, hand)
            drag.shared = self._scene.shared(handle)
            drag.leave_in_place(filter(None, map(self._scene.handle, sorted(self.in_place))))
            if pose is not None:
                drag.begin(frame, pose)
            self._scene.hold(name)
            self._wake.notify()
        if drag.hand != hand:
            return None
        drag.heard = time.monotonic()
        return drag

    def _end_for(self, name: str) -> None:
        """No hand has a handle any more."""
        self._over.append(self._held.pop(name))

    def _work(self) -> None:
        with contextlib.suppress(rospy.ROSInterruptException):
            while not rospy.is_shutdown():
                with self._wake:
                    drag = self._next()
                    held = {name: one.hand for name, one in self._held.items()}
                if self._others is not None and held != self._told:
                    self._told = held
                    self._others.tell(held)
                for name, drop in list(self._drops.items()):
                    with contained(f'{name} cannot be looked at where it was dropped'):
                        self._look_at(name, drop)
                if drag is not None:
                    with contained(f'{drag.handle.name} cannot follow its hand'):
                        self._follow(drag)

    def _look_at(self, name: str, drop: Drop) -> None:
        """Take back a drag whose thing is not shown where it was dropped, even after several changes of its sources."""
        drag = drop.drag
        error = '' if drop.loop.seen else self._why_raised(drag)
        if not error:
            drop.see(self._scene.handle(name))
        error = error or drag.unlike
        if not (error or drop.loop.is_over) or self._drops.get(name) is not drop:
            return
        del self._drops[name]
        if error:
            self._scene.say(drag.handle, f'{drag.unlike or drag.request.raised(error)}; {self._take_back(drag)}')
            self._scene.let_go(name)
        elif not drop.is_seen:
            why = self._why_left(drag, self._scene.handle(name) or drag.handle)
            if not why and drop.is_passed_by and self._is_in_force(drag):
                kept = f'its messages still come from the old value of {self._names(drag.request.after)}'
                self._scene.say(drag.handle, f'{kept}; {self._take_back(drag)}')
                self._scene.let_go(name)
            else:
                self._scene.say(drag.handle, f'changed; {why}' if why else 'changed, but not shown yet')
                self._background.call_soon(functools.partial(self._say_outdated, drag))
        elif drag.is_exact and not drag.went_on and drop.is_elsewhere and self._is_in_force(drag):
            parts = ['its node shows it elsewhere than it was dropped, and computes it in another way']
            if drag.refusal:
                parts.append(wording.refusal(drag.refusal))
            self._scene.say(drag.handle, '; '.join([*parts, self._take_back(drag)]))
        else:
            self._background.call_soon(functools.partial(self._say_outdated, drag))

    def _say_outdated(self, drag: Drag) -> None:
        """Say what still has the former value: a target, say, that its node has read."""
        told = drag.request.outdated()
        if told:
            self._scene.say(drag.handle, told)

    def _why_raised(self, drag: Drag) -> str:
        """The error that a drag has made the publisher, or a node with a changed source, raise; '' for none."""
        nodes = {self._scene.origin(drag.handle.name)[1], *drag.request.nodes}
        return self._raised_since(nodes, drag.request.began)

    def _take_back(self, drag: Drag) -> str:
        """Restore the values that the sources had before a drag; returns a text about the outcome."""
        self._remember(drag)
        reason = self._undo(drag.handle.name)
        return 'it could not be taken back: ' + reason if reason else 'taken back'

    @staticmethod
    def _is_in_force(drag: Drag) -> bool:
        """Return whether all sources still have the values that a drag gave them; changes by others are left alone."""
        try:
            return not drag.request.lost()
        except values.Error:
            return False

    def _change_again(self, drag: Drag) -> bool:
        """Solve again for a thing that is shown elsewhere than it was dropped; False if nothing more has changed."""
        if not drag.is_exact or drag.went_on or not self._is_in_force(drag):
            return False
        before = dict(drag.request.after)
        if drag.handle.basis is None:
            drag.thing = self._scene.handle(drag.handle.name) or drag.thing
        drag.refusal = self._force(drag, drag.pose, may_leap=True)
        if drag.refusal is not None or drag.request.after == before:
            return False
        self._remember(drag)
        return True

    def _remember(self, drag: Drag) -> None:
        """Keep the changes of a drag for undo."""
        past = self._past.setdefault(drag.handle.name, [])
        if drag.request not in past[-1:]:
            past.append(drag.request)

    def _next(self) -> Optional[Drag]:
        """The next drag to follow; after a wait, None if there is none yet."""
        now = time.monotonic()
        for name in [name for name, drag in self._held.items() if now - drag.heard > SILENCE]:
            self._end_for(name)  # as if it had let go
        if self._over:
            drag = self._over.popleft()
            drag.is_over = True
            return drag
        wait = 1.0 / self._rules.rate if self._drops or self._held else PERIOD
        for name, drag in self._held.items():
            drag.take(self._scene.handle(name) or drag.thing)
            if drag.request.after and drag.fault is None and (drag.unlike or self._why_raised(drag)):
                return drag
            follows = self._rules.is_live and not drag.handle.takes_restart
            if follows and (drag.asked != drag.pose or drag.doubt is not None):
                wait = min(wait, drag.due - now)
                if wait <= 0.0:
                    drag.due = now + 1.0 / self._rules.rate
                    return drag
        self._wake.wait(wait)
        return None

    def _follow(self, drag: Drag) -> None:
        """Change the sources so that the handle is where the drag is."""
        if drag.goes_back:
            self._go_back(drag)
            return
        try:
            self._ask(drag)
        except rospy.ROSInterruptException:
            raise
        except Exception as error:  # an error in one drag must not end the others
            rospy.logerr('%s: the drag failed\n%s', drag.handle.name, traceback.format_exc())
            drag.fault = f'{type(error).__name__}: {error}'  # it asks for nothing more
        refusal = drag.fault or (wording.refusal(drag.refusal) if drag.refusal else None)
        if drag.is_over:
            self._end(drag, refusal)
        if refusal:
            self._scene.say(drag.handle, refusal)

    def _ask(self, drag: Drag) -> None:
        """Ask the owners where the hand has gone on since they were last asked, or lets go."""
        error = self._why_raised(drag) if drag.request.after and drag.fault is None else ''
        drag.take(self._scene.handle(drag.handle.name) or drag.thing)
        if drag.request.after and drag.fault is None and (error or drag.unlike):
            drag.fault = f'{drag.unlike or drag.request.raised(error)}; {self._take_back(drag)}'
        if drag.fault is not None or drag.is_over:
            drag.give_up_doubt()
        if drag.doubt is not None:
            self._ask_back(drag, drag.doubt)
        if drag.doubt is not None:
            return
        pose, asked = drag.pose, drag.asked
        drag.asked = pose
        # An answer that can only be reached by a leap is one when the hand lets go, if nothing has followed it yet.
        may_leap = drag.is_over and not drag.followed and pose != drag.start
        has_no_answer = drag.refusal is None or isinstance(drag.refusal, values.NotInvertible)
        if drag.fault is None and (pose != asked or (may_leap and has_no_answer)):
            drag.refusal = self._force(drag, pose, may_leap)

    @staticmethod
    def _ask_back(drag: Drag, doubt: Handle) -> None:
        """Ask the owners for what has the next message tell whether the node of a thing has gone on."""
        drag.asked = None
        back, after = drag.before_doubt(doubt), drag.request.after
        wanted = {source: value for source, value in (back or {}).items() if after.get(source, value) != value}
        try:
            if wanted:
                drag.request.step(wanted)
        except values.Error:
            back = None
        if back is None:
            drag.give_up_doubt()

    def _end(self, drag: Drag, refusal: Optional[str]) -> None:
        name = drag.handle.name
        if drag.request.after:
            self._remember(drag)
        if name not in self._held:  # no hand has taken it again meanwhile
            self._scene.let_go(name, None if refusal or not drag.request.after else drag.request)
            if not refusal and drag.request.after:
                self._drops[name] = Drop(drag, lambda: self._change_again(drag), self._rules.resolution)
        if refusal:
            rospy.logwarn('%s snaps back: %s', name, refusal)

    def _go_back(self, drag: Drag) -> None:
        name = drag.handle.name
        told = self._take_back(drag) if drag.request.after else ''
        if name not in self._held:
            self._scene.let_go(name)
        if drag.request.after:  # as it is not taken back
            self._scene.say(drag.handle, told)

    def _force(self, drag: Drag, pose: PoseTuple, may_leap: bool) -> Optional[Exception]:
        """Ask the owners for what a drag wants; the refusal, or None."""
        handle = self._scene.handle(drag.handle.name) or drag.handle
        misfit = drag.misfit(handle) or self._why_gone(drag, handle)
        misfit = misfit or self._why_left(drag, handle)
        if misfit:
            drag.fault = drag.fault or misfit
            return None
        drag.chosen = self.chosen_for(drag.handle)
        tracked, targets, limit = drag.wanted(drag.thing, pose)
        if drag.went_on:  # the sources of what the hand has may be others by now
            tracked = values.reapply(tracked, values.source_values(list(handle.tracked)))
        stays = f'chosen: {self._names(drag.chosen)}; the rest stays' if drag.goes_beyond_choice(handle, pose) else ''
        if not tracked:
            if stays:
                self._scene.say(handle, stays)
            return None
        timeout = self._rules.timeout
        try:
            plan = changes.plan(
                tracked,
                targets,
                drag.chosen,
                timeout / 2,
                began=drag.request.before,
                last=drag.followed,
                may_leap=may_leap,
                resolution=self._rules.resolution,
                thing=drag.handle.tracked,
                shared=drag.shared,
                limited=drag.handle.limits,
                in_place=drag.targets_in_place(self._scene.handle),
                takes_restart=drag.handle.takes_restart,
            )
            joint_limits.check(drag.handle.limits, plan.after)
            if drag.thing.basis is not None:
                drag.thing.basis.check(plan.after)
            wanted = changes.to_request(plan, drag.request.after)
            if wanted:
                drag.solved = handle
                drag.request.step(wanted)
            if plan.is_exact:
                drag.followed = {source: drag.request.after.get(source, new) for source, new in plan.after.items()}
        except values.Error as error:
            others = [source for source in values.sources(list(tracked)) if source not in drag.held]
            is_others = isinstance(error, values.NotInvertible) and others
            return values.NotInvertible(self._comes_from(others)) if is_others else error
        # The nearest whole number is all that can be had: where it puts the thing is where that belongs.
        drag.is_exact = plan.gap <= self._rules.resolution and not plan.whole
        self._say_how_far(drag, handle, plan, limit, stays)
        return None

    def _names(self, sources: Iterable[values.Source]) -> str:
        return ', '.join(map(self._name_of, sources))

    def _why_gone(self, drag: Drag, handle: Handle) -> str:
        """Why the thing that a hand took hold of is gone, '' if it is there.

        It is gone if its sources no longer exist, as after a live script was saved anew. Sources that only have no
        effect on it now, as in another branch of its node, do not count.
        """
        held = list(drag.handle.tracked)
        if set(values.sources(held)) <= set(values.sources(list(handle.tracked))):
            return ''
        try:
            node.reevaluate(held, self._rules.timeout)
        except node.SourceUnreachable as error:
            return f'its numbers are others by now: {error}'
        return ''

    def _why_left(self, drag: Drag, handle: Handle) -> str:
        """Say what a thing comes from that has nothing to do with a drag any more, '' if it has."""
        sources = values.sources(list(handle.tracked))
        return self._comes_from(sources) if drag.has_left(sources) else ''

    def _comes_from(self, sources: List[values.Source]) -> str:
        return node.comes_from(node.directory().own_first(sources), self._name_of)

    def _say_how_far(self, drag: Drag, handle: Handle, plan: changes.Plan, limit: str, stays: str) -> None:
        reasons = [wording.short_numbers(limit)] if limit else []
        if plan.gap > self._rules.resolution:
            reasons += [wording.limit(plan.stops, self._name_of)] if plan.stops else []
            reasons += ['{} takes whole numbers only'.format(self._name_of(source)) for source in plan.whole]
            reasons += [f'{other} is held in place' for other in drag.in_place]
            reasons = reasons or ['as near as possible']
        for source in node.directory().shared(drag.handle.tracked, drag.shared, plan.after):
            reasons.append(f'{self._name_of(source)} moves others, too')
        for source in plan.after:
            place = node.directory().of(source)
            if place is not None and place.location.plain_copies:
                reasons.append(f'{self._name_of(source)}: {place.location.plain_copies}')
        late = dict.fromkeys(filter(None, map(node.directory().at_next_start, plan.after)))
        reasons += [f'it {why}' for why in late]
        reasons += [WENT_ON] if drag.went_on > self._rules.resolution else []
        reasons += [stays] if stays else []
        chosen = self.chosen.get(handle.name)
        if chosen and not drag.chosen and plan.after:
            reasons.append(f'it does not come from {self._names(chosen)} now: a drag changes {self._names(plan.after)}')
        if reasons:
            self._scene.say(handle, '; '.join(reasons))
