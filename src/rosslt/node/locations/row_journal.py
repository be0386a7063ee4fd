"""Keeps a record of what was done with rows of lists in the files of a node, so that it can be taken back."""

import contextlib
import json
import os
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, cast

import rosgraph
import rospy

from rosslt import files, msg, srv
from rosslt.node.change.client import SourceUnreachable
from rosslt.node.change.last_change import histories, last_change, to_take_back
from rosslt.node.locations.row_locks import check_locks
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameters.mirror import RECORDS, read_record
from rosslt.node.service_calls import ask_all

#: The parameter in the namespace of records that keeps what was done with rows, the latest last.
_ROWS = '_rows'

#: The parameter beside it that tells the node of a live script which numbers are which once rows of it were edited.
_NUMBERS = '_numbers'

#: What was done if rows were added, beside `files.OPERATIONS`.
ADD = 'add'

#: The maximal number of kept ones.
_MOST_KEPT = 20

_Origins = Dict[str, Dict[str, Any]]


class LaunchedRow(NamedTuple):
    """A row in a file that `rosslt launch` has read.

    Attributes:
        file: it.
        rosparam: which <rosparam> of a launch file it is in, [index, count]; None if the file is YAML itself.
        path: of keys and indices, from the root of the YAML; the last one is the row's index in its list.
        added: how many rows were added below it.
    """

    file: str
    rosparam: Optional[List[int]]
    path: List[Any]
    added: int = 0

    def index_after(self, index: int, operation: str) -> Optional[int]:
        """As `files.index_after`, with this row; also if rows were added below it."""
        if operation == ADD:
            return index + self.added * (index > self.path[-1])
        return files.index_after(index, self.path[-1], operation)

    def index_before(self, index: int, operation: str) -> Optional[int]:
        """As `files.index_before`, with this row; also if rows were added below it."""
        if operation == ADD:
            is_added = self.path[-1] < index <= self.path[-1] + self.added
            return None if is_added else index - self.added * (index > self.path[-1])
        return files.index_before(index, self.path[-1], operation)

    def moved(self, origins: _Origins, index_of: Callable[[int], Optional[int]]) -> _Origins:
        """Return the places at which parameters are given once rows of the list of this one are in other places.

        Args:
            origins: {full name of a parameter: where it is given}.
            index_of: gives the new index of an element of the list; None if it is gone.
        """
        depth = len(self.path)
        moved: _Origins = {}
        for name, one in origins.items():
            steps = one.get('path') or []
            is_in_file = one['file'] == self.file and one.get('rosparam') == self.rosparam
            if is_in_file and len(steps) >= depth and steps[: depth - 1] == self.path[:-1]:
                index = index_of(steps[depth - 1])
                if index is None:
                    one = {'file': one['file'], 'said': one['said'], 'is_gone': True}
                else:
                    one = {**one, 'path': [*steps[: depth - 1], index, *steps[depth:]]}
            moved[name] = one
        return moved


class RowRecord(NamedTuple):
    """A record of what was done with a row, and how it is taken back.

    Attributes:
        name: NODE/LOCATION of a number in it.
        operation: one of `files.OPERATIONS`, or ADD.
        place: FILE:LINE of the row.
        is_in_script: whether that is a live script.
        after: the id of the last request that had changed its node by then, and was not taken back; '' if none had.
        edits: take it back.
        launched: the row, if it stands in a file that `rosslt launch` has read; else None.
        gone: {full name of a parameter in a deleted row: where it was given}.
        numbers: as of `files.RowEdits`; none if that is no live script.
    """

    name: str
    operation: str
    place: str
    is_in_script: bool
    after: str
    edits: List[files.Edit]
    launched: Optional[LaunchedRow]
    gone: _Origins
    numbers: Sequence[Optional[int]] = ()


def write_rows(node: str, edits: Sequence[files.Edit], numbers: Sequence[Optional[int]]) -> None:
    """Write edits of rows. The node of a live script is told before it reads the file which numbers are which: of equal
    rows, the text does not say.

    Args:
        node: its full name.
        edits: of one file.
        numbers: as of `files.RowEdits`; none if that is no live script.

    Raises:
        FileError: the file was edited meanwhile, or cannot be written.
    """
    if numbers and edits:
        content = files.read_bytes(edits[0].file)
        after = files.digest_of(files.replaced(content, edits))
        master = rosgraph.Master(rospy.get_name())
        master.setParam(f'{node}/{RECORDS}/{_NUMBERS}', json.dumps([edits[0].digest, after, list(numbers)]))
    files.write(edits)


def numbers_of_rows(before: str, after: str) -> Sequence[Optional[int]]:
    """Return which numbers of the live script of this node are which since rows of it were edited, as `files.RowEdits`
    has them; none if that is not known.

    Args:
        before, after: the digests of the text before, and of the one that is there now.
    """
    try:
        kept = read_record(rospy.get_param(f'~{RECORDS}/{_NUMBERS}', ''))
    except NO_MASTER:
        return ()
    is_known = len(kept) == 3 and kept[:2] == [before, after] and isinstance(kept[2], list)
    return cast(Sequence[Optional[int]], kept[2]) if is_known else ()


def origins_of(master: rosgraph.Master) -> Any:
    """{full name of a parameter: where it is given}, as `rosslt launch` has noted it."""
    try:
        return json.loads(master.getParam(files.ORIGINS))
    except (rosgraph.MasterError, ValueError, TypeError):
        return {}


