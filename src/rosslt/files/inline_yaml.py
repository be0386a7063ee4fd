"""YAML within launch files, `<rosparam>a: 1.5</rosparam>`: other values in it, and every other byte as it is."""

import contextlib
from typing import Iterator, List, Optional, Sequence, Tuple, Union

from rosslt.files.errors import FileError
from rosslt.files.launch_text import Event, becomes, events_of, tags_in
from rosslt.files.notation import Scalar
from rosslt.files.python_source import Edit, Standing, digest_of, replaced
from rosslt.files.yaml_rows import yaml_row_additions, yaml_row_edits
from rosslt.files.yaml_text import YamlChange, yaml_edits, yaml_places


def inline_edits(
    file: str, content: bytes, nth: int, count: int, changes: Sequence[YamlChange]
) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give the YAML of one <rosparam> of a launch file other values.

    Args:
        file: the launch file's path.
        content: all of it.
        nth: which <rosparam> of the file it was when that was loaded.
        count: how many it had then.
        changes: of its values, with paths from the root of its YAML.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: the file is no XML, or its YAML cannot be read.
    """
    try:
        text, place = _inline(file, content, nth, count)
    except ValueError as error:
        return [], [(change.what, str(error)) for change in changes]
    made, left = yaml_edits(file, text, changes)
    edits: List[Edit] = []
    for one in made:
        edit = _placed(content, text, place, one)
        if edit is not None:
            edits.append(edit)
        else:
            left.append((one.what, f'{one.new.decode()} would need a notation of XML in its <rosparam> in {file}'))
    return edits, left


def inline_places(
    file: str, content: bytes, nth: int, count: int, paths: Sequence[Sequence[Union[str, int]]]
) -> List[Optional[Standing]]:
    """Find where single values stand in the YAML of one <rosparam> of a launch file.

    Args:
        file, content, nth, count: as in `inline_edits`.
        paths: as in `yaml_places`, and so is what is returned; all are None if it is not certain which <rosparam> it
            is, or if that is in a notation of XML.

    Raises:
        FileError: as in `inline_edits`.
    """
    try:
        text, place = _inline(file, content, nth, count)
    except ValueError:
        return [None] * len(paths)
    found = yaml_places(file, text, paths)
    return [one and one._replace(start=one.start + place, end=one.end + place) for one in found]


def inline_row_edits(
    file: str, content: bytes, nth: int, count: int, path: Sequence[Union[str, int]], operation: str
) -> Tuple[List[Edit], int]:
    """Make the edits that do something with a row in the YAML of one <rosparam> of a launch file.

    Args:
        file, content, nth, count: as in `inline_edits`.
        path, operation: as in `yaml_row_edits`, and so is what is returned.

    Raises:
        FileError: as in `yaml_row_edits`, or it is not certain which <rosparam> it is.
        ValueError: as in `yaml_row_edits`.
    """
    with _in_lines_of(file, content, nth, count) as (text, place):
        made, depth = yaml_row_edits(file, text, path, operation)
    return _all_placed(file, content, text, place, made), depth


def inline_row_additions(
    file: str,
    content: bytes,
    nth: int,
    count: int,
    paths: Sequence[Sequence[Union[str, int]]],
    added: Sequence[Sequence[Scalar]],
    behind: Sequence[Sequence[Scalar]] = (),
) -> Tuple[List[Edit], int, int]:
    """Make the edits that add copies of a row in the YAML of one <rosparam> of a launch file.

    Args:
        file, content, nth, count: as in `inline_edits`.
        paths, added, behind: as in `yaml_row_additions`, and so is what is returned.

    Raises:
        FileError: as in `yaml_row_additions`, or it is not certain which <rosparam> it is.
    """
    with _in_lines_of(file, content, nth, count) as (text, place):
        made, depth, below = yaml_row_additions(file, text, paths, added, behind)
    return _all_placed(file, content, text, place, made), depth, below


@contextlib.contextmanager
def _in_lines_of(file: str, content: bytes, nth: int, count: int) -> Iterator[Tuple[bytes, int]]:
    """Yield the YAML of one <rosparam>, and where it begins in the content; errors in it are said with their place in
    the launch file."""
    try:
        text, place = _inline(file, content, nth, count)
    except ValueError as error:
        raise FileError(file, None, None, str(error)) from None
    try:
        yield text, place
    except FileError as error:
        if error.line is None:
            raise
        # The YAML begins somewhere in a line of the launch file.
        lines = content[:place].decode('utf-8', 'replace').split('\n')
        column = (error.column or 1) + (len(lines[-1]) if error.line == 1 else 0)
        raise FileError(file, error.line + len(lines) - 1, column, error.reason) from None


def _all_placed(file: str, content: bytes, text: bytes, place: int, made: List[Edit]) -> List[Edit]:
    """Edits of a YAML text as those of the launch file; FileError if XML would read one as something else."""
    edits = [_placed(content, text, place, one) for one in made]
    if None in edits:
        raise FileError(file, None, None, 'the row would need a notation of XML in its <rosparam>; edit it by hand')
    return [edit for edit in edits if edit is not None]


def _inline(file: str, content: bytes, nth: int, count: int) -> Tuple[bytes, int]:
    """The YAML of one <rosparam>, and where it begins in the content; ValueError if it is not certain, or not there
    as it is read."""
    events = events_of(file, content)
    tags = tags_in(events, 'rosparam')
    if len(tags) != count:
        raise ValueError(f'it is not certain which <rosparam> of {file} it is since that was edited')
    index = tags[nth] + 1
    start, end = events[index].start, events[index + 1].start if events[index].kind == 'text' else events[index].start
    text = content[start:end]
    if any(mark in text for mark in (b'<', b'&', b']]>')):
        raise ValueError(f'its <rosparam> in {file} is in a notation of XML that is not rewritten')
    return text, start


def _placed(content: bytes, text: bytes, place: int, one: Edit) -> Optional[Edit]:
    """An edit of a YAML text as one of the launch file in which it begins at a place; None if XML would read it as
    something else."""
    events = events_of(one.file, content)
    index = next(index for index, event in enumerate(events) if event.start == place and event.kind == 'text')
    said = [*events[:index], _with_text(events[index], replaced(text, [one])), *events[index + 1 :]]
    edit = one._replace(digest=digest_of(content), start=one.start + place, end=one.end + place)
    return edit if becomes(content, edit, said) else None


def _with_text(event: Event, text: bytes) -> Event:
    """A text in XML, which reads each end of a line as a line feed."""
    return event._replace(text=text.decode('utf-8').replace('\r\n', '\n').replace('\r', '\n'))
