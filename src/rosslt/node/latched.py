"""Latched messages: one that was published once is published again, evaluated anew, when a source of it changes."""

import threading
import weakref
from typing import Any, List, Optional

import rospy

from rosslt import messages, values
from rosslt.messages import Message
from rosslt.node.callbacks import Callbacks
from rosslt.node.refresh import READINGS, Refresher

_latched: 'weakref.WeakKeyDictionary[Any, Latched]' = weakref.WeakKeyDictionary()
_lock = threading.RLock()  # reentrant, as a signal's handler may publish in the middle of a publish
_soon = Callbacks('rosslt latched messages')


class Latched:
    """The last message of a latched publisher, as it was when it was published.

    Args:
        message: a copy of it, which nobody changes.
        sent: the message that was sent, with the values that its sources had at that moment.
        outgoing: the object that rospy holds for it.

    Attributes:
        outgoing: the object that rospy holds for it by now.
    """

    def __init__(self, message: Message, sent: Message, outgoing: Message) -> None:
        self.outgoing = outgoing
        self._message = message
        self._shown = _plain_leaves(sent)

    def changed(self, refresher: Refresher) -> Any:
        """The message with the present values of its sources; None where it was shown with them already."""
        message = refresher.fresh(self._message, was_sent=True)
        shown = _plain_leaves(message)
        if shown == self._shown:
            return None
        self._shown = shown
        return message


def latch(publisher: Any, message: Message, sent: Message, outgoing: Message) -> Optional[Latched]:
    """Keep the message that a latched publisher has just published, if any of it is tracked.

    Args:
        publisher: a Publisher; its `publish_again` is called after changes.
        message: the ordinary message.
        sent: the same, or what it was evaluated anew to.
        outgoing: the object that rospy got for it.

    Returns:
        The Latched, None where nothing is tracked.
    """
    kept = None
    if messages.tracked_leaves(message):
        kept = Latched(messages.with_leaves(message, {}), sent, outgoing)
    with _lock:
        if kept is None:
            _latched.pop(publisher, None)
        else:
            _latched[publisher] = kept
            READINGS.on_change = lambda: _soon.call_soon(_publish_again)
    if READINGS.replaced:
        READINGS.on_change()  # it may be outdated already
    return kept


def _publish_again() -> None:
    with _lock:
        kept = list(_latched.items())
    for publisher, latched in kept:
        try:
            publisher.publish_again(latched)
        except Exception as error:  # of this publisher only; the others have theirs to publish
            rospy.logerr('cannot publish the latched message of %s again: %s', publisher.resolved_name, error)


def _plain_leaves(message: Message) -> List[Any]:
    return [values.untracked(value) for _, value in messages.tracked_leaves(message)]
