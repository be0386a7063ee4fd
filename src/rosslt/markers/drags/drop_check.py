"""Checks after a drop that messages show the thing there: the node may compute it in another branch by then."""

import time
from typing import Callable, Optional

from rosslt import node, values
from rosslt.markers.drags.drag import NOISE, Drag
from rosslt.markers.scene.handle import Handle

#: The maximal number of changes of the sources, including the drag itself.
ROUNDS = 5

#: The maximal wait for a message that shows the change, in seconds.
TIMEOUT = 5.0


class Drop:
    """Feeds a ClosedLoop with the messages after a drop.

    A thing that moves by itself is left where its messages have it.

    Args:
        drag: it is over, and sources have followed it.
        change: changes the sources again for what is seen; False if it cannot.
        resolution: how near it is where it was dropped, as in Rules.
    """

    def __init__(self, drag: Drag, change: Callable[[], bool], resolution: float = 0.0) -> None:
        self.drag, self._resolution = drag, resolution
        self._handle = drag.solved
        timeout = TIMEOUT + (drag.handle.basis.following.delay if drag.handle.basis is not None else 0.0)
        self.loop = node.ClosedLoop(drag.request, lambda _: change(), ROUNDS, timeout, leaves_moving=True)
        self.loop.follow()

    def see(self, handle: Optional[Handle]) -> None:
        """Take in the thing as the latest message has it, or None."""
        if handle is not None and handle is not self._handle and self.drag.misfit(handle) is None:
            self._handle = handle
            if not self.drag.has_left(values.sources(list(handle.tracked))) and self.drag.learn(handle):
                self.loop.take(self._observed(handle))
        if not self.loop.is_over and time.monotonic() >= self.loop.end:
            self.loop.pass_time()

    @property
    def is_seen(self) -> bool:
        """True once a message has shown it since the last change."""
        return bool(self.loop.seen)

    @property
    def is_passed_by(self) -> bool:
        """True if messages that came after the last change had the thing from the values before it."""
        return self.loop.old > 1

    @property
    def is_elsewhere(self) -> bool:
        """True once the thing stays elsewhere, whatever its sources were made."""
        return self.loop.is_over and not self.loop.is_reached and self.loop.last is not None

    def _observed(self, handle: Handle) -> node.Observation:
        tracked, targets, _ = self.drag.wanted(handle, self.drag.pose)
        are_there = [
            abs(float(value) - target) <= max(self._resolution, NOISE * max(1.0, abs(target)))
            for value, target in zip(tracked, targets)
        ]
        return node.observe(list(tracked), list(targets), is_reached=all(are_there))
