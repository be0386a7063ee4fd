"""Source files and the values of locations in them: where each stands in the file as it is now."""

import re
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Set, Tuple

from rosslt import files, node, srv
from rosslt.node import Place
from rosslt.web.locations import TIMEOUT, Key, number_said

#: {full name of a parameter: where it is given}, as `rosslt launch` has noted it.
Origins = Mapping[str, Any]

#: The ends of lines, as browsers and Python see them.
NEWLINE = re.compile(r'\r\n|\r|\n')

#: What stands in front of an angle that is written in degrees.
DEGREES = re.compile(r'!degrees\s+(?:&\S+\s+)?$')

#: A text in quotes.
QUOTED = re.compile(r'[uUrR]?("""|\'\'\'|"|\')(.*)\1')


class Mark(NamedTuple):
    """A value in a file: its line and column, which count from 1, in characters; how it is written, a text without its
    quotes; and the value."""

    line: int
    column: int
    token: str
    value: Any


class Document(NamedTuple):
    """A file.

    Attributes:
        text: its content; '' if it cannot be read.
        marks: the values of locations in it.
        notes: why others are not marked, for people.
    """

    text: str
    marks: Dict[Key, Mark]
    notes: List[str]


def key_of(place: Place) -> Key:
    """The key of a location."""
    return place.node, place.location.id


def file_of(place: Place, origins: Origins) -> str:
    """The file that the value of a location stands in: that which gives a parameter, if there is one.

    Args:
        place: the location.
        origins: {full name of a parameter: where it is given}.
    """
    origin = _origin_of(place, origins)
    return origin['file'] if origin else place.location.file


def _origin_of(place: Place, origins: Origins) -> Any:
    """Where a parameter is given; None if it is a value in the code, or if its row was deleted."""
    name = place.location.name
    origin = node.origin_of(name, origins) if name.startswith('/') else None
    return None if origin is None or origin.get('is_gone') else origin


def read(file: str, content: bytes, places: Sequence[Place], origins: Origins) -> Tuple[Document, bool]:
    """Find the values of a file; the owners of those in code are asked where they stand since it was edited.

    Args:
        file: its path.
        content: what it says now.
        places: the locations that stand in it, as their owners report them.
        origins: {full name of a parameter: where it is given}.

    Returns:
        The document, and whether all owners have answered.
    """
    given = [(place, origin) for place in places for origin in [_origin_of(place, origins)] if origin]
    in_code = [place for place in places if _origin_of(place, origins) is None]
    try:
        document = _given_in(file, content, given)
        if not in_code:
            return document, True
        code, is_complete = _in_code(file, content, in_code)
    except files.FileError as error:
        return Document(content.decode('utf-8', 'replace'), {}, [f'nothing is marked: {error}']), True
    return Document(code.text, {**document.marks, **code.marks}, [*document.notes, *code.notes]), is_complete


def _given_in(file: str, content: bytes, given: Sequence[Tuple[Place, Any]]) -> Document:
    """Find the values of a file that gives parameters.

    Raises:
        FileError: it cannot be read.
    """
    text = content.decode('utf-8', 'replace')
    whole = [(place, origin) for place, origin in given if not node.why_not_written(place, origin)]
    stands = node.parameter_places(file, content, whole) if whole else {}
    marks: Dict[Key, Mark] = {}
    reasons: Dict[str, List[str]] = {}
    for place, origin in given:
        stand = stands.get(place.source)
        if stand is None:
            reason = node.why_not_written(place, origin) or (
                'the file has changed since it was loaded, or says no single value there'
            )
            reasons.setdefault(reason, []).append(place.name)
            continue
        token = content[stand.start : stand.end].decode('utf-8', 'replace')
        if NEWLINE.search(token):
            reasons.setdefault('it is written in several lines', []).append(place.name)
            continue
        before = content[: stand.start].decode('utf-8', 'replace')
        reason = _why_not_typed(before, token, stand.value)
        if reason:
            reasons.setdefault(reason, []).append(place.name)
            continue
        line, column = len(NEWLINE.findall(before)) + 1, len(NEWLINE.split(before)[-1]) + 1
        marks[key_of(place)] = _mark(line, column, token, stand.value)
    return Document(text, marks, [f'not marked are {", ".join(names)}: {why}' for why, names in reasons.items()])


def _why_not_typed(before: str, token: str, value: object) -> str:
    """Why no number is typed in the place of one, as it would be taken for another one there; '' if one is.

    Args:
        before: the text in front of it.
        token: how it is written.
        value: what that reads as.
    """
    if type(value) not in (int, float):
        return ''
    if DEGREES.search(before):
        return 'it is written in degrees, and the value is in radians'
    number = number_said(token.replace('_', ''))
    return '' if number is None or number == value else 'it is not written as a decimal number'


def _mark(line: int, column: int, token: str, value: Any) -> Mark:
    """The mark of a value; a text has it within its quotes."""
    match = QUOTED.fullmatch(token) if isinstance(value, str) and token != value else None
    return Mark(line, column + match.start(2), match[2], value) if match else Mark(line, column, token, value)


def _in_code(file: str, content: bytes, places: Sequence[Place]) -> Tuple[Document, bool]:
    """Find the values in a text in Python syntax.

    Returns:
        As `read`.

    Raises:
        FileError: it is not in Python syntax.
    """
    source = files.SourceText(file, content)
    nodes = {place.node for place in places}
    answers, silent = node.ask_all('list_edits', srv.ListEdits, dict.fromkeys(nodes, srv.ListEditsRequest()), TIMEOUT)
    stands: Dict[Key, Tuple[int, int]] = {}
    to_save: Set[Key] = set()
    for name, answer in answers.items():
        for number, line, column in zip(answer.read_ids, answer.lines, answer.columns):
            stands[name, number] = line, column
        to_save.update((name, edit.location_id) for edit in answer.edits)
    marks: Dict[Key, Mark] = {}
    lost: Dict[str, List[str]] = {}
    for place in places:
        key, location = key_of(place), place.location
        if place.node in silent:
            continue
        index = source.literal_at(*stands.get(key, (location.line, location.column)))
        one = None if index is None else source.literals[index]
        if one is not None and (key in to_save or _says(place, one.value, key in stands)):
            marks[key] = _mark(one.line, one.column, source.text[one.start : one.end], one.value)
        elif key in stands:
            lost.setdefault(place.node, []).append(place.local_name)
    notes = [f'{name} does not answer: {why}' for name, why in silent.items()]
    for name, those in lost.items():
        which = ', '.join(those)
        notes.append(f'not marked are {which}: the file has changed since {name} read it, or says no such value there')
    return Document(source.text, marks, notes), not silent


def _says(place: Place, said: object, is_followed: bool) -> bool:
    """Return whether a value in a file is what the owner of a location reports: what the code says, or the value in
    force. The default of a parameter is not reported: its owner has followed it."""
    location = place.location
    if location.literal and files.equal(said, node.from_json(location.literal)):
        return True
    return files.equal(said, place.value) or (is_followed and not location.literal)
