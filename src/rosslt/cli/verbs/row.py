"""`rosslt row`: a row of a list, a waypoint say, duplicated, deleted or moved in its file."""

import argparse

from rosslt import files, node
from rosslt.cli.directory import cannot_reach, find_in_row
from rosslt.cli.failure import Failure
from rosslt.cli.master import TIMEOUT, find_master
from rosslt.cli.output import write_diff, write_note, write_result
from rosslt.cli.verb import CHANGE, Argument
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'duplicate, delete or move a row of a list, as a waypoint, in its file'
DESCRIPTION = """Duplicate, delete or move the row of a list that a location is in: an element such as (1.0, 2.0), or a
call such as goto(1, 2, 0) among others. It must stand on lines of its own; all other bytes of the file stay. The file
is edited as by a person with an editor: a live script runs again by itself; another node takes the row at its next
start, and what stands in a YAML or launch file with the next `rosslt launch`.

A changed value that is not saved is refused, and so is a parameter that `rosslt launch` has not read from a file."""
EXAMPLE = """\
examples:
  rosslt row duplicate /patrol/WAYPOINTS_2
  rosslt row up /patrol/WAYPOINTS_2_0 --diff

In a pipe it is a line of columns between tabs: NODE/LOCATION, what was done, file:line as the node has
read it.
"""
ARGUMENTS = [
    Argument('--diff', action='store_true', help='print what would be written as a unified diff, and write nothing'),
    Argument(
        'operation', choices=files.OPERATIONS, completer='row_operations', metavar='|'.join(files.OPERATIONS), help=''
    ),
    Argument(
        'location',
        completer='locations',
        metavar='NODE/LOCATION',
        help='any of its numbers, as rosslt list says, or NODE#ID; or its row in a table: what the names of its '
        'numbers begin with',
    ),
]


def run(options: argparse.Namespace) -> None:
    master, directory = find_master(), Directory()
    place, row = find_in_row(master, directory, options.location)
    try:
        found = node.row_edit(place, row, options.operation, TIMEOUT)
        if options.diff:
            write_diff(files.unified_diff(found.edits))
            return
        untaken = found.write(TIMEOUT)
    except node.SourceUnreachable as error:
        raise cannot_reach(master, place.node, str(error)) from None
    except files.FileError as error:
        raise Failure(f'nothing is written: {error}') from None
    where = found.record.place
    write_result(f'{place.name}: {options.operation}  [{where}]', place.name, options.operation, where)
    if untaken:
        raise Failure(f'the file is written, but {untaken}')
    write_note('row', node.when_rows_are_read(place.node, found.record, TIMEOUT))
