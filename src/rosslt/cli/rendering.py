"""Messages as text: for people YAML with the provenance behind each tracked field, for a pipe lines, and JSON."""

import base64
import json
import math
from typing import Dict, Iterator, List, Sequence, Tuple

import genpy

from rosslt import values
from rosslt.cli.fields import joined
from rosslt.cli.output import shortened, table, write_row
from rosslt.messages import Message
from rosslt.node import Directory, Heard

#: The longest array without provenance that is shown to people in full; programs get all of it.
LONGEST_ARRAY = 120


def yaml_lines(part: Message) -> List[str]:
    """A message or a part of one as YAML, with the provenance in comments."""
    rows = []
    for indent, text, leaf in _yaml_rows(part, 0):
        text = '  ' * indent + text
        rows.append((text, '# ' + values.explain(leaf)) if _has_provenance(leaf) else (text, ''))
    tracked = [row for row in rows if row[1]]
    aligned = iter(table(tracked))
    return [next(aligned) if comment else text for text, comment in rows]


def _yaml_rows(part: Message, depth: int, label: str = '') -> Iterator[Tuple[int, str, Message]]:
    """(depth, text, tracked leaf or None) for each line."""
    prefix = label + ' ' if label else ''
    if _is_structure(part):
        fields = [(name, getattr(part, name)) for name in _names(part)]
        if label:
            yield depth, label, None
        for name, value in fields:
            yield from _yaml_rows(value, depth + bool(label), name + ':')
    elif isinstance(part, (list, tuple)) and (values.is_tracked(part) or any(map(_is_structure, part))):
        if label:
            yield depth, label, None
        for element in part:
            lines = list(_yaml_rows(element, 0))
            for number, (inner, text, leaf) in enumerate(lines):
                yield (depth + bool(label), ('  ' if number else '- ') + '  ' * inner + text, leaf)
    else:
        plain = _jsonable(part)
        text = json.dumps(plain, ensure_ascii=False)
        yield (
            depth,
            prefix + (shortened(text, LONGEST_ARRAY) if isinstance(part, (list, tuple, bytes)) else text),
            part if _has_provenance(part) else None,
        )


def write_lines(part: Message, path: str = '') -> None:
    """Print a line for each scalar: its path, its value, its provenance (empty if it has none)."""
    for leaf_path, leaf in values.leaves(part):
        write_row(joined(path, leaf_path), text_of(leaf), values.explain(leaf) if _has_provenance(leaf) else '')


def json_line(received: Heard, part: Message, path: str, directory: Directory) -> str:
    """A message or a part of one as a line of JSON, with the provenance of its leaves beside it."""
    provenance = {
        joined(path, leaf_path): {
            'expression': values.explain(leaf),
            'sources': [_source(source, directory) for source in values.sources(leaf)],
        }
        for leaf_path, leaf in values.leaves(part)
        if _has_provenance(leaf)
    }
    return json.dumps(
        {
            'topic': received.topic,
            'type': received.type,
            'publisher': received.publisher,
            'field': path,
            'value': _jsonable(part),
            'provenance': provenance,
        },
        ensure_ascii=False,
    )


def _source(source: values.Source, directory: Directory) -> Dict[str, object]:
    described: Dict[str, object] = {'node': source.node, 'location_id': source.location_id}
    place = directory.of(source)
    if place:
        described.update(
            name=place.local_name, file=place.location.file, line=place.location.line, column=place.location.column
        )
    return described


def _has_provenance(leaf: Message) -> bool:
    return (
        leaf is not None and not isinstance(leaf, (list, tuple)) and not _is_structure(leaf) and values.is_tracked(leaf)
    )


def _is_structure(part: Message) -> bool:
    """Return True for a message, a time or a duration."""
    return isinstance(part, (genpy.TVal, genpy.Message))


def _names(part: Message) -> Sequence[str]:
    """The names of a structure's fields."""
    if isinstance(part, genpy.TVal):
        return ('secs', 'nsecs')
    return tuple(part.__slots__)


def text_of(leaf: Message) -> str:
    """A scalar as JSON, a text as it is."""
    plain = _jsonable(leaf)
    return plain if isinstance(plain, str) else json.dumps(plain)


def _jsonable(part: Message) -> Message:
    """Convert a part of a message to JSON types: bytes to base64, as rosbridge does, and infinity and NaN to text."""
    plain = values.untracked(part)
    if _is_structure(plain):
        return {name: _jsonable(getattr(plain, name)) for name in _names(plain)}
    if isinstance(plain, bytes):
        return base64.b64encode(plain).decode('ascii')
    if isinstance(plain, (list, tuple)):
        return [_jsonable(element) for element in plain]
    if isinstance(plain, float) and not math.isfinite(plain):
        return str(plain)
    return plain
