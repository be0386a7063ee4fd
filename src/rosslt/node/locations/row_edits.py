"""The row that a location is in, a waypoint of a list say, duplicated, deleted or moved in the file where it stands."""

from typing import List, Sequence, Tuple

import rosgraph
import rospy

from rosslt import files
from rosslt.messages import Message
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
    answer = list_edits(place.node, timeout)
    path, line, column = place.location.file, place.location.line, place.location.column
    if place.location.id in answer.read_ids:
        unsaved = {edit.location_id for edit in answer.edits} | set(answer.left_ids)
        changed = [one.local_name for one in row if one.location.id in unsaved]
        if changed:
            reason = f'{" and ".join(changed)} is changed, and not saved: `rosslt save {place.node}` first'
            raise files.FileError(path, line, column, reason)
        line, column = _place_now(place, answer)
        content = files.read_bytes(path)
    else:
        content = _script_of(place)
    return files.python_row_edits(path, content, line, column, operation)


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
