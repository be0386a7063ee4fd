"""Identifies numbers in a program's text, so that after an edit, a remembered value never reaches the wrong one.

A number is identified by the function and the line that it stands in. Numbers that are locations themselves may be
edited and saved, so they do not count; all others of the statement do: `servo(3, location(0.5))` and
`servo(4, location(0.5))` are two servos. Lines of a function that are equal except for such numbers are identified by
the rest of their statements, and by the conditions and loops around them. After an edit of these nobody can say which
line is which, and their old identities are unknown.
"""

import ast
import bisect
import contextlib
import hashlib
import io
import itertools
import keyword
import tokenize
from collections import Counter
from typing import Dict, Iterable, List, NamedTuple, Sequence, Set, Tuple

_Position = Tuple[int, int]
"""A line, counted from 1, and a column in bytes, from 0, as a syntax tree gives them."""

#: Tokens without meaning for the computation of a line.
_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT}
_OPENING, _CLOSING = frozenset('([{'), frozenset(')]}')
_COMPOUND = (ast.If, ast.For, ast.While, ast.With, ast.Try, ast.AsyncFor, ast.AsyncWith)


class _Token(NamedTuple):
    start: _Position
    text: str
    is_number: bool
    is_sign: bool


class _Item(NamedTuple):
    """An expression to be identified, with the kind of those whose numbers do not count for each other."""

    start: _Position
    end: _Position
    kind: str


def identities(tree: ast.AST, text: str, nodes: Sequence[Tuple[ast.expr, str]]) -> List[str]:
    """The identity of each of some expressions of a program.

    Args:
        tree: of the program.
        text: of the program.
        nodes: the expressions, with their kinds: the numbers of one do not count for others of its kind.
    """
    statements = list(_statements(text))
    begins = [statement[0].start for statement in statements]
    around = _around(tree, {node for node, _ in nodes})
    items = [
        _Item((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0), kind)
        for node, kind in nodes
    ]
    by_statement: Dict[Tuple[int, str], List[_Item]] = {}
    for item in sorted(items, key=lambda item: item[:2]):
        by_statement.setdefault((_last_up_to(item.start, begins), item.kind), []).append(item)
    known: Dict[_Item, Tuple[str, ...]] = {}
    with_comma: Dict[_Item, Tuple[str, ...]] = {}  # of the last ones of lists without one, as if they had it
    for (at, _), alike in by_statement.items():
        words, numbers = _without_numbers(statements[at], alike)
        bare = {row: f'{words[row][: len(words[row]) - len(rest)]} ,' for row, rest in _closing(statements[at]).items()}
        counts: Counter = Counter()
        for item in alike:
            row = item.start[0]
            known[item] = item.kind, f'{words.get(row, "")}\n{counts[row]}', ' '.join(numbers)
            if row in bare:
                with_comma[item] = item.kind, f'{bare[row]}\n{counts[row]}', ' '.join(numbers)
            counts[row] += 1
    functions = {item: around[node].function for item, (node, _) in zip(items, nodes)}
    keys = {(functions[item], *words) for item, words in known.items()}
    groups: Dict[Tuple[str, ...], List[int]] = {}
    for index in sorted(range(len(items)), key=lambda index: items[index][:2]):
        item = items[index]
        key = functions[item], *with_comma.get(item, ())
        groups.setdefault(key if key in keys else (functions[item], *known[item]), []).append(index)
    found = [''] * len(items)
    for group, indices in groups.items():
        for index in indices:
            found[index] = '\n'.join(group)
        if len(indices) == 1:
            continue
        positions = {items[index].start for index in indices}
        positions.update((row, 0) for index in indices for row in around[nodes[index][0]].rows)
        concerned = _Lines([statements[at] for at in sorted({_last_up_to(position, begins) for position in positions})])
        for nth, index in enumerate(indices):
            blocks = around[nodes[index][0]].blocks
            found[index] += f'\n{nth} of {len(indices)}{blocks}\n{concerned.digest_besides(items[index])}'
    return found


def _last_up_to(position: _Position, begins: List[_Position]) -> int:
    """The index of the statement that a position is in."""
    return max(0, bisect.bisect_right(begins, (position[0], position[1] + 1)) - 1)


