"""The diff of one file, as saving its changed values would write it; and the writing."""

import os
import sys
from typing import Dict, List, NamedTuple, Sequence, Tuple

from rosslt import files, node
from rosslt.node import Place
from rosslt.web.locations import TIMEOUT

NOTHING_TO_SAVE = 'nothing to save: all is as the file says'


class Offer(NamedTuple):
    """What saving would write into a file.

    Attributes:
        nodes: those that its values belong to.
        edits: of the file.
        lines: all of it, with the edits: (' ', '-' or '+', text); none if there is nothing to write.
        left: what is not saved and why, or why nothing is, for people.
    """

    nodes: Sequence[str]
    edits: List[files.Edit]
    lines: List[Tuple[str, str]]
    left: List[str]


def offer(file: str, places: Sequence[Place]) -> Offer:
    """Ask the owners of a file's values what saving would write into it.

    Args:
        file: its path.
        places: the locations that stand in it.
    """
    names: Dict[str, List[str]] = {}
    for place in places:
        names.setdefault(place.node, []).append(place.local_name)
    edits: List[files.Edit] = []
    left: List[str] = []
    for name, there in names.items():
        try:
            made, unsaved = node.changes_to_save(name, TIMEOUT)
        except node.SourceUnreachable as error:
            left.append(f'{name} does not answer: {error}')
            continue
        edits += [edit for edit in made if os.path.realpath(edit.file) == os.path.realpath(file)]
        left += [f'{name}/{one.name} cannot be saved: {one.reason}' for one in unsaved if one.name in there]
    try:
        lines = _lines(edits)
    except files.FileError as error:
        return Offer(list(names), [], [], [*left, f'nothing can be saved: {error}'])
    if not edits and not left:
        left = [text for text in (node.differing_in(name, TIMEOUT) for name in names) if text] or [NOTHING_TO_SAVE]
    return Offer(list(names), edits, lines, left)


def write(offered: Offer) -> str:
    """Write what has been shown, and nothing else; say what was written, or why nothing is."""
    try:
        files.write(offered.edits)
    except files.FileError as error:
        return f'nothing is written: {error}'
    for name in offered.nodes:
        node.tell_saved(name, offered.edits, TIMEOUT)
    return f'saved in {offered.edits[0].file}'


def _lines(edits: Sequence[files.Edit]) -> List[Tuple[str, str]]:
    """All lines of the file that edits are of, with those that they write; not the note that a last one has no end."""
    diff = files.unified_diff(edits, context=sys.maxsize).encode('utf-8', 'surrogateescape').decode('utf-8', 'replace')
    head_and_lines = diff.split('\n')
    return [(line[0], line[1:].rstrip('\r')) for line in head_and_lines[3:-1] if line[0] != '\\']
