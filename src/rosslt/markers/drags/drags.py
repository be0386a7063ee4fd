"""All drags of a scene: which changes are requested while the mouse moves, and which messages are shown.

What hands do is only noted as it is reported. One thread of its own asks the owners, the newest
position first and as often as the rate allows, and waits for their answers.

The scene is called with the lock of the drags held, but never calls back, so that nobody waits for it long.
"""

import collections
import threading
import time
import traceback
from typing import Any, Callable, Deque, Dict, List, NamedTuple, Optional, Set, Tuple

import rospy

from rosslt import node, values
from rosslt.markers.drags import changes, wording
from rosslt.markers.drags.drag import Drag
from rosslt.markers.drags.drop import Drop
from rosslt.markers.drags.other_views import REPEAT_PERIOD, SILENCE, OtherViews
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.scene import Scene

#: The maximal distance from its target at which a drag ends without a message, in the unit of the coordinate.
NOTICEABLE = 1e-3


class Rules(NamedTuple):
    """Settings: when and how sources follow hands.

    Attributes:
        is_live: whether they follow while the mouse moves, or when the button is released.
        rate: how often they follow while it moves, in Hz.
        timeout: how long an owner may take to answer, in seconds.
    """

    is_live: bool = True
    rate: float = 20.0
    timeout: float = 1.0


