"""Runs a node as Python would, rewritten: as `__main__`, with its own arguments, paths, tracebacks and exit code."""

import builtins
import functools
import gc
import importlib.machinery
import linecache
import os
import re
import sys
import threading
import types
from typing import Any, Collection, List, NoReturn, Optional, Tuple

from rosslt.instrument.loader import OwnModules, prepare, rewritten

_RELAY = re.compile(r"^python_script = '(.*)'$", re.MULTILINE)
_HERE = os.path.dirname(os.path.abspath(__file__))
#: The folders of the code that runs a node, whose frames its tracebacks leave out; a workspace may link to them.
_OURS = tuple(
    os.path.join(find(os.path.dirname(_HERE)), room) + os.sep
    for find in (os.path.abspath, os.path.realpath)
    for room in ('instrument', 'cli', 'values', 'node')
)


class NoNode(Exception):
    """There is no such node; the text says which package or executable is missing.

    Attributes:
        wanted, known: that name, and the names that it could have been.
    """

    def __init__(self, text: str, wanted: str = '', known: Collection[str] = ()) -> None:
        super().__init__(text)
        self.wanted, self.known = wanted, known


def find_node(package: str, name: str) -> str:
    """The executable of a package, as rosrun finds it.

    Raises:
        NoNode: there is no such package, or no such executable in it.
    """
    import roslib.packages
    import rospkg

    try:
        found = roslib.packages.find_node(package, name)
    except (rospkg.ResourceNotFound, roslib.packages.ROSPkgException) as error:
        why = f'there is no package {package} ({type(error).__name__})'
        raise NoNode(why, package, rospkg.RosPack().list()) from None
    if not found:
        why = f'there is no executable {name} in the package {package}'
        raise NoNode(why, name, _executables(package))
    return found[0] if isinstance(found, list) else found


def _executables(package: str) -> List[str]:
    """The names of the executables of a package."""
    import rospkg

    workspaces = [*filter(None, os.environ.get('CMAKE_PREFIX_PATH', '').split(os.pathsep)), sys.prefix]
    roots = [rospkg.RosPack().get_path(package), *(os.path.join(one, 'lib', package) for one in workspaces)]
    paths = (os.path.join(folder, name) for root in roots for folder, _, names in os.walk(root) for name in names)
    return [os.path.basename(path) for path in paths if os.access(path, os.X_OK)]


def is_python_node(path: str) -> bool:
    """Return whether an executable is a Python file."""
    return _script(path)[1] is not None


def run_file(path: str, arguments: List[str], include: Collection[str] = (), pure: Collection[str] = ()) -> None:
    """Run a node in this process, which becomes its own; its exceptions pass through.

    Args:
        path: of the file. A program that this Python cannot run replaces this process, untracked.
        arguments: of the node.
        include: names of modules to track beside the user's own.
        pure: `MODULE.NAME` of functions and classes that compute from their arguments alone.
    """
    script, content = _script(path)
    if content is None:
        _replace_process(path, arguments, 'it is no Python file')
    assert content is not None
    made = None
    try:
        made = rewritten(script, content, script)
    except SyntaxError as error:
        if os.access(path, os.X_OK):  # it may be written for another Python
            _replace_process(path, arguments, str(error))
    except (ValueError, RecursionError, KeyError, IndexError, AttributeError) as error:
        _say(f'{path} runs untracked: {type(error).__name__}: {error}')
    main = _main_module(script)
    sys.argv = [path if script == os.path.abspath(path) else script, *arguments]
    sys.path[0] = os.path.dirname(os.path.realpath(script))
    sys.modules['__main__'] = main
    threading.excepthook = _without_ours_in_thread
    try:
        if made is None:
            code = compile(content, script, 'exec', dont_inherit=True)
        else:
            code = made.code
            _set_up(pure)
            prepare(main.__dict__, made, script)
            sys.meta_path.insert(0, OwnModules(sys.path[0], include))
            # All objects loaded so far stay. The collector would visit them again and again, for 20 ms at a time.
            gc.freeze()
        exec(code, main.__dict__)
    except BaseException:
        sys.excepthook = functools.partial(_report, sys.excepthook)
        raise


