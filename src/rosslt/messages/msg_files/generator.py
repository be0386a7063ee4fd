"""The generator: writes the `.msg` files of tracked message types (paper, section IV: provenance-annotated messages).

Its command is `rosslt generate`, alias `scripts/generate_tracked_msgs.py`, which `add_tracked_message_files()` calls in
the build of a package. It runs before anything of the package is built.
"""

import os
import re
import sys
import tempfile
from typing import Dict, List, NamedTuple, Optional, Sequence

from rosslt.messages.errors import UnknownType
from rosslt.messages.msg_files.definitions import (
    MARK,
    MessagePath,
    data_type,
    definition_of_tracked,
    long_name,
    short_name,
)
from rosslt.values import Error


class CannotGenerate(Error):
    """The files cannot be written; none was changed."""


def tracked_names(types: Sequence[str], name: Optional[str] = None) -> Dict[str, str]:
    """Choose the names of the tracked types of several message types.

    Args:
        types: distinct message types.
        name: the tracked type's name, without `.msg`, if there is one type only.

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
    """The present content; None if the file does not exist."""


def plan_files(folder: str, names: Dict[str, str]) -> List[File]:
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


def write_files(files: Sequence[File]) -> None:
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
