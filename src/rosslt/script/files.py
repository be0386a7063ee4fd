"""A script as a file: read as a whole, replaced as a whole, and watched.

Others write the file as well, at any moment. Whoever reads it here gets a text that was saved, and whoever replaces
it here replaces the text that was expected there, or nothing.
"""

import contextlib
import ctypes
import errno
import os
import stat
import tempfile
import threading
import time
from typing import Callable, Union

from watchdog.events import FileSystemEvent, FileSystemEventHandler
from watchdog.observers import Observer

from rosslt.script.errors import ScriptError

#: For how long a file has to stay the same to count as saved, in seconds.
SETTLING_TIME = 0.03

#: How long to wait for that.
PATIENCE = 0.5

#: What watchdog reports when somebody has written; newer versions report who reads, too.
WRITTEN = frozenset(['created', 'modified', 'moved', 'closed', 'deleted'])

EXCHANGE = 2  # RENAME_EXCHANGE, for renameat2
CURRENT_DIRECTORY = -100  # AT_FDCWD


class Unsettled(ScriptError):
    """A file that is written all the time."""


def read(path: str) -> str:
    """The text of a file, with its newlines as they are.

    Raises:
        ScriptError: it is not there, cannot be read, or is not in UTF-8.
    """
    data = _bytes(path)
    try:
        return data.decode('utf-8')
    except UnicodeDecodeError as error:
        before = data[: error.start].decode('utf-8')
        raise ScriptError(
            path,
            before.count('\n') + 1,
            len(before) - before.rfind('\n'),
            'it is not in UTF-8: {}'.format(error.reason),
        ) from None


def holds(path: str, *texts: str) -> bool:
    """Whether the file holds one of these texts now."""
    return _attempt(path) in texts


def read_settled(path: str) -> str:
    """`read`, once the file has stayed the same for a moment: some editors empty it first, or take it away.

    Raises:
        Unsettled: it does not.
        ScriptError: as of `read`.
    """
    deadline = time.monotonic() + PATIENCE
    before = _attempt(path)
    while True:
        time.sleep(SETTLING_TIME)
        outcome = _attempt(path)
        if outcome == before:
            return read(path) if isinstance(outcome, bytes) else outcome
        if time.monotonic() > deadline:
            raise Unsettled(path, None, None, 'other programs keep writing it')
        before = outcome


def _attempt(path: str) -> Union[str, bytes]:
    """What `read` gives, or '' in bytes, which no text is equal to, where it raises."""
    try:
        return read(path)
    except ScriptError:
        return b''


def replace(path: str, expected: str, text: str) -> bool:
    """Replace a file's text atomically; its mode, its owner and a link that leads to it stay.

    Args:
        expected: the text that is to be replaced.
        text: the new one.

    Returns:
        Whether it has been; False where the file holds another text than the expected one, and still does.

    Raises:
        ScriptError: the file cannot be written.
    """
    target = os.path.realpath(path)
    directory, name = os.path.split(target)
    try:
        status = os.stat(target)
        handle, other = tempfile.mkstemp(prefix='.{}.'.format(name), dir=directory)
        try:
            with os.fdopen(handle, 'wb') as file:
                file.write(text.encode('utf-8'))
            os.chmod(other, stat.S_IMODE(status.st_mode))
            with contextlib.suppress(PermissionError):  # the owner of somebody else's file
                os.chown(other, status.st_uid, status.st_gid)
            return _swap(other, target, expected.encode('utf-8'), text.encode('utf-8'))
        finally:
            with contextlib.suppress(FileNotFoundError):  # it has been renamed
                os.unlink(other)
    except OSError as error:
        raise ScriptError(path, None, None, 'it cannot be written: {}'.format(error.strerror)) from None


def _swap(other: str, target: str, expected: bytes, placed: bytes) -> bool:
    """Exchange two files; back again where the target was not as expected.

    There is no other way to look at what is replaced at the very moment of replacing it.
    """
    if not _exchange(other, target):
        if _bytes(target) != expected:
            return False
        os.replace(other, target)
        return True
    displaced = _bytes(other)
    if displaced == expected:
        return True
    while True:
        # What has been displaced is newer than what has been placed, and goes back. Should it displace
        # something else than what was placed, that is newer still.
        newer = displaced
        _exchange(other, target)
        displaced = _bytes(other)
        if displaced == placed:
            return False
        placed = newer


def _exchange(first: str, second: str) -> bool:
    """Exchange two files, atomically; False where the system cannot."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), 'renameat2', None)
    if rename is None:
        return False
    if rename(CURRENT_DIRECTORY, os.fsencode(first), CURRENT_DIRECTORY, os.fsencode(second), EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in (errno.ENOSYS, errno.EINVAL):
        return False
    raise OSError(number, os.strerror(number), second)


def _bytes(path: str) -> bytes:
    try:
        with open(path, 'rb') as file:
            return file.read()
    except OSError as error:
        raise ScriptError(path, None, None, 'it cannot be read: {}'.format(error.strerror)) from None


class _Handler(FileSystemEventHandler):
    """Hands on what watchdog reports."""

    def __init__(self, take: Callable[[FileSystemEvent], None]) -> None:
        self._take = take

    def on_any_event(self, event: FileSystemEvent) -> None:
        self._take(event)


class FileWatch:
    """Calls a function when a file may have been written, whoever did it and however; from a thread of its own.

    Args:
        path: the file. What matters happens in its folder: editors write a new file, and give it the old name.
        changed: called without arguments.
    """

    def __init__(self, path: str, changed: Callable[[], object]) -> None:
        self._names = {os.path.abspath(path), os.path.realpath(path)}
        self._changed = changed
        self._written = threading.Event()
        handler = _Handler(self._note)
        self._observer = Observer()
        for directory in {os.path.dirname(name) for name in self._names}:
            self._observer.schedule(handler, directory)
        self._observer.start()
        threading.Thread(target=self._work, name='watch', daemon=True).start()

    def _note(self, event: FileSystemEvent) -> None:
        paths = {
            os.path.abspath(os.fsdecode(path)) for path in (event.src_path, getattr(event, 'dest_path', '')) if path
        }
        if event.event_type in WRITTEN and paths & self._names:
            self._written.set()

    def _work(self) -> None:
        while True:
            self._written.wait()
            self._written.clear()
            self._changed()
