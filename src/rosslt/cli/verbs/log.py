"""`rosslt log`: who changed what, when, and from what."""

import argparse
from datetime import datetime
from typing import List

from rosslt.cli.directory import report_silent, tracked_node
from rosslt.cli.history import Recorded, recorded_changes
from rosslt.cli.master import find_master, tracked_nodes
from rosslt.cli.output import is_terminal, table, write_row
from rosslt.cli.verb import LOOK, Argument
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'who changed which location, when, and from what'
DESCRIPTION = """Print what was changed in running nodes, the oldest change first: when, who asked, which location, its
value before and after. What one drag or one command changed is one request, in however many nodes."""
EXAMPLE = """\
examples:
  rosslt log
  rosslt log /talker -n 10

In a pipe each change is a line of columns between tabs: time in seconds, who asked, NODE/LOCATION, old value, new
value, the request, `undone` if it has been taken back (or empty).
"""
ARGUMENTS = [
    Argument('node', nargs='?', completer='nodes', metavar='NODE', help='of this node alone'),
    Argument('-n', dest='count', type=int, default=0, metavar='N', help='the last N changes (default: all)'),
]

#: Stamps before this are of simulated time, which begins at 0; in seconds since 1970.
_EARLIEST_DATE = 1e8


def run(options: argparse.Namespace) -> int:
    master = find_master()
    asked = [tracked_node(master, options.node)] if options.node else tracked_nodes(master)
    found, silent = recorded_changes(asked, max(0, options.count))
    directory = Directory()
    directory.ask(sorted({each.node for each in found}))
    (_show if is_terminal() else _write)(found, directory)
    return report_silent('log', master, silent)


def _show(found: List[Recorded], directory: Directory) -> None:
    if not found:
        print('nothing has been changed (of its earlier runs, a node remembers the last change)')
    rows = [
        (
            _time(each.recorded.change.stamp.to_sec()),
            each.recorded.change.requester,
            each.name(directory),
            f'{each.recorded.change.old_value} -> {each.recorded.change.new_value}',
            'taken back' if each.recorded.undone else '',
        )
        for each in found
    ]
    for line in table(rows):
        print(line)


def _write(found: List[Recorded], directory: Directory) -> None:
    for each in found:
        change = each.recorded.change
        write_row(
            change.stamp.to_sec(),
            change.requester,
            each.name(directory),
            change.old_value,
            change.new_value,
            each.recorded.request_id,
            'undone' if each.recorded.undone else '',
        )


def _time(seconds: float) -> str:
    if seconds < _EARLIEST_DATE:
        return f'{seconds:.3f} s'
    return datetime.fromtimestamp(seconds).strftime('%Y-%m-%d %H:%M:%S')
