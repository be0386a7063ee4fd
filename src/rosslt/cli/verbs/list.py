"""`rosslt list`: nodes and their locations."""

import argparse
import sys

from rosslt.cli.completers import nodes
from rosslt.cli.directory import Directory, tracked_node
from rosslt.cli.master import find_master, tracked_nodes
from rosslt.cli.output import is_terminal, shortened, table, width, write_row
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'nodes and their locations'
DESCRIPTION = 'Print the nodes that have locations, and for each location its name, type, value, bounds and file.'
EXAMPLE = """\
example:
  rosslt list /talker

In a pipe each location is a line of columns between tabs: NODE/LOCATION, type, value, minimum, maximum, read-only (or
empty), file:line:column.
"""
ARGUMENTS = [
    Argument('node', completer=nodes, nargs='?', metavar='NODE', help='this node alone'),
]

#: The most that a value takes of a line.
LONGEST_VALUE = 30


def run(options: argparse.Namespace) -> int:
    master = find_master()
    nodes = [tracked_node(master, options.node)] if options.node else tracked_nodes(master)
    places, silent = Directory().ask(nodes)
    show = _show if is_terminal() else _write
    for node in nodes:
        if node in places:
            show(node, places[node])
    for node, why in sorted(silent.items()):
        print(f'rosslt list: cannot reach {node}: {why}', file=sys.stderr)
    return 1 if silent else 0


def _show(node, places):
    print(node)
    rows = [
        (place.local_name, place.location.type, shortened(place.location.value, LONGEST_VALUE), _limits(place.location))
        for place in places
    ]
    lines = [
        table([(*row, file) for row, file in zip(rows, files)], indent='  ')
        for files in ([place.file for place in places], [place.short_file for place in places])
    ]
    for line in lines[0] if all(len(line) <= width() for line in lines[0]) else lines[1]:
        print(line)


def _limits(location):
    if location.read_only:
        return 'read-only'
    if location.minimum or location.maximum:
        return '{} .. {}'.format(location.minimum, location.maximum).strip()
    return ''


def _write(_node, places):
    for place in places:
        location = place.location
        write_row(
            place.name,
            location.type,
            location.value,
            location.minimum,
            location.maximum,
            'read-only' if location.read_only else '',
            place.file,
        )
