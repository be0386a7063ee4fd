"""When operations are recorded: always, but where that costs a node too much, in some of its rounds only.

A node that computes much would take several times its CPU time. Where this process takes a large share of a core and
recording is a large part of that, operations are recorded in some rounds, as many as a small share of a core allows;
between them, messages carry the provenance that was recorded last (`messages.SparingProvenance`). From the first change
of a source on, all is recorded.
"""

import threading
import time
from typing import Any, Dict, Optional, Tuple

from rosslt import values

#: From which share of a core on a process may be too expensive; how much of it recording must be; and how often as much
#: the process must take with it as without. Writing is not counted there: it is limited elsewhere, and where nothing is
#: recorded it may take as much.
HEAVY, WORTH, RATIO = 0.05, 0.03, 1.5

#: Which share of a core recording may take where it takes too much.
ALLOWED = 0.02

#: How long a process is watched at a time, in seconds; for how long it must take much; and how long it is left alone
#: where recording costs little.
WATCHED, LONG_HEAVY, LEFT_ALONE = 0.5, 0.9, 20.0

#: After how many seconds without recording, of which later ones count more, it shows what recording costs; and which
#: share of a core is so little that the first rounds show it.
LONG_ENOUGH, NEXT_TO_NOTHING = 1.0, 0.01

#: The longest time without recording: in seconds, or in rounds where these take longer, but no more than so many
#: seconds.
LONGEST_PAUSE, ROUNDS_OF_PAUSE, LONGEST_OF_SLOW = 1.5, 10, 10.0

#: How many rounds of the publisher that is the turn of are recorded in a row; and how many where they take long and
#: recording begins with one.
ROUNDS, ROUNDS_OF_LONG = 2, 1

#: For how long at least it is recorded for the first time, which shows what that takes.
FIRST_RECORDED = 0.1


class _Phase:
    """How much CPU time a process takes while it records, or while it does not."""

    def __init__(self) -> None:
        self.time = self.cpu = 0.0

    def add(self, seconds: float, cpu: float) -> None:
        # What was long ago counts less and less.
        self.time, self.cpu = 0.8 * self.time + seconds, 0.8 * self.cpu + cpu

    @property
    def share(self) -> float:
        return self.cpu / self.time if self.time else 0.0


