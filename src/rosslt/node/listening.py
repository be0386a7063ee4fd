"""Listening to a topic whatever its type, with provenance: its messages in the order in which they come."""

import contextlib
import queue
import time
from typing import List, NamedTuple, Optional

import genpy.message
import rosgraph
import rospy

from rosslt import messages, values
from rosslt.messages import Message
from rosslt.node.service_calls import SHUTDOWN_CHECK_PERIOD
from rosslt.node.topics import Subscriber

#: The maximal number of unread messages; beyond it, the oldest are dropped.
BACKLOG = 1000

#: The maximal wait for another publisher's message with a source after a message without one, in seconds.
GATHERING = 1.0


class Heard(NamedTuple):
    """A message, and the node that has sent it."""

    publisher: str
    message: Message
    is_latched: bool
    """Whether its publisher is a latched one, which sends again only what has changed."""


class Listener:
    """The messages of a topic as they come, for a node that may have other subscribers of it.

    Args:
        topic: its full name.

    Raises:
        rospy.ROSException: nobody publishes it.
        UnknownType: its messages' type is not installed here.
    """

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._queue: queue.Queue[Heard] = queue.Queue(BACKLOG)
        types = dict(rosgraph.Master(rospy.get_name()).getPublishedTopics('/'))
        if topic not in types:
            raise rospy.ROSException(f'nobody publishes {topic}')
        message_class = genpy.message.get_message_class(types[topic])
        if message_class is None:
            raise messages.UnknownType(f'{topic} has the type {types[topic]}, which is not installed here')
        self._subscriber = Subscriber(topic, message_class, self._take, keep_provenance=True)

    def _take(self, message: Message) -> None:
        header = message._connection_header or {}
        publisher = header.get('callerid', '')
        heard = Heard(publisher, message, header.get('latching') == '1')
        while True:
            try:
                self._queue.put_nowait(heard)
                return
            except queue.Full:
                with contextlib.suppress(queue.Empty):
                    self._queue.get_nowait()

    def next_before(self, end: float) -> Optional[Heard]:
        """The next message, or None where there is none until a time of `time.monotonic`.

        Raises:
            rospy.ROSInterruptException: this node is being shut down.
        """
        while True:
            left = end - time.monotonic()
            with contextlib.suppress(queue.Empty):
                return self._queue.get(timeout=max(0.0, min(left, SHUTDOWN_CHECK_PERIOD)))
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException('rospy shutdown')
            if left <= 0:
                return None

    def first(self, field: str, timeout: float) -> Heard:
        """The first message in whose field something has a source; the first one at all where none has.

        Args:
            field: as `messages.part_at` takes it.
            timeout: how long to wait for a message, in seconds.

        Raises:
            rospy.ROSException: none came in time.
            ValueError: the messages have no such field.
        """
        end = time.monotonic() + timeout
        found: List[Heard] = []
        reason = ''
        while True:
            heard = self.next_before(end)
            if heard is None:
                break
            try:
                part, _ = messages.part_at(heard.message, field)
            except messages.NoSuchPart as missing:
                reason = str(missing)
                end = min(end, time.monotonic() + GATHERING)
                continue
            if values.is_tracked(part):
                return heard
            if not found:
                end = min(end, time.monotonic() + GATHERING)
            found.append(heard)
        if found:
            return found[0]
        if reason:
            raise ValueError(f'the messages on {self._topic} have no field {field}: {reason}')
        raise rospy.ROSException(f'no message on {self._topic} within {timeout:g} s')

    def clear(self) -> None:
        """Drop messages that have arrived and were not read."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._queue.get_nowait()

    def __enter__(self) -> 'Listener':
        return self

    def __exit__(self, *_: object) -> None:
        self._subscriber.unregister()
