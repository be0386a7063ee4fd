"""Limits what recording costs a node: the CPU time that it takes itself and 5 % of a core, over any half a second.

A debt grows by what recording takes, and shrinks by what the node takes itself and as time passes. If it passes
`MOST`, recording stops: results are plain. It begins again with the next round, a message that is sent or a
callback, once the debt is paid. A publisher whose round was not recorded as a whole sends sampled messages.

Requests are answered at once: after a publisher was made, after a change, and after somebody has subscribed, recording
goes on until a message was recorded as a whole, for `ASKED` at most. That adds to the debt like all recording.
"""

import sys
import time
from collections import Counter
from typing import Any, Callable, Set

from rosslt import values
from rosslt.instrument.tree_rewriting import CELLS

MOST = 0.25
"""The CPU time in seconds by which recording may be ahead of the node: half of that of half a second."""

ASKED = 2.0
"""The CPU time in seconds that recording may take once somebody has asked, whatever is owed: two rounds of a second."""

FREE = 0.05
"""The share of a core that recording may take, however little the node does itself."""

_GRANT = 24989
"""The number of operations between two looks at the clock: a prime, so that in a loop each line is met in its turn."""


class Budget:
    """The budget of this process.

    Args:
        clock: gives the CPU time of the process in seconds.
        wall_clock: gives the time in seconds.

    Attributes:
        stops: how often recording was stopped or begun again. Recording was on all the time between two
            moments if it is even and the same at both.
        spent: the CPU time that recording has taken, in seconds.
        lines: {(file, line) of the node's own code: how often it was met there}.
    """

    def __init__(
        self, clock: Callable[[], float] = time.process_time, wall_clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.stops = 0
        self.spent = 0.0
        self.lines: Counter = Counter()
        self._debt = 0.0
        self._most = MOST
        self._asked: Set[object] = set()
        self._clock, self._wall_clock = clock, wall_clock
        self._since, self._wall_since = clock(), wall_clock()

    def begin(self) -> None:
        """Limit recording from now on."""
        self._since, self._wall_since = self._clock(), self._wall_clock()
        values.limit_recording(self._refill)

    def begin_round(self) -> None:
        """Record again, if it was stopped and the debt is paid."""
        if self.stops % 2:
            self._account(0.0)
            if self._asked or not self._debt:
                self.stops += 1
                values.allow(_GRANT)

    def ask(self, asked: object) -> None:
        """Record from the next round on, whatever the debt, until the asked publisher has answered."""
        self._account(0.0)
        self._asked.add(asked)
        self._most = self._debt + ASKED

    def answer(self, asked: object) -> None:
        """An asked publisher has sent a message that was recorded as a whole."""
        self._asked.discard(asked)
        if not self._asked:
            self._most = MOST

    def _refill(self, overdrawn: int) -> int:
        self._account((_GRANT + overdrawn) * values.OPERATION)
        frame: Any = sys._getframe(1)
        while frame is not None and CELLS not in frame.f_globals:
            frame = frame.f_back
        if frame is not None:
            self.lines[frame.f_globals[CELLS].path, frame.f_lineno] += 1
        if self._debt < self._most:
            return _GRANT
        self._asked.clear()
        self._most = MOST
        self.stops += 1
        return 0

    def _account(self, recording: float) -> None:
        now, wall_now = self._clock(), self._wall_clock()
        paid = max(0.0, now - self._since - recording) + FREE * (wall_now - self._wall_since)
        self._debt = max(0.0, self._debt + recording - paid)
        self.spent += recording
        self._since, self._wall_since = now, wall_now


BUDGET = Budget()
"""The budget of this process."""
