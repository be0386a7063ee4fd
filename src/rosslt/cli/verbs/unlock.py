"""`rosslt unlock`: accept changes of a locked node or location again."""

import argparse

from rosslt.cli.failure import Failure
from rosslt.cli.locks import lock_or_unlock, locks_of, note_of
from rosslt.cli.output import write_result
from rosslt.cli.verb import CHANGE, node_or_location

GROUP = CHANGE
SUMMARY = 'accept changes of a locked node or location again'
DESCRIPTION = """Accept changes of a location again, or of a node and all of its locations: the opposite of `rosslt
lock`."""
EXAMPLE = """\
examples:
  rosslt unlock /talker
  rosslt unlock /talker/radius

In a pipe it is a line of columns between tabs: NODE or NODE/LOCATION, and unlocked.
"""
ARGUMENTS = [node_or_location('it and all of its locations')]


def run(options: argparse.Namespace) -> None:
    name, unlocked = lock_or_unlock(options, 'unlock')
    still = ''.join(map(note_of, locks_of([name]).values()))
    if still:
        raise Failure(f'{unlocked} is unlocked, but the whole node is {still}; rosslt unlock {name}')
    write_result(f'{unlocked} is unlocked', unlocked, 'unlocked')
