"""A timer for bringing the page up to date: as soon as something has changed, but not too often; else now and then."""

import math
import threading
import time


class RefreshTimer:
    """Tells when to bring a page up to date.

    Args:
        rate: how often, in Hz, while things change; and while nobody says that something has, as not all changes are
            told.
    """

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._news = threading.Event()
        self._last = -math.inf  # when there were news

    def request(self) -> None:
        """Say that something has changed: `wait` returns now, or soon after it did so last."""
        if not self._news.is_set():
            self._news.set()

    def wait(self) -> None:
        """Wait until it is time."""
        if self._news.wait(self._period):
            time.sleep(max(0.0, self._last + self._period - time.monotonic()))
            self._news.clear()
            self._last = time.monotonic()
