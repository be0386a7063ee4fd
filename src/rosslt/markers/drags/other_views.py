"""Hands in other views of the same things: views tell each other what is held, so that the first hand holds it."""

import time
from typing import Callable, Dict, Optional, Tuple

import rospy

from rosslt import msg

TOPIC = '/rosslt/held'

#: The period in which a view repeats the handles held in it, for views that started later, in seconds.
REPEAT_PERIOD = 0.5

#: The time after which a hand, or a view, of which nothing is heard has let go, in seconds. A view reports a hand
#: several times a second while a button is down.
SILENCE = 3.0

#: (when a hand took hold, in seconds since 1970; the view it is in): of two, the smaller one holds a thing.
Claim = Tuple[float, str]


class OtherViews:
    """The things that are held in other views.

    Args:
        view: the name of this one.
    """

    def __init__(self, view: str) -> None:
        self.view = view
        self._heard: Dict[str, Tuple[float, Dict[str, float]]] = {}  # view -> (when, {name: since})

    def hear(self, view: str, held: Dict[str, float]) -> None:
        """A view says what is held in it, {name of a handle: since when}."""
        if view != self.view:
            self._heard[view] = (time.monotonic(), held)

    def first(self, name: str) -> Optional[Claim]:
        """The first claim of another view on a handle, or None."""
        now = time.monotonic()
        claims = [
            (held[name], view) for view, (heard, held) in self._heard.items() if name in held and now - heard < SILENCE
        ]
        return min(claims, default=None)

    def is_before(self, name: str, since: float) -> bool:
        """Return whether another view was first, where a hand in this one took hold of a handle at some time."""
        claim = self.first(name)
        return claim is not None and claim < (since, self.view)


class HeldTopic:
    """The topic on which views tell each other.

    Args:
        hear: called with (view, {name: since}) for what a view says, this one among them.
    """

    def __init__(self, hear: Callable[[str, Dict[str, float]], None]) -> None:
        self._publisher = rospy.Publisher(TOPIC, msg.HeldThings, queue_size=10)
        rospy.Subscriber(TOPIC, msg.HeldThings, self._take, hear)

    def tell(self, held: Dict[str, float]) -> None:
        """Say what is held in this view."""
        self._publisher.publish(list(held), list(held.values()))

    @staticmethod
    def _take(message: msg.HeldThings, hear: Callable[[str, Dict[str, float]], None]) -> None:
        hear(message._connection_header['callerid'], dict(zip(message.things, message.since)))
