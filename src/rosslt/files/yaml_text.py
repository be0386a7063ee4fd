"""YAML files as text: other scalars in them, and everything else as it is: comments, layout, quotes."""

import math
import re
from collections import Counter
from typing import Callable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import yaml

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, alike, equal, in_manner_of, truths_in_manner_of, written_as
from rosslt.files.source_text import Edit, digest_of

#: An anchor or a tag, which stands in front of a scalar and stays there.
PROPERTIES = re.compile(r'(?:[&!]\S*\s+)*')

#: The tags that rosparam reads angles by, and what it writes them with where they have none.
_ANGLES = {'!degrees': 'deg', '!radians': 'rad'}


class YamlChange(NamedTuple):
    """A number, a text or a truth value of a YAML file that is to be another one.

    Attributes:
        path: of keys and indices, from the root of the document.
        said: what stood there when the file was read, and what may have been saved there since; empty for whatever
            stands there.
        value: what should stand there.
        what: what people call it.
    """

    path: Sequence[Union[str, int]]
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
    try:
        text = content.decode('utf-8')
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise FileError(file, None, None, f'it cannot be read: {error}') from None
    uses: Counter = Counter()
    _count_uses(root, uses)
    edits, left = [], []
    for change in changes:
        try:
            node = _node_at(root, change.path)
            start, end = node.start_mark.index, node.end_mark.index
            properties = PROPERTIES.match(text, start, end)
            start = properties.end() if properties else start
            old, present = text[start:end], _constructed(node)
            if equal(present, change.value):
                continue
            _node_at(root, change.path, uses)
            if change.said and not any(equal(present, one) for one in change.said):
                raise ValueError(f'it was edited since it was loaded: {file} says {old} instead of {change.said[0]!r}')
            if not alike(present, change.value):
                raise ValueError(f'{change.value!r} is of another kind than {present!r}, which {file} says')
            if isinstance(change.value, (str, bool)):
                new = _word(text, node, (start, end), change)
            else:
                start, new = _number(text, node, (start, end), change.value)
        except ValueError as error:
            left.append((change.what, str(error)))
            continue
        first, last = (len(text[:place].encode('utf-8')) for place in (start, end))
        edits.append(Edit(file, digest_of(content), first, last, content[first:last], new.encode(), change.what))
    return edits, left


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


def _node_at(node: yaml.Node, path: Sequence[Union[str, int]], uses: Optional[Counter] = None) -> yaml.Node:
    """The scalar at a path; ValueError where there is none, or, with `uses`, where it is used more than once."""
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
        raise ValueError(f'{"/".join(map(str, path))} is no single value any more')
    return node


def ranges_at(text: str, paths: Sequence[Sequence[Union[str, int]]]) -> List[Tuple[int, int]]:
    """Find the ranges of the scalars at paths in a YAML text, in its order; without those that it does not have."""
    found = set()
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return []
    for path in paths:
        try:
            node = _node_at(root, path)
        except ValueError:
            continue
        found.add((node.start_mark.index, node.end_mark.index))
    return sorted(found)


def _constructed(node: yaml.Node) -> object:
    """Read a scalar by its tag; None where it is no YAML that is read safely."""
    try:
        return yaml.SafeLoader('').construct_object(node, deep=True)
    except Exception:  # rosparam evaluates its angles, which raises whatever is wrong with them
        return None


