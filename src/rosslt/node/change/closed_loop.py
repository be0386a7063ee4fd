"""The closed loop: solve, change, look at the next messages, up to a number of rounds.

An expression says how a node computed a field, not how it will compute it after a change: it may take another branch,
round, or go on from what it has summed up. So the next messages are looked at; if the field is not at its target,
the new message's expression is solved, and so on. `forcing` feeds it with the messages of a topic, drags with those of
the thing that was dropped.
"""

import math
import time
from typing import Callable, List, Optional

from rosslt import messages, values
from rosslt.node.change.change_request import ChangeRequest, Shown
from rosslt.node.change.observation import Observation, is_alike

#: The time in which messages show whether a field stands still, in seconds.
LOOK = 1.0


class ClosedLoop:
    """Has the sources of a field changed, looks at the next messages, and has them changed again.

    Args:
        request: what is changed.
        change: has the sources become what an observation needs; False if there is nothing left to try.
        rounds: how many times at most.
        timeout: how long to wait for a message that shows a change, in seconds.
        moved_before: whether the field moved before it was changed: only then it is believed to move by itself.
        leaves_moving: for a thing that a hand has dropped: it is solved again only if it has stood still for LOOK,
            and left alone if it has not.

    Attributes:
        is_over, is_reached: whether it is at its end, and the field as wanted, or as near as NEAR if it comes no
            nearer. One that moves by itself is as wanted if it was solved for its moment: computed as it was then,
            and no further off than it moves.
        moves: whether the field moves after the change.
        rounds: how many times sources were changed.
        end: until when the next observation is waited for, a time of `time.monotonic`; then `pass_time` is called.
        seen: the observations that show the last change.
        other: those without any of the changed sources; they count if `seen` stays empty.
        old: how many still had an old value of a changed source.
        last: the observation that is the result; None if no message shows the change.
    """

    def __init__(
        self,
        request: ChangeRequest,
        change: Callable[[Observation], bool],
        rounds: int,
        timeout: float,
        moved_before: bool = False,
        leaves_moving: bool = False,
    ) -> None:
        self._request, self._change, self._most, self._timeout = request, change, rounds, timeout
        self._moved_before, self._leaves_moving = moved_before, leaves_moving
        self.is_over = self.is_reached = self.moves = False
        self.rounds = self.old = 0
        self.seen: List[Observation] = []
        self.other: List[Observation] = []
        self.last: Optional[Observation] = None

    def solve(self, observation: Observation) -> None:
        """Have the sources changed for an observation; raises what `change` raises."""
        if self.rounds < self._most and self._change(observation):
            self.follow(observation)
        else:
            self.is_over, self.is_reached = True, not self.moves and self.last is not None and self.last.is_near

    def follow(self, solved: Observation) -> None:
        """Look at the next messages: the sources have been changed for an observation."""
        self.rounds += 1
        self._solved = solved
        self.last, self.seen, self.other, self.old = None, [], [], 0
        self.end = self._latest_end = time.monotonic() + self._timeout
        self._nearest = math.inf

    def take(self, observation: Optional[Observation]) -> None:
        """Take in what a message shows; None if it has no such field."""
        if observation is None:
            return
        shown = self._request.shown_by(observation.expression.readings)
        if shown is Shown.OLD and not observation.is_reached:
            self.old += 1
            return
        is_new = observation.is_reached or shown is not Shown.NOTHING
        seen = self.seen if is_new else self.other
        seen.append(observation)
        if len(seen) == 1 or observation.distance < self._nearest:  # it may come nearer by itself
            self._nearest = observation.distance
            self.end = min(self._latest_end, observation.at + LOOK)
        if is_new and len(seen) > 1:
            is_reached = observation.is_reached and seen[-2].is_reached
            if is_reached or (not self._leaves_moving and is_alike(*seen[-2:])):
                self.pass_time()

    def pass_time(self) -> None:
        """Judge the messages since a change, at `end` if not earlier, and solve again if the target is missed."""
        seen = self.seen or self.other
        if not seen or (self._leaves_moving and len(seen) < 2):  # one message does not tell whether it moves
            self.is_over = True
        elif all(one.is_reached for one in seen[-2:]):
            self.last, self.moves, self.is_over, self.is_reached = seen[-2:][0], False, True, True
        else:
            pairs = list(zip(seen, seen[1:]))
            self.moves = not all(is_alike(*pair) for pair in (pairs if self._leaves_moving else pairs[-1:]))
            is_by_itself = self._leaves_moving or (self._moved_before and self._is_of_its_moment(seen))
            if self.moves and is_by_itself:
                self.last, self.is_over, self.is_reached = seen[0], True, True
                return
            self.last = seen[-1]
            self.solve(seen[-1])

    def _is_of_its_moment(self, seen: List[Observation]) -> bool:
        """Return whether a field that moves is computed as when it was solved, and no further off than it moves."""
        first, form = values.untracked(seen[0].part), self._solved.expression.form
        spread = max(messages.distance(one.part, first) for one in seen)
        return seen[0].distance <= spread and all(one.expression.form == form for one in seen)
