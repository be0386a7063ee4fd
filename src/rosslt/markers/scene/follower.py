"""Bringing a view up to date with a scene: what every view does alike.

A view is told nothing. Whenever it draws, it takes from the scene what is new, and draws, moves and erases what differs
from what it shows. Nothing of the scene is locked meanwhile. What a hand holds is left alone, as the hand knows better
than the last message where it is.
"""

import queue
from typing import Dict, Hashable, List, NamedTuple, Optional, Set, Tuple

from rosslt.markers.describing import Descriptions
from rosslt.markers.faults import contained
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle, Motions
from rosslt.markers.scene.scene import Scene

#: The rate at which a view is brought up to date, in Hz: that at which RViz draws.
FRAME_RATE = 30.0


class Shown(NamedTuple):
    """A handle as a view shows it.

    Attributes:
        basis: what its motions were computed from.
        drawing: what it was drawn from; None where it has to be drawn anew.
        pose: where it is shown; None where a hand has moved it.
    """

    basis: Hashable
    drawing: Optional[Tuple[Hashable, Motions]]
    pose: Optional[PoseTuple]


class Follower:
    """A view of a scene, but for the drawing itself: `draw`, `move`, `erase` and `say`.

    Only `redraw` may be called by several threads at once.

    Args:
        scene: what is shown.
        descriptions: say which sources take changes.
    """

    def __init__(self, scene: Scene, descriptions: Descriptions) -> None:
        self._scene, self._descriptions = scene, descriptions
        self._version = descriptions.version
        self._wanted: Dict[str, Handle] = {}
        self._shown: Dict[str, Shown] = {}
        self._differ: Set[str] = set()
        self._to_redraw: queue.SimpleQueue[str] = queue.SimpleQueue()

    def draw(self, handle: Handle, motions: Motions) -> None:
        """Draw a handle; the drawing replaces an earlier one."""
        raise NotImplementedError

    def move(self, handle: Handle) -> None:
        """Put a handle that is drawn where it is now."""
        raise NotImplementedError

    def erase(self, name: str) -> None:
        """Take the drawing of a handle away."""
        raise NotImplementedError

    def say(self, handle: Handle, text: str) -> None:
        """Show a message at a handle."""
        raise NotImplementedError

    def redraw(self, name: str) -> None:
        """Have a handle drawn anew, as something else that belongs to it has changed."""
        self._to_redraw.put(name)

    def names(self) -> List[str]:
        """The names of all handles that are shown."""
        return list(self._wanted)

    def follow(self) -> bool:
        """Show what differs; returns whether anything did."""
        self._take_news()
        free = [name for name in self._differ if not self._scene.is_held(name)]
        self._differ.difference_update(free)
        has_changed = False
        for name in free:
            with contained(f'{name} cannot be shown'):
                has_changed = self._update(name) or has_changed
        return has_changed

    def _take_news(self) -> None:
        news = self._scene.news()
        for name, handle in news.handles.items():
            if handle is None:
                self._wanted.pop(name, None)
            else:
                self._wanted[name] = handle
        self._differ.update(news.handles)
        for name in news.let_go & self._shown.keys():
            self._shown[name] = self._shown[name]._replace(pose=None)
            self._differ.add(name)
        while not self._to_redraw.empty():
            name = self._to_redraw.get()
            if name in self._shown:
                self._shown[name] = self._shown[name]._replace(basis=None, drawing=None)
                self._differ.add(name)
        if self._version != self._descriptions.version:
            self._version = self._descriptions.version
            self._differ.update(self._wanted)
        for handle, text in news.said:
            with contained(f'a message cannot be shown at {handle.name}'):
                self.say(handle, text)

    def _update(self, name: str) -> bool:
        """Bring one handle up to date; returns whether it differed."""
        handle, shown = self._wanted.get(name), self._shown.get(name)
        if handle is None:
            if shown is not None:
                del self._shown[name]
                self.erase(name)
            return shown is not None
        drawing = shown.drawing if shown is not None else None
        turn = handle.pose[3:] if drawing is not None and drawing[1].rings else None
        basis = handle.draw_key, turn, self._version
        if shown is None or shown.basis != basis:
            drawing = handle.draw_key, handle.motions(self._descriptions.can_change)
        # What cannot be drawn is not tried over and over.
        self._shown[name] = Shown(basis, drawing, handle.pose)
        if drawing is not None and (shown is None or drawing != shown.drawing):
            self.draw(handle, drawing[1])
        elif shown is not None and shown.pose != handle.pose:
            self.move(handle)
        else:
            return False
        return True
