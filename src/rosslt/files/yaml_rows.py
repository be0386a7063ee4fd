"""Rows in YAML: items of block sequences, and elements of flow sequences on lines of their own."""

import re
from typing import Any, Iterator, List, NamedTuple, Sequence, Tuple, Union

import yaml

from rosslt.files import rows
from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar
from rosslt.files.python_source import Edit, digest_of, replaced
from rosslt.files.yaml_text import PROPERTIES, YamlChange, composed, yaml_edits, yaml_places

_Path = Sequence[Union[str, int]]

_COMMENT = re.compile(r'(?<!\S)#')


class _Found(NamedTuple):
    """An element of a sequence.

    Attributes:
        sequence: it.
        position: which element it is.
        depth: how many steps of the path lead to it.
    """

    sequence: yaml.SequenceNode
    position: int
    depth: int


def yaml_row_edits(file: str, content: bytes, path: _Path, operation: str) -> Tuple[List[Edit], int]:
    """Make the edits that do something with a row of a YAML file.

    The row is the element of the innermost sequence whose elements are no scalars; if there is none, that of a
    sequence of scalars.

    Args:
        file: its path.
        content: all of it.
        path: of keys and indices, from the root of the document to the row or to something in it.
        operation: one of OPERATIONS.

    Returns:
        (the edits, how many steps of the path lead to the row).

    Raises:
        FileError: what stands there is no row of a list of alike ones, or cannot be moved or deleted.
        ValueError: there is no such operation.
    """
    rows.check_operation(operation)
    text, root = composed(file, content)
    found = _row_at(file, text, root, path)
    row = _rows_of(file, text, found)
    changed = rows.after(row, operation)
    rows.operate(found.sequence.value, found.position, operation)
    _check_says(file, changed.encode('utf-8'), root, row)
    return [_edit(file, content, text, changed)], found.depth


def yaml_row_additions(
    file: str,
    content: bytes,
    paths: Sequence[_Path],
    added: Sequence[Sequence[Scalar]],
    behind: Sequence[Sequence[Scalar]] = (),
) -> Tuple[List[Edit], int, int]:
    """Make the edits that add copies of a row of a YAML file below it, in which some numbers are others.

    Args:
        file: its path.
        content: all of it.
        paths: of each of these numbers in the row, of keys and indices, from the root of the document.
        added: for each copy, what they are there. Each is written in the manner of the one in the row.
        behind: as of `python_row_additions`.

    Returns:
        (the edits, how many steps of a path lead to the row, how many rows between it and the copies).

    Raises:
        FileError: the numbers are not all in one row of a list of alike ones, or a number cannot stand in the place of
            the old one.
    """
    text, root = composed(file, content)
    found = _row_at(file, text, root, paths[0])
    row = _rows_of(file, text, found)
    place, depth = row.ranges[row.position][0], found.depth
    list_path, insides = paths[0][: depth - 1], [path[depth:] for path in paths]
    if any(path[:depth] != paths[0][:depth] for path in paths):
        raise row.refusal('not all numbers are in this row; edit the file by hand', place)
    below = 0
    copies = iter(behind)
    for index in range(found.position + 1, len(found.sequence.value)):
        standing = yaml_places(file, content, [[*list_path, index, *inside] for inside in insides])
        said = [one and one.value for one in standing]
        if not any(said == list(copy) for copy in copies):
            break
        below += 1
    changed = rows.with_copies(row, len(added), below)[0].encode('utf-8')
    first = found.position + below + 1
    found.sequence.value[first:first] = [found.sequence.value[found.position]] * len(added)
    _check_says(file, changed, root, row)
    changes = [
        YamlChange([*list_path, first + number, *inside], (), value, 'the row')
        for number, one in enumerate(added)
        for inside, value in zip(insides, one)
    ]
    edits, left = yaml_edits(file, changed, changes)
    if left:
        raise row.refusal(f'{left[0][1]}; edit the file by hand', place)
    made = replaced(changed, edits).decode('utf-8')
    return ([_edit(file, content, text, made)] if added else []), depth, below


def _check_says(file: str, changed: bytes, root: Any, row: rows.Rows) -> None:
    """Raise FileError unless a changed content says what a tree of nodes does."""
    try:
        is_same = list(_said(composed(file, changed)[1])) == list(_said(root))
    except FileError:
        is_same = False
    if not is_same:
        reason = 'the file would not say the same otherwise; edit it by hand'
        raise row.refusal(reason, row.ranges[row.position][0])


