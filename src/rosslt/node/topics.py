"""Publishers and subscribers that carry provenance: rospy's own, with the same arguments.

The type that is passed decides the transport: a tracked type (`PoseTracked`) travels as in the paper, an
    ordinary one (`Pose`) with its provenance in-band, behind the message. Callbacks get the ordinary message
    either way.
"""

import functools
import io
import threading
import time

import genpy
import rospy
from rospy.core import is_initialized
from rospy.msg import args_kwds_to_message

from rosslt import messages, values
from rosslt.node.carriers import Sending, carrier, reading_class, report_bad_header
from rosslt.node.latched import latch
from rosslt.node.refresh import READINGS, Refresher


class Publisher(rospy.Publisher):
    """`rospy.Publisher`, whose messages carry the provenance of the tracked values in them.

    Args:
        name, data_class, and all others: as of `rospy.Publisher`; `data_class` may be a tracked message type.
    """

    def __init__(self, name, data_class, subscriber_listener=None, *args, **kwargs):
        wraps = messages.is_tracked_type(data_class)
        self._plain_class = messages.plain_type(data_class) if wraps else data_class
        self._refresher = Refresher()
        self._carrier = self._wrapped if wraps else carrier(data_class, self._refresher)
        self._latched = None
        if subscriber_listener is not None:
            subscriber_listener = _Listener(subscriber_listener, self._carried)
        super().__init__(name, data_class, subscriber_listener, *args, **kwargs)

    def publish(self, *args, **kwds):
        """Publish a message, given as `rospy.Publisher.publish` takes it: ordinary, also where the type is
        tracked."""
        only = args[0] if len(args) == 1 and not kwds else None
        if type(only) is self._plain_class:
            message, carried = only, self._carrier(only)
        else:
            expected = self.data_class if _has_its_provenance(only) else self._plain_class
            message = args_kwds_to_message(expected, args, kwds)
            carried = self._carried(message)
        impl = self.impl
        sent = message
        is_latch = carried is not message and getattr(impl, 'is_latch', False)
        if is_latch and READINGS.replaced:
            sent = self._refresher.fresh(message)
            carried = self._carrier(sent)
        lock = getattr(impl, 'publock', None)
        if lock is None or not is_initialized():  # unregistered, closed, or too early
            super().publish(carried)
            return
        # As rospy does it, without looking again for what is known by now. What it has written of a message that cannot
        # be serialized would be sent in front of the next one.
        with lock:
            try:
                impl.publish(carried)
            except Exception as error:
                if not impl.closed:
                    impl.buff.seek(0)
                    impl.buff.truncate(0)
                if isinstance(error, (genpy.SerializationError, rospy.ROSSerializationException)):
                    raise rospy.ROSSerializationException(_fault(message, error)) from None
                raise
            if is_latch:
                self._latched = latch(self, message, sent, carried)

    def publish_again(self, latched):
        """Publish the last message of a latched publisher again, where it has become another one since.

        Args:
            latched: the Latched of the last message, if it still is.
        """
        with READINGS.lock:  # not in the middle of a change of several locations
            message = latched.changed(self._refresher)
        impl = self.impl
        lock = getattr(impl, 'publock', None)
        if message is None or lock is None:
            return
        with lock:
            # Unless another one was published meanwhile, by this or by another publisher of the topic.
            if impl.latch is latched.carried and self._latched is latched:
                latched.carried = self._carried(message)
                impl.publish(latched.carried)

    def _carried(self, message):
        """What rospy gets in place of a message."""
        return message if _has_its_provenance(message) else self._carrier(message)

    def _wrapped(self, message):
        if READINGS.replaced:
            message = self._refresher.fresh(message)
        return messages.wrap(message, self.data_class, Sending.full_history)


def _fault(message, error):
    """What is wrong with a message. genpy looks for the culprit by exact types, and would blame a tracked value."""
    try:
        values.untracked(message).serialize(io.BytesIO())
    except genpy.SerializationError as found:
        return str(found)
    return str(error)


def _has_its_provenance(message):
    """Whether a message is to be sent as it is: of a tracked type, or bytes that were received."""
    return isinstance(message, rospy.AnyMsg) or messages.is_tracked_type(type(message))


class _Listener(rospy.SubscribeListener):
    """A listener for a publisher's peers, what it publishes to them carried as what the publisher does."""

    def __init__(self, listener, carried):
        self._listener = listener
        self._carried = carried

    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        self._listener.peer_subscribe(
            topic_name,
            lambda message: topic_publish(self._carried(message)),
            lambda message: peer_publish(self._carried(message)),
        )

    def peer_unsubscribe(self, topic_name, num_peers):
        self._listener.peer_unsubscribe(topic_name, num_peers)


class Subscriber(rospy.Subscriber):
    """`rospy.Subscriber`, whose callback gets ordinary messages with tracked values in them.

    Args:
        name, data_class, callback, and all others: as of `rospy.Subscriber`; `data_class` may be a tracked
            type.
    """

    def __init__(self, name, data_class, callback=None, callback_args=None, *args, **kwargs):
        if callback is not None and messages.is_tracked_type(data_class):
            callback = self._unwrapping(callback)
        super().__init__(
            name, reading_class(data_class, rospy.resolve_name(name)), callback, callback_args, *args, **kwargs
        )
        if data_class is not rospy.AnyMsg:
            _read_in_band(self.impl, data_class)

    def _unwrapping(self, callback):
        @functools.wraps(callback)
        def unwrapped(tracked_message, *callback_args):
            try:
                message = messages.unwrap(tracked_message)
            except messages.BadHeader as error:
                report_bad_header(self.resolved_name, tracked_message._connection_header, error)
                message = tracked_message.data
            message._connection_header = tracked_message._connection_header
            callback(message, *callback_args)

        return unwrapped


def wait_for_message(topic, topic_type, timeout=None):
    """`rospy.wait_for_message`, with provenance: the next message on a topic.

    Args:
        topic, timeout: as of `rospy.wait_for_message`, seconds or None.
        topic_type: an ordinary or a tracked message type.

    Raises:
        rospy.ROSException: none came within the timeout.
        rospy.ROSInterruptException: this node is being shut down.
    """
    arrived, box = threading.Event(), []

    def take(message):
        box.append(message)
        arrived.set()

    subscriber = Subscriber(topic, topic_type, take)
    try:
        end = None if timeout is None else time.monotonic() + timeout
        while not arrived.wait(0.05):
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException('rospy shutdown')
            if end is not None and time.monotonic() >= end:
                raise rospy.ROSException('timeout exceeded while waiting for message on topic ' + topic)
    finally:
        subscriber.unregister()
    return box[0]


def _read_in_band(impl, data_class):
    """Have a topic that is already subscribed to in this process, by plain rospy perhaps, be read with
    provenance.

    rospy has one reader for all subscribers of a topic in a process. Tracked values are plain values to those
    who do not know of them.
    """
    reading = reading_class(data_class, impl.resolved_name)
    impl.data_class = reading
    with impl.c_lock:
        for connection in impl.connections:
            connection.protocol.recv_data_class = reading
