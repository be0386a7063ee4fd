"""Publishers and subscribers that carry provenance: rospy's own, with the same arguments.

The type that is passed decides the transport: a tracked type (`PoseTracked`) travels as in the paper, an
ordinary one (`Pose`) with its provenance in-band, behind the message. Callbacks get the ordinary message either way.
"""

import functools
import threading
import time
import warnings
from typing import Any, Callable, Dict, List, Optional, Set, Tuple

import genpy
import rospy

from rosslt import messages, values
from rosslt.messages import Message, MessageClass
from rosslt.node.master_watch import MASTER_WATCH
from rosslt.node.memory.latched import containers, follow_latched
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.rospy_internals import (
    args_kwds_to_message,
    get_topic_manager,
    is_initialized,
    mend_connecting,
    read_all_with,
)
from rosslt.node.topics.serialization import (
    Provenance,
    Sending,
    ThisThread,
    is_sampled,
    received_class,
    serialization_fault,
    serializer,
    told,
    whole_provenance,
)

#: The text of rospy's warning about a missing queue size.
_NO_QUEUE_SIZE = (
    "The publisher should be created with an explicit keyword argument 'queue_size'. Please see "
    'http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more information.'
)
#: The endings of the type names of an action's messages. A goal or a result comes once.
_OF_ACTIONS = 'ActionGoal', 'ActionFeedback', 'ActionResult'
#: For how long a whole message is waited for instead of one between, in seconds.
PATIENCE = 1.0
#: The index of the queue size among the arguments after `subscriber_listener`.
_PLACE_OF_QUEUE_SIZE = 3


class Publisher(rospy.Publisher):
    """`rospy.Publisher`, whose messages carry the provenance of the tracked values in them.

    Args:
        name, data_class, and all others: as in `rospy.Publisher`; `data_class` may be a tracked message type.
    """

    def __init__(
        self,
        name: str,
        data_class: MessageClass,
        subscriber_listener: Optional[rospy.SubscribeListener] = None,
        *args: Any,
        **kwargs: Any,
    ) -> None:
        args, kwargs = _plain_options(args, kwargs)
        wraps = messages.is_tracked_type(data_class)
        self._plain_class = messages.plain_type(data_class) if wraps else data_class
        self._sampled = messages.SampledProvenance(lambda: Sending.rate)
        self._is_always_whole = data_class._type.endswith(_OF_ACTIONS)
        self._serializable: Callable[[Message], Message] = (
            self._wrapped if wraps else serializer(data_class, self._provenance, lambda: self._is_recorded)
        )
        self._latched: Optional[Tuple[Message, Message]] = None  # the last message, and what rospy has of it
        if subscriber_listener is not None:
            whole = functools.partial(self._wrapped, provenance=whole_provenance)
            in_full = whole if wraps else serializer(data_class)
            subscriber_listener = _Listener(
                subscriber_listener, lambda message: message if has_its_provenance(message) else in_full(message)
            )
        if kwargs.get('queue_size') is not None or len(args) > _PLACE_OF_QUEUE_SIZE:
            super().__init__(name, data_class, subscriber_listener, *args, **kwargs)
            MASTER_WATCH.start()
            return
        # rospy would say so of the line below, rather than of the one that makes this publisher.
        warnings.warn(_NO_QUEUE_SIZE, SyntaxWarning, stacklevel=2)
        present = {impl: impl.queue_size for impl in get_topic_manager().pubs.values()}
        super().__init__(name, data_class, subscriber_listener, *args, **{**kwargs, 'queue_size': 0})
        self.impl.set_queue_size(present.get(self.impl))
        MASTER_WATCH.start()

    @property
    def _is_recorded(self) -> bool:
        """False if a message without provenance may have some that was not recorded."""
        return True

    @property
    def _keeps_last(self) -> bool:
        """True if rospy keeps the last message for later subscribers, and if the publisher is unregistered."""
        return getattr(self.impl, 'is_latch', True)

    @property
    def _last_asked(self) -> Tuple[int, Any]:
        """Differs after a change, and after somebody has subscribed."""
        # rospy makes another list of connections then
        return MEMORY.changes, getattr(self.impl, 'connections', None)

    def _provenance(self, message: Message) -> bytes:
        """The provenance of a message that is sent now: all of it, or none between those that are written at a rate."""
        if self._is_always_whole or self._keeps_last:
            return whole_provenance(message)
        return self._sampled.to_send(message, Sending.full_history, self._last_asked)

    def publish(self, *args: object, **kwds: object) -> None:
        """Publish a message, given as `rospy.Publisher.publish` takes it: ordinary, also if the type is
        tracked."""
        only = args[0] if len(args) == 1 and not kwds else None
        if type(only) is self._plain_class:
            message, outgoing = only, self._serializable(only)
        else:
            expected = self.data_class if has_its_provenance(only) else self._plain_class
            message = args_kwds_to_message(expected, args, kwds)
            outgoing = self._outgoing(message)
        impl = self.impl
        lock = getattr(impl, 'publock', None)
        if lock is None or not is_initialized():  # unregistered, closed, or too early
            super().publish(outgoing)
            return
        # As in rospy, without repeating checks. Unlike in rospy, what has been written of a message that cannot be
        # serialized is removed: it would be sent in front of the next message.
        with lock:
            try:
                impl.publish(outgoing)
            except Exception as error:
                if not impl.closed:
                    impl.buff.seek(0)
                    impl.buff.truncate(0)
                if isinstance(error, (genpy.SerializationError, rospy.ROSSerializationException)):
                    raise rospy.ROSSerializationException(serialization_fault(message, error)) from None
                raise
            if impl.is_latch:
                self._latched = message, outgoing
                follow_latched(self)

    def publish_again(self, owners: Set[int]) -> None:
        """Publish the last message of a latched publisher again if a change has set a part of it.

        Args:
            owners: the ids of the messages and lists in which the change has set something.
        """
        impl = self.impl
        lock = getattr(impl, 'publock', None)
        if lock is None:
            return
        with lock:
            # unless another publisher of the topic has published since
            if self._latched is None or impl.latch is not self._latched[1]:
                return
            message = self._latched[0]
            if any(id(part) in owners for part in containers(message)):
                outgoing = self._outgoing(message)
                self._latched = message, outgoing
                impl.publish(outgoing)

    def _outgoing(self, message: Message) -> Message:
        """Return the object that rospy serializes for a message."""
        return message if has_its_provenance(message) else self._serializable(message)

    def _wrapped(self, message: Message, provenance: Optional[Provenance] = None) -> Message:
        return messages.wrap(message, self.data_class, (provenance or self._provenance)(message))


