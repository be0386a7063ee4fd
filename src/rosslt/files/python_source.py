"""A source file in Python as bytes, its literals, how they are replaced, and which is which after an edit."""

import ast
import contextlib
import hashlib
import io
import itertools
import tokenize
from collections import Counter
from typing import Collection, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, alike, in_manner_of, text_in_manner_of
from rosslt.files.python_literals import (
    CLOSING,
    NEWLINE,
    Literal,
    Positions,
    last_ends,
    literals_in,
    without_literals,
)

#: The placeholders of a number, and of a text or truth value, in a line. Python allows no null characters in a file.
_BLANK, _BLANK_WORD = '\0', '\0\0'

_TOO_DEEP = 'it is nested too deeply'


def digest_of(content: bytes) -> str:
    """The hash of a file's content."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


class Edit(NamedTuple):
    """A part of a file that gets another text.

    Attributes:
        file: its path.
        digest: the hash of the content that the edit is meant for.
        start, end: the range in that content, in bytes.
        old, new: the present text, and the text that replaces it.
        what: for people, what is changed: `/patrol/speed`.
    """

    file: str
    digest: str
    start: int
    end: int
    old: bytes
    new: bytes
    what: str = ''


class Standing(NamedTuple):
    """A value in a file: its range in the content, in bytes, and what it reads as."""

    start: int
    end: int
    value: object


class SourceText:
    """A Python file.

    Args:
        path: for errors.
        content: of the file.

    Attributes:
        path, content: the same.
        digest: the hash of the content.
        literals: its numbers, and then its texts and truth values; indices are those in this list.
        numbers: the numbers alone.

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
            self.literals = [literal for literal, _ in self._literals_in(self.tree)]
        except SyntaxError as error:
            raise FileError(path, error.lineno or 1, error.offset or 1, str(error.msg)) from None
        except (RecursionError, MemoryError):
            raise FileError(path, None, None, _TOO_DEEP) from None
        except ValueError as error:
            raise FileError(path, None, None, f'it cannot be read: {error}') from None
        self.numbers = [literal for literal in self.literals if type(literal.value) in (int, float)]
        self._skeleton: Optional[str] = None
        self._calls: Optional[Dict[int, List[ast.Call]]] = None  # by the index that they begin at
        self._indices = {(literal.line, literal.column): index for index, literal in enumerate(self.literals)}

    def _literals_in(self, tree: ast.AST) -> List[Tuple[Literal, ast.AST]]:
        # The services that tell of edits are in UTF-8.
        return [
            (literal, node)
            for literal, node in literals_in(tree, self.text)
            if self._is_utf8 or self.text[literal.start : literal.end].isascii()
        ]

    @property
    def _is_utf8(self) -> bool:
        return self._encoding.startswith('utf-8')

    def program(self, count: Optional[int] = None) -> ast.Module:
        """Its syntax tree, in which `__literals__[index]` stands for the first so many of its literals, or for all."""
        tree = ast.parse(self.text)
        nodes = [node for _, node in self._literals_in(tree)][:count]
        return without_literals(tree, {node: index for index, node in enumerate(nodes)})

    @property
    def skeleton(self) -> str:
        """The program without its literals, comments and layout.

        Raises:
            FileError: it is nested too deeply, or has an integer that is too long to be written.
        """
        if self._skeleton is None:
            with self._that_can_be_walked():
                self._skeleton = ast.dump(self.program())
        return self._skeleton

    def blocks(self) -> str:
        """The program without its literals, comments and layout, and without the order of the statements of the module
        and of its classes.

        Raises:
            FileError: it is nested too deeply, or has an integer that is too long to be written.
        """
        with self._that_can_be_walked():
            tree = ast.parse(self.text)
            without_literals(tree, dict.fromkeys((node for _, node in self._literals_in(tree)), 0))
            for node in reversed([*ast.walk(tree)]):
                if isinstance(node, (ast.Module, ast.ClassDef)):
                    node.body.sort(key=ast.dump)
            return ast.dump(tree)

    @contextlib.contextmanager
    def _that_can_be_walked(self) -> Iterator[None]:
        try:
            yield
        except (RecursionError, MemoryError):
            raise FileError(self.path, None, None, _TOO_DEEP) from None
        except ValueError as error:
            raise FileError(self.path, None, None, str(error)) from None

    def literal_at(self, line: int, column: int) -> Optional[int]:
        """The index of the literal that begins there; both count from 1, in characters."""
        return self._indices.get((line, column))

    def number_at(self, line: int, column: int) -> Optional[int]:
        """The index of the number that begins there; both count from 1, in characters."""
        index = self.literal_at(line, column)
        return None if index is None or index >= len(self.numbers) else index

    def argument_of_call(
        self, line: int, column: int, position: int, keyword: str, path: Sequence[str] = ()
    ) -> Optional[int]:
        """The index of the literal that is an argument of the call that begins there; None if the argument is not a
        literal.

        Args:
            line, column: of the call; both count from 1.
            position, keyword: of the argument.
            path: the indices and keys from the argument to a literal in it, if that is a list or a dict.
        """
        positions = Positions(self.text)
        given = self._arguments_of_call(line, column, position, keyword)
        for argument in (_part_at(one, path) for one in given):
            if argument is None:
                continue
            for index, literal in enumerate(self.literals):
                if (literal.start, literal.end) == positions.range_of(argument):
                    return index
        return None

    def name_of_argument(self, line: int, column: int, position: int, keyword: str) -> str:
        """The text of an argument of the call that begins there, if that is a name, an attribute or an element of
        something, as `GOAL[0]`; '' if not.

        Args:
            line, column, position, keyword: as in `argument_of_call`.
        """
        positions = Positions(self.text)
        for argument in self._arguments_of_call(line, column, position, keyword):
            if isinstance(argument, (ast.Name, ast.Attribute, ast.Subscript)):
                return ' '.join(self.text[slice(*positions.range_of(argument))].split())
        return ''

    def _arguments_of_call(self, line: int, column: int, position: int, keyword: str) -> List[ast.expr]:
        positions = Positions(self.text)
        if self._calls is None:
            self._calls = {}
            for call in (node for node in ast.walk(self.tree) if isinstance(node, ast.Call)):
                self._calls.setdefault(positions.of(call.lineno, call.col_offset), []).append(call)
        calls = self._calls.get(positions.of(line, 0) + column - 1)
        if not calls:
            return []
        # In `get_param('~a', 'b').replace('c', 'd')` both calls begin there, and the first one gives the value.
        node = min(calls, key=lambda call: (call.end_lineno or 0, call.end_col_offset or 0))
        return [one.value for one in node.keywords if one.arg == keyword] + node.args[position : position + 1]

    def edits(self, values: Mapping[int, Scalar]) -> List[Edit]:
        """Make the edits that give literals other values, and leave every other byte as it is.

        Args:
            values: {index of a literal: its value, of the same kind}.

        Raises:
            FileError: a value cannot stand in the place of the old one.
        """
        wanted = {index: value for index, value in values.items() if not _is_same(self.literals[index].value, value)}
        spelled = {index: self._spelled(index, value) for index, value in wanted.items()}
        for index, value in wanted.items():
            if not alike(self.literals[index].value, value):
                raise self._refusal(index, spelled[index])
        if not self._reads(spelled, wanted):
            # A number with another sign may mean something else without parentheses: `2 ** 2`, `return-1`.
            spelled = {
                index: spelling if self._reads({index: spelling}, wanted) else f'({spelling})'
                for index, spelling in spelled.items()
            }
            if not self._reads(spelled, wanted):
                raise self._refusal(*min(spelled.items()))
        return [self._edit(index, spelling) for index, spelling in sorted(spelled.items())]

    def _refusal(self, index: int, spelling: str) -> FileError:
        literal = self.literals[index]
        return FileError(self.path, literal.line, literal.column, f'{spelling} cannot stand here')

    def edit(self, start: int, end: int, new: str) -> Edit:
        """The edit that puts another text in the place of text[start:end]."""
        first, last = self._offset(start), self._offset(end)
        written = new.encode('utf-8' if self._is_utf8 else self._encoding)
        return Edit(self.path, self.digest, first, last, self.content[first:last], written)

    def _edit(self, index: int, spelling: str) -> Edit:
        return self.edit(*self.literals[index][:2], spelling)

    def _spelled(self, index: int, value: Scalar) -> str:
        old = self.text[self.literals[index].start : self.literals[index].end]
        if isinstance(value, str):
            return text_in_manner_of(old, value, self._is_utf8)
        return repr(value) if isinstance(value, bool) else in_manner_of(old, value)

    def _reads(self, spelled: Dict[int, str], values: Mapping[int, Scalar]) -> bool:
        """Return whether the text with other spellings has these values, and is the same program otherwise."""
        edits = [self._edit(index, spelling) for index, spelling in spelled.items()]
        try:
            made = SourceText(self.path, replaced(self.content, edits))
        except FileError:
            return False
        expected = [values[index] if index in spelled else literal.value for index, literal in enumerate(self.literals)]
        return (
            len(made.literals) == len(expected)
            and all(_is_same(literal.value, value) for literal, value in zip(made.literals, expected))
            and made.skeleton == self.skeleton
        )

    def _offset(self, place: int) -> int:
        """Convert a position in the text to an offset in the bytes of the content."""
        # If a byte order mark is skipped, encoding puts it back, also in front of no text.
        return len(self.text[:place].encode(self._encoding))


