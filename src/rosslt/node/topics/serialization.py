"""Makes rospy append provenance to the messages that it serializes, and read it from those that it deserializes."""

import functools
import io
import threading
from typing import Any, BinaryIO, Callable, Dict, Hashable, Set, Tuple

import genpy
import rospy

from rosslt import messages, values
from rosslt.messages import BadHeader, Message, MessageClass
from rosslt.node.memory.remembered import MEMORY

#: The topics and services, each with a peer, of which a bad header was reported.
_reported: Set[Tuple[str, str]] = set()


class Sending:
    """Settings of the provenance that this node sends.

    Attributes:
        full_history: complete expressions, for explaining, instead of folded ones.
        rate: how many messages of one thing are whole in a second, at most.
        hold: called with a tracked number that a field for whole numbers has, and the least and the greatest one that
            the field holds.
    """

    full_history = False
    rate = DEFAULT_RATE = 100.0
    hold: Any = staticmethod(lambda _value, _least, _greatest: None)

    #: The parameters that set these.
    NAMES = frozenset(('history', 'rate'))

    @classmethod
    def set(cls, name: str, value: object) -> str:
        """Take the value of one of its parameters, `{}` if that was deleted.

        Returns:
            What is wrong with the value, '' if nothing is.
        """
        if name == 'rate':
            is_rate = isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0
            cls.rate = float(value) if isinstance(value, (int, float)) and is_rate else cls.DEFAULT_RATE
            return '' if is_rate or value == {} else f'{value!r:.200} instead of a rate in Hz: taken for {cls.rate:g}'
        cls.full_history = value == 'full'
        if value in ('full', 'folded', {}):
            return ''
        return f"{value!r:.200} instead of 'full' or 'folded': taken for 'folded'"


Provenance = Callable[[Message], bytes]
"""Gives the provenance of a message that is sent now, b'' if it is sent plain."""


def whole_provenance(message: Message) -> bytes:
    """The provenance of a message that is always whole."""
    return messages.encode(message, Sending.full_history)


def serializer(
    message_class: MessageClass,
    provenance: Provenance = whole_provenance,
    is_recorded: Callable[[], bool] = lambda: True,
) -> Callable[[Message], Message]:
    """Make the function that wraps a message for rospy, which then serializes it followed by its provenance.

    Args:
        message_class: of the messages.
        provenance: what gives the provenance of each.
        is_recorded: whether a message without provenance has none, as all that it was computed of was recorded.
    """
    if message_class is rospy.AnyMsg:
        return lambda message: message  # with the provenance that it was received with
    make = functools.partial(_class_with_provenance(message_class), provenance)
    if messages.has_arrays(message_class):
        return make  # to look for tracked leaves takes as long as to collect them

    def outgoing(message: Message) -> Message:
        try:
            return make(message) if not is_recorded() or messages.has_tracked_leaf(message) else message
        except AttributeError:
            return message  # rospy says which field is wrong when it serializes it

    return outgoing


@functools.lru_cache(maxsize=None)
def _class_with_provenance(message_class: MessageClass) -> Any:
    class WithProvenance(genpy.Message):
        __slots__ = ('message', 'provenance')
        _type, _md5sum = message_class._type, message_class._md5sum
        _has_header = message_class._has_header

        def __init__(self, provenance: Provenance, message: Message) -> None:
            self.message = message
            self.provenance = provenance

        @property
        def header(self) -> Any:
            return self.message.header

        def serialize(self, buff: BinaryIO) -> None:
            message = self.message
            for read, least, greatest in whole_numbers:
                if type(read(message)) in values.TRACKED_CLASSES:
                    Sending.hold(read(message), least, greatest)
            try:
                pack(message).serialize(buff)
            except genpy.SerializationError as error:
                raise genpy.SerializationError(serialization_fault(message, error)) from None
            messages.append_provenance(message, buff, self.provenance(message))

    pack, whole_numbers = messages.packed_arrays(message_class), messages.whole_numbers(message_class)
    return WithProvenance


class Input:
    """The messages of one publisher, as one thread of this process reads them."""

    def __init__(self) -> None:
        # {thing: (its readings, its form)}
        self._last: Dict[Hashable, Tuple[messages.Readings, Tuple[Hashable, ...]]] = {}

    def take(self, message: Message, found: messages.Found) -> None:
        """Note the provenance that came with a message, or have the leaves of a sampled message depend on `UNKNOWN`.

        These are the leaves that had provenance in the last whole message of the same thing and form; all leaves if
        there was none.

        Args:
            message: as it was read.
            found: what came with it.
        """
        if not isinstance(found, messages.Readings):
            return
        thing, form = messages.thing_of(message), messages.form_of(message)
        last, last_form = self._last.get(thing, (messages.NO_READINGS, None))
        if found is messages.NO_READINGS:
            messages.make_unknown(message, last.leaves if form == last_form else None)
            return
        if last.sources == found.sources and last.values != found.values:
            MEMORY.changes += 1
        if len(self._last) >= messages.MOST_THINGS:
            self._last.clear()
        self._last[values.untracked(thing)] = found, values.untracked(form)


class ThisThread(threading.local):
    """The input that a thread reads: rospy reads what comes from each publisher in a thread of its own."""

    def __init__(self) -> None:
        self.input = Input()


#: The key in the connection header of a message that came between whole ones.
SAMPLED_KEY = 'rosslt_sampled'


def is_sampled(message: Message) -> bool:
    """Return whether a received message came between whole ones: a leaf of it is tracked where it was published."""
    return SAMPLED_KEY in (message._connection_header or ())


@functools.lru_cache(maxsize=None)
def received_class(message_class: MessageClass, channel: str) -> Any:
    """A class that rospy deserializes instead of a message's class.

    What comes out is an ordinary message, whose fields are tracked if provenance follows it. A tracked
    type is read as it is, and unwrapped for each callback; AnyMsg keeps the provenance in its bytes.

    Args:
        message_class: of the message.
        channel: the resolved name of the topic or service.
    """
    if message_class is rospy.AnyMsg or messages.is_tracked_type(message_class):
        return message_class

    def deserialize(message: Message, data: bytes) -> Message:
        message.__class__ = message_class  # another message would take 0.8 us for a Pose, 6.6 for an Odometry
        found = decode_into(message, data)
        if found is None:
            return message
        this_thread.input.take(message, found)
        if found is messages.NO_READINGS or isinstance(found, BadHeader):
            message._connection_header = found
            message.__class__ = untold
        return message

    def tell(message: Message, connection_header: Dict[str, str]) -> None:
        found = genpy.Message._connection_header.__get__(message)
        message.__class__ = message_class
        message._connection_header = told(found, connection_header, channel)

    decode_into, this_thread = messages.decoder(message_class), ThisThread()
    # The class of a message until rospy says, the next it does, from whom it came.
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


def told(found: messages.Found, connection_header: Dict[str, str], channel: str) -> Dict[str, str]:
    """The connection header of a message with what its readers need to know of its provenance; faults are reported."""
    if found is messages.NO_READINGS:
        return {**connection_header, SAMPLED_KEY: '1'}
    if isinstance(found, BadHeader):
        report_bad_header(channel, connection_header, found)
    return connection_header


def serialization_fault(message: Message, error: Exception) -> str:
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
