"""A script's file: replaced atomically, never over a text that somebody else has just saved, and watched."""

import itertools
import os
import shutil
import stat
import threading
import time

import pytest

from rosslt import files
from rosslt.files import FileError, atomic_replacement
from support.processes import wait_until


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text('a = 1\n')
    return path


@pytest.fixture(params=['exchange', 'rename'])
def system(request, monkeypatch):
    """A system that can exchange two files atomically, and one that cannot."""
    if request.param == 'rename':
        monkeypatch.setattr(atomic_replacement, '_exchange', lambda first, second: False)


def test_a_file_that_cannot_be_read_says_why(path):
    with pytest.raises(FileError, match='cannot be read: No such file'):
        files.read_bytes(str(path) + '.none')
    with pytest.raises(FileError, match='cannot be read: Is a directory'):
        files.read_bytes(str(path.parent))


def test_a_pipe_or_a_device_is_not_read_as_that_may_take_forever(tmp_path):
    pipe = tmp_path / 'pipe'
    os.mkfifo(str(pipe))
    for one in (str(pipe), '/dev/zero'):
        with pytest.raises(FileError, match='it is a pipe or a device'):
            files.read_bytes(one)


@pytest.mark.usefixtures('system')
def test_a_replaced_file_keeps_its_mode_and_leaves_nothing_else_behind(path):
    path.chmod(0o754)
    assert files.replace_bytes(str(path), b'a = 1\n', b'a = 2\n')
    assert path.read_text() == 'a = 2\n'
    assert stat.S_IMODE(path.stat().st_mode) == 0o754
    assert os.listdir(str(path.parent)) == ['tour.script']


def test_a_link_stays_a_link_and_its_target_is_replaced(path, tmp_path):
    link = tmp_path / 'links' / 'my.script'
    link.parent.mkdir()
    link.symlink_to('../tour.script')
    assert files.replace_bytes(str(link), b'a = 1\n', b'a = 2\n')
    assert link.is_symlink()
    assert path.read_text() == 'a = 2\n'


@pytest.mark.parametrize('mode', [0o444, 0o555])
def test_a_read_only_file_is_not_replaced_by_root_either(path, mode):
    path.chmod(mode)
    with pytest.raises(FileError, match='it cannot be written: it is read-only'):
        files.replace_bytes(str(path), b'a = 1\n', b'a = 2\n')
    assert path.read_text() == 'a = 1\n'
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_hard_links_stay_links_to_one_file(path, tmp_path):
    other = tmp_path / 'other.script'
    os.link(path, other)
    assert files.replace_bytes(str(path), b'a = 1\n', b'a = 25\n')
    assert not files.replace_bytes(str(path), b'a = 1\n', b'a = 3\n'), 'it is not what was expected'
    assert files.replace_bytes(str(path), b'a = 25\n', b'a\n'), 'and shorter than before'
    assert (path.read_text(), other.read_text()) == ('a\n', 'a\n')
    assert os.path.samefile(path, other)
    assert sorted(os.listdir(str(path.parent))) == ['other.script', 'tour.script']


@pytest.mark.usefixtures('system')
def test_a_text_that_was_not_expected_is_not_replaced(path):
    assert not files.replace_bytes(str(path), b'a = 0\n', b'a = 2\n')
    assert path.read_text() == 'a = 1\n'
    assert os.listdir(str(path.parent)) == ['tour.script']


def test_what_is_saved_in_the_very_moment_of_replacing_is_not_lost(path, monkeypatch):
    saves = iter(['a = 10\n', 'a = 20\n'])
    exchange = atomic_replacement._exchange

    def interrupted(first, second):
        text = next(saves, None)
        if text is not None:
            path.with_suffix('.new').write_text(text)
            path.with_suffix('.new').replace(path)
        return exchange(first, second)

    monkeypatch.setattr(atomic_replacement, '_exchange', interrupted)
    assert not files.replace_bytes(str(path), b'a = 1\n', b'a = 2\n')
    assert path.read_text() == 'a = 20\n'
    assert os.listdir(str(path.parent)) == ['tour.script']


