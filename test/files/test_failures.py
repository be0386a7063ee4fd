"""A file that is replaced holds the old or the new text as a whole, whatever fails in between."""

import errno
import os
import subprocess
import tempfile
import threading

import pytest

from rosslt import files
from rosslt.files import FileError, atomic_replacement

OLD, NEW = b'a = 1\n' * 500, b'a = 2\n' * 500

#: Every call of the system that replacing makes: module, name.
CALLS = [
    (os, 'stat'),
    (tempfile, 'mkstemp'),
    (os, 'fdopen'),
    (os, 'fsync'),
    (os, 'chmod'),
    (os, 'chown'),
    (atomic_replacement, '_exchange'),
    (atomic_replacement, 'read_bytes'),
    (os, 'replace'),
    (os, 'unlink'),
    (os, 'open'),
    (os, 'close'),
]


class PowerCut(BaseException):
    """Nothing is done from here on."""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_bytes(OLD)
    return path


def failing(patch, number, error, is_last):
    """Have the call of that number fail, and, if it is the last one, all that follow; returns the list of calls."""
    made = []
    caller = threading.current_thread()

    def wrapped(call, name):
        def instead(*arguments, **options):
            if threading.current_thread() is not caller:
                return call(*arguments, **options)
            made.append(name)
            if len(made) == number or (is_last and len(made) > number):
                if error is not PowerCut and name == 'read_bytes':
                    raise FileError(str(arguments[0]), None, None, 'it cannot be read: ' + os.strerror(error))
                raise PowerCut if error is PowerCut else OSError(error, os.strerror(error))
            return call(*arguments, **options)

        return instead

    for module, name in CALLS:
        patch.setattr(module, name, wrapped(getattr(module, name), name))
    return made


def outcome_of(path, number, error, is_last, can_exchange):
    """(what replacing gave or raised, the calls that it made, the text afterwards)."""
    with pytest.MonkeyPatch.context() as patch:
        if not can_exchange:
            patch.setattr(atomic_replacement, '_exchange', lambda first, second: False)
        made = failing(patch, number, error, is_last)
        try:
            result = files.replace_bytes(str(path), OLD, NEW)
        except (FileError, PowerCut) as raised:
            result = type(raised)
    return result, made, path.read_bytes()


@pytest.mark.parametrize('can_exchange', [True, False])
@pytest.mark.parametrize('error', [errno.EIO, errno.ENOSPC, errno.EACCES])
def test_each_call_that_fails_leaves_the_old_or_the_new_text_and_says_which(path, error, can_exchange):
    number, seen = 0, set()
    while True:
        number += 1
        path.write_bytes(OLD)
        result, made, text = outcome_of(path, number, error, False, can_exchange)
        if len(made) < number:
            break  # there are no more calls
        assert text in (OLD, NEW), (number, made)
        assert (text == NEW) == (result is True), (number, made, result)
        seen.add((made[number - 1], result))
        left = [name for name in os.listdir(str(path.parent)) if name != path.name]
        assert not left or made[number - 1] == 'unlink', (number, made, left)
        for name in left:
            os.unlink(str(path.parent / name))
    assert {name for name, _ in seen} >= {'mkstemp', 'fsync', 'chmod', 'read_bytes', 'unlink'}
    assert (text, result) == (NEW, True)


@pytest.mark.parametrize('can_exchange', [True, False])
def test_a_power_cut_between_any_two_calls_leaves_the_old_or_the_new_text(path, can_exchange):
    number, texts = 0, set()
    while True:
        number += 1
        path.write_bytes(OLD)
        _, made, text = outcome_of(path, number, PowerCut, True, can_exchange)
        if len(made) < number:
            break
        assert text in (OLD, NEW), (number, made)
        texts.add(text)
    assert texts == {OLD, NEW}


def test_what_cannot_be_looked_at_nor_put_back_is_kept_and_named(path, monkeypatch):
    real, read, calls = atomic_replacement._exchange, atomic_replacement.read_bytes, []

    def once(first, second):
        calls.append(first)
        if len(calls) > 1:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        path.write_text('edited by somebody')
        return real(first, second)

    def unreadable(name):
        if calls:
            raise FileError(name, None, None, 'it cannot be read: no idea')
        return read(name)

    monkeypatch.setattr(atomic_replacement, '_exchange', once)
    monkeypatch.setattr(atomic_replacement, 'read_bytes', unreadable)
    with pytest.raises(FileError, match='what was there before is in ') as caught:
        files.replace_bytes(str(path), OLD, NEW)
    kept = str(caught.value).split(' is in ')[1].split(': ')[0]
    with open(kept, encoding='utf-8') as file:
        assert file.read() == 'edited by somebody'


def test_an_editor_that_saves_at_the_same_moment_loses_nothing(path):
    def save(text):
        other = path.with_suffix('.new')
        other.write_text(text)
        os.replace(str(other), str(path))

    replaced = 0
    for number in range(200):
        path.write_bytes(OLD)
        edit = f'edit {number}\n'
        editor = threading.Thread(target=save, args=(edit,))
        editor.start()
        replaced += files.replace_bytes(str(path), OLD, NEW)
        editor.join()
        assert path.read_text() == edit
    assert os.listdir(str(path.parent)) == [path.name]


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 64 kB of its own."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    mounted = subprocess.run(
        ['mount', '-t', 'tmpfs', '-o', 'size=64k', 'tmpfs', str(folder)], capture_output=True, text=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip(f'this process may not mount: {mounted.stderr.strip()}')
    yield folder
    subprocess.run(['umount', '-l', str(folder)], check=True)


def test_a_full_disk_leaves_the_old_text_and_says_so(small_disk):
    path = small_disk / 'tour.script'
    path.write_text('x' * 40000)
    with pytest.raises(FileError, match='cannot be written: No space left on device'):
        files.replace_bytes(str(path), b'x' * 40000, b'y' * 40000)
    assert path.read_text() == 'x' * 40000
    assert os.listdir(str(small_disk)) == ['tour.script']


def test_a_file_system_that_is_read_only_says_so(small_disk):
    path = small_disk / 'tour.script'
    path.write_bytes(OLD)
    subprocess.run(['mount', '-o', 'remount,ro', str(small_disk)], check=True)
    with pytest.raises(FileError, match='cannot be written: Read-only file system'):
        files.replace_bytes(str(path), OLD, NEW)
    assert path.read_bytes() == OLD


def test_a_link_to_another_file_system_stays_a_link(small_disk, tmp_path):
    path, link = small_disk / 'tour.script', tmp_path / 'link.script'
    path.write_bytes(OLD)
    link.symlink_to(path)
    assert files.replace_bytes(str(link), OLD, NEW)
    assert link.is_symlink()
    assert path.read_bytes() == NEW
