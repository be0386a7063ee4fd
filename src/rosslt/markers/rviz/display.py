"""The display: which interactive markers RViz is shown, and how they follow the handles of a scene.

Handles are put and dropped as messages come; `apply` then sends what differs from what RViz has, at most as
often as it is called. What a hand holds is left alone: RViz lets go of a marker that is inserted again.
"""

import traceback
from typing import Any, Callable, Dict, Hashable, List, Optional, Set, Tuple

import rospy
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from rosslt.markers.drags.drags import Drags
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.rviz import controls
from rosslt.markers.rviz.notes import Notes
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.handle import CanChange, Handle
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.shapes import pose_tuple


class Display:
    """A scene in RViz: a View of it.

    Args:
        server: a `Server`, which nobody else uses.
        scene: what is shown.
        can_change: tells of a tracked value whether it has a source that takes changes.
        notes: the texts beside handles.

    Attributes:
        free: the names of handles whose bodies move in the plane of the screen.
    """

    def __init__(self, server: Server, scene: Scene, can_change: CanChange, notes: Notes) -> None:
        self.lock = scene.lock
        self.free: Set[str] = set()
        self._server, self._scene, self._can_change, self._notes = server, scene, can_change, notes
        self._drags: Optional[Drags] = None
        self._add_menu: Callable[[Any, Handle], None] = lambda server, handle: None
        self._wanted: Dict[str, Handle] = {}
        self._shown: Dict[str, Tuple[Hashable, Optional[PoseTuple]]] = {}  # name -> (draw_key, pose)
        self._differ: Set[str] = set()

    def connect(self, drags: Drags, add_menu: Callable[[Any, Handle], None]) -> None:
        """Connect drags and menus, before the first handle is added.

        Args:
            drags: told of what hands do.
            add_menu: called with (server, handle) once a handle's marker has been inserted.
        """
        self._drags, self._add_menu = drags, add_menu

    # What the scene tells a View.

    def put(self, handle: Handle) -> None:
        """A handle is there, or has changed."""
        name = handle.name
        self._wanted[name] = handle
        shown = self._shown.get(name)
        if shown is None or shown[1] != handle.pose or shown[0] != handle.draw_key:
            self._differ.add(name)

    def drop(self, name: str) -> None:
        """A handle was removed."""
        if self._wanted.pop(name, None) is not None:
            self._differ.add(name)

    def let_go(self, name: str) -> None:
        """A drag has ended: the server has to hear of the pose in any case, as other clients are shown the old one."""
        if name in self._shown:
            self._shown[name] = (self._shown[name][0], None)
            self._differ.add(name)

    def say(self, handle: Handle, text: str) -> None:
        """Put a note beside a handle."""
        self._notes.put(handle, text)

    # For the node.

    def redraw(self, name: str) -> None:
        """Have a marker drawn anew, as its menu has changed."""
        with self.lock:
            if name in self._shown:
                self._shown[name] = (None, self._shown[name][1])
                self._differ.add(name)

    def names(self) -> List[str]:
        """The names of all handles that are shown."""
        with self.lock:
            return list(self._wanted)

    def apply(self) -> None:
        """Send what differs from what RViz has."""
        with self.lock:
            has_changed = self._notes.update(self._server)
            if self._differ:
                self._differ = {name for name in self._differ if not self._update(name)}
                has_changed = True
            if has_changed:
                self._server.applyChanges()

    def clear(self) -> None:
        """Take everything away, at the end."""
        with self.lock:
            self._wanted.clear()
            self._server.clear()
            self._server.applyChanges()

    def _update(self, name: str) -> bool:
        """Bring one marker up to date; False where it has to wait."""
        handle, shown = self._wanted.get(name), self._shown.get(name)
        if self._scene.is_held(name):
            return False
        if handle is None:
            if shown is not None:
                self._server.erase(name)
                del self._shown[name]
            return True
        if shown is None or shown[0] != handle.draw_key:
            try:
                self._server.insert(controls.handle_marker(handle, self._can_change, name in self.free), self._feedback)
                self._add_menu(self._server, handle)
            except Exception:  # a thing that cannot be drawn must not prevent the others from being shown
                rospy.logerr('%s cannot be shown\n%s', name, traceback.format_exc())
        elif shown[1] != handle.pose:
            self._server.setPose(name, controls.pose_message(handle.pose))
        self._shown[name] = (handle.draw_key, handle.pose)
        return True

    def _feedback(self, feedback: Any) -> None:
        """Hand on what RViz reports of a drag."""
        if self._drags is None:
            return
        name, event = feedback.marker_name, feedback.event_type
        if event == Feedback.MOUSE_DOWN:
            self._drags.hold(name)
        elif event == Feedback.POSE_UPDATE:
            self._drags.move(name, feedback.header.frame_id, pose_tuple(feedback.pose))
        elif event == Feedback.MOUSE_UP:
            self._drags.release(name, feedback.header.frame_id, pose_tuple(feedback.pose))
        else:
            self._drags.keep(name)