def _part_at(node: Optional[ast.expr], path: Sequence[str]) -> Optional[ast.expr]:
    """The expression at a path of indices and keys in the list or dict that an expression writes out."""
    for step in path:
        parts: Dict[str, ast.expr] = {}
        if isinstance(node, ast.List):
            parts = {str(index): part for index, part in enumerate(node.elts)}
        elif isinstance(node, ast.Dict):
            parts = {key.value: part for key, part in zip(node.keys, node.values) if isinstance(key, ast.Constant)}
        node = parts.get(step)
    return node


def _is_same(one: Scalar, other: Scalar) -> bool:
    if type(one) in (str, bool) or not alike(one, other):
        return type(one) is type(other) and bool(one == other)
    return bool(one == other) and repr(float(one)) == repr(float(other))


def replaced(content: bytes, edits: Sequence[Edit]) -> bytes:
    """A content with edits done, which are meant for it."""
    for edit in sorted(edits, key=lambda one: one.start, reverse=True):
        content = content[: edit.start] + edit.new + content[edit.end :]
    return content


class Followed(NamedTuple):
    """The changes of a text that somebody has edited.

    Attributes:
        literals: {index of a literal in the text before: its index in the new one}.
        lines: the lines of the new text, from 1, that differ from the text before in more than these literals.
        has_lost_lines: whether lines of the text before are gone.
        moved: the lines of the new text that stand in another order than before, each within its function.
    """

    literals: Dict[int, int]
    lines: List[int]
    has_lost_lines: bool
    moved: List[int]


