"""YAML files as text: other scalars in them, and everything else as it is: comments, layout, quotes."""

import re
from collections import Counter
from typing import List, NamedTuple, Optional, Sequence, Tuple, Union

import yaml

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, check_replaceable, equal, notations, same
from rosslt.files.python_source import Edit, Standing, digest_of

#: An anchor or a tag, which stands in front of a scalar and stays there.
PROPERTIES = re.compile(r'(?:[&!]\S*\s+)*')


#: Keys and indices, from the root of a document to a value in it.
_Path = Sequence[Union[str, int]]


class YamlChange(NamedTuple):
    """The change of a number, a text or a truth value in a YAML file.

    Attributes:
        path: of keys and indices, from the root of the document.
        said: what stood there when the file was read, and what may have been saved there since; empty for whatever
            stands there.
        value: what should stand there.
        what: what people call it.
    """

    path: _Path
    said: Sequence[Scalar]
    value: Scalar
    what: str


def yaml_edits(file: str, content: bytes, changes: Sequence[YamlChange]) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give a YAML file other values, and leave every other byte as it is.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: the file is no YAML, or not in UTF-8.
    """
    text, root = composed(file, content)
    uses: Counter = Counter()
    _count_uses(root, uses)
    edits, left = [], []
    for change in changes:
        try:
            node = _node_at(root, change.path)
            present = _constructed(node)
            if equal(present, change.value):
                continue
            _node_at(root, change.path, uses)
            start, end = _range_of(text, node)
            check_replaceable(file, text[start:end], present, change.said, change.value)
            new = _written(text, node, (start, end), change)
        except ValueError as error:
            left.append((change.what, str(error)))
            continue
        first, last = _in_bytes(text, start, end)
        edits.append(Edit(file, digest_of(content), first, last, content[first:last], new.encode(), change.what))
    return edits, left


def yaml_places(file: str, content: bytes, paths: Sequence[_Path]) -> List[Optional[Standing]]:
    """Find where single values stand in a YAML file.

    Args:
        file: its path.
        content: of it.
        paths: of keys and indices, from the root of the document.

    Returns:
        Where each stands, without its anchor and its tag; None if there is no single value at its path.

    Raises:
        FileError: the file is no YAML, or not in UTF-8.
    """
    text, root = composed(file, content)
    found: List[Optional[Standing]] = []
    for path in paths:
        try:
            node = _node_at(root, path)
        except ValueError:
            found.append(None)
        else:
            found.append(Standing(*_in_bytes(text, *_range_of(text, node)), _constructed(node)))
    return found


def composed(file: str, content: bytes) -> Tuple[str, yaml.Node]:
    """The text of a YAML file, and the root of its document."""
    try:
        text = content.decode('utf-8')
        return text, yaml.compose(text, Loader=yaml.SafeLoader)
    except (UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise FileError(file, None, None, f'it cannot be read: {error}') from None


def _range_of(text: str, node: yaml.Node) -> Tuple[int, int]:
    """The range of a scalar in the text, without its anchor and its tag."""
    start, end = node.start_mark.index, node.end_mark.index
    properties = PROPERTIES.match(text, start, end)
    return (properties.end() if properties else start), end


def _in_bytes(text: str, start: int, end: int) -> Tuple[int, int]:
    """A range of a text as that of its bytes."""
    first = len(text[:start].encode('utf-8'))
    return first, first + len(text[start:end].encode('utf-8'))


def _count_uses(node: yaml.Node, uses: Counter) -> None:
    """Count how often each scalar is used, by an alias say."""
    waiting, seen = [node], set()
    while waiting:
        node = waiting.pop()
        uses[id(node)] += 1
        if node is None or id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, yaml.MappingNode):
            waiting += [part for pair in node.value for part in pair]
        elif isinstance(node, yaml.SequenceNode):
            waiting += node.value


def _node_at(node: yaml.Node, path: _Path, uses: Optional[Counter] = None) -> yaml.Node:
    """The scalar at a path; ValueError if there is none, or, with `uses`, if it is used more than once."""
    for step in path:
        found: List[yaml.Node] = []
        if isinstance(node, yaml.MappingNode):
            found = [part for key, part in node.value if key.value == str(step)]
        elif isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
            found = [node.value[step]]
        if len(found) != 1:
            raise ValueError(f'the file has no {"/".join(map(str, path))} any more')
        node = found[0]
        if uses and uses[id(node)] > 1:
            raise ValueError('it is one value in several places, and would have to be two')
    if not isinstance(node, yaml.ScalarNode):
        raise ValueError(f'{"/".join(map(str, path))} is not a single value any more')
    return node


def _constructed(node: yaml.Node) -> object:
    """Read a scalar by its tag; None if it is no YAML that is read safely."""
    try:
        return yaml.SafeLoader('').construct_object(node, deep=True)
    except Exception:  # rosparam evaluates its angles, which raises whatever is wrong with them
        return None


def _written(text: str, node: yaml.Node, place: Tuple[int, int], change: YamlChange) -> str:
    """Write a value in the notation of the scalar that it replaces.

    Args:
        text: the whole YAML.
        node: what stands there now.
        place: its range in the text, without its anchor and its tag.

    Raises:
        ValueError: nothing reads back to exactly that value, and leaves all else as it was.
    """
    start, end = place
    old = text[start:end]
    if '\n' in old or '\r' in old:
        raise ValueError('what is written in several lines is not rewritten')
    for candidate in notations(old, change.value):
        if _says_instead(text, text[:start] + candidate + text[end:], node, change):
            return candidate
    raise ValueError(f'{change.value!r} cannot be written in the place of {old}')


def _says_instead(before: str, after: str, node: yaml.Node, change: YamlChange) -> bool:
    """Return whether a YAML text differs from the one before in that value alone."""
    try:
        old, new = list(yaml.parse(before, yaml.SafeLoader)), list(yaml.parse(after, yaml.SafeLoader))
        now = _node_at(yaml.compose(after, Loader=yaml.SafeLoader), change.path)
    except (yaml.YAMLError, ValueError):
        return False
    return (
        len(old) == len(new)
        and all(
            _content(one) == _content(other)
            or (isinstance(one, yaml.ScalarEvent) and one.start_mark.index == node.start_mark.index)
            for one, other in zip(old, new)
        )
        and now.end_mark.line == now.start_mark.line
        and same(_constructed(now), change.value)
    )


def _content(event: yaml.Event) -> Tuple[object, ...]:
    """The content of an event of YAML, without its position."""
    return (type(event), *(getattr(event, name, None) for name in ('anchor', 'tag', 'implicit', 'value')))
