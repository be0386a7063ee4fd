"""The messages in which a verb looks at a field: the next ones of a topic or of a link of a robot, or one of a bag."""

import argparse
from typing import Any, Iterator, List, NamedTuple, Tuple

from rosslt import values
from rosslt.cli import bags
from rosslt.cli.directory import instead_of_topic
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.fields import field_of, joined
from rosslt.cli.master import find_master, split_topic
from rosslt.cli.reading import LINK_ARGUMENTS, heard_publishers, link_of, listener
from rosslt.cli.verb import Argument
from rosslt.node import Directory, Heard

ARGUMENTS = [
    Argument(
        'field',
        nargs='?',
        default='',
        completer='fields',
        metavar='TOPIC/FIELD',
        help='as /target/pose/position/x or /path/points[3]; with --frame, as position/z',
    ),
    *LINK_ARGUMENTS,
    Argument('--node', completer='nodes', metavar='NODE', help='in the messages of this node'),
    Argument('--timeout', type=float, default=5.0, metavar='S', help='seconds to wait for a message (default: 5)'),
    Argument('--bag', metavar='FILE', help='in the first message of a recorded bag'),
]
"""The arguments of verbs that look at a field."""


class NothingTracked(Failure):
    """No value in a field has a source."""


class Reading(NamedTuple):
    """A field as messages have it.

    Attributes:
        heard: the messages, one of each publisher.
        field: its path in them.
        title: what they are about; '' if it is their topic.
    """

    heard: List[Heard]
    field: str
    title: str

    def tracked_leaves(self) -> Iterator[Tuple[Heard, str, Any]]:
        """The values with sources in the field: (message, path, value).

        Raises:
            NothingTracked: there is none.
            Failure: there is no such field.
        """
        found = False
        for each in self.heard:
            for path, leaf in values.leaves(field_of(each.message, self.field)):
                if values.is_tracked(leaf):
                    found = True
                    yield each, joined(self.field, path), leaf
        if not found:
            names = ' and '.join(each.publisher or each.topic for each in self.heard)
            part = '/'.join(filter(None, (self.heard[0].topic, '' if self.title else self.field)))
            raise NothingTracked(f'nothing in it has a source, as {names} sends it; `rosslt doctor {part}` says why')


def read_field(options: argparse.Namespace, directory: Directory) -> Reading:
    """Read the field that `ARGUMENTS` name; the directory learns of its sources.

    Raises:
        Misused: no field is named, or two things at once.
        Failure: there is no such field, or no message came.
    """
    if not (options.field or options.frame):
        raise Misused('name a field, TOPIC/FIELD, or a link, --frame LINK')
    if options.frame and options.bag:
        raise Misused('--frame is for what is sent now, not for --bag')
    found = _recorded(options, directory) if options.bag else _heard(options)
    values.describe_sources_with(directory.describe)
    directory.learn({source for each in found.heard for source in values.sources(field_of(each.message, found.field))})
    return found


def _heard(options: argparse.Namespace) -> Reading:
    master = find_master()
    link = link_of(master, options)
    if link is not None:
        with listener(link.topic, is_exact=True) as states:
            heard = heard_publishers(master, link.stream(states), link.topic, options.timeout, options.node)
            return Reading(heard, options.field, link.title)
    try:
        topic, _, field = split_topic(master, options.field)
    except Failure as failure:
        raise Failure(f'{failure}{instead_of_topic(master, options.field)}') from None
    with listener(topic, is_exact=True) as stream:
        return Reading(heard_publishers(master, stream, topic, options.timeout, options.node), field, '')


def _recorded(options: argparse.Namespace, directory: Directory) -> Reading:
    with bags.opened(options.bag) as bag:
        topic, field = bags.split_topic(bag, options.field)
        bags.take_names(bag, directory)
        return Reading([next(bags.messages(bag, [topic]))], field, '')
