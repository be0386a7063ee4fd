"""The numbers, texts and truth values in a text in Python syntax: where each stands, and what the text is without
them."""

import ast
import math
import re
from typing import Any, Dict, List, Mapping, NamedTuple, Tuple, Union

from rosslt.files.notation import Scalar


class Literal(NamedTuple):
    """A literal in a text: text[start:end] at a line and a column, from 1.

    It is a finite number, to which a minus sign belongs, or a text or a truth value in one piece and on one line.
    """

    start: int
    end: int
    line: int
    column: int
    value: Scalar


#: The name of the list from which a tree without literals reads them.
LITERALS = '__literals__'

MINUS = re.compile(r'-[ \t]*')
NEWLINE = re.compile(r'\r\n|\r|\n')

#: What may stand behind the last one of a list on its line, if it has no comma.
CLOSING = ')]} \t\r\n'

#: Texts in several pieces, bytes and f-strings are not words: it is not one token that says them.
_WORD = re.compile(
    r"""True|False|[uUrR]?(?:
    \'\'\'(?:[^'\\\r\n]|\\[^\r\n]|'(?!''))*\'\'\' | \"\"\"(?:[^"\\\r\n]|\\[^\r\n]|"(?!""))*\"\"\"
    | '(?:[^'\\\r\n]|\\[^\r\n])*' | "(?:[^"\\\r\n]|\\[^\r\n])*")""",
    re.VERBOSE,
)


def literals_in(tree: ast.AST, text: str) -> List[Tuple[Literal, ast.AST]]:
    """The literals of a program, each with its node: numbers, and then all others, both in the order of the text."""
    positions = Positions(text)
    found: List[Tuple[Literal, ast.AST]] = []
    nodes = [tree]
    while nodes:
        node: Any = nodes.pop()
        # Inside of an f-string, Python before 3.12 does not know where things are.
        if isinstance(node, ast.JoinedStr):
            continue
        number = positions.number(node)
        if number is not None:
            found.append((positions.literal(node, number), node))
            continue
        nodes.extend(ast.iter_child_nodes(node))
        if isinstance(node, ast.Constant) and type(node.value) in (str, bool):
            literal = positions.literal(node, node.value)
            if _WORD.fullmatch(text, literal.start, literal.end):
                found.append((literal, node))
    return sorted(found, key=lambda pair: (type(pair[0].value) in (str, bool), pair[0].start))


def without_literals(tree: ast.Module, indices: Mapping[ast.AST, int]) -> ast.Module:
    """Replace some literals of a tree, of {node: index}, by `__literals__[index]`; the tree itself is changed."""
    taken_out: ast.Module = _Substitution(indices).visit(tree)
    return taken_out


def last_ends(tree: ast.AST) -> Dict[int, int]:
    """{line: the column in UTF-8 bytes, from 0, at which the last one of several elements or arguments ends there}, of
    those that stand on several lines and may have a comma behind them; the outermost one of each line."""
    found: Dict[int, int] = {}
    for node in ast.walk(tree):
        ones: List[ast.expr] = []
        if isinstance(node, (ast.List, ast.Set)) or (isinstance(node, ast.Tuple) and len(node.elts) > 1):
            ones = node.elts
        elif isinstance(node, ast.Dict):
            ones = node.values
        elif isinstance(node, ast.Call):
            ones = [*node.args, *[keyword.value for keyword in node.keywords]]
        ones = sorted(ones, key=lambda one: (one.lineno, one.col_offset))
        above = ones[-2].end_lineno if len(ones) > 1 else getattr(node, 'lineno', 0)
        if ones and (above or 0) < ones[-1].lineno and not isinstance(ones[-1], ast.GeneratorExp):
            line, end = ones[-1].end_lineno or 0, ones[-1].end_col_offset or 0
            found[line] = max(found.get(line, 0), end)
    return found


class Positions:
    """Places in a text by their line and their column in UTF-8 bytes, as `ast` has them."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._starts = [0] + [match.end() for match in NEWLINE.finditer(text)]

    def of(self, line: int, byte: int) -> int:
        """The index in the text."""
        start = self._starts[line - 1]
        return start + len(self.text[start : start + byte].encode('utf-8')[:byte].decode('utf-8', 'replace'))

    def column(self, line: int, byte: int) -> int:
        """The column, in characters from 1."""
        return self.of(line, byte) - self._starts[line - 1] + 1

    def range_of(self, node: Any) -> Tuple[int, int]:
        """The range of a node in the text."""
        return self.of(node.lineno, node.col_offset), self.of(node.end_lineno, node.end_col_offset)

    def text_of(self, node: Any) -> str:
        """The text of a node."""
        start, end = self.range_of(node)
        return self.text[start:end]

    def literal(self, node: Any, value: Scalar) -> Literal:
        """The Literal that a node is."""
        return Literal(*self.range_of(node), node.lineno, self.column(node.lineno, node.col_offset), value)

    def number(self, node: Any) -> Union[int, float, None]:
        """The finite number of a node, with its sign; None if the node is not a number."""
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return node.value if _is_finite(node.value) else None
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            number = self.number(node.operand)
            start, end = self.of(node.lineno, node.col_offset), self.of(node.operand.lineno, node.operand.col_offset)
            # nothing but blanks stands behind a sign, no parenthesis and no comment
            if number is not None and MINUS.fullmatch(self.text, start, end):
                return -number
        return None


def _is_finite(number: Union[int, float]) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:
        return False


class _Substitution(ast.NodeTransformer):
    """Replaces literals of a tree by `__literals__[index]`."""

    def __init__(self, indices: Mapping[ast.AST, int]) -> None:
        self._indices = indices

    def visit(self, node: ast.AST) -> Any:
        index = self._indices.get(node)
        if index is None:
            return super().visit(node)
        name = ast.copy_location(ast.Name(LITERALS, ast.Load()), node)
        number: Any = ast.copy_location(ast.Constant(index, kind=None), node)
        if not hasattr(ast, 'unparse'):  # Python 3.8 has a node of its own around an index
            number = ast.copy_location(ast.Index(number), node)
        return ast.copy_location(ast.Subscript(name, number, ast.Load()), node)
