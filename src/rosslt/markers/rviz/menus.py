"""The menu behind a right click on a handle: which source its drags change, where that is, and undo."""

import functools
import time
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import rospy
from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import InteractiveMarkerFeedback

from rosslt import values
from rosslt.markers.faults import contained
from rosslt.markers.offers import FREE, HEADING, UNDO, Offers
from rosslt.markers.rviz.display import Display
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.handle import Handle

#: The time that values must stay the same before a menu shows them, in seconds: RViz closes a menu that changes.
SETTLING_TIME = 2.0

SHIFT = ' (with Shift: towards you and away)'
SOURCES = 'Sources'


class Drawn(NamedTuple):
    """All that a menu has been drawn from."""

    version: int
    sources: Tuple[values.Source, ...]
    present: Dict[values.Source, Any]


class Menus:
    """The menus of all handles.

    Args:
        offers: the choices in them.
        display: shows the handles.
    """

    def __init__(self, offers: Offers, display: Display) -> None:
        self._offers, self._display = offers, display
        self._scene, self._descriptions = offers.scene, offers.descriptions
        self._drawn: Dict[str, Drawn] = {}
        self._latest: Dict[
            str, Tuple[Dict[values.Source, Any], float]
        ] = {}  # name -> (values that a menu lacks, since when)
        self._unchecked: List[str] = []
        display.add_menu = self.add

    def add(self, server: Server, handle: Handle) -> None:
        """Add the menu to a handle that has just been inserted."""
        name = handle.name
        if not handle.tracked:
            return
        drawn = self._drawn[name] = Drawn(
            self._descriptions.version, tuple(values.sources(handle.tracked)), values.source_values(handle.tracked)
        )
        choices = self._offers.choices(handle)
        chosen = self._offers.chosen(name, choices)
        menu = MenuHandler()
        menu.insert(HEADING + (':' if len(choices) == 1 else ' (choose one):'))
        for choice in choices:
            title = self._offers.title(choice, drawn.present)
            entry = menu.insert(
                title if choice.source else title + ' (default)',
                callback=functools.partial(self._choose, name, choice.source),
            )
            menu.setCheckState(entry, MenuHandler.CHECKED if choice.source == chosen else MenuHandler.UNCHECKED)
        if self._offers.can_be_free(handle):
            entry = menu.insert(FREE + SHIFT, callback=functools.partial(self._free, name))
            menu.setCheckState(entry, MenuHandler.CHECKED if name in self._display.free else MenuHandler.UNCHECKED)
        menu.insert(UNDO, callback=functools.partial(self._undo, name))
        where = menu.insert(SOURCES)
        for source in drawn.sources:
            menu.insert(
                self._descriptions.one(source, drawn.present),
                parent=where,
                callback=functools.partial(self._tell, name, source),
            )
        menu.apply(server, name)

    def check(self, count: int) -> None:
        """Check whether the menus of some handles, in turns, are up to date."""
        if not self._unchecked:
            self._unchecked = self._display.names()
        for name in self._unchecked[-count:]:
            with contained(f'the menu of {name} cannot be checked'):
                self._check(name)
        del self._unchecked[-count:]

    def _check(self, name: str) -> None:
        handle, drawn = self._scene.handle(name), self._drawn.get(name)
        if handle is None:
            self._drawn.pop(name, None)
            self._latest.pop(name, None)
        elif drawn is not None and not self._scene.is_held(name):
            self._descriptions.look_up(drawn.sources)
            known = self._descriptions.version, tuple(values.sources(handle.tracked))
            if known != drawn[:2] or self._has_settled(name, handle, drawn):
                self._display.redraw(name)

    def _has_settled(self, name: str, handle: Handle, drawn: Drawn) -> bool:
        """True where a menu lacks values that have not changed for a while."""
        present, now = values.source_values(handle.tracked), time.monotonic()
        if present == drawn.present:
            self._latest.pop(name, None)
            return False
        latest, since = self._latest.get(name, (None, now))
        if latest != present:
            self._latest[name] = (present, now)
            return False
        return now - since > SETTLING_TIME

    def _choose(self, name: str, source: Optional[values.Source], _feedback: InteractiveMarkerFeedback) -> None:
        self._offers.choose(name, source)
        self._display.redraw(name)

    def _free(self, name: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._display.free ^= {name}
        self._display.redraw(name)

    def _undo(self, name: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._offers.drags.undo(name)

    def _tell(self, name: str, source: values.Source, _feedback: InteractiveMarkerFeedback) -> None:
        text = self._descriptions.in_full(source)
        rospy.loginfo('%s', text)
        handle = self._scene.handle(name)
        if handle is not None:
            self._scene.say(handle, text)
