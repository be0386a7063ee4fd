"""`rosslt bag`: what provenance a recorded bag holds."""

import argparse
from typing import Any, Dict, List, Sequence, Tuple

from rosslt.cli import bags
from rosslt.cli.directory import Directory
from rosslt.cli.output import is_terminal, table, write_row
from rosslt.cli.provenance_map import ProvenanceMap, brief
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'what provenance a recorded bag holds'
DESCRIPTION = """Print what provenance a recorded bag holds: for each topic how many of its messages have some, and
which sources reach which fields. Sources have their names where
<node>/rosslt/locations was recorded too, or where their nodes run now, and are NODE#ID otherwise."""
EXAMPLE = """\
example:
  rosslt bag run.bag

In a pipe each source of each topic is a line of columns between tabs: topic, type, number of messages, number of
those with provenance, source, fields; a topic without provenance has a line with the last two empty.
"""
ARGUMENTS = [
    Argument('file', metavar='FILE'),
]

#: What is known of the sources on a topic: (source, the fields that it reaches).
Rows = Sequence[Tuple[str, List[str]]]


def run(options: argparse.Namespace) -> None:
    found = ProvenanceMap()
    tracked: Dict[str, int] = {}
    directory = Directory()
    with bags.opened(options.file) as bag:
        topics = bag.get_type_and_topic_info().topics
        for received in bags.messages(bag):
            tracked[received.topic] = tracked.get(received.topic, 0) + found.add(received)
        bags.take_names(bag, directory)
    directory.learn(found.sources)
    for name, topic in sorted(topics.items()):
        rows = [
            (directory.name(source), found.fields[reach])
            for source in directory.ordered(found.sources)
            for reach in found.reached_by(source)
            if reach.topic == name
        ]
        (_show if is_terminal() else _write)(name, topic, tracked.get(name, 0), rows)


def _show(name: str, topic: Any, tracked: int, rows: Rows) -> None:
    print(
        '{}  {}, {} message{}, {} with provenance'.format(
            name, topic.msg_type, topic.message_count, 's' * (topic.message_count != 1), tracked or 'none'
        )
    )
    for line in table([(source, '-> ' + brief(fields)) for source, fields in rows], indent='  '):
        print(line)


def _write(name: str, topic: Any, tracked: int, rows: Rows) -> None:
    for source, fields in rows or [('', [])]:
        write_row(name, topic.msg_type, topic.message_count, tracked, source, ','.join(fields))
