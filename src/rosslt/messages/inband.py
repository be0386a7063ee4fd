"""Provenance behind an ordinary message, where those who do not know of it never look.

genpy and roscpp read the fields that a type has and ignore what follows. What follows is the provenance, its length in
four bytes, and MAGIC. Any message may end in bytes that look like that, so the fields are walked as well: only where
they end exactly where the provenance would begin, there is one.
"""

import functools
import struct
from typing import Any, BinaryIO, Callable, Optional, Tuple

from rosslt.messages.straight import searches
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


def plain_check(message_class: type) -> Optional[Callable[[Any], bool]]:
    """What tells whether no leaf of a message is tracked, so that nothing is to be appended; None for a class with
    arrays, where that takes no less than appending."""
    found = searches(message_class)
    return found.is_plain if found else None


def split_provenance(data: bytes, message_class: type) -> Tuple[bytes, bytes]:
    """A serialized message and the provenance behind it, b'' if there is none.

    Args:
        data: as received.
        message_class: its type.
    """
    provenance = finder(message_class)(data) if data.endswith(MAGIC) else None
    if provenance is None:
        return data, b''
    return data[: len(data) - _FOOTER.size - len(provenance)], provenance


@functools.lru_cache(maxsize=None)
def finder(message_class: Any) -> Callable[[bytes], Optional[bytes]]:
    """`find(data)`: the provenance behind a serialized message of that class that ends with MAGIC; None where that is
    part of the message."""
    walks = walkers(message_class)
    size, end = walks.layout.size(walks.layout.name), walks.end
    length_at = struct.Struct('<I').unpack_from

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
