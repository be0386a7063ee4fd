"""`rosslt undo`: take the last change back."""

import argparse
import sys
from typing import Any, Collection, Dict, List

import rosgraph

from rosslt import files, node, values
from rosslt.cli.directory import cannot_reach, tracked_node
from rosslt.cli.failure import Failure
from rosslt.cli.master import TIMEOUT, find_master, problem_of, tracked_nodes
from rosslt.cli.output import few, write_change, write_note, write_result
from rosslt.cli.verb import CHANGE, Argument
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'take the last change back, in all nodes that it changed'
DESCRIPTION = """Take the last change back: all of it, in every node that it changed or, if one of them does not
take it back, in none. A drag is one change. With a NODE it is the last one that changed this node; without, the last
one of all.

If a file has the value that is taken back, as it was saved, that is said: `rosslt save` writes the present one.

With a NODE, what `rosslt row`, or the menu of a handle, has done with a row of a list is taken back in its turn: its
file becomes what it was, but for values saved elsewhere in it since. If it was edited otherwise, that is refused. What
a node has read again in a file that was edited is taken back in the file."""
EXAMPLE = """\
examples:
  rosslt undo
  rosslt undo /talker

In a pipe each location is a line of columns between tabs: NODE/LOCATION, value until now, value that it has again,
file:line:column. Of a row, they are NODE/LOCATION, what was done, `undone`, file:line as the node has read it.
"""
ARGUMENTS = [
    Argument('node', nargs='?', completer='nodes', metavar='NODE', help='the last change of this node'),
]


def run(options: argparse.Namespace) -> int:
    master = find_master()
    asked = [tracked_node(master, options.node)] if options.node else tracked_nodes(master)
    histories = node.histories if options.node else node.taking_part
    found = _complete(master, *histories(asked, '', TIMEOUT))
    record = node.last_row_record(asked[0], found.get(asked[0], [])) if options.node else None
    if record is not None:
        _take_row_back(master, asked[0], record)
        return 0
    last = node.last_change(found)
    if last is None:
        of_node = f'{asked[0]}: ' if options.node else ''
        raise Failure(f'{of_node}there is no change to take back (of its earlier runs, a node remembers the last one)')
    taking_part = _complete(master, *node.taking_part(tracked_nodes(master), last.request_id, TIMEOUT))
    unsaved = {name: _to_save(name).keys() for name in taking_part}
    undone = node.undo_request(last.request_id, taking_part, 'rosslt undo', TIMEOUT)
    directory = Directory()
    directory.ask(sorted(undone.changes))
    for name, changes in sorted(undone.changes.items()):
        for change in changes:
            source = values.Source(name, change.location_id)
            write_change(directory, source, change.old_value, change.new_value)
        places = [directory.of(values.Source(name, change.location_id)) for change in changes]
        _say_what_is_saved(name, {place.local_name for place in places if place} - unsaved[name])
    for name, reason in sorted(undone.reasons.items()):
        nothing = '' if undone.changes else 'nothing is taken back: '
        print(f'rosslt undo: {nothing}{name}: {problem_of(master, name) or reason}', file=sys.stderr)
    return 1 if undone.reasons else 0


def _to_save(name: str) -> Dict[str, str]:
    """{changed location of a node: the file that has another value, '' if that is not known}; empty if the node does
    not answer."""
    try:
        edits, unsaved = node.changes_to_save(name, TIMEOUT)
    except node.SourceUnreachable:
        return {}
    return {**{one.name: '' for one in unsaved}, **{edit.what: edit.file for edit in edits}}


def _say_what_is_saved(name: str, undone: Collection[str]) -> None:
    """Say of which locations the file still has the value that was taken back.

    Args:
        name: of the node.
        undone: the locations whose files had their values until now.
    """
    saved = {what: file for what, file in _to_save(name).items() if file and what in undone}
    if saved:
        files_of = ' and '.join(sorted(set(saved.values())))
        said = f'the saved value of {few(sorted(saved))} still stands in {files_of}'
        write_note('undo', f'{said}; `rosslt save {name}` writes the present one')


def _take_row_back(master: rosgraph.Master, name: str, record: node.RowRecord) -> None:
    try:
        node.take_row_back(name, record, TIMEOUT)
    except files.FileError as error:
        raise Failure(f'nothing is taken back: {error}') from None
    except node.SourceUnreachable as error:
        raise cannot_reach(master, name, str(error)) from None
    line = f'{record.name}: {record.operation} is undone  [{record.place}]'
    write_result(line, record.name, record.operation, 'undone', record.place)
    write_note('undo', node.when_rows_are_read(name, record, TIMEOUT))


def _complete(master: rosgraph.Master, found: Dict[str, List[object]], silent: Dict[str, str]) -> Dict[str, List[Any]]:
    """{node: its rosslt/RecordedChange} of nodes that have any.

    Raises:
        Failure: a node does not answer: what it has changed is not known, and would not be taken back.
    """
    for name, reason in silent.items():
        raise cannot_reach(master, name, reason)
    return found
