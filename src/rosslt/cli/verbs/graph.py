"""`rosslt graph`: the flow of provenance."""

import argparse
from typing import Iterable

import rosgraph

from rosslt import values
from rosslt.cli.directory import report_silent
from rosslt.cli.failure import Failure
from rosslt.cli.history import recorded_changes
from rosslt.cli.master import find_master, full_name, tracked_nodes
from rosslt.cli.output import is_terminal, write_row, write_text
from rosslt.cli.prov_document import prov_json
from rosslt.cli.reading import listener
from rosslt.cli.verb import LOOK, Argument
from rosslt.flow import Flow, NotDrawn, ProvenanceMap, Step, brief, dot, svg
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'which location reaches which field of which topic, through which nodes'
DESCRIPTION = """Listen to all topics for a while, and print which location reaches which field of which topic, through
which nodes."""
EXAMPLE = """\
examples:
  rosslt graph
  rosslt graph --svg > graph.svg
  rosslt graph --prov provenance.json

In a pipe each location and topic is a line of columns between tabs: NODE/LOCATION, topic, fields, nodes on the way.
"""
ARGUMENTS = [
    Argument('topics', completer='topics', nargs='*', metavar='TOPIC', help='listen to these alone'),
    Argument('--time', type=float, default=2.0, metavar='S', help='how long to listen (default: 2)'),
    Argument('--dot', action='store_true', help='print it for graphviz', exclusive=True),
    Argument('--svg', action='store_true', help='print it drawn by graphviz', exclusive=True),
    Argument(
        '--prov',
        metavar='FILE',
        help='write it, all locations and who changed what as W3C PROV-JSON; - for standard output',
        exclusive=True,
    ),
]


def run(options: argparse.Namespace) -> int:
    master = find_master()
    published = [topic for topic, _ in master.getPublishedTopics('/')]
    topics = list(map(full_name, options.topics)) or published
    missing = sorted(set(topics) - set(published))
    if missing:
        raise Failure('nobody publishes ' + ', '.join(missing))
    found = ProvenanceMap()
    with listener(*topics) as stream:
        for received in stream.during(options.time):
            found.add(received.topic, received.publisher, received.message)
    if options.prov:
        return _write_prov(master, found, options.prov)
    if not found.fields:
        raise Failure(f'no message with provenance within {options.time:g} s')
    flow, directory = Flow(found, dict(master.getSystemState()[1])), Directory()
    directory.learn(found.sources)
    sources = directory.ordered(found.sources)
    if options.dot or options.svg:
        text = dot(flow, directory)
        try:
            print(svg(text) if options.svg else text)
        except NotDrawn as error:
            raise Failure(str(error)) from None
    elif is_terminal():
        _show(flow, sources, directory)
    else:
        for source in sources:
            for topic, fields, nodes in flow.paths(source):
                write_row(directory.name(source), topic, ','.join(fields), ','.join(nodes))
    return 0


def _write_prov(master: rosgraph.Master, found: ProvenanceMap, file_name: str) -> int:
    nodes, directory = tracked_nodes(master), Directory()
    if not nodes and not found.fields:
        raise Failure('there is no node with locations')
    places, silent = directory.ask(nodes)
    changes, silent_of_changes = recorded_changes(places)
    sources = [place.source for name in nodes for place in places.get(name, ())]
    directory.learn(found.sources)
    text = prov_json(directory, sources, found, changes)
    write_text(file_name, text + '\n')
    silent.update(silent_of_changes)
    return report_silent('graph', master, silent)


def _show(flow: Flow, sources: Iterable[values.Source], directory: Directory) -> None:
    for source in sources:
        place = directory.of(source)
        print(directory.name(source) + (f'  [{place.short_file}]' if place else ''))
        _show_steps(flow.steps(source), '  ')


def _show_steps(steps: Iterable[Step], indent: str) -> None:
    for step in steps:
        unknown = '' if step.is_known else '  (path unknown)'
        print(f'{indent}{step.publisher} -> {step.topic}: {brief(step.fields)}{unknown}')
        _show_steps(step.next, indent + '  ')
