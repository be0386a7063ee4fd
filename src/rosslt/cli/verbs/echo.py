"""`rosslt echo`: messages with the provenance of their fields."""

import argparse
import itertools
import math
import time
from typing import Iterable, Iterator

import rosgraph

from rosslt import values
from rosslt.cli import bags
from rosslt.cli.fields import field_of
from rosslt.cli.master import find_master, split_topic
from rosslt.cli.output import is_terminal, write_note
from rosslt.cli.reading import listener, why_silent
from rosslt.cli.rendering import json_line, write_lines, yaml_lines
from rosslt.cli.verb import LOOK, Argument
from rosslt.node import Directory, Heard, Listener

#: For how long messages without their provenance are left out until one with it has come, in seconds.
PATIENCE = 1.0

#: After how long without a message it is said why none comes, in seconds.
SILENCE = 3.0

GROUP = LOOK
SUMMARY = 'messages with the provenance of their fields'
DESCRIPTION = """Print messages, or one field of them, with the provenance of each tracked value beside it: what was
done, and the file and line that each number comes from."""
EXAMPLE = """\
examples:
  rosslt echo /target/pose/position
  rosslt echo --once --json /markers | jq .provenance
  rosslt echo --bag run.bag /target

In a pipe each value is a line of columns between tabs: field, value, provenance (or empty); --- ends a message. With
--json each message is a line.
"""
ARGUMENTS = [
    Argument(
        'topic', completer='topics', metavar='TOPIC[/FIELD]', help='a field in it as pose/position/x or points[3].x'
    ),
    Argument('-n', dest='count', type=int, default=0, metavar='N', help='end after N messages'),
    Argument('--once', dest='count', action='store_const', const=1, help='end after one message'),
    Argument('--json', action='store_true', help='one line of JSON for each message'),
    Argument('--bag', metavar='FILE', help='from a recorded bag'),
]


def run(options: argparse.Namespace) -> None:
    if options.bag:
        with bags.opened(options.bag) as bag:
            topic, field = bags.split_topic(bag, options.topic)
            directory = Directory()
            bags.take_names(bag, directory)
            _echo(bags.messages(bag, [topic]), field, directory, options)
        return
    master = find_master()
    topic, _, field = split_topic(master, options.topic)
    with listener(topic) as stream:
        try:
            _echo(_from_first_whole(master, stream, topic), field, Directory(), options)
        except KeyboardInterrupt:
            # without a count this is how it ends
            if options.count:
                raise


def _from_first_whole(master: rosgraph.Master, stream: Listener, topic: str) -> Iterator[Heard]:
    """The messages that come, without sampled ones whose provenance is not known yet, if one with it comes soon."""
    end = time.monotonic() + PATIENCE
    first = stream.next_before(time.monotonic() + SILENCE)
    if first is None:
        write_note('echo', why_silent(master, stream, topic, SILENCE))
    for received in itertools.chain([first] if first else [], stream.during(math.inf)):
        if received.is_sampled and not values.is_tracked(received.message) and time.monotonic() < end:
            continue
        yield received


def _echo(messages: Iterable[Heard], field: str, directory: Directory, options: argparse.Namespace) -> None:
    values.describe_sources_with(directory.describe)
    for number, received in enumerate(messages, 1):
        part = field_of(received.message, field)
        directory.learn(values.sources(part))
        if options.json:
            print(json_line(received, part, field, directory), flush=True)
        else:
            if is_terminal():
                print('\n'.join(yaml_lines(part)))
            else:
                write_lines(part, field)
            print('---', flush=True)
        if number == options.count:
            break
