"""The menu behind a right click on a handle: which source its drags change, where that is, and undo."""

import functools
import os

import rospy
from interactive_markers.menu_handler import MenuHandler

from rosslt import values
from rosslt.markers import changing, reach


class Menus:
    """The menus of all handles on a board.

    Args:
        board: holds the handles.
        drags: changes what is chosen, and undoes.
        places: says where sources are.
    """

    def __init__(self, board, drags, places):
        self._board, self._drags, self._places = board, drags, places
        self._ways = {}  # name of a handle -> (its sources, those that are read-only, the ways to change it)
        self._unchecked = []

    def add(self, server, handle):
        """Add the menu to a handle that has just been inserted."""
        if not handle.tracked:
            return
        sources, ways = self._ways_of(handle)
        chosen = self._drags.chosen.get(handle.name)
        if chosen not in dict(ways):
            chosen = None
        menu = MenuHandler()
        for source, changed in ways:
            title = self._places.describe_all(changed)
            entry = menu.insert(
                title if source else title + ' (default)', callback=functools.partial(self._choose, handle.name, source)
            )
            menu.setCheckState(entry, MenuHandler.CHECKED if source == chosen else MenuHandler.UNCHECKED)
        menu.insert('Undo', callback=functools.partial(self._undo, handle.name))
        where = menu.insert('Sources')
        for source in sources:
            menu.insert(self._described(source), parent=where, callback=functools.partial(self._tell, source))
        menu.apply(server, handle.name)

    def check(self, count):
        """Look at some handles, in turns: whether they come from other sources than their menus say."""
        if not self._unchecked:
            self._unchecked = self._board.names()
        for name in self._unchecked[-count:]:
            handle = self._board.handle(name)
            if handle is None:
                self._ways.pop(name, None)
            elif name in self._ways:
                sources = self._ways[name][0]
                self._places.look_up(sources)
                if sources != tuple(values.sources(handle.tracked)):
                    self._board.redraw(name)
        del self._unchecked[-count:]

    def redraw(self):
        """Have all menus drawn anew."""
        for name in list(self._ways):
            self._board.redraw(name)

    def _ways_of(self, handle):
        """(the sources, [(the source to choose, or None for the default; the sources that it changes)])."""
        sources = tuple(values.sources(handle.tracked))
        read_only = self._places.read_only(sources)
        known = self._ways.get(handle.name)
        if known is None or known[:2] != (sources, read_only):
            known = self._ways[handle.name] = (sources, read_only, self._ways_to_change(handle.tracked, read_only))
        return sources, known[2]

    def _ways_to_change(self, tracked, read_only):
        able = [source for source in reach.able(tracked) if source not in read_only]
        default = changing.default_sources(tracked, read_only) or able
        # To choose a source makes a difference only where a value has another one, too.
        others = [
            source
            for source in able
            if [source] != default and any(len(both) > 1 and source in both for both in map(values.sources, tracked))
        ]
        return [(None, default)] + [(source, [source]) for source in others]

    def _choose(self, name, source, _feedback):
        self._drags.chosen[name] = source
        self._board.redraw(name)

    def _undo(self, name, _feedback):
        self._drags.undo(name)

    def _tell(self, source, _feedback):
        rospy.loginfo('%s', self._described(source, with_path=True))

    def _described(self, source, with_path=False):
        place = self._places.of(source)
        if place is None:
            return '{} of {}'.format(source.location_id, source.node)
        file = place.file if with_path else os.path.basename(place.file)
        return '{}:{}:{}  {} of {}'.format(file, place.line, place.column, place.name, source.node)
