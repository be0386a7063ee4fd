"""Messages with their provenance, from topics and from bags, whatever their type."""

import contextlib
import queue
import sys
import threading
import time
from collections import namedtuple

import genpy.dynamic
import roslib.message
import rospy

from rosslt import messages, node
from rosslt.cli.failure import Failure

Received = namedtuple('Received', 'topic publisher type message')
Received.__doc__ = """A message with tracked leaves, whichever way it came: the topic, the publishing node ('' where
that was not recorded), the type on the wire, the message."""

#: How often one who waits looks whether the node is being shut down, in seconds.
_SHUTDOWN_CHECK_PERIOD = 0.1

#: How many messages wait to be read before their publishers have to.
_BACKLOG = 100


class Decoder:
    """Decodes serialized messages; provenance that cannot be read is reported once a topic and publisher."""

    def __init__(self):
        self._reported = set()
        self._classes = {}
        self._lock = threading.Lock()

    def message_class(self, type_, md5sum, definition):
        """The class of a type, made from its definition where it is not installed as it was sent."""
        with self._lock:
            if (type_, md5sum) not in self._classes:
                found = roslib.message.get_message_class(type_)
                if found is None or found._md5sum != md5sum:
                    found = genpy.dynamic.generate_dynamic(type_, definition)[type_]
                self._classes[type_, md5sum] = found
            return self._classes[type_, md5sum]

    def decode(self, data, message_class, topic, publisher=''):
        """The Received that serialized data is."""
        message = message_class()
        try:
            if messages.is_tracked_type(message_class):
                tracked = message.deserialize(data)
                message = tracked.data
                messages.unwrap(tracked)
            else:
                plain, provenance = messages.split_provenance(data, message_class)
                message.deserialize(plain)
                if provenance:
                    messages.attach(message, provenance)
        except messages.BadHeader as error:
            if (topic, publisher) not in self._reported:
                self._reported.add((topic, publisher))
                print(
                    f'rosslt: {publisher or topic} sends a provenance on {topic} that cannot be read: {error}',
                    file=sys.stderr,
                )
        return Received(topic, publisher, message_class._type, message)


class Inbox:
    """The messages of topics as they come, for a node that owns nothing.

    Args:
        topics: their full names.
    """

    def __init__(self, topics):
        self._queue = queue.Queue(_BACKLOG)
        self._decoder = Decoder()
        if not node.is_initialized():
            # without arguments, as private parameters among them would be left behind
            rospy.init_node('rosslt', anonymous=True, disable_rosout=True, argv=[])
        self._subscribers = [rospy.Subscriber(topic, rospy.AnyMsg, self._take, topic) for topic in topics]

    def _take(self, message, topic):
        header = message._connection_header
        message_class = self._decoder.message_class(header['type'], header['md5sum'], header['message_definition'])
        self._queue.put(self._decoder.decode(message._buff, message_class, topic, header['callerid']))

    def next(self, timeout=None):
        """The next Received.

        Args:
            timeout: seconds, or None to wait for as long as it takes.

        Raises:
            Failure: none came in time.
            KeyboardInterrupt: this process shall end.
        """
        received = self._get(None if timeout is None else time.monotonic() + timeout)
        if received is None:
            raise Failure(f'no message within {timeout:g} s')
        return received

    def during(self, seconds):
        """The Received of that time, as they come."""
        end = time.monotonic() + seconds
        yield from iter(lambda: self._get(end), None)

    def _get(self, end):
        while end is None or time.monotonic() < end:
            left = _SHUTDOWN_CHECK_PERIOD if end is None else max(0.0, end - time.monotonic())
            with contextlib.suppress(queue.Empty):
                return self._queue.get(timeout=min(left, _SHUTDOWN_CHECK_PERIOD))
            if rospy.is_shutdown():
                # rospy keeps an interrupt for itself
                raise KeyboardInterrupt
        return None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for subscriber in self._subscribers:
            subscriber.unregister()
