"""The number literals of a source file: where each stands, what it says, and what makes it itself after a restart."""

import ast
import io
import os
import re
import tokenize
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

from rosslt import files, node
from rosslt.instrument.literal_names import literal_names
from rosslt.instrument.location_rules import FORM, NUMBER, PLAIN, judge
from rosslt.instrument.set_up_names import MODULE, code_run_once, key_of
from rosslt.instrument.states import States
from rosslt.instrument.tables import rows_of_literals

#: The rank at which a drag changes a literal, by its rule; it changes rank 0 first, as for parameters.
RANKS = {'named': 0, 'parameter': 0, 'value': 1, 'term': 2}
_RANK_OF_VERDICT = {NUMBER: 2, FORM: node.SHAPE_RANK}
LAST_RANK = 4

_DIRECTIVE = re.compile(r'#\s*rosslt:\s*(?:(skip)|([-+.\deE]+)?\s*\.\.\s*([-+.\deE]+)?)\s*(?:#.*)?$')


class Literal(NamedTuple):
    """A number literal in a source file.

    Attributes:
        file: the real path of the file.
        line, column, end_line, end_column: the range of its text, with the sign in front of it; lines and columns
            are counted from 1, in characters, and the end is the position after the last one.
        text: as it is written, `-2.50`.
        value: the number.
        verdict, rule: as in `location_rules.RULES`.
        identity: a key of the literal that stays the same after a restart and after edits elsewhere in the file.
        name: the variable that it is the value of (`speed`), or its place in that (`waypoints.2.x`); or None.
        minimum, maximum: bounds from a comment, or None.
        is_read_once: whether it is read when its file is loaded, and never again.
        row: the row of a table that it is in, as of `tables.rows_of_literals`; '' if it is in none.
        is_set_up: whether, if its file is the program, an `__init__` reads it that runs once, as of
            `code_run_once`.
        once_in: the function that runs once if its file is the program and reads it, or the module, as `key_of` has it;
            '' if it is in none.
    """

    file: str
    line: int
    column: int
    end_line: int
    end_column: int
    text: str
    value: float
    verdict: str
    rule: str
    identity: str
    name: Optional[str]
    minimum: Optional[float]
    maximum: Optional[float]
    is_read_once: bool
    row: str
    is_set_up: bool
    once_in: str

    @property
    def rank(self) -> int:
        """The order in which a drag changes literals: 0 first, `LAST_RANK` last."""
        return RANKS.get(self.rule, _RANK_OF_VERDICT.get(self.verdict, LAST_RANK))

    @property
    def is_shape(self) -> bool:
        """True for a divisor, a phase, a count and the like: the number can be set, but a drag does not change it."""
        return self.verdict == FORM or self.rule == 'used as a count'


class SourceText(files.Positions):
    """The text of a source file, whether it can be parsed or not.

    Attributes:
        path: its real path.
        digest: the hash of its content, by which it is known whether the file was edited since.
    """

    def __init__(self, path: str, content: bytes) -> None:
        self.path = os.path.realpath(path)
        self.digest = files.digest_of(content)
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        super().__init__(io.TextIOWrapper(io.BytesIO(content), encoding, newline=None).read())


def find_literals(tree: ast.Module, source: SourceText, states: States) -> List[Tuple[ast.expr, Literal]]:
    """The literals of a file that are locations, each with its expression in the tree."""
    limits_at = directives(tree, source.text)
    found = []
    for judgement in sorted(
        judge(tree, source.text_of, states), key=lambda one: (one.node.lineno, one.node.col_offset)
    ):
        limits = limits_at.get(judgement.node.lineno)
        if judgement.rule.verdict != PLAIN and limits != 'skip':
            found.append((judgement, limits or (None, None)))
    places, ways = code_run_once(tree)
    once_in = {part: place.code for part, place in places.items()}
    rows = rows_of_literals(tree)
    identities = node.identities(tree, source.text, [(judgement.node, '') for judgement, _ in found])
    names = literal_names(tree, [(judgement.node, judgement.name) for judgement, _ in found])
    return [
        (
            judgement.node,
            Literal(
                source.path,
                judgement.node.lineno,
                source.column(judgement.node.lineno, judgement.node.col_offset),
                judgement.node.end_lineno or judgement.node.lineno,
                source.column(judgement.node.end_lineno or judgement.node.lineno, judgement.node.end_col_offset or 0),
                source.text_of(judgement.node),
                judgement.value,
                judgement.rule.verdict,
                judgement.rule.name,
                f'{source.path}\n{identity}',
                name,
                minimum,
                maximum,
                once_in.get(id(judgement.node)) == MODULE,
                rows.get(id(judgement.node), ''),
                once_in.get(id(judgement.node), MODULE)[0] == '__init__',
                key_of(once_in[id(judgement.node)]) if once_in.get(id(judgement.node)) in ways else '',
            ),
        )
        for (judgement, (minimum, maximum)), identity, name in zip(found, identities, names)
    ]


def directives(tree: ast.Module, text: str) -> Dict[int, Any]:
    """Read `# rosslt:` comments: {line: 'skip', or (minimum, maximum) of the literals on it}.

    A comment on the first line of a statement holds for all of it; one on a line of its own for the statement below.

    Raises:
        ValueError: a bound is not a number.
    """
    if 'rosslt:' not in text:
        return {}
    lines: Dict[int, Any] = {}
    at_line: Dict[int, Any] = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        match = _DIRECTIVE.match(token.string) if token.type == tokenize.COMMENT else None
        if match:
            skip, low, high = match.groups()
            says = 'skip' if skip else (_bound(low), _bound(high))
            is_alone = token.line.lstrip().startswith('#')
            at_line[token.start[0]] = says, is_alone
    statements = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    for number, (says, is_alone) in sorted(at_line.items()):
        concerned = [
            statement
            for statement in statements
            if (_first_line(statement) > number if is_alone else _first_line(statement) == number)
        ]
        last = number
        if concerned:
            first = min(map(_first_line, concerned))
            ends = [statement.end_lineno or first for statement in concerned if _first_line(statement) == first]
            number, last = first, max(ends)
        lines.update(dict.fromkeys(range(number, last + 1), says))
    return lines


def _first_line(statement: ast.stmt) -> int:
    return min([statement.lineno, *(decorator.lineno for decorator in getattr(statement, 'decorator_list', ()))])


def _bound(text: Optional[str]) -> Optional[float]:
    if text is None:
        return None
    try:
        return int(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        raise ValueError(f'{text!r} in a comment `# rosslt:` is not a number') from None