class Sampling:
    """Decides when this process records.

    Attributes:
        is_on: whether it records in some rounds only.
        sending: the CPU time spent on writing what was recorded, which is limited elsewhere.
        takes_turns: whether a publisher sends several things in turn: only what is recorded of those has provenance, so
            that pauses are short, however long a round takes.
    """

    def __init__(self) -> None:
        self.is_on = False
        self.sending = 0.0
        self.takes_turns = False
        # Reentrant, as a signal's handler may publish in the middle of a publish.
        self._lock = threading.RLock()
        self._has_changed = False
        self._phase = 0
        self._since = self._cpu = self._heavy = self._next = self._not_before = self._settled = 0.0
        self._written = 0.0  # the CPU time spent on writing until then
        self._recording, self._pausing = _Phase(), _Phase()
        self._leader: Optional[Any] = None
        self._rounds = self._wanted = 0
        self._began = self._first_round = 0.0
        # Of each publisher, when a whole round was recorded last; before pauses begin, when it was last needed.
        self._sampled: Dict[Any, float] = {}
        self._sent: Dict[Any, float] = {}  # of each, when it has sent its last message

    def is_recorded(self, publisher: Any) -> bool:
        """Whether all operations since the last message of a publisher were recorded."""
        return not values.RECORDING.is_paused and publisher.recorded_since == self._phase

    def was_sampled(self, publisher: Any) -> bool:
        """Whether a publisher has sent a message already that was recorded as a whole, since recording began again."""
        return self._sampled.get(publisher, 0.0) >= self._began

    def changed(self) -> None:
        """Record all from now on: what a node has kept of a source has the value from before the change, which only a
        recorded operation tells."""
        with self._lock:
            self._has_changed = True
            if self.is_on:
                self.is_on = False
                self._phase += 1
                values.resume_recording()

    def published(self, publisher: Any) -> bool:
        """A publisher has sent a message, a round of it is over.

        Returns:
            Whether what was recorded of that message is needed for later ones, of which less may be recorded.
        """
        now = time.monotonic()
        if self.is_on:
            with self._lock:
                is_first = self.is_recorded(publisher) and not self.was_sampled(publisher)
                self._round_is_over(publisher, now)
                self._sent[publisher] = now
            publisher.recorded_since = -1 if values.RECORDING.is_paused else self._phase
            return is_first
        if now >= self._next and not self._has_changed:
            with self._lock:
                self._watch(publisher, now)
                if self.is_on:
                    return True
        if self._heavy and now >= self._not_before and publisher not in self._sampled:
            self._sampled[publisher] = now
            return True
        return False

    def _spent(self, now: float) -> Tuple[float, float, float]:
        """The seconds since the last time that this was asked, and the CPU time in them: without writing, and of it."""
        written = self.sending
        cpu = time.process_time() - written
        spent = now - self._since, cpu - self._cpu, written - self._written
        self._since, self._cpu, self._written = now, cpu, written
        return spent

    def _watch(self, publisher: Any, now: float) -> None:
        is_first = not self._since
        if is_first:
            self._settled = now + 2 * WATCHED
        seconds, cpu, written = self._spent(now)
        self._next = now + WATCHED
        # What a process does before its first message and just after that, it does once.
        is_once = is_first or (now <= self._settled and seconds < LONG_HEAVY)
        self._heavy = self._heavy + seconds if cpu + written > HEAVY * seconds and not is_once else 0.0
        if not self._heavy:
            self._sampled = {}
        if self._heavy < LONG_HEAVY or now < self._not_before:
            return
        self.is_on = True
        self._recording, self._pausing = _Phase(), _Phase()
        self._sampled, self._sent = {publisher: 0.0}, {publisher: now}
        self._began = now
        # What it takes without shows whether it is worth while; all that was sent so far was recorded.
        values.pause_recording()

    def _round_is_over(self, publisher: Any, now: float) -> None:
        if self.is_recorded(publisher):
            self._sampled[publisher] = now
        else:
            self._sampled.setdefault(publisher, 0.0)
        if not values.RECORDING.is_paused:
            if publisher is self._leader:
                self._rounds -= 1
            is_enough = self._rounds <= 0 and (self._recording.time or now - self._since >= FIRST_RECORDED)
            if now >= self._next and (is_enough or now > self._next + LONGEST_PAUSE):
                self._pause(now)
        elif now >= self._next:
            self._pausing.add(*self._spent(now)[:2])
            self._record(publisher, now)

    def _record(self, publisher: Any, now: float) -> None:
        self._phase += 1
        self._began = now
        values.resume_recording()
        self._leader = min(list(self._sampled), key=lambda one: self._sampled[one], default=None)
        # The round of another one has begun already, and others send theirs in turn.
        is_long = publisher is self._leader and now - self._sent.get(publisher, now) > WATCHED
        self._rounds = self._wanted = ROUNDS_OF_LONG if is_long else ROUNDS
        self._next = self._first_round = now

    def _pause(self, now: float) -> None:
        self._recording.add(*self._spent(now)[:2])
        cost = self._recording.share - self._pausing.share
        is_little = cost < WORTH or self._recording.share < RATIO * self._pausing.share
        if is_little and self._pausing.time > (WATCHED if cost < NEXT_TO_NOTHING else LONG_ENOUGH):
            self.is_on, self._not_before, self._heavy = False, now + LEFT_ALONE, 0.0
            self._next = now + WATCHED
            return
        values.pause_recording()
        length = self._recording.time * max(cost, WORTH) / ALLOWED
        rounds = 0 if self.takes_turns else ROUNDS_OF_PAUSE
        slow = min(rounds * (now - self._first_round) / self._wanted, LONGEST_OF_SLOW)
        self._next = now + min(max(length, 0.05), max(slow, LONGEST_PAUSE))


#: Of this process.
SAMPLING = Sampling()
