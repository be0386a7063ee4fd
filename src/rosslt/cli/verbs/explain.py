"""`rosslt explain`: where a field of a topic comes from."""

import argparse
from typing import List, Tuple

from rosslt import values
from rosslt.cli import field_reading
from rosslt.cli.fields import source_values
from rosslt.cli.output import is_terminal, limits, table, write_row
from rosslt.cli.rendering import text_of
from rosslt.cli.verb import LOOK
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
ARGUMENTS = field_reading.ARGUMENTS


def run(options: argparse.Namespace) -> None:
    directory = Directory()
    reading = field_reading.read_field(options, directory)
    for each, path, leaf in reading.tracked_leaves():
        if is_terminal():
            _show(reading.title or each.topic, each, path, leaf, directory, not options.bag)
        else:
            _write(path, leaf, directory, not options.bag)


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
