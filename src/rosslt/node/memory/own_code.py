"""Tells the node's own modules from others: its main module, and those of its author.

The standard library, packages installed by Debian, pip or ROS, and rosslt itself are nobody's own.
"""

import os
import sysconfig
import traceback
import types
from pathlib import Path
from typing import Dict, Set, Tuple

_OURS = str(Path(__file__).resolve().parents[2]) + os.sep
#: Files that are taken for the node's own wherever they are.
_included: Set[str] = set()
_known: Dict[str, bool] = {}


def include_file(path: str) -> None:
    """Take a file for the node's own, wherever it is."""
    _included.add(path)
    _known.clear()


def is_own_module(names: Dict[str, object]) -> bool:
    """Return whether a module is the node's own.

    Args:
        names: the module's globals.
    """
    path = names.get('__file__')
    if not isinstance(path, str):
        return names.get('__name__') == '__main__'
    known = _known.get(path)
    if known is None:
        known = _known[path] = path in _included or is_own_file(os.path.realpath(path))
    return known


def is_own_file(path: str) -> bool:
    """Return whether a file is neither installed nor one of rosslt.

    Args:
        path: its real path.
    """
    return not path.startswith((_OURS, *_FOREIGN)) and not _is_installed(path)


def raised_in(error: BaseException) -> Tuple[types.FrameType, int]:
    """The frame and the line of the node's own code that an exception came from; of any code if it passed none."""
    passed = list(traceback.walk_tb(error.__traceback__))
    own = [(frame, line) for frame, line in passed if is_own_module(frame.f_globals)]
    return (own or passed)[-1]


def raised_by(error: BaseException) -> Tuple[str, int]:
    """The file and the line that `raised_in` finds."""
    frame, line = raised_in(error)
    return frame.f_code.co_filename, line


def _foreign_folders() -> tuple:
    folders = {sysconfig.get_path(name) for name in ('stdlib', 'platstdlib', 'purelib', 'platlib')}
    folders |= {'/opt/ros', '/usr/lib', '/usr/local/lib', os.path.expanduser('~/.local/lib')}
    return tuple(sorted(os.path.realpath(folder) + os.sep for folder in folders if folder))


_FOREIGN = _foreign_folders()


def _is_installed(path: str) -> bool:
    """Return whether a file is in site-packages or dist-packages, outside of catkin workspaces."""
    for folder in ('/site-packages/', '/dist-packages/'):
        if folder in path:
            # <workspace>/devel/lib/python3/dist-packages/...: catkin marks its spaces by a file.
            above = path.split(folder)[0]
            return not any(
                os.path.exists(os.path.join(space, '.catkin'))
                for space in (os.path.dirname(above), os.path.dirname(os.path.dirname(above)))
            )
    return False
