"""Whether a thing is shown where it was dropped: its node may have taken another branch with the new source values."""

import time
from typing import Optional

from rosslt import messages, node, values
from rosslt.markers.drags.drag import NOISE, Drag
from rosslt.markers.scene.handle import Handle

#: How many times what a message shows instead is solved.
ROUNDS = 4

#: How long to wait for a message that shows the change, in seconds.
TIMEOUT = 5.0

#: How long a thing stands still that does not move by itself, in seconds; many a thing is sent oftener than it moves.
STILL = 1.0


class Check:
    """Looks at the messages after a drop.

    Args:
        drag: it is over, and sources have followed it.
        handle: the thing as the last message before has it, or None.
        rounds: how many times it may still be corrected.
    """

    def __init__(self, drag: Drag, handle: Optional[Handle], rounds: int = ROUNDS) -> None:
        self.drag, self.rounds = drag, rounds
        self._handle = handle
        self._end: Optional[float] = None  # from when on it is known, a time of `time.monotonic`
        changed = {source: node.Change(old, drag.after[source]) for source, old in drag.before.items()}
        self._look = node.Look(changed, TIMEOUT)

    def is_elsewhere(self, handle: Optional[Handle]) -> Optional[bool]:
        """Whether the thing stays elsewhere; None as long as that is not known.

        What moves by itself is not elsewhere: it was dropped where it was at its moment. One message does not tell
        whether it moves, nor do two that are equal where it is computed in another way than when it was solved.

        Where the latest message has the thing in another frame, or another thing in its place, it is left alone.

        Args:
            handle: as the latest message has it, or None.
        """
        look, now = self._look, time.monotonic()
        if handle is not None and handle is not self._handle:
            self._handle = handle
            if self.drag.misfit(handle) is not None:
                return False
            sight = self._sight(handle)
            if sight is not None and look.is_over_after(sight) and self._end is None:
                self._end = now + STILL if self._may_move(sight) else now
        if now < (look.end if self._end is None else self._end) and not look.moves:
            return None
        return len(look.new or look.other) > 1 and not look.reached and not look.moves

    def _may_move(self, sight: node.Sight) -> bool:
        """Whether it is computed in another way than when it was solved: it moves, or its node took another branch."""
        solved = node.Expression(list(self.drag.solved.tracked))
        return solved.difference(sight.expression).is_branch()

    def _sight(self, handle: Handle) -> Optional[node.Sight]:
        """What a message shows; None where it was computed from what the hand has passed on its way."""
        tracked, targets = handle.wanted(self.drag.pose, self.drag.is_moved, self.drag.is_turned)
        present = values.source_values(tracked)
        if any(
            source in present and not messages.is_sent_as(new, present[source])
            for source, new in self.drag.after.items()
        ):
            return None
        sight = node.sight_of(list(tracked), list(targets))
        are_there = [
            abs(float(value) - target) <= NOISE * max(1.0, abs(target)) for value, target in zip(tracked, targets)
        ]
        return sight._replace(is_reached=all(are_there))
