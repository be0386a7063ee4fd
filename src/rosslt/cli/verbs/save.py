"""`rosslt save`: changed values written back to where they were read, or into a YAML file."""

import argparse
import sys
from typing import Any, Dict, List, Optional, Sequence, Tuple

import rosgraph
import yaml

from rosslt import files, node
from rosslt.cli.directory import cannot_reach, locations_of, node_to_save
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.master import TIMEOUT, find_master
from rosslt.cli.output import write_diff, write_note, write_result, write_text
from rosslt.cli.verb import CHANGE, Argument
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'changed values where they were read: in the code, in launch and YAML files'
DESCRIPTION = """Write each changed value of a node back to where it was read: a literal in its source file; a parameter
in the YAML file, the <param> or the <arg> that `rosslt launch` has read it from. Only these values change. All files
are written, or none; what cannot be written back is named, and left. A file that was edited since is written where it
is certain which value is which.

With FILE, write the current values of all of its locations as YAML instead. `rosparam load FILE` puts them in force
again, and so does <rosparam file="FILE"/> in a launch file, before the node starts."""
EXAMPLE = """\
examples:
  rosslt save /talker --diff
  rosslt save /talker
  rosslt save /talker talker.yaml && rosparam load talker.yaml

In a pipe each value that was written is a line of columns between tabs: NODE/LOCATION, old text, new text, file.
"""
ARGUMENTS = [
    Argument('--diff', action='store_true', help='print what would be written as a unified diff, and write nothing'),
    Argument('-o', dest='output', metavar='FILE', help='write the values as YAML into FILE, whatever it is called'),
    Argument('node', completer='nodes', metavar='NODE'),
    Argument('file', nargs='?', metavar='FILE', help='a .yaml to write; - for standard output'),
]


def run(options: argparse.Namespace) -> None:
    file = options.output or options.file
    if options.diff and file:
        raise Misused('--diff is about the files that values were read from; leave FILE out')
    if options.output and options.file:
        raise Misused(f'one file is written, not both {options.output} and {options.file}')
    # A second node, say, is not a file to be written.
    if options.file not in (None, '-') and not options.file.endswith(('.yaml', '.yml')):
        raise Misused(f'{options.file} does not end in .yaml; if it is the file to write, say -o {options.file}')
    master = find_master()
    name, begin = node_to_save(master, options.node)
    if file is None:
        _save_where_it_stands(master, name, begin, options.diff)
    else:
        _write_yaml(master, name, begin, file)


def _save_where_it_stands(master: rosgraph.Master, name: str, begin: str, is_diff: bool) -> None:
    try:
        edits, unsaved = node.changes_to_save(name, TIMEOUT)
    except node.SourceUnreachable as error:
        raise cannot_reach(master, name, str(error)) from None
    edits = [one for one in edits if one.what.startswith(begin)]
    unsaved = [one for one in unsaved if one.name.startswith(begin)]
    try:
        if is_diff:
            write_diff(files.unified_diff(edits))
        else:
            files.write(edits)
            node.tell_saved(name, edits, TIMEOUT)
    except files.FileError as error:
        raise Failure(f'nothing is written: {error}') from None
    if not is_diff:
        for edit in edits:
            called, old, new = f'{name}/{edit.what}', edit.old.decode(), edit.new.decode()
            write_result(f'{called}: {old} -> {new}  [{edit.file}]', called, old, new, edit.file)
    if not edits and not unsaved:
        differing = node.differing_in(name, TIMEOUT)
        all_is = f', but {differing}' if differing else ': all is as the files say'
        write_note('save', f'nothing to save{all_is}')
    if unsaved:
        raise Failure('not saved: ' + '; '.join(f'{one.name} ({one.reason})' for one in unsaved))


def _write_yaml(master: rosgraph.Master, name: str, begin: str, file: str) -> None:
    parameters = master.getParam('/')
    saved: Dict[str, Any] = {}
    left_out: List[str] = []
    for place in (one for one in locations_of(master, Directory(), name) if one.location.name.startswith(begin)):
        # a literal's location is the parameter below the node's name
        location = place.location.name
        path = (location if location.startswith('/') else f'{name}/rosslt/{location}').strip('/').split('/')
        found = None if place.location.fault else _parameter_at(parameters, path)
        if found is None:
            left_out.append(place.local_name)
            continue
        (*steps, last), value = found
        below = saved
        for step in steps:
            below = below.setdefault(step, {})
        below[last] = value
    text = yaml.safe_dump(saved, default_flow_style=False, allow_unicode=True) if saved else ''
    write_text(file, text)
    if left_out:
        print('rosslt save: not saved, as no parameter stands behind them: ' + ', '.join(left_out), file=sys.stderr)


def _parameter_at(parameters: object, path: Sequence[str]) -> Optional[Tuple[Sequence[str], Any]]:
    """The name and the value of the parameter that a value at a path is in; None if there is none.

    Args:
        parameters: the tree of all parameters.
        path: the steps of a parameter's name, and then indices if the value is in a list.
    """
    for count, step in enumerate(path, 1):
        if not isinstance(parameters, dict) or step not in parameters:
            return None
        parameters = parameters[step]
        if not isinstance(parameters, dict):
            return path[:count], parameters
    return None
