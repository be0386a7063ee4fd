"""A text file, read as a whole and replaced as a whole.

Others write the file as well, at any moment. Whoever reads it here gets a text that was saved, and whoever replaces
it here replaces the text that was expected there, or nothing.
"""

import contextlib
import ctypes
import errno
import os
import stat
import tempfile
import time
from typing import Optional

from rosslt.files.errors import FileError

#: The time without a change after which a file counts as saved, in seconds.
SETTLING_TIME = 0.03

#: The maximal number of checks for that, counted since a busy machine may delay them by seconds. An empty or
#: missing file has to stay so in all checks: some editors empty or remove a file and write it later.
LOOKS = 17

EXCHANGE = 2  # RENAME_EXCHANGE, for renameat2
CURRENT_DIRECTORY = -100  # AT_FDCWD


class Unsettled(FileError):
    """A file that is written all the time."""


class _Displaced(FileError):
    """The earlier content of a file could not be looked at, nor put back; it is in the other file, which stays."""


def read_bytes(path: str) -> bytes:
    """The content of a file.

    Raises:
        FileError: it is not there, cannot be read, or is a pipe or a device, which may keep its reader waiting.
    """
    try:
        mode = os.stat(path).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise FileError(path, None, None, 'it cannot be read: it is a pipe or a device')
        with open(path, 'rb') as file:
            return file.read()
    except OSError as error:
        raise FileError(path, None, None, 'it cannot be read: {}'.format(error.strerror)) from None


def read_settled_bytes(path: str) -> bytes:
    """`read_bytes`, once the file has stayed the same for a moment; see `LOOKS`.

    Raises:
        Unsettled: it does not.
        FileError: as in `read_bytes`.
    """
    last, is_gone = _attempt(path), True
    for _ in range(LOOKS):
        time.sleep(SETTLING_TIME)
        before, last = last, _attempt(path)
        if last and last == before:
            return last
        is_gone = is_gone and not before
    if is_gone and not last:
        return read_bytes(path)
    raise Unsettled(path, None, None, 'other programs keep writing it')


def holds(path: str, content: Optional[bytes]) -> bool:
    """Return whether the file has this content now."""
    return content is not None and _attempt(path) == content


def _attempt(path: str) -> Optional[bytes]:
    """`read_bytes`, or None if it raises."""
    try:
        return read_bytes(path)
    except FileError:
        return None


def replace_bytes(path: str, expected: bytes, content: bytes) -> bool:
    """Replace a file's content atomically; its mode, its owner and the links that lead to it stay.

    A file with hard links is overwritten, and a reader may see it half written.

    Args:
        expected: the content that is to be replaced.
        content: the new one.

    Returns:
        Whether it has been; False if the file holds another content than the expected one, and still does.

    Raises:
        FileError: the file cannot be written, or is read-only.
    """
    target = os.path.realpath(path)
    directory, name = os.path.split(target)
    try:
        status = _writable(target)
        os.close(os.open(target, os.O_WRONLY))  # who may rename files in a folder may not therefore write this one
        if status.st_nlink > 1:
            return _write_in_place(target, expected, content)
        handle, other = tempfile.mkstemp(prefix='.{}.'.format(name), dir=directory)
        try:
            with os.fdopen(handle, 'wb') as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())  # or a power cut after the exchange may leave an empty file
            os.chmod(other, stat.S_IMODE(status.st_mode))
            with contextlib.suppress(PermissionError):  # the owner of somebody else's file
                os.chown(other, status.st_uid, status.st_gid)
            is_replaced = _swap(other, target, expected, content)
        except _Displaced:
            raise
        except BaseException:
            _remove(other)
            raise
        _remove(other)
        _settle(directory)
        return is_replaced
    except OSError as error:
        raise FileError(path, None, None, 'it cannot be written: {}'.format(error.strerror)) from None


def overwrite(path: str, text: str) -> None:
    """Write a text into a file, whether it is there or not.

    Raises:
        FileError: it cannot be written, or is read-only.
    """
    try:
        if os.path.exists(path):
            _writable(path)
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
    except OSError as error:
        raise FileError(path, None, None, 'it cannot be written: {}'.format(error.strerror)) from None


def _writable(path: str) -> os.stat_result:
    """The status of a file; raises PermissionError if it is read-only, which does not keep root from writing it."""
    status = os.stat(path)
    if not status.st_mode & 0o222:
        raise PermissionError(errno.EACCES, 'it is read-only')
    return status


def _write_in_place(target: str, expected: bytes, content: bytes) -> bool:
    """Replace the content of a file that keeps its inode; False if the content differs from the expected one."""
    with open(target, 'r+b') as file:
        if file.read() != expected:
            return False
        file.seek(0)
        file.write(content)
        file.truncate()
        file.flush()
        os.fsync(file.fileno())
    return True


def _remove(other: str) -> None:
    """Remove the other file; if that fails, the target is as it should be all the same."""
    with contextlib.suppress(OSError):  # or it has been renamed
        os.unlink(other)


def _settle(directory: str) -> None:
    """Have a replaced file survive a power cut, if the file system can do so."""
    with contextlib.suppress(OSError):
        handle = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _swap(other: str, target: str, expected: bytes, placed: bytes) -> bool:
    """Exchange two files; back again where the target was not as expected.

    Only an exchange shows which content was replaced at that moment. Until it is exchanged back, others see a text that
    nobody saved, so it is not begun if the target is another already.
    """
    if read_bytes(target) != expected:
        return False
    if not _exchange(other, target):
        os.replace(other, target)
        return True
    try:
        return _put_back_newer(other, target, expected, placed)
    except (FileError, OSError) as error:
        try:
            if _exchange(other, target):
                raise
        except OSError:
            pass
        reason = error.reason if isinstance(error, FileError) else error.strerror
        raise _Displaced(
            target, None, None, f'it was replaced, and what was there before is in {other}: {reason}'
        ) from None


def _put_back_newer(other: str, target: str, expected: bytes, placed: bytes) -> bool:
    """Check the content that an exchange displaced, and exchange again until nothing newer is displaced."""
    displaced = read_bytes(other)
    if displaced == expected:
        return True
    while True:
        # The displaced content is newer than the placed one, and goes back. If that displaces something else than the
        # placed content, it is newer still.
        newer = displaced
        _exchange(other, target)
        displaced = read_bytes(other)
        if displaced == placed:
            return False
        placed = newer


def _exchange(first: str, second: str) -> bool:
    """Exchange two files, atomically; False if the system cannot."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), 'renameat2', None)
    if rename is None:
        return False
    if rename(CURRENT_DIRECTORY, os.fsencode(first), CURRENT_DIRECTORY, os.fsencode(second), EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in (errno.ENOSYS, errno.EINVAL):
        return False
    raise OSError(number, os.strerror(number), second)
