"""`rosslt run`: an unmodified node, with provenance."""

import argparse
import os
import sys

from rosslt.cli.failure import did_you_mean
from rosslt.cli.verb import RUN, Argument

GROUP = RUN
SUMMARY = 'an unmodified node, with provenance'
DESCRIPTION = """\
Run a rospy node as it is, with its number literals as locations and its parameters as sources. It behaves as when it
is run by itself. What cannot be tracked runs untracked, with a line that says why.
"""
EXAMPLE = """\
example:
  rosslt run turtle_tf2 dynamic_tf2_broadcaster.py
  rosslt run ./patrol.py _speed:=0.3
  <node pkg="turtle_tf2" type="dynamic_tf2_broadcaster.py" name="frame" launch-prefix="rosslt run"/>
"""


def _name_in_module(argument: str) -> str:
    if not all(part.isidentifier() for part in argument.split('.')) or '.' not in argument:
        raise argparse.ArgumentTypeError(f'{argument!r} is not the name of a function or class in a module')
    return argument


ARGUMENTS = [
    Argument(
        '--include',
        action='append',
        default=[],
        metavar='MODULE',
        help='track this module too, and those below it; by default those beside the script and those of catkin '
        'workspaces are',
    ),
    Argument(
        '--pure',
        action='append',
        default=[],
        type=_name_in_module,
        metavar='MODULE.NAME',
        help='record calls of this function of another library, or of the methods of this class: their results follow '
        'from their arguments alone',
    ),
    Argument('node', nargs=argparse.REMAINDER, metavar='PACKAGE NODE | FILE', help='and the arguments of the node'),
]

#: This verb becomes the node: exceptions and the exit code are the node's own.
TAKES_OVER = True


def run(options: argparse.Namespace) -> int:
    """Run a node in this process; its exceptions and its exit go through."""
    from rosslt import instrument

    rest = list(options.node)
    if not rest:
        print('rosslt run: which node? See rosslt run -h', file=sys.stderr)
        return 2
    first = rest.pop(0)
    is_file = os.path.isfile(first) and (os.sep in first or first.endswith('.py') or not rest)
    try:
        if not is_file:
            if not rest or ':=' in rest[0]:
                raise instrument.NoNode(f'there is no file {first}')
            first = instrument.find_node(first, rest.pop(0))
    except instrument.NoNode as error:
        print(f'rosslt run: {error}{did_you_mean(error.wanted, error.known)}', file=sys.stderr)
        return 1
    instrument.run_file(first, rest, options.include, options.pure)
    return 0