class Drags:
    """All hands on the handles of a scene.

    Args:
        scene: has the handles.
        rules: how sources follow.
        name_of: what a source is called, for people.
        view: the name of this view among others that show the same things.
        errors: hears of errors in nodes; a change that makes one raise is taken back.

    Attributes:
        chosen: {name of a handle: the Source that its drags change}.
    """

    def __init__(
        self,
        scene: Scene,
        rules: Rules,
        name_of: Callable[[Any], str],
        view: str = '',
        errors: Optional[node.NodeErrors] = None,
    ) -> None:
        self._scene, self._rules, self._name_of, self._errors = scene, rules, name_of, errors
        self._held: Dict[str, Drag] = {}
        self._over: Deque[Drag] = collections.deque()
        self._drops: Dict[str, Drop] = {}  # by the names of handles
        self._wake = threading.Condition()
        self.chosen: Dict[str, Optional[values.Source]] = {}
        self._past: Dict[str, List[Tuple[str, Set[str]]]] = {}  # name of a handle -> (request id, nodes) of its drags
        self._others = OtherViews(view)
        self._tell: Callable[[Dict[str, float]], None] = lambda held: None
        self._told_at = 0.0
        threading.Thread(target=self._work, name='drags', daemon=True).start()

    def share(self, tell: Callable[[Dict[str, float]], None]) -> None:
        """Have a function called with what is held in this view, {name of a handle: since when}, for other views."""
        self._tell = tell

    def hear(self, view: str, held: Dict[str, float]) -> None:
        """Take in the handles that are held in another view, {name of a handle: start time}; the earlier hold wins."""
        with self._wake:
            self._others.hear(view, held)
            for name in list(self._held):
                if self._others.is_before(name, self._held[name].since):
                    self._end_for(name, wording.HELD)
            self._wake.notify()

    def hold(self, name: str, hand: str = '', frame: str = '', pose: Optional[PoseTuple] = None) -> bool:
        """A hand takes hold of a handle; False where there is none, or another hand has it, here or in another view.

        Args:
            hand: whose it is, where one view shows the handle to several people.
            frame: the frame that the pose is in.
            pose: where the view showed it then; None for where the last message has it.
        """
        with self._wake:
            drag = self._held.get(name)
            if drag is not None and drag.hand == hand and (drag.is_moved or drag.is_turned):
                self._end_for(name)  # nothing was heard of its letting go
            return self._drag_of(name, hand, frame, pose) is not None

    def move(self, name: str, frame: str, pose: PoseTuple, hand: str = '') -> bool:
        """A hand has moved a handle; False as of `hold`.

        Where it has not said that it takes hold, it does so here: RViz reports the pose first, and the press then.

        Args:
            frame: the frame that the pose is in.
            pose: where it stands now.
            hand: as of `hold`.
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
        """A hand has let go of a handle; False where it did not have it."""
        with self._wake:
            drag = self._held.get(name)
            if drag is None or drag.hand != hand:
                return False
            drag.heard = time.monotonic()
            drag.move(frame, pose)
            self._end_for(name)
            self._wake.notify()
            return True

    def undo(self, name: str) -> None:
        """Restore the values that the sources of a handle had before its last drag."""
        handle, past = self._scene.handle(name), self._past.get(name)
        if handle is None:
            return
        if not past:
            self._scene.say(handle, 'nothing to undo')
            return
        request_id, nodes = past[-1]
        self._drops.pop(name, None)
        undone = node.undo_request(request_id, nodes, rospy.get_name(), self._rules.timeout)
        if undone.reasons:
            reason = '; '.join(dict.fromkeys(undone.reasons.values()))
            rospy.logwarn('%s: cannot undo: %s', name, reason)
            self._scene.say(handle, 'cannot undo: ' + reason)
        if undone.changes or not undone.reasons:
            past.pop()

    def _drag_of(self, name: str, hand: str, frame: str, pose: Optional[PoseTuple]) -> Optional[Drag]:
        """The drag of a hand, which begins at a pose where nobody has the handle; None where another hand has it."""
        drag = self._held.get(name)
        if drag is None:
            handle = self._scene.handle(name)
            if handle is None or self._others.first(name) is not None:
                return None
            self._drops.pop(name, None)
            drag = self._held[name] = Drag(handle, node.new_request_id(), hand)
            if pose is not None:
                drag.begin(frame, pose)
            self._scene.hold(name)
            self._tell_others()
        if drag.hand != hand:
            return None
        drag.heard = time.monotonic()
        return drag

    def _end_for(self, name: str, fault: Optional[str] = None) -> None:
        """No hand has a handle any more."""
        drag = self._held.pop(name)
        drag.fault = drag.fault or fault
        self._over.append(drag)
        self._tell_others()

    def _tell_others(self) -> None:
        self._told_at = time.monotonic()
        self._tell({name: drag.since for name, drag in self._held.items()})

    def _work(self) -> None:
        while not rospy.is_shutdown():
            with self._wake:
                drag = self._next()
            try:
                self._look_at_what_was_dropped()
            except rospy.ROSInterruptException:
                return
            except Exception:
                rospy.logerr('what was dropped could not be looked at\n%s', traceback.format_exc())
            if drag is None:
                self._scene.say_what_is_not_shown()
                continue
            try:
                self._follow(drag)
            except rospy.ROSInterruptException:
                return
            except Exception as error:  # an error in one drag must not end the others
                rospy.logerr('%s: the drag failed\n%s', drag.handle.name, traceback.format_exc())
                drag.fault = drag.fault or '{}: {}'.format(type(error).__name__, error)  # it asks for nothing more
                self._scene.say(drag.handle, drag.fault)
                if drag.is_over:
                    self._scene.let_go(drag.handle.name)

    def _look_at_what_was_dropped(self) -> None:
        """Take back what is not shown where it was dropped, although its sources were changed again and again."""
        for name, drop in list(self._drops.items()):
            error = '' if drop.loop.observer.new else self._why_raised(drop.drag)
            if not error:
                try:
                    drop.see(self._scene.handle(name))
                except Exception:
                    self._drops.pop(name, None)
                    raise
                if not drop.loop.is_over:
                    continue
            if self._drops.get(name) is not drop:
                continue
            del self._drops[name]
            if (error or drop.is_elsewhere) and self._is_in_force(drop.drag):
                refusal = drop.drag.refusal
                why = error or 'its node shows it elsewhere than it was dropped, and computes it in another way'
                reason = '; ' + wording.refusal(refusal) if refusal else ''
                self._scene.say(drop.drag.handle, f'{why}{reason}; {self._take_back(drop.drag)}')

    def _is_in_force(self, drag: Drag) -> bool:
        """Return whether all sources still have what a drag gave them: what others have changed since is left alone."""
        given = [values.track(new, source) for source, new in drag.after.items()]
        try:
            return bool(values.untracked(node.reevaluate(given, self._rules.timeout)) == values.untracked(given))
        except values.Error:
            return False

    def _why_raised(self, drag: Drag) -> str:
        """The error that the last change of a drag has made a node raise; '' where there is none."""
        if self._errors is None:
            return ''
        return self._errors.raised_since({source.node for source in drag.before}, drag.requested)

    def _change_again(self, drag: Drag) -> Dict[values.Source, node.Change]:
        """Solve again for a thing that is shown elsewhere than it was dropped; gives what its drag has changed by now,
        {} where it has changed nothing more."""
        if not self._is_in_force(drag):
            return {}
        before = dict(drag.after)
        drag.refusal = self._force(drag, drag.pose, may_leap=True)
        if drag.refusal is not None or drag.after == before:
            return {}
        self._remember(drag)
        return drag.changes

    def _take_back(self, drag: Drag) -> str:
        """Restore what the sources were before a drag, as a force that is not reached does; what came of it."""
        past = self._past.get(drag.handle.name)
        nodes = {source.node for source in drag.before}
        undone = node.undo_request(drag.request_id, nodes, rospy.get_name(), self._rules.timeout)
        if undone.reasons:
            return 'it could not be taken back: ' + '; '.join(dict.fromkeys(undone.reasons.values()))
        if past and past[-1][0] == drag.request_id:
            past.pop()
        return 'taken back'

    def _remember(self, drag: Drag) -> None:
        """Keep what a drag has changed, to be undone."""
        past = self._past.setdefault(drag.handle.name, [])
        if past and past[-1][0] == drag.request_id:
            past.pop()
        past.append((drag.request_id, {source.node for source in drag.before}))

    def _next(self) -> Optional[Drag]:
        """The next drag to follow; after a wait, None where there is none yet."""
        now = time.monotonic()
        for name in [name for name, drag in self._held.items() if now - drag.heard > SILENCE]:
            self._end_for(name)  # as if it had let go
        if self._held and now - self._told_at > REPEAT_PERIOD:
            self._tell_others()
        if self._over:
            drag = self._over.popleft()
            drag.is_over = True
            return drag
        wait = 1.0 / self._rules.rate if self._drops else REPEAT_PERIOD
        for drag in self._held.values():
            if self._rules.is_live and drag.asked != drag.pose:
                wait = min(wait, drag.due - now)
                if wait <= 0.0:
                    drag.due = now + 1.0 / self._rules.rate
                    return drag
        self._wake.wait(wait)
        return None

    def _follow(self, drag: Drag) -> None:
        """Change the sources so that the handle is where the drag is."""
        pose, asked, is_last = drag.pose, drag.asked, drag.is_over
        drag.asked = pose
        error = '' if drag.fault else self._why_raised(drag)
        if error:
            drag.fault = f'{error}; {self._take_back(drag)}'
            drag.before, drag.after = {}, {}
        # An owner that was silent until after the release is not asked again: it has been waited for.
        is_silent = isinstance(drag.refusal, node.SourceUnreachable) and drag.answered > drag.heard
        # An answer that can only be reached by a leap is one when the hand lets go, where nothing has followed it yet.
        may_leap = is_last and not drag.followed and pose != drag.start
        has_no_answer = drag.refusal is None or isinstance(drag.refusal, values.NotInvertible)
        is_new = pose != asked or (may_leap and has_no_answer)
        if drag.fault is None and is_new and not (is_last and is_silent):
            drag.refusal = self._force(drag, pose, may_leap)
            drag.answered = time.monotonic()
        refusal = drag.fault
        if refusal is None and drag.refusal is not None:
            refusal = wording.refusal(drag.refusal)
        if is_last:
            self._end(drag, refusal)
        if refusal:
            self._scene.say(drag.handle, refusal)

    def _end(self, drag: Drag, refusal: Optional[str]) -> None:
        name = drag.handle.name
        if drag.before and drag.fault == wording.HELD and self._is_in_force(drag):
            # this view did not know yet that another hand has it: what it did meanwhile is not for that hand to see
            refusal = f'{refusal}; {self._take_back(drag)}'
        elif drag.before:
            self._remember(drag)
        if name not in self._held:  # no hand has taken it again meanwhile
            self._scene.let_go(name, None if refusal else drag.after)
            if not refusal and drag.after and drag.is_exact:
                self._drops[name] = Drop(drag, self._scene.handle(name), lambda: self._change_again(drag))
        if refusal:
            rospy.logwarn('%s snaps back: %s', name, refusal)

    def _force(self, drag: Drag, pose: PoseTuple, may_leap: bool) -> Optional[Exception]:
        """Ask the owners for what a drag wants; the refusal, or None."""
        handle = self._scene.handle(drag.handle.name) or drag.handle
        misfit = drag.misfit(handle)
        if misfit is not None:
            drag.fault = drag.fault or misfit
            return None
        tracked, targets = handle.wanted(pose, drag.is_moved, drag.is_turned)
        if not tracked:
            return None
        timeout = self._rules.timeout
        try:
            chosen = self.chosen.get(handle.name)
            plan = changes.plan(tracked, targets, chosen, timeout / 2, drag.before, drag.followed, may_leap)
            wanted = changes.to_request(plan, drag.after)
            if wanted:
                drag.solved, drag.requested = handle, time.monotonic()
                drag.remember(node.request_values(wanted, timeout, drag.request_id))
            if plan.is_exact:
                drag.followed = {source: drag.after.get(source, new) for source, new in plan.after.items()}
        except values.Error as error:
            # Of several owners, some may have changed what others have refused.
            drag.remember(getattr(error, 'changed', {}))
            return error
        drag.is_exact = plan.gap <= NOTICEABLE
        self._say_how_far(handle, plan)
        return None

    def _say_how_far(self, handle: Handle, plan: changes.Plan) -> None:
        # A whole number rarely fits exactly; that is not worth a message.
        is_whole = any(isinstance(value, int) for value in plan.after.values())
        if plan.gap > NOTICEABLE and not is_whole:
            reasons: List[str] = [wording.limit(plan.stops, self._name_of)] if plan.stops else []
            self._scene.say(handle, '; '.join(reasons) or 'as near as possible')
