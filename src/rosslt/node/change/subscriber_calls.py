"""The calls of callbacks: which exceptions of Subscribers come with a change, and which callbacks were called since."""

import threading
import time
from typing import Callable, Dict, Optional, Set, Tuple

from rosslt.node.memory.own_code import raised_by
from rosslt.node.rospy_internals import watch_callbacks

#: A callback that was called in so long a time before a change is waited for, and so long at most, in seconds.
AWAITED = 1.0


class SubscriberCalls:
    """Watches all Subscribers and Timers of this process.

    An exception comes with a change if no callback has raised the same one, from the same line, with the former
    values: before the change, or again after the change was taken back.

    Args:
        take_back: called with an exception and the time of the callback's call before, of `time.monotonic`; takes back
            the changes of the last moments, and returns whether there were any.
    """

    def __init__(self, take_back: Callable[[Exception, float], bool]) -> None:
        self._take_back = take_back
        self._known: Set[Tuple[type, str, int]] = set()  # exceptions that come without a change
        self._taken_back = 0.0  # a time of `time.monotonic`
        self._began: Dict[Tuple[str, str], float] = {}  # when the last call began
        self._ended = threading.Condition()

    def watch(self) -> None:
        """Begin."""
        watch_callbacks(self._called)

    def look_again(self) -> None:
        """Have those who wait look at what may end their wait."""
        with self._ended:
            self._ended.notify_all()

    def wait_since(self, changed: float, is_over: Callable[[], bool], is_main_done: Callable[[], bool]) -> None:
        """Wait until each callback that was called in the last moment before a change was called after it.

        Args:
            changed: the time of the change, of `time.monotonic`.
            is_over: ends the wait; looked at after each call.
            is_main_done: what is waited for beside the callbacks.
        """
        with self._ended:
            awaited = [one for one, began in self._began.items() if changed - AWAITED <= began < changed]
            self._ended.wait_for(
                lambda: is_over() or (is_main_done() and all(self._began[one] >= changed for one in awaited)), AWAITED
            )

    def _called(self, callback: Tuple[str, str], began: float, error: Optional[Exception]) -> None:
        if error is not None:
            self._judge(error, began, self._began.get(callback, 0.0))
        with self._ended:
            self._began[callback] = began
            self._ended.notify_all()

    def _judge(self, error: Exception, began: float, before: float) -> None:
        raised = (type(error), *raised_by(error))
        if raised in self._known:
            return
        if self._take_back(error, before):
            self._taken_back = time.monotonic()
        elif began > self._taken_back:
            self._known.add(raised)
