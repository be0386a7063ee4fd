"""Where sources are, for people: what menus and notes call them, and whether a hand may move them."""

import os

from rosslt import node, values

#: After how many seconds a node is asked again: its files may have been edited, and it started anew.
STALE_AFTER = 30.0


class Places:
    """The places of sources, as this node knows them.

    Args:
        found: called without arguments when something new has become known.
    """

    def __init__(self, found):
        self._directory = node.directory()
        self._directory.when_found(found)

    def of(self, source):
        """The rosslt/Location of a source; None until its owner has answered."""
        place = self._directory.of(source)
        return place and place.location

    def look_up(self, sources):
        """Ask for what is not known of sources, or has not been asked for long; it is known some time later."""
        self._directory.look_up(sources, STALE_AFTER)

    def describe(self, source):
        """`waypoints.script:3:12`, or the node's name until it has answered."""
        place = self.of(source)
        if place is None:
            return source.node
        return '{}:{}:{}'.format(os.path.basename(place.file), place.line, place.column)

    def describe_all(self, sources):
        """Several places as one text, a file named once: `waypoints.script:3:12, :3:17`."""
        parts, file = [], None
        for place in map(self.describe, sources):
            before, file = file, place.partition(':')[0]
            parts.append(place[len(file) :] if file == before and ':' in place else place)
        return ', '.join(parts)

    def read_only(self, sources):
        """Those of the sources that are known to take no change."""
        known = [(source, self.of(source)) for source in sources]
        return tuple([source for source, place in known if place is not None and place.read_only])

    def can_move(self, value):
        """Whether a value has a source that takes changes, as far as known."""
        sources = values.sources(value)
        self.look_up(sources)
        return len(self.read_only(sources)) < len(sources)
