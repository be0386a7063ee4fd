"""The display: which interactive markers RViz is shown, and how they follow the handles of a scene.

`apply` sends the differences to RViz, at most as often as it is called. RViz lets go of a marker that is
inserted again, so a held marker has to be left alone.
"""

from typing import Optional

from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from rosslt.markers.drags.other_views import OtherViews, held_by
from rosslt.markers.drags.wording import HELD
from rosslt.markers.faults import contained
from rosslt.markers.offers import Offers
from rosslt.markers.rviz import controls
from rosslt.markers.rviz.frames import JoinedFrames
from rosslt.markers.rviz.menus import Menu, Menus
from rosslt.markers.rviz.notes import Notes
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.follower import Follower
from rosslt.markers.scene.handle import Handle, Motions
from rosslt.markers.scene.selection import Selection
from rosslt.markers.scene.shapes import pose_tuple


class Display(Follower):
    """A scene in RViz.

    Args:
        server: a `Server`, which nobody else uses.
        offers: what is shown, and what hands can do.
        notes: the texts beside handles.
        selection: which handles are drawn with arrows and rings.
        handle_size: the size of arrows and rings, in metres; they are larger around larger things.
        frames: those that RViz can show handles in.
        others: whose hands hold things as well.
    """

    def __init__(
        self,
        server: Server,
        offers: Offers,
        notes: Notes,
        selection: Selection,
        handle_size: float,
        frames: JoinedFrames,
        others: Optional[OtherViews] = None,
    ) -> None:
        super().__init__(offers.scene, offers.descriptions, selection)
        self._server, self._drags, self._notes, self._handle_size = server, offers.drags, notes, handle_size
        self._frames, self._others = frames, others
        self._menus = Menus(offers, self.redraw, self.free, selection)
        self._is_over = False

    def extra(self, handle: Handle) -> Optional[Menu]:
        """The menu of a handle."""
        with contained(f'{handle.name} has no menu'):
            return self._menus.of(handle)
        return None

    def say(self, handle: Handle, text: str) -> None:
        """Put a note beside a handle."""
        if self._frames.has(handle.frame):
            self._notes.put(handle, text)

    def leaves_out(self, handle: Handle, motions: Motions) -> bool:
        """Return whether RViz cannot show a handle, or shows its thing by itself: a body that nothing moves would hide
        others from the mouse."""
        return (motions.is_stuck and not handle.draws_thing) or not self._frames.has(handle.frame)

    def draw(self, handle: Handle, motions: Motions) -> None:
        """Insert the interactive marker of a handle."""
        menu = None if motions.is_stuck else self._shown[handle.name].drawing[2]
        is_free = handle.name in self.free
        marker = controls.handle_marker(handle, motions, is_free, self._handle_size, menu is not None)
        self._server.insert(marker, self._feedback)
        if menu is not None:
            self._menus.add(self._server, handle.name, menu)

    def move(self, handle: Handle) -> None:
        """Send where a handle is now."""
        self._server.setPose(handle.name, controls.pose_message(handle.pose))

    def erase(self, name: str) -> None:
        """Take an interactive marker away."""
        self._server.erase(name)

    # For the node.

    def apply(self) -> None:
        """Send the differences to RViz."""
        with self._server.mutex:
            if self._is_over:
                return
            if self._frames.update():
                self.look_again()
            has_changed = self.follow()
            self._mark_held()
            if self._notes.update(self._server) or has_changed:
                self._server.applyChanges()

    def _mark_held(self) -> None:
        """Have it stand beside each thing that is held elsewhere who holds it."""
        for name, who in self._others.held().items() if self._others is not None else ():
            handle = self._scene.handle(name)
            if handle is not None and self._frames.has(handle.frame):
                self._notes.keep(self._server, handle, held_by(who))

    def clear(self) -> None:
        """Take everything away, at the end."""
        with self._server.mutex:
            self._is_over = True
            self._server.clear()
            self._server.applyChanges()

    def _feedback(self, feedback: Feedback) -> None:
        """Hand on what an RViz reports of a drag."""
        name, event, hand = feedback.marker_name, feedback.event_type, feedback.client_id
        frame, pose = feedback.header.frame_id, pose_tuple(feedback.pose)
        if event == Feedback.MOUSE_DOWN:
            handle = self._scene.handle(name)
            is_held = self._drags.hold(name, hand, frame, pose)  # first, so that it is not drawn anew in the hand
            if handle is not None:
                self.selection.things = frozenset([handle.thing])
                if not is_held:
                    self._scene.say(handle, HELD)
        elif event == Feedback.POSE_UPDATE:
            self._drags.move(name, frame, pose, hand)
        elif event == Feedback.MOUSE_UP:
            if not self._drags.release(name, frame, pose, hand):
                self._scene.put_back(name)  # RViz has moved it all the same
        else:
            self._drags.keep(name, hand)
