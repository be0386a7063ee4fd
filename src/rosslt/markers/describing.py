"""What sources are called and where they are, for people: asked of the nodes that own them, in the background."""

import os
import re
import threading
import time
from typing import Any, Callable, Collection, Dict, List, NamedTuple, Optional, Tuple

import rospy

from rosslt import srv, values

#: After how many seconds a node is asked again: its files may have been edited, and it started anew.
STALE_AFTER = 30.0

#: After how many seconds a node is asked again that has not answered, or did not know a source.
RETRY_AFTER = 2.0


class Description(NamedTuple):
    """What is known of a source: where it is, what it is called, and whether it takes no changes."""

    file: str
    line: int
    column: int
    name: str
    read_only: bool

    @property
    def has_own_name(self) -> bool:
        """Whether somebody has named it, or its name says where it stands anyhow: `script_8_6_675e85a7`."""
        return re.search(r'_{}_\d+(_|$)'.format(self.line), self.name) is None


class Descriptions:
    """What is known of sources.

    Args:
        found: called without arguments when something new has become known.
    """

    def __init__(self, found: Callable[[], None]) -> None:
        self._found = found
        self._known: Dict[Any, Description] = {}  # (node, location id) -> its Description
        self._asked: Dict[str, Optional[float]] = {}  # node -> when, or None while it is being asked
        self._lock = threading.Lock()

    def of(self, source: Any) -> Optional[Description]:
        """The Description of a source; None until its owner has answered."""
        return self._known.get(source)

    def look_up(self, sources: Collection[Any]) -> None:
        """Ask for what is not known of sources, or has not been asked for long; it is known some time later."""
        now = time.monotonic()
        for source in sources:
            with self._lock:
                asked = self._asked.get(source.node, -STALE_AFTER)
                patience = STALE_AFTER if source in self._known else RETRY_AFTER
                if asked is None or now - asked < patience:
                    continue
                self._asked[source.node] = None
            threading.Thread(target=self._ask, args=(source.node,), name='descriptions', daemon=True).start()

    def name(self, source: Any) -> str:
        """What a source is called: its name, else where it is."""
        known = self.of(source)
        if known is None:
            return '{} of {}'.format(source.location_id, source.node)
        return known.name if known.has_own_name else self._place(source, known)

    def one(self, source: Any, present: Dict[Any, Any]) -> str:
        """`shoulder = 0.4 (arm.py:48)`, and the node where more than one has such a location.

        Args:
            source: what to describe.
            present: {Source: its value}.
        """
        known = self.of(source)
        if known is None:
            return '{} = {}'.format(self.name(source), _brief(present.get(source)))
        value, place = _brief(present.get(source)), self._place(source, known)
        if known.has_own_name:
            return '{} = {} ({})'.format(known.name, value, place)
        return '{} ({})'.format(value, place)

    def several(self, sources: List[Any], present: Dict[Any, Any]) -> str:
        """Several sources as one text."""
        return ', '.join(self.one(source, present) for source in sources)

    def in_full(self, source: Any) -> str:
        """Where a source is, with the whole path: `/home/me/arm.py:48:24, shoulder of /arm`."""
        known = self.of(source)
        if known is None:
            return self.name(source)
        return '{}:{}:{}, {} of {}'.format(known.file, known.line, known.column, known.name, source.node)

    def read_only(self, sources: Collection[Any]) -> Tuple[Any, ...]:
        """Those of the sources that are known to take no change."""
        return tuple([source for source in sources if source in self._known and self._known[source].read_only])

    def can_change(self, value: Any) -> bool:
        """Whether a value has a source that takes changes, as far as known."""
        sources = values.sources(value)
        self.look_up(sources)
        return len(self.read_only(sources)) < len(sources)

    def _place(self, source: Any, known: Description) -> str:
        place = '{}:{}'.format(os.path.basename(known.file), known.line)
        if not known.has_own_name:
            place += ':{}'.format(known.column)
        is_shared = any(
            other.node != source.node and (one.file, one.line, one.column) == (known.file, known.line, known.column)
            for other, one in list(self._known.items())
        )
        return '{} of {}'.format(place, source.node) if is_shared else place

    def _ask(self, owner: str) -> None:
        try:
            answer = rospy.ServiceProxy(owner + '/rosslt/list_locations', srv.ListLocations)()
        except (rospy.ServiceException, rospy.ROSException) as error:
            rospy.logdebug('%s does not say where its locations are: %s', owner, error)
            news = {}
        else:
            news = {
                values.Source(owner, one.id): Description(one.file, one.line, one.column, one.name, one.read_only)
                for one in answer.locations
            }
        is_new = any(self._known.get(source) != known for source, known in news.items())
        with self._lock:
            self._known.update(news)
            self._asked[owner] = time.monotonic()
        if is_new:
            self._found()


def _brief(value: Any) -> str:
    return '%.4g' % value if isinstance(value, float) else repr(value)
