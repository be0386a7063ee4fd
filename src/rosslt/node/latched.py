"""Latched messages: one that was published once is published again, evaluated anew, when a source of it changes."""

import threading
import weakref
from typing import Any, List, NamedTuple, Optional

import rospy

from rosslt import messages, values
from rosslt.messages import Message
from rosslt.node.callbacks import Callbacks
from rosslt.node.refresh import READINGS

_publishers: 'weakref.WeakSet[Any]' = weakref.WeakSet()
_lock = threading.RLock()  # reentrant, as a signal's handler may publish in the middle of a publish
_soon = Callbacks('rosslt latched messages')


class Latched(NamedTuple):
    """The last message of a latched publisher.

    Attributes:
        message: a copy of it as it was published, which nobody changes.
        shown: the plain values of its tracked leaves, as they were sent last.
        outgoing: the object that rospy holds for it.
    """

    message: Message
    shown: List[Any]
    outgoing: Message


def latch(publisher: Any, message: Message, sent: Message, outgoing: Message) -> Optional[Latched]:
    """Follow the message that a latched publisher has just published, if any of it is tracked.

    Args:
        publisher: a Publisher; its `publish_again` is called after changes.
        message: the ordinary message.
        sent: the same, or what it was evaluated anew to.
        outgoing: the object that rospy got for it.

    Returns:
        The Latched, None where nothing is tracked.
    """
    if not messages.tracked_leaves(message):
        return None
    with _lock:
        _publishers.add(publisher)
    READINGS.on_change = lambda: _soon.call_soon(_publish_again)
    if READINGS.replaced:
        READINGS.on_change()  # it may be outdated already
    return Latched(messages.with_leaves(message, {}), plain_leaves(sent), outgoing)


def _publish_again() -> None:
    with _lock:
        publishers = list(_publishers)
    for publisher in publishers:
        try:
            publisher.publish_again()
        except Exception as error:  # of this publisher only; the others have theirs to publish
            rospy.logerr('cannot publish the latched message of %s again: %s', publisher.resolved_name, error)


def plain_leaves(message: Message) -> List[Any]:
    """The plain values of the tracked leaves of a message."""
    return [values.untracked(value) for _, value in messages.tracked_leaves(message)]
