"""`rosslt undo`: take a node's last change back."""

import argparse

from std_srvs.srv import Trigger, TriggerRequest

from rosslt import node
from rosslt.cli.completers import nodes
from rosslt.cli.directory import TIMEOUT, tracked_node
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
    name = tracked_node(find_master(), options.node)
    answers, silent = node.ask_all('undo', Trigger, {name: TriggerRequest()}, TIMEOUT)
    if silent:
        raise Failure(f'cannot reach {name}: {silent[name]}')
    if not answers[name].success:
        raise Failure(f'{name}: {answers[name].message}')
    print(answers[name].message)