def _plain_options(args: Tuple[object, ...], kwargs: Dict[str, object]) -> Tuple[Tuple[Any, ...], Dict[str, Any]]:
    """Options as rospy takes them: a size may come from a parameter, and rospy asks for the exact type."""

    def plain(option: object) -> Any:
        return values.untracked(option) if type(option) in values.TRACKED_CLASSES else option

    return tuple(map(plain, args)), {name: plain(option) for name, option in kwargs.items()}


def has_its_provenance(message: Message) -> bool:
    """Return whether a message is sent unchanged.

    This holds for tracked types, for received bytes, and for a class instead of a message, which rospy reports.
    """
    return isinstance(message, (rospy.AnyMsg, type)) or messages.is_tracked_type(type(message))


class _Listener(rospy.SubscribeListener):
    """A listener for a publisher's peers, what it publishes to them with provenance, and each time with all of it: it
    may be for one of them only."""

    def __init__(self, listener: rospy.SubscribeListener, outgoing: Callable[[Message], Message]) -> None:
        self._listener = listener
        self._outgoing = outgoing

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[[Message], Message], peer_publish: Callable[[Message], Message]
    ) -> None:
        self._listener.peer_subscribe(
            topic_name,
            lambda message: topic_publish(self._outgoing(message)),
            lambda message: peer_publish(self._outgoing(message)),
        )

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        self._listener.peer_unsubscribe(topic_name, num_peers)


class Subscriber(rospy.Subscriber):
    """`rospy.Subscriber`, whose callback gets ordinary messages with tracked values in them.

    Args:
        name, data_class, callback, and all others: as in `rospy.Subscriber`; `data_class` may be a tracked
            type.
        keep_provenance: for subscribers that display or change messages: messages between whole ones are left out,
            so that numbers with sources always come with them.
    """

    def __init__(
        self,
        name: str,
        data_class: MessageClass,
        callback: Optional[Callable[..., Any]] = None,
        callback_args: Any = None,
        *args: Any,
        keep_provenance: bool = False,
        **kwargs: Any,
    ) -> None:
        args, kwargs = _plain_options(args, kwargs)
        if callback is not None and keep_provenance:
            callback = _leaving_out_sampled(callback)
        if callback is not None and messages.is_tracked_type(data_class):
            callback = self._unwrapping(callback)
        mend_connecting()
        reading = received_class(data_class, rospy.resolve_name(name))
        super().__init__(name, reading, callback, callback_args, *args, **kwargs)
        if data_class is not rospy.AnyMsg:
            # rospy has one reader for all subscribers of a topic in a process, plain ones too.
            read_all_with(self.impl, reading)
        MASTER_WATCH.start()

    def _unwrapping(self, callback: Callable[..., Any]) -> Callable[..., None]:
        this_thread = ThisThread()

        @functools.wraps(callback)
        def unwrapped(tracked_message: Message, *callback_args: object) -> None:
            message, found = messages.read_tracked(tracked_message)
            header = tracked_message._connection_header
            this_thread.input.take(message, found)
            message._connection_header = told(found, header, self.resolved_name)
            callback(message, *callback_args)

        return unwrapped


def _leaving_out_sampled(callback: Callable[..., Any]) -> Callable[..., None]:
    @functools.wraps(callback)
    def without_sampled(message: Message, *callback_args: object) -> None:
        if not is_sampled(message):
            callback(message, *callback_args)

    return without_sampled


def wait_for_message(topic: str, topic_type: MessageClass, timeout: Optional[float] = None) -> Message:
    """`rospy.wait_for_message`, with provenance: the next message on a topic. A message between whole ones is taken if
    no whole one comes within a second.

    Args:
        topic, timeout: as in `rospy.wait_for_message`, seconds or None.
        topic_type: an ordinary or a tracked message type.

    Raises:
        rospy.ROSException: none came within the timeout.
        rospy.ROSInterruptException: this node is being shut down.
    """
    arrived = threading.Event()
    whole: List[Message] = []
    sampled: List[Tuple[float, Message]] = []  # with the times of their arrival

    def take(message: Message) -> None:
        if is_sampled(message):
            sampled.append((time.monotonic(), message))
        else:
            whole.append(message)
            arrived.set()

    subscriber = Subscriber(topic, topic_type, take)
    try:
        end = None if timeout is None else time.monotonic() + timeout
        while not arrived.wait(0.05):
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException('rospy shutdown')
            now = time.monotonic()
            is_over = end is not None and now >= end
            if sampled and (is_over or now >= sampled[0][0] + PATIENCE):
                return sampled[0][1]
            if is_over:
                raise rospy.ROSException('timeout exceeded while waiting for message on topic ' + topic)
    finally:
        subscriber.unregister()
    return whole[0]
