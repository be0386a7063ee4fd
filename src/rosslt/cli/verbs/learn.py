"""`rosslt learn`: how what a node sends depends on what it hears, found by trying a copy of it."""

import argparse
import math
import signal
import sys
import time
from typing import TYPE_CHECKING

from rosslt import node
from rosslt.cli import bags, learned
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.master import find_master, full_name
from rosslt.cli.output import write_result
from rosslt.cli.reading import start_node
from rosslt.cli.verb import LOOK, Argument

if TYPE_CHECKING:
    from rosslt.models import Answer

GROUP = LOOK
LEAST = 6  # trials that `models.learn` takes at least

SUMMARY = 'how what a node sends depends on what it hears, tried on a copy of it'
DESCRIPTION = """Find which number that a node sends depends on which number that it hears, and how much. A copy of the
node, the same program with the same arguments and parameters, runs on this machine under a master of its own, without
the robot's network and devices if this user may do that. It hears what the node has just heard; if it sends the same,
its inputs are changed, many at once at first, and what moves is looked into. Nothing is ever tried on the robot.
What is found is kept for `rosslt explain`.

A node that does not send the same on the same input is refused: it depends on time, on chance, on what it did before,
or on what it does not hear by topics. So is one that holds a device, a port or a lock."""
EXAMPLE = """\
examples:
  rosslt learn /robot_state_publisher
  rosslt learn --bag run.bag --parameters /crop_box

In a pipe each dependency is a line of columns between tabs: output, input, kind, slope, its uncertainty, and the change
of the input down and up to which the slope holds.
"""
ARGUMENTS = [
    Argument('node', completer='nodes', metavar='NODE'),
    Argument('--seconds', type=float, default=2.0, metavar='S', help='listen to it for so long (default: 2)'),
    Argument('--bag', metavar='FILE', help='take what it heard and sent from a recorded bag'),
    Argument('--parameters', action='store_true', help='try its private parameters too: a start of the copy for each'),
    Argument('--most', type=int, default=200, metavar='N', help='trials at most (default: 200)'),
]


def run(options: argparse.Namespace) -> None:
    from rosslt import models  # NumPy and SciPy, which other verbs do without

    if not 0 < options.seconds < float('inf') or options.most < LEAST:
        raise Misused(f'--seconds must be finite and above 0, and --most at least {LEAST}')
    begin = time.monotonic()
    master = find_master()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does: what was begun is cleared away
    try:
        process = models.live_process(master, full_name(options.node))
        if options.bag:
            with bags.opened(options.bag):
                recording = models.recorded(process, options.bag)
        else:
            start_node(disable_signals=True)
            recording = models.record(process, options.seconds)
            node.leave()  # what comes now is not of the live graph, and may take long
        tree = master.getParam('/')
        answers = models.learn_node(process, tree, recording, options.most, options.parameters, _say)
    except (models.NotBuilt, models.NotCopied, models.NotLearned, models.TwinFailed) as error:
        raise Failure(str(error)) from None
    for answer in answers:
        _show(answer)
    try:
        _say('kept for `rosslt explain` in ' + learned.keep(process, tree, answers))
    except (OSError, models.NotCopied) as error:
        _say(f'this is not kept: {error}')
    _say(f'{sum(answer.learned.trials for answer in answers)} trials, {time.monotonic() - begin:.1f} s in all')


def _say(text: str) -> None:
    print(f'rosslt learn: {text}', file=sys.stderr, flush=True)


def _show(answer: 'Answer') -> None:
    found = answer.learned
    for one in found.dependencies:
        moved, by = answer.outputs[one.output].name, answer.inputs[one.input].name
        slope = f'{one.slope:.6g} +- {one.uncertainty:.1g}' if math.isfinite(one.slope) else one.kind
        write_result(
            f'{moved}  moves with  {by}  {slope}  from {one.low:+.3g} to {one.high:+.3g}',
            *(moved, by, one.kind, one.slope, one.uncertainty, one.low, one.high),
        )
    if not found.dependencies:
        what = 'inputs' if any(number.path for number in answer.inputs) else 'parameters'
        _say(f'nothing that it sends moves with the numbers of its {what}')
    for number in found.unrepeatable:
        _say(f'{answer.outputs[number].name} is not the same each time, and nothing is said of it')
    for number in found.unanswered:
        _say(f'no answer came when {answer.inputs[number].name} was changed')
    for number in found.untried:
        _say(f'{answer.inputs[number].name} was not tried to the end: raise --most')