def last_request_of(node: str, timeout: float) -> str:
    """The id of the last request that has changed a node and was not taken back; '' if there is none.

    Raises:
        SourceUnreachable: it does not answer; the message is the reason alone.
    """
    found, silent = histories([node], '', timeout)
    if node in silent:
        raise SourceUnreachable(silent[node], silent)
    last = last_change(found)
    return last.request_id if last else ''


def keep_row_record(node: str, record: RowRecord) -> None:
    """Keep what was done with a row of a node as the latest."""
    _write(node, [*_read(node), record][-_MOST_KEPT:])


def last_row_record(node: str, changes: Sequence[msg.RecordedChange]) -> Optional[RowRecord]:
    """Return the record of what was last done with a row of a node; None if a change came later that was not taken
    back.

    Args:
        node: its full name.
        changes: its history, the oldest first.
    """
    for record in _read(node)[-1:]:
        before = [number for number, one in enumerate(changes, 1) if one.request_id == record.after]
        if not to_take_back(changes[max(before, default=0) :]):
            return record
    return None


def take_row_back(node: str, record: RowRecord, timeout: float) -> None:
    """Take back what was last done with a row: its file becomes what it was, but for values that were saved since, and
    its node reads it.

    Args:
        node: its full name.
        record: what was done.
        timeout: how long the node may take to read it, in seconds.

    Raises:
        ChangeRejected: the number that it was done with, its list or the node is locked.
        FileError: the file was edited since, or cannot be written; then all is as it was.
        SourceUnreachable: the node does not answer; the message is the reason alone.
    """
    check_locks(node, record.name, timeout)
    file = record.edits[0].file
    content = files.read_bytes(file)
    if files.digest_of(content) != record.edits[0].digest:
        verb = 'teach' if record.operation == ADD else f'row {record.operation}'
        reason = f'it was edited since `rosslt {verb} {record.name}`; take that edit back, and try again'
        raise files.FileError(file, None, None, reason)
    numbers: List[Optional[int]] = []
    if record.numbers:
        count = len(files.SourceText(file, files.replaced(content, record.edits)).numbers)
        now = {before: index for index, before in enumerate(record.numbers) if before is not None}
        numbers = [now.get(index) for index in range(count)]
    write_rows(node, record.edits, numbers)
    launched = record.launched
    if launched is not None:
        master = rosgraph.Master(rospy.get_name())
        origins = launched.moved(origins_of(master), lambda index: launched.index_before(index, record.operation))
        back = {name: one for name, one in record.gone.items() if origins.get(name, {}).get('is_gone')}
        master.setParam(files.ORIGINS, json.dumps({**origins, **back}))
    _write(node, _read(node)[:-1])
    ask_all('list_edits', srv.ListEdits, {node: srv.ListEditsRequest()}, timeout)


def follow_save(node: str, edits: Sequence[files.Edit]) -> None:
    """Have what was done with rows of a node be taken back beside values that were saved since, as far as they stand
    elsewhere in the file.

    Args:
        edits: what was just written.
    """
    records = _read(node)
    if not records:
        return
    before = list(records)
    for file in {os.path.realpath(record.edits[0].file) for record in records}:
        those = {(one.start, one.end): one for one in edits if os.path.realpath(one.file) == file}
        if those:
            with contextlib.suppress(files.FileError):  # somebody has deleted it since
                _follow_save_of(file, list(those.values()), records)
    if records != before:
        _write(node, records)


def _follow_save_of(file: str, saved: List[files.Edit], records: List[RowRecord]) -> None:
    """`follow_save` for one file: changes its records."""
    now = files.read_bytes(file)
    then = files.replaced(now, files.taking_back(saved, files.digest_of(now)))
    if files.digest_of(then) != saved[0].digest:
        return  # somebody has edited it since
    for number in reversed(range(len(records))):
        back, digest = records[number].edits, files.digest_of(then)
        if os.path.realpath(back[0].file) != file or back[0].digest != digest:
            continue
        back_now = files.beside(back, saved, files.digest_of(now))
        if back_now is None:
            return
        records[number] = records[number]._replace(edits=back_now)
        then_before, now = files.replaced(then, back), files.replaced(now, back_now)
        saved = files.beside(saved, back, files.digest_of(then_before)) or []
        then = then_before


def _read(node: str) -> List[RowRecord]:
    try:
        kept = read_record(rosgraph.Master(rospy.get_name()).getParam(f'{node}/{RECORDS}/{_ROWS}'))
        return [_decoded(one) for one in kept]
    except (rosgraph.MasterError, TypeError, ValueError, AttributeError):  # nothing, or not what was written
        return []


def _write(node: str, records: Sequence[RowRecord]) -> None:
    master, key = rosgraph.Master(rospy.get_name()), f'{node}/{RECORDS}/{_ROWS}'
    master.setParam(key, json.dumps([_encoded(one) for one in records]))


def _encoded(record: RowRecord) -> List[Any]:
    edits = [(*one[:4], one.old.decode('latin-1'), one.new.decode('latin-1'), one.what) for one in record.edits]
    return [edits if cell is record.edits else cell for cell in record]


def _decoded(cells: Any) -> RowRecord:
    record = RowRecord(*cells)
    return record._replace(
        edits=[
            files.Edit(file, digest, start, end, old.encode('latin-1'), new.encode('latin-1'), what)
            for file, digest, start, end, old, new, what in cells[RowRecord._fields.index('edits')]
        ],
        launched=LaunchedRow(*record.launched) if record.launched else None,
    )
