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
from rospy.msg import args_kwds_to_message

from rosslt import messages, values
from rosslt.node.carriers import BadHeaders, Sending, carrier_class, reading_class


class Publisher(rospy.Publisher):
    """`rospy.Publisher`, whose messages carry the provenance of the tracked values in them.

    Args:
        name, data_class, and all others: as of `rospy.Publisher`; `data_class` may be a tracked message type.
    """

    def __init__(self, name, data_class, *args, **kwargs):
        super().__init__(name, data_class, *args, **kwargs)
        self._wraps = messages.is_tracked_type(data_class)
        self._plain_class = messages.plain_type(data_class) if self._wraps else data_class
        self._carrier = None if self._wraps else carrier_class(data_class)

    def publish(self, *args, **kwds):
        """Publish a message, given as `rospy.Publisher.publish` takes it: ordinary, also where the type is
        tracked."""
        if self.impl is None or (self._wraps and len(args) == 1 and messages.is_tracked_type(type(args[0]))):
            super().publish(*args, **kwds)
            return
        if len(args) == 1 and type(args[0]) is self._plain_class:
            message = args[0]
        else:
            message = args_kwds_to_message(self._plain_class, args, kwds)
        try:
            if self._wraps:
                super().publish(messages.wrap(message, self.data_class, Sending.full_history))
            else:
                super().publish(self._carrier(message))
        except rospy.ROSSerializationException:
            # genpy looks for the culprit by exact types, and would blame a tracked value: let it look again.
            try:
                values.untracked(message).serialize(io.BytesIO())
            except genpy.SerializationError as error:
                raise rospy.ROSSerializationException(str(error)) from None
            raise


class Subscriber(rospy.Subscriber):
    """`rospy.Subscriber`, whose callback gets ordinary messages with tracked values in them.

    Args:
        name, data_class, callback, and all others: as of `rospy.Subscriber`; `data_class` may be a tracked
            type.
    """

    def __init__(self, name, data_class, callback=None, callback_args=None, *args, **kwargs):
        self._bad_headers = BadHeaders(rospy.resolve_name(name))
        if callback is not None:
            callback = self._unwrapping(callback) if messages.is_tracked_type(data_class) \
                else self._reporting(callback)
        super().__init__(name, reading_class(data_class), callback, callback_args, *args, **kwargs)
        _read_in_band(self.impl, data_class)

    def _unwrapping(self, callback):
        @functools.wraps(callback)
        def unwrapped(tracked_message, *callback_args):
            try:
                message = messages.unwrap(tracked_message)
            except messages.BadHeader as error:
                self._bad_headers.report(tracked_message, error)
                message = tracked_message.data
            message._connection_header = tracked_message._connection_header
            callback(message, *callback_args)
        return unwrapped

    def _reporting(self, callback):
        @functools.wraps(callback)
        def reported(message, *callback_args):
            self._bad_headers.report_found(message)
            callback(message, *callback_args)
        return reported


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
    reading = reading_class(data_class)
    impl.data_class = reading
    with impl.c_lock:
        for connection in impl.connections:
            connection.protocol.recv_data_class = reading
