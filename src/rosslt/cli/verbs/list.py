"""`rosslt list`: nodes and their locations."""

import argparse
from typing import List

from rosslt import srv
from rosslt.cli.directory import find_node_or_locations, report_silent
from rosslt.cli.failure import Failure
from rosslt.cli.locks import locks_of, note_of, notes_of
from rosslt.cli.master import find_master, tracked_nodes
from rosslt.cli.output import is_terminal, limits, shortened, table, write_row
from rosslt.cli.verb import LOOK, Argument, node_or_location
from rosslt.node import Directory, Place, listed

GROUP = LOOK
SUMMARY = 'nodes and their locations'
DESCRIPTION = """Print the nodes that have locations, and for each location its name, type, value, bounds and file,
what the code says if the value is one of an earlier run, what takes a change at the next start only, and who has
locked it and why. Values of names, tables and parameters stand first, then numbers that stand in the code without a
name, then terms and factors of formulas, each in the order of the code. Numbers that give a formula its shape, as a
divisor or a conversion of units, are left out. The name of a list stands for all of its numbers."""
EXAMPLE = """\
examples:
  rosslt list /talker
  rosslt list /talker/radius
  rosslt list /patrol/WAYPOINTS

In a pipe each location is a line of columns between tabs: NODE/LOCATION, type, value, minimum, maximum, read-only (or
empty), file:line:column, what the code says (empty if that is the value), who may change it (empty: everybody), what
takes a change at the next start only (empty: all that came of it follows at once).
"""
ARGUMENTS = [
    node_or_location('all of its locations', nargs='?'),
    Argument('--all', action='store_true', help='also the numbers that give a formula its shape'),
]

#: The answer assumed for a node that does not say.
_OPEN = srv.LockLocationsResponse()

#: The most characters of a line that a value takes.
LONGEST_VALUE = 30


def run(options: argparse.Namespace) -> int:
    master = find_master()
    directory = Directory()
    nodes, asked = tracked_nodes(master), None
    if options.location:
        node, asked = find_node_or_locations(master, directory, options.location)
        nodes = [node]
    if not nodes:
        raise Failure(
            'no node has locations: none is tracked. Start one with `rosslt run` or `rosslt launch`, or have its '
            'code call rosslt.init_node'
        )
    places, silent = ({nodes[0]: asked}, {}) if asked else directory.ask(nodes, makes_known=options.all)
    places = listed(places, options.all or asked is not None)
    for found in places.values():
        found.sort(key=lambda place: 0 if place.location.row else place.location.rank)
    show = _show if is_terminal() else _write
    access = locks_of(places)
    for node in nodes:
        if node in places:
            show(node, places[node], access.get(node, _OPEN))
    return report_silent('list', master, silent)


def _show(node: str, places: List[Place], access: srv.LockLocationsResponse) -> None:
    whole = ', '.join(notes_of(access))
    print(f'{node}  ({whole})' if whole else node)
    rows = []
    for place in places:
        location = place.location
        said = f'the code says {location.literal}' if location.remembered else ''
        notes = ', '.join(filter(None, [said, location.fault, place.next_start, note_of(access, location.id)]))
        value = shortened(location.value, LONGEST_VALUE)
        rows.append((place.local_name, location.type, value, limits(place), place.short_file, notes))
    for line in table(rows, indent='  '):
        print(line)


def _write(_node: str, places: List[Place], access: srv.LockLocationsResponse) -> None:
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
            location.literal if location.remembered else '',
            '; '.join(filter(None, [location.fault, *notes_of(access), note_of(access, location.id)])),
            place.next_start,
        )
