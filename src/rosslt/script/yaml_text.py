"""YAML files as text: other scalars in them, and everything else as it is: comments, layout, quotes."""

import re

import yaml

from rosslt.script.errors import ScriptError

#: An anchor or a tag, which stands in front of a scalar and stays there.
PROPERTIES = re.compile(r'(?:[&!]\S*\s+)*')


def with_values(text, data, file):
    """A YAML text with other scalars.

    Args:
        text: the YAML.
        data: what it shall say: dicts, lists and scalars in the shape of the text. What a dict lacks stays as it is.
        file: its path, for errors.

    Raises:
        ScriptError: the text is no YAML, or is of another shape than the data.
    """
    try:
        root, present = yaml.compose(text, Loader=yaml.SafeLoader), yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise ScriptError(file, *place, getattr(error, 'problem', None) or str(error)) from None
    edits = {}
    _collect(root, present, data, edits, file)
    for (start, end), spelling in sorted(edits.items(), key=lambda edit: edit[0], reverse=True):
        if spelling is not None:
            start = PROPERTIES.match(text, start, end).end()
            text = text[:start] + spelling + text[end:]
    return text


def _collect(node, present, wanted, edits, file):
    """Note {(start, end): new text, or None where it stays} for the scalars of a YAML node."""
    mark = getattr(node, 'start_mark', None)
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
            raise ScriptError(file, line, column, 'this is one value in several places, and would have to be two')
    else:
        raise ScriptError(file, line, column, 'the file has another shape here than {!r}'.format(wanted))


def _spelled(value):
    return yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=float('inf')).splitlines()[0]