def _statements(text: str) -> Iterable[List[_Token]]:
    """The logical lines of a text, none of them empty."""
    tokens: List[_Token] = []
    ends_nothing = True  # a + or - behind this is the sign of a number
    lines = text.split('\n')  # as the parser does: a form feed ends no line
    with contextlib.suppress(tokenize.TokenError, SyntaxError):  # of what the parser takes all the same
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type in (tokenize.NEWLINE, tokenize.ENDMARKER):
                if tokens:
                    yield tokens
                tokens, ends_nothing = [], True
            elif token.type not in _LAYOUT:
                row, column = token.start
                start = row, len(lines[row - 1][:column].encode('utf-8', 'surrogatepass'))
                is_number = token.type == tokenize.NUMBER
                is_operator = token.type == tokenize.OP
                tokens.append(_Token(start, token.string, is_number, ends_nothing and token.string in ('+', '-')))
                ends_nothing = keyword.iskeyword(token.string) or (is_operator and token.string not in (')', ']', '}'))
    if tokens:
        yield tokens


def _without_numbers(statement: List[_Token], items: List[_Item]) -> Tuple[Dict[int, str], List[str]]:
    """The words of each line of a statement, and the numbers in the statement; those in the items do not count."""
    starts = [item.start for item in items]
    ends = list(itertools.accumulate([item.end for item in items], max))
    words: Dict[int, str] = {}
    numbers = []
    for index, token in enumerate(statement):
        is_sign = token.is_sign and index + 1 < len(statement) and statement[index + 1].is_number
        before = bisect.bisect_right(starts, token.start)
        word = token.text
        if (token.is_number or is_sign) and before and token.start < ends[before - 1]:
            word = '' if is_sign else '0'
        elif token.is_number:
            numbers.append(word)
        words[token.start[0]] = f'{words.get(token.start[0], "")} {word}' if word else words.get(token.start[0], '')
    return words, numbers


def _closing(statement: List[_Token]) -> Dict[int, str]:
    """{line in which the last one of several lines in brackets ends without a comma: the words of the brackets behind
    it}, if nothing else stands there."""
    separators: List[int] = []  # of each open bracket, or the comma behind the one before
    ends: Dict[int, int] = {}  # the first bracket behind the outermost one
    for index, token in enumerate(statement):
        if token.text in _OPENING:
            separators.append(index)
        elif token.text == ',' and separators:
            separators[-1] = index
        elif token.text in _CLOSING and separators:
            before = separators.pop()
            if before + 1 < index and statement[before].start[0] < statement[before + 1].start[0]:
                ends[statement[index - 1].start[0]] = index
    found = {}
    for row, end in ends.items():
        behind = [token.text for token in itertools.takewhile(lambda one: one.start[0] == row, statement[end:])]  # noqa: B023
        if _CLOSING.issuperset(behind):
            found[row] = ''.join([f' {text}' for text in behind])
    return found


class _Lines:
    """The tokens of several statements, joined to one text.

    Args:
        statements: their tokens, in the order of the statements.
    """

    def __init__(self, statements: List[List[_Token]]) -> None:
        tokens = [token for statement in statements for token in statement]
        self._starts = [token.start for token in tokens]
        self._offsets = list(itertools.accumulate([0, *(len(token.text) + 1 for token in tokens)]))
        self._said = ''.join([f'{token.text} ' for token in tokens])

    def digest_besides(self, item: _Item) -> str:
        """The hash of it without an item."""
        begin, end = (self._offsets[bisect.bisect_left(self._starts, position)] for position in (item.start, item.end))
        said = self._said[:begin] + self._said[end:]
        return hashlib.blake2b(said.encode('utf-8', 'surrogatepass'), digest_size=8).hexdigest()


class _Surroundings(NamedTuple):
    """The surroundings of an expression.

    Attributes:
        function: the names of the classes and functions around it.
        rows: the lines of the compound statements around it in that function.
        blocks: in which blocks of these it is.
    """

    function: str = ''
    rows: Tuple[int, ...] = ()
    blocks: str = ''


def _around(tree: ast.AST, wanted: Set[ast.expr]) -> Dict[ast.AST, _Surroundings]:
    """The surroundings of the expressions that are wanted."""
    found: Dict[ast.AST, _Surroundings] = {}
    waiting: List[Tuple[ast.AST, _Surroundings]] = [(tree, _Surroundings())]
    while waiting:
        node, around = waiting.pop()
        if node in wanted:
            found[node] = around
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            around = _Surroundings(f'{around.function}.{node.name}'.lstrip('.'))
        for field, value in ast.iter_fields(node):
            inner = around
            if isinstance(node, _COMPOUND) and isinstance(value, list):
                inner = _Surroundings(around.function, (*around.rows, node.lineno), f'{around.blocks} {field}')
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    waiting.append((child, inner))
    return found
