"""Rows in Python: elements of lists and tuples, and alike calls in neighbouring statements."""

import ast
import bisect
import itertools
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.files import rows
from rosslt.files.notation import Scalar
from rosslt.files.python_literals import Positions
from rosslt.files.python_source import Edit, SourceText, comment_starts, replaced

_NONE = (
    'no list of alike rows stands here: elements of a list, or calls of one function one below the other; '
    'edit the file by hand'
)


class _Found(NamedTuple):
    """An element of a list, or a statement of a block.

    Attributes:
        owner: the list or tuple, or what has the block.
        siblings: the list of the syntax tree that it is in.
        position: which of them it is.
        first, last: the range of its rows among them.
    """

    owner: Any
    siblings: List[Any]
    position: int
    first: int
    last: int


class RowEdits(NamedTuple):
    """What does something with rows of a Python file.

    Attributes:
        edits: of the file.
        numbers: for each number of the text that they make, its index in `SourceText.numbers` of the text before; None
            if it is a new one.
    """

    edits: List[Edit]
    numbers: List[Optional[int]]


#: (first, last) of the run of alike calls that each statement of a block is in, by the id of the block.
_Runs = Dict[int, List[Tuple[int, int]]]


def rows_of_numbers(source: SourceText) -> List[str]:
    """The row that each number of a file is in, `12:9[1]` for row 1 of those that begin at line 12 and column 9.

    It is the row of `python_row_edits`, if that is one of several alike ones, each on lines of its own;
    '' if there is none.
    """
    positions = Positions(source.text)
    runs: _Runs = {}
    beginnings: Dict[Tuple[int, int], str] = {}  # of each list, by the id of the siblings and the first of them
    found: Dict[int, str] = {}
    waiting: List[Tuple[ast.AST, Tuple[_Found, ...]]] = [(source.tree, ())]
    while waiting:
        node, path = waiting.pop()
        if positions.number(node) is None:
            waiting += [(one, path if member is None else (*path, member)) for one, member in _members(node)]
            continue
        row = _chosen(path, runs)
        if row is not None:
            key = id(row.siblings), row.first
            beginning = beginnings.get(key)
            if beginning is None:
                beginning = beginnings[key] = _beginning(row, positions)
            if beginning:
                found[positions.range_of(node)[0]] = f'{beginning}[{row.position - row.first}]'
    return [found.get(literal.start, '') for literal in source.numbers]


def _beginning(found: _Found, positions: Positions) -> str:
    """Return the line and the column at which a list of several alike rows begins; '' if it is none, or two of its rows
    share a line."""
    those = found.siblings[found.first : found.last]
    is_apart = all(one.end_lineno < other.lineno for one, other in zip(those, those[1:]))
    is_alike = isinstance(those[0], ast.stmt) or all(_shape(one) == _shape(those[0]) for one in those)
    if len(those) < 2 or not is_apart or not is_alike:
        return ''
    return f'{those[0].lineno}:{positions.column(those[0].lineno, those[0].col_offset)}'


def python_row_edits(file: str, content: bytes, line: int, column: int, operation: str) -> RowEdits:
    """Make the edits that do something with a row of a Python file.

    The row is the element of the innermost list whose elements are more than single values; if there is none, the
    call if that has alike neighbours, else the element of a list of single values.

    Args:
        file: its path.
        content: all of it.
        line, column: of any place in the row; both count from 1, in characters.
        operation: one of OPERATIONS.

    Raises:
        FileError: what stands there is no row of a list of alike ones, or cannot be moved or deleted.
        ValueError: there is no such operation.
    """
    rows.check_operation(operation)
    source = SourceText(file, content)
    try:
        return _edits(source, line, column, operation)
    except (RecursionError, MemoryError):
        raise rows.refusal(file, source.text, 0, 'it is nested too deeply') from None


def python_row_additions(
    file: str,
    content: bytes,
    places: Sequence[Tuple[int, int]],
    added: Sequence[Sequence[Scalar]],
    behind: Sequence[Sequence[Scalar]] = (),
) -> RowEdits:
    """Make the edits that add copies of a row of a Python file below it, in which some numbers are others.

    Args:
        file: its path.
        content: all of it.
        places: line and column of each of these numbers in the row, from 1, in characters.
        added: for each copy, what they are there. Each is written in the manner of the one in the row.
        behind: the same for copies that were added before. As far as these still stand directly below the row, in this
            order, the new ones go behind them.

    Raises:
        FileError: a number does not stand there, they are not all in one row of a list of alike ones, or a number
            cannot stand in the place of the old one.
    """
    source = SourceText(file, content)
    try:
        return _additions(source, places, added, behind)
    except (RecursionError, MemoryError):
        raise rows.refusal(file, source.text, 0, 'it is nested too deeply') from None


