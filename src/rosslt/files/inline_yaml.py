"""YAML within launch files, `<rosparam>a: 1.5</rosparam>`: other values in it, and every other byte as it is."""

import re
from typing import Any, List, Optional, Sequence, Tuple, Union
from xml.parsers import expat

from rosslt.files.errors import FileError
from rosslt.files.launch_text import is_in_utf8
from rosslt.files.source_text import Edit, digest_of, replaced
from rosslt.files.yaml_text import YamlChange, ranges_at, yaml_edits

_Path = Sequence[Union[str, int]]

#: Scalars that a save may replace by one of the same kind: an angle of rosparam, or a number.
_NUMBER = re.compile(r'\b(?:deg|rad)\([^)]*\)|[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')


def inline_edits(
    file: str, content: bytes, nth: int, count: int, text: str, changes: Sequence[YamlChange]
) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give the YAML of one <rosparam> of a launch file other values.

    Args:
        file: the launch file's path.
        content: all of it.
        nth: which <rosparam> of the file it was when that was loaded.
        count: how many it had then.
        text: what stood in it then; its numbers, and what is to be changed, may be others by now.
        changes: of its values, with paths from the root of its YAML.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: the file is no XML, or its YAML cannot be read.
    """
    try:
        start, end = _range_of(file, content, nth, count, text, [change.path for change in changes])
    except ValueError as error:
        return [], [(change.what, str(error)) for change in changes]
    made, left = yaml_edits(file, content[start:end], changes)
    edits: List[Edit] = []
    for one in made:
        edit = one._replace(digest=digest_of(content), start=one.start + start, end=one.end + start)
        if _is_read_as_it_is(file, content, edit):
            edits.append(edit)
        else:
            left.append((one.what, f'{one.new.decode()} would need a notation of XML in its <rosparam> in {file}'))
    return edits, left


def _is_read_as_it_is(file: str, content: bytes, edit: Edit) -> bool:
    """Return whether XML reads what an edit writes within a <rosparam> as just that."""
    if b'<' in edit.new or b'&' in edit.new or not (edit.new.isascii() or is_in_utf8(content)):
        return False
    longer = len(edit.new) - (edit.end - edit.start)
    try:
        after = _ranges(file, replaced(content, [edit]))
    except FileError:
        return False
    return after == [tuple(at + longer if at > edit.start else at for at in one) for one in _ranges(file, content)]


def _range_of(file: str, content: bytes, nth: int, count: int, text: str, paths: Sequence[_Path]) -> Tuple[int, int]:
    """Find the range of a <rosparam>'s text, in bytes; ValueError where it is not certain."""
    ranges, blanked = _ranges(file, content), _without_values(text, paths)
    same = [(start, end) for start, end in ranges if _blanked(content[start:end], paths) == blanked]
    # Of several with the same text, another one may be the nth by now.
    if len(ranges) == count and ranges[nth] in same:
        return ranges[nth]
    if len(same) != 1:
        raise ValueError(
            f'the text of its <rosparam> in {file} was edited since it was loaded, or is in a notation of XML that is '
            'not rewritten'
        )
    return same[0]


def _blanked(content: bytes, paths: Sequence[_Path]) -> Optional[str]:
    """A text as XML reads it, without values; None where it is written with entities, comments or in sections."""
    if any(mark in content for mark in (b'<', b'&', b']]>')):
        return None
    return _without_values(content.decode('utf-8', 'replace').replace('\r\n', '\n').replace('\r', '\n'), paths)


def _without_values(text: str, paths: Sequence[_Path]) -> str:
    """A YAML text without its numbers, and without what stands at paths."""
    for start, end in reversed(ranges_at(text, paths)):
        text = text[:start] + text[end:]
    return _NUMBER.sub('', text)


def _ranges(file: str, content: bytes) -> List[Tuple[int, int]]:
    """The ranges of what stands within each <rosparam>, in the order in which they begin."""
    parser = expat.ParserCreate()
    found: List[List[int]] = []
    is_within = False

    def begin(name: str, _: Any) -> None:
        nonlocal is_within
        if name == 'rosparam':
            is_within = True
            found.append([])

    def read(_: str) -> None:
        if is_within and not found[-1]:
            found[-1].append(parser.CurrentByteIndex)

    def end(name: str) -> None:
        nonlocal is_within
        if name == 'rosparam':
            is_within = False
            found[-1].append(parser.CurrentByteIndex)

    parser.StartElementHandler, parser.CharacterDataHandler, parser.EndElementHandler = begin, read, end
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FileError(file, error.lineno, error.offset + 1, expat.ErrorString(error.code)) from None
    return [(one[0], one[-1]) for one in found]
