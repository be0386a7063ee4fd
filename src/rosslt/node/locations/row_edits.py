"""The row that a location is in, a waypoint of a list say, duplicated, deleted or moved in the file where it stands."""

import json
import os
import re
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import rosgraph
import rospy

from rosslt import files, values
from rosslt.messages import Message, Scalar
from rosslt.node.change.client import SourceUnreachable
from rosslt.node.locations.directory import Directory, Place
from rosslt.node.locations.row_journal import (
    ADD,
    LaunchedRow,
    RowRecord,
    keep_row_record,
    last_request_of,
    origins_of,
    write_rows,
)
from rosslt.node.locations.row_locks import check_locks, list_of
from rosslt.node.locations.saving import edits_of, list_edits, stale_in, untaken_in, why_not_written

#: The ROS parameter below its node in which the node of a live script says which text of it is in force.
SCRIPT_TEXT = 'rosslt_script'

_DONE = {
    files.DUPLICATE: 'duplicated {}',
    files.DELETE: 'deleted {}',
    files.UP: 'moved {} up',
    files.DOWN: 'moved {} down',
}


def edit_row(directory: Directory, source: values.Source, operation: str, timeout: float) -> str:
    """Do something with the row of a table that a location is in, as `Directory.rows_of` finds it, in its file.

    Args:
        directory: asks the node.
        source: the location.
        operation, timeout: as of `row_edit`.

    Returns:
        What was done, and when it takes effect, as a text for people.

    Raises:
        ChangeRejected: as of `row_edit`.
        FileError: as of `row_edit`, or the file cannot be written; then it is as it was.
        SourceUnreachable: the node does not answer, or has no such location any more; the message is the reason alone.
    """
    places, silent = directory.ask([source.node], timeout)
    if source.node not in places:
        raise SourceUnreachable(silent[source.node], silent)
    place = next((one for one in places[source.node] if one.source == source), None)
    if place is None:
        reason = 'it has that number no more'
        raise SourceUnreachable(reason, {source.node: reason})
    row = in_row(place, places[source.node])
    found = row_edit(place, row, operation, timeout)
    untaken = found.write(timeout)
    done = _DONE[operation].format(_name_of(row))
    file = os.path.basename(found.record.place.rpartition(':')[0])
    when = when_rows_are_read(place.node, found.record, timeout)
    return '; '.join(filter(None, [f'{done} in {file}', when, untaken]))


def when_rows_are_read(node: str, record: RowRecord, timeout: float) -> str:
    """Say when the rows of a node's list, as they are in the file now, are in force.

    Args:
        node: its full name.
        record: what was done with one, or undone.
        timeout: how long the node may take to answer, in seconds.
    """
    if record.launched is not None:
        return 'the next `rosslt launch` of the file has the rows as they are now'
    if record.is_in_script:
        return f'{node} runs the script again'
    at = '' if stale_in(node, timeout) == '' else ' at its next start'
    return f'{node} has the rows as they are now{at}'


def in_row(place: Place, places: Iterable[Place]) -> List[Place]:
    """Return the locations of a node that are in the same row as one of them; that one alone if it is in none."""
    row = place.location.row
    return [one for one in places if one.location.row == row] if row else [place]


def _name_of(row: Sequence[Place]) -> str:
    """Return the beginning of the names of the numbers of a row, `WAYPOINTS_2`; its line if they have no names."""
    if not row[0].location.is_named:
        return f'line {row[0].location.line}'
    names = [place.local_name for place in row]
    begun = os.path.commonprefix(names)
    return re.sub('[_/][^_/]*$', '', begun) if names[1:] else begun


class RowEdit(NamedTuple):
    """The edits of files that do something with a row.

    Attributes:
        node: the full name of the row's node.
        edits: of its file.
        record: what was done, once it is.
        origins: {parameter: where it stands then}, if it stands in a file that `rosslt launch` has read; else empty.
    """

    node: str
    edits: List[files.Edit]
    record: RowRecord
    origins: Dict[str, Any]

    def write(self, timeout: float) -> str:
        """Write it, and keep what takes it back.

        Args:
            timeout: how long the node may take to read the file, in seconds.

        Returns:
            Which numbers of the file the node does not take; '' if none is known.

        Raises:
            FileError: the file was edited meanwhile, or cannot be written.
        """
        write_rows(self.node, self.edits, self.record.numbers)
        if self.origins:
            rosgraph.Master(rospy.get_name()).setParam(files.ORIGINS, json.dumps(self.origins))
        keep_row_record(self.node, self.record)
        return untaken_in(self.node, timeout)


