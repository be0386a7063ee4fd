"""The directory of sources, those of this node and of others: the only cache of their owners' answers.

The owner of a source has the last word on every change. If it is known beforehand where a source is, what it is called
and which values it accepts, errors and menus can name it, and `solve` can choose a different source or name the bound.

Owners are asked by `learn`, `limits` and `ask`, which block, and by `look_up` in a thread of its own. All other methods
answer from what is known, so that they can be called from anywhere, also while locks are held.
"""

import contextlib
import os
import re
import threading
import time
from typing import Any, Callable, Collection, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

import numpy
import rospy

from rosslt import msg, srv, values
from rosslt.node.callbacks import Callbacks
from rosslt.node.json_scalars import from_json
from rosslt.node.locations.uses import Shared
from rosslt.node.service_calls import ask_all

#: The time for which an owner's answer is used for changes, in seconds. Bounds rarely change, but a node can be
#: restarted with other code.
FRESH = 10.0

#: The delay before a node is asked again that did not answer or did not know a source, in seconds.
RETRY_AFTER = 2.0

#: The default timeout of owners' answers, in seconds.
TIMEOUT = 2.0


SHAPE_RANK = 3
"""The rank of locations that give a formula its shape, as a divisor or a conversion of units."""


ASIDE = 0.01
"""How far numbers are moved aside to tell how many ways a thing can go, as a part of their size."""


class Place(NamedTuple):
    """A location as its node describes it: the node's full name, and its rosslt/Location."""

    node: str
    location: msg.Location

    @property
    def source(self) -> values.Source:
        """The location as a Source."""
        return values.Source(self.node, self.location.id)

    @property
    def local_name(self) -> str:
        """Its name in its node: `radius`, `~parking/0` for a private parameter, `/height` for a parameter
        elsewhere."""
        name = self.location.name
        return '~' + name[len(self.node) + 1 :] if name.startswith(self.node + '/') else name

    @property
    def name(self) -> str:
        """NODE/LOCATION: `/talker/radius`, `/talker/~parking/0`, `/talker//height`."""
        return f'{self.node}/{self.local_name}'

    @property
    def file(self) -> str:
        """`/home/me/src/talker.py:12:9`."""
        return f'{self.location.file}:{self.location.line}:{self.location.column}'

    @property
    def short_file(self) -> str:
        """`talker.py:12:9`."""
        return f'{os.path.basename(self.location.file)}:{self.location.line}:{self.location.column}'

    @property
    def value(self) -> Any:
        """Its plain value when its owner was asked; None if it had none, as `location.fault` says."""
        return from_json(self.location.value) if self.location.value else None

    @property
    def minimum(self) -> Any:
        """Its lower bound, or None."""
        return from_json(self.location.minimum) if self.location.minimum else None

    @property
    def maximum(self) -> Any:
        """Its upper bound, or None."""
        return from_json(self.location.maximum) if self.location.maximum else None

    @property
    def read_only(self) -> bool:
        """True if the location refuses all changes."""
        return self.location.read_only

    @property
    def is_fixed(self) -> bool:
        """True if no message follows a change of it: it refuses all, or its node does not look at it again."""
        return self.location.read_only or bool(self.location.at_next_start)

    @property
    def next_start(self) -> str:
        """Say which uses of it take a change at the next start only, as a part of a sentence; '' if none does."""
        return self.location.at_next_start or self.location.plain_copies

    @property
    def is_shape(self) -> bool:
        """True if it gives a formula its shape, and has the value that the code says: people rarely change it."""
        return self.location.rank == SHAPE_RANK and self.location.value == self.location.literal

    def is_called(self, text: str) -> bool:
        """Return whether `text`, the part after the node's name and a /, names this location, as the parameter server
        does if it is a private parameter."""
        name = self.location.name
        is_named = text in (self.local_name, name.lstrip('/'), str(self.location.id))
        return is_named or name == f'{self.node}/{text}'


def listed(places: Dict[str, List[Place]], shows_all: bool) -> Dict[str, List[Place]]:
    """The places of each node that people are shown, in the order of the code, which is the same after a restart:
    unless they ask for all, without those that give a formula its shape."""
    return {
        node: sorted((place for place in found if shows_all or not place.is_shape), key=_order)
        for node, found in places.items()
    }


