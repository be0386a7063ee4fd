"""Warnings on rosout, each fault once: the next message is likely to have the same fault."""

import logging
from typing import Hashable, Set

LIMIT = 1000
"""The most faults that are logged: whoever makes up ever new ones does not fill a log."""

_said: Set[Hashable] = set()


def warn_once(fault: Hashable, text: str, *arguments: object) -> None:
    """Log a warning if rospy takes it to rosout.

    Args:
        fault: identifies the fault; further warnings about it are dropped.
        text, arguments: as in `logging`.
    """
    if fault not in _said and len(_said) < LIMIT:
        _said.add(fault)
        logging.getLogger('rosout').warning(text, *arguments)
