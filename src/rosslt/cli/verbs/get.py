"""`rosslt get`: the value of a location."""

import argparse

from rosslt import node
from rosslt.cli.directory import find
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master
from rosslt.cli.verb import LOCATION, LOOK
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'the value of a location'
DESCRIPTION = 'Print the current value of a location, as `rosslt set` takes it.'
EXAMPLE = """\
example:
  rosslt get /talker/radius
"""
ARGUMENTS = [LOCATION]


def run(options: argparse.Namespace) -> None:
    place = find(find_master(), Directory(), options.location)
    if place.location.fault:
        raise Failure(f'{place.name} has no value: {place.location.fault}')
    # a text is printed as it is, so that a shell can use it
    print(place.value if isinstance(place.value, str) else node.to_json(place.value))
