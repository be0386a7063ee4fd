"""What has taken a plain copy of a location before the first round, and so follows no change of it: `rospy.Rate(rate)`.

A line that makes such a copy again in a round, or in another thread, follows by itself.
"""

import functools
import os
import sys
import threading
import types
from typing import Any, Callable, Dict, List, Optional, Tuple

import rospy

from rosslt import values
from rosslt.node.memory.own_code import is_own_module
from rosslt.node.memory.remembered import MEMORY

#: The classes of rospy that keep plain numbers of their arguments. A Timer gets its period as a Duration.
_CLASSES = (rospy.Rate, rospy.Duration)


class PlainCopies:
    """The copies that the node has made in its set-up alone."""

    def __init__(self) -> None:
        self._made: Dict[Tuple[str, int, str], List[values.Source]] = {}  # by file, line, and class

    def watch(self) -> None:
        """Note copies from now on, as there is a node: sources that are looked up before are unknown ever after."""
        for kind in _CLASSES:
            kind.__init__ = self._noting(kind.__name__, kind.__init__)

    def takers_of(self, source: values.Source) -> List[str]:
        """What has copied a source, and where: `rospy.Rate at pid.py:31`."""
        return [
            f'rospy.{kind} at {os.path.basename(file)}:{line}'
            for (file, line, kind), sources in list(self._made.items())
            if source in sources
        ]

    def _noting(self, kind: str, function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def initialize(instance: object, *args: Any, **kwargs: Any) -> None:
            function(instance, *args, **kwargs)
            is_in_round = MEMORY.has_begun or threading.current_thread() is not threading.main_thread()
            sources = [] if is_in_round else values.sources([*args, *kwargs.values()])
            place = _place(sys._getframe(1)) if sources or (is_in_round and self._made) else None
            if place is not None and is_in_round:
                self._made.pop((*place, kind), None)
            elif place is not None:
                known = self._made.setdefault((*place, kind), [])
                known += [source for source in sources if source not in known]

        return initialize


def _place(frame: Optional[types.FrameType]) -> Optional[Tuple[str, int]]:
    """The line of the node's own code that a frame runs, or is called from."""
    while frame is not None and not is_own_module(frame.f_globals):
        frame = frame.f_back
    return frame and (frame.f_code.co_filename, frame.f_lineno)


PLAIN_COPIES = PlainCopies()
"""Those of this process."""
