"""The editor window on a virtual screen: keys are pressed, and the screen and the file are checked."""

import importlib
import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest

from support.processes import wait_until

TOUR = '# tour\ngoto(2.0, 1.0, 1.5)\nwait(1)\ngoto(-1, 2, 0.5)\n'
MARK, ERROR = (255, 224, 102), (255, 205, 205)
SIZE = (800, 600)
STARTING = 20.0

#: A tour with what Qt takes as the end of a line, what it shows as a blank, and line ends of another system.
ODD = "# a\u00a0b\u2028c\x0c\r\ngoto(2.0, 1.0, 1.5)\r\nprint('\u00a0')\r\nwait(1)\r\n\r\ngoto(-1, 2, 0.5)"

#: Pictures of the screen are kept here, to be looked at after the tests.
SCREENSHOTS = Path(os.environ.get('ROSSLT_SCREENSHOTS') or Path(__file__).resolve().parents[2] / 'build/screenshots')

pytest.importorskip('PyQt5', reason='the window needs PyQt5')
editor = importlib.import_module('rosslt.script.editor')
QtCore, QtGui, QtTest, QtWidgets = [
    importlib.import_module('PyQt5.' + name) for name in ('QtCore', 'QtGui', 'QtTest', 'QtWidgets')
]


class Desk:
    """A screen with the editor on it, and a keyboard."""

    def __init__(self, path):
        self.path, self.processes = path, []
        self.environment = self.window = None

    def open(self):
        read_end, write_end = os.pipe()
        # Without -noreset, it begins anew when its last client has gone, and takes the window manager with it.
        self.start(
            'Xvfb',
            '-displayfd',
            str(write_end),
            '-noreset',
            '-screen',
            '0',
            '{}x{}x24'.format(*SIZE),
            pass_fds=[write_end],
        )
        os.close(write_end)
        with os.fdopen(read_end) as pipe:
            self.environment = dict(os.environ, DISPLAY=':' + pipe.readline().strip())
        self.start('openbox', env=self.environment)
        self.start('rosrun', 'rosslt', 'script_editor', str(self.path), env=self.environment)
        self.window = wait_until(self.find_window, 'the window to take keys', STARTING)
        self.tool(
            'windowmove', self.window, '0', '0', 'windowsize', '--sync', self.window, str(SIZE[0]), str(SIZE[1] - 40)
        )
        wait_until(lambda: (255, 255, 255) in self.colors(), 'the text to be drawn')

    def find_window(self):
        """The window, once it has the keyboard: the window manager may be later than the window."""
        for window in self.tool('search', '--onlyvisible', '--name', self.path.name).split():
            self.tool('windowactivate', window)
            time.sleep(0.1)
            if self.tool('getwindowfocus').strip() == window:
                return window
        return None

    def start(self, *command, **options):
        self.processes.append(
            subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options
            )
        )
        return self.processes[-1]

    def close(self):
        for process in reversed(self.processes):
            process.send_signal(signal.SIGTERM)
            process.wait(60)

    def tool(self, *arguments):
        return subprocess.run(
            ['xdotool', *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            timeout=STARTING,
            check=False,
        ).stdout

    def press(self, *keys):
        self.tool('key', '--delay', '20', *keys)

    def type(self, text):
        self.tool('type', '--delay', '20', text)

    def title(self):
        return self.tool('getwindowname', self.window).strip()

    def colors(self):
        """{color: number of pixels}."""
        lines = subprocess.run(
            ['import', '-window', 'root', '-depth', '8', '-format', '%c', 'histogram:info:-'],
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout
        return {
            tuple(map(int, color.split(','))): int(count)
            for count, color in re.findall(r'(\d+): \(\s*([\d ,]+?)\)', lines)
        }

    def screenshot(self, name):
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            ['import', '-window', 'root', str(SCREENSHOTS / (name + '.png'))], env=self.environment, check=True
        )

    def wait_for_file(self, text):
        try:
            wait_until(lambda: self.path.read_bytes() == text.encode('utf-8'), 'the file')
        finally:
            assert self.path.read_bytes().decode('utf-8') == text


@pytest.fixture
def desk(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text(TOUR)
    desk = Desk(path)
    try:
        desk.open()
        yield desk
    finally:
        desk.close()


def test_what_is_typed_is_saved_with_ctrl_s(desk):
    desk.press('ctrl+Home', 'Down', 'End')
    desk.type('  # up')
    wait_until(lambda: '*' in desk.title(), 'the title to tell of the change')
    assert desk.path.read_text() == TOUR
    desk.press('ctrl+s')
    desk.wait_for_file(TOUR.replace('1.5)', '1.5)  # up'))
    wait_until(lambda: '*' not in desk.title(), 'the title to tell that it is saved')


def test_a_number_that_is_changed_from_outside_is_marked_for_a_second(desk):
    desk.path.write_text(TOUR.replace('1.0', '-12.345'))
    wait_until(lambda: MARK in desk.colors(), 'the mark')
    marked = time.monotonic()
    desk.screenshot('editor_marked')
    wait_until(lambda: MARK not in desk.colors(), 'the mark to go')
    assert 0.3 < time.monotonic() - marked < 2.0
    assert '*' not in desk.title()
    desk.press('ctrl+End')
    desk.type('wait(2)')
    desk.press('ctrl+s')
    desk.wait_for_file(TOUR.replace('1.0', '-12.345') + 'wait(2)')


def test_what_is_typed_and_what_is_dragged_meanwhile_are_both_saved(desk):
    desk.press('ctrl+Home')
    desk.type('goto(0, 0, 9)')
    desk.press('Return')
    desk.path.write_text(TOUR.replace('1.5', '7.25').replace('-1,', '8.5,'))
    wait_until(lambda: MARK in desk.colors(), 'the mark')
    desk.press('ctrl+s')
    desk.wait_for_file('goto(0, 0, 9)\n' + TOUR.replace('1.5', '7.25').replace('-1,', '8.5,'))


@pytest.fixture
def window(tmp_path, monkeypatch):
    """The window without a screen."""
    monkeypatch.setenv('QT_QPA_PLATFORM', 'offscreen')
    application = QtWidgets.QApplication.instance() or QtWidgets.QApplication(['script_editor'])
    path = tmp_path / 'tour.script'
    path.write_bytes(ODD.encode('utf-8'))
    opened = editor.Editor(str(path))
    opened.path, opened.text = path, opened.centralWidget()
    opened.shown = lambda: application.processEvents() or opened.text.toPlainText()
    yield opened
    opened.deleteLater()


def test_all_that_was_not_typed_is_saved_as_it_was(window):
    window.text.moveCursor(QtGui.QTextCursor.Start)
    window.text.find('1.5)')
    window.text.moveCursor(QtGui.QTextCursor.EndOfLine)
    QtTest.QTest.keyClicks(window.text, '  # up')
    QtTest.QTest.keyClick(window.text, QtCore.Qt.Key_Return, QtCore.Qt.ShiftModifier)
    QtTest.QTest.keyClicks(window.text, 'wait(3)')
    assert window._save()
    assert window.path.read_bytes().decode('utf-8') == ODD.replace('1.5)', '1.5)  # up\r\nwait(3)')


def test_numbers_of_others_come_into_a_text_with_odd_characters(window):
    QtTest.QTest.keyClicks(window.text, '# first ')
    text = ODD.replace('2.0', '-12.345').replace('0.5', '0.75')
    window.path.write_bytes(text.encode('utf-8'))
    wait_until(lambda: '0.75' in window.shown(), 'the numbers')
    assert window._save()
    assert window.path.read_bytes().decode('utf-8') == '# first ' + text


def test_a_comment_that_somebody_else_has_saved_is_shown(window):
    text = ODD.replace('# a', '# the tour')
    window.path.write_bytes(text.encode('utf-8'))
    wait_until(lambda: 'the tour' in window.shown(), 'the comment')
    assert window._save()
    assert window.path.read_bytes().decode('utf-8') == text


def test_an_error_is_shown_at_its_line_until_it_is_mended(desk):
    desk.press('ctrl+Home', 'Down', 'End', 'BackSpace', 'ctrl+s')
    wait_until(lambda: desk.colors().get(ERROR, 0) > SIZE[0] * 5, 'the line to be marked')
    desk.screenshot('editor_error')
    desk.type(')')
    desk.press('ctrl+s')
    wait_until(lambda: ERROR not in desk.colors(), 'the mark to go')
    desk.wait_for_file(TOUR)


def test_a_text_that_somebody_else_has_saved_is_shown_but_not_over_what_was_typed(desk):
    desk.path.write_text('wait(5\n')
    wait_until(lambda: ERROR in desk.colors(), 'the text of somebody else, with its error')
    desk.press('ctrl+Home', 'End')
    desk.type(')')
    wait_until(lambda: '*' in desk.title(), 'the title to tell of the change')
    desk.path.write_text('print("other")\n')
    desk.press('ctrl+s')
    time.sleep(0.5)
    assert desk.path.read_text() == 'print("other")\n', 'the first Ctrl-S only says so'
    desk.press('ctrl+s')
    desk.wait_for_file('wait(5)\n')
