"""What rospy serializes and deserializes in place of ordinary messages, so that provenance travels behind them."""

import functools
import io
import threading
from typing import Any, BinaryIO, Callable, ClassVar, Dict, Optional, Set, Tuple

import genpy
import rospy

from rosslt import messages, values
from rosslt.node.refresh import READINGS, Refresher

#: The topics and services, each with a peer, of which a bad header was reported.
_reported: Set[Tuple[str, str]] = set()


class Sending:
    """How this node sends provenance.

    Attributes:
        full_history: complete expressions, for explaining, instead of what they come to.
        only_changes: by reference to an earlier message, as far as that says the same.
    """

    full_history = False
    only_changes = False

    #: The parameters that set these: {name: (attribute, the word that sets it, the one that does not)}.
    WORDS: ClassVar[Dict[str, Tuple[str, str, str]]] = {
        'history': ('full_history', 'full', 'folded'),
        'provenance': ('only_changes', 'changes', 'full'),
    }

    @classmethod
    def set(cls, name: str, value: Any) -> str:
        """Take the value of one of its parameters, `{}` where that was deleted.

        Returns:
            What is wrong with the value, '' where nothing is.
        """
        attribute, word, otherwise = cls.WORDS[name]
        setattr(cls, attribute, value == word)
        if value in (word, otherwise, {}):
            return ''
        return f'{value!r:.200} instead of {word!r} or {otherwise!r}: taken for {otherwise!r}'


Provenance = Callable[[Any, bool], bytes]
"""Gives the provenance of a message, as `messages.provenance_to_send` does."""


def serializer(
    message_class: Any,
    refresher: Refresher,
    provenance: Provenance = messages.provenance_to_send,
    announcer: Optional[messages.Announcer] = None,
) -> Callable[[Any], Any]:
    """The function that makes of a message what rospy serializes in its place: the message, then its provenance.

    Args:
        message_class: of the messages.
        refresher: the Refresher of the publisher, service or caller that sends them.
        provenance: what gives the provenance of each.
        announcer: the one of the publisher that sends them to all who have subscribed; None for others, which send all
            of it each time.
    """
    if message_class is rospy.AnyMsg:
        return lambda message: message  # with the provenance that it was received with
    make = functools.partial(_class_with_provenance(message_class), refresher, provenance, announcer)
    is_plain = messages.plain_check(message_class)
    if is_plain is None or provenance is not messages.provenance_to_send:
        return make
    return lambda message: message if is_plain(message) else make(message)


@functools.lru_cache(maxsize=None)
def _class_with_provenance(message_class: Any) -> Any:
    class WithProvenance(genpy.Message):
        __slots__ = ('announcer', 'message', 'provenance', 'refresher')
        _type, _md5sum = message_class._type, message_class._md5sum
        _has_header = message_class._has_header

        def __init__(
            self, refresher: Refresher, provenance: Provenance, announcer: Optional[messages.Announcer], message: Any
        ) -> None:
            self.message = message
            self.announcer = announcer
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
            announcer = self.announcer if Sending.only_changes else None
            messages.append_provenance(message, buff, Sending.full_history, self.provenance, announcer)

    pack = messages.packed_arrays(message_class)
    return WithProvenance


class _Sharing(threading.local):
    """A SharingDecoder for each publisher: rospy reads what comes from each in a thread of its own."""

    def __init__(self, message_class: Any) -> None:
        self._decode_into = messages.SharingDecoder(message_class).decode_into

    def decode_into(self, message: Any, data: bytes) -> Optional[messages.BadHeader]:
        return self._decode_into(message, data)


@functools.lru_cache(maxsize=None)
def received_class(message_class: Any, channel: str, shares: bool = False) -> Any:
    """A class that rospy deserializes in place of a message's.

    What comes out is an ordinary message, whose fields are tracked where provenance follows it. A tracked
    type is read as it is, and unwrapped for each callback; AnyMsg keeps the provenance in its bytes.

    Args:
        message_class: of the message.
        channel: the resolved name of the topic or service.
        shares: whether messages have in them what is the same as in the one before, as of `messages.SharingDecoder`.
    """
    if message_class is rospy.AnyMsg or messages.is_tracked_type(message_class):
        return message_class

    def deserialize(message: Any, data: bytes) -> Any:
        message.__class__ = message_class  # another message would take 0.8 us for a Pose, 6.6 for an Odometry
        error = decode_into(message, data)
        if error is not None and not isinstance(error, messages.UnknownOutline):
            message._connection_header = error
            message.__class__ = untold
        return message

    def tell(message: Any, connection_header: Dict[str, str]) -> None:
        error = genpy.Message._connection_header.__get__(message)
        message.__class__ = message_class
        message._connection_header = connection_header
        report_bad_header(channel, connection_header, error)

    decode_into = _Sharing(message_class).decode_into if shares else messages.decoder(message_class)
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
    """What is wrong with a message. genpy compares exact types and would name a tracked value instead."""
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
