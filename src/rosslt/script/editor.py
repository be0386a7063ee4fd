"""A window to edit a live script in: it follows the numbers that are dragged, and shows errors where they are.

It works on the file alone, and needs neither the node `interactive_script` nor a ROS master: whoever runs the script
sees what is saved, and here is seen what they write. PyQt5 is needed for this window only.
"""

import argparse
import os
import signal
import sys
from typing import List, Optional, Tuple

import rospy
from PyQt5.QtCore import QRect, QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import (
    QCloseEvent,
    QColor,
    QFontDatabase,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QTextCursor,
    QTextFormat,
)
from PyQt5.QtWidgets import QApplication, QMainWindow, QMessageBox, QPlainTextEdit, QShortcut, QTextEdit, QWidget

from rosslt import files
from rosslt.script import execution

#: The time for which a number that was changed from outside is marked, in milliseconds.
MARKED = 1000

MARK_COLOR = QColor(255, 224, 102)
ERROR_COLOR = QColor(255, 205, 205)
GUTTER_COLOR, NUMBER_COLOR = QColor(240, 240, 240), QColor(140, 140, 140)

#: What Qt has between two lines.
BLOCK_END = '\u2029'


class Editor(QMainWindow):
    """The window.

    Args:
        path: the file to edit; it need not be there yet.
    """

    _written = pyqtSignal()

    def __init__(self, path: str) -> None:
        super().__init__()
        self._path = path
        self._saved = ''  # the text in the file, as far as it is known here
        # where the numbers of that text are by now, and what they were
        self._numbers: List[Tuple[QTextCursor, str]] = []
        self._text = _Text()
        self.setCentralWidget(self._text)
        self.setWindowTitle('{}[*] - script'.format(os.path.basename(path)))
        self.resize(720, 480)
        QShortcut(QKeySequence.Save, self, self._save_pressed)
        QShortcut(QKeySequence.Refresh, self, self._reload)
        self._text.document().modificationChanged.connect(self.setWindowModified)
        if os.path.exists(path):
            self._reload()
        else:
            self.statusBar().showMessage('{} is not there yet: Ctrl-S writes it'.format(path))
        # The watch has a thread of its own, and only the main one may touch the window.
        self._written.connect(self._file_written)
        self._watch = files.FileWatch(path, self._written.emit)

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802  (the name is Qt's)
        """Ask before anything is lost."""
        if self._text.document().isModified():
            answer = QMessageBox.question(
                self, 'script', 'Save the changes?', QMessageBox.Save | QMessageBox.Discard | QMessageBox.Cancel
            )
            if answer == QMessageBox.Cancel or (answer == QMessageBox.Save and not self._save()):
                event.ignore()

    def _save_pressed(self) -> None:
        self._save()

    def _file_written(self) -> None:
        self._follow()

    def _save(self) -> bool:
        """Write the file, with the numbers in it that were changed from outside; whether that was possible."""
        try:
            if not os.path.exists(self._path):
                with open(self._path, 'x', encoding='utf-8'):
                    self._saved = ''
            text = self._to_write()
            while not files.replace_bytes(self._path, self._saved.encode('utf-8'), text.encode('utf-8')):
                if not self._follow():
                    # The user was told that the file has another text, and saves again on purpose.
                    self._saved = _read(self._path)
                    return False
                text = self._to_write()
        except (OSError, files.FileError) as error:
            self.statusBar().showMessage(str(error))
            return False
        self._note_saved(text)
        self._check()
        return True

    def _to_write(self) -> str:
        # toPlainText would give blanks for no-break spaces, and newlines for line separators.
        return self._text.document().toRawText().replace(BLOCK_END, '\r\n' if '\r\n' in self._saved else '\n')

    def _reload(self) -> None:
        """Show what is in the file, whatever was typed."""
        try:
            text = _read(self._path)
        except files.FileError as error:
            self.statusBar().showMessage(str(error))
            return
        position = self._text.textCursor().position()
        self._text.setPlainText(text)
        cursor = self._text.textCursor()
        cursor.setPosition(min(position, self._text.document().characterCount() - 1))
        self._text.setTextCursor(cursor)
        self._note_saved(text)
        self._check()

    def _follow(self) -> bool:
        """Show what somebody else has written into the file; False where that would lose what was typed here."""
        try:
            text = _read(self._path)
        except files.FileError as error:
            self.statusBar().showMessage(str(error))
            return False
        if text == self._saved:
            return True
        if self._follow_numbers(text):
            return True
        if self._text.document().isModified():
            self.statusBar().showMessage('The file has been saved by somebody else: F5 shows it, Ctrl-S overwrites it')
            return False
        self._reload()
        return True

    def _follow_numbers(self, text: str) -> bool:
        """Take other numbers over into what was typed; False where not just numbers have changed."""
        try:
            old, new = (self._source(one) for one in (self._saved, text))
        except files.FileError:
            return False
        if _without_numbers(old) != _without_numbers(new):
            return False
        is_modified = self._text.document().isModified()
        marked = []
        for (cursor, before), literal in zip(self._numbers, new.numbers):
            after = new.text[literal.start : literal.end]
            # A number that was edited here, too, is what was typed.
            if after != before and cursor.selectedText() == before:
                start = cursor.selectionStart()
                cursor.insertText(after)
                cursor.setPosition(start)
                cursor.setPosition(start + len(after), QTextCursor.KeepAnchor)
                marked.append(cursor)
        self._saved = text
        self._numbers = [
            (cursor, new.text[literal.start : literal.end]) for (cursor, _), literal in zip(self._numbers, new.numbers)
        ]
        self._text.document().setModified(is_modified and self._to_write() != text)
        self._text.mark(marked)
        return True

    def _note_saved(self, text: str) -> None:
        """Note that the window shows what is in the file."""
        self._saved, self._numbers = text, []
        self._text.document().setModified(False)
        try:
            found = self._source(text)
        except files.FileError:
            return
        mark = len(text) - len(found.text)  # some editors begin a file with a byte order mark
        for literal in found.numbers:
            cursor = QTextCursor(self._text.document())
            cursor.setPosition(_position(text, mark + literal.start))
            cursor.setPosition(_position(text, mark + literal.end), QTextCursor.KeepAnchor)
            self._numbers.append((cursor, found.text[literal.start : literal.end]))

    def _source(self, text: str) -> files.SourceText:
        return files.SourceText(self._path, text.encode('utf-8'))

    def _check(self) -> None:
        """Show what is wrong with the script, at its line."""
        try:
            source = self._source(self._saved)
            execution.run(source, [literal.value for literal in source.numbers], say=lambda *_words: None)
        except files.FileError as error:
            self._text.show_error(error.line)
            self.statusBar().showMessage(str(error))
        else:
            self._text.show_error(None)
            self.statusBar().clearMessage()


class _Text(QPlainTextEdit):
    """The text, with the numbers of its lines beside it."""

    def __init__(self) -> None:
        super().__init__()
        self.setFont(QFontDatabase.systemFont(QFontDatabase.FixedFont))
        self.setLineWrapMode(QPlainTextEdit.NoWrap)
        self._error_line: Optional[int] = None
        self._marked: List[QTextCursor] = []
        self._gutter = _Gutter(self)
        self.blockCountChanged.connect(self._make_room)
        self.updateRequest.connect(self._scroll)
        self._make_room()

    def mark(self, cursors: List[QTextCursor]) -> None:
        """Mark ranges of the text for a moment."""
        self._marked.extend(cursors)
        self._show_marks()
        QTimer.singleShot(MARKED, lambda: self._unmark(cursors))

    def show_error(self, line: Optional[int]) -> None:
        """Mark the line that an error is in; None: no line."""
        self._error_line = line
        self._show_marks()

    def _unmark(self, cursors: List[QTextCursor]) -> None:
        self._marked = [cursor for cursor in self._marked if all(cursor is not one for one in cursors)]
        self._show_marks()

    def _show_marks(self) -> None:
        selections = []
        if self._error_line is not None:
            cursor = QTextCursor(self.document().findBlockByNumber(self._error_line - 1))
            selections.append(self._selection(cursor, ERROR_COLOR))
            selections[0].format.setProperty(QTextFormat.FullWidthSelection, True)
        selections.extend(self._selection(cursor, MARK_COLOR) for cursor in self._marked)
        self.setExtraSelections(selections)
        self._gutter.update()

    def _selection(self, cursor: QTextCursor, color: QColor) -> QTextEdit.ExtraSelection:
        selection = QTextEdit.ExtraSelection()
        selection.cursor = cursor
        selection.format.setBackground(color)
        return selection

    def gutter_width(self) -> int:
        return 16 + self.fontMetrics().horizontalAdvance('9') * max(2, len(str(self.blockCount())))

    def paint_gutter(self, event: QPaintEvent) -> None:
        """Draw the numbers of the lines that are in view."""
        painter = QPainter(self._gutter)
        painter.fillRect(event.rect(), GUTTER_COLOR)
        block = self.firstVisibleBlock()
        top = round(self.blockBoundingGeometry(block).translated(self.contentOffset()).top())
        while block.isValid() and top <= event.rect().bottom():
            height = round(self.blockBoundingRect(block).height())
            line = block.blockNumber() + 1
            if line == self._error_line:
                painter.fillRect(0, top, self._gutter.width(), height, ERROR_COLOR)
            painter.setPen(QColor('red') if line == self._error_line else NUMBER_COLOR)
            painter.drawText(0, top, self._gutter.width() - 8, height, Qt.AlignmentFlag.AlignRight, str(line))
            block, top = block.next(), top + height

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  (the name is Qt's)
        if event.matches(QKeySequence.InsertLineSeparator):  # which Python does not take as the end of a line
            self.insertPlainText('\n')
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  (the name is Qt's)
        super().resizeEvent(event)
        inside = self.contentsRect()
        self._gutter.setGeometry(QRect(inside.left(), inside.top(), self.gutter_width(), inside.height()))

    def _make_room(self) -> None:
        self.setViewportMargins(self.gutter_width(), 0, 0, 0)

    def _scroll(self, rectangle: QRect, by: int) -> None:
        if by:
            self._gutter.scroll(0, by)
        else:
            self._gutter.update(0, rectangle.y(), self._gutter.width(), rectangle.height())


class _Gutter(QWidget):
    """The strip with the numbers of the lines."""

    def __init__(self, text: '_Text') -> None:
        super().__init__(text)
        self._text = text

    def sizeHint(self) -> QSize:  # noqa: N802  (the name is Qt's)
        return QSize(self._text.gutter_width(), 0)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802  (the name is Qt's)
        self._text.paint_gutter(event)


def _read(path: str) -> str:
    try:
        return files.read_settled_bytes(path).decode('utf-8')
    except UnicodeDecodeError as error:
        raise files.FileError(path, None, None, f'it is not in UTF-8: {error.reason}') from None


def _without_numbers(source: files.SourceText) -> List[str]:
    """The pieces of a text between its numbers."""
    starts = [0, *(literal.end for literal in source.numbers)]
    ends = [*(literal.start for literal in source.numbers), len(source.text)]
    return [source.text[start:end] for start, end in zip(starts, ends)]


def _position(text: str, index: int) -> int:
    """A position in a text as Qt counts it: in units of UTF-16, of which the end of a line is one."""
    return len(text[:index].replace('\r\n', '\n').encode('utf-16-le')) // 2


def main() -> int:
    """Open the window; returns when it is closed."""
    parser = argparse.ArgumentParser(
        prog='script_editor',
        description='Edit a live script. Ctrl-S saves and so runs it, F5 shows what is in the file.',
    )
    parser.add_argument('file', help='the script')
    arguments = parser.parse_args(rospy.myargv()[1:])
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Qt does not come back to Python to hear of it
    application = QApplication(sys.argv[:1])
    window = Editor(os.path.abspath(arguments.file))
    window.show()
    return int(application.exec_())
