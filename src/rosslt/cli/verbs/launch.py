"""`rosslt launch`: a launch file, every Python node in it with provenance."""

import argparse

from rosslt.cli.failure import Failure
from rosslt.cli.verb import RUN, Argument

GROUP = RUN
SUMMARY = 'a launch file, every Python node in it with provenance'
DESCRIPTION = """\
Start a launch file as roslaunch does, with every Python node in it run by `rosslt run`, others as they are, and
slt_visualization beside them, whose interactive markers change what they show. It is started again if it ends.
The parameters that the file gives to a node that runs as it is can be changed as well: such a node is started again
when one has changed, unless it has it in dynamic_reconfigure.
"""
EXAMPLE = """\
example:
  rosslt launch --except /joy diff_drive_demo mock_robot.launch rviz:=true
"""
ARGUMENTS = [
    Argument('--no-markers', action='store_true', help='without slt_visualization'),
    Argument('--rviz', action='store_true', help='open RViz with everything that can be dragged'),
    Argument('--only', action='append', default=[], metavar='NODE', help='run no other node tracked'),
    Argument('--except', action='append', default=[], dest='others', metavar='NODE', help='run this node as it is'),
    Argument(
        '--no-restart',
        action='store_true',
        help='refuse a change of a parameter that would have its node started again',
    ),
    Argument('--screen', action='store_true', help='show the output of all nodes'),
    Argument('file', nargs='+', metavar='[PACKAGE] FILE', help='and its arguments, NAME:=VALUE'),
]


def run(options: argparse.Namespace) -> None:
    from rosslt import instrument

    try:
        instrument.launch(
            options.file,
            markers=not options.no_markers,
            only=options.only,
            others=options.others,
            screen=options.screen,
            rviz=options.rviz,
            restarts=not options.no_restart,
        )
    except instrument.NotLaunched as error:
        raise Failure(str(error)) from None
