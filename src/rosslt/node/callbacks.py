"""Calls that follow a change, in a thread of their own, so that a change does not wait for them."""

import threading
import time
import traceback
from typing import Callable, Dict

import rospy

from rosslt.node.rospy_internals import is_shutdown_requested


class Callbacks:
    """Calls functions later, one after the other. One that is asked for again before its turn is called once.

    Args:
        name: that of the thread, which begins with the first call.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._due: Dict[Callable[[], None], float] = {}  # times of `time.monotonic`
        self._wake = threading.Condition()
        self._is_started = False

    def call_soon(self, function: Callable[[], None], after: float = 0.0) -> None:
        """Call a function, not before `after` seconds have passed; an exception that it raises is logged."""
        due = time.monotonic() + after
        with self._wake:
            self._due[function] = min(due, self._due.get(function, due))
            self._wake.notify_all()
            if not self._is_started:
                self._is_started = True
                threading.Thread(target=self._work, name=self._name, daemon=True).start()

    def _next(self) -> Callable[[], None]:
        """Wait for the function that is due first."""
        with self._wake:
            while True:
                function = min(self._due, key=self._due.__getitem__, default=None)
                wait = None if function is None else self._due[function] - time.monotonic()
                if function is not None and wait is not None and wait <= 0:
                    del self._due[function]
                    return function
                self._wake.wait(wait)

    def _work(self) -> None:
        while not rospy.is_shutdown():
            function = self._next()
            try:
                function()
            except Exception:  # a user's function must not end the calls of others
                if is_shutdown_requested():  # meanwhile: its topics are closed
                    return
                rospy.logerr('in the thread %s:\n%s', self._name, traceback.format_exc())
