"""YAML within launch files, `<rosparam>a: 1.5</rosparam>`: other values in it, and every other byte as it is."""

from typing import List, Sequence, Tuple

from rosslt.files.launch_text import Event, becomes, events_of, tags_in
from rosslt.files.python_source import Edit, digest_of, replaced
from rosslt.files.yaml_text import YamlChange, yaml_edits


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
    events = events_of(file, content)
    tags = tags_in(events, 'rosparam')
    if len(tags) != count:
        reason = f'it is not certain which <rosparam> of {file} it is since that was edited'
        return [], [(change.what, reason) for change in changes]
    index = tags[nth] + 1
    start, end = events[index].start, events[index + 1].start if events[index].kind == 'text' else events[index].start
    text = content[start:end]
    if any(mark in text for mark in (b'<', b'&', b']]>')):
        reason = f'its <rosparam> in {file} is in a notation of XML that is not rewritten'
        return [], [(change.what, reason) for change in changes]
    made, left = yaml_edits(file, text, changes)
    edits: List[Edit] = []
    for one in made:
        said = [*events[:index], _with_text(events[index], replaced(text, [one])), *events[index + 1 :]]
        edit = one._replace(digest=digest_of(content), start=one.start + start, end=one.end + start)
        if becomes(content, edit, said):
            edits.append(edit)
        else:
            left.append((one.what, f'{one.new.decode()} would need a notation of XML in its <rosparam> in {file}'))
    return edits, left


def _with_text(event: Event, text: bytes) -> Event:
    """A text in XML, which reads each end of a line as a line feed."""
    return event._replace(text=text.decode('utf-8').replace('\r\n', '\n').replace('\r', '\n'))
