"""Provenance behind an ordinary message, where those who do not know of it never look.

genpy and roscpp read the fields that a type has and ignore what follows. What follows is the provenance, its length in
four bytes, and MAGIC. Any message may end in bytes that look like that, so the fields are walked as well: only where
they end exactly where the provenance would begin, there is one.
"""

import struct
from typing import Any, BinaryIO, Tuple

from rosslt.messages.walkers import walkers
from rosslt.messages.wire import encode

MAGIC = b'rSLT'

_FOOTER = struct.Struct('<I4s')


def append_provenance(message: Any, buff: BinaryIO, full_history: bool = False) -> None:
    """Write the provenance of a message behind it; nothing, where no leaf is tracked.

    Args:
        message: an ordinary message, which was just serialized into `buff`.
        buff: where rospy gathers what it sends.
        full_history: as of `encode`.
    """
    data = encode(message, full_history)
    if data:
        buff.write(data + _FOOTER.pack(len(data), MAGIC))


def split_provenance(data: bytes, message_class: type) -> Tuple[bytes, bytes]:
    """A serialized message and the provenance behind it, b'' if there is none.

    Args:
        data: as received.
        message_class: its type.
    """
    if data[-4:] != MAGIC or len(data) < _FOOTER.size:
        return data, b''
    size = _FOOTER.unpack_from(data, len(data) - _FOOTER.size)[0]
    start = len(data) - _FOOTER.size - size
    try:
        if start < 0 or walkers(message_class).end(data, 0, len(data)) != start:
            return data, b''
    except struct.error:
        return data, b''
    return data[:start], data[start:-_FOOTER.size]
