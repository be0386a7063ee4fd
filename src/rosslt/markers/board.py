"""The board: which interactive markers RViz is shown, and how it follows what ought to be there.

Handles are put and dropped as messages come; `apply` then sends what differs from what RViz has, at most as
often as it is called. What a hand holds is left alone: RViz lets go of a marker that is inserted again.
"""

import threading
import time
import traceback

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer

from rosslt.markers.controls import pose_message
from rosslt.markers.geometry import are_same_rotation, distance

#: For how long a message may be under way that does not show a change yet, in seconds.
IN_FLIGHT = 0.25

#: For how long a marker stays where it was let go when no message comes at all, in seconds.
LONGEST_WAIT = 2.0

#: For how long after its last feedback a hand keeps other hands off a marker, in seconds.
OTHER_HAND_TIMEOUT = 1.0

#: Two positions nearer than this are the same, in metres: drags and some messages come in 32 bits.
NEAR = 1e-3


class Board:
    """The interactive markers of one server.

    Args:
        server: a `Server`, which nobody else uses.
    """

    def __init__(self, server):
        self.lock = threading.RLock()
        self._server = server
        self._feedback = self._decorate = self._can_move = None
        self._wanted = {}
        self._shown = {}  # name -> (look, pose)
        self._differ = set()
        self._holds = {}  # name -> _Hold

    def connect(self, feedback, decorate, can_move):
        """Before the first handle is put: what its controls depend on, and what comes of hands on them.

        Args:
            feedback: called with each InteractiveMarkerFeedback on a marker of the board.
            decorate: called with (server, handle) once a handle's marker has been inserted, to add a menu.
            can_move: tells of a tracked value whether it has a source that takes changes.
        """
        self._feedback, self._decorate, self._can_move = feedback, decorate, can_move

    def put(self, handle):
        """A handle that ought to be there, in place of an earlier one of that name."""
        name = handle.name
        self._wanted[name] = handle
        if name in self._holds:
            self._holds[name].see(handle)
        shown = self._shown.get(name)
        if shown is None or shown[1] != handle.pose or shown[0] != handle.look:
            self._differ.add(name)

    def drop(self, name):
        """A handle that is there no longer."""
        if self._wanted.pop(name, None) is not None:
            self._differ.add(name)

    def handle(self, name):
        """The handle of that name, or None."""
        return self._wanted.get(name)

    def names(self):
        """The names of all handles that ought to be there."""
        return list(self._wanted)

    def redraw(self, name):
        """Have a marker drawn anew, as its menu has changed."""
        with self.lock:
            if name in self._shown:
                self._shown[name] = (None, self._shown[name][1])
                self._differ.add(name)

    def hold(self, name):
        """A hand has taken hold of a marker: leave it alone."""
        with self.lock:
            self._holds[name] = _Hold()

    def let_go(self, name, pose, is_followed):
        """The hand has let go.

        Args:
            pose: where the marker stands in RViz now.
            is_followed: whether the sources have followed, so that a message is to be expected that says so
                too; else the marker goes back to where the last message has it.
        """
        with self.lock:
            hold = self._holds.pop(name, None)
            if is_followed and hold is not None:
                hold.expect(pose)
                self._holds[name] = hold
            if name in self._shown:
                # The server has to hear of the pose in any case: other clients are still shown the old one.
                self._shown[name] = (self._shown[name][0], None)
                self._differ.add(name)

    def apply(self):
        """Send what differs from what RViz has."""
        with self.lock:
            if not self._differ:
                return
            now = time.monotonic()
            self._differ = {name for name in self._differ if not self._update(name, now)}
            self._server.applyChanges()

    def clear(self):
        """Take everything away, at the end."""
        with self.lock:
            self._wanted.clear()
            self._server.clear()
            self._server.applyChanges()

    def _update(self, name, now):
        """Bring one marker up to date; False where it has to wait."""
        handle, shown = self._wanted.get(name), self._shown.get(name)
        hold = self._holds.get(name)
        if hold is not None:
            if now < hold.until:
                return False
            del self._holds[name]
        if handle is None:
            if shown is not None:
                self._server.erase(name)
                del self._shown[name]
            return True
        if shown is None or shown[0] != handle.look:
            try:
                self._server.insert(handle.draw(self._can_move), self._feedback)
                self._decorate(self._server, handle)
            except Exception:  # one thing that cannot be drawn must not keep all others from being shown
                rospy.logerr('%s cannot be shown\n%s', name, traceback.format_exc())
        elif shown[1] != handle.pose:
            self._server.setPose(name, pose_message(handle.pose))
        self._shown[name] = (handle.look, handle.pose)
        return True


class _Hold:
    """Why a marker is left alone: a hand holds it, or has let it go at a place that no message says yet."""

    def __init__(self):
        self.until = float('inf')
        self._left_at, self._in_flight_until = None, 0.0

    def expect(self, pose):
        """It was let go at a pose, which a message will say soon."""
        now = time.monotonic()
        self.until = now + LONGEST_WAIT
        self._left_at, self._in_flight_until = pose, now + IN_FLIGHT

    def see(self, handle):
        """A message says where it is: it is believed, unless it was under way when the marker was let go."""
        if self._left_at is not None and (
            _are_near(handle.pose, self._left_at) or time.monotonic() > self._in_flight_until
        ):
            self.until = 0.0


class Server(InteractiveMarkerServer):
    """The server, but for two things.

    A pose that RViz reports is not sent back to it: it would arrive late, and RViz would jump to it at the
    end of the drag. And two hands are kept apart only where there are two: the original refuses any feedback
    in the first second of a marker.
    """

    def processFeedback(self, feedback):  # noqa: N802  (the name is the base class's)
        with self.mutex:
            context = self.marker_contexts.get(feedback.marker_name)
            if context is None:
                return
            now = time.monotonic()
            if (
                context.last_client_id not in ('', feedback.client_id)
                and now - context.last_feedback < OTHER_HAND_TIMEOUT
            ):
                return
            context.last_feedback, context.last_client_id = now, feedback.client_id
        callback = context.feedback_cbs.get(feedback.event_type, context.default_feedback_cb)
        callback(feedback)


def _are_near(first, second):
    return distance(first[:3], second[:3]) < NEAR and are_same_rotation(first[3:], second[3:])
