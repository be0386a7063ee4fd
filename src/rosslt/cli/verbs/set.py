"""`rosslt set`: change a location."""

import argparse
import contextlib
import sys

from rosslt import node
from rosslt.cli.directory import change, find
from rosslt.cli.failure import Failure
from rosslt.cli.fields import parse_scalar, parses_as_float
from rosslt.cli.master import find_master
from rosslt.cli.output import write_change
from rosslt.cli.verb import CHANGE, LOCATION, Argument
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'change a location'
DESCRIPTION = """Give a location a new value; its node takes it or says why it doesn't. If the node keeps nothing that
came of the location, and does not read it again, it is said that the change takes effect at the next start."""
EXAMPLE = """\
example:
  rosslt set /talker/radius 2.5
"""
ARGUMENTS = [
    LOCATION,
    Argument('value', metavar='VALUE', help='a number, true or false, or a text; -- in front of a text with -'),
]


def run(options: argparse.Namespace) -> None:
    master, directory = find_master(), Directory()
    place = find(master, directory, options.location)
    try:
        value = parse_scalar(options.value, place.location.type)
    except ValueError as error:
        why = node.why_whole(place) if parses_as_float(options.value) else ''
        raise Failure('; '.join(filter(None, [f'{place.name}: {error}', why]))) from None
    changed, outdated = change(master, directory, 'rosslt set', {place.source: value})
    ((old, new),) = changed.values()
    write_change(directory, place.source, node.to_json(old), node.to_json(new))
    with contextlib.suppress(Failure):  # the node has ended
        # An array may have come to wait for its length by this change, or have ceased to.
        place = find(master, Directory(), options.location)
    if place.location.at_next_start:
        print(f'rosslt set: it {place.location.at_next_start}', file=sys.stderr)
    elif place.location.plain_copies:
        print(f'rosslt set: {place.location.plain_copies}; what else uses it follows', file=sys.stderr)
    if outdated and not place.location.at_next_start:
        print(f'rosslt set: {outdated}', file=sys.stderr)
