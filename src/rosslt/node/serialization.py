"""Makes rospy append provenance to the messages that it serializes, and read it from those that it deserializes."""

import functools
import io
import threading
from typing import Any, BinaryIO, Callable, Dict, Set, Tuple

import genpy
import rospy

from rosslt import messages, values
from rosslt.node.refresh import READINGS, Refresher

#: The topics and services, each with a peer, of which a bad header was reported.
_reported: Set[Tuple[str, str]] = set()


class Sending:
    """Settings of the provenance that this node sends.

    Attributes:
        full_history: complete expressions, for explaining, instead of what they come to.
        rate: how many messages of one thing are whole in a second, at most.
    """

    full_history = False
    rate = DEFAULT_RATE = 20.0

    #: The parameters that set these.
    NAMES = frozenset(('history', 'rate'))

    @classmethod
    def set(cls, name: str, value: Any) -> str:
        """Take the value of one of its parameters, `{}` where that was deleted.

        Returns:
            What is wrong with the value, '' where nothing is.
        """
        if name == 'rate':
            is_rate = isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0
            cls.rate = float(value) if is_rate else cls.DEFAULT_RATE
            return '' if is_rate or value == {} else f'{value!r:.200} instead of a rate in Hz: taken for {cls.rate:g}'
        cls.full_history = value == 'full'
        if value in ('full', 'folded', {}):
            return ''
        return f"{value!r:.200} instead of 'full' or 'folded': taken for 'folded'"


Provenance = Callable[[Any], bytes]
"""Gives the provenance of a message that is sent now, b'' where it is sent plain."""


def whole_provenance(message: Any) -> bytes:
    """The provenance of a message that is always whole."""
    return messages.provenance_to_send(message, Sending.full_history)


def serializer(
    message_class: Any, refresher: Refresher, provenance: Provenance = whole_provenance
) -> Callable[[Any], Any]:
    """Make the function that wraps a message for rospy, which then serializes it followed by its provenance.

    Args:
        message_class: of the messages.
        refresher: the Refresher of the publisher, service or caller that sends them.
        provenance: what gives the provenance of each.
    """
    if message_class is rospy.AnyMsg:
        return lambda message: message  # with the provenance that it was received with
    make = functools.partial(_class_with_provenance(message_class), refresher, provenance)
    check = messages.plain_check(message_class)
    if check is None:
        return make
    is_plain = check

    def outgoing(message: Any) -> Any:
        try:
            return message if is_plain(message) else make(message)
        except AttributeError:
            return message  # rospy says which field is wrong when it serializes it

    return outgoing


@functools.lru_cache(maxsize=None)
def _class_with_provenance(message_class: Any) -> Any:
    class WithProvenance(genpy.Message):
        __slots__ = ('message', 'provenance', 'refresher')
        _type, _md5sum = message_class._type, message_class._md5sum
        _has_header = message_class._has_header

        def __init__(self, refresher: Refresher, provenance: Provenance, message: Any) -> None:
            self.message = message
            self.refresher = refresher
            self.provenance = provenance

        @property
        def header(self) -> Any:
            return self.message.header

        def serialize(self, buff: BinaryIO) -> None:
            message = self.message
            if READINGS.replaced:
                message = self.refresher.fresh(message)
            try:
                pack(message).serialize(buff)
            except genpy.SerializationError as error:
                raise genpy.SerializationError(serialization_fault(message, error)) from None
            messages.append_provenance(message, buff, self.provenance(message))

    pack = messages.packed_arrays(message_class)
    return WithProvenance


class _Before(threading.local):
    """The message before, and its bytes: rospy reads what comes from each publisher in a thread of its own."""

    data = b''
    message: Any = None


@functools.lru_cache(maxsize=None)
def received_class(message_class: Any, channel: str, shares: bool = False) -> Any:
    """A class that rospy deserializes instead of a message's class.

    What comes out is an ordinary message, whose fields are tracked where provenance follows it. A tracked
    type is read as it is, and unwrapped for each callback; AnyMsg keeps the provenance in its bytes.

    Args:
        message_class: of the message.
        channel: the resolved name of the topic or service.
        shares: whether a message of the same bytes as the one before has the very objects of that in it.
    """
    if message_class is rospy.AnyMsg or messages.is_tracked_type(message_class):
        return message_class

    def deserialize(message: Any, data: bytes) -> Any:
        message.__class__ = message_class  # another message would take 0.8 us for a Pose, 6.6 for an Odometry
        if shares and data == before.data:
            for name in message.__slots__:
                setattr(message, name, getattr(before.message, name))
            return message
        error = decode_into(message, data)
        if error is not None:
            message._connection_header = error
            message.__class__ = untold
        elif shares:
            before.data, before.message = data, message
        return message

    def tell(message: Any, connection_header: Dict[str, str]) -> None:
        error = genpy.Message._connection_header.__get__(message)
        message.__class__ = message_class
        message._connection_header = connection_header
        report_bad_header(channel, connection_header, error)

    decode_into, before = messages.decoder(message_class), _Before()
    # Of a message with a bad header, until rospy says from whom it came, the next it does. Only then it can be told.
    untold = type(
        message_class.__name__,
        (message_class,),
        {'__slots__': (), '__module__': message_class.__module__, '_connection_header': property(fset=tell)},
    )
    # rospy asks for a class that is of type `type`, with the fields of the message.
    return type(
        message_class.__name__,
        (message_class,),
        {'__slots__': (), '__module__': message_class.__module__, 'deserialize': deserialize},
    )


def serialization_fault(message: Any, error: Exception) -> str:
    """Return the fault of a message; genpy, which compares exact types, would name a tracked value instead."""
    try:
        values.untracked(message).serialize(io.BytesIO())
    except genpy.SerializationError as found:
        return str(found)
    return str(error)


def report_bad_header(channel: str, connection_header: Dict[str, str], error: Exception) -> None:
    """Warn of provenance that cannot be read, once for each publisher or caller.

    Args:
        channel: the resolved name of the topic or service.
        connection_header: of the message; says from whom it came.
        error: the BadHeader.
    """
    peer = connection_header.get('callerid', 'a peer')
    if (channel, peer) not in _reported:
        _reported.add((channel, peer))
        rospy.logwarn(
            '%s sends a provenance on %s that cannot be read, its messages arrive untracked: %s', peer, channel, error
        )
