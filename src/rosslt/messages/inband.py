"""In-band provenance: bytes behind a serialized message, which plain subscribers ignore.

genpy and roscpp read the fields that a type has and ignore what follows. What follows is the provenance, its length in
four bytes, and MAGIC; or a reference to a provenance that was sent before, its length, and REFERENCE. Any message may
end in bytes that look like that, so the fields are walked as well: there is a provenance only if the fields end exactly
where it would begin.
"""

import functools
import logging
import struct
from typing import Any, BinaryIO, Callable, NamedTuple, Optional, Tuple

from rosslt.messages.codec import OUTLINES, Announcer, attach, provenance_to_send
from rosslt.messages.codegen.leaf_access import leaf_readers
from rosslt.messages.codegen.walkers import walkers
from rosslt.messages.errors import BadHeader
from rosslt.messages.tracked_types import is_tracked_type, unwrap
from rosslt.values import untracked

MAGIC = b'rSLT'
REFERENCE = b'rSLR'

_BOTH = MAGIC, REFERENCE

_FOOTER = struct.Struct('<I4s')
_LENGTH = struct.Struct('<I')


def append_provenance(
    message: Any,
    buff: BinaryIO,
    full_history: bool = False,
    provenance: Callable[[Any, bool], bytes] = provenance_to_send,
    announcer: Optional[Announcer] = None,
) -> None:
    """Write the provenance of a message behind it; nothing, where no leaf is tracked.

    Args:
        message: an ordinary message, which was just serialized into `buff`.
        buff: where rospy gathers what it sends.
        full_history: as of `encode`.
        provenance: what gives it, as `provenance_to_send` does.
        announcer: what gives a reference in its place now and then; None where it is always written in full.
    """
    data = provenance(message, full_history)
    if data:
        reference = announcer.reference(data) if announcer is not None else b''
        if reference:
            buff.write(reference + _FOOTER.pack(len(reference), REFERENCE))
        else:
            buff.write(data + _FOOTER.pack(len(data), MAGIC))


def plain_check(message_class: type) -> Optional[Callable[[Any], bool]]:
    """A function that tells whether a message has no tracked leaf, so that nothing has to be appended.

    Returns:
        `is_plain(message)`; None for a class with arrays, where the check takes as long as appending.
    """
    found = leaf_readers(message_class)
    return found.is_plain if found else None


class Decoded(NamedTuple):
    """What a serialized message was decoded to."""

    message: Any
    """The ordinary message, with tracked leaves where it came with a provenance."""
    error: Optional[BadHeader]
    """The fault in its provenance, or None. With a fault, the message is untracked."""


def decode(data: bytes, message_class: type) -> Decoded:
    """Decode a serialized message, ordinary or of a tracked type, with the provenance that came with it.

    This is how all read messages that came from elsewhere: topics, services, bags, the command.

    Args:
        data: as received.
        message_class: of the message on the wire.

    Raises:
        genpy.DeserializationError: the message itself cannot be read.
    """
    message: Any = message_class()
    if is_tracked_type(message_class):
        return read_tracked(message.deserialize(data))
    return Decoded(message, decoder(message_class)(message, data))


@functools.lru_cache(maxsize=None)
def decoder(message_class: Any) -> Callable[[Any, bytes], Optional[BadHeader]]:
    """A function that decodes into a message object that is there already.

    Returns:
        `decode_into(message, data)`: fills an ordinary message of that class from data, and returns what was wrong with
        the provenance behind it, None where nothing was.
    """
    deserialize, find = message_class.deserialize, finder(message_class)
    met, resolved = OUTLINES.met, OUTLINES.resolved

    def decode_into(message: Any, data: bytes) -> Optional[BadHeader]:
        deserialize(message, data)  # which ignores what follows the fields
        is_full = data.endswith(MAGIC)
        if not (is_full or data.endswith(REFERENCE)):
            return None
        try:
            found = find(data)
            if found is not None:
                if is_full:
                    met(message_class, found)
                else:
                    found = resolved(message_class, found)
                attach(message, found)
        except BadHeader as error:
            return error
        except Exception as error:
            # The stream must go on after any exception: rospy would try the same data again for ever.
            deserialize(message, data)
            return unexpected(error)
        return None

    return decode_into


