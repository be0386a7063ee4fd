"""The menu behind a right click on a handle: which source its drags change, where that is, its row, and undo."""

import functools
from typing import Callable, List, NamedTuple, Optional, Sequence, Set, Tuple

import rospy
from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import InteractiveMarkerFeedback

from rosslt import values
from rosslt.markers.offers import FREE, HEADING, HOLD, ROW, ROW_OPERATIONS, UNDO, Choice, Offers
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.selection import Selection

SHIFT = ' (with Shift: towards you and away)'
SHOW_ALL = 'Show all handles'
SOURCES = 'Sources'

#: Where the ids of those entries begin that do something with a row.
ROW_IDS = 2**30


class Menu(NamedTuple):
    """The content of a menu.

    Attributes:
        choices: (title, source, whether it is chosen) of what drags can change; no source for the default.
        can_be_free: whether there is an entry to move the body freely.
        sources: (title, source) of those that the numbers come from.
        shows_all: whether all handles are shown.
        rows: (title, a number of it) of each row of a list that the numbers are in.
        is_in_place: whether it is held in place while others are dragged.
    """

    choices: List[Tuple[str, Optional[values.Source], bool]]
    can_be_free: bool
    sources: List[Tuple[str, values.Source]]
    shows_all: bool
    rows: Sequence[Tuple[str, values.Source]] = ()
    is_in_place: bool = False


class Menus:
    """The menus of handles.

    Args:
        offers: the choices in them.
        redraw: has a handle drawn anew, given its name.
        free: {name of a handle} of those whose bodies move freely.
        selection: which handles are shown.
    """

    def __init__(self, offers: Offers, redraw: Callable[[str], None], free: Set[str], selection: Selection) -> None:
        self._offers, self._redraw, self._free, self._selection = offers, redraw, free, selection

    def of(self, handle: Handle) -> Optional[Menu]:
        """The menu of a handle; None if nothing that it comes from takes changes."""
        descriptions = self._offers.descriptions
        if not self._offers.can_change(handle):
            return None
        is_chosen, choices = self._offers.is_chosen, self._offers.choices(handle)
        return Menu(
            [(self._title(choice), choice.source, is_chosen(handle, choice)) for choice in choices],
            self._offers.can_be_free(handle),
            [(descriptions.one(source), source) for source in descriptions.own_first(values.sources(handle.tracked))],
            self._selection.shows_all,
            self._offers.rows(choices),
            self._offers.is_in_place(handle.name),
        )

    def _title(self, choice: Choice) -> str:
        """The text of a choice, several numbers by their names alone: a menu has to fit on the view."""
        if len(choice.changed) == 1:
            return self._offers.title(choice)
        return ', '.join(map(self._offers.descriptions.name, choice.changed))

    def add(self, server: Server, name: str, menu: Menu) -> None:
        """Add a menu to a handle that has just been inserted."""
        drawn = MenuHandler()
        if menu.choices:
            drawn.insert(HEADING + (':' if len(menu.choices) == 1 else ' (choose one or more):'), callback=_ignore)
        for title, source, is_chosen in menu.choices:
            entry = drawn.insert(
                title if source else title + ' (default)', callback=functools.partial(self._choose, name, source)
            )
            drawn.setCheckState(entry, MenuHandler.CHECKED if is_chosen else MenuHandler.UNCHECKED)
        if menu.can_be_free:
            entry = drawn.insert(FREE + SHIFT, callback=functools.partial(self._set_free, name))
            drawn.setCheckState(entry, MenuHandler.CHECKED if name in self._free else MenuHandler.UNCHECKED)
        entry = drawn.insert(HOLD, callback=functools.partial(self._set_in_place, name))
        drawn.setCheckState(entry, MenuHandler.CHECKED if menu.is_in_place else MenuHandler.UNCHECKED)
        entry = drawn.insert(SHOW_ALL, callback=self._set_shows_all)
        drawn.setCheckState(entry, MenuHandler.CHECKED if menu.shows_all else MenuHandler.UNCHECKED)
        drawn.insert(UNDO, callback=functools.partial(self._undo, name))
        where = drawn.insert(SOURCES, callback=_ignore)
        for title, source in menu.sources:
            drawn.insert(title, parent=where, callback=functools.partial(self._tell, name, source))
        if menu.rows:
            self._add_rows(drawn, name, menu.rows)
        drawn.apply(server, name)

    def _add_rows(self, drawn: MenuHandler, name: str, rows: Sequence[Tuple[str, values.Source]]) -> None:
        every = drawn.insert(ROW, callback=_ignore)
        for of, row in rows:
            parent = drawn.insert(of, parent=every, callback=_ignore) if len(rows) > 1 else every
            # A menu stays open while its handle is drawn anew for another row, as that of the next target of a patrol,
            # and RViz reports nothing but the id of an entry: each row has its own, alone or among several.
            drawn.current_handle_ = ROW_IDS + hash(row) % (ROW_IDS // 2)
            for title, operation in ROW_OPERATIONS.items():
                drawn.insert(title, parent=parent, callback=functools.partial(self._edit_row, name, row, operation))

    def _choose(self, name: str, source: Optional[values.Source], _feedback: InteractiveMarkerFeedback) -> None:
        handle = self._offers.scene.handle(name)
        if handle is not None:
            self._offers.choose(handle, source)
            self._redraw(name)

    def _set_free(self, name: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._free ^= {name}
        self._redraw(name)

    def _set_in_place(self, name: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._offers.set_in_place(name, not self._offers.is_in_place(name))
        self._redraw(name)

    def _set_shows_all(self, _feedback: InteractiveMarkerFeedback) -> None:
        self._selection.shows_all = not self._selection.shows_all

    def _undo(self, name: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._offers.drags.undo(name)

    def _edit_row(self, name: str, row: values.Source, operation: str, _feedback: InteractiveMarkerFeedback) -> None:
        self._offers.edit_row(name, row, operation)

    def _tell(self, name: str, source: values.Source, _feedback: InteractiveMarkerFeedback) -> None:
        text = self._offers.descriptions.in_full(source)
        rospy.loginfo('%s', text)
        handle = self._offers.scene.handle(name)
        if handle is not None:
            self._offers.scene.say(handle, text)


def _ignore(_feedback: InteractiveMarkerFeedback) -> None:
    """The callback of entries that do nothing: MenuHandler calls that of each entry that is reported."""
