"""A source file in Python as bytes, its numbers, how they are replaced, and which is which after an edit."""

import ast
import hashlib
import io
import tokenize
from collections import Counter
from typing import Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt.files.errors import FileError
from rosslt.files.notation import in_manner_of
from rosslt.files.python_numbers import NEWLINE, Positions, numbers_in, without_numbers

#: What stands for a number in a line: no text has it, as Python takes no null.
_BLANK = '\0'


def digest_of(content: bytes) -> str:
    """The hash of a file's content."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


class Edit(NamedTuple):
    """A part of a file that gets another text.

    Attributes:
        file: its path.
        digest: the hash of the content that the edit is meant for.
        start, end: the range in that content, in bytes.
        old, new: what stands there, and what takes its place.
        what: for people, what is changed: `/patrol/speed`.
    """

    file: str
    digest: str
    start: int
    end: int
    old: bytes
    new: bytes
    what: str = ''


class SourceText:
    """A Python file.

    Args:
        path: for errors.
        content: of the file.

    Attributes:
        path, content: the same.
        digest: the hash of the content.
        numbers: its Numbers, in the order of the text.

    Raises:
        FileError: it is not in Python syntax, or cannot be decoded.
    """

    def __init__(self, path: str, content: bytes) -> None:
        self.path = path
        self.content = content
        self.digest = digest_of(content)
        try:
            self._encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
            self.text = content.decode(self._encoding)
            self.tree = ast.parse(self.text)
            numbers = numbers_in(self.tree, self.text)
            self._skeleton: Optional[str] = None
        except SyntaxError as error:
            raise FileError(path, error.lineno or 1, error.offset or 1, str(error.msg)) from None
        except (ValueError, RecursionError, MemoryError) as error:
            raise FileError(path, None, None, f'it cannot be read: {error}') from None
        self.numbers = [number for number, _ in numbers]
        self._indices = {(number.line, number.column): index for index, number in enumerate(self.numbers)}

    @property
    def skeleton(self) -> str:
        """What two texts have in common that differ in their numbers, comments and layout alone."""
        if self._skeleton is None:
            tree = ast.parse(self.text)
            self._skeleton = ast.dump(without_numbers(tree, [node for _, node in numbers_in(tree, self.text)]))
        return self._skeleton

    def number_at(self, line: int, column: int) -> Optional[int]:
        """The index of the number that begins there; both count from 1, in characters."""
        return self._indices.get((line, column))

    def argument_of_call(self, line: int, column: int, position: int, keyword: str) -> Optional[int]:
        """The index of the number that is an argument of the call that begins there; None where it is no number."""
        positions = Positions(self.text)
        start = positions.of(line, 0) + column - 1
        for node in ast.walk(self.tree):
            if not isinstance(node, ast.Call) or positions.of(node.lineno, node.col_offset) != start:
                continue
            given = [one.value for one in node.keywords if one.arg == keyword]
            given += node.args[position : position + 1]
            for argument in given:
                begin = positions.of(argument.lineno, argument.col_offset)
                end = positions.of(argument.end_lineno or 0, argument.end_col_offset or 0)
                for index, number in enumerate(self.numbers):
                    if (number.start, number.end) == (begin, end):
                        return index
        return None

    def edits(self, values: Dict[int, float], what: Optional[Dict[int, str]] = None) -> List[Edit]:
        """What makes the file say other numbers, and leaves every other byte as it is.

        Args:
            values: {index of a number: its value}.
            what: {index of a number: what people call it}.

        Raises:
            FileError: a number cannot stand where another one does.
        """
        wanted = {index: value for index, value in values.items() if not _is_same(self.numbers[index].value, value)}
        spelled = {index: self._spelled(index, value) for index, value in wanted.items()}
        if not self._reads(spelled, wanted):
            # Parentheses for the places where a number with another sign would mean something else: 2 ** 2, return-1
            for index, spelling in spelled.items():
                if not self._reads({index: spelling}, {index: wanted[index]}):
                    spelled[index] = f'({spelling})'
            if not self._reads(spelled, wanted):
                number = self.numbers[min(spelled)]
                raise FileError(self.path, number.line, number.column, f'{spelled[min(spelled)]} cannot stand here')
        made = []
        for index, spelling in sorted(spelled.items()):
            number = self.numbers[index]
            start, end = (self._offset(place) for place in (number.start, number.end))
            called = (what or {}).get(index, '')
            made.append(Edit(self.path, self.digest, start, end, self.content[start:end], spelling.encode(), called))
        return made

    def _spelled(self, index: int, value: float) -> str:
        number = self.numbers[index]
        return in_manner_of(self.text[number.start : number.end], value)

    def _reads(self, spelled: Dict[int, str], values: Dict[int, float]) -> bool:
        """Whether the text with other spellings has these values, and is the same program otherwise."""
        text = self.text
        for index, spelling in sorted(spelled.items(), reverse=True):
            text = text[: self.numbers[index].start] + spelling + text[self.numbers[index].end :]
        try:
            made = SourceText(self.path, text.encode(self._encoding))
        except FileError:
            return False
        expected = [values.get(index, number.value) for index, number in enumerate(self.numbers)]
        return (
            len(made.numbers) == len(expected)
            and all(_is_same(number.value, value) for number, value in zip(made.numbers, expected))
            and made.skeleton == self.skeleton
        )

    def _offset(self, place: int) -> int:
        """A place in the text, in bytes of the content."""
        # Where a byte order mark is skipped, encoding puts it back, also in front of no text.
        return len(self.text[:place].encode(self._encoding))


def _is_same(one: float, other: float) -> bool:
    return one == other and repr(float(one)) == repr(float(other))


def replaced(content: bytes, edits: Sequence[Edit]) -> bytes:
    """A content with edits done, which are meant for it."""
    for edit in sorted(edits, key=lambda one: one.start, reverse=True):
        content = content[: edit.start] + edit.new + content[edit.end :]
    return content


class Followed(NamedTuple):
    """What has become of a text that somebody has edited.

    Attributes:
        numbers: {index of a number in the text before: its index in the new one}.
        lines: the lines of the new text, from 1, that are others than before but for their numbers.
        has_lost_lines: whether lines of the text before are gone.
    """

    numbers: Dict[int, int]
    lines: List[int]
    has_lost_lines: bool


def followed(old: SourceText, new: SourceText) -> Followed:
    """Which number of a file that somebody has edited is which of the file before.

    A number is followed where that is certain: its line reads the same but for numbers, blanks and comments, and there
    are as many such lines in its function as before, of which it is in the same one.
    """
    lines_before, lines_after = _lines_by_template(old), _lines_by_template(new)
    on_line_before, on_line_after = _numbers_by_line(old), _numbers_by_line(new)
    numbers: Dict[int, int] = {}
    for key, before in lines_before.items():
        after = lines_after.get(key, [])
        if len(before) == len(after):
            for one, other in zip(before, after):
                numbers.update(zip(on_line_before.get(one, ()), on_line_after.get(other, ())))
    kept = {key for key, after in lines_after.items() if len(lines_before.get(key, ())) == len(after)}
    changed = [line for key, after in lines_after.items() if key not in kept for line in after]
    return Followed(numbers, sorted(changed), bool(lines_before.keys() - lines_after.keys()))


def _lines_by_template(source: SourceText) -> Dict[Tuple[str, str], List[int]]:
    """{(function, line without its numbers): [numbers of such lines, from 1]}, without lines that say nothing."""
    starts = [0] + [match.end() for match in NEWLINE.finditer(source.text)]
    ends = [*starts[1:], len(source.text)]
    cut = _comment_starts(source)
    functions = _functions_by_line(source.tree, len(starts))
    by_line = _numbers_by_line(source)
    found: Dict[Tuple[str, str], List[int]] = {}
    for line, (start, end) in enumerate(zip(starts, ends), 1):
        parts = []
        for index in by_line.get(line, ()):
            number = source.numbers[index]
            parts += [source.text[start : number.start], _BLANK]
            start = number.end
        parts.append(source.text[start : max(start, min(end, starts[line - 1] + cut.get(line, end)))])
        template = ''.join(''.join(parts).split())
        if template:
            found.setdefault((functions[line - 1], template), []).append(line)
    return found


def _numbers_by_line(source: SourceText) -> Dict[int, List[int]]:
    """{line: [indices of the numbers in it]}, of those that end where they begin."""
    found: Dict[int, List[int]] = {}
    for index, number in enumerate(source.numbers):
        if not NEWLINE.search(source.text, number.start, number.end):
            found.setdefault(number.line, []).append(index)
    return found


def _comment_starts(source: SourceText) -> Dict[int, int]:
    """{line: the column, from 0, at which a comment begins in it}."""
    found = {}
    try:
        for token in tokenize.generate_tokens(io.StringIO(source.text).readline):
            if token.type == tokenize.COMMENT:
                found[token.start[0]] = token.start[1]
    except (tokenize.TokenError, SyntaxError):
        return {}
    return found


def _functions_by_line(tree: ast.AST, count: int) -> List[str]:
    """For each line, the qualified name of the function or class that it is in."""
    names = [''] * count
    waiting: List[Tuple[ast.AST, str]] = [(tree, '')]
    while waiting:
        node, name = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            name = f'{name}.{node.name}'.lstrip('.')
            last = node.end_lineno or node.lineno
            names[node.lineno - 1 : last] = [name] * (last - node.lineno + 1)
        waiting.extend((child, name) for child in ast.iter_child_nodes(node))
    return names


def changed_elsewhere(old: SourceText, new: SourceText, result: Followed, locations: Set[int]) -> List[int]:
    """The lines of a new text in which more is another than the numbers that are locations.

    Args:
        result: what `followed` says.
        locations: indices, in the old text, of the numbers that are locations.
    """
    lines = Counter(result.lines)
    for before, after in result.numbers.items():
        if before not in locations and not _is_same(old.numbers[before].value, new.numbers[after].value):
            lines[new.numbers[after].line] += 1
    return sorted(lines)