def _edit(file: str, content: bytes, text: str, changed: str) -> Edit:
    """The edit of a content, with a text, that gives it another one."""
    start, end, new = rows.difference(text, changed)
    first, last = (len(text[:place].encode('utf-8')) for place in (start, end))
    return Edit(file, digest_of(content), first, last, content[first:last], new.encode('utf-8'))


def _row_at(file: str, text: str, root: Any, path: _Path) -> _Found:
    """The element of the list of rows on a path.

    Raises:
        FileError: there is none.
    """
    node, found = root, []
    for depth, step in enumerate(path, 1):
        parts: List[yaml.Node] = []
        if isinstance(node, yaml.MappingNode):
            parts = [part for key, part in node.value if key.value == str(step)]
        elif isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
            parts = [node.value[step]]
            found.append(_Found(node, step, depth))
        if len(parts) != 1:
            raise FileError(file, None, None, f'the file has no {"/".join(map(str, path))} any more')
        node = parts[0]
    compound = [one for one in found if not isinstance(one.sequence.value[one.position], yaml.ScalarNode)]
    chosen = compound[-1:] or found[-1:]
    if not chosen:
        place = node.start_mark.index if node else 0
        raise rows.refusal(file, text, place, 'no list of alike rows stands here; edit the file by hand')
    return chosen[0]


def _rows_of(file: str, text: str, found: _Found) -> rows.Rows:
    """The rows of a sequence, with their places.

    Raises:
        FileError: its elements are not alike, or cannot be moved or copied as text.
    """
    sequence = found.sequence
    tokens = list(yaml.scan(text, Loader=yaml.SafeLoader))
    is_flow = sequence.flow_style
    ranges = [(one.start_mark.index, _end_of(one)) for one in sequence.value]
    opening = PROPERTIES.match(text, sequence.start_mark.index).end() + 1  # type: ignore[union-attr]
    if not is_flow:
        dashes = [token.start_mark.index for token in tokens if isinstance(token, yaml.BlockEntryToken)]
        ranges = [(max(dash for dash in dashes if dash < start), max(start, end)) for start, end in ranges]
        first = ranges[0][0]
        opening = first if re.fullmatch('[- ]*', text[rows.line_start(text, first) : first]) else -1

    def comment_at(place: int) -> int:
        end = rows.line_end(text, place)
        comment = _COMMENT.search(text, place, end)
        return comment.start() if comment else end

    row = rows.Rows(file, text, ranges, found.position, opening, ',' if is_flow else '', False, comment_at)
    rows.check_alike(row, [_shape(one) for one in sequence.value])
    for token in tokens:
        start, end = ranges[found.position]
        if start <= token.start_mark.index < end:
            if isinstance(token, (yaml.AnchorToken, yaml.AliasToken)):
                reason = 'an anchor or an alias stands in the row; edit the file by hand'
                raise row.refusal(reason, token.start_mark.index)
            if isinstance(token, yaml.ScalarToken) and token.style in ('|', '>'):
                reason = 'a text in a block of lines stands in the row; edit the file by hand'
                raise row.refusal(reason, token.start_mark.index)
    last = ranges[-1][1]
    behind = text[last : comment_at(last)]
    if is_flow and re.search(r'[^\s,\]}]', behind):
        raise row.refusal('something else stands behind the list on its line; put the last row on its own', last)
    return row


def _end_of(node: yaml.Node) -> int:
    """Return the end of a node; PyYAML has the end of a block behind the blank lines and comments that follow it."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        node = node.value[-1]
        if isinstance(node, tuple):
            node = node[1]
    return int(node.end_mark.index)


def _shape(node: yaml.Node) -> Tuple[object, ...]:
    """Return a tuple that is equal for alike rows."""
    if isinstance(node, yaml.MappingNode):
        return ('map', sorted(str(key.value) for key, _ in node.value))
    if isinstance(node, yaml.SequenceNode):
        return ('list', len(node.value))
    return ('number',) if _is_number(node) else ('scalar', node.tag)


def _is_number(node: yaml.Node) -> bool:
    return isinstance(node, yaml.ScalarNode) and node.tag in ('tag:yaml.org,2002:int', 'tag:yaml.org,2002:float')


def _said(node: Any) -> Iterator[Tuple[object, ...]]:
    """Yield the content of a YAML node, without places and layout."""
    if node is None:
        return
    yield (type(node), node.tag, node.value if isinstance(node, yaml.ScalarNode) else len(node.value))
    for part in [] if isinstance(node, yaml.ScalarNode) else node.value:
        for one in part if isinstance(part, tuple) else (part,):
            yield from _said(one)
