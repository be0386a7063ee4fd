"""Listening to topics whatever their types, with provenance: their messages in the order in which they come."""

import contextlib
import queue
import time
from typing import Callable, Dict, Iterator, Mapping, NamedTuple, Optional, Set, Tuple

import genpy.message
import rosgraph
import rospy

from rosslt import messages, values
from rosslt.messages import Message
from rosslt.node.rospy_internals import connected_publishers, latched_publishers
from rosslt.node.service_calls import SHUTDOWN_CHECK_PERIOD
from rosslt.node.slave_api import sent_types
from rosslt.node.topics.serialization import is_sampled
from rosslt.node.topics.topics import Subscriber


class Heard(NamedTuple):
    """A message with its provenance."""

    topic: str
    publisher: str
    """The publishing node; '' if that is not known."""
    type: str
    """The type on the wire."""
    message: Message
    """An ordinary message, also if the type on the wire is a tracked one."""
    is_latched: bool = False
    """True for a latched publisher, which sends its last message to later subscribers."""
    is_sampled: bool = False
    """True for a message that was sent plain between whole ones, although a leaf of it is tracked."""


class TopicReader:
    """Reads topics whatever their types, for a node that may have other subscribers of them.

    Args:
        take: called with each message.
        is_exact: leave out messages between whole ones, instead of completing what is as in the last whole one.
        of_moved: complete what has moved since as well, as in `messages.LastProvenance`.

    Attributes:
        left_out: the number of messages that were left out.
    """

    def __init__(self, take: Callable[[Heard], None], is_exact: bool = False, of_moved: bool = False) -> None:
        self._heard, self._is_exact = take, is_exact
        self.left_out = 0
        self._last = messages.LastProvenance(of_moved)
        self._subscribers: Dict[str, Tuple[str, Subscriber]] = {}  # topic -> (its type, the subscriber)

    def follow(self, types: Mapping[str, str]) -> None:
        """Read these topics, {topic: type}, and no others; those whose types are not installed here are left out."""
        for topic, (type_, subscriber) in list(self._subscribers.items()):
            if types.get(topic) != type_:
                del self._subscribers[topic]
                subscriber.unregister()
        with contextlib.ExitStack() as each:  # an error of one is raised after all others
            for topic in types.keys() - self._subscribers.keys():
                each.callback(self._subscribe, topic, types[topic])

    def topics(self) -> Set[str]:
        """All topics that are read."""
        return set(self._subscribers)

    def publishers(self, topic: str) -> Set[str]:
        """The nodes that are connected; a node that crashed stays in the master's list."""
        return connected_publishers(self._subscribers[topic][1]) if topic in self._subscribers else set()

    def latched(self) -> Set[Tuple[str, str]]:
        """{(topic, publisher)} of the latched publishers that are connected."""
        return {(topic, one) for topic, (_, made) in self._subscribers.items() for one in latched_publishers(made)}

    def _subscribe(self, topic: str, type_: str) -> None:
        # a topic whose type nobody has told yet has the type *
        message_class = genpy.message.get_message_class(type_) if '/' in type_ else None
        if message_class:
            self._subscribers[topic] = type_, Subscriber(topic, message_class, self._take, topic)

    def _take(self, message: Message, topic: str) -> None:
        header, sampled = message._connection_header or {}, is_sampled(message)
        if sampled and self._is_exact:
            self.left_out += 1
            return
        publisher, type_ = header.get('callerid', ''), header.get('type', message._type)
        if not self._is_exact:
            message = self._last.completed(message, sampled, (topic, publisher))
        self._heard(Heard(topic, publisher, type_, message, header.get('latching') == '1', sampled))


class Listener:
    """The messages of topics as they come, for who waits for them, of the types that their publishers say.

    Args:
        topics: their full names.
        is_exact: as in `TopicReader`.

    Raises:
        rospy.ROSException: nobody publishes one of them.
        UnknownType: the types of all of them are not installed here; without this, those that are not are left out.
    """

    def __init__(self, *topics: str, is_exact: bool = False) -> None:
        self._topics = topics
        self._queue: queue.Queue[Heard] = queue.Queue()
        self._reader = TopicReader(self._queue.put, is_exact)
        master = rosgraph.Master(rospy.get_name())
        kept = dict(master.getPublishedTopics('/'))
        for topic in topics:
            if topic not in kept:
                raise rospy.ROSException(f'nobody publishes {topic}')
        types = sent_types({topic: kept[topic] for topic in topics}, dict(master.getSystemState()[0]))
        self._reader.follow(types)
        if topics and not self._reader.topics():
            raise messages.UnknownType(f'{topics[0]} has the type {types[topics[0]]}, which is not installed here')

    def during(self, seconds: float) -> Iterator[Heard]:
        """The messages of that time, as they come."""
        end = time.monotonic() + seconds
        return iter(lambda: self.next_before(end), None)

    def next_before(self, end: float) -> Optional[Heard]:
        """The next message, or None if there is none until a time of `time.monotonic`.

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
        """The first message of the topic in whose field something has a source; the first one at all if none has.

        Args:
            field: as `messages.part_at` takes it.
            timeout: how long to wait for a message, in seconds.

        Raises:
            rospy.ROSException: none came in time.
            ValueError: the messages have no such field.
        """
        end = time.monotonic() + timeout
        first: Optional[Heard] = None
        error: Optional[Exception] = None
        for heard in iter(lambda: self.next_before(end), None):
            try:
                part, _ = messages.part_at(heard.message, field)
            except messages.NoSuchPart as missing:
                error = ValueError(f'the messages on {self._topics[0]} have no field {field}: {missing}')
                continue
            if values.is_tracked(part):
                return heard
            first = first or heard
        if first is None:
            raise error or rospy.ROSException(self.why_nothing(timeout))
        return first

    def why_nothing(self, timeout: float) -> str:
        """Why none of the messages of the first topic that came within a timeout, in seconds, was taken."""
        topic = self._topics[0]
        if not self._reader.left_out:
            return f'no message on {topic} within {timeout:g} s'
        return (
            f'no message with provenance on {topic} within {timeout:g} s: {self._reader.left_out} came without theirs'
        )

    def latched(self) -> Set[Tuple[str, str]]:
        """{(topic, publisher)} of the latched publishers that are connected, also of those that have sent nothing."""
        return self._reader.latched()

    def clear(self) -> None:
        """Drop messages that have arrived and were not read."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._queue.get_nowait()

    def __enter__(self) -> 'Listener':
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.follow({})
