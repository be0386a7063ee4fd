"""Drags: what RViz reports of a hand on a marker, and what is asked of the sources for it.

Feedback comes in rospy's threads and is only noted there. One thread of its own asks the owners, the newest
position first and as often as the rate allows, and waits for their answers.
"""

import collections
import math
import threading
import time
import traceback

import rospy
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from rosslt import node, values
from rosslt.markers import changing
from rosslt.markers.controls import pose_tuple
from rosslt.markers.geometry import are_same_rotation, moved_alike, normalized, turned_alike

#: RViz reports several times a second while a button is down; a hand that is silent for so many is gone.
HAND_TIMEOUT = 3.0

#: What numbers in 32 bits may be off, against their size or 1.
NOISE = 1e-6

#: How far off its target, in the unit of the thing, a drag may end without a word.
NOTICEABLE = 1e-3

#: How many drags of one handle can be undone.
UNDO_LIMIT = 50


class Drags:
    """All hands on the markers of a board.

    Args:
        board: holds the markers.
        is_live: whether sources follow while the mouse moves, or when the button is released.
        rate: how often sources follow a drag, in Hz.
        timeout: how long an owner may take to answer, in seconds.
        say: called with (handle, text) where a hand ought to be told something.
    """

    def __init__(self, board, is_live, rate, timeout, say):
        self._board = board
        self._is_live, self._period, self._timeout = is_live, 1.0 / rate, timeout
        self._say = say
        self._held, self._over = {}, collections.deque()
        self._wake = threading.Condition()
        self.chosen = {}  # name of a handle -> the Source that its drags change
        self._past = {}  # name of a handle -> its drags, each {Source: (value after, value before)}
        threading.Thread(target=self._work, name='drags', daemon=True).start()

    def feedback(self, feedback):
        """Note what RViz reports."""
        name, event = feedback.marker_name, feedback.event_type
        with self._wake:
            drag = self._held.get(name)
            if drag is None:
                handle = self._board.handle(name)
                if handle is None or event not in (Feedback.MOUSE_DOWN, Feedback.POSE_UPDATE):
                    return
                drag = self._held[name] = _Drag(handle)
                self._board.hold(name)
            drag.heard = time.monotonic()
            if event in (Feedback.POSE_UPDATE, Feedback.MOUSE_UP):
                drag.move(feedback.header.frame_id, pose_tuple(feedback.pose))
            if event == Feedback.MOUSE_UP:
                self._over.append(self._held.pop(name))
            self._wake.notify()

    def undo(self, name):
        """Have the sources of a handle become what they were before its last drag."""
        handle, past = self._board.handle(name), self._past.get(name)
        if handle is None:
            return
        if not past:
            self._say(handle, 'nothing to undo')
            return
        try:
            changing.request(past[-1], self._timeout)
        except values.Error as error:
            rospy.logwarn('%s: cannot undo: %s', name, error)
            self._say(handle, 'cannot undo: {}'.format(error))
        else:
            past.pop()

    def _work(self):
        while not rospy.is_shutdown():
            with self._wake:
                drag = self._next()
            if drag is None:
                continue
            try:
                self._follow(drag)
            except rospy.ROSInterruptException:
                return
            except Exception:  # one drag that goes wrong must not end all others
                rospy.logerr('%s: the drag failed\n%s', drag.handle.name, traceback.format_exc())
                self._board.let_go(drag.handle.name, drag.pose, is_followed=False)

    def _next(self):
        """The next drag to follow; after a wait, None where there is none yet."""
        now = time.monotonic()
        for name in [name for name, drag in self._held.items() if now - drag.heard > HAND_TIMEOUT]:
            drag = self._held.pop(name)
            drag.fault = 'RViz reports no more of the drag'
            self._over.append(drag)
        if self._over:
            drag = self._over.popleft()
            drag.is_over = True
            return drag
        wait = 0.5
        for drag in self._held.values():
            if self._is_live and drag.followed != drag.pose:
                wait = min(wait, drag.due - now)
                if wait <= 0.0:
                    drag.due = now + self._period
                    return drag
        self._wake.wait(wait)
        return None

    def _follow(self, drag):
        """Have the sources follow a drag to where it is."""
        name, pose, is_last = drag.handle.name, drag.pose, drag.is_over
        # An owner that was silent until after the release is not asked again: it has been waited for.
        is_silent = isinstance(drag.refusal, node.SourceUnreachable) and drag.answered > drag.heard
        if drag.fault is None and pose != drag.followed and not (is_last and is_silent):
            drag.refusal = self._force(drag, pose)
            drag.followed, drag.answered = pose, time.monotonic()
        refusal = drag.fault or drag.refusal
        if is_last:
            if drag.before:
                past = self._past.setdefault(name, collections.deque(maxlen=UNDO_LIMIT))
                past.append({source: (drag.after[source], value) for source, value in drag.before.items()})
            if name not in self._held:  # no hand has taken it again meanwhile
                self._board.let_go(name, pose, is_followed=bool(drag.before) and not refusal)
            if refusal:
                rospy.logwarn('%s snaps back: %s', name, refusal)
        if refusal:
            self._say(drag.handle, str(refusal))

    def _force(self, drag, pose):
        """Ask the owners for what a drag wants; the refusal, or None."""
        handle = self._board.handle(drag.handle.name) or drag.handle
        tracked, targets = handle.wanted(pose, drag.is_moved, drag.is_turned)
        if not tracked:
            return None
        try:
            outcome = changing.force(tracked, targets, self.chosen.get(handle.name), self._timeout)
        except values.Error as error:
            # Of several owners, some may have changed what others have refused.
            drag.remember(getattr(error, 'changed', {}))
            return error
        drag.remember(outcome.changes)
        # A whole number always stays a little off; that is no limit that anybody has to be told of.
        is_whole = any(isinstance(change.new, int) for change in outcome.changes.values())
        if outcome.gap > NOTICEABLE and not is_whole:
            self._say(handle, 'as far as it goes')
            if not drag.is_limited:
                rospy.loginfo('%s cannot follow to (%.4g, %.4g, %.4g)', handle.name, *pose[:3])
            drag.is_limited = True
        return None


class _Drag:
    """One hand on one marker, from the press of the button to its release."""

    def __init__(self, handle):
        self.handle = handle
        self.pose = self.followed = self.start = handle.pose
        self.is_moved = self.is_turned = self.is_over = self.is_limited = False
        self.heard = time.monotonic()
        self.due = self.answered = 0.0
        self.fault = self.refusal = None
        self.before, self.after = {}, {}

    def move(self, frame, pose):
        """The hand is at a pose now."""
        if frame.lstrip('/') != self.handle.frame.lstrip('/'):
            self.fault = 'its pose is reported in the frame {} instead of {}'.format(frame, self.handle.frame)
            return
        if not all(map(math.isfinite, pose)):
            self.fault = 'its pose is not finite'
            return
        # What the hand left as it was stays exactly that: RViz reports all of it, in 32 bits.
        position = moved_alike(self.start[:3], pose[:3], NOISE)
        rotation = turned_alike(self.start[3:], normalized(*pose[3:]), NOISE)
        self.pose = (*position, *rotation)
        # Only what the hand has changed is asked for, and that even where it goes back to where it was.
        self.is_moved = self.is_moved or position != self.start[:3]
        self.is_turned = self.is_turned or not are_same_rotation(rotation, self.start[3:], NOISE**2)

    def remember(self, changes):
        """Keep what it has changed, to be undone."""
        for source, change in changes.items():
            self.before.setdefault(source, change.old)
            self.after[source] = change.new
