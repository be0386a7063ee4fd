"""`rosslt force`: have a field of a topic become a value, by changing where it comes from."""

import argparse
from collections import namedtuple

import rospy

from rosslt import node, values
from rosslt.cli.completers import fields, locations
from rosslt.cli.directory import TIMEOUT, Directory
from rosslt.cli.failure import Failure
from rosslt.cli.fields import field_of, target
from rosslt.cli.master import find_master, split_topic
from rosslt.cli.output import is_terminal, write_change
from rosslt.cli.reading import Inbox
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = 'have a field of a topic become a value, by changing where it comes from'
DESCRIPTION = """Take the next message of a topic, solve for the sources of a field of it, and have their nodes change
them, so that the field of the messages to come is VALUE. Prints what changed."""
EXAMPLE = """\
examples:
  rosslt force /goal/pose/position/x 1.5
  rosslt force /goal/pose/position "{x: 1.5, y: 0.0}" --dry-run
  rosslt force /goal/pose/position/x 1.5 --source /talker/radius

In a pipe each change is a line of columns between tabs: NODE/LOCATION, old value, new value, file:line:column.
"""
ARGUMENTS = [
    Argument('field', completer=fields, metavar='TOPIC/FIELD', help='as /goal/pose/position/x or /path/points[3]'),
    Argument('value', metavar='VALUE', help='a scalar; YAML for a whole part of a message'),
    Argument(
        '--source',
        completer=locations,
        metavar='S',
        help='change this location alone: NODE/LOCATION, NODE#ID, or FILE:LINE:COLUMN as rosslt echo says',
    ),
    Argument('--dry-run', action='store_true', help='print what would change; change nothing'),
    Argument('--timeout', type=float, default=5.0, metavar='S', help='seconds to wait for a message (default: 5)'),
]

#: What the command has of a node that asks others: its name, and what it knows of their locations.
Asker = namedtuple('Asker', 'name directory')


def run(options: argparse.Namespace) -> None:
    topic, _, field = split_topic(find_master(), options.field)
    with Inbox([topic]) as inbox:
        received = inbox.next(options.timeout)
    part = field_of(received.message, field)
    wanted = target(part, options.value)
    directory = Directory()
    values.describe_sources_with(directory.short_file)
    directory.learn(values.sources(part))
    source = options.source and _source(directory, values.sources(part), options.source)
    if options.dry_run:
        changes = _planned(directory, part, wanted, source)
    else:
        changes = node.force_value_as(Asker(rospy.get_name(), directory), part, wanted, source, TIMEOUT)
    if not changes and is_terminal():
        print('nothing to change')
    for changed, (old, new) in changes.items():
        write_change(directory, changed, node.to_json(old), node.to_json(new), is_planned=options.dry_run)


def _planned(directory, part, wanted, source):
    """{Source: Change(old, new)} as far as it is known without asking for the change."""
    sources = values.sources(part)
    new = values.solve(part, wanted, source, **directory.limits(sources, TIMEOUT))
    instructions, _ = values.disassemble([leaf for _, leaf in values.leaves(part) if values.is_tracked(leaf)])
    old = {instruction[1]: instruction[2] for instruction in instructions if instruction[0] is values.SOURCE}
    return {changing: node.Change(old[changing], value) for changing, value in new.items()}


def _source(directory, sources, text):
    """The one among sources that people call `text`."""
    called = [source for source in sources if text in _names(directory, source)]
    if not called:
        raise Failure(
            '{} is none of its sources, which are {}'.format(text, ', '.join(map(directory.name, sources)) or 'none')
        )
    if len(called) > 1:
        raise Failure('{} may be {}'.format(text, ' or '.join(map(directory.name, called))))
    return called[0]


def _names(directory, source):
    place = directory.of(source)
    return {str(source)} | ({place.name, place.file, place.short_file} if place else set())
