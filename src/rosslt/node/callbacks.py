"""Calls that follow a change, in a thread of their own, so that a change does not wait for them."""

import threading
import traceback
from typing import Callable, Dict

import rospy


class Callbacks:
    """Calls functions soon, one after the other. One that is asked for again before its turn is called once.

    Args:
        name: of the thread.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._waiting: Dict[Callable[[], None], None] = {}  # an ordered set
        self._wake = threading.Condition()
        self._is_started = False

    def call_soon(self, function: Callable[[], None]) -> None:
        """Call a function later; an exception that it raises is logged."""
        with self._wake:
            self._waiting[function] = None
            self._wake.notify_all()
            if not self._is_started:
                self._is_started = True
                threading.Thread(target=self._work, name=self._name, daemon=True).start()

    def _work(self) -> None:
        while not rospy.is_shutdown():
            with self._wake:
                self._wake.wait_for(lambda: self._waiting)
                function = next(iter(self._waiting))
                del self._waiting[function]
            try:
                function()
            except Exception:  # a user's function must not end the calls of others
                rospy.logerr('in a callback of a location:\n%s', traceback.format_exc())
