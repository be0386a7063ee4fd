"""The locations of all tracked nodes, as their owners report them, kept up to date; and changes of them."""

import json
import threading
import time
import traceback
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Set, Tuple

import rosgraph
import rospy

from rosslt import msg, node, srv, values
from rosslt.markers import refusal
from rosslt.node import Place

#: The period of asking nodes for their locations, in seconds. `<node>/rosslt/changes` tells of changes in between.
PERIOD = 1.0

#: The timeout of an owner's answer, in seconds.
TIMEOUT = 2.0

#: The number of unanswered questions after which a node is taken as gone; a busy one misses some.
PATIENCE = 3

#: Changes of one location by one hand that are no further apart than this, in seconds, are undone as one.
ONE_MOVE = 1.5

SERVICE = '/rosslt/list_locations'

#: (node, id)
Key = Tuple[str, int]


class Wish(NamedTuple):
    """A change that somebody wants.

    Attributes:
        value: the new value.
        hand: whose wish it is.
        refused: called with the reason if it is refused.
    """

    value: Any
    hand: str
    refused: Callable[[str], None]


class Locations:
    """All locations, node by node.

    Args:
        changed: called when one has another value.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._lock = threading.Lock()
        self._news = threading.Condition(self._lock)
        self._places: Dict[str, Dict[int, Place]] = {}
        self._first: Dict[Key, str] = {}  # what a parameter was before its first change
        self._silent: Dict[str, int] = {}  # node -> how many questions it has not answered
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._fresh: Set[Key] = set()  # what has changed since somebody asked
        self._wishes: Dict[Key, Wish] = {}
        self._moves: Dict[Key, Tuple[str, str, float]] = {}  # (hand, request id, when) of the last change of each
        self._master = rosgraph.Master(rospy.get_name())
        for work in (self._look, self._change):
            threading.Thread(target=self._forever, args=(work,), name='rosslt locations', daemon=True).start()

    def nodes(self) -> List[str]:
        """The nodes that have locations, sorted."""
        with self._lock:
            return sorted(self._places)

    def places(self) -> Dict[str, List[Place]]:
        """{node: its Places, in its own order} of all nodes."""
        with self._lock:
            return {name: list(places.values()) for name, places in sorted(self._places.items())}

    def fresh(self) -> Dict[Key, Place]:
        """The locations with another value than at the last call, as far as owners have told of it."""
        with self._lock:
            keys, self._fresh = self._fresh, set()
            return {(name, one): self._places[name][one] for name, one in keys if one in self._places.get(name, {})}

    def is_changed(self, place: Place) -> bool:
        """Return whether a location has another value than the code says, or than a parameter had at first."""
        first = place.location.literal or self._first.get((place.node, place.location.id), '')
        return bool(first and place.location.value) and not _is_same_json(first, place.location.value)

    def wish(self, place: Place, value: Any, hand: str, refused: Callable[[str], None]) -> None:
        """Have a location changed soon; a later wish replaces one that still waits.

        Args:
            place: the location.
            value, hand, refused: as of a Wish.
        """
        with self._news:
            self._wishes[place.node, place.location.id] = Wish(value, hand, refused)
            self._news.notify()

    def _forever(self, work: Callable[[], None]) -> None:
        while not rospy.is_shutdown():
            try:
                work()
            except rospy.ROSInterruptException:
                return
            except (OSError, rosgraph.MasterException) as error:
                rospy.logwarn_throttle(30, 'the master does not answer: %s', error)
                rospy.rostime.wallsleep(PERIOD)
            except Exception:  # one odd node must not end this for all others
                rospy.logerr_throttle(30, 'while following locations:\n%s', traceback.format_exc())
                rospy.rostime.wallsleep(PERIOD)

    def _look(self) -> None:
        services = self._master.getSystemState()[2]
        nodes = [name[: -len(SERVICE)] for name, _ in services if name.endswith(SERVICE)]
        nodes = [name for name in nodes if name != rospy.get_name()]
        found, _ = node.directory().ask(nodes, TIMEOUT)
        with self._lock:
            for name, places in found.items():
                self._places[name] = {place.location.id: place for place in places}
            self._silent = {name: self._silent.get(name, 0) + 1 for name in nodes if name not in found}
            for name in list(self._places):
                if not self._places[name] or (name not in found and self._silent.get(name, PATIENCE) >= PATIENCE):
                    del self._places[name]
            there = set(found).union(self._places)
        self._follow(there)
        rospy.rostime.wallsleep(PERIOD)

    def _follow(self, nodes: Set[str]) -> None:
        """Hear of changes in these nodes."""
        for name in set(self._subscribers).difference(nodes):
            self._subscribers.pop(name).unregister()
        for name in nodes.difference(self._subscribers):
            self._subscribers[name] = rospy.Subscriber(name + '/rosslt/changes', msg.AppliedChange, self._applied, name)
            answers, _ = node.ask_all('get_history', srv.GetHistory, {name: srv.GetHistoryRequest()}, TIMEOUT)
            with self._lock:
                for answer in answers.values():
                    for one in answer.changes:
                        self._first.setdefault((name, one.change.location_id), one.change.old_value)

    def _applied(self, change: msg.AppliedChange, name: str) -> None:
        with self._lock:
            self._first.setdefault((name, change.location_id), change.old_value)
            place = self._places.get(name, {}).get(change.location_id)
            if place is not None:
                place.location.value = change.new_value
                self._fresh.add((name, change.location_id))
        self._changed()

    def _change(self) -> None:
        with self._news:
            while not self._wishes:
                self._news.wait(1.0)
                if rospy.is_shutdown():
                    return
            key = next(iter(self._wishes))
            wish = self._wishes.pop(key)
            request_id = self._request_id(key, wish.hand)
        name, location_id = key
        source = values.Source(name, location_id)
        try:
            changed = node.request_values({source: wish.value}, TIMEOUT, request_id)
        except values.Error as error:
            wish.refused(refusal(error))
            return
        with self._lock:
            place = self._places.get(name, {}).get(location_id)
            if place is not None:
                place.location.value = node.to_json(changed[source].new)
                self._fresh.add(key)
        self._changed()

    def _request_id(self, key: Key, hand: str) -> str:
        """The id of a request: that of the last one where a hand goes on moving what it has just moved."""
        now = time.monotonic()
        before: Optional[Tuple[str, str, float]] = self._moves.get(key)
        goes_on = before is not None and before[0] == hand and now - before[2] < ONE_MOVE
        request_id = before[1] if before is not None and goes_on else node.new_request_id()
        self._moves[key] = (hand, request_id, now)
        return request_id


def _is_same_json(first: str, second: str) -> bool:
    return first == second or bool(json.loads(first) == json.loads(second))
