"""A location as a topic: its node sends a message of one number, `data`, whenever it is changed."""

import threading
from typing import Any, Callable, Dict

import rospy
from std_msgs.msg import Bool, Float64, Int64, String

from rosslt import messages, msg, node, srv, values
from rosslt.node import Heard
from rosslt.teach.devices import NotTaught

#: The class of the messages, and the one of their value, for each type of location.
MESSAGES: Dict[str, Any] = {'bool': (Bool, bool), 'float': (Float64, float), 'int': (Int64, int), 'str': (String, str)}

#: How long the owner of a location may take to answer, in seconds.
TIMEOUT = 2.0


class LocationReader:
    """Reads a location.

    Args:
        place: of the location.
        take: called with a message each time that it is changed, and when it is asked for.
    """

    def __init__(self, place: node.Place, take: Callable[[Heard], None]) -> None:
        self._place, self._take = place, take
        self._lock = threading.Lock()  # an answer is older than the changes that come while it is awaited
        rospy.Subscriber(f'{place.node}/rosslt/changes', msg.AppliedChange, self._applied)

    def ask(self) -> Heard:
        """Ask the node for the present value.

        Raises:
            NotTaught: it does not answer, has no such location any more, or that has no value.
        """
        with self._lock:
            name, request = self._place.node, srv.ListLocationsRequest([self._place.location.id], False)
            answers, silent = node.ask_all('list_locations', srv.ListLocations, {name: request}, TIMEOUT)
            if silent:
                raise NotTaught(f'{name} does not answer: {silent[name]}')
            if not answers[name].locations:
                raise NotTaught(f'{name} has no location {self._place.local_name} any more')
            place = node.Place(name, answers[name].locations[0])
            if place.value is None:
                raise NotTaught(f'{place.name} has no value: {place.location.fault}')
            return self._tell(place.value)

    def _applied(self, change: msg.AppliedChange) -> None:
        if change.location_id == self._place.location.id:
            with self._lock:
                self._tell(node.from_json(change.new_value))

    def _tell(self, value: messages.Scalar) -> Heard:
        place = self._place
        message_class, kind = MESSAGES[place.location.type]
        message = message_class(values.track(kind(value), place.source))
        heard = Heard(str(place.source), place.node, message._type, message, is_latched=True)
        self._take(heard)
        return heard
