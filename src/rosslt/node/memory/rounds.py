"""When a node's first round begins: its main thread spins or waits for a signal, or, in a loop of the node's own code,
sleeps or asks rospy whether it is shut down.

A loop that does nothing but wait belongs to the set-up, as `while not pub.get_num_connections(): rospy.sleep(0.1)`; so
does one that tries something until nothing is raised, and does nothing but wait between.
"""

import ast
import functools
import linecache
import signal
import sys
import threading
import time
import types
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

import rospy

from rosslt.node.memory.own_code import is_own_module
from rosslt.node.memory.remembered import MEMORY

_SPIN, _PAUSE = rospy.spin, signal.pause
_LOOPS = (ast.While, ast.For, ast.AsyncFor)
_ENDS = (ast.Break, ast.Return)


class _Loop(NamedTuple):
    """The lines of a loop, the last one included."""

    first: int
    last: int


def begins_round(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function by which a main thread waits: a call of it may begin the first round."""

    @functools.wraps(function)
    def called(*args: object, **kwargs: object) -> Any:
        if not MEMORY.has_begun and threading.current_thread() is threading.main_thread():
            frame = sys._getframe(1)
            if is_own_module(frame.f_globals) and (function in (_SPIN, _PAUSE) or _is_in_round(frame)):
                MEMORY.begin()
        return function(*args, **kwargs)

    return called


def watch_first_round() -> None:
    """Have the first round begin when it does, from now on."""
    watched: List[Tuple[Any, str]] = [
        *((rospy, 'is_shutdown'), (rospy, 'sleep'), (rospy, 'spin'), (rospy.Rate, 'sleep'), (time, 'sleep')),
        (signal, 'pause'),
    ]
    wrapped = {id(getattr(owner, name)): begins_round(getattr(owner, name)) for owner, name in watched}
    # names that a module of the node has imported before
    for module in [one for one in list(sys.modules.values()) if isinstance(one, types.ModuleType)]:
        if is_own_module(vars(module)):
            watched += [(module, name) for name, thing in list(vars(module).items()) if id(thing) in wrapped]
    originals = [(owner, name, getattr(owner, name)) for owner, name in watched]
    for owner, name, original in originals:
        setattr(owner, name, wrapped[id(original)])

    def restore() -> None:
        for owner, name, original in originals:
            if getattr(owner, name, None) is wrapped[id(original)]:
                setattr(owner, name, original)

    MEMORY.begins.append(restore)


def _is_in_round(frame: Optional[types.FrameType]) -> bool:
    """Return whether any of the node's own functions that are running is in a loop that does more than wait."""
    while frame is not None:
        if is_own_module(frame.f_globals):
            code = frame.f_code
            begin = 0 if code.co_name == '<module>' else code.co_firstlineno
            loops = _loops_of(code.co_filename)
            if loops is None or any(loop.first <= frame.f_lineno <= loop.last for loop in loops if loop.first >= begin):
                return True
        frame = frame.f_back
    return False


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
    return [_Loop(loop.lineno, loop.end_lineno or loop.lineno) for loop in loops if not _only_waits(loop.body)]


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