def test_a_reader_never_sees_a_part_of_a_text(path):
    texts = [b'a = %d\n' % number * 2000 for number in (1, 2)]
    path.write_bytes(texts[0])
    done = threading.Event()
    seen = []

    def read():
        while not done.is_set():
            seen.append(files.read_bytes(str(path)))

    reader = threading.Thread(target=read)
    reader.start()
    for turn in range(200):
        assert files.replace_bytes(str(path), texts[turn % 2], texts[1 - turn % 2])
    done.set()
    reader.join()
    assert set(seen) <= set(texts)


def save_in_place(path, text):
    path.write_text(text)


def save_by_rename(path, text):
    path.with_suffix('.new').write_text(text)
    path.with_suffix('.new').replace(path)


def save_with_backup(path, text):
    path.replace(path.with_suffix('.bak'))
    path.write_text(text)


@pytest.mark.parametrize('save', [save_in_place, save_by_rename, save_with_backup])
@pytest.mark.parametrize('through_link', [False, True])
def test_the_watch_sees_whatever_way_an_editor_saves(path, tmp_path, save, through_link):
    watched = path
    if through_link:
        watched = tmp_path / 'links' / 'my.script'
        watched.parent.mkdir()
        watched.symlink_to(path)
    seen = []
    files.FileWatch(str(watched), lambda: seen.append(files.read_settled_bytes(str(watched))))
    for text in ('a = 2\n', 'a = 3\n'):
        save(path, text)
        wait_until(lambda text=text: seen[-1:] == [text.encode()], 'the watch to see ' + text)


@pytest.fixture
def watched(tmp_path):
    """A file in a folder that a link leads to, with what the watch has seen of it."""
    for name in ('first', 'second'):
        (tmp_path / name).mkdir()
    (tmp_path / 'first' / 'my.script').write_text('a = 1\n')
    (tmp_path / 'current').symlink_to('first')
    file, seen = tmp_path / 'current' / 'my.script', []
    files.FileWatch(str(file), lambda: seen.append(file.exists() and file.read_text()))
    return file, seen


def test_the_watch_sees_what_is_written_in_a_folder_that_was_made_again(watched, tmp_path):
    file, seen = watched
    for text in ('a = 2\n', 'a = 3\n'):
        shutil.rmtree(tmp_path / 'first')
        wait_until(lambda: seen[-1:] == [False], 'the watch to see that it is gone')
        (tmp_path / 'first').mkdir()
        file.write_text(text)
        wait_until(lambda text=text: seen[-1:] == [text], 'the watch to see ' + text)


def test_a_file_that_is_being_written_is_read_when_it_is_done(path):
    with path.open('w') as file:
        timer = threading.Timer(0.05, lambda: (file.write('a = 5\n'), file.flush()))
        timer.start()
        assert files.read_settled_bytes(str(path)) == b'a = 5\n'
        timer.join()


def test_a_file_that_is_written_once_while_the_machine_is_busy_is_read(path, monkeypatch):
    """A busy machine is played: whoever waits comes back a second late, and the file was written meanwhile."""
    wait = time.sleep

    def come_back_late(seconds):
        wait(seconds + 1.0)
        path.write_text('a = 2\n')

    monkeypatch.setattr(atomic_replacement.time, 'sleep', come_back_late)
    assert files.read_settled_bytes(str(path)) == b'a = 2\n'


def test_a_file_that_is_written_all_the_time_is_said_to_be(path, monkeypatch):
    """Another program that writes in each moment is played by the waiting itself."""
    numbers = itertools.count()
    monkeypatch.setattr(atomic_replacement.time, 'sleep', lambda _: path.write_text(f'a = {next(numbers)}\n'))
    with pytest.raises(files.Unsettled, match='other programs keep writing it'):
        files.read_settled_bytes(str(path))
