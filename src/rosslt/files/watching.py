"""Watches files: notices what others write into them, however they do it."""

import os
import threading
import time
from typing import Callable, Dict, Optional, Tuple

#: The period of checking files for changes, in seconds. A check costs a few microseconds. It resolves the whole path,
#: and so also notices a folder that was made again or a link with a new target.
PERIOD = 0.1


class FileWatch:
    """Calls a function when a file may have been written, whoever did it and however; from a thread of its own.

    Args:
        path: the file, which need not be there.
        changed: called without arguments.
    """

    def __init__(self, path: str, changed: Callable[[], object]) -> None:
        self._states: Dict[str, Optional[Tuple[int, ...]]] = {}
        self._changed = changed
        self.add(path)
        threading.Thread(target=self._work, name='watch', daemon=True).start()

    def add(self, path: str) -> None:
        """Watch another file, too."""
        path = os.path.abspath(path)
        self._states[path] = _state_of(path)

    def _work(self) -> None:
        while True:
            time.sleep(PERIOD)
            before = dict(self._states)
            after = {path: _state_of(path) for path in before}
            if after != before:
                self._states.update(after)
                self._changed()


def _state_of(path: str) -> Optional[Tuple[int, ...]]:
    """Return a mark of a file that differs after each writing; None if there is no file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
