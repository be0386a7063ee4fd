"""`rosslt reset`: restore the values in the code."""

import argparse

from rosslt import srv
from rosslt.cli.completers import nodes_and_locations
from rosslt.cli.directory import Directory, call, find
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master, full_name, tracked_nodes
from rosslt.cli.output import is_terminal, write_applied
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = 'give locations the values again that the code says'
DESCRIPTION = """Give a location, or all of a node whose values are literals, the value again that the code says. What
was changed is remembered over a restart of the node; this is how to forget it."""
EXAMPLE = """\
examples:
  rosslt reset /talker
  rosslt reset /talker/radius

In a pipe each change is a line of columns between tabs: NODE/LOCATION, old value, new value, file:line:column.
"""
ARGUMENTS = [
    Argument(
        'location',
        completer=nodes_and_locations,
        metavar='NODE[/LOCATION]',
        help='as rosslt list says, or NODE#ID; a NODE for all of its literals',
    ),
]


def run(options: argparse.Namespace) -> None:
    master, directory = find_master(), Directory()
    name, ids = full_name(options.location.partition('#')[0]), []
    if '#' in options.location or name not in tracked_nodes(master):
        place = find(master, directory, options.location)
        name, ids = place.node, [place.location.id]
    answer = call(master, name, 'reset', srv.ResetLocations, srv.ResetLocationsRequest(ids, 'rosslt reset'))
    if not answer.applied:
        raise Failure('{} refuses: {}'.format(name, '; '.join(answer.reasons)))
    directory.ask([name])
    for change in answer.changes:
        write_applied(directory, name, change)
    if not answer.changes and is_terminal():
        print('nothing to change: it is as the code says')
