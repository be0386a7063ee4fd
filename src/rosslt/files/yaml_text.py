"""YAML files as text: other scalars in them, and everything else as it is: comments, layout, quotes."""

import re
from typing import Any, Dict, Optional, Tuple

import yaml

from rosslt.files.errors import FileError

#: An anchor or a tag, which stands in front of a scalar and stays there.
PROPERTIES = re.compile(r'(?:[&!]\S*\s+)*')

#: {(start, end) in the text: what takes its place, or None where it stays}
Edits = Dict[Tuple[int, int], Optional[str]]


def with_values(text: str, data: Any, file: str) -> str:
    """A YAML text with other scalars.

    Args:
        text: the YAML.
        data: what it shall say: dicts, lists and scalars in the shape of the text. What a dict lacks stays as it is.
        file: its path, for errors.

    Raises:
        FileError: the text is no YAML, or is of another shape than the data.
    """
    try:
        root, present = yaml.compose(text, Loader=yaml.SafeLoader), yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise FileError(file, line, column, getattr(error, 'problem', None) or str(error)) from None
    edits: Edits = {}
    _collect(root, present, data, edits, file)
    for (start, end), spelling in sorted(edits.items(), key=lambda edit: edit[0], reverse=True):
        if spelling is not None:
            properties = PROPERTIES.match(text, start, end)
            start = properties.end() if properties else start
            text = text[:start] + spelling + text[end:]
    return text


def _collect(node: Any, present: Any, wanted: Any, edits: Edits, file: str) -> None:
    """Note {(start, end): new text, or None where it stays} for the scalars of a YAML node."""
    mark: Any = getattr(node, 'start_mark', None)
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    if isinstance(node, yaml.MappingNode) and isinstance(wanted, dict) and wanted.keys() <= present.keys():
        for key, part in node.value:
            if key.value in wanted:
                _collect(part, present[key.value], wanted[key.value], edits, file)
    elif isinstance(node, yaml.SequenceNode) and isinstance(wanted, (list, tuple)) and len(wanted) == len(present):
        for part, now, then in zip(node.value, present, wanted):
            _collect(part, now, then, edits, file)
    elif isinstance(node, yaml.ScalarNode) and not isinstance(wanted, (dict, list, tuple)):
        spelling = None if wanted == present and type(wanted) is type(present) else _spelled(wanted)
        # An anchor and its aliases are one scalar.
        if edits.setdefault((mark.index, node.end_mark.index), spelling) != spelling:
            raise FileError(file, line, column, 'this is one value in several places, and would have to be two')
    else:
        raise FileError(file, line, column, 'the file has another shape here than {!r}'.format(wanted))


def _spelled(value: Any) -> str:
    dumped: str = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=float('inf'))
    return dumped.splitlines()[0]
