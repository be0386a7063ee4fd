"""Finds the lines of a node where numbers lose their provenance, while it starts and while somebody asks, those that
carry a state on, which has none, and where recording costs most.

Code that needs a plain float calls `__float__`: NumPy does so when a number is written into an array without
provenance, and so do other libraries. Tracked numbers define that method only while losses are counted, so that it
costs nothing otherwise.
"""

import builtins
import linecache
import math
import os
import sys
import threading
import time
import types
from collections import Counter
from typing import Any, Dict, Tuple

import rospy

from rosslt import srv, values
from rosslt.instrument import cells, starts
from rosslt.instrument.budget import BUDGET
from rosslt.instrument.tree_rewriting import CELLS, CUT_OFF, PLAIN, PLAIN_PARTS

#: Duration of the search after a node's first message, in seconds.
START = 5.0

#: The longest time that may be asked for, in seconds.
LONGEST = 60.0

#: The maximal number of lines that are remembered, and of those that are called costly.
MOST_PLACES = 100
MOST_COSTLY = 3

#: Packages that compute nothing from their arguments: they send them, wait for them or write them down.
_SINKS = ('genpy', 'json', 'logging', 'rosgraph', 'rospy', 'rosslt', 'xmlrpc', 'yaml')

_NUMBERS = tuple(kind for kind in values.TRACKED_CLASSES if kind.__base__ in (float, int))


class Losses:
    """The lines of a node's own files where provenance is lost.

    Attributes:
        is_watched: True while losses are counted.
        steps: where states were carried on: {(id of the code, index of the instruction): ((file, line), code)}.
    """

    def __init__(self) -> None:
        self.is_watched = False
        self._counts: Dict[Tuple[str, int], int] = {}
        self._topics: Dict[str, bool] = {}  # whether a number on it had a source
        self._sent: Counter = Counter()  # by (topic, file, line)
        self.steps: Dict[Tuple[int, int], Any] = {}
        self._watchers = 0
        self._lock = threading.Lock()
        self._is_starting = False
        self._started_at = 0.0

    def watch_start(self) -> None:
        """Look until the node has sent messages for a while."""
        self._is_starting = True
        self.begin()

    def published(self, topic: str, now: float, has_sources: bool) -> None:
        """The node has sent a message, at a time of `time.monotonic`; said of one in half a second."""
        self._topics[topic] = has_sources or self._topics.get(topic, False)
        if self._is_starting:
            self._started_at = self._started_at or now
            if now > self._started_at + START:
                self._is_starting = False
                self.end()

    def begin(self) -> None:
        """Look, until `end` is called as often."""
        with self._lock:
            self._watchers += 1
            if not self.is_watched:
                self.is_watched = True
                for kind in _NUMBERS:
                    kind.__float__ = _plain_float
                vars(builtins).update({PLAIN: _plain_step, PLAIN_PARTS: _plain_steps, CUT_OFF: _cut_off})

    def end(self) -> None:
        """Look no more, if nobody else does."""
        with self._lock:
            self._watchers -= 1
            if not self._watchers:
                self.is_watched = False
                for kind in _NUMBERS:
                    del kind.__float__
                vars(builtins).update({PLAIN: cells.plain, PLAIN_PARTS: cells.plain_parts, CUT_OFF: starts.cut_off})

    def note(self, frame: Any) -> None:
        """Count a number that has lost its provenance in a frame, or in a function called from there."""
        while frame is not None:
            place = _place(frame)
            if place is not None:
                if place in self._counts or len(self._counts) < MOST_PLACES:
                    self._counts[place] = self._counts.get(place, 0) + 1
                return
            if _package(frame) in _SINKS:
                return
            frame = frame.f_back

    def stepped(self, frame: Any) -> None:
        """Note that the line of a frame has carried a state on, if `steps` does not know its instruction."""
        if len(self.steps) < MOST_PLACES:
            self.steps[id(frame.f_code), frame.f_lasti] = _place(frame), frame.f_code

    def places(self) -> Dict[Tuple[str, int], int]:
        """{(file, line): how many numbers have lost their provenance there}."""
        return dict(self._counts)

    def sent(self, topic: str, frame: Any) -> None:
        """Note that a frame of the node, or a function called from there, has published a message."""
        while frame is not None and _place(frame) is None:
            frame = frame.f_back
        place = frame and (topic, *_place(frame))
        if place and (place in self._sent or len(self._sent) < MOST_PLACES):
            self._sent[place] += 1

    def computed(self, result: object, arguments: object) -> None:
        """A function that is not known to keep provenance has given a result."""
        if self.is_watched and _is_plain(result) and _has_provenance(arguments):
            frame: Any = sys._getframe(1)
            while frame is not None and _package(frame) in ('rosslt', 'numpy'):
                frame = frame.f_back
            self.note(frame)

    def find(self, request: srv.FindLossesRequest) -> srv.FindLossesResponse:
        """Look for so long; serves `~rosslt/find_losses`."""
        end = time.monotonic() + min(max(request.seconds, 0.0), LONGEST)
        cpu, recording = time.process_time(), BUDGET.spent
        lines, sent = BUDGET.lines.copy(), self._sent.copy()
        self.begin()
        try:
            while not rospy.is_shutdown() and time.monotonic() < end:
                rospy.rostime.wallsleep(min(0.1, max(0.0, end - time.monotonic())))
        finally:
            self.end()
        found = sorted(self.places().items())
        topics, sending = dict(self._topics), sorted(self._sent.copy() - sent)
        return srv.FindLossesResponse(
            [path for (path, _), _ in found],
            [line for (_, line), _ in found],
            [linecache.getline(path, line).strip() for (path, line), _ in found],
            [count for _, count in found],
            time.process_time() - cpu,
            BUDGET.spent - recording,
            [_shown(*place) for place, _ in (BUDGET.lines - lines).most_common(MOST_COSTLY)],
            list(topics),
            list(topics.values()),
            ['; '.join(_shown(*place) for topic, *place in sending if topic == one) for one in topics],
            [_shown(*place) for place in sorted({place for place, _ in self.steps.copy().values()})],
        )


