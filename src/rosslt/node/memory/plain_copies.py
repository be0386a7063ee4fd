"""What has taken a plain copy of a location before the first round, and so follows no change of it: `rospy.Rate(rate)`,
and what was counted or decided by it, as `range(n)`.

A line that does so again in a round, or in another thread, follows by itself.
"""

import functools
import os
import sys
import threading
import types
from typing import Any, Callable, Dict, List, NamedTuple, Tuple

import rospy

from rosslt import values
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.rounds import own_stack, rounds_of_main_thread

#: The classes of rospy that keep plain numbers of their arguments. A Timer gets its period as a Duration.
_CLASSES = (rospy.Rate, rospy.Duration)

#: What has taken a copy: the file, the line, and what stands there.
_Taker = Tuple[str, int, str]


class _Copy(NamedTuple):
    """A copy.

    Attributes:
        number: that was copied.
        stack: as of `own_stack`.
    """

    number: Any
    stack: Tuple[Tuple[types.CodeType, int], ...]


class PlainCopies:
    """The copies that the node has made in its set-up alone.

    Attributes:
        made: all of them.
    """

    def __init__(self) -> None:
        self.made: Dict[_Taker, List[_Copy]] = {}

    def watch(self) -> None:
        """Note what makes them of rospy from now on, as there is a node."""
        MEMORY.begins.append(self._forget_the_first_round)
        for kind in _CLASSES:
            kind.__init__ = self._noting(kind)

    def take(self, taker: str, frame: types.FrameType, value: Any) -> None:
        """The line that a frame runs counts or decides by a value."""
        if not _is_in_round():
            self._note(taker, frame, [value])
        else:
            self._forget((frame.f_code.co_filename, frame.f_lineno, taker), value)

    def takers_of(self, source: values.Source) -> List[str]:
        """What has copied a source, and where: `rospy.Rate at pid.py:31`."""
        return [
            f'{taker} at {os.path.basename(file)}:{line}'
            for (file, line, taker), copies in list(self.made.items())
            if source in values.sources([copy.number for copy in copies])
        ]

    def _noting(self, kind: Any) -> Callable[..., None]:
        function, taker = kind.__init__, f'rospy.{kind.__name__}'

        @functools.wraps(function)
        def initialize(instance: object, *args: Any, **kwargs: Any) -> None:
            function(instance, *args, **kwargs)
            if not _is_in_round():
                self._note(taker, sys._getframe(1), [*args, *kwargs.values()])
            elif self.made:
                for code, line in own_stack(sys._getframe(1))[:1]:
                    self.made.pop((code.co_filename, line, taker), None)

        return initialize

    def _note(self, taker: str, frame: types.FrameType, given: List[Any]) -> None:
        numbers = [number for number in given if type(number) in values.TRACKED_CLASSES]
        stack = own_stack(frame) if numbers else ()
        for code, line in stack[:1]:
            copies = self.made.setdefault((code.co_filename, line, taker), [])
            for number in numbers:
                if not any(copy.number is number and copy.stack == stack for copy in copies):
                    copies.append(_Copy(number, stack))

    def _forget(self, taker: _Taker, value: Any) -> None:
        """Forget the copies of what a line has taken again; all of them if it is not known what that comes from."""
        copies = self.made.get(taker)
        if copies:
            sources = set(values.sources([value]))
            left = [copy for copy in copies if sources and sources.isdisjoint(values.sources([copy.number]))]
            if left:
                self.made[taker] = left
            else:
                self.made.pop(taker, None)

    def _forget_the_first_round(self) -> None:
        """Forget what was copied since the main thread came into the loop in which the first round begins."""
        rounds = rounds_of_main_thread()
        for taker, copies in list(self.made.items()):
            left = [copy for copy in copies if not _is_within(copy.stack, rounds)]
            if left:
                self.made[taker] = left
            else:
                del self.made[taker]


def _is_in_round() -> bool:
    return MEMORY.has_begun or threading.current_thread() is not threading.main_thread()


def _is_within(stack: Tuple[Tuple[types.CodeType, int], ...], rounds: List[Tuple[types.CodeType, int, int]]) -> bool:
    return any(code is other and first <= line <= last for code, line in stack for other, first, last in rounds)


PLAIN_COPIES = PlainCopies()
"""Those of this process."""


def taken(taker: str, value: Any) -> Any:
    """A value by which the line that calls this counts or decides.

    Args:
        taker: how people call what does so.
        value: any.
    """
    if PLAIN_COPIES.made or type(value) in values.TRACKED_CLASSES:
        PLAIN_COPIES.take(taker, sys._getframe(1), value)
    return value
