"""Where sources are, for people: asked of the nodes that own them, in the background, and remembered."""

import os
import threading
import time
from collections import namedtuple

import rospy

from rosslt import srv, values

#: After how many seconds a node is asked again: its files may have been edited, and it started anew.
STALE_AFTER = 30.0

#: After how many seconds a node is asked again that has not answered, or did not know a source.
RETRY_AFTER = 2.0


Place = namedtuple('Place', 'file line column name read_only')
Place.__doc__ = 'Where a source is, what it is called, and whether it takes no changes.'


class Places:
    """The places of sources.

    Args:
        found: called without arguments when something new has become known.
    """

    def __init__(self, found):
        self._found = found
        self._known = {}  # (node, location id) -> Place
        self._asked = {}  # node -> when, or None while it is being asked
        self._lock = threading.Lock()

    def of(self, source):
        """The Place of a source; None until its owner has answered."""
        return self._known.get(source)

    def look_up(self, sources):
        """Ask for what is not known of sources, or has not been asked for long; it is known some time later."""
        now = time.monotonic()
        for source in sources:
            with self._lock:
                asked = self._asked.get(source.node, -STALE_AFTER)
                patience = STALE_AFTER if source in self._known else RETRY_AFTER
                if asked is None or now - asked < patience:
                    continue
                self._asked[source.node] = None
            threading.Thread(target=self._ask, args=(source.node,), name='places', daemon=True).start()

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
        return tuple([source for source in sources if source in self._known and self._known[source].read_only])

    def can_move(self, value):
        """Whether a value has a source that takes changes, as far as known."""
        sources = values.sources(value)
        self.look_up(sources)
        return len(self.read_only(sources)) < len(sources)

    def _ask(self, owner):
        try:
            answer = rospy.ServiceProxy(owner + '/rosslt/list_locations', srv.ListLocations)()
        except (rospy.ServiceException, rospy.ROSException) as error:
            rospy.logdebug('%s does not say where its locations are: %s', owner, error)
            news = {}
        else:
            news = {
                (owner, one.id): Place(one.file, one.line, one.column, one.name, one.read_only)
                for one in answer.locations
            }
        is_new = any(self._known.get(source) != place for source, place in news.items())
        with self._lock:
            self._known.update(news)
            self._asked[owner] = time.monotonic()
        if is_new:
            self._found()
