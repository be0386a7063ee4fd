"""The closed loop: solve, change, look at what comes, at most so many times.

An expression says how a node computed a field, not how it will compute it after a change: it may take another branch,
round, or go on from what it has summed up. So the next message is looked at; where the field is not what was wanted,
the new message's expression is solved, and so on. `forcing` feeds it with the messages of a topic, drags with those of
the thing that was dropped.
"""

import time
from typing import Callable, Dict, Optional

from rosslt.node.client import Change
from rosslt.node.observation import SECOND_MESSAGE, ChangeObserver, Observation
from rosslt.values import Source

#: The number of successive solutions for a field that moves by itself: one that settles is settled by the second one.
MOMENTS = 2


class ClosedLoop:
    """Has the sources of a field changed, looks at what comes, and has them changed again.

    Args:
        change: has the sources become what an observation needs, and gives what it has changed, {Source: Change};
            empty where there is nothing left to try.
        rounds: how many times at most.
        timeout: how long to wait for a message that shows a change, in seconds.
        settle: how long a field that is computed in another way than when it was solved has to stand still before it is
            solved again, in seconds. Where that is above 0, a field that moves is left alone: it was where it was
            wanted at its moment.

    Attributes:
        is_over, is_reached: whether it is at its end, and the field as wanted.
        moves: whether the field moves by itself.
        rounds: how many times sources were changed.
        observer: what the messages after the last change show.
        last: the observation that is the result; None where no message shows the change.
        has_branched: whether the field was computed in another way than when it was solved.
    """

    def __init__(
        self,
        change: Callable[[Observation], Dict[Source, Change]],
        rounds: int,
        timeout: float,
        settle: float = 0.0,
    ) -> None:
        self._change, self._most, self._timeout, self._settle = change, rounds, timeout, settle
        self.is_over = self.is_reached = self.moves = False
        self.rounds = self._moments = 0
        self.observer = ChangeObserver({}, timeout)
        self.last: Optional[Observation] = None
        self.has_branched = False
        self._still_until: Optional[float] = None
        self._resting_until: Optional[float] = None

    def begin(self, observation: Observation) -> None:
        """Have the sources changed for the first time; raises what `change` raises."""
        self._solve(observation)

    def follow(self, solved: Observation, changed: Dict[Source, Change]) -> None:
        """Look at what comes: the sources have been changed for an observation."""
        self.rounds += 1
        self._solved, self.observer, self.last = solved, ChangeObserver(changed, self._timeout), None

    @property
    def end(self) -> float:
        """Until when the next observation is waited for, a time of `time.monotonic`; then `pass_time` is called."""
        return self._resting_until or self._still_until or self.observer.end

    def take(self, observation: Optional[Observation]) -> None:
        """Take in what a message shows; None where it has no such field."""
        is_enough = self.observer.take(observation)
        if self._resting_until is not None:
            if self.observer.rests:
                # it does not move by itself: it came to rest after the change, and somewhere else
                self._resting_until, self.moves = None, False
                self._solve(self.observer.new[-1])
        elif self._still_until is not None:
            if self.observer.moves:
                self._conclude()
        elif is_enough and self._settle and self._is_other(self.observer):
            self._still_until = time.monotonic() + self._settle
        elif is_enough:
            self._conclude()

    def pass_time(self) -> None:
        """No message came until `end`."""
        if self._resting_until is None:
            self._conclude()
        else:
            self.is_over = self.is_reached = True

    def stop(self) -> None:
        """End it here."""
        self.is_over = True

    def _is_other(self, observer: ChangeObserver) -> bool:
        """Return whether the field is not as wanted, and computed in another way than when it was solved."""
        seen = observer.new or observer.other
        return not observer.reached and self._solved.expression.is_other_branch(seen[-1].expression)

    def _conclude(self) -> None:
        """Judge what was seen of a change, and solve that where it is not what was wanted."""
        observer, self._still_until = self.observer, None
        seen = observer.new or observer.other
        if self._settle and len(seen) < 2:  # one message does not tell whether it moves
            seen = []
        if observer.reached is not None:
            self.last, self.moves = observer.reached, False
            self.is_over = self.is_reached = True
            return
        self.last, self.moves = (seen[-1] if seen else None), observer.moves
        if not seen:
            self.stop()
            return
        is_branch = self._solved.expression.is_other_branch(seen[0].expression, observer.moving)
        self._moments = self._moments + 1 if self.moves and not is_branch else 0
        if self.moves and (self._settle or self._moments >= min(MOMENTS, self._most)):
            self.last = seen[0]
            if self._settle:
                self.is_over = self.is_reached = True
            else:
                self._resting_until = time.monotonic() + SECOND_MESSAGE
            return
        self.has_branched = self.has_branched or is_branch
        self._solve(seen[-1])

    def _solve(self, observation: Observation) -> None:
        changed = self._change(observation) if self.rounds < self._most else {}
        if changed:
            self.follow(observation, changed)
        else:
            self.stop()