def _additions(
    source: SourceText,
    places: Sequence[Tuple[int, int]],
    added: Sequence[Sequence[Scalar]],
    behind: Sequence[Sequence[Scalar]],
) -> RowEdits:
    tree, found, row = _row_at(source, *places[0])
    first, last = row.ranges[row.position]
    offsets: List[int] = []
    for line, column in places:
        place = rows.place_of(source.text, line, column)
        if source.number_at(line, column) is None or not first <= place < last:
            reason = f'no number of the row in line {rows.line_of(source.text, first)} stands here'
            raise rows.refusal(source.path, source.text, place, f'{reason}; edit the file by hand')
        offsets.append(place - first)
    below = _still_below(source, row, offsets, behind)
    changed, starts = rows.with_copies(row, len(added), below)
    copied = SourceText(source.path, replaced(source.content, [source.edit(0, len(source.text), changed)]))
    behind_last = found.position + below + 1
    found.siblings[behind_last:behind_last] = [found.siblings[found.position]] * len(added)
    if ast.dump(copied.tree) != ast.dump(tree):
        raise row.refusal('the file would not say the same otherwise; edit it by hand', first)
    at = {literal.start: index for index, literal in enumerate(copied.numbers)}
    wanted = {at[start + offset]: value for start, one in zip(starts, added) for offset, value in zip(offsets, one)}
    made = SourceText(source.path, replaced(copied.content, copied.edits(wanted)))
    edits = [source.edit(*rows.difference(source.text, made.text))] if added else []
    numbers = _numbers_of_rows(source, row)
    copies: List[List[Optional[int]]] = [[None] * len(numbers[row.position + 1])] * len(added)
    behind_last = row.position + below + 2  # the first is what stands above the rows
    numbers[behind_last:behind_last] = copies
    return RowEdits(edits, _in_order(numbers, made))


def _still_below(source: SourceText, row: rows.Rows, offsets: Sequence[int], behind: Sequence[Sequence[Scalar]]) -> int:
    """Count the rows directly below a row that are copies which were added before, in their order.

    Args:
        offsets: of some numbers in the row.
        behind: what they are in each copy.
    """
    numbers = sorted(source.numbers, key=lambda one: one.start)
    own, *others = [[one for one in numbers if start <= one.start < end] for start, end in row.ranges[row.position :]]
    starts = [one.start - row.ranges[row.position][0] for one in own]
    indices, copies = [starts.index(offset) for offset in offsets], iter(behind)
    for count, other in enumerate(others):
        is_alike = len(other) == len(own)
        if not (is_alike and any([other[index].value for index in indices] == list(copy) for copy in copies)):
            return count
    return len(others)


def _numbers_of_rows(source: SourceText, row: rows.Rows) -> List[List[Optional[int]]]:
    """The indices of the numbers of a file in the order of its text: those above the rows of a list, those of each
    row, and those below."""
    indices = sorted(range(len(source.numbers)), key=lambda index: source.numbers[index].start)
    starts = [source.numbers[index].start for index in indices]
    ends = [0, *(bisect.bisect_left(starts, end) for _, end in row.ranges), len(indices)]
    ends.insert(1, bisect.bisect_left(starts, row.ranges[0][0]))
    return [list(indices[first:last]) for first, last in zip(ends, ends[1:])]


def _in_order(numbers: Sequence[Sequence[Optional[int]]], made: SourceText) -> List[Optional[int]]:
    """What stands for each number of a text, given in the order of the text, in the order of its numbers."""
    indices = sorted(range(len(made.numbers)), key=lambda index: made.numbers[index].start)
    by_index = dict(zip(indices, itertools.chain.from_iterable(numbers)))
    return [by_index[index] for index in range(len(indices))]


def _edits(source: SourceText, line: int, column: int, operation: str) -> RowEdits:
    tree, found, row = _row_at(source, line, column)
    changed = rows.after(row, operation)
    rows.operate(found.siblings, found.position, operation)
    made = SourceText(source.path, replaced(source.content, [source.edit(0, len(source.text), changed)]))
    start = row.ranges[row.position][0]
    if ast.dump(made.tree) != ast.dump(tree):
        raise row.refusal('the file would not say the same otherwise; edit it by hand', start)
    numbers = _numbers_of_rows(source, row)
    rows.operate(numbers, row.position + 1, operation)  # the first is what stands above the rows
    if operation == rows.DUPLICATE:
        numbers[row.position + 2] = [None] * len(numbers[row.position + 2])
    return RowEdits([source.edit(*rows.difference(source.text, changed))], _in_order(numbers, made))


def _row_at(source: SourceText, line: int, column: int) -> Tuple[ast.Module, _Found, rows.Rows]:
    """The syntax tree, and the row in it that a place is in.

    Raises:
        FileError: there is none, or its list has others that are not alike.
    """
    tree, positions = ast.parse(source.text), Positions(source.text)
    place = rows.place_of(source.text, line, column)
    chosen = _chosen(_path_to(tree, positions, place), {})
    if chosen is None:
        raise rows.refusal(source.path, source.text, place, _NONE)
    return tree, chosen, _row_of(source, positions, chosen)


