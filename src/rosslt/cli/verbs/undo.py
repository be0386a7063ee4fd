"""`rosslt undo`: take a node's last change back."""

from std_srvs.srv import Trigger, TriggerRequest

from rosslt import node
from rosslt.cli.directory import TIMEOUT, tracked_node
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master

DESCRIPTION = "Take the last change of a node's locations back, and print the values that are in force again."
EXAMPLE = """\
example:
  rosslt undo /talker
"""


def parse(parser):
    parser.add_argument('node', metavar='NODE')


def run(options):
    name = tracked_node(find_master(), options.node)
    answers, silent = node.ask_all('undo', Trigger, {name: TriggerRequest()}, TIMEOUT)
    if silent:
        raise Failure(f'cannot reach {name}: {silent[name]}')
    if not answers[name].success:
        raise Failure(f'{name}: {answers[name].message}')
    print(answers[name].message)