def read_tracked(tracked_message: Any) -> Decoded:
    """The ordinary message of one of a tracked type, with the provenance in its header on its leaves."""
    try:
        return Decoded(unwrap(tracked_message), None)
    except BadHeader as error:
        return Decoded(tracked_message.data, error)
    except Exception as error:
        return Decoded(untracked(tracked_message.data), unexpected(error))


def unexpected(error: Exception) -> BadHeader:
    """An unexpected exception while reading provenance, as the error to report."""
    logging.getLogger(__name__).debug('in reading a provenance', exc_info=error)
    return BadHeader('bad provenance: reading it failed with %s: %s' % (type(error).__name__, error))


def provenance_size(data: bytes, message_class: type) -> int:
    """The number of bytes of provenance, with the length and the footer around it, in a serialized message.

    Args:
        data: as it comes from the wire.
        message_class: ordinary or tracked.
    """
    if is_tracked_type(message_class):
        return _LENGTH.size + _LENGTH.unpack_from(data)[0]
    return sum(map(len, _found_behind(data, message_class)))


def split_provenance(data: bytes, message_class: type) -> Tuple[bytes, bytes]:
    """A serialized message and the provenance behind it, b'' if there is none.

    Args:
        data: as received.
        message_class: its type.

    Raises:
        UnknownOutline: what is behind it refers to a provenance that was not received.
        BadHeader: what is behind it is no reference.
    """
    found, footer = _found_behind(data, message_class)
    if not footer:
        return data, b''
    return data[: len(data) - len(footer) - len(found)], _in_full(message_class, data, found)


def in_full(data: bytes, message_class: Any) -> bytes:
    """A serialized message, with its provenance in the place of a reference to it.

    Args:
        data: as received.
        message_class: its type, ordinary or tracked.

    Raises:
        UnknownOutline, BadHeader: as of `split_provenance`.
    """
    if is_tracked_type(message_class):
        return data
    found, footer = _found_behind(data, message_class)
    if not footer:
        return data
    provenance = _in_full(message_class, data, found)
    if provenance is found:
        return data
    return data[: len(data) - len(footer) - len(found)] + provenance + _FOOTER.pack(len(provenance), MAGIC)


def fields_and_provenance(data: bytes, message_class: type) -> Tuple[int, bytes]:
    """Where the fields of a serialized message end, and the provenance behind it, b'' if there is none.

    Only the last bytes are looked at: whoever reads the fields has to see that they end there. If they do not, there is
    no provenance.

    Raises:
        UnknownOutline, BadHeader: as of `split_provenance`.
    """
    if not data.endswith(_BOTH):
        return len(data), b''
    footer = len(data) - _FOOTER.size
    start = footer - _LENGTH.unpack_from(data, footer)[0]
    if start < 0:
        raise BadHeader('found a provenance longer than its message')
    return start, _in_full(message_class, data, data[start:footer])


def _found_behind(data: bytes, message_class: type) -> Tuple[bytes, bytes]:
    """What is behind a message, and its footer; both are b'' where there is nothing."""
    found = finder(message_class)(data) if data.endswith(_BOTH) else None
    return (b'', b'') if found is None else (found, data[-_FOOTER.size :])


def _in_full(message_class: type, data: bytes, found: bytes) -> bytes:
    """The provenance that was found behind a message, or that it refers to."""
    if data.endswith(REFERENCE):
        return OUTLINES.resolved(message_class, found)
    OUTLINES.met(message_class, found)
    return found


@functools.lru_cache(maxsize=None)
def finder(message_class: Any) -> Callable[[bytes], Optional[bytes]]:
    """A function that finds the provenance behind a serialized message, or the reference to one.

    Returns:
        `find(data)`, for data that ends with MAGIC or REFERENCE: what is between the message and the footer, or None
        where these bytes are part of the message.
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