def row_edit(place: Place, row: Sequence[Place], operation: str, timeout: float) -> RowEdit:
    """Make the edits that do something with the row of a location, in a source file, a live script, or a YAML or launch
    file that `rosslt launch` has read.

    Args:
        place: the location.
        row: all locations of its row, as far as known.
        operation: one of `files.OPERATIONS`.
        timeout: how long its node may take to answer, in seconds.

    Raises:
        ChangeRejected: it, its list or its node is locked.
        FileError: it is in no row of alike ones, it is not certain where it stands now, or its value is not saved.
        SourceUnreachable: its node does not answer; the message is the reason alone.
    """
    check_locks(place.node, place.name, timeout)
    after = last_request_of(place.node, timeout)
    origins: Dict[str, Any] = {}
    gone: Dict[str, Any] = {}
    launched = None
    numbers: Sequence[Optional[int]] = ()
    in_script = is_in_script(place)
    if _is_in_parameter_file(place):
        before = origins_of(rosgraph.Master(rospy.get_name()))
        content, edits, launched = _in_parameter_file(place, row, operation, before)
        origins = launched.moved(before, lambda one: launched.index_after(one, operation))
        gone = {name: one for name, one in before.items() if origins[name].get('is_gone') and not one.get('is_gone')}
        file, line = launched.file, content[: edits[0].start].count(b'\n') + 1
    else:
        if operation in (files.UP, files.DOWN):  # the node reads the numbers of the other row, too, by their places
            listed, _ = Directory().ask([place.node], timeout)
            row = [one for one in listed.get(place.node, row) if list_of(one.location) == list_of(place.location)]
        content, ((line, column),) = _text_of([place], row, timeout)
        file = place.location.file
        edits, made = files.python_row_edits(file, content, line, column, operation)
        numbers = made if in_script else ()
        line = place.location.line
    back = files.taking_back(edits, files.digest_of(files.replaced(content, edits)))
    done = RowRecord(place.name, operation, f'{file}:{line}', in_script, after, back, launched, gone, numbers)
    return RowEdit(place.node, edits, done, origins)


def _is_in_parameter_file(place: Place) -> bool:
    """Return whether a location is a parameter that the code gives no default for."""
    return place.location.name.startswith('/') and not place.location.literal


def _in_parameter_file(
    place: Place, row: Sequence[Place], operation: str, origins: Dict[str, Any]
) -> Tuple[bytes, List[files.Edit], LaunchedRow]:
    """The content of the file that a parameter is given in, the edits of it, and the row.

    Args:
        place, row, operation: as of `row_edit`.
        origins: {full name of a parameter: where it is given}.

    Raises:
        FileError: as of `row_edit`.
    """
    origin = _origin_of(place, origins)
    path = origin['path']
    _check_saved(place.node, [(one, origins[one.location.name]) for one in row if one.location.name in origins])
    content, inline = files.read_bytes(origin['file']), origin.get('rosparam')
    if inline:
        nth, count = inline
        edits, depth = files.inline_row_edits(origin['file'], content, nth, count, path, operation)
    else:
        edits, depth = files.yaml_row_edits(origin['file'], content, path, operation)
    return content, edits, LaunchedRow(origin['file'], inline, path[:depth])


def _origin_of(place: Place, origins: Dict[str, Any]) -> Dict[str, Any]:
    """Where a parameter is given in YAML.

    Raises:
        FileError: that is not known, or it is given otherwise.
    """
    location = place.location
    origin: Dict[str, Any] = origins.get(location.name, {})
    reason = why_not_written(place, origin)
    if reason:
        raise files.FileError(location.file, location.line, location.column, reason)
    if origin.get('path') is None:
        raise files.FileError(origin['file'], None, None, 'no list of alike rows stands here; edit the file by hand')
    return origin


