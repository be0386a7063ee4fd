"""When a node's first round begins: its main thread spins or waits for a signal, or, in a loop of the node's own code,
sleeps or asks rospy whether it is shut down. And when it has gone round that loop once more.

A loop that does nothing but wait belongs to the set-up, as `while not pub.get_num_connections(): rospy.sleep(0.1)`; so
does one that tries something until nothing is raised, and does nothing but wait between.
"""

import ast
import contextlib
import functools
import linecache
import signal
import sys
import threading
import time
import traceback
import types
from typing import Any, Callable, Iterator, List, NamedTuple, Optional, Set, Tuple

import rospy

from rosslt.node.memory.own_code import is_own_module
from rosslt.node.memory.remembered import MEMORY

_SPIN, _PAUSE = rospy.spin, signal.pause
_LOOPS = (ast.While, ast.For, ast.AsyncFor)
_ENDS = (ast.Break, ast.Return)

#: (file, line) of each of the node's own functions that are running, from the inside outward.
Stack = Tuple[Tuple[str, int], ...]


class _Loop(NamedTuple):
    """The lines of a loop, the last one included, and the first of those that run in each round."""

    first: int
    last: int
    again: int


def begins_round(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function by which a main thread waits: a call of it may begin the first round, or the next one."""

    @functools.wraps(function)
    def called(*args: object, **kwargs: object) -> Any:
        if (_WATCHED or not MEMORY.has_begun) and threading.current_thread() is threading.main_thread():
            frame = sys._getframe(1)
            if is_own_module(frame.f_globals):
                if not MEMORY.has_begun and (function in (_SPIN, _PAUSE) or _is_in_round(frame)):
                    MEMORY.begin()
                for one in tuple(_WATCHED):
                    one.waits_at(frame)
        return function(*args, **kwargs)

    return called


class _Hooks:
    """The functions by which a main thread waits, replaced as long as anybody wants to know of their calls."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._replaced: List[Tuple[Any, str, Any, Any]] = []  # (owner, name, function, its replacement)

    def put(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1:
                self._replaced = _waiting_functions()
                for owner, name, _, replacement in self._replaced:
                    setattr(owner, name, replacement)

    def take_away(self) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                for owner, name, function, replacement in self._replaced:
                    if getattr(owner, name, None) is replacement:
                        setattr(owner, name, function)


_HOOKS = _Hooks()


def watch_first_round() -> None:
    """Have the first round begin when it does, from now on."""
    _HOOKS.put()
    MEMORY.begins.append(_HOOKS.take_away)


class Round:
    """A round of the main thread, from now on: it is over when the thread waits again where it has waited since.

    Attributes:
        is_over: also true if the thread is in no loop that does more than wait, or spins.
    """

    def __init__(self, ends: Callable[[], None]) -> None:
        frame = sys._current_frames().get(threading.main_thread().ident or 0)
        self.is_over = _spins(frame) or not _is_in_round(frame)
        self._ends = ends
        self._places: Set[Tuple[Tuple[int, int], ...]] = set()

    def waits_at(self, frame: types.FrameType) -> None:
        """The main thread waits."""
        running = traceback.walk_stack(frame)
        place = tuple((id(one.f_code), line) for one, line in running if is_own_module(one.f_globals))
        if place in self._places and not self.is_over:
            self.is_over = True
            self._ends()
        self._places.add(place)


#: The rounds that somebody waits for.
_WATCHED: List[Round] = []


@contextlib.contextmanager
def watch_round(ends: Callable[[], None]) -> Iterator[Round]:
    """Watch the Round that begins now.

    Args:
        ends: called when it is over, in the main thread.
    """
    watched = Round(ends)
    if watched.is_over:
        yield watched
        return
    _WATCHED.append(watched)
    _HOOKS.put()
    try:
        yield watched
    finally:
        _HOOKS.take_away()
        _WATCHED.remove(watched)


def _waiting_functions() -> List[Tuple[Any, str, Any, Any]]:
    """(owner, name, function, its replacement) of the functions by which a main thread waits."""
    watched: List[Tuple[Any, str]] = [
        *((rospy, 'is_shutdown'), (rospy, 'sleep'), (rospy, 'spin'), (rospy.Rate, 'sleep'), (time, 'sleep')),
        (signal, 'pause'),
    ]
    wrapped = {id(getattr(owner, name)): begins_round(getattr(owner, name)) for owner, name in watched}
    # names that a module of the node has imported before
    for module in [one for one in list(sys.modules.values()) if isinstance(one, types.ModuleType)]:
        if is_own_module(vars(module)):
            watched += [(module, name) for name, thing in list(vars(module).items()) if id(thing) in wrapped]
    functions = [(owner, name, getattr(owner, name)) for owner, name in watched]
    return [(owner, name, function, wrapped[id(function)]) for owner, name, function in functions]


def _spins(frame: Optional[types.FrameType]) -> bool:
    return any(one.f_code is _SPIN.__code__ for one, _ in traceback.walk_stack(frame)) if frame else False


def _is_in_round(frame: Optional[types.FrameType]) -> bool:
    """Return whether any of the node's own functions that are running is in a loop that does more than wait."""
    return any(loops is None or loops for _, loops in _own_frames(frame))


def own_stack(frame: Optional[types.FrameType]) -> Stack:
    """Return the node's own functions that are running."""
    found = []
    while frame is not None:
        if is_own_module(frame.f_globals):
            found.append((frame.f_code.co_filename, frame.f_lineno or 0))
        frame = frame.f_back
    return tuple(found)


def rounds_of_main_thread() -> List[Tuple[str, int, int]]:
    """(file, first line, last line) of what runs again in each round of the loops that the main thread is in."""
    frame = sys._current_frames().get(threading.main_thread().ident or 0)
    return [
        (one.f_code.co_filename, loop.again, loop.last) for one, loops in _own_frames(frame) for loop in loops or ()
    ]


def _own_frames(
    frame: Optional[types.FrameType],
) -> Iterator[Tuple[types.FrameType, Optional[List[_Loop]]]]:
    """The node's own functions that are running, from the inside outward, each with the loops around its line; None if
    the text of its file is not known."""
    while frame is not None:
        if is_own_module(frame.f_globals):
            code = frame.f_code
            begin = 0 if code.co_name == '<module>' else code.co_firstlineno
            line = frame.f_lineno or 0  # none between two lines, where another thread may see the frame
            loops = _loops_of(code.co_filename)
            yield (
                frame,
                None if loops is None else [one for one in loops if begin <= one.first <= line <= one.last],
            )
        frame = frame.f_back


@functools.lru_cache(maxsize=None)
def _loops_of(path: str) -> Optional[List[_Loop]]:
    """The loops of a file that do more than wait; None if its text is not known."""
    try:
        tree = ast.parse(''.join(linecache.getlines(path)))
    except (SyntaxError, ValueError, SystemError):  # Python 3.11 raises the last one if two threads parse
        return None
    if not tree.body:
        return None
    loops = [node for node in ast.walk(tree) if isinstance(node, _LOOPS)]
    return [
        _Loop(
            loop.lineno,
            loop.end_lineno or loop.lineno,
            loop.lineno if isinstance(loop, ast.While) else loop.body[0].lineno,
        )
        for loop in loops
        if not _only_waits(loop.body)
    ]


def _only_waits(body: List[ast.stmt]) -> bool:
    """Return whether a loop does nothing but wait, or does more only in the turn that ends it if nothing is raised."""
    others = [statement for statement in body if not _waits(statement)]
    if not others:
        return True
    first, *later = others
    tried, between = [first], []
    if isinstance(first, ast.Try):
        tried = [*first.body, *first.orelse]
        between = [*first.finalbody, *(one for handler in first.handlers for one in handler.body)]
    ends = isinstance(body[-1], _ENDS) or (isinstance(tried[-1], _ENDS) and not later)
    goes_on = any(isinstance(part, ast.Continue) for one in [*tried, *later] for part in ast.walk(one))
    return ends and not goes_on and all(map(_waits, between))


def _waits(statement: ast.stmt) -> bool:
    """Return whether a statement does nothing but sleep, log or print."""
    if isinstance(statement, ast.If):
        return all(map(_waits, [*statement.body, *statement.orelse]))
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        function = statement.value.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, 'id', '')
        return name in ('sleep', 'print') or name.startswith('log')
    return isinstance(statement, (ast.Pass, ast.Continue, ast.Raise, *_ENDS))
