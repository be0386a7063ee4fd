"""In-band provenance: bytes behind a serialized message, which plain subscribers ignore.

genpy and roscpp read the fields that a type has and ignore what follows. What follows is the provenance, its length in
four bytes, and MAGIC. Any message may end in bytes that look like that, so the fields are walked as well: there is a
provenance only if the fields end exactly where it would begin.
"""

import functools
import logging
import struct
from typing import Any, BinaryIO, Callable, NamedTuple, Optional, Tuple, Union

from rosslt.messages.codec import NO_READINGS, Readings, attach, encode
from rosslt.messages.errors import BadHeader
from rosslt.messages.fields import Message, MessageClass
from rosslt.messages.tracked_types import is_tracked_type
from rosslt.messages.walkers import walkers
from rosslt.values import untracked

MAGIC = b'rSLT'

_FOOTER = struct.Struct('<I4s')
_LENGTH = struct.Struct('<I')


def append_provenance(message: Message, buff: BinaryIO, provenance: Optional[bytes] = None) -> None:
    """Write the provenance of a message behind it; nothing, if no leaf is tracked.

    Args:
        message: an ordinary message, which was just serialized into `buff`.
        buff: where rospy gathers what it sends.
        provenance: as `encode` gave it, b'' for none; by default it is encoded now.
    """
    data = encode(message) if provenance is None else provenance
    if data:
        buff.write(data + _FOOTER.pack(len(data), MAGIC))


Found = Union[None, Readings, BadHeader]
"""The provenance that came with a message: None for none, NO_READINGS for a message between whole ones, the error if
it cannot be read."""


class Decoded(NamedTuple):
    """A decoded message and the fault in its provenance, if any."""

    message: Message
    """The ordinary message, with tracked leaves if it came with a provenance."""
    error: Optional[BadHeader]
    """The fault in its provenance, or None. With a fault, the message is untracked."""
    is_sampled: bool
    """True for a message that was sent plain between whole ones, although a leaf of it is tracked."""


def decode(data: bytes, message_class: type) -> Decoded:
    """Decode a serialized message, ordinary or of a tracked type, with the provenance that came with it.

    Topics, services, bags and the command decode all messages with it.

    Args:
        data: as received.
        message_class: the class of the message on the wire.

    Raises:
        genpy.DeserializationError: the message itself cannot be read.
    """
    message: Message = message_class()
    if is_tracked_type(message_class):
        message, found = read_tracked(message.deserialize(data))
    else:
        found = decoder(message_class)(message, data)
    return Decoded(message, found if isinstance(found, BadHeader) else None, found is NO_READINGS)


@functools.lru_cache(maxsize=None)
def decoder(message_class: MessageClass) -> Callable[[Any, bytes], Found]:
    """A function that decodes into a message object that is there already.

    Returns:
        `decode_into(message, data)`: fills an ordinary message of that class from data, and returns what was found
        behind it.
    """
    deserialize, find = message_class.deserialize, finder(message_class)

    def decode_into(message: Message, data: bytes) -> Found:
        deserialize(message, data)  # which ignores what follows the fields
        if not data.endswith(MAGIC):
            return None
        try:
            found = find(data)
            return None if found is None else attach(message, found)
        except BadHeader as error:
            return error
        except Exception as error:
            # The stream must go on after any exception: rospy would try the same data again for ever.
            deserialize(message, data)
            return unexpected(error)

    return decode_into


def read_tracked(tracked_message: Message) -> Tuple[Any, Found]:
    """The ordinary message of one of a tracked type, with the provenance in its header on its leaves, and that."""
    message = tracked_message.data
    try:
        return message, attach(message, tracked_message.provenance.data)
    except BadHeader as error:
        return message, error
    except Exception as error:
        return untracked(message), unexpected(error)


def unexpected(error: Exception) -> BadHeader:
    """An unexpected exception while reading provenance, as the error to report."""
    logging.getLogger(__name__).debug('in reading a provenance', exc_info=error)
    return BadHeader('bad provenance: reading it failed with %s: %s' % (type(error).__name__, error))


def split_provenance(data: bytes, message_class: type) -> Tuple[bytes, bytes]:
    """A serialized message and the provenance behind it, b'' if there is none.

    Args:
        data: as received.
        message_class: its type.
    """
    found = finder(message_class)(data) if data.endswith(MAGIC) else None
    if not found:
        return data, b''
    return data[: len(data) - _FOOTER.size - len(found)], found


@functools.lru_cache(maxsize=None)
def finder(message_class: MessageClass) -> Callable[[bytes], Optional[bytes]]:
    """A function that finds the provenance behind a serialized message, or the reference to one.

    Returns:
        `find(data)`, for data that ends with MAGIC: what is between the message and the footer, or None
        if these bytes are part of the message.
    """
    walks = walkers(message_class)
    size, end = walks.layout.size(walks.layout.name), walks.end
    length_at = _LENGTH.unpack_from

    def find(data: bytes) -> Optional[bytes]:
        footer = len(data) - _FOOTER.size
        try:
            start = footer - length_at(data, footer)[0]
            if start < 0 or start != (end(data, 0, len(data)) if size is None else size):
                return None
        except struct.error:
            return None
        return data[start:footer]

    return find
