"""What rospy serializes and reads in place of ordinary messages, so that provenance travels behind them."""

import functools
import threading

import genpy
import rospy

from rosslt import messages

#: Headers that this thread has found to be bad since it last ran a callback. rospy deserializes and calls
#: back in one thread for each connection, and only the callback knows from whom the message comes.
_found = threading.local()


class Sending:
    """How this node sends provenance.

    Attributes:
        full_history: complete expressions, for explaining, instead of what they come to.
    """

    full_history = False


@functools.lru_cache(maxsize=None)
def carrier_class(message_class):
    """A class that rospy serializes in place of a message: the message, then its provenance."""

    class Carrier(genpy.Message):
        __slots__ = ('message',)
        _type, _md5sum = message_class._type, message_class._md5sum
        _has_header = message_class._has_header

        def __init__(self, message):
            self.message = message

        @property
        def header(self):
            return self.message.header

        def serialize(self, buff):
            self.message.serialize(buff)
            messages.append_provenance(self.message, buff, Sending.full_history)

    return Carrier


@functools.lru_cache(maxsize=None)
def reading_class(message_class):
    """A class that rospy deserializes in place of a message's.

    What comes out is an ordinary message, whose fields are tracked where provenance follows it. A tracked
    type is read as it is, and unwrapped for each callback.
    """
    if messages.is_tracked_type(message_class):
        return message_class

    def deserialize(message, data):
        plain, provenance = messages.split_provenance(data, message_class)
        message_class.deserialize(message, plain)
        message.__class__ = message_class    # cheaper than making another one
        if provenance:
            try:
                messages.attach(message, provenance)
            except messages.BadHeader as error:
                _found.__dict__.setdefault('errors', []).append(error)
        return message

    # rospy asks for a class that is of type `type`, with the fields of the message.
    return type(message_class.__name__, (message_class,), {
        '__slots__': (), '__module__': message_class.__module__, 'deserialize': deserialize})


class BadHeaders:
    """Warns of provenance that cannot be read, once for each publisher or caller.

    Args:
        channel: the name of the topic or service.
    """

    def __init__(self, channel):
        self._channel = channel
        self._known = set()

    def report_found(self, message):
        """Report what this thread found while it read messages from where `message` comes from."""
        while getattr(_found, 'errors', None):
            self.report(message, _found.errors.pop())

    def report(self, message, error):
        """Report a bad header of `message`."""
        peer = (getattr(message, '_connection_header', None) or {}).get('callerid', 'a peer')
        if peer not in self._known:
            self._known.add(peer)
            rospy.logwarn('%s sends a provenance on %s that cannot be read, its messages arrive untracked: '
                          '%s', peer, self._channel, error)