def _number(text: str, node: yaml.Node, place: Tuple[int, int], value: Union[int, float]) -> Tuple[int, str]:
    """Write a number in the notation of the number that it replaces.

    Args:
        text: the whole YAML.
        node: what stands there now.
        place: its range in the text, without its anchor and its tag.

    Returns:
        Where what is written begins, and it: a tag in front, such as `!degrees`, has its say in what a number is.

    Raises:
        ValueError: nothing reads back to exactly that value.
    """
    (start, end), first = place, node.start_mark.index
    old, properties = text[start:end], text[first:start]
    if node.style in ('|', '>') or '\n' in old or '\r' in old:
        raise ValueError('a number that is written in several lines is not rewritten')
    if not any(one.startswith('!') for one in properties.split()):
        return start, _angle(old, value, yaml.safe_load) or written_as(old, value, yaml.safe_load)

    def read(written: str) -> object:
        return _constructed(yaml.ScalarNode(node.tag, written))

    unit = _ANGLES.get(node.tag)
    if unit is None:  # `!!float 1` stays a float
        return start, written_as(old, float(value) if type(_constructed(node)) is float else value, read)
    angle = _angle(old, value, read) or _angle(f'{unit}({old})', value, lambda whole: read(whole[4:-1]))
    if angle is None:
        return first, re.sub(r'!\S+\s+', '', properties) + written_as(old, value, yaml.safe_load)
    return start, angle if old.startswith(unit) else angle[4:-1]


def _word(text: str, node: yaml.Node, place: Tuple[int, int], change: YamlChange) -> str:
    """Write a text or a truth value in the notation of the scalar that it replaces.

    Args:
        text: the whole YAML.
        node: what stands there now.
        place: its range in the text, without its anchor and its tag.

    Raises:
        ValueError: nothing reads back to exactly that value, and leaves all else as it was.
    """
    start, end = place
    if node.style in ('|', '>') or '\n' in text[start:end] or '\r' in text[start:end]:
        raise ValueError('a text of several lines is not rewritten')
    for candidate in _words(text[start:end], node.style, change.value):
        if _says_instead(text, text[:start] + candidate + text[end:], node, change):
            return candidate
    raise ValueError(f'{change.value!r} cannot be written in the place of {text[start:end]}')


def _words(old: str, style: Optional[str], value: Scalar) -> Iterator[str]:
    if isinstance(value, bool):
        yield from truths_in_manner_of(old, value)
        return
    if style is None and value:
        yield str(value)
    for quotes in ("'", '"')[style == '"' :]:
        yield yaml.safe_dump(value, default_style=quotes, allow_unicode=True, width=float('inf')).rstrip('\n')


def _says_instead(before: str, after: str, node: yaml.Node, change: YamlChange) -> bool:
    """Return whether a YAML text differs from the one before in that value alone."""
    try:
        old, new = list(yaml.parse(before, yaml.SafeLoader)), list(yaml.parse(after, yaml.SafeLoader))
        place = next(
            index
            for index, event in enumerate(old)
            if event.start_mark.index == node.start_mark.index and isinstance(event, yaml.ScalarEvent)
        )
        if len(new) != len(old) or not isinstance(new[place], yaml.ScalarEvent):
            return False
        is_same = all(
            type(one) is type(other)
            and (index == place or getattr(one, 'value', None) == getattr(other, 'value', None))
            and all(
                getattr(one, name, None) == getattr(other, name, None)
                for name in ('anchor', 'tag', 'flow_style', *(() if index == place else ('style', 'implicit')))
            )
            for index, (one, other) in enumerate(zip(old, new))
        )
        now = _node_at(yaml.compose(after, Loader=yaml.SafeLoader), change.path)
    except (yaml.YAMLError, ValueError):
        return False
    return is_same and now.end_mark.line == now.start_mark.line and equal(_constructed(now), change.value)


def _angle(old: str, value: float, read: Callable[[str], object]) -> Optional[str]:
    """A number as the angle of rosparam that it was, `deg(45)` or `rad(0.5)`; None where it cannot be."""
    match = re.fullmatch(r'(deg|rad)\(\s*(.*?)\s*\)', old)
    if not match:
        return None
    unit, inner = match.groups()
    candidates = [value] if unit == 'rad' else [round(math.degrees(value), digits) for digits in range(16)]
    for candidate in candidates:
        text = f'{unit}({in_manner_of(inner, candidate)})'
        if repr(read(text)) == repr(value):
            return text
    return None