def _place(frame: types.FrameType) -> Any:
    """(file, line) of a frame of the node's own code, None for other code."""
    cells = frame.f_globals.get(CELLS)
    return None if cells is None else (cells.path, frame.f_lineno)


def _shown(path: str, line: int) -> str:
    return f'{os.path.basename(path)}:{line}: {linecache.getline(path, line).strip()}'


def _package(frame: types.FrameType) -> str:
    return str(frame.f_globals.get('__name__', '')).partition('.')[0]


#: The losses of this process.
LOSSES = Losses()


def _plain_float(number: Any) -> float:
    LOSSES.note(sys._getframe(1))
    return float(number._plain)


# A busy loop may take such a step in each of its rounds: what is noted already costs little.
def _plain_step(value: Any) -> Any:
    frame = sys._getframe(1)
    if (id(frame.f_code), frame.f_lasti) not in LOSSES.steps:
        LOSSES.stepped(frame)
    return cells.plain(value)


def _plain_steps(parts: Any, *others: int) -> Any:
    frame = sys._getframe(1)
    if (id(frame.f_code), frame.f_lasti) not in LOSSES.steps:
        LOSSES.stepped(frame)
    return cells.plain_parts(parts, *others)


def _cut_off(owner: Any, key: Any) -> Any:
    frame = sys._getframe(1)
    if (id(frame.f_code), frame.f_lasti) not in LOSSES.steps:
        LOSSES.stepped(frame)
    return starts.cut_off(owner, key)


def _has_provenance(thing: Any, depth: int = 3) -> bool:
    if type(thing) is dict:
        thing = list(thing.values())
    if type(thing) in (list, tuple) and depth:
        return any(_has_provenance(part, depth - 1) for part in thing)
    is_number = type(thing) in values.TRACKED_CLASSES and not isinstance(thing, str)
    return is_number or getattr(thing, 'has_provenance', False) is True


def _is_plain(result: Any, depth: int = 2) -> bool:
    """Return whether a result consists of numbers without provenance."""
    if type(result) in (list, tuple) and depth:
        return bool(result) and all(_is_plain(part, depth - 1) for part in result)
    is_number = isinstance(result, (int, float)) and type(result) is not bool and not math.isnan(result)
    is_array = getattr(getattr(result, 'dtype', None), 'kind', '') in tuple('fiuc') and bool(getattr(result, 'size', 0))
    return (is_number or is_array) and not _has_provenance(result)
