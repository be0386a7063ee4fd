"""What a publisher sends in full, and what by a reference to that (see `outlines`).

A provenance is sent in full when its outline is new, when somebody has subscribed since, and again after at most
PERIOD. The time in between is random: else a `throttle` or a busy subscriber, which take one of a number of messages,
might take none in full for ever.
"""

import random
import time
from typing import Any, Callable, Dict, List, Optional

from rosslt.messages.codec.outlines import SLOPES_SENT, VALUES_SENT, Cut, checksum_of, cut_of
from rosslt.messages.errors import BadHeader

PERIOD, SHORTEST_PERIOD = 1.0, 0.25
"""After how many seconds at most, and at least, an outline is sent in full again."""

MOST_ANNOUNCED = 16
"""How many outlines of one publisher are remembered."""

MOST_NEW, NEXT_TRY = 8, 16
"""After so many new outlines in a row, only one of so many messages is looked at until one is known."""


class _Announced:
    """An outline that was sent in full."""

    __slots__ = ('_around', '_cut', 'audience', 'checksums', 'due', 'size', 'slopes', 'values')

    def __init__(self, data: bytes, cut: Cut) -> None:
        self._cut = cut
        self.size = len(data)
        self._around = data[: cut.values_at], data[cut.values_to : cut.slopes_at], data[cut.slopes_to :]
        self.values = self.slopes = b''
        self.checksums: Dict[int, bytes] = {}
        self.due = 0.0
        self.audience: Any = None

    def has(self, data: bytes) -> bool:
        """Whether that is the outline of a provenance."""
        cut = self._cut
        return (
            len(data) == self.size
            and (data[: cut.values_at], data[cut.values_to : cut.slopes_at], data[cut.slopes_to :]) == self._around
        )

    def announce(self, data: bytes, due: float, audience: Any) -> None:
        """Keep what was sent in full."""
        self.values = self._cut.floats(data, VALUES_SENT)
        self.slopes = self._cut.floats(data, SLOPES_SENT)
        self.checksums = {}
        self.due = due
        self.audience = audience

    def reference(self, message_class: Any, data: bytes) -> bytes:
        """The shortest reference for a provenance that has this outline."""
        values, slopes = self._cut.floats(data, VALUES_SENT), self._cut.floats(data, SLOPES_SENT)
        sent = (VALUES_SENT if values != self.values else 0) | (SLOPES_SENT if slopes != self.slopes else 0)
        checksum = self.checksums.get(sent)
        if checksum is None:
            checksum = self.checksums[sent] = checksum_of(message_class, data, self._cut, sent)
        return (values if sent & VALUES_SENT else b'') + (slopes if sent & SLOPES_SENT else b'') + checksum


class Announcer:
    """Decides for one publisher what is sent in full. One thread at a time may use it.

    Args:
        message_class: of its messages.
        audience: gives what is another object after somebody has subscribed, or None where all is to be sent in full.
            Who came while a message was sent may not get that one, so two messages are sent in full.
        clock: gives seconds.
    """

    def __init__(
        self,
        message_class: Any,
        audience: Callable[[], Optional[object]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._class = message_class
        self._audience = audience
        self._clock = clock
        self._announced: List[_Announced] = []
        self._last = self._last_reference = b''
        self._audience_before: Any = None
        self._new = 0

    def reference(self, data: bytes) -> bytes:
        """What to send in place of a provenance; b'' where that is to be sent in full."""
        audience = self._audience()
        if audience is None:
            return b''
        now = self._clock()
        before, self._audience_before = self._audience_before, audience
        if data is self._last:  # as that of what stands still is
            announced = self._announced[0]
            if now < announced.due and announced.audience is audience:
                return self._last_reference
        self._last = b''
        for place, announced in enumerate(self._announced):
            if announced.has(data):
                self._new = 0
                if place:
                    self._announced.insert(0, self._announced.pop(place))
                if now < announced.due and announced.audience is audience:
                    reference = announced.reference(self._class, data)
                    if len(reference) >= len(data):
                        return b''
                    self._last, self._last_reference = data, reference
                    return reference
                break
        else:
            self._new += 1
            if self._new > MOST_NEW and self._new % NEXT_TRY:
                return b''
            try:
                announced = _Announced(data, cut_of(self._class, data))
            except BadHeader:
                return b''  # what no reader takes: the message is sent all the same
            self._announced = [announced, *self._announced[: MOST_ANNOUNCED - 1]]
        announced.announce(data, now + random.uniform(SHORTEST_PERIOD, PERIOD), before)
        return b''