def _chosen(path: Sequence[_Found], runs: _Runs) -> Optional[_Found]:
    """The row among the members of lists that a place is in, from the outside inward; None if there is none.

    Args:
        path: these members.
        runs: what is known of blocks; gets what is found out.
    """
    lists = [one for one in path if isinstance(one.owner, (ast.List, ast.Tuple))]
    compound = [one for one in lists if not _is_single(one.siblings[one.position])]
    statements = [one for one in path if isinstance(one.siblings[one.position], ast.stmt)]
    calls = [one for one in (_neighbours(one, runs) for one in statements[-1:]) if one.last - one.first > 1]
    chosen = compound[-1:] or calls or lists[-1:]
    is_value = any(isinstance(one.owner, ast.Dict) and len(one.siblings) > 1 for one in path)
    if not chosen or (is_value and not compound and not calls):  # (1, 2) of {'dock': (1, 2), 'door': (3, 4)} is a row
        return None
    return chosen[0]


def _path_to(tree: ast.AST, positions: Positions, place: int) -> List[_Found]:
    """The members of lists of a syntax tree that a place is in, from the outside inward."""
    path: List[_Found] = []
    waiting: List[ast.AST] = [tree]
    while waiting:
        for member, found in _members(waiting.pop()):
            # What has no position, as a keyword argument in Python 3.8, has parts that have one.
            if hasattr(member, 'lineno'):
                start, end = positions.range_of(member)
                if not start <= place < end:
                    continue
                if found is not None:
                    path.append(found)
            waiting.append(member)
    return path


def _members(node: ast.AST) -> Iterator[Tuple[ast.AST, Optional[_Found]]]:
    """Yield the parts of a node of a syntax tree, with what is found there of those that are members of lists."""
    for _, field in ast.iter_fields(node):
        members = field if isinstance(field, list) else [field]
        for index, member in enumerate(members):
            if isinstance(member, ast.AST):
                is_member = members is field and isinstance(member, (ast.stmt, ast.expr))
                yield member, _Found(node, members, index, 0, len(members)) if is_member else None


def _is_single(node: ast.expr) -> bool:
    """Return whether an element is a single value; `location(1.5)` is one."""
    if isinstance(node, ast.Call):
        return getattr(node.func, 'attr', getattr(node.func, 'id', '')) == 'location'
    return not isinstance(node, (ast.List, ast.Tuple, ast.Dict))


def _neighbours(found: _Found, runs: _Runs) -> _Found:
    """A statement among the statements around it that call the same with as many arguments; alone if it is no call.

    Args:
        found: it.
        runs: as of `_chosen`.
    """
    block = runs.get(id(found.siblings))
    if block is None:
        block = runs[id(found.siblings)] = []
        for shape, group in itertools.groupby(found.siblings, _call_of):
            first, count = len(block), len([*group])
            block += [(at, at + 1) if shape is None else (first, first + count) for at in range(first, first + count)]
    first, last = block[found.position]
    return found._replace(first=first, last=last)


def _call_of(statement: ast.stmt) -> Optional[Tuple[object, ...]]:
    is_call = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)
    return _shape(statement.value) if is_call else None  # type: ignore[attr-defined]


def _shape(node: ast.expr) -> Tuple[object, ...]:
    """Return a tuple that is equal for alike rows."""
    if isinstance(node, ast.Call):
        return ('call', ast.dump(node.func), len(node.args), sorted(str(keyword.arg) for keyword in node.keywords))
    if isinstance(node, (ast.List, ast.Tuple)):
        return (type(node), len(node.elts))
    if isinstance(node, ast.Dict):
        return ('dict', sorted('**' if key is None else ast.dump(key) for key in node.keys))
    if isinstance(node, ast.UnaryOp):
        return _shape(node.operand)
    if isinstance(node, ast.Constant):
        return ('number' if type(node.value) in (int, float) else type(node.value),)
    return (type(node),)


def _row_of(source: SourceText, positions: Positions, found: _Found) -> rows.Rows:
    """The rows of a list, with their places.

    Raises:
        FileError: its elements are not alike.
    """
    those = found.siblings[found.first : found.last]
    ranges = [positions.range_of(one) for one in those]
    comments = comment_starts(source)

    def comment_at(place: int) -> int:
        end = rows.line_end(source.text, place)
        line = rows.line_of(source.text, place)
        return positions.of(line, 0) + comments[line] if line in comments else end

    is_list = isinstance(found.owner, (ast.List, ast.Tuple))
    row = rows.Rows(
        source.path,
        source.text,
        ranges,
        found.position - found.first,
        positions.range_of(found.owner)[0] + 1 if is_list else -1,
        ',' if is_list else '',
        isinstance(found.owner, ast.Tuple),
        comment_at,
    )
    if is_list:
        rows.check_alike(row, [_shape(one) for one in those])
    return row
