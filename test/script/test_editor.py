"""The editor window, without a screen: keys are pressed, and the window and the file are checked."""

import importlib
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from support.processes import wait_until

TOUR = '# tour\ngoto(2.0, 1.0, 1.5)\nwait(1)\ngoto(-1, 2, 0.5)\n'

#: A tour with what Qt takes as the end of a line, what it shows as a blank, and line ends of another system.
ODD = "# a\u00a0b\u2028c\x0c\r\ngoto(2.0, 1.0, 1.5)\r\nprint('\u00a0')\r\nwait(1)\r\n\r\ngoto(-1, 2, 0.5)"

PROGRAM = Path(__file__).resolve().parents[2] / 'scripts/script_editor'

pytest.importorskip('PyQt5', reason='the window needs PyQt5')
editor = importlib.import_module('rosslt.script.editor')
QtCore, QtGui, QtTest, QtWidgets = [
    importlib.import_module('PyQt5.' + name) for name in ('QtCore', 'QtGui', 'QtTest', 'QtWidgets')
]


class Desk:
    """The window with a file, and a keyboard."""

    def __init__(self, path, text):
        self.path = path
        self.write(text)
        self.window = editor.Editor(str(path))
        self.text = self.window.centralWidget()

    def write(self, text):
        """Write the file as somebody else does."""
        self.path.write_bytes(text.encode('utf-8'))

    @property
    def saved(self):
        return self.path.read_bytes().decode('utf-8')

    def go(self, word):
        """Put the cursor behind a word."""
        self.text.moveCursor(QtGui.QTextCursor.Start)
        assert self.text.find(word)
        cursor = self.text.textCursor()
        cursor.clearSelection()
        self.text.setTextCursor(cursor)

    def type(self, words):
        QtTest.QTest.keyClicks(self.text, words)

    def save(self):
        """Press Ctrl-S."""
        (pressed,) = [one for one in self.window.findChildren(QtWidgets.QShortcut) if one.key().toString() == 'Ctrl+S']
        pressed.activated.emit()

    def shown(self):
        """The text in the window, after all that happened has been seen."""
        QtWidgets.QApplication.processEvents()
        return self.text.toPlainText()

    def marked(self, color):
        """The words that are marked with a color."""
        self.shown()
        return [
            one.cursor.selectedText() or one.cursor.block().text()
            for one in self.text.extraSelections()
            if one.format.background().color() == color
        ]


@pytest.fixture(scope='module')
def application():
    """Qt's one application in this process, and the windows: the threads that watch their files outlive each test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('QT_QPA_PLATFORM', 'offscreen')
        yield QtWidgets.QApplication(['script_editor']), []


@pytest.fixture
def open_desk(tmp_path, application):
    """A function that opens a file with a text."""

    def open_file(text):
        application[1].append(Desk(tmp_path / 'tour.script', text))
        return application[1][-1]

    return open_file


def test_what_is_typed_is_saved_with_ctrl_s(open_desk):
    desk = open_desk(TOUR)
    desk.go('1.5)')
    desk.type('  # up')
    assert desk.window.isWindowModified()
    assert desk.saved == TOUR
    desk.save()
    assert desk.saved == TOUR.replace('1.5)', '1.5)  # up')
    assert not desk.window.isWindowModified()


def test_all_that_was_not_typed_is_saved_as_it_was(open_desk):
    desk = open_desk(ODD)
    desk.go('1.5)')
    desk.type('  # up')
    QtTest.QTest.keyClick(desk.text, QtCore.Qt.Key_Return, QtCore.Qt.ShiftModifier)
    desk.type('wait(3)')
    desk.save()
    assert desk.saved == ODD.replace('1.5)', '1.5)  # up\r\nwait(3)')


def test_a_number_that_is_changed_from_outside_is_marked_for_a_moment(open_desk):
    desk = open_desk(TOUR)
    desk.write(TOUR.replace('1.0', '-12.345'))
    wait_until(lambda: desk.marked(editor.MARK_COLOR) == ['-12.345'], 'the mark')
    wait_until(lambda: not desk.marked(editor.MARK_COLOR), 'the mark to go')
    assert not desk.window.isWindowModified()


@pytest.mark.parametrize('tour', [TOUR, ODD], ids=['plain', 'odd'])
def test_what_is_typed_and_what_is_dragged_meanwhile_are_both_saved(open_desk, tour):
    desk = open_desk(tour)
    desk.text.moveCursor(QtGui.QTextCursor.Start)
    desk.type('# first ')
    text = tour.replace('2.0', '-12.345').replace('0.5', '0.75')
    desk.write(text)
    wait_until(lambda: '0.75' in desk.shown(), 'the numbers')
    desk.save()
    assert desk.saved == '# first ' + text


def test_a_comment_that_somebody_else_has_saved_is_shown(open_desk):
    desk = open_desk(ODD)
    desk.write(ODD.replace('# a', '# the tour'))
    wait_until(lambda: 'the tour' in desk.shown(), 'the comment')
    desk.save()
    assert desk.saved == ODD.replace('# a', '# the tour')


def test_an_error_is_shown_at_its_line_until_it_is_mended(open_desk):
    desk = open_desk(TOUR)
    desk.go('1.5)')
    QtTest.QTest.keyClick(desk.text, QtCore.Qt.Key_Backspace)
    desk.save()
    assert desk.marked(editor.ERROR_COLOR) == ['goto(2.0, 1.0, 1.5']
    desk.type(')')
    desk.save()
    assert desk.marked(editor.ERROR_COLOR) == []
    assert desk.saved == TOUR


def test_a_text_that_somebody_else_has_saved_is_not_shown_over_what_was_typed(open_desk):
    desk = open_desk('wait(5\n')
    desk.go('wait(5')
    desk.type(')')
    desk.write('print("other")\n')
    desk.save()
    assert desk.saved == 'print("other")\n', 'the first Ctrl-S only says so'
    desk.save()
    assert desk.saved == 'wait(5)\n'


def test_it_is_a_program_that_an_interrupt_ends(tmp_path, monkeypatch):
    monkeypatch.setenv('QT_QPA_PLATFORM', 'offscreen')
    path = tmp_path / 'tour.script'
    path.write_text(TOUR)
    with subprocess.Popen([sys.executable, str(PROGRAM), str(path)], stderr=subprocess.PIPE, text=True) as process:
        maps = Path(f'/proc/{process.pid}/maps')
        wait_until(lambda: 'libqoffscreen' in maps.read_text(), 'the window')
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
