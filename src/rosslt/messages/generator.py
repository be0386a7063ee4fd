"""The generator: writes the `.msg` files of tracked message types (paper, section IV: provenance-annotated messages).

`scripts/generate_tracked_msgs.py` is its command, which `add_tracked_message_files()` calls in the build of a package.
It runs before anything of the package is built.
"""

import argparse
import os
import re
import sys
import tempfile
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.definitions import (
    MARK,
    MessagePath,
    UnknownType,
    data_type,
    definition_of_tracked,
    long_name,
    short_name,
)
from rosslt.values import Error

_EPILOG = """\
A tracked type holds a provenance header beside the message: PoseTracked is rosslt/Provenance and geometry_msgs/Pose.
Where types of several packages have one name, each takes its package's: geometry_msgs/Pose and turtlesim/Pose become
GeometryMsgsPoseTracked and TurtlesimPoseTracked. The files' paths are printed; one that is up to date is not touched.

Example: {} geometry_msgs/Pose -o msg
"""


class CannotGenerate(Error):
    """What was asked for cannot be written; nothing was."""


def tracked_names(types: Sequence[str], name: Optional[str] = None) -> Dict[str, str]:
    """What the tracked types of several message types are called.

    Args:
        types: distinct message types.
        name: the tracked type's name, without `.msg`, where there is one type only.

    Returns:
        {tracked type's name: message type}; names that clash carry their package's in front.

    Raises:
        CannotGenerate: `name` does not fit, or no names that differ exist.
    """
    if name is not None:
        if len(types) != 1:
            raise CannotGenerate('--name needs exactly one message type, found %d' % len(types))
        if not re.match(r'[A-Za-z][A-Za-z0-9_]*\Z', name):
            raise CannotGenerate('%r is not the name of a message: it must be letters, digits and _' % name)
        return {name: types[0]}
    shorts = [short_name(each) for each in types]
    names: Dict[str, str] = {}
    for each, short in zip(types, shorts):
        chosen = short if shorts.count(short) == 1 else long_name(each)
        if chosen in names:
            raise CannotGenerate(
                '%s and %s would both become %s: generate one of them apart, with --name'
                % (names[chosen], each, chosen)
            )
        names[chosen] = each
    return names


def select_types(path: MessagePath, types: Sequence[str], packages: Sequence[str], everything: bool) -> List[str]:
    """The message types to make tracked types of, each checked to be there and right.

    Args:
        path: where definitions lie.
        types: named by the caller.
        packages: take all of these packages that are not tracked types themselves.
        everything: take all that can be read; those that cannot (the share of a ROS 2 package) are named on stderr.

    Raises:
        UnknownType: one is not found or cannot be read.
        CannotGenerate: a named one is a tracked type already.
    """
    selected = []
    for name in types:
        inner = data_type(path.read(name))
        if inner:
            raise CannotGenerate('%s is already a tracked type, of %s' % (name, inner))
        selected.append(name)
    for package in packages:
        selected += [name for name in path.types(package) if not data_type(path.read(name))]
    if everything:
        for package in path.packages():
            try:
                found = path.types(package)
            except UnknownType:
                continue  # a folder msg without messages
            for name in found:
                try:
                    if not data_type(path.read(name)):
                        selected.append(name)
                except UnknownType as error:
                    print('skipped: %s' % error, file=sys.stderr)
    return list(dict.fromkeys(selected))


class File(NamedTuple):
    """A file to write."""

    path: str
    text: str
    present: Optional[str]
    """What is in it now; None if there is none."""


def plan(folder: str, names: Dict[str, str]) -> List[File]:
    """The files to write.

    Raises:
        CannotGenerate: one lies there that was not generated, or was for another message type.
    """
    files = []
    for name, source in names.items():
        path = os.path.join(folder, name + '.msg')
        present = None
        if os.path.lexists(path):
            try:
                with open(path, encoding='utf-8') as file:
                    present = file.read()
            except (OSError, UnicodeDecodeError) as error:
                raise CannotGenerate('will not overwrite %s: %s' % (path, error)) from error
            if not present.startswith(MARK):
                raise CannotGenerate(
                    'will not overwrite %s: it was not generated. Choose another folder with -o '
                    'or another name with --name' % path
                )
            if data_type(present) != source:
                raise CannotGenerate(
                    'will not overwrite %s: it was generated for %s, not for %s. Remove it, or '
                    'choose another name with --name' % (path, data_type(present), source)
                )
        files.append(File(path, definition_of_tracked(source), present))
    return files


def write(files: Sequence[File]) -> None:
    """Write the files that are missing or out of date, all of them or, if one cannot be, none.

    Raises:
        CannotGenerate: the folder cannot be written to.
    """
    written: List[File] = []
    try:
        for file in files:
            if file.present != file.text:
                os.makedirs(os.path.dirname(file.path) or '.', exist_ok=True)
                _replace(file.path, file.text)
                written.append(file)
    except OSError as error:
        for file in written:
            if file.present is None:
                os.remove(file.path)
            else:
                _replace(file.path, file.present)
        raise CannotGenerate('cannot write %s: %s' % (error.filename or 'the files', error.strerror)) from error


def _replace(path: str, text: str) -> None:
    """Write a file so that nobody sees a part of it."""
    handle, temporary = tempfile.mkstemp(prefix='.tracked', dir=os.path.dirname(path) or '.')
    try:
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError:
        os.remove(temporary)
        raise


def _include(argument: str) -> Tuple[str, str]:
    package, colon, folder = argument.partition(':')
    if not (package and colon and folder):
        raise argparse.ArgumentTypeError('%r is not PACKAGE:FOLDER' % argument)
    return package, folder


def _parser(program: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=program,
        epilog=_EPILOG.format(program),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description='Write the .msg files of tracked message types.',
    )
    parser.add_argument('types', nargs='*', metavar='TYPE', help='a message type, as geometry_msgs/Pose')
    parser.add_argument('--package', action='append', default=[], help='all message types of this package')
    parser.add_argument('--all', action='store_true', help='all message types that are installed or in a workspace')
    parser.add_argument('-o', dest='folder', default='.', metavar='DIR', help='where to write (default: here)')
    parser.add_argument('--name', help='what the tracked type is called, if there is one (default: <Type>Tracked)')
    parser.add_argument(
        '-I',
        dest='include',
        action='append',
        default=[],
        type=_include,
        metavar='PACKAGE:FOLDER',
        help='look for the messages of PACKAGE in FOLDER first',
    )
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument('--list', action='store_true', help='print the message types that are meant; write nothing')
    mode.add_argument('--dry-run', action='store_true', help='print the files that would be written; write nothing')
    return parser


def main(arguments: Optional[Sequence[str]] = None, program: str = 'generate_tracked_msgs.py') -> int:
    """Run the command.

    Args:
        arguments: those of this process where they are None.
        program: what it was called as.

    Returns:
        The exit code: 1 where something could not be done, 2 where it was not understood.
    """
    parser = _parser(program)
    options = parser.parse_args(arguments)
    if not (options.types or options.package or options.all):
        parser.error('name message types, a --package, or --all')
    include: Dict[str, List[str]] = {}
    for package, folder in options.include:
        include.setdefault(package, []).append(folder)
    try:
        types = select_types(MessagePath(include), options.types, options.package, options.all)
        if options.list:
            print('\n'.join(types))
            return 0
        files = plan(options.folder, tracked_names(types, options.name))
        if not options.dry_run:
            write(files)
    except Error as error:
        print('generate_tracked_msgs.py: %s' % error, file=sys.stderr)
        return 1
    for file in files:
        print(file.path)
    return 0
