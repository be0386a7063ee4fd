"""What has taken a plain copy of a location before the first round, and so follows no change of it: `rospy.Rate(rate)`,
and what was counted or decided by it, as `range(n)`.

A line that does so again in a round, or in another thread, follows by itself.
"""

import collections
import functools
import os
import sys
import threading
import types
from typing import Any, Callable, Counter, Dict, Iterable, List, Set, Tuple

import rospy

from rosslt import values
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.rounds import Stack, own_stack, rounds_of_main_thread

#: The classes of rospy that keep plain numbers of their arguments. A Timer gets its period as a Duration.
_CLASSES = (rospy.Rate, rospy.Duration)

#: How many times a line of the set-up is looked at: a loop of it may have millions of passes.
MOST_PASSES = 1000

#: What has taken a copy: the file, the line, and what stands there.
_Taker = Tuple[str, int, str]


class _Copies:
    """The copies that one line has made, each time that it was called from the same lines.

    Attributes:
        sources: of the numbers that were copied, as far as they have been looked up.
    """

    def __init__(self) -> None:
        self.sources: Set[values.Source] = set()
        self._numbers: Dict[int, Any] = {}  # by id; before there is a node, their sources would be lost by a look
        self._lock = threading.Lock()

    def add(self, numbers: Iterable[Any]) -> None:
        """Note numbers that were copied."""
        with self._lock:
            self._numbers.update((id(number), number) for number in numbers)

    def look_up(self) -> Set[values.Source]:
        """Look up the sources, once there is a node."""
        with self._lock:
            numbers, self._numbers = self._numbers, {}
        self.sources.update(values.sources(list(numbers.values())))
        return self.sources


class PlainCopies:
    """The copies that the node has made in its set-up alone.

    Attributes:
        made: all of them, by what has made them, and then by what called that.
    """

    def __init__(self) -> None:
        self.made: Dict[_Taker, Dict[Stack, _Copies]] = {}
        self._passes: Counter[_Taker] = collections.Counter()

    def watch(self) -> None:
        """Note what makes them of rospy from now on, as there is a node."""
        MEMORY.begins.append(self._forget_the_first_round)
        for kind in _CLASSES:
            kind.__init__ = self._noting(kind)

    def take(self, taker: str, frame: types.FrameType, value: Any) -> None:
        """The line that a frame runs counts or decides by a value."""
        line = frame.f_code.co_filename, frame.f_lineno, taker
        if _is_in_round():
            self._forget(line, value)
        elif type(value) in values.TRACKED_CLASSES and self._passes[line] < MOST_PASSES:
            self._passes[line] += 1
            self._note(taker, frame, [value])

    def takers_of(self, source: values.Source) -> List[str]:
        """What has copied a source, and where: `rospy.Rate at pid.py:31`."""
        return [
            f'{taker} at {os.path.basename(file)}:{line}'
            for (file, line, taker), made in list(self.made.items())
            if any(source in copies.look_up() for copies in list(made.values()))
        ]

    def _noting(self, kind: Any) -> Callable[..., None]:
        function, taker = kind.__init__, f'rospy.{kind.__name__}'

        @functools.wraps(function)
        def initialize(instance: object, *args: Any, **kwargs: Any) -> None:
            function(instance, *args, **kwargs)
            if not _is_in_round():
                numbers = [number for number in (*args, *kwargs.values()) if values.is_tracked(number)]
                if numbers:
                    self._note(taker, sys._getframe(1), numbers)
            elif self.made:
                for file, line in own_stack(sys._getframe(1))[:1]:
                    self.made.pop((file, line, taker), None)

        return initialize

    def _note(self, taker: str, frame: types.FrameType, numbers: Iterable[Any]) -> None:
        stack = own_stack(frame)
        for file, line in stack[:1]:
            made = self.made.setdefault((file, line, taker), {})
            if stack not in made:
                made[stack] = _Copies()
            made[stack].add(numbers)

    def _forget(self, taker: _Taker, value: Any) -> None:
        """Forget the copies of what a line has taken again; all of them if it is not known what that comes from."""
        made = self.made.get(taker)
        if made:
            sources = values.sources(value)
            for copies in made.values():
                copies.sources = copies.sources.difference(sources) if sources else set()
            if not any(copies.sources for copies in made.values()):
                self.made.pop(taker, None)

    def _forget_the_first_round(self) -> None:
        """Forget what was copied since the main thread came into the loop in which the first round begins."""
        rounds = rounds_of_main_thread()
        for taker, made in list(self.made.items()):
            left = {stack: copies for stack, copies in made.items() if not _is_within(stack, rounds)}
            for copies in left.values():
                copies.look_up()
            if any(copies.sources for copies in left.values()):
                self.made[taker] = left
            else:
                del self.made[taker]


def _is_in_round() -> bool:
    return MEMORY.has_begun or threading.current_thread() is not threading.main_thread()


def _is_within(stack: Stack, rounds: List[Tuple[str, int, int]]) -> bool:
    return any(file == other and first <= line <= last for file, line in stack for other, first, last in rounds)


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
