"""Warnings on rosout, each fault once: what is wrong with a message is wrong with the next one, too."""

import logging
from typing import Hashable, Set

LIMIT = 1000
"""The most different faults that are remembered; further faults are not logged."""

_said: Set[Hashable] = set()


def warn_once(fault: Hashable, text: str, *arguments: object) -> None:
    """Log a warning where rospy takes it to rosout.

    Args:
        fault: what nothing more is said of after that.
        text, arguments: as of `logging`.
    """
    if fault not in _said and len(_said) < LIMIT:
        _said.add(fault)
        logging.getLogger('rosout').warning(text, *arguments)
