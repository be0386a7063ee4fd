"""`rosslt explain`: where a field of a topic comes from."""

import argparse
from typing import Dict, List, Tuple

import rosgraph

from rosslt import values
from rosslt.cli import field_reading, learned
from rosslt.cli.failure import Failure
from rosslt.cli.fields import field_of, source_values
from rosslt.cli.master import find_master, system_state
from rosslt.cli.output import is_terminal, limits, table, write_note, write_result, write_row
from rosslt.cli.reading import heard_publishers, listener
from rosslt.cli.rendering import text_of
from rosslt.cli.verb import LOOK
from rosslt.messages import Scalar
from rosslt.node import Directory, Heard, age_text

GROUP = LOOK
SUMMARY = 'where a field of a topic comes from: the expression, and each location in it'
DESCRIPTION = """Print where a field of the next message of a topic comes from: the expression that made it, and each
location in that with its value, its bounds and its file. Of several nodes that publish the topic, each is explained.

Of a node that is not tracked, print what `rosslt learn` has found: the inputs that move the field, the largest effect
first, and where those come from. It is marked as learned, and not shown if the node has changed since.

With --frame, it is about a link of a robot, where its JointState and robot_description say it is: FIELD is then one of
position/x, y and z, orientation/roll, pitch and yaw, or left out for all of them."""
EXAMPLE = """\
examples:
  rosslt explain /target/pose/position/x
  rosslt explain --bag run.bag /target/pose/position
  rosslt explain --frame gripper position/z

In a pipe each location of each field is a line of columns between tabs: field, value, expression, NODE/LOCATION, its
value, file:line:column (or empty). What was learned is a line for each input: field, value, `learned`, TOPIC/FIELD of
the input, kind, slope, its uncertainty, the seconds since it was learned; lines of the input's own locations follow.
"""
ARGUMENTS = field_reading.ARGUMENTS


def run(options: argparse.Namespace) -> None:
    directory = Directory()
    is_live = not (options.bag or options.frame)
    try:
        reading = field_reading.read_field(options, directory)
    except Failure as failure:
        raise Failure(f'{failure}{learned.of_silent(options.field) if is_live and options.field else ""}') from None
    try:
        for each, path, leaf in reading.tracked_leaves():
            if is_terminal():
                _show(reading.title or each.topic, each, path, leaf, directory, not options.bag)
            else:
                _write(path, leaf, directory, not options.bag)
    except field_reading.NothingTracked as failure:
        if not is_live:
            raise
        _explain_learned(reading, directory, options.timeout, failure)


def _explain_learned(
    reading: field_reading.Reading, directory: Directory, timeout: float, failure: field_reading.NothingTracked
) -> None:
    """Print what was learned of a field without sources.

    Raises:
        Failure: that, and why nothing is known, if nothing was learned of any of its publishers.
    """
    master = find_master()
    state = system_state(master)
    why_not: List[str] = []
    inputs: Dict[str, Dict[str, str]] = {}
    is_known = False
    for each in reading.heard:
        known = learned.known_of(master, each, reading.field) if each.publisher else None
        if known is None and each.publisher and each.publisher not in state.tracked_nodes:
            why_not.append(f'`rosslt learn {each.publisher}` can find out what moves it')
        elif known and known.why_not:
            why_not.append(f'learned {age_text(known.age)} ago, {known.why_not}')
        elif known:
            is_known = True
            for moved in known.leaves:
                _show_effects(each, moved, known.age)
                for one in moved.effects:
                    inputs.setdefault(one.topic, {})[one.path] = one.name
    if not is_known:
        raise Failure('; '.join([str(failure), *why_not]))
    for note in why_not:
        write_note('explain', note)
    for topic, paths in inputs.items():
        if set(state.publishers.get(topic, ())) & set(state.tracked_nodes):
            _explain_input(master, topic, paths, directory, timeout)


def _show_effects(received: Heard, moved: learned.Moved, age: float) -> None:
    if is_terminal():
        print(f'{received.topic} {moved.path} = {text_of(moved.value)}, published by {received.publisher}')
    for one in moved.effects:
        write_result(
            f'  learned {age_text(age)} ago: {one.text}',
            *(moved.path, text_of(moved.value), 'learned', one.name, one.kind, one.slope, one.uncertainty, round(age)),
        )


def _explain_input(
    master: rosgraph.Master, topic: str, paths: Dict[str, str], directory: Directory, timeout: float
) -> None:
    """Print where fields of a topic, {path: TOPIC/FIELD}, come from, if they have sources."""
    try:
        with listener(topic, is_exact=True) as stream:
            heard = heard_publishers(master, stream, topic, timeout)
        leaves = [(each, path, field_of(each.message, path)) for each in heard for path in paths]
    except Failure as failure:
        write_note('explain', str(failure))
        return
    directory.learn({source for _, _, leaf in leaves for source in values.sources(leaf)})
    for each, path, leaf in leaves:
        if not values.is_tracked(leaf):
            continue
        if is_terminal():
            _show(topic, each, path, leaf, directory, True)
        else:
            _write(paths[path], leaf, directory, True)


def _show(title: str, received: Heard, path: str, leaf: object, directory: Directory, is_live: bool) -> None:
    by = f', published by {received.publisher}' if received.publisher else ''
    print(f'{title} {path} = {text_of(leaf)}{by}')
    print('  = ' + values.explain(leaf))
    rows = []
    for source, value, present in _readings(leaf, directory, is_live):
        place = directory.of(source)
        shown = text_of(present) if present == value else f'{text_of(present)}, but {text_of(value)} in the message'
        rows.append((directory.name(source), shown, limits(place) if place else '', place.file if place else ''))
    print('\n'.join(table(rows, indent='  ')))


def _write(path: str, leaf: object, directory: Directory, is_live: bool) -> None:
    for source, _, present in _readings(leaf, directory, is_live):
        place = directory.of(source)
        file = place.file if place else ''
        write_row(path, text_of(leaf), values.explain(leaf), directory.name(source), text_of(present), file)


def _readings(leaf: object, directory: Directory, is_live: bool) -> List[Tuple[values.Source, Scalar, Scalar]]:
    """The sources of a number, its own first, each with the value that the message has of it, and the present one, as
    far as known: of a recorded message, that again."""
    found = source_values(leaf)
    places = [(source, directory.of(source)) for source in directory.own_first(found)]
    return [
        (source, found[source], place.value if is_live and place and place.location.value else found[source])
        for source, place in places
    ]
