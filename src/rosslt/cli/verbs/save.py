"""`rosslt save`: a node's current values as YAML that rosparam load takes."""

import argparse
import contextlib
import sys
from typing import Any, Dict, List, Sequence, Union

import yaml

from rosslt.cli.completers import nodes
from rosslt.cli.directory import Directory, locations_of, tracked_node
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = "a node's current values as YAML that rosparam load takes"
DESCRIPTION = """Write the current values of a node's locations as YAML. `rosparam load FILE` puts them in force again,
and so does <rosparam file="FILE"/> in a launch file, before the node starts."""
EXAMPLE = """\
example:
  rosslt save /talker talker.yaml && rosparam load talker.yaml
"""
ARGUMENTS = [
    Argument('node', completer=nodes, metavar='NODE'),
    Argument('file', metavar='FILE', help='- for standard output'),
]


def run(options: argparse.Namespace) -> None:
    master = find_master()
    name = tracked_node(master, options.node)
    parameters = master.getParam('/')
    saved: Dict[str, Any] = {}
    left_out: List[str] = []
    for place in locations_of(master, Directory(), name):
        # a literal's location is the parameter below the node's name
        location = place.location.name
        path = (location if location.startswith('/') else f'{name}/rosslt/{location}').strip('/').split('/')
        if not _put(parameters, saved, path, place.value):
            left_out.append(place.local_name)
    text = yaml.safe_dump(saved, default_flow_style=False, allow_unicode=True) if saved else ''
    try:
        with (
            contextlib.nullcontext(sys.stdout) if options.file == '-' else open(options.file, 'w', encoding='utf-8')
        ) as file:
            file.write(text)
    except OSError as error:
        raise Failure(f'cannot write {options.file}: {error.strerror}') from None
    if left_out:
        print('rosslt save: not saved, as no parameter stands behind them: ' + ', '.join(left_out), file=sys.stderr)


def _put(parameters: Any, saved: Any, path: Sequence[str], value: Any) -> bool:
    """Take one value into what is saved: in the place that it has among the parameters.

    Args:
        parameters: the tree of all parameters, whose lists are taken over whole, with the value in them.
        saved: the tree so far.
        path: the steps of the parameter's name; an index where it is in a list.

    Returns:
        Whether there is such a parameter.
    """
    step: Union[str, int, None] = path[0]
    rest = path[1:]
    if isinstance(parameters, list):
        step = int(path[0]) if path[0].isdigit() and int(path[0]) < len(parameters) else None
    elif not isinstance(parameters, dict) or step not in parameters:
        step = None
    if step is None:
        return False
    if not rest:
        if isinstance(parameters[step], dict):
            return False
        saved[step] = value
        return True
    below = parameters[step]
    if isinstance(saved, dict) and step not in saved:
        fresh = below if isinstance(below, list) else {}
        if not _put(below, fresh, rest, value):
            return False
        saved[step] = fresh
        return True
    return _put(below, saved[step], rest, value)
