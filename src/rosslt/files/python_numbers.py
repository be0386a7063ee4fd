"""The numbers, texts and truth values in a text in Python syntax: where each stands, and what the text is without
them."""

import ast
import bisect
import itertools
import math
import re
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union


class Number(NamedTuple):
    """A number in a text: text[start:end] at a line and a column, from 1. A minus sign belongs to it."""

    start: int
    end: int
    line: int
    column: int
    value: Union[int, float]


class Word(NamedTuple):
    """A text or a truth value that is written in one piece and on one line; otherwise as a Number."""

    start: int
    end: int
    line: int
    column: int
    value: Union[str, bool]


#: The name of the list from which a tree without numbers reads them.
LITERALS = '__literals__'

MINUS = re.compile(r'-[ \t]*')
NEWLINE = re.compile(r'\r\n|\r|\n')

#: Texts in several pieces, bytes and f-strings are no words: it is not one token that says them.
_WORD = re.compile(
    r"""True|False|[uUrR]?(?:
    \'\'\'(?:[^'\\\r\n]|\\[^\r\n]|'(?!''))*\'\'\' | \"\"\"(?:[^"\\\r\n]|\\[^\r\n]|"(?!""))*\"\"\"
    | '(?:[^'\\\r\n]|\\[^\r\n])*' | "(?:[^"\\\r\n]|\\[^\r\n])*")""",
    re.VERBOSE,
)


def numbers_in(tree: ast.AST, text: str) -> List[Tuple[Number, ast.AST]]:
    """The finite numbers of a program, in the order of its text, each with its node in the tree."""
    positions = Positions(text)
    found: List[Tuple[Number, ast.AST]] = []
    nodes = [tree]
    while nodes:
        node: Any = nodes.pop()
        # Inside of an f-string, Python before 3.12 does not know where things are.
        if isinstance(node, ast.JoinedStr):
            continue
        if _is_number(node):
            found.append((positions.number(node, node.value), node))
        elif (
            isinstance(node, ast.UnaryOp)
            and isinstance(node.op, ast.USub)
            and _is_number(node.operand)
            and positions.is_sign_of(node, node.operand)
        ):
            operand: Any = node.operand
            found.append((positions.number(node, -operand.value), node))
        else:
            nodes.extend(ast.iter_child_nodes(node))
    return sorted(found, key=lambda pair: pair[0].start)


def words_in(tree: ast.AST, text: str) -> List[Tuple[Word, ast.AST]]:
    """The texts and truth values of a program that stand in one piece, in the order of its text, each with its node."""
    positions = Positions(text)
    found: List[Tuple[Word, ast.AST]] = []
    nodes = [tree]
    while nodes:
        node: Any = nodes.pop()
        if isinstance(node, ast.JoinedStr):
            continue
        nodes.extend(ast.iter_child_nodes(node))
        if isinstance(node, ast.Constant) and type(node.value) in (str, bool):
            place = positions.number(node, 0)
            if _WORD.fullmatch(text, place.start, place.end):
                found.append((Word(place.start, place.end, place.line, place.column, node.value), node))
    return sorted(found, key=lambda pair: pair[0].start)


def without_numbers(tree: ast.Module, numbers: Sequence[ast.AST]) -> ast.Module:
    """Replace each number of a tree by `__literals__[index]`; the tree itself is changed."""
    taken_out: ast.Module = _Substitution({id(node): index for index, node in enumerate(numbers)}).visit(tree)
    return taken_out


class Positions:
    """Places in a text by their line and their column in UTF-8 bytes, as `ast` has them."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._starts = [0] + [match.end() for match in NEWLINE.finditer(text)]
        self._bytes: Dict[int, Optional[List[int]]] = {}

    def of(self, line: int, byte: int) -> int:
        """The index in the text."""
        if line not in self._bytes:
            self._bytes[line] = self._bytes_of(line)
        before = self._bytes[line]
        return self._starts[line - 1] + (byte if before is None else bisect.bisect_left(before, byte))

    def _bytes_of(self, line: int) -> Optional[List[int]]:
        """Count the bytes before each character of a line and before its end; None where it is in ASCII."""
        end = self._starts[line] if line < len(self._starts) else None
        text = self._text[self._starts[line - 1] : end]
        if text.isascii():
            return None
        return [0, *itertools.accumulate(len(character.encode('utf-8')) for character in text)]

    def number(self, node: Any, value: Union[int, float]) -> Number:
        """The Number that a node is."""
        start = self.of(node.lineno, node.col_offset)
        return Number(
            start,
            self.of(node.end_lineno, node.end_col_offset),
            node.lineno,
            start - self._starts[node.lineno - 1] + 1,
            value,
        )

    def is_sign_of(self, node: Any, number: Any) -> bool:
        """Return whether nothing but a minus and blanks stands before the number: no parenthesis and no comment."""
        start, end = self.of(node.lineno, node.col_offset), self.of(number.lineno, number.col_offset)
        return MINUS.fullmatch(self._text[start:end]) is not None


def _is_number(node: Any) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float) and _is_finite(node.value)


def _is_finite(number: Union[int, float]) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:
        return False


class _Substitution(ast.NodeTransformer):
    """Replaces each number of a tree by `__literals__[index]`."""

    def __init__(self, indices: Mapping[int, int]) -> None:
        self._indices: Dict[int, int] = dict(indices)

    def visit(self, node: ast.AST) -> Any:
        index = self._indices.get(id(node))
        if index is None:
            return super().visit(node)
        name = ast.copy_location(ast.Name(LITERALS, ast.Load()), node)
        number: Any = ast.copy_location(ast.Constant(index, kind=None), node)
        if not hasattr(ast, 'unparse'):  # Python 3.8 has a node of its own around an index
            number = ast.copy_location(ast.Index(number), node)
        return ast.copy_location(ast.Subscript(name, number, ast.Load()), node)
