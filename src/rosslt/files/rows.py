"""Rows of lists in text files: one is duplicated, deleted or moved where it stands, and every other byte stays.

A row is one of the alike elements of a list, each on lines of its own: what `python_rows` and `yaml_rows` find. The
comment at the end of a row's last line goes with it; lines between rows, blank or with a comment, stay where they are.
"""

import re
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple, TypeVar

from rosslt.files.errors import FileError

DUPLICATE, DELETE, UP, DOWN = 'duplicate', 'delete', 'up', 'down'

#: What may be done with a row.
OPERATIONS = (DUPLICATE, DELETE, UP, DOWN)

_NEWLINE = re.compile(r'\r\n|\r|\n')
_COMMA = re.compile(r'[ \t]*,')
_GAP = re.compile(r'(?:\r\n|\r|\n)[ \t]*')

_Element = TypeVar('_Element')


class Row(NamedTuple):
    """A row in a text: text[start:end] is its element.

    Attributes:
        start, end: of the element, with the dash in front of an item in YAML.
        comma: where the comma behind it ends; `end` if there is none.
        tail: where the blanks and the comment at the end of its last line begin.
        line_end: where its last line ends, in front of the line break.
    """

    start: int
    end: int
    comma: int
    tail: int
    line_end: int


class Rows(NamedTuple):
    """The rows of one list in a text.

    Attributes:
        file, text: where they stand.
        ranges: (start, end) of each element.
        position: which of them is meant.
        opening: where what opens the list on the line of its first row ends: a bracket, or dashes in YAML; -1 if
            nothing does.
        separator: what stands between two of them, ',' or ''.
        is_tuple: whether it is a tuple, which needs a comma behind its only element.
        comment_at: gives the place of the comment in the line that a place is in, or that line's end.
    """

    file: str
    text: str
    ranges: Sequence[Tuple[int, int]]
    position: int
    opening: int
    separator: str
    is_tuple: bool
    comment_at: Callable[[int], int]

    def refusal(self, reason: str, place: int) -> FileError:
        """The FileError about a place in the text."""
        return refusal(self.file, self.text, place, reason)


def refusal(file: str, text: str, place: int, reason: str) -> FileError:
    """The FileError about a place in a text."""
    return FileError(file, line_of(text, place), place - line_start(text, place) + 1, reason)


def line_of(text: str, place: int) -> int:
    """The number, from 1, of the line that a place is in."""
    return len(_NEWLINE.findall(text, 0, place)) + 1


def place_of(text: str, line: int, column: int) -> int:
    """The place at a line and a column, from 1; the end of the text if it has no such line."""
    starts = [0] + [match.end() for match in _NEWLINE.finditer(text)]
    return starts[line - 1] + column - 1 if 1 <= line <= len(starts) else len(text)


def check_alike(rows: Rows, shapes: Sequence[object]) -> None:
    """Raise FileError unless all rows have the same shape."""
    for number, shape in enumerate(shapes):
        if shape != shapes[rows.position]:
            line = line_of(rows.text, rows.ranges[number][0])
            reason = f'it is no row of a list of alike ones: element {number}, in line {line}, is of another shape'
            raise rows.refusal(f'{reason}; edit the file by hand', rows.ranges[rows.position][0])


def line_start(text: str, place: int) -> int:
    """The start of the line that a place is in, behind a byte order mark."""
    return max(text.rfind('\n', 0, place) + 1, text.rfind('\r', 0, place) + 1, text.startswith('\ufeff'))


def line_end(text: str, place: int) -> int:
    """The end of the line that a place is in, in front of its line break."""
    found = _NEWLINE.search(text, place)
    return found.start() if found else len(text)


def check_operation(operation: str) -> None:
    """Raise ValueError unless it is one of OPERATIONS."""
    if operation not in OPERATIONS:
        raise ValueError(f'{operation!r} is none of {", ".join(OPERATIONS)}')


def operate(elements: List[_Element], index: int, operation: str) -> None:
    """Do an operation with an element of a list."""
    if operation == DUPLICATE:
        elements.insert(index + 1, elements[index])
    elif operation == DELETE:
        del elements[index]
    else:
        elements.insert(index - 1 if operation == UP else index + 1, elements.pop(index))


def index_after(index: int, row: int, operation: str) -> Optional[int]:
    """Return the index of an element of a list after an operation with one of them; None if that has deleted it.

    Args:
        index: of the element.
        row: of the one that the operation is done with.
    """
    places: List[int] = list(range(max(index, row) + 2))
    operate(places, row, operation)
    return places.index(index) if index in places else None


def index_before(index: int, row: int, operation: str) -> Optional[int]:
    """Return the index of an element of a list before an operation with one of them; None if it is the copy that was
    made.

    Args:
        index: of the element, after the operation.
        row: of the one that the operation was done with, before it.
    """
    if operation == DUPLICATE and index == row + 1:
        return None
    places: List[int] = list(range(max(index, row) + 3))
    operate(places, row, operation)
    return places[index]


def after(rows: Rows, operation: str) -> str:
    """The text after an operation with a row.

    Raises:
        FileError: the rows do not stand on lines of their own, or the row cannot be moved or deleted.
    """
    found, index = _found(rows), rows.position
    place = found[index].start
    if operation == DUPLICATE:
        return _duplicated(rows, found)
    if operation == DELETE:
        if len(found) == 1:
            raise rows.refusal('it is the only row of its list, which needs one; delete the list by hand', place)
        return _deleted(rows, found)
    if operation == UP and index == 0:
        raise rows.refusal('it is the first row of its list, and cannot move up', place)
    if operation == DOWN and index == len(found) - 1:
        raise rows.refusal('it is the last row of its list, and cannot move down', place)
    upper = index - 1 if operation == UP else index
    return _swapped(rows.text, found[upper], found[upper + 1])


