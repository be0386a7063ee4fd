"""`rosslt bag`: what provenance a recorded bag holds, and what the messages would have been with other values."""

import argparse
import contextlib
import os
import sys
from typing import Any, Dict, Iterator, List, Sequence, Tuple

import rosbag

from rosslt import values
from rosslt.cli import bags, what_if
from rosslt.cli.directory import sources_called
from rosslt.cli.failure import Failure, did_you_mean
from rosslt.cli.fields import parse_scalar, source_values
from rosslt.cli.output import is_terminal, table, write_row
from rosslt.cli.verb import LOOK, Argument
from rosslt.flow import ProvenanceMap, brief
from rosslt.messages import Scalar
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'what provenance a recorded bag holds, and what its messages would have been with other values'
DESCRIPTION = """Print what provenance a recorded bag holds: for each topic how many of its messages have some, and
which sources reach which fields. Sources have their names where
<node>/rosslt/locations was recorded too, or if their nodes run now, and are NODE#ID otherwise.

With --set and -o, write a bag with what the messages would have been had a location had another value all the time:
each tracked field is evaluated by its provenance. What was computed without provenance stays as it was recorded."""
EXAMPLE = """\
examples:
  rosslt bag run.bag
  rosslt bag run.bag --set /planner/speed=0.8 -o slower.bag

In a pipe each source of each topic is a line of columns between tabs: topic, type, number of messages, number of
those with provenance, source, fields; a topic without provenance has a line with the last two empty. With --set, each
topic is one: topic, number of messages, how many of them have other values now.
"""
ARGUMENTS = [
    Argument('file', metavar='FILE'),
    Argument(
        '--set',
        action='append',
        metavar='NODE/LOCATION=VALUE',
        help='with this value of a location, named as the listing does; may be given several times',
    ),
    Argument('-o', '--output', metavar='OUT', help='write the messages as they would have been'),
]

#: The sources on a topic: (source, the fields that it reaches).
Rows = Sequence[Tuple[str, List[str]]]


def run(options: argparse.Namespace) -> None:
    if options.set or options.output:
        if not (options.set and options.output):
            raise Failure('give --set NODE/LOCATION=VALUE and -o OUT together')
        _rewrite(options.file, options.set, options.output)
        return
    found = ProvenanceMap()
    tracked: Dict[str, int] = {}
    directory = Directory()
    with bags.opened(options.file) as bag:
        topics = bag.get_type_and_topic_info().topics
        for received in bags.messages(bag):
            is_tracked = found.add(received.topic, received.publisher, received.message)
            tracked[received.topic] = tracked.get(received.topic, 0) + is_tracked
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
    messages = f'{topic.message_count} message{"s" * (topic.message_count != 1)}'
    print(f'{name}  {topic.msg_type}, {messages}, {tracked or "none"} with provenance')
    for line in table([(source, '-> ' + brief(fields)) for source, fields in rows], indent='  '):
        print(line)


def _write(name: str, topic: Any, tracked: int, rows: Rows) -> None:
    for source, fields in rows or [('', [])]:
        write_row(name, topic.msg_type, topic.message_count, tracked, source, ','.join(fields))


def _rewrite(file: str, settings: Sequence[str], output: str) -> None:
    """Write a bag with other values of locations.

    Raises:
        Failure: a location is not known, a value does not fit, or the bag cannot be written.
    """
    directory = Directory()
    with bags.opened(file) as bag:
        changes = _changes(bag, directory, settings)
        with _replacing(output) as part:
            try:
                with rosbag.Bag(part, 'w', compression=bag.get_compression_info()[0]) as written:
                    topics = what_if.rewrite(bag, written, changes)
            except OSError as error:
                raise Failure(f'cannot write {output}: {error.strerror or error}') from None
    rows = [(name, str(topic.count), str(topic.changed)) for name, topic in sorted(topics.items())]
    if is_terminal():
        for line in table([('topic', 'messages', 'changed'), *rows], left=1):
            print(line)
    else:
        for row in rows:
            write_row(*row)
    for name, topic in sorted(topics.items()):
        if topic.left_out:
            print(f'rosslt bag: {topic.left_out} messages on {name} are left out: {topic.reason}', file=sys.stderr)
        if topic.is_approximate:
            reason = 'their provenance is linearized, or that of the message before'
            print(f'rosslt bag: messages on {name} are approximate: {reason}', file=sys.stderr)


@contextlib.contextmanager
def _replacing(output: str) -> Iterator[str]:
    """The name of a file that becomes `output` once all has gone well.

    Raises:
        Failure: there is such a file already.
    """
    if os.path.exists(output):
        raise Failure(f'{output} exists already: give another name, or remove it')
    part = output + '.part'
    try:
        yield part
        os.replace(part, output)
    finally:
        with contextlib.suppress(OSError):
            os.remove(part)


def _changes(bag: rosbag.Bag, directory: Directory, settings: Sequence[str]) -> Dict[values.Source, Scalar]:
    """{Source: value} of NODE/LOCATION=VALUE.

    Raises:
        Failure: it is not such a thing, or the bag has no such location.
    """
    bags.take_names(bag, directory)
    recorded = _recorded(bag, directory)
    changes: Dict[values.Source, Scalar] = {}
    for setting in settings:
        name, equals, text = setting.partition('=')
        if not equals:
            raise Failure(f'{setting!r} is not NODE/LOCATION=VALUE')
        found = sources_called(directory, recorded, name)
        if not found:
            every = sorted(directory.name(source) for source in recorded)
            raise Failure(
                f'no message comes from {name}{did_you_mean(name, every)}; the sources are '
                + (', '.join(every) or 'none')
            )
        source = found[0]
        try:
            value = parse_scalar(text, type(recorded[source]).__name__)
        except ValueError as error:
            raise Failure(f'{name}: {error}') from None
        changes[source] = value
    return changes


def _recorded(bag: rosbag.Bag, directory: Directory) -> Dict[values.Source, Scalar]:
    """The sources of the messages, each with a value that it had; the directory learns of them."""
    recorded: Dict[values.Source, Scalar] = {}
    for received in bags.messages(bag):
        for source, value in source_values(received.message).items():
            recorded.setdefault(source, value)
    directory.learn(recorded)
    return recorded
