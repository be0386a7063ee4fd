"""`rosslt generate`: write the .msg files of tracked message types. scripts/generate_tracked_msgs.py is the same.

It runs before anything of the package is built, and so may load nothing that is.
"""

import argparse
from typing import Dict, List, Tuple

from rosslt import messages
from rosslt.cli.failure import Misused
from rosslt.cli.verb import BUILD, Argument

GROUP = BUILD
SUMMARY = 'write the .msg files of tracked message types'
DESCRIPTION = 'Write the .msg files of tracked message types.'
EXAMPLE = """\
A tracked type holds a provenance header beside the message: PoseTracked is rosslt/Provenance and geometry_msgs/Pose.
If types of several packages have one name, each takes its package's: geometry_msgs/Pose and turtlesim/Pose become
GeometryMsgsPoseTracked and TurtlesimPoseTracked. The files' paths are printed; one that is up to date is not touched.

example:
  %(prog)s geometry_msgs/Pose -o msg
"""


def _include(argument: str) -> Tuple[str, str]:
    package, colon, folder = argument.partition(':')
    if not (package and colon and folder):
        raise argparse.ArgumentTypeError(f'{argument!r} is not PACKAGE:FOLDER')
    return package, folder


ARGUMENTS = [
    Argument(
        'types', nargs='*', metavar='TYPE', completer='message_types', help='a message type, as geometry_msgs/Pose'
    ),
    Argument(
        '--package', action='append', default=[], completer='message_packages', help='all message types of this package'
    ),
    Argument('--all', action='store_true', help='all message types that are installed or in a workspace'),
    Argument('-o', dest='folder', default='.', metavar='DIR', help='where to write (default: here)'),
    Argument('--name', help='what the tracked type is called, if there is one (default: <Type>Tracked)'),
    Argument(
        '-I',
        dest='include',
        action='append',
        default=[],
        type=_include,
        metavar='PACKAGE:FOLDER',
        help='look for the messages of PACKAGE in FOLDER first',
    ),
    Argument(
        '--list', action='store_true', exclusive=True, help='print the message types that are meant; write nothing'
    ),
    Argument(
        '--dry-run', action='store_true', exclusive=True, help='print the files that would be written; write nothing'
    ),
]


def run(options: argparse.Namespace) -> None:
    if not (options.types or options.package or options.all):
        raise Misused('name message types, a --package, or --all')
    include: Dict[str, List[str]] = {}
    for package, folder in options.include:
        include.setdefault(package, []).append(folder)
    types = messages.select_types(messages.MessagePath(include), options.types, options.package, options.all)
    if options.list:
        print('\n'.join(types))
        return
    files = messages.plan_files(options.folder, messages.tracked_names(types, options.name))
    if not options.dry_run:
        messages.write_files(files)
    for file in files:
        print(file.path)