def with_copies(rows: Rows, count: int, below: int = 0) -> Tuple[str, List[int]]:
    """The text with copies of a row below it, or below so many rows more, and where each of them begins.

    The comment at the end of a row stays with the row.

    Raises:
        FileError: the rows do not stand on lines of their own.
    """
    found = _found(rows)
    text, (start, end), row = rows.text, rows.ranges[rows.position], found[rows.position + below]
    element, comma, line_break = text[start:end], text[row.end : row.comma], _line_break(rows, found)
    is_alone = row.tail == row.comma  # and no bracket stands behind it, which would have to go below the copies
    rest = row.line_end if is_alone else row.comma
    changed = text[: row.end] + (comma or rows.separator) + text[row.tail : row.line_end] * is_alone
    starts: List[int] = []
    for number in range(count):
        changed += line_break
        starts.append(len(changed))
        changed += element + (comma if number == count - 1 else comma or rows.separator)
    return changed + text[rest:], starts


def difference(before: str, changed: str) -> Tuple[int, int, str]:
    """The range of a text in which another differs from it, and what that has there: start, end and a text."""
    least = min(len(before), len(changed))
    start = next((place for place in range(least) if before[place] != changed[place]), least)
    same = next((n for n in range(least - start) if before[-1 - n] != changed[-1 - n]), least - start)
    return start, len(before) - same, changed[start : len(changed) - same]


def _found(rows: Rows) -> List[Row]:
    """The rows with what stands behind each."""
    text = rows.text
    found: List[Row] = []
    for (_, end), (start, _) in zip(rows.ranges, rows.ranges[1:]):
        if start < line_end(text, end):
            reason = 'two rows of its list stand on one line; put each on a line of its own, and try again'
            raise rows.refusal(reason, start)
    for start, end in rows.ranges:
        last = line_end(text, end)
        comma = _COMMA.match(text, end, last) if rows.separator else None
        behind = comma.end() if comma else end
        tail = behind + len(text[behind : rows.comment_at(end)].rstrip(' \t'))
        found.append(Row(start, end, behind, tail, last))
        is_first = len(found) == 1 and rows.opening >= 0 and not text[rows.opening : start].strip(' \t')
        if _indentation(text, start).strip(' \t') and not is_first:
            raise rows.refusal('something else stands in front of the row on its line; put the row on its own', start)
        is_last = len(found) == len(rows.ranges)
        if tail > behind and (not is_last or not rows.separator):
            raise rows.refusal('something else stands behind the row on its line; put the row on its own', end)
    return found


def _indentation(text: str, place: int) -> str:
    """Return the part of a line in front of a place."""
    return text[line_start(text, place) : place]


def _swapped(text: str, one: Row, other: Row) -> str:
    return ''.join(
        (
            text[: one.start],
            text[other.start : other.end],
            text[one.end : one.tail],
            text[other.tail : other.line_end],
            text[one.line_end : other.start],
            text[one.start : one.end],
            text[other.end : other.tail],
            text[one.tail : one.line_end],
            text[other.line_end :],
        )
    )


def _duplicated(rows: Rows, found: List[Row]) -> str:
    text, row = rows.text, found[rows.position]
    return ''.join(
        (
            text[: row.end],
            text[row.end : row.comma] or rows.separator,
            text[row.tail : row.line_end],
            _line_break(rows, found),
            text[row.start : row.end],
            text[row.end :],
        )
    )


def _line_break(rows: Rows, found: List[Row]) -> str:
    """Return the line break and the indentation between a row and a copy of it below."""
    text, row = rows.text, found[rows.position]
    indentation = _indentation(text, row.start)
    if indentation.strip(' \t'):
        # The first row stands behind what opens the list.
        below = found[1:2]
        indentation = _indentation(text, below[0].start) if below else re.sub(r'[^\t]', ' ', indentation)
    newline = _NEWLINE.search(text, row.line_end) or _NEWLINE.search(text)
    return (newline[0] if newline else '\n') + indentation


def _deleted(rows: Rows, found: List[Row]) -> str:
    text, index = rows.text, rows.position
    row, is_last = found[index], index == len(found) - 1
    below = found[1]
    if rows.is_tuple and len(found) == 2 and index == 0 and below.comma == below.end:
        text = text[: below.end] + rows.separator + text[below.end :]
    if _indentation(text, row.start).strip(' \t'):
        is_next = _GAP.fullmatch(text, row.line_end, below.start)
        return text[: row.start] + text[below.start if is_next else row.line_end :]
    above = found[index - 1]
    rest = text[row.comma : row.tail]
    # The last row may have no comma; that of a tuple of one stays.
    keeps_comma = not is_last or row.comma > row.end or (rows.is_tuple and len(found) == 2)
    if rest:
        if not _GAP.fullmatch(text, above.line_end, row.start):
            return text[: row.start] + rest + text[row.line_end :]
        kept = text[: above.comma if keeps_comma else above.end]
        return kept + rest + text[above.tail : above.line_end] + text[row.line_end :]
    start, newline = line_start(text, row.start), _NEWLINE.match(text, row.line_end)
    end = newline.end() if newline else row.line_end
    if not newline:  # the file ends without one, and still does
        start -= 2 if text[:start].endswith('\r\n') else 1
    if keeps_comma:
        return text[:start] + text[end:]
    return text[: above.end] + text[above.comma : start] + text[end:]
