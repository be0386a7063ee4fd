"""The closed loop: solve, change, look at the next messages, up to a number of rounds.

An expression says how a node computed a field, not how it will compute it after a change: it may take another branch,
round, or go on from what it has summed up. So the next messages are looked at; if the field is not at its target,
the new message's expression is solved, and so on. `forcing` feeds it with the messages of a topic, drags with those of
the thing that was dropped.
"""

import math
import time
from typing import Callable, List, Optional, Set

from rosslt.node.change.change_request import ChangeRequest, Shown
from rosslt.node.change.observation import Observation, is_alike
from rosslt.values import Source

#: The time in which messages show whether a field stands still, in seconds: nodes send one a second with provenance.
LOOK = 2.0


class ClosedLoop:
    """Has the sources of a field changed, looks at the next messages, and has them changed again.

    Args:
        request: what is changed.
        change: has the sources become what an observation needs; False if there is nothing left to try.
        rounds: how many times at most.
        timeout: how long to wait for a message that shows a change, in seconds.
        leaves_moving: for a thing that a hand has dropped: it is left where it moves to.

    Attributes:
        is_over, is_reached: whether it is at its end, and the field as wanted, or as near as NEAR if it comes no
            nearer.
        moves: whether the field moves after the change. Then it is not solved again: a controller whose robot follows
            would be run after, with ever greater numbers.
        rounds: how many times sources were changed.
        end: until when the next observation is waited for, a time of `time.monotonic`; then `pass_time` is called.
        seen: the observations that show the last change.
        other: the latest one that lacks a changed source, or one of the first observation that was solved. It is never
            solved: the node may have gone on to the next of its targets.
        old: how many still had an old value of a changed source.
        last: the observation that is the result, or `other` if no message shows the change; None if there is neither.
    """

    def __init__(
        self,
        request: ChangeRequest,
        change: Callable[[Observation], bool],
        rounds: int,
        timeout: float,
        leaves_moving: bool = False,
    ) -> None:
        self._request, self._change, self._most, self._timeout = request, change, rounds, timeout
        self._leaves_moving = leaves_moving
        self.is_over = self.is_reached = self.moves = False
        self.rounds = self.old = 0
        self.seen: List[Observation] = []
        self.other: Optional[Observation] = None
        self.last: Optional[Observation] = None
        self._began: Set[Source] = set()

    def solve(self, observation: Observation) -> None:
        """Have the sources changed for an observation; raises what `change` raises."""
        self._began = self._began or set(observation.expression.sources)
        if self.rounds < self._most and self._change(observation):
            self.follow()
        else:
            self.is_over, self.is_reached = True, self.last is not None and self.last.is_near

    def follow(self) -> None:
        """Look at the next messages: the sources have been changed."""
        self.rounds += 1
        self.last, self.seen, self.other, self.old = None, [], None, 0
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
        if shown is Shown.NOTHING or not self._began <= set(observation.expression.sources):
            self.other = observation
            return
        seen = self.seen
        seen.append(observation)
        if len(seen) == 1 or observation.distance < self._nearest:  # it may come nearer by itself
            self._nearest = observation.distance
            self.end = min(self._latest_end, observation.at + LOOK)
        if len(seen) > 1:
            was_reached, is_reached = (one.is_reached for one in seen[-2:])
            stands = is_alike(*seen[-2:])
            if (was_reached and is_reached) or (not self._leaves_moving and (was_reached or stands)):
                self.pass_time()

    def pass_time(self) -> None:
        """Judge the messages since a change, at `end` if not earlier, and solve again if the target is missed."""
        seen = self.seen
        if not seen:
            self.last, self.is_over = self.other, True
        elif self._leaves_moving and len(seen) < 2:  # one message does not tell whether it moves
            self.is_over = True
        elif all(one.is_reached for one in seen[-2:]):
            self.last, self.moves, self.is_over, self.is_reached = seen[-2:][0], False, True, True
        else:
            # What comes nearer and stays there may be solved again, what goes away again may not.
            nearest = min(seen, key=lambda one: one.distance)
            others = seen[:-1] if self._leaves_moving else [*seen[-2:-1], nearest]
            self.last = seen[-1]
            self.moves = not all(is_alike(one, self.last) for one in others)
            if self.moves:
                self.is_over = True
                self.is_reached = self._leaves_moving or all(one.is_near for one in seen[-2:])
            else:
                self.solve(seen[-1])