def _set_up(pure: Collection[str]) -> None:
    from rosslt.instrument import budget, exact_classes, functions, losses, warning_lines
    from rosslt.instrument.pure import keep_provenance

    exact_classes.give_plain_ones()
    functions.show_numbers_as_plain()
    keep_provenance(pure)
    warning_lines.name_lines_of_node(_OURS)
    losses.LOSSES.watch_start()
    budget.BUDGET.begin()


def _script(path: str) -> Tuple[str, Optional[bytes]]:
    """The Python file that a path stands for, and its content: a catkin workspace has relays to scripts elsewhere.

    The content is None if it is no Python.
    """
    path = os.path.abspath(path) if sys.version_info >= (3, 9) else path
    with open(path, 'rb') as file:
        content = file.read()
    if b'\0' in content or not _is_python(path, content):
        return path, None
    if b'# creates a relay to a python script source file' in content[:400]:
        match = _RELAY.search(content.decode('utf-8', 'replace'))
        if match and os.path.isfile(match.group(1)):
            return _script(match.group(1))
    return path, content


def _is_python(path: str, content: bytes) -> bool:
    first = content.split(b'\n', 1)[0]
    if first.startswith(b'#!'):
        return b'python' in first
    return path.endswith('.py') or not content.startswith(b'\x7f')


def _main_module(script: str) -> types.ModuleType:
    main = types.ModuleType('__main__')
    main.__file__ = script
    main.__builtins__ = builtins  # type: ignore[attr-defined]
    main.__loader__ = importlib.machinery.SourceFileLoader('__main__', script)
    main.__package__ = None
    main.__spec__ = None
    main.__dict__['__cached__'] = None
    main.__dict__['__annotations__'] = {}
    linecache.checkcache(script)
    return main


def _replace_process(path: str, arguments: List[str], why: str) -> NoReturn:
    _say(f'{path} runs untracked: {why}')
    sys.stdout.flush()
    os.execv(path if os.path.isabs(path) or os.sep in path else './' + path, [path, *arguments])


def _say(line: str) -> None:
    print('rosslt: ' + line, file=sys.stderr)


def _report(hook: Any, kind: Any, error: BaseException, traceback: object) -> None:
    """Report an exception of a node by the node's own `sys.excepthook`, without the frames of the code that runs it."""
    _trim(error)
    hook(kind, error, error.__traceback__)


_in_thread = threading.excepthook


def _without_ours_in_thread(raised: Any) -> None:
    """Print the traceback of an exception in a thread of the node, such as a `rospy.Timer`."""
    if raised.exc_value is not None:
        _trim(raised.exc_value)
        traceback = raised.exc_value.__traceback__
        raised = threading.ExceptHookArgs((raised.exc_type, raised.exc_value, traceback, raised.thread))
    _in_thread(raised)


def _trim(error: BaseException) -> None:
    """Remove the frames of the code that runs a node from an exception's traceback, and of those that led to it."""
    seen = set()
    waiting: List[Any] = [error]
    while waiting:
        one = waiting.pop()
        if one is not None and id(one) not in seen:
            seen.add(id(one))
            one.__traceback__ = _trimmed(one.__traceback__)
            waiting += [one.__cause__, one.__context__]


def _trimmed(traceback: Any) -> Any:
    kept = []
    while traceback is not None:
        frame = traceback.tb_frame
        file = frame.f_code.co_filename
        is_operator = file == '<string>' and frame.f_globals.get('TrackedFloat') is not None
        if not (file.startswith(_OURS) or _is_command(file) or is_operator):
            kept.append(traceback)
        traceback = traceback.tb_next
    result = None
    for part in reversed(kept):
        result = types.TracebackType(result, part.tb_frame, part.tb_lasti, part.tb_lineno)
    return result


def _is_command(file: str) -> bool:
    return os.path.basename(file) == 'rosslt' and os.path.basename(os.path.dirname(file)) in (
        'scripts',
        'rosslt',
        'bin',
    )
