"""References: a provenance by the checksum of what stays the same in it, and the floats that do not.

What is constant is the *outline* of a provenance: all its bytes but those of the two blocks of floats, and the blocks
too that a reference does not send. A publisher sends a provenance in full now and then (`announcing`), and whoever
reads it learns its outlines here. A checksum covers everything that a reference leaves out, so it makes no difference
from whom, on which topic, how long ago or in which order the outlines were learned: a reference means the same bytes
everywhere, or cannot be resolved yet.
"""

import collections
import hashlib
import threading
from typing import Any, Deque, Dict, Iterator, NamedTuple, Tuple

from rosslt.messages.codec.decoder import header_like
from rosslt.messages.errors import BadHeader, UnknownOutline

CHECKSUM_SIZE = 8

VALUES_SENT, SLOPES_SENT = 1, 2
"""Which blocks of floats a reference sends: the values of sources, the coefficients."""

SMALL = 1 << 12
"""A provenance up to so many bytes is small."""

RECENT_SMALL, RECENT_LARGE = 1024, 16
"""How many of those that were received last, small and larger ones, are kept until a reference asks for them."""

KNOWN_LIMIT, KNOWN_BYTES_LIMIT = 4096, 1 << 24
"""How many checksums are kept, and how many bytes of outlines."""


class Cut(NamedTuple):
    """A provenance in its five parts, which the positions of the two blocks of floats make."""

    values_at: int
    values_to: int
    slopes_at: int
    slopes_to: int

    def kinds(self) -> Iterator[int]:
        """The sorts of references that there are: VALUES_SENT and SLOPES_SENT only for blocks that are not empty."""
        for sent in range(4):
            if (self.values_to > self.values_at or not sent & VALUES_SENT) and (
                self.slopes_to > self.slopes_at or not sent & SLOPES_SENT
            ):
                yield sent

    def floats(self, data: bytes, sent: int) -> bytes:
        """The blocks of floats that a reference sends."""
        values = data[self.values_at : self.values_to] if sent & VALUES_SENT else b''
        return values + data[self.slopes_at : self.slopes_to] if sent & SLOPES_SENT else values

    def filled(self, data: bytes, sent: int, floats: bytes) -> bytes:
        """A provenance with other bytes in the blocks that a reference sends."""
        slopes = floats
        if sent & VALUES_SENT:
            size = self.values_to - self.values_at
            data, slopes = data[: self.values_at] + floats[:size] + data[self.values_to :], floats[size:]
        return data[: self.slopes_at] + slopes + data[self.slopes_to :] if sent & SLOPES_SENT else data

    def size(self, sent: int) -> int:
        """The bytes of the blocks that a reference sends."""
        return (self.values_to - self.values_at if sent & VALUES_SENT else 0) + (
            self.slopes_to - self.slopes_at if sent & SLOPES_SENT else 0
        )


def cut_of(message_class: Any, data: bytes) -> Cut:
    """Where the blocks of floats are in a provenance.

    Raises:
        BadHeader: its form is not right.
    """
    blocks = header_like(message_class, data).blocks
    return Cut(
        blocks.values_at,
        blocks.values_at + 8 * len(blocks.value_numbers),
        blocks.slopes_at,
        blocks.slopes_at + 8 * blocks.slope_count,
    )


def checksum_of(message_class: Any, data: bytes, cut: Cut, sent: int) -> bytes:
    """The checksum of everything that a reference of that sort leaves out.

    Args:
        message_class: of the message: a provenance means something else in another type.
        data: the provenance.
        cut: of the provenance.
        sent: VALUES_SENT, SLOPES_SENT, both or none.
    """
    outline = cut.filled(data, sent, bytes(cut.size(sent)))
    text = message_class._md5sum.encode('ascii') + bytes((sent,)) + outline
    return hashlib.blake2b(text, digest_size=CHECKSUM_SIZE).digest()


class _Known(NamedTuple):
    """An outline, and what a reference to it sends."""

    md5sum: str
    data: bytes
    """A provenance that has the outline."""
    cut: Cut
    sent: int


class Outlines:
    """The outlines that were received. Several threads may use it.

    They are worked out when a reference is met whose checksum is not known: who gets no references pays for an entry in
    a queue only. Once there have been references, large ones are worked out before they would be dropped, unread: a
    publisher whose messages are few among many others would have none that is known, however often it repeats them.
    What does not fit is dropped, the oldest first; a publisher repeats what it refers to.
    """

    def __init__(self) -> None:
        self._small: Deque[Tuple[Any, bytes]] = collections.deque(maxlen=RECENT_SMALL)
        self._large: Deque[Tuple[Any, bytes]] = collections.deque(maxlen=RECENT_LARGE)
        self._known: Dict[bytes, _Known] = {}
        self._bytes = 0
        self._is_asked = False  # whether there has been a reference
        self._lock = threading.Lock()

    def met(self, message_class: Any, data: bytes) -> None:
        """Keep a provenance that came in full."""
        if len(data) <= SMALL:
            self._small.append((message_class, data))
            return
        if self._is_asked and len(self._large) >= RECENT_LARGE:
            self._learn()
        self._large.append((message_class, data))

    def resolved(self, message_class: Any, reference: bytes) -> bytes:
        """The provenance that a reference stands for.

        Raises:
            UnknownOutline: it cannot be resolved yet.
            BadHeader: it is no reference.
        """
        if len(reference) < CHECKSUM_SIZE:
            raise BadHeader('bad provenance: found a reference of %d bytes' % len(reference))
        self._is_asked = True
        checksum = reference[-CHECKSUM_SIZE:]
        known = self._known.get(checksum)
        if known is None:
            self._learn()
            known = self._known.get(checksum)
        if known is None or known.md5sum != message_class._md5sum:
            raise UnknownOutline('found a reference to the provenance %s, which has not been received' % checksum.hex())
        if len(reference) != CHECKSUM_SIZE + known.cut.size(known.sent):
            raise BadHeader(
                'bad provenance: found a reference of %d bytes, expected %d'
                % (len(reference), CHECKSUM_SIZE + known.cut.size(known.sent))
            )
        return known.cut.filled(known.data, known.sent, reference[:-CHECKSUM_SIZE]) if known.sent else known.data

    def _learn(self) -> None:
        """Work out the outlines of what was received since the last time."""
        with self._lock:
            found: Dict[Tuple[Any, bytes], None] = {}
            for recent in (self._small, self._large):
                while recent:
                    found[recent.popleft()] = None
            for message_class, data in found:
                try:
                    cut = cut_of(message_class, data)
                except BadHeader:
                    continue  # it was reported when it came
                for sent in cut.kinds():
                    self._keep(
                        checksum_of(message_class, data, cut, sent), _Known(message_class._md5sum, data, cut, sent)
                    )

    def _keep(self, checksum: bytes, known: _Known) -> None:
        replaced = self._known.pop(checksum, None)
        self._bytes += len(known.data) - (len(replaced.data) if replaced else 0)
        self._known[checksum] = known
        while len(self._known) > KNOWN_LIMIT or self._bytes > KNOWN_BYTES_LIMIT:
            self._bytes -= len(self._known.pop(next(iter(self._known))).data)


OUTLINES = Outlines()
"""Those of this process, from wherever they came."""
