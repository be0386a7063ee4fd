"""`rosslt undo`: take a node's last change back."""

import argparse

from std_srvs.srv import Trigger, TriggerRequest

from rosslt.cli.completers import nodes
from rosslt.cli.directory import call, tracked_node
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = "take a node's last change back"
DESCRIPTION = "Take the last change of a node's locations back, and print the values that are in force again."
EXAMPLE = """\
example:
  rosslt undo /talker
"""
ARGUMENTS = [
    Argument('node', completer=nodes, metavar='NODE'),
]


def run(options: argparse.Namespace) -> None:
    master = find_master()
    name = tracked_node(master, options.node)
    answer = call(master, name, 'undo', Trigger, TriggerRequest())
    if not answer.success:
        raise Failure(f'{name}: {answer.message}')
    print(answer.message)
