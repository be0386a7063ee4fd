"""`rosslt explain`: where a field of a topic comes from."""

import argparse
from typing import List, Tuple

from rosslt import values
from rosslt.cli import bags
from rosslt.cli.directory import instead_of_topic
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.fields import field_of, joined, source_values
from rosslt.cli.master import find_master, split_topic
from rosslt.cli.output import is_terminal, limits, table, write_row
from rosslt.cli.reading import LINK_ARGUMENTS, heard_publishers, link_of, listener
from rosslt.cli.rendering import text_of
from rosslt.cli.verb import LOOK, Argument
from rosslt.messages import Scalar
from rosslt.node import Directory, Heard

GROUP = LOOK
SUMMARY = 'where a field of a topic comes from: the expression, and each location in it'
DESCRIPTION = """Print where a field of the next message of a topic comes from: the expression that made it, and each
location in that with its value, its bounds and its file. Of several nodes that publish the topic, each is explained.

With --frame, it is about a link of a robot, where its JointState and robot_description say it is: FIELD is then one of
position/x, y and z, orientation/roll, pitch and yaw, or left out for all of them."""
EXAMPLE = """\
examples:
  rosslt explain /target/pose/position/x
  rosslt explain --bag run.bag /target/pose/position
  rosslt explain --frame gripper position/z

In a pipe each location of each field is a line of columns between tabs: field, value, expression, NODE/LOCATION, its
value, file:line:column (or empty).
"""
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


def run(options: argparse.Namespace) -> None:
    if not (options.field or options.frame):
        raise Misused('name a field, TOPIC/FIELD, or a link, --frame LINK')
    if options.frame and options.bag:
        raise Misused('--frame is for what is sent now, not for --bag')
    directory = Directory()
    received, field, title = _recorded(options, directory) if options.bag else _heard(options)
    values.describe_sources_with(directory.describe)
    directory.learn({source for each in received for source in values.sources(field_of(each.message, field))})
    found = False
    for each in received:
        leaves = [
            (joined(field, path), leaf)
            for path, leaf in values.leaves(field_of(each.message, field))
            if values.is_tracked(leaf)
        ]
        found = found or bool(leaves)
        for path, leaf in leaves:
            if is_terminal():
                _show(title or each.topic, each, path, leaf, directory, not options.bag)
            else:
                _write(path, leaf, directory, not options.bag)
    if not found:
        names = ' and '.join(each.publisher or each.topic for each in received)
        part = '/'.join(filter(None, (received[0].topic, '' if title else field)))
        raise Failure(f'nothing in it has a source, as {names} sends it; `rosslt doctor {part}` says why')


def _heard(options: argparse.Namespace) -> Tuple[List[Heard], str, str]:
    """Messages, the field in them, and what a link is called that they are about, '' for none."""
    master = find_master()
    link = link_of(master, options)
    if link is not None:
        with listener(link.topic, is_exact=True) as states:
            heard = heard_publishers(master, link.stream(states), link.topic, options.timeout, options.node)
            return heard, options.field, link.title
    try:
        topic, _, field = split_topic(master, options.field)
    except Failure as failure:
        raise Failure(f'{failure}{instead_of_topic(master, options.field)}') from None
    with listener(topic, is_exact=True) as stream:
        return heard_publishers(master, stream, topic, options.timeout, options.node), field, ''


def _recorded(options: argparse.Namespace, directory: Directory) -> Tuple[List[Heard], str, str]:
    with bags.opened(options.bag) as bag:
        topic, field = bags.split_topic(bag, options.field)
        bags.take_names(bag, directory)
        return [next(bags.messages(bag, [topic]))], field, ''


def _show(title: str, received: Heard, path: str, leaf: object, directory: Directory, is_live: bool) -> None:
    by = f', published by {received.publisher}' if received.publisher else ''
    print(f'{title} {path} = {text_of(leaf)}{by}')
    print('  = ' + values.explain(leaf))
    rows = []
    for source, value, present in _readings(leaf, directory, is_live):
        place = directory.of(source)
        shown = text_of(present) if present == value else f'{text_of(present)}, but {text_of(value)} in the message'
        rows.append((directory.name(source), shown, limits(place) if place else '', place.file if place else ''))
    print('\n'.join(table(rows, indent='  ')))


def _write(path: str, leaf: object, directory: Directory, is_live: bool) -> None:
    for source, _, present in _readings(leaf, directory, is_live):
        place = directory.of(source)
        file = place.file if place else ''
        write_row(path, text_of(leaf), values.explain(leaf), directory.name(source), text_of(present), file)


def _readings(leaf: object, directory: Directory, is_live: bool) -> List[Tuple[values.Source, Scalar, Scalar]]:
    """The sources of a number, its own first, each with the value that the message has of it, and the present one, as
    far as known: of a recorded message, that again."""
    found = source_values(leaf)
    places = [(source, directory.of(source)) for source in directory.own_first(found)]
    return [
        (source, found[source], place.value if is_live and place and place.location.value else found[source])
        for source, place in places
    ]
