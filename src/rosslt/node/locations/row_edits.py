"""The row that a location is in, a waypoint of a list say, duplicated, deleted or moved in the file where it stands."""

from typing import List, Sequence, Tuple

import rosgraph
import rospy

from rosslt import files
from rosslt.messages import Message, Scalar
from rosslt.node.locations.directory import Place
from rosslt.node.locations.saving import list_edits

#: The ROS parameter below its node in which the node of a live script says which text of it is in force.
SCRIPT_TEXT = 'rosslt_script'


def row_edits(place: Place, row: Sequence[Place], operation: str, timeout: float) -> List[files.Edit]:
    """Make the edits that do something with the row of a location, in a source file or a live script.

    Args:
        place: the location.
        row: all locations of its row, as far as known.
        operation: one of `files.OPERATIONS`.
        timeout: how long its node may take to answer, in seconds.

    Raises:
        FileError: it is in no row of alike ones, it is not certain where it stands now, or its value is not saved.
        SourceUnreachable: its node does not answer; the message is the reason alone.
    """
    content, ((line, column),) = _text_of([place], row, timeout)
    path = place.location.file
    return files.python_row_edits(path, content, line, column, operation)


def row_additions(places: Sequence[Place], added: Sequence[Sequence[Scalar]], timeout: float) -> List[files.Edit]:
    """Make the edits that add rows below the row that locations are in, in a source file or a live script.

    Args:
        places: the locations, of one node.
        added: for each row, what their numbers are there; all else is as in their row.
        timeout: how long their node may take to answer, in seconds.

    Raises:
        FileError: they are not in one row of alike ones, it is not certain where they stand now, or a value is not
            saved.
        SourceUnreachable: their node does not answer; the message is the reason alone.
    """
    content, stands = _text_of(places, places, timeout)
    return files.python_row_additions(places[0].location.file, content, stands, added)


def _text_of(places: Sequence[Place], row: Sequence[Place], timeout: float) -> Tuple[bytes, List[Tuple[int, int]]]:
    """The content of the file that locations stand in, and the line and column of each in it.

    Args:
        places: the locations, of one node.
        row: those whose values must be saved.
        timeout: how long their node may take to answer, in seconds.

    Raises:
        FileError: it is not certain where they stand now, or a value is not saved.
        SourceUnreachable: their node does not answer; the message is the reason alone.
    """
    answer = list_edits(places[0].node, timeout)
    first = places[0].location
    unread = [one for one in places if one.location.id not in answer.read_ids]
    if unread:
        return _script_of(unread[0]), [(one.location.line, one.location.column) for one in places]
    other = next((one for one in places if one.location.file != first.file), None)
    if other is not None:
        reason = f'{other.local_name} stands in another file, {other.file}; edit them by hand'
        raise files.FileError(first.file, first.line, first.column, reason)
    unsaved = {edit.location_id for edit in answer.edits} | set(answer.left_ids)
    changed = [one.local_name for one in row if one.location.id in unsaved]
    if changed:
        reason = f'{" and ".join(changed)} is changed, and not saved: `rosslt save {places[0].node}` first'
        raise files.FileError(first.file, first.line, first.column, reason)
    stands = [_place_now(one, answer) for one in places]
    return files.read_bytes(first.file), stands


def is_in_script(place: Place) -> bool:
    """Return whether a location is a number of a live script."""
    return not place.location.literal and _script_text(place) is not None


def _place_now(place: Place, answer: Message) -> Tuple[int, int]:
    index = list(answer.read_ids).index(place.location.id)
    line, column = answer.lines[index], answer.columns[index]
    if not line:
        reason = 'its line was edited since the node read it, and may be one of several; start the node again'
        raise files.FileError(place.location.file, place.location.line, place.location.column, reason)
    return line, column


def _script_of(place: Place) -> bytes:
    """The live script that a location is a number of.

    Raises:
        FileError: it is in no live script, or that was edited and is not in force.
    """
    location = place.location
    text = _script_text(place)
    if location.name.startswith('/') or text is None:
        reason = 'it is a parameter' if location.name.startswith('/') else 'its node reads it by a function'
        raise files.FileError(
            location.file, location.line, location.column, f'{reason}, and no literal: edit the file that it is from'
        )
    content = files.read_bytes(location.file)
    if files.digest_of(content) != text:
        reason = 'the script was edited, and the text that stands there is not in force; try again'
        raise files.FileError(location.file, None, None, reason)
    return content


def _script_text(place: Place) -> object:
    """The digest of the live script that a node has in force; None if it has none."""
    try:
        kept = rosgraph.Master(rospy.get_name()).getParam(f'{place.node}/{SCRIPT_TEXT}')
    except rosgraph.MasterError:
        return None
    return kept.get('text') if isinstance(kept, dict) else None