def followed(old: SourceText, new: SourceText, locations: Collection[int] = (), exactly: bool = False) -> Followed:
    """Follow the literals of a file that somebody has edited.

    A literal is followed if that is certain: its line reads the same except for numbers, blanks and comments, and its
    function has as many such lines as before, and the line has the same place among them; or it has more, and the
    line is the only one with its numbers, before and now.

    Args:
        old, new: the file before, and now.
        locations: indices of literals in the old one. Texts and truth values among them may have changed,
            and are followed; all other texts name what a line is about: `'~speed'`.
        exactly: follow literals of those lines alone that read the same with their numbers, blanks and comments.
    """
    lines_before, lines_after = _lines_of(old, exactly), _lines_of(new, exactly)
    free: Dict[Tuple[str, str], Set[int]] = {}
    for line in lines_before.values():
        places = {place for place, index in enumerate(line.literals) if index in locations}
        free.setdefault((line.function, line.template), set()).update(places)
    keys_before, keys_after = _lines_by_key(lines_before, free), _lines_by_key(lines_after, free)
    literals: Dict[int, int] = {}
    kept: Dict[int, int] = {}
    for key, before in keys_before.items():
        for one, other in _pairs(old, new, lines_before, lines_after, before, keys_after.get(key, [])):
            kept[other] = one
            pairs = zip(lines_before[one].literals, lines_after[other].literals)
            literals.update(pair for pair, said in zip(pairs, key[2]) if said is None)
    changed = [line for after in keys_after.values() for line in after if line not in kept]
    moved = _moved(kept, {line: one.function for line, one in lines_after.items()})
    return Followed(literals, sorted(changed), bool(keys_before.keys() - keys_after.keys()), moved)


def _moved(lines: Dict[int, int], functions: Dict[int, str]) -> List[int]:
    """The lines, of {line now: line before}, between which and another one of their function the order is another."""
    by_function: Dict[str, List[int]] = {}
    for line in sorted(lines, key=lines.__getitem__):
        by_function.setdefault(functions[line], []).append(line)
    moved: List[int] = []
    for those in by_function.values():
        highest = itertools.accumulate(those, max)
        lowest = reversed([*itertools.accumulate(reversed(those), min)])
        moved += [line for line, high, low in zip(those, highest, lowest) if low < line or line < high]
    return sorted(moved)


