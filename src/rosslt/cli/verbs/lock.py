"""`rosslt lock`: refuse changes of a location or a node."""

import argparse

from rosslt.cli.locks import lock_or_unlock
from rosslt.cli.output import write_result
from rosslt.cli.verb import CHANGE, Argument, node_or_location

GROUP = CHANGE
SUMMARY = 'refuse changes of a location or of a node, until it is unlocked'
DESCRIPTION = """Have a node refuse every change of a location, or of all its locations, until `rosslt unlock`. The
refusal says who has locked it and why. It holds over a restart of the node. A drag or `rosslt force` that could change
several locations changes those that are not locked. This guards against accidents: ROS 1 has no authentication, and
whoever reaches the master can unlock."""
EXAMPLE = """\
examples:
  rosslt lock /talker --reason "the robot is running"
  rosslt lock /talker/radius

In a pipe it is a line of columns between tabs: NODE or NODE/LOCATION, and locked.
"""
ARGUMENTS = [
    node_or_location('all of its locations'),
    Argument('--reason', default='', metavar='TEXT', help='why, for those who are refused'),
]


def run(options: argparse.Namespace) -> None:
    _, locked = lock_or_unlock(options, 'lock', options.reason)
    write_result(f'{locked} is locked', locked, 'locked')
