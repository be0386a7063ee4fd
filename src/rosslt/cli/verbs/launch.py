"""`rosslt launch`: a launch file, every Python node in it with provenance."""

import argparse
import sys

DESCRIPTION = """\
usage: rosslt launch [OPTION]... PACKAGE FILE [ARG:=VALUE...]
       rosslt launch [OPTION]... FILE [ARG:=VALUE...]

Start a launch file as roslaunch does, with every Python node in it run by `rosslt run`, others as they are, and
slt_visualization beside them, whose interactive markers change what they show.

  --no-markers      without slt_visualization
  --only NODE       run no other node tracked; may be given several times
  --except NODE     run this node as it is; may be given several times
  --screen          show the output of all nodes

example:
  rosslt launch diff_drive_demo mock_robot.launch rviz:=true --except /joy
"""


def run(arguments):
    from rosslt import instrument

    parser = argparse.ArgumentParser(prog='rosslt launch', add_help=False)
    parser.add_argument('-h', '--help', action='store_true')
    parser.add_argument('--no-markers', action='store_true')
    parser.add_argument('--only', action='append', default=[])
    parser.add_argument('--except', action='append', default=[], dest='others')
    parser.add_argument('--screen', action='store_true')
    options, rest = parser.parse_known_args(arguments)
    if options.help:
        print(DESCRIPTION, end='')
        return 0
    unknown = [argument for argument in rest if argument.startswith('-')]
    if unknown or not rest:
        what = f'{unknown[0]} is not understood' if unknown else 'which launch file?'
        print(f'rosslt launch: {what}; see rosslt launch -h', file=sys.stderr)
        return 2
    try:
        instrument.launch(
            rest, markers=not options.no_markers, only=options.only, others=options.others, screen=options.screen
        )
    except instrument.NotLaunched as error:
        print(f'rosslt launch: {error}', file=sys.stderr)
        return 1
    return 0
