"""`rosslt statistics`: what provenance costs on topics. scripts/rosslt_message_statistics is the same."""

import argparse
import sys

import rospy

from rosslt.cli.completers import topics
from rosslt.cli.master import find_master
from rosslt.cli.message_statistics import Pipe, Screen, Topic
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'how many bytes of the messages on topics are provenance'
DESCRIPTION = 'Print rate, plain size, provenance size and ratio of the messages on topics.'
EXAMPLE = """\
plain is what the message takes without its provenance, and the ratio is the whole over that, all as averages since the
report before. On a terminal the table is refreshed in place; in a pipe there is a line for each topic and report.

example:
  rosslt statistics /target /markers
"""


def _positive(text: str) -> float:
    number = float(text)
    if not 0 < number < float('inf'):
        raise argparse.ArgumentTypeError(f'{text} is not above 0')
    return number


ARGUMENTS = [
    Argument('topics', nargs='+', metavar='TOPIC', completer=topics, help='of any message type, tracked or not'),
    Argument(
        '-i', '--interval', type=_positive, default=1.0, metavar='S', help='seconds between two reports (default: 1)'
    ),
    Argument('-n', '--count', type=int, default=0, metavar='N', help='end after N reports (default: never)'),
]


def run(options: argparse.Namespace) -> None:
    find_master()
    rospy.init_node('rosslt_message_statistics', anonymous=True)
    watched = [Topic(name) for name in dict.fromkeys(map(rospy.resolve_name, options.topics))]
    output = Screen() if sys.stdout.isatty() else Pipe()
    reports = 0
    while not rospy.is_shutdown() and (not options.count or reports < options.count):
        rospy.rostime.wallsleep(options.interval)
        output.show([topic.report() for topic in watched])
        reports += 1
