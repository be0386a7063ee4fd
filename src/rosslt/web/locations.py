"""The locations of all tracked nodes, as their owners report them, kept up to date; and changes of them."""

import contextlib
import json
import math
import reprlib
import time
from concurrent import futures
from typing import Any, Callable, ContextManager, Dict, List, NamedTuple, Optional, Set, Tuple, Union

import rospy

from rosslt import files, msg, node, values
from rosslt.markers import Graph, contained, refusal
from rosslt.node import Place

#: The timeout of an owner's answer, in seconds.
TIMEOUT = 2.0

#: The pause after which a hand begins something new, in seconds: changes of one location with shorter pauses are undone
#: as one, and what is typed is taken after it.
PAUSE = 1.0

SERVICE = '/rosslt/list_locations'

#: (node, id)
Key = Tuple[str, int]


class Wish(NamedTuple):
    """A change that somebody wants.

    Attributes:
        value: the new value.
        hand: whose wish it is.
        refused: called with the reason if it is refused.
        told: called with what the node's memory still has of the former value, once the hand has paused.
        taken: called when the value is in force.
        turn: all changes of a location by this hand in one turn are undone as one, however long it pauses; None: the
            pauses decide.
    """

    value: Any
    hand: str
    refused: Callable[[str], None]
    told: Callable[[str], None]
    taken: Callable[[], None] = lambda: None
    turn: Optional[int] = None


class Locations:
    """All locations, node by node.

    Args:
        lock: of the page.

    Attributes:
        shows_all: whether numbers are shown that give a formula its shape.
        reports: how many reports of owners there were: as long as there is no other one, `places` are the same.
        origins: {full name of a parameter: where it is given}, as `rosslt launch` has noted it.
    """

    def __init__(self, lock: ContextManager[bool]) -> None:
        self._lock = lock
        self.shows_all, self.reports = False, 0
        self.origins: Dict[str, Dict[str, Any]] = {}
        self._places: Dict[str, Dict[int, Place]] = {}
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._wishes: Dict[Tuple[Key, str], Wish] = {}  # of each location and hand
        self._changes: Dict[Key, Tuple[Wish, node.ChangeRequest]] = {}  # the last one of each, and for which wish
        self._requests = futures.ThreadPoolExecutor(1)
        self._changed: Dict[Key, Tuple[Wish, node.ChangeRequest]] = {}  # what is not told of yet
        self._after = node.Callbacks('rosslt after changes')

    def nodes(self) -> List[str]:
        """The nodes that have locations, sorted."""
        with self._lock:
            return sorted(self._places)

    def places(self) -> Dict[str, List[Place]]:
        """{node: its Places that are shown, in its own order} of all nodes."""
        with self._lock:
            there = {name: list(places.values()) for name, places in sorted(self._places.items())}
        return node.listed(there, self.shows_all)

    def wish(self, place: Place, wish: Wish) -> None:
        """Have a location changed soon; a later wish replaces one of the same hand that still waits."""
        key = place.node, place.location.id
        with self._lock:
            if (key, wish.hand) not in self._wishes:
                self._requests.submit(self._change, key, wish.hand)
            self._wishes[key, wish.hand] = wish

    def wait_for_wishes(self) -> None:
        """Wait until all wishes so far have been asked for."""
        self._requests.submit(lambda: None).result()

    def update(self, graph: Graph) -> None:
        """Ask all nodes for their locations; `<node>/rosslt/changes` tells of changes in between."""
        services = [name for name in graph.services if name.endswith(SERVICE)]
        nodes = {name[: -len(SERVICE)] for name in services}.difference([rospy.get_name()])
        found, silent = node.directory().ask(nodes, TIMEOUT, makes_known=self.shows_all)
        origins = _origins()
        with self._lock:
            self.origins = origins
            known = {name: self._places[name] for name in self._places if silent.get(name) == node.NO_ANSWER}
            told = {name: {place.location.id: place for place in places} for name, places in found.items() if places}
            self._places = {**known, **told}
            self.reports += 1
            there = set(self._places)
        self._follow(there)

    def _follow(self, nodes: Set[str]) -> None:
        """Hear of changes in these nodes."""
        for name in set(self._subscribers).difference(nodes):
            self._subscribers.pop(name).unregister()
        for name in nodes.difference(self._subscribers):
            self._subscribers[name] = rospy.Subscriber(name + '/rosslt/changes', msg.AppliedChange, self._applied, name)

    def _applied(self, change: msg.AppliedChange, name: str) -> None:
        self._take((name, change.location_id), change.new_value)

    def _take(self, key: Key, value: str) -> None:
        """A location has another value now, in JSON."""
        with self._lock:
            place = self._places.get(key[0], {}).get(key[1])
            if place is not None:
                place.location.value = value
                self.reports += 1

    def _change(self, key: Key, hand: str) -> None:
        """Ask an owner for the present wish of a hand."""
        with contained('a location cannot be changed'):
            with self._lock:
                wish = self._wishes.pop((key, hand))
                request = self._request(key, wish)
            source = values.Source(*key)
            try:
                changed = request.step({source: wish.value})
            except values.Error as error:
                wish.refused(refusal(error))
            else:
                self._take(key, node.to_json(changed[source].new))
                wish.taken()
                with self._lock:
                    place = self._places.get(key[0], {}).get(key[1])
                    if place is not None and not place.location.at_next_start:  # of which the field says that
                        self._changed[key] = wish, request
                self._after.call_soon(self._say_outdated, PAUSE)

    def _say_outdated(self) -> None:
        with self._lock:
            changed, self._changed = self._changed, {}
        for wish, request in changed.values():
            outdated = request.outdated()
            if outdated:
                wish.told(outdated)

    def _request(self, key: Key, wish: Wish) -> node.ChangeRequest:
        """The request for a change of a location: the last request if the hand goes on moving the same location."""
        last, request = self._changes.get(key, (None, node.ChangeRequest(TIMEOUT)))
        is_same = last is not None and (last.hand, last.turn) == (wish.hand, wish.turn)
        if not is_same or (wish.turn is None and time.monotonic() - request.requested > PAUSE):
            request = node.ChangeRequest(TIMEOUT)
        self._changes[key] = wish, request
        return request