def _pairs(
    old: SourceText,
    new: SourceText,
    lines_before: Dict[int, '_Line'],
    lines_after: Dict[int, '_Line'],
    before: List[int],
    after: List[int],
) -> List[Tuple[int, int]]:
    """Pair lines of a text with those of another that read the same but for their numbers.

    If there are as many, each has its place among them. If there are more now, as rows of a list to which one was
    added, each is the one with its numbers, if only one has them, before and now.
    """
    if len(before) >= len(after):
        return list(zip(before, after)) if len(before) == len(after) else []
    ones, others = (
        [tuple([source.literals[index].value for index in lines[line].literals]) for line in those]
        for source, lines, those in ((old, lines_before, before), (new, lines_after, after))
    )
    return [
        (line, after[others.index(said)])
        for line, said in zip(before, ones)
        if ones.count(said) == 1 and others.count(said) == 1
    ]


class _Line(NamedTuple):
    """A line that says something.

    Attributes:
        function: the qualified name of the one that it is in.
        template: it without its literals, blanks and comments, or as it is; with a comma behind the last one of a list.
        literals: the indices of those that begin and end in it.
        texts: each as it is written; None for one that the template does not depend on.
    """

    function: str
    template: str
    literals: List[int]
    texts: List[Optional[str]]


#: A function, a template, and the texts and truth values that are to stay the same; None for those that may change.
_Key = Tuple[str, str, Tuple[Optional[str], ...]]


def _lines_by_key(lines: Dict[int, _Line], free: Dict[Tuple[str, str], Set[int]]) -> Dict[_Key, List[int]]:
    """Line numbers, from 1, grouped by the key of equal lines; `free` says which of their literals may differ."""
    found: Dict[_Key, List[int]] = {}
    for number, line in lines.items():
        may_differ = free.get((line.function, line.template), ())
        texts = tuple([None if place in may_differ else text for place, text in enumerate(line.texts)])
        found.setdefault((line.function, line.template, texts), []).append(number)
    return found


def _lines_of(source: SourceText, exactly: bool) -> Dict[int, _Line]:
    """{number, from 1: the line}, without lines that say nothing."""
    starts = [0] + [match.end() for match in NEWLINE.finditer(source.text)]
    ends = [*starts[1:], len(source.text)]
    comments, ends_of_last = comment_starts(source), last_ends(source.tree)
    positions = Positions(source.text)
    functions = [''] * len(starts) if exactly else _functions_by_line(source.tree, len(starts))
    by_line: Dict[int, List[int]] = {}
    for index, literal in enumerate(source.literals):
        if not NEWLINE.search(source.text, literal.start, literal.end):
            by_line.setdefault(literal.line, []).append(index)
    found: Dict[int, _Line] = {}
    for line, (start, end) in enumerate(zip(starts, ends), 1):
        indices = sorted(by_line.get(line, ()), key=lambda index: source.literals[index].start)
        texts: List[Optional[str]] = [None] * len(indices)
        code_end = start + comments[line] if line in comments else end
        last = positions.of(line, ends_of_last[line]) if line in ends_of_last else end
        # What is added behind the last one of a list gives it a comma, and takes the brackets behind it.
        is_bare = line in ends_of_last and last <= code_end and not source.text[last:code_end].strip(CLOSING)
        last = last if is_bare else code_end
        if exactly:
            behind = start + len(source.text[start:code_end].rstrip(' \t\r\n')) if is_bare else code_end
            template = (source.text[start:last] + ',' * is_bare + source.text[behind:end]).rstrip('\r\n')
        else:
            parts: List[str] = []
            for place, index in enumerate(indices):
                literal = source.literals[index]
                is_number = index < len(source.numbers)
                parts += [source.text[start : literal.start], _BLANK if is_number else _BLANK_WORD]
                texts[place] = None if is_number else source.text[literal.start : literal.end]
                start = literal.end
            parts += [source.text[start : max(start, last)], ',' * is_bare]
            template = ''.join(''.join(parts).split())
        if template:
            found[line] = _Line(functions[line - 1], template, indices, texts)
    return found


def comment_starts(source: SourceText) -> Dict[int, int]:
    """{line: the column, from 0, at which a comment begins in it}."""
    found = {}
    try:
        for token in tokenize.generate_tokens(io.StringIO(source.text, newline=None).readline):
            if token.type == tokenize.COMMENT:
                found[token.start[0]] = token.start[1]
    except (tokenize.TokenError, SyntaxError):
        return {}
    return found


def _functions_by_line(tree: ast.AST, count: int) -> List[str]:
    """List the qualified name of the function or class that each line is in."""
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
    """The lines of a new text in which more is another than the literals that are locations.

    Args:
        result: what `followed` says.
        locations: indices, in the old text, of the literals that are locations.
    """
    lines = Counter(result.lines)
    for before, after in result.literals.items():
        if before not in locations and not _is_same(old.literals[before].value, new.literals[after].value):
            lines[new.literals[after].line] += 1
    return sorted(lines)
