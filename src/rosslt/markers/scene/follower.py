"""Bringing a view up to date with a scene: what every view does alike.

A view polls: whenever it draws, it takes the news from the scene, and draws, moves and erases the handles that differ
from those shown. Nothing of the scene is locked meanwhile. A held handle is left alone, as the hand knows better than
the last message where it is.
"""

import queue
import time
from typing import Any, Dict, Hashable, List, NamedTuple, Optional, Set, Tuple

from rosslt import values
from rosslt.markers.describing import Descriptions
from rosslt.markers.faults import contained
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import Handle, Motions
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.selection import Selection

#: The rate at which a view is brought up to date, in Hz: that at which RViz draws.
FRAME_RATE = 30.0

#: The period in seconds in which owners are asked for unknown or outdated facts about the sources.
LOOK_UP_PERIOD = 1.0


class Shown(NamedTuple):
    """A handle as a view shows it.

    Attributes:
        known: what the rest of its drawing was computed from.
        drawing: its `draw_key`, the motions that it is drawn with, and the rest of its drawing.
        pose: where it is shown; None if a hand has moved it.
    """

    known: Hashable
    drawing: Tuple[Hashable, Optional[Motions], Any]
    pose: Optional[PoseTuple]


class Follower:
    """A view of a scene, without the drawing itself: subclasses add `draw`, `move`, `erase` and `say`.

    Only `redraw` may be called by several threads at once.

    Args:
        scene: what is shown.
        descriptions: say which sources take changes.
        selection: which handles are drawn with arrows and rings; by default all.

    Attributes:
        free: the names of handles whose bodies move in the plane of the screen.
        selection: the same.
    """

    def __init__(self, scene: Scene, descriptions: Descriptions, selection: Optional[Selection] = None) -> None:
        self._scene, self._descriptions = scene, descriptions
        self._version, self._looked_up = descriptions.version, 0.0
        self._wanted: Dict[str, Handle] = {}
        self._motions: Dict[str, Tuple[Hashable, Motions]] = {}  # and what they were computed from
        self._shown: Dict[str, Shown] = {}
        self._differ: Set[str] = set()
        self._to_redraw: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.free: Set[str] = set()
        self.selection = selection or Selection(shows_all=True)
        self._rule = self.selection.rule

    def extra(self, handle: Handle) -> Any:
        """All that the drawing of a handle shows of its sources, and of what is chosen for it."""
        del handle

    def leaves_out(self, handle: Handle, motions: Motions) -> bool:
        """Return whether a handle is not drawn."""
        del handle, motions
        return False

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

    def look_again(self) -> None:
        """Bring all handles up to date: something else has changed that they are drawn by."""
        self._differ.update(self._wanted)

    def follow(self) -> bool:
        """Show what differs; returns whether anything did."""
        self._take_news()
        self._look_at_all()
        while self._rule != self.selection.rule:
            self._rule = self.selection.rule
            self._differ.update(self._wanted)
            self._look_at_all()
        free = self._not_held()
        self._differ.difference_update(free)
        has_changed = False
        for name in free:
            with contained(f'{name} cannot be shown'):
                has_changed = self._update(name) or has_changed
        return has_changed

    def _look_at_all(self) -> None:
        for name in self._not_held():
            with contained(f'it cannot be told how {name} can be moved'):
                self._look_at(name)

    def _not_held(self) -> List[str]:
        return [name for name in self._differ if not self._scene.is_held(name)]

    def _take_news(self) -> None:
        news = self._scene.news()
        for name, handle in news.handles.items():
            if handle is None:
                gone = self._wanted.pop(name, None)
                if gone is not None:
                    self._motions.pop(name, None)
                    self._differ.update(self.selection.drop(gone))
            else:
                before = self._wanted.get(name)
                if before is not None:
                    self._differ.update(self.selection.note_place(before, handle))
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

    def _look_at(self, name: str) -> None:
        """Learn how a handle can be moved, which depends on more than its drawing."""
        handle = self._wanted.get(name)
        if handle is None:
            return
        basis, motions = self._motions.get(name, (None, None))
        # The rings of a thing that turns are not computed once and for all.
        turn = handle.pose[3:] if motions is not None and motions.rings else None
        now = handle.draw_key, turn, self._version, self.selection.shows_all
        if motions is None or basis != now:
            rank_of = None if self.selection.shows_all else self._descriptions.rank
            self._motions[name] = now, handle.motions(self._descriptions.can_change, rank_of)
            self._differ.update(self.selection.put(handle, self._motions[name][1]))

    def _update(self, name: str) -> bool:
        """Bring one handle up to date; returns whether it differed."""
        handle, shown = self._wanted.get(name), self._shown.get(name)
        motions = None
        if handle is not None and name in self._motions:
            motions = self.selection.drawn(handle, self._motions[name][1])
        if handle is None or motions is None or self.leaves_out(handle, motions):
            if shown is not None:
                del self._shown[name]
                self.erase(name)
            return shown is not None
        known = tuple(values.sources(handle.tracked)), self._version, self.selection.shows_all
        extra = self.extra(handle) if shown is None or shown.known != known else shown.drawing[2]
        drawing = handle.draw_key, motions, extra
        # A handle that cannot be drawn is not tried again.
        self._shown[name] = Shown(known, drawing, handle.pose)
        if shown is None or drawing != shown.drawing:
            self.draw(handle, motions)
        elif shown.pose != handle.pose:
            self.move(handle)
        else:
            return False
        return True
