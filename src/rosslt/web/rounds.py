"""When the page is brought up to date: as soon as something has changed, but only so often; else from time to time."""

import math
import threading
import time


class Rounds:
    """The rounds in which a page is brought up to date.

    Args:
        rate: how often there is one, in Hz, while things change; and while nobody says that something has, as not all
            changes are told.
    """

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._news = threading.Event()
        self._last = -math.inf  # when there were news

    def begin(self) -> None:
        """Something has changed: begin the next round now, or soon after the last one."""
        if not self._news.is_set():
            self._news.set()

    def wait(self) -> None:
        """Wait for the beginning of the next round."""
        if self._news.wait(self._period):
            time.sleep(max(0.0, self._last + self._period - time.monotonic()))
            self._news.clear()
            self._last = time.monotonic()
