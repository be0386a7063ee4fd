"""`rosslt learn`: how what a node sends depends on what it hears, found by trying a copy of it."""

import argparse
import sys
import time
from typing import Sequence

from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master, full_name
from rosslt.cli.output import is_terminal, table, write_row
from rosslt.cli.reading import start_node
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'how what a node sends depends on what it hears, tried on a copy of it'
DESCRIPTION = """Find which number that a node sends depends on which number that it hears, and how much. A copy of the
node, the same program with the same arguments and parameters, runs on this machine under a master of its own, without
the robot's network and devices if this user may do that. It hears what the node has just heard; if it sends the same,
its inputs are changed, many at once at first, and what moves is looked into. Nothing is ever tried on the robot.

A node that does not send the same on the same input is refused: it depends on time, on chance, on what it did before,
or on what it does not hear by topics. So is one that holds a device, a port or a lock."""
EXAMPLE = """\
example:
  rosslt learn /robot_state_publisher

In a pipe each dependency is a line of columns between tabs: output, input, kind, slope, its uncertainty, and the change
of the input down and up to which the slope holds.
"""
ARGUMENTS = [
    Argument('node', completer='nodes', metavar='NODE'),
    Argument('--seconds', type=float, default=2.0, metavar='S', help='listen to it for so long (default: 2)'),
    Argument('--most', type=int, default=200, metavar='N', help='trials at most (default: 200)'),
]


def run(options: argparse.Namespace) -> None:
    from rosslt import models  # NumPy and SciPy, which other verbs do without

    begin = time.monotonic()
    master = find_master()
    node = full_name(options.node)
    try:
        process = models.live_process(master, node)
        start_node()
        recording = models.record(process, options.seconds)
        answer = models.learn_node(process, master.getParam('/'), recording, options.most, _say)
    except (models.NotCopied, models.NotLearned, models.TwinFailed) as error:
        raise Failure(str(error)) from None
    _show(answer)
    _say(f'{answer.learned.trials} trials, {time.monotonic() - begin:.1f} s in all')


def _say(text: str) -> None:
    print(f'rosslt learn: {text}', file=sys.stderr, flush=True)


def _show(answer: 'models.Answer') -> None:
    learned = answer.learned
    rows = [
        (
            answer.outputs[one.output].name,
            answer.inputs[one.input].name,
            one.kind,
            one.slope,
            one.uncertainty,
            one.low,
            one.high,
        )
        for one in learned.dependencies
    ]
    if not is_terminal():
        for row in rows:
            write_row(*row)
    elif rows:
        shown = [
            (
                output,
                'moves with',
                name,
                f'{slope:.6g} +- {error:.1g}' if slope == slope else kind,
                f'from {low:+.3g} to {high:+.3g}',
            )
            for output, name, kind, slope, error, low, high in rows
        ]
        print('\n'.join(table(shown)))
    else:
        print('nothing that it sends moves with a number that it hears')
    for words, numbers, names in (
        ('not repeatable, so nothing is said of it', learned.unrepeatable, answer.outputs),
        ('takes the answer away when it is changed', learned.unanswered, answer.inputs),
        ('not tried: there were no more trials', learned.untried, answer.inputs),
    ):
        for name in _names(numbers, names):
            _say(f'{name} is {words}' if not words.startswith('takes') else f'{name} {words}')


def _names(numbers: Sequence[int], of: Sequence['models.Number']) -> Sequence[str]:
    return [of[number].name for number in numbers]
