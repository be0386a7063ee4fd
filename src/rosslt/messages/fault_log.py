"""Warnings on rosout, each fault once: what is wrong with a message is wrong with the next one, too."""

import logging
import threading
import time
from typing import Dict, Hashable

LIMIT, REMEMBERED = 1000, 60.0
"""The most different faults that are remembered, and for how many seconds at least: further faults are not logged until
then, so that whoever makes up ever new ones neither fills a log nor hides what comes later."""

_said: Dict[Hashable, float] = {}
_lock = threading.Lock()


def warn_once(fault: Hashable, text: str, *arguments: object) -> None:
    """Log a warning where rospy takes it to rosout.

    Args:
        fault: identifies the fault; further warnings about it are dropped.
        text, arguments: as of `logging`.
    """
    if fault in _said:
        return
    with _lock:
        now = time.monotonic()
        if len(_said) >= LIMIT:
            oldest = next(iter(_said))
            if now < _said[oldest] + REMEMBERED:
                return
            del _said[oldest]
        _said[fault] = now
    logging.getLogger('rosout').warning(text, *arguments)
