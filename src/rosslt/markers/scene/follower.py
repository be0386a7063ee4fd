"""What every view of a scene does alike: it notes which handles differ from what is shown, and brings these up to date.

Handles are put and dropped as messages come; `follow` then shows what differs, at most as often as it is called. What a
hand holds is left alone, as the hand knows better than the last message where it is.
"""

import traceback
from typing import Dict, Hashable, List, Optional, Set, Tuple

import rospy

from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.scene import Scene


class Follower:
    """A View of a scene, but for the showing itself: `draw`, `move` and `erase`, which are called with its lock held.

    Args:
        scene: what is shown.
    """

    def __init__(self, scene: Scene) -> None:
        self.lock = scene.lock
        self._scene = scene
        self._wanted: Dict[str, Handle] = {}
        self._shown: Dict[str, Tuple[Hashable, Optional[PoseTuple]]] = {}  # name -> (draw_key, pose)
        self._differ: Set[str] = set()

    def draw(self, handle: Handle) -> None:
        """Draw a handle, in place of an earlier drawing."""
        raise NotImplementedError

    def move(self, handle: Handle) -> None:
        """Put a handle that is drawn where it is now."""
        raise NotImplementedError

    def erase(self, name: str) -> None:
        """Take the drawing of a handle away."""
        raise NotImplementedError

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
        """A drag has ended: the pose has to be shown in any case, as others see the one before the drag."""
        if name in self._shown:
            self._shown[name] = (self._shown[name][0], None)
            self._differ.add(name)

    # For those who call it from time to time.

    def redraw(self, name: str) -> None:
        """Have a handle drawn anew, as something else that belongs to it has changed."""
        with self.lock:
            if name in self._shown:
                self._shown[name] = (None, self._shown[name][1])
                self._differ.add(name)

    def names(self) -> List[str]:
        """The names of all handles that are shown."""
        with self.lock:
            return list(self._wanted)

    def follow(self) -> bool:
        """Show what differs; returns whether anything did."""
        with self.lock:
            if not self._differ:
                return False
            self._differ = {name for name in self._differ if not self._update(name)}
            return True

    def _update(self, name: str) -> bool:
        """Bring one handle up to date; False where it has to wait."""
        handle, shown = self._wanted.get(name), self._shown.get(name)
        if self._scene.is_held(name):
            return False
        if handle is None:
            if shown is not None:
                self.erase(name)
                del self._shown[name]
            return True
        if shown is None or shown[0] != handle.draw_key:
            try:
                self.draw(handle)
            except Exception:  # a thing that cannot be drawn must not prevent the others from being shown
                rospy.logerr('%s cannot be shown\n%s', name, traceback.format_exc())
        elif shown[1] != handle.pose:
            self.move(handle)
        self._shown[name] = (handle.draw_key, handle.pose)
        return True
