"""`rosslt reset`: restore the values in the code."""

import argparse
from typing import List

from rosslt import node
from rosslt.cli.directory import change, find, locations_of
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master, full_name, tracked_nodes
from rosslt.cli.output import few, write_change, write_note
from rosslt.cli.verb import CHANGE, node_or_location
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'give locations the values again that the code says'
DESCRIPTION = """Give a location, or all of a node whose values are literals, the value again that the code says. What
was changed is remembered over a restart of the node; this is how to forget it. Of a node, what is no literal (a
parameter, what a getter reads) stays as it is, and is named."""
EXAMPLE = """\
examples:
  rosslt reset /talker
  rosslt reset /talker/radius

In a pipe each change is a line of columns between tabs: NODE/LOCATION, old value, new value, file:line:column.
"""
ARGUMENTS = [node_or_location('all of its literals')]


def run(options: argparse.Namespace) -> None:
    master, directory = find_master(), Directory()
    staying: List[str] = []
    name = full_name(options.location.partition('#')[0])
    if '#' in options.location or name not in tracked_nodes(master):
        places = [find(master, directory, options.location)]
        if not places[0].location.literal:
            raise Failure(f'{places[0].name} is no literal: there is no value in the code to restore')
    else:
        places = locations_of(master, directory, name)
    staying = [place.name for place in places if not place.location.literal and not place.location.read_only]
    changed, outdated = change(master, directory, 'rosslt reset', node.values_in_code(places))
    for source, (old, new) in changed.items():
        write_change(directory, source, node.to_json(old), node.to_json(new))
    if not changed:
        write_note('reset', 'nothing to change: it is as the code says')
    if outdated:
        write_note('reset', outdated)
    if staying:
        note = 'what is no literal has no value in the code, and stays as it is; `rosslt log` has earlier values'
        write_note('reset', f'{few(staying)}: {note}')
