"""What this node knows of sources, its own and those of other nodes: where they are, and what they take.

The owner of a source has the last word on every change. Knowing beforehand that a source is read-only, or how
far it goes, lets `solve` choose another one, or say which bound stands in the way.
"""

import threading
import time
from collections import namedtuple

from rosslt.node.locations import from_json

Fact = namedtuple('Fact', 'place minimum maximum read_only rank')
Fact.__doc__ = 'Of a source: where it stands (`talker.py:12:9`), its bounds or None, whether it is fixed, and its rank.'

#: How long an owner's answer is good for, in seconds. What a location takes rarely changes, but its node can
#: come back with other code.
LIFETIME = 10.0


class Facts:
    """Remembers what owners say of their locations.

    Args:
        locations: this node's own Locations.
        ask: called with {node: [location id, ...]}; returns {node: [rosslt/Location, ...]} of those that
            answer.
    """

    def __init__(self, locations, ask):
        self._locations = locations
        self._ask = ask
        self._known = {}  # Source -> Fact; None where its owner does not know it or does not answer
        self._good_until = {}  # Source -> a time
        self._lock = threading.Lock()

    def of(self, source):
        """The Fact of a source as far as it is known already, else None."""
        if source.node == self._locations.node:
            location = self._locations.by_id.get(source.location_id)
            return location and Fact(
                location.place, location.minimum, location.maximum, location.read_only, location.rank
            )
        return self._known.get(source)

    def place(self, source):
        """Where a source stands, as `explain` and errors say it; None where that is not known."""
        fact = self.of(source)
        return fact and fact.place

    def limits(self, sources, timeout):
        """What `solve` has to know of sources; their owners are asked where that was long ago.

        Returns:
            The arguments `bounds`, `read_only` and `rank` of `solve`.
        """
        self._learn(sources, timeout)
        facts = [(source, self.of(source)) for source in sources]
        return {
            'bounds': {source: (fact.minimum, fact.maximum) for source, fact in facts if fact},
            'read_only': [source for source, fact in facts if fact and fact.read_only],
            'rank': {source: fact.rank for source, fact in facts if fact and fact.rank},
        }

    def forget(self, sources):
        """Ask anew the next time."""
        with self._lock:
            for source in sources:
                self._good_until.pop(source, None)

    def _learn(self, sources, timeout):
        now = time.monotonic()
        stale = {}
        with self._lock:
            for source in sources:
                if source.node != self._locations.node and self._good_until.get(source, 0.0) < now:
                    stale.setdefault(source.node, []).append(source)
        if not stale:
            return
        answers = self._ask({node: [source.location_id for source in asked] for node, asked in stale.items()}, timeout)
        with self._lock:
            for node, asked in stale.items():
                told = {location.id: location for location in answers.get(node, ())}
                for source in asked:
                    location = told.get(source.location_id)
                    self._known[source] = location and _fact(location)
                    self._good_until[source] = now + LIFETIME


def _fact(location):
    bounds = [from_json(text) if text else None for text in (location.minimum, location.maximum)]
    place = '{}:{}:{}'.format(location.file.rsplit('/', 1)[-1], location.line, location.column)
    return Fact(place, *bounds, location.read_only, location.rank)
