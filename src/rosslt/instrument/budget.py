"""Limits what recording costs a node: at most as much CPU time as the node itself takes, over any half a second.

A debt grows by what recording takes and shrinks by what the node takes itself. Where it passes `MOST`, recording stops:
what is computed is plain. It begins again with the next round, a message that is sent or a callback, once the debt is
paid. A publisher whose round was not recorded as a whole sends plain messages.
"""

import time
from typing import Callable

from rosslt import values

MOST = 0.25
"""The CPU time in seconds by which recording may be ahead of the node: half of that of half a second."""

_GRANT = round(MOST / values.OPERATION / 100)
"""The operations between two looks at the clock."""


class Budget:
    """The budget of this process.

    Args:
        clock: gives the CPU time of the process in seconds.

    Attributes:
        stops: how often recording was stopped or begun again. What was computed while it was even, and the same, was
            recorded as a whole.
        spent: the CPU time that recording has taken, in seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.process_time) -> None:
        self.stops = 0
        self.spent = 0.0
        self._debt = 0.0
        self._clock = clock
        self._since = clock()

    def begin(self) -> None:
        """Limit recording from now on."""
        self._since = self._clock()
        values.limit_recording(self._refill)

    def begin_round(self) -> None:
        """Record again, where it was stopped and the debt is paid."""
        if self.stops % 2:
            self._account(0.0)
            if not self._debt:
                self.stops += 1
                values.allow(_GRANT)

    def _refill(self) -> int:
        self._account(_GRANT * values.OPERATION)
        if self._debt < MOST:
            return _GRANT
        self.stops += 1
        return 0

    def _account(self, recording: float) -> None:
        now = self._clock()
        own = max(0.0, now - self._since - recording)
        self._debt = max(0.0, self._debt + recording - own)
        self.spent += recording
        self._since = now


BUDGET = Budget()
"""The budget of this process."""
