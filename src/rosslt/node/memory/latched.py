"""Latched messages: each is published again when a change has reached its fields."""

import threading
import weakref
from typing import Any, Iterator, Set

import rospy

from rosslt.messages import Message
from rosslt.node.callbacks import Callbacks
from rosslt.node.memory.remembered import MEMORY

_publishers: 'weakref.WeakSet[Any]' = weakref.WeakSet()
_lock = threading.RLock()  # reentrant, as a signal's handler may publish in the middle of a publish
_soon = Callbacks('rosslt latched messages')


def follow_latched(publisher: object) -> None:
    """Have the last message of a latched publisher be published again after changes.

    Args:
        publisher: a Publisher; its `publish_again` is called, with the message, if a change has set a part of it.
    """
    with _lock:
        _publishers.add(publisher)
    MEMORY.changed = lambda owners: _soon.call_soon(lambda: _publish_again(owners))


def _publish_again(owners: Set[int]) -> None:
    with _lock:
        publishers = list(_publishers)
    for publisher in publishers:
        try:
            publisher.publish_again(owners)
        except Exception as error:  # of this publisher only; the others have theirs to publish
            rospy.logerr('cannot publish the latched message of %s again: %s', publisher.resolved_name, error)


def containers(message: Message) -> Iterator[Any]:
    """A message, and the messages and lists in it at any depth."""
    waiting = [message]
    while waiting:
        part = waiting.pop()
        yield part
        inner = part if isinstance(part, (list, tuple)) else [getattr(part, name) for name in part.__slots__]
        waiting += [one for one in inner if isinstance(one, (list, tuple)) or hasattr(one, '_slot_types')]
