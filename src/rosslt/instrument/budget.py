"""Limits what recording costs a node: a third of the CPU time that it takes otherwise or, if that is more, 3 % of a
core.

What recording takes is owed to both; the one debt is paid by the CPU time that the node takes otherwise, the other one
as time passes. A round of a publisher or a service ends with its message. If both have passed `MOST` at the end of a
round, or `MOST_OF_ROUND` within one (`MOST_AT_FIRST` before all), recording stops: results are plain. It begins again
with the next round, once one of them is paid. A publisher whose round was not recorded as a whole sends sampled
messages. So that each publisher of a node has whole rounds, recording goes on until each one that has sent a sampled
message has had a whole one, too. Those that come to none within `MOST_OF_ROUND` more are not waited for while
`GIVEN_UP` is recorded.

Requests are answered at once: after a publisher was made, after a change, and after somebody has subscribed, recording
goes on until a message was recorded as a whole, for `ASKED` at most. That adds to the debt like all recording.
"""

import os
import sys
import threading
import time
from collections import Counter
from typing import Any, Callable, Set

from rosslt import values
from rosslt.instrument.tree_rewriting import CELLS

MOST = 0.1
"""The CPU time in seconds by which recording may be ahead after a round."""

MOST_OF_ROUND = 1.0
"""The CPU time in seconds by which recording may be ahead within a round."""

MOST_AT_FIRST = 0.25
"""The same before the first round: a program may send nothing at all."""

ASKED = 2.0
"""The CPU time in seconds that recording may take once somebody has asked, whatever is owed: two rounds of a second."""

GIVEN_UP = 10 * MOST_OF_ROUND
"""The CPU time in seconds of recording in which no publisher is waited for that was in vain: a tenth is for these."""

OF_NODE = 1 / 3
"""The share of the CPU time of a node without recording that recording may take."""

OF_CORE = 0.03
"""The share of a core that recording may take, however little the node does otherwise."""

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
        self._owed_to_node = self._owed_to_core = 0.0
        self._most = MOST_AT_FIRST
        self._asked: Set[object] = set()
        self._met: Set[object] = set()  # the publishers that have ended a round since recording has begun
        self._starved: Set[object] = set()  # those that have sent a sampled message, and no whole one since
        self._given_up: Set[object] = set()  # those that are not waited for until `spent` is:
        self._given_up_until = 0.0
        self._lock = threading.RLock()  # recording something while it is held comes here again
        self._clock, self._wall_clock = clock, wall_clock
        self._since, self._wall_since = clock(), wall_clock()

    def begin(self) -> None:
        """Limit recording from now on."""
        self._since, self._wall_since = self._clock(), self._wall_clock()
        values.limit_recording(self._refill)
        os.register_at_fork(after_in_child=self._unlock)  # another thread of the parent may have held it

    def begin_round(self, publisher: object) -> None:
        """Record again if the debt is paid, or stop if it has become too large.

        Args:
            publisher: the one that has sent a message, with its thread, or the service that answers.
        """
        with self._lock:
            self._most = max(self._most, MOST_OF_ROUND)
            is_on = self._is_on
            if self.stops % 2 == is_on:  # threads were stopping and refilling at once
                self.stops += 1
                self._met.clear()
            if not is_on:
                self._starved.add(publisher)
                self._account(0.0)
                if self._asked or not self._debt:
                    self.stops += 1
                    self._met = {publisher}
                    values.allow(_GRANT)
            elif self.stops and publisher not in self._met:
                self._met.add(publisher)
                self._starved.add(publisher)
                self._most = max(self._most, self._debt + MOST_OF_ROUND)
            else:
                self._starved.discard(publisher)
                if self._debt >= MOST and not self._asked and self._starved <= self._given_up:
                    self._stop()
                    self._account(max(0, _GRANT - values.allow(0)) * values.OPERATION)

    def is_recorded(self, stops: int) -> bool:
        """Return whether all was recorded since `stops` was that number."""
        return stops == self.stops and not stops % 2 and self._is_on

    def ask(self, asked: object) -> None:
        """Record from the next round on, whatever the debt, until the asked publisher has answered."""
        with self._lock:
            self._account(0.0)
            self._asked.add(asked)
            self._most = self._debt + ASKED

    def answer(self, asked: object) -> None:
        """An asked publisher has sent a message that was recorded as a whole."""
        with self._lock:
            if asked in self._asked:
                self._asked.remove(asked)
                if not self._asked:
                    self._most = MOST_OF_ROUND

    @property
    def _is_on(self) -> bool:
        return values.spend(0)

    @property
    def _debt(self) -> float:
        return min(self._owed_to_node, self._owed_to_core)

    def _unlock(self) -> None:
        self._lock = threading.RLock()

    def _refill(self, overdrawn: int) -> int:
        with self._lock:
            self._account((_GRANT + overdrawn) * values.OPERATION)
            frame: Any = sys._getframe(1)
            while frame is not None and CELLS not in frame.f_globals:
                frame = frame.f_back
            if frame is not None:
                self.lines[frame.f_globals[CELLS].path, frame.f_lineno] += 1
            if self._debt < self._most:
                return _GRANT
            self._asked.clear()
            self._given_up, self._starved = self._starved, set()
            self._given_up_until = self.spent + GIVEN_UP
            self._stop()
            return 0

    def _stop(self) -> None:
        self.stops += 1
        self._most = MOST_OF_ROUND
        if self.spent >= self._given_up_until:
            self._given_up.clear()

    def _account(self, recording: float) -> None:
        now, wall_now = self._clock(), self._wall_clock()
        others = max(0.0, now - self._since - recording)
        self._owed_to_node = max(0.0, self._owed_to_node + recording - OF_NODE * others)
        self._owed_to_core = max(0.0, self._owed_to_core + recording - OF_CORE * (wall_now - self._wall_since))
        self.spent += recording
        self._since, self._wall_since = now, wall_now


BUDGET = Budget()
"""The budget of this process."""
