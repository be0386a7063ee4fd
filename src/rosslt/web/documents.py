"""Source files and the numbers of locations in them: where each stands in the file as it is now."""

from typing import Dict, List, NamedTuple, Sequence, Set, Tuple, Union

from rosslt import files, node, srv
from rosslt.node import Place
from rosslt.web.locations import TIMEOUT, Key


class Mark(NamedTuple):
    """A number in a file: its line and column, which count from 1, in characters; how it is written, and its value."""

    line: int
    column: int
    token: str
    value: Union[int, float, str]


class Document(NamedTuple):
    """A file.

    Attributes:
        text: its content; '' if it cannot be read.
        marks: the numbers in it.
        notes: why others are not marked, for people.
    """

    text: str
    marks: Dict[Key, Mark]
    notes: List[str]


def key_of(place: Place) -> Key:
    """The key of a location."""
    return place.node, place.location.id


def read(file: str, content: bytes, places: Sequence[Place]) -> Tuple[Document, bool]:
    """Find the numbers of a file; their owners are asked where these stand since it was edited.

    Args:
        file: its path.
        content: what it says now.
        places: the locations that stand in it, as their owners report them.

    Returns:
        The document, and whether all owners have answered.
    """
    try:
        source = files.SourceText(file, content)
    except files.FileError as error:
        return Document(content.decode('utf-8', 'replace'), {}, [f'no number is marked: {error}']), True
    nodes = {place.node for place in places}
    answers, silent = node.ask_all('list_edits', srv.ListEdits, dict.fromkeys(nodes, srv.ListEditsRequest()), TIMEOUT)
    stands: Dict[Key, Tuple[int, int]] = {}
    to_save: Set[Key] = set()
    for name, answer in answers.items():
        for one, line, column in zip(answer.read_ids, answer.lines, answer.columns):
            stands[name, one] = line, column
        to_save.update((name, edit.location_id) for edit in answer.edits)
    marks: Dict[Key, Mark] = {}
    lost: Dict[str, List[str]] = {}
    for place in places:
        key, location = key_of(place), place.location
        if location.type not in ('int', 'float') or place.node in silent:
            continue
        index = source.number_at(*stands.get(key, (location.line, location.column)))
        number = None if index is None else source.numbers[index]
        if number is not None and (key in to_save or _says(place, number.value, key in stands)):
            marks[key] = Mark(number.line, number.column, source.text[number.start : number.end], number.value)
        elif key in stands:
            lost.setdefault(place.node, []).append(place.local_name)
    notes = [f'{name} does not answer: {why}' for name, why in silent.items()]
    for name, those in lost.items():
        which = ', '.join(those)
        notes.append(f'not marked are {which}: the file has changed since {name} read it, or says no number there')
    return Document(source.text, marks, notes), not silent


def _says(place: Place, said: object, is_followed: bool) -> bool:
    """Return whether a number in a file is what the owner of a location reports: what the code says, or the value in
    force. The default of a parameter is not reported: its owner has followed it."""
    location = place.location
    if location.literal and files.equal(said, node.from_json(location.literal)):
        return True
    return files.equal(said, place.value) or (is_followed and not location.literal)
