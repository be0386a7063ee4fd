"""Bringing a view up to date with a scene: what every view does alike.

A view is told nothing. Whenever it draws, it takes from the scene what is new, and draws, moves and erases what differs
from what it shows. Nothing of the scene is locked meanwhile. What a hand holds is left alone, as the hand knows better
than the last message where it is.
"""

import queue
import time
from typing import Any, Dict, Hashable, NamedTuple, Optional, Set, Tuple

from rosslt import values
from rosslt.markers.describing import Descriptions
from rosslt.markers.faults import contained
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle, Motions
from rosslt.markers.scene.scene import Scene

#: The rate at which a view is brought up to date, in Hz: that at which RViz draws.
FRAME_RATE = 30.0

#: The period in which owners are asked what is not known of the sources, or may have changed, in seconds.
LOOK_UP_PERIOD = 1.0


class Shown(NamedTuple):
    """A handle as a view shows it.

    Attributes:
        basis: what its motions were computed from.
        known: what the rest of its drawing was computed from.
        drawing: its `draw_key`, its motions, and the rest of its drawing.
        pose: where it is shown; None where a hand has moved it.
    """

    basis: Hashable
    known: Hashable
    drawing: Tuple[Hashable, Optional[Motions], Any]
    pose: Optional[PoseTuple]


class Follower:
    """A view of a scene, but for the drawing itself: `draw`, `move`, `erase` and `say`.

    Only `redraw` may be called by several threads at once.

    Args:
        scene: what is shown.
        descriptions: say which sources take changes.

    Attributes:
        free: the names of handles whose bodies move in the plane of the screen.
    """

    def __init__(self, scene: Scene, descriptions: Descriptions) -> None:
        self._scene, self._descriptions = scene, descriptions
        self._version, self._looked_up = descriptions.version, 0.0
        self._wanted: Dict[str, Handle] = {}
        self._shown: Dict[str, Shown] = {}
        self._differ: Set[str] = set()
        self._to_redraw: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.free: Set[str] = set()

    def extra(self, handle: Handle) -> Any:
        """All that the drawing of a handle shows of its sources, and of what is chosen for it."""
        del handle

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
        """Have a handle drawn anew, as what is chosen for it has changed."""
        self._to_redraw.put(name)

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
                self._shown[name] = self._shown[name]._replace(known=None, drawing=(None, None, None))
                self._differ.add(name)
        if time.monotonic() - self._looked_up > LOOK_UP_PERIOD:
            self._looked_up = time.monotonic()
            self._descriptions.look_up(values.sources([handle.tracked for handle in self._wanted.values()]))
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
        _, motions, extra = shown.drawing if shown is not None else (None, None, None)
        # The rings of a thing that turns are not computed once and for all.
        turn = handle.pose[3:] if motions is not None and motions.rings else None
        basis = handle.draw_key, turn, self._version
        known = tuple(values.sources(handle.tracked)), self._version
        if motions is None or shown is None or shown.basis != basis:
            motions = handle.motions(self._descriptions.can_change)
        if shown is None or shown.known != known:
            extra = self.extra(handle)
        drawing = handle.draw_key, motions, extra
        # What cannot be drawn is not tried over and over.
        self._shown[name] = Shown(basis, known, drawing, handle.pose)
        if shown is None or drawing != shown.drawing:
            self.draw(handle, motions)
        elif shown.pose != handle.pose:
            self.move(handle)
        else:
            return False
        return True
