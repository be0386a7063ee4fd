"""`rosslt force`: have a field of a topic become a value, by changing where it comes from."""

import argparse
import sys
import time
from typing import Any, Dict, Optional, Set, Tuple

import rospy

from rosslt import node, values
from rosslt.cli.completers import fields, locations, nodes
from rosslt.cli.directory import TIMEOUT, Directory
from rosslt.cli.failure import Failure
from rosslt.cli.fields import field_of, is_reached, source_values, target
from rosslt.cli.hearing import heard_publishers
from rosslt.cli.master import find_master, split_topic
from rosslt.cli.output import is_terminal, write_change
from rosslt.cli.reading import Inbox
from rosslt.cli.rendering import text_of
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = 'have a field of a topic become a value, by changing where it comes from'
DESCRIPTION = """Take the next message of a topic, solve for the sources of a field of it, and have their nodes change
them, so that the field of the messages to come is VALUE. Prints what changed, and waits until a message shows it. Where
several nodes publish the topic, it is about the first one by name whose messages have a source, unless --node or
--source says another."""
EXAMPLE = """\
examples:
  rosslt force /target/pose/position/x 1.5
  rosslt force /target/pose/position "{x: 1.5, y: 0.0}" --dry-run
  rosslt force /target/pose/position/x 1.5 --source /talker/radius

In a pipe each change is a line of columns between tabs: NODE/LOCATION, old value, new value, file:line:column.
"""
ARGUMENTS = [
    Argument('field', completer=fields, metavar='TOPIC/FIELD', help='as /target/pose/position/x or /path/points[3]'),
    Argument('value', metavar='VALUE', help='a scalar; YAML for a whole part of a message'),
    Argument(
        '--source',
        completer=locations,
        metavar='S',
        help='change this location alone: NODE/LOCATION, NODE#ID, or FILE:LINE:COLUMN as rosslt echo says',
    ),
    Argument('--node', completer=nodes, metavar='NODE', help='in the messages of this node'),
    Argument('--dry-run', action='store_true', help='print what would change; change nothing'),
    Argument('--timeout', type=float, default=5.0, metavar='S', help='seconds to wait for a message (default: 5)'),
]


class Requester:
    """What the command has of a node that asks others: its name, and what it knows of their locations."""

    def __init__(self, name: str, directory: Directory) -> None:
        self.name = name
        self.directory = directory


def run(options: argparse.Namespace) -> None:
    master, directory = find_master(), Directory()
    topic, _, field = split_topic(master, options.field)
    values.describe_sources_with(directory.describe)
    with Inbox([topic]) as inbox:
        heard = heard_publishers(master, inbox, topic, options.timeout, options.node)
        parts = {received.publisher: field_of(received.message, field) for received in heard}
        directory.learn({source for part in parts.values() for source in values.sources(part)})
        publisher, source = _chosen(directory, parts, options.source)
        part = parts[publisher]
        if not values.sources(part):
            raise Failure(f'nothing in it has a source, as {publisher} sends it; `rosslt doctor {topic}` says why')
        if len(parts) > 1:
            print(
                'rosslt force: {} publish {}; this is about the messages of {}, --node takes another'.format(
                    ' and '.join(parts), topic, publisher
                ),
                file=sys.stderr,
            )
        wanted = target(part, options.value)
        if options.dry_run:
            changes = _planned(directory, part, wanted, source)
        else:
            inbox.clear()
            changes = node.force_value_as(Requester(rospy.get_name(), directory), part, wanted, source, TIMEOUT)
        changes = {changing: change for changing, change in changes.items() if change.old != change.new}
        if not changes and is_terminal():
            print('nothing to change: it is so already')
        for changed, (old, new) in changes.items():
            write_change(directory, changed, node.to_json(old), node.to_json(new), is_planned=options.dry_run)
        if changes and not options.dry_run:
            sys.stdout.flush()
            _wait_until_seen(inbox, publisher, field, wanted, changes, options)


def _chosen(directory: Directory, parts: Dict[str, Any], text: Optional[str]) -> Tuple[str, Optional[values.Source]]:
    """Whose message to solve, and the source to change if one was named.

    Args:
        directory: knows what sources are called.
        parts: {publisher: the field in its message}.
        text: what people call the source, or None.
    """
    if text is None:
        return next((name for name, part in parts.items() if values.sources(part)), next(iter(parts))), None
    found: Dict[values.Source, str] = {}
    for name, part in parts.items():
        for source in values.sources(part):
            if text in _names(directory, source):
                found.setdefault(source, name)
    if not found:
        sources = dict.fromkeys(source for part in parts.values() for source in values.sources(part))
        raise Failure(
            '{} is not among its sources, which are {}'.format(text, ', '.join(map(directory.name, sources)) or 'none')
        )
    if len(found) > 1:
        raise Failure('{} is ambiguous: it may be {}'.format(text, ' or '.join(map(directory.name, found))))
    ((source, name),) = found.items()
    return name, source


def _planned(
    directory: Directory, part: Any, wanted: Any, source: Optional[values.Source]
) -> Dict[values.Source, node.Change]:
    """{Source: Change(old, new)} as far as it is known without requesting the change."""
    new = values.solve(part, wanted, source, **directory.limits(values.sources(part), TIMEOUT))
    old = source_values(part)
    return {changing: node.Change(old[changing], value) for changing, value in new.items()}


def _wait_until_seen(
    inbox: Inbox,
    publisher: str,
    field: str,
    wanted: Any,
    changes: Dict[values.Source, node.Change],
    options: argparse.Namespace,
) -> None:
    """Wait for a message of the same publisher that was made after the change, and check its value.

    Raises:
        Failure: it does not have the wanted value.
    """
    end = time.monotonic() + options.timeout
    last = None
    while True:
        received = inbox.next_before(end)
        if received is None:
            break
        if received.publisher != publisher:
            continue
        last = field_of(received.message, field)
        if is_reached(last, wanted):
            return
        present = source_values(last)
        if all(source in present and present[source] == change.new for source, change in changes.items()):
            break
    if last is None:
        print(
            f'rosslt force: no message of {publisher} came within {options.timeout:g} s after that: '
            'it is seen when the node publishes again',
            file=sys.stderr,
        )
    else:
        raise Failure(f'this has changed, but {publisher} now sends {_shown(last)} instead of {options.value}')


def _shown(part: Any) -> str:
    """A part of a message in one line."""
    tracked = [(path, leaf) for path, leaf in values.leaves(part) if values.is_tracked(leaf)]
    return ', '.join(f'{path}: {text_of(leaf)}' if path else text_of(leaf) for path, leaf in tracked) or str(part)


def _names(directory: Directory, source: values.Source) -> Set[str]:
    """All that people may call a source."""
    place = directory.of(source)
    return {str(source)} | ({place.name, place.file, place.short_file} if place else set())
