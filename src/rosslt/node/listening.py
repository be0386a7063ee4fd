"""Listening to a topic whatever its type, with provenance: its messages in the order in which they come."""

import contextlib
import queue
import time
from typing import NamedTuple, Optional

import genpy.message
import rosgraph
import rospy

from rosslt import messages, values
from rosslt.messages import Message
from rosslt.node.service_calls import SHUTDOWN_CHECK_PERIOD
from rosslt.node.topics import Subscriber


class Heard(NamedTuple):
    """A message, and the node that has sent it."""

    publisher: str
    message: Message


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
        self._queue: queue.Queue[Heard] = queue.Queue()
        types = dict(rosgraph.Master(rospy.get_name()).getPublishedTopics('/'))
        if topic not in types:
            raise rospy.ROSException(f'nobody publishes {topic}')
        message_class = genpy.message.get_message_class(types[topic])
        if message_class is None:
            raise messages.UnknownType(f'{topic} has the type {types[topic]}, which is not installed here')
        self._subscriber = Subscriber(topic, message_class, self._take, keep_provenance=True)

    def _take(self, message: Message) -> None:
        self._queue.put(Heard((message._connection_header or {}).get('callerid', ''), message))

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
        first: Optional[Heard] = None
        error: Exception = rospy.ROSException(f'no message on {self._topic} within {timeout:g} s')
        for heard in iter(lambda: self.next_before(end), None):
            try:
                part, _ = messages.part_at(heard.message, field)
            except messages.NoSuchPart as missing:
                error = ValueError(f'the messages on {self._topic} have no field {field}: {missing}')
                continue
            if values.is_tracked(part):
                return heard
            first = first or heard
        if first is None:
            raise error
        return first

    def clear(self) -> None:
        """Drop messages that have arrived and were not read."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._queue.get_nowait()

    def __enter__(self) -> 'Listener':
        return self

    def __exit__(self, *_: object) -> None:
        self._subscriber.unregister()