def _added_to_parameter_file(
    places: Sequence[Place],
    added: Sequence[Sequence[Scalar]],
    behind: Sequence[Sequence[Scalar]],
    origins: Dict[str, Any],
) -> Tuple[bytes, List[files.Edit], LaunchedRow]:
    """The content of the file that parameters are given in, the edits that add rows to it, and the row above these.

    Args:
        places, added, behind: as of `row_additions`.
        origins: {full name of a parameter: where it is given}.

    Raises:
        FileError: as of `row_additions`.
    """
    given = [_origin_of(place, origins) for place in places]
    file, inline = given[0]['file'], given[0].get('rosparam')
    for place, origin in zip(places, given):
        if (origin['file'], origin.get('rosparam')) != (file, inline):
            raise files.FileError(file, None, None, f'{place.local_name} stands elsewhere; edit them by hand')
    _check_saved(places[0].node, [*zip(places, given)])
    content, paths = files.read_bytes(file), [origin['path'] for origin in given]
    if inline:
        nth, count = inline
        edits, depth, below = files.inline_row_additions(file, content, nth, count, paths, added, behind)
    else:
        edits, depth, below = files.yaml_row_additions(file, content, paths, added, behind)
    *around, index = paths[0][:depth]
    return content, edits, LaunchedRow(file, inline, [*around, index + below], len(added))


def _check_saved(node: str, row: Sequence[Tuple[Place, Dict[str, Any]]]) -> None:
    """Raise FileError if the file does not have the present values of a row."""
    for place, origin in row:
        said = [origin['said'], *origin.get('offered', ())]
        edits, left = edits_of(origin['file'], [(place, {**origin, 'said': said})])
        if edits or left:
            reason = left[0][1] if left else f'{place.local_name} is changed, and not saved: `rosslt save {node}` first'
            raise files.FileError(origin['file'], None, None, reason)


def row_additions(
    places: Sequence[Place],
    added: Sequence[Sequence[Scalar]],
    timeout: float,
    behind: Sequence[Sequence[Scalar]] = (),
) -> RowEdit:
    """Make the edits that add rows below the row that locations are in, in a file as of `row_edit`.

    Args:
        places: the locations, of one node.
        added: for each row, what their numbers are there; all else is as in their row.
        timeout: how long their node may take to answer, in seconds.
        behind: as of `files.python_row_additions`.

    Raises:
        ChangeRejected: one of them, their list or their node is locked.
        FileError: they are not in one row of alike ones, it is not certain where they stand now, or a value is not
            saved.
        SourceUnreachable: their node does not answer; the message is the reason alone.
    """
    place = places[0]
    check_locks(place.node, place.name, timeout)
    after = last_request_of(place.node, timeout)
    origins: Dict[str, Any] = {}
    launched = None
    numbers: Sequence[Optional[int]] = ()
    in_script = is_in_script(place)
    file, line = place.location.file, place.location.line
    if all(map(_is_in_parameter_file, places)):
        before = origins_of(rosgraph.Master(rospy.get_name()))
        content, edits, launched = _added_to_parameter_file(places, added, behind, before)
        origins = launched.moved(before, lambda one: launched.index_after(one, ADD))
        file, line = launched.file, content[: edits[0].start].count(b'\n') if edits else 0
    else:
        content, stands = _text_of(places, places, timeout)
        edits, made = files.python_row_additions(file, content, stands, added, behind)
        numbers = made if in_script else ()
    back = files.taking_back(edits, files.digest_of(files.replaced(content, edits)))
    done = RowRecord(place.name, ADD, f'{file}:{line}', in_script, after, back, launched, {}, numbers)
    return RowEdit(place.node, edits, done, origins)


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
    if text is None:
        why = 'it is a parameter' if location.name.startswith('/') else 'its node reads it by a function'
        reason = f'{why}, and no literal: edit the file that it is from'
        raise files.FileError(location.file, location.line, location.column, reason)
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