def _order(place: Place) -> Tuple[Any, ...]:
    """Orders places by where they stand, those of one call by name, `x/2` before `x/10`."""
    location = place.location
    words = [int(word) if word.isdigit() else word for word in re.split(r'([0-9]+)', location.name)]
    return location.file, location.line, location.column, words


class Directory:
    """A cache of what owners report about their locations.

    Args:
        own: looks up a location of this node by its id; None if this process has none of its own.
        node: gives the full name of this node.

    Attributes:
        version: grows whenever something other than a value becomes known.
    """

    def __init__(
        self,
        own: Optional[Callable[[int], Optional[msg.Location]]] = None,
        node: Callable[[], str] = lambda: '',
    ) -> None:
        self._own = own
        self._node = node
        self.version = 0
        self._known: Dict[values.Source, Place] = {}
        self._asked: Dict[values.Source, float] = {}  # when
        self._listed: Set[str] = set()  # nodes that have told all of their locations once
        self._wanted: Dict[str, List[values.Source]] = {}  # those to be looked up, by node
        self._background = Callbacks('rosslt locations')
        self._lock = threading.Lock()

    def of(self, source: values.Source) -> Optional[Place]:
        """The Place of a source, as far as known; None if its owner does not know it or has not answered."""
        if self._own is not None and source.node == self._node():
            location = self._own(source.location_id)
            return location and Place(source.node, location)
        return self._known.get(source)

    def describe(self, source: values.Source) -> Optional[str]:
        """The name of a source in explanations and errors; None if nothing is known of it yet.

        `radius, talker.py:12:9`, and `talker.py:12:9` for a location without a name; with the node's name in front
        if another node has such a location, and with who has locked it at the end.
        """
        self.look_up([source])
        place = self.of(source)
        if place is None:
            return None
        text = f'{place.local_name}, {place.short_file}' if place.location.is_named else place.short_file
        text = f'{place.node}: {text}' if self.has_twin(place) else text
        return f'{text}, {place.location.locked}' if place.location.locked else text

    def has_twin(self, place: Place) -> bool:
        """True if another node has the same location, as one file was started twice."""
        if self._own is not None and place.node != self._node():
            own = self._own(place.location.id)
            if own is not None and own.file == place.location.file:
                return True
        with self._lock:
            return any(
                source.location_id == place.location.id
                and source.node != place.node
                and other.location.file == place.location.file
                for source, other in self._known.items()
            )

    def short_file(self, source: values.Source) -> Optional[str]:
        """The file and line of a source, `talker.py:12:9`; None if that is not known."""
        place = self.of(source)
        return place and place.short_file

    def name(self, source: values.Source) -> str:
        """The name of a source; node and id if nothing else is known."""
        place = self.of(source)
        return place.name if place else str(source)

    def at_next_start(self, source: values.Source) -> str:
        """Why a change of a source does nothing before its node starts again, as far as known; '' if it does, and for a
        read-only one."""
        place = self.of(source)
        return place.location.at_next_start if place and not place.read_only else ''

    def ordered(self, sources: Iterable[values.Source]) -> List[values.Source]:
        """Sources by node, and in the order in which the node lists them."""
        with self._lock:
            order = {source: index for index, source in enumerate(self._known)}
        return sorted(sources, key=lambda source: (source.node, order.get(source, len(order)), source.location_id))

    def limits(self, sources: Sequence[values.Source], timeout: float) -> Dict[str, Any]:
        """The limits of sources that `solve` takes; their owners are asked if that was long ago.

        Returns:
            The arguments `bounds` and `read_only` of `solve`, and `rank` and `weights` if owners say some.
        """
        self.learn(sources, timeout, FRESH)
        known = [(source, place) for source, place in ((source, self.of(source)) for source in sources) if place]
        limits: Dict[str, Any] = {
            'bounds': {source: (place.minimum, place.maximum) for source, place in known},
            'read_only': [source for source, place in known if place.is_fixed],
        }
        ranks = {source: place.location.rank for source, place in known if place.location.rank}
        if ranks:
            limits['rank'] = ranks
        weights = {source: place.location.weight for source, place in known if place.location.weight}
        if weights:
            limits['weights'] = weights
        return limits

    def held(self, thing: Sequence[Any], shared: Sequence[Collection[values.Source]] = ()) -> List[values.Source]:
        """Return the sources that stay if a thing changes, as far as known: if a number has a source of its own, its
        others.

        If a thing comes from a single row of a table, as of a list of waypoints, it is one of several things, and the
        numbers of the row are its own. Of other numbers, what is shared stays, if the thing can go all ways without it.

        Args:
            thing: its tracked numbers.
            shared: of each of these, the sources that move other things as well, as of `Uses.shared`.
        """
        single = self._single_rows(values.sources(thing))
        own = {place.source for place in single if not place.is_fixed and place.location.rank < SHAPE_RANK}
        concerned = [sources for sources in map(values.sources, thing) if own.intersection(sources)]
        held = [source for sources in concerned for source in sources if source not in own]
        if not any(shared):
            return held
        willing = [self._willing(number) for number in thing]
        slopes = values.slopes(_elsewhere(thing))
        still = (0.0,) * len(thing)  # a text or a bool has no slope
        free = {source: slopes.get(source, still) for sources in willing for source in sources if source not in held}
        stays = {
            source
            for sources, others in zip(willing, shared)
            if free.keys() & sources - set(others)
            for source in free.keys() & others
        }
        left = [ways for source, ways in free.items() if source not in stays]
        is_enough = left and numpy.linalg.matrix_rank(left) == numpy.linalg.matrix_rank(list(free.values()))
        return [*held, *stays] if is_enough else held

    def _willing(self, number: Any) -> Set[values.Source]:
        """Return the sources of a number that are changed first, by their ranks, of those that take changes."""
        ranks = {}
        for source in values.sources(number):
            place = self.of(source)
            if place is None or not place.is_fixed:
                ranks[source] = 0 if place is None else place.location.rank
        return {source for source, rank in ranks.items() if rank == min(ranks.values())}

    def shared(
        self, thing: Sequence[Any], shared: Sequence[Collection[values.Source]], changed: Iterable[values.Source]
    ) -> List[values.Source]:
        """Return the changed sources that move others as well, although the thing has some of its own, or as one of its
        numbers has no other that is changed first, or is one of several from the same sources.

        Args:
            thing, shared: as of `held`.
        """
        own = [place.source for place in self._single_rows(values.sources(thing))]
        needed = {
            one for number, others in zip(thing, shared) if self._willing(number) <= set(others) for one in others
        }
        if isinstance(shared, Shared):
            needed |= shared.alike
        return [source for source in changed if source in needed or (own and source not in own)]

    def own_first(self, sources: Collection[values.Source]) -> List[values.Source]:
        """The sources of a thing, first those that are its own, as far as known: the numbers of a single row of a
        table."""
        own = [place.source for place in self._single_rows(sources)]
        return sorted(sources, key=lambda source: source not in own)

    def rows_of(self, sources: Collection[values.Source]) -> List[Place]:
        """The first of some sources in each row of a table that they are in, as far as known."""
        found: Dict[Tuple[str, str], Place] = {}
        for place in filter(None, map(self.of, sources)):
            if place.location.row:
                found.setdefault((place.node, place.location.row), place)
        return list(found.values())

    def _single_rows(self, sources: Collection[values.Source]) -> List[Place]:
        """The numbers of those tables of which all numbers are in one row, if such a row holds others."""
        rows: Dict[Tuple[str, str], Dict[str, List[Place]]] = {}
        for place in filter(None, map(self.of, sources)):
            row = place.location.row
            if row and not place.location.row_holds_none:
                rows.setdefault((place.node, row.rpartition('[')[0]), {}).setdefault(row, []).append(place)
        return [place for found in rows.values() if len(found) == 1 for row in found.values() for place in row]

    def learn(self, sources: Iterable[values.Source], timeout: float = TIMEOUT, age: float = float('inf')) -> None:
        """Ask the owners of sources that are not known yet, or whose answer is older than `age` seconds."""
        stale = self._stale(sources, age)
        self._ask(stale, timeout)
        self._note_asked(stale)

    def look_up(self, sources: Iterable[values.Source], age: float = float('inf')) -> None:
        """Ask as `learn` does, in the background; `version` grows when something new is known."""
        stale = self._stale(sources, age)
        if stale:
            with self._lock:
                for node, asked in stale.items():
                    self._wanted.setdefault(node, []).extend(asked)
            self._background.call_soon(self._ask_wanted)

    def ask(
        self, nodes: Iterable[str], timeout: float = TIMEOUT, makes_known: bool = False
    ) -> Tuple[Dict[str, List[Place]], Dict[str, str]]:
        """All locations of nodes, asked now.

        Args:
            nodes: their full names.
            timeout: how long to wait for their answers, in seconds.
            makes_known: also those that are not known yet because they give a formula its shape.

        Returns:
            ({node: [Place, ...]}, {node: why it does not answer}).
        """
        nothing: Sequence[values.Source] = ()
        return self._ask(dict.fromkeys(nodes, nothing), timeout, makes_known)

    def take(self, node: str, locations: Iterable[msg.Location]) -> None:
        """Remember what a node says of itself without being asked: on its topic `<node>/rosslt/locations`, or in a
        bag."""
        self._take({node: [Place(node, location) for location in locations]}, {node: []})

    def forget(self, sources: Iterable[values.Source]) -> None:
        """Ask anew the next time."""
        with self._lock:
            for source in sources:
                self._asked.pop(source, None)

    def _stale(self, sources: Iterable[values.Source], age: float) -> Dict[str, List[values.Source]]:
        """The nodes that have to be asked, and for which of their sources."""
        now, own = time.monotonic(), self._node()
        stale: Dict[str, List[values.Source]] = {}
        with self._lock:
            for source in sources:
                patience = age if source in self._known else RETRY_AFTER
                asked = self._asked.get(source)
                if source.node not in ('', own) and (asked is None or now - asked >= patience):
                    stale.setdefault(source.node, []).append(source)
        return stale

    def _note_asked(self, stale: Dict[str, List[values.Source]]) -> None:
        with self._lock:
            for asked in stale.values():
                self._asked.update(dict.fromkeys(asked, time.monotonic()))

    def _ask(
        self, sources_by_node: Mapping[str, Sequence[values.Source]], timeout: float, makes_known: bool = False
    ) -> Tuple[Dict[str, List[Place]], Dict[str, str]]:
        """Ask nodes for sources of theirs: for all of them if a node has not told them yet, or none is named."""
        if not sources_by_node:
            return {}, {}
        ids_by_node = {
            node: [source.location_id for source in sources] if node in self._listed else []
            for node, sources in sources_by_node.items()
        }
        requests = {node: srv.ListLocationsRequest(ids, makes_known) for node, ids in ids_by_node.items()}
        answers, silent = ask_all('list_locations', srv.ListLocations, requests, timeout)
        places = {node: [Place(node, location) for location in answer.locations] for node, answer in answers.items()}
        self._take(places, ids_by_node)
        return places, silent

    def _take(self, places: Dict[str, List[Place]], ids_by_node: Mapping[str, Sequence[int]]) -> None:
        now = time.monotonic()
        with self._lock:
            for node, found in places.items():
                told = {place.source: place for place in found}
                asked = [values.Source(node, location_id) for location_id in ids_by_node[node]]
                if not asked:
                    self._listed.add(node)
                    asked = [source for source in self._known if source.node == node]
                for source in asked:
                    if source not in told:
                        self._known.pop(source, None)  # the location is gone
                if any(_is_news(self._known.get(source), place) for source, place in told.items()):
                    self.version += 1
                self._known.update(told)
                self._asked.update(dict.fromkeys(told, now))

    def _ask_wanted(self) -> None:
        with self._lock:
            wanted, self._wanted = self._wanted, {}
        with contextlib.suppress(rospy.ROSInterruptException):
            self._ask(wanted, TIMEOUT)
        self._note_asked(wanted)


def _elsewhere(thing: Sequence[Any]) -> List[Any]:
    """The numbers of a thing with its sources a little elsewhere, if they are defined there: an arm loses one of its
    ways when it is outstretched, and only then."""
    present = values.source_values(list(thing))
    moved = {
        source: value + ASIDE * (1.0 + abs(value)) / number
        for number, (source, value) in enumerate(present.items(), 1)
        if isinstance(value, float)
    }
    with contextlib.suppress(Exception):  # of whatever type: a user's operation may raise any
        found = list(values.reapply(list(thing), moved))
        if all(map(values.is_tracked, found)):  # and not a complex number, as a root may be
            return found
    return list(thing)


def _is_news(known: Optional[Place], told: Place) -> bool:
    """True if an owner says anything new of a location, other than its value."""
    fields = [field for field in msg.Location.__slots__ if field != 'value']
    return known is None or any(getattr(known.location, field) != getattr(told.location, field) for field in fields)