def _origins() -> Dict[str, Dict[str, Any]]:
    """{full name of a parameter: where it is given}, as `rosslt launch` has noted it."""
    with contextlib.suppress(ValueError, AttributeError):  # what is there is not what `rosslt launch` writes
        noted = json.loads(str(rospy.get_param_cached(files.ORIGINS, '{}')))
        return {name: one for name, one in noted.items() if isinstance(one, dict) and isinstance(one.get('file'), str)}
    return {}


def value_in(place: Place, text: str) -> Tuple[Any, str]:
    """The value that a text says for a location: (value, ''), or (None, why it is none that the location takes)."""
    if place.location.type == 'str':
        is_unicode = not any('\ud800' <= one <= '\udfff' for one in text)
        return (text, '') if is_unicode else (None, f'{reprlib.repr(text)} holds half a surrogate pair')
    if place.location.type == 'bool':
        value = {'true': True, 'false': False}.get(text)
        return value, '' if value is not None else f'{reprlib.repr(text)} is neither true nor false'
    return number_in(place, text.strip())


def number_in(place: Place, text: str) -> Tuple[Union[int, float, None], str]:
    """The number that a text says for a location: (number, ''), or (None, why it is none that the location takes)."""
    value = number_said(text)
    if value is None:
        return None, f'{reprlib.repr(text)} is not a number'
    if isinstance(value, float) and math.isinf(value):
        return None, f'{reprlib.repr(text)} is too large'
    why = node.why_whole(place) if isinstance(value, float) and not value.is_integer() else ''
    return (None, f'{text!r} is not an int: {why}') if why else (value, '')


def number_said(text: str) -> Union[int, float, None]:
    """The number that a text says, infinite if it is too large; None if it says none."""
    with contextlib.suppress(ValueError):
        return int(text)
    with contextlib.suppress(ValueError):
        return None if math.isnan(float(text)) else float(text)
    return None
