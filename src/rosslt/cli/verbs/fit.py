"""`rosslt fit`: find the source values that bring recorded fields nearest to what was measured."""

import argparse
import bisect
import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import rosbag
import rosgraph

from rosslt import files, node, values
from rosslt.cli import bags
from rosslt.cli.directory import cannot_reach, sources_called
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.fields import field_of
from rosslt.cli.master import TIMEOUT, find_master
from rosslt.cli.output import is_terminal, table, write_note, write_row
from rosslt.cli.reading import start_node
from rosslt.cli.verb import CHANGE, Argument
from rosslt.messages import Message
from rosslt.node import Directory

GROUP = CHANGE
SUMMARY = 'find the source values that bring recorded fields nearest to what was measured'
DESCRIPTION = """Find the values of the locations that the fields of a bag come from with which the fields would have
been as near as possible to others of the bag, by least squares; print the old and the new value of each, and its
standard error. Locations that the bag does not determine stay as they are, and are named together with those that
they move with. Messages are paired by their stamps. --apply changes the nodes that run now, --save also writes the
values back to where they were read."""
EXAMPLE = """\
examples:
  rosslt fit run.bag /odom/pose/pose/position/x --to /truth/pose/pose/position/x
  rosslt fit run.bag /odom/pose/x /odom/pose/y --to /truth/pose/x /truth/pose/y --loss cauchy --scale 0.1 --apply

In a pipe each location is a line of columns between tabs: NODE/LOCATION, old value, new value, standard error.
"""
ARGUMENTS = [
    Argument('file', metavar='BAG'),
    Argument('fields', nargs='+', metavar='TOPIC/FIELD', help='tracked fields of numbers'),
    Argument('--to', nargs='+', required=True, metavar='TOPIC/FIELD', help='as many: what they should have been'),
    Argument('--source', action='append', metavar='S', help='fit this location alone; may be given several times'),
    Argument(
        '--loss', choices=['linear', 'soft_l1', 'huber', 'cauchy', 'arctan'], default='linear', help='as of SciPy'
    ),
    Argument(
        '--scale', type=float, default=1.0, metavar='D', help='differences beyond D count less, with a robust loss'
    ),
    Argument('--slack', type=float, default=0.01, metavar='S', help='seconds between paired stamps (default: 0.01)'),
    Argument('--apply', action='store_true', help='change the nodes that run now'),
    Argument('--save', action='store_true', help='change them, and write the values to where they were read'),
]


def run(options: argparse.Namespace) -> None:
    if len(options.fields) != len(options.to):
        raise Failure(f'found {len(options.fields)} fields and {len(options.to)} after --to: give as many of each')
    if not 0 < options.scale < math.inf:
        raise Misused(f'--scale must be finite and above 0, found {options.scale:g}')
    master = find_master() if options.apply or options.save else None
    directory = Directory()
    with bags.opened(options.file) as bag:
        bags.take_names(bag, directory)
        found = _pairs(bag, options.fields, options.to, options.slack)
    for field, paired in zip(options.fields, found):
        if not paired:
            raise Failure(f'no stamp of {field} is within {options.slack:g} s of one that it is compared with')
    results = [pair.result for paired in found for pair in paired]
    targets = [pair.target for paired in found for pair in paired]
    sources = values.sources(results)
    directory.learn(sources)
    limits = directory.limits(sources, TIMEOUT)

    def fit(chosen: Optional[List[values.Source]]) -> values.Fit:
        try:
            return values.fit(
                results,
                targets,
                chosen,
                options.loss,
                scale=options.scale,
                bounds=limits['bounds'],
                read_only=limits['read_only'],
            )
        except (values.Error, ValueError, ArithmeticError) as error:
            raise Failure(str(error)) from None

    fitted = fit(_chosen(directory, sources, options.source))
    undetermined = fitted.undetermined
    open_ones = {source for direction in undetermined for source in direction}
    told = [_together(directory, direction) for direction in undetermined]
    if open_ones:
        chosen = [source for source in fitted.values if source not in open_ones]
        if not chosen:
            raise Failure(f'{options.file} determines none of these locations. ' + ' '.join(told))
        fitted = fit(chosen)
    _show(directory, fitted)
    for sentence in told:
        write_note('fit', sentence)
    if master is not None:
        _apply(directory, fitted)
        if options.save:
            _save(master, sorted({source.node for source in fitted.values}))


def _chosen(
    directory: Directory, sources: Sequence[values.Source], names: Optional[Sequence[str]]
) -> Optional[List[values.Source]]:
    if not names:
        return None
    chosen = []
    for name in names:
        found = sources_called(directory, sources, name)
        if not found:
            every = ', '.join(sorted(map(directory.name, sources))) or 'none'
            raise Failure(f'{name} is not among the sources of the fields, which are {every}')
        chosen.append(found[0])
    return chosen


def _together(directory: Directory, direction: Dict[values.Source, float]) -> str:
    """Say which locations a bag does not determine, and what to do."""
    if len(direction) == 1:
        (name,) = map(directory.name, direction)
        return f'{name} is not determined, and stays: it moves none of these fields; record more, where it does.'
    names = [directory.name(source) for source in direction]
    moves = ', '.join(f'{directory.name(source)} by {share:+.3g}' for source, share in direction.items())
    return (
        f'{", ".join(names[:-1])} and {names[-1]} are not determined, and stay: they can move together, {moves}, '
        'and the fields stay as they are. Record another movement, in which they differ, or say with --source which to '
        'fit.'
    )


def _show(directory: Directory, fitted: values.Fit) -> None:
    rows = [
        (directory.name(source), repr(fitted.old[source]), repr(new), repr(fitted.errors[source]))
        for source, new in fitted.values.items()
    ]
    if not is_terminal():
        for row in rows:
            write_row(*row)
        return
    short = [
        (name, f'{fitted.old[source]:.6g}', '->', f'{new:.6g}', '+-', f'{fitted.errors[source]:.2g}')
        for (name, *_), (source, new) in zip(rows, fitted.values.items())
    ]
    for line in table(short):
        print(line)
    print(f'{fitted.compared} pairs; their differences have been {fitted.before:.4g}, and would be {fitted.after:.4g}')
    if not fitted.is_converged:
        print('the search has not come to an end: the values may not be the best ones')
    if fitted.is_linearized:
        print('approximate: an expression is linearized; apply, record again, and fit once more')


def _apply(directory: Directory, fitted: values.Fit) -> None:
    """Change the nodes that run now.

    Raises:
        Failure: a node refuses, or does not answer.
    """
    start_node()
    try:
        node.request_values(fitted.values, TIMEOUT, asker=node.Requester('rosslt fit', directory))
    except values.Error as error:
        raise Failure(str(error)) from None


def _save(master: rosgraph.Master, nodes: Sequence[str]) -> None:
    """Write the changed values of nodes back to where they were read.

    Raises:
        Failure: one cannot be written back.
    """
    edits: List[files.Edit] = []
    left: Dict[str, str] = {}
    for name in nodes:
        try:
            found, unsaved = node.changes_to_save(name, TIMEOUT)
        except node.SourceUnreachable as error:
            raise cannot_reach(master, name, str(error)) from None
        edits += [edit._replace(what=f'{name}/{edit.what}') for edit in found]
        left.update((f'{name}/{one.name}', one.reason) for one in unsaved)
    try:
        files.write(edits)
    except files.FileError as error:
        raise Failure(f'nothing is written: {error}') from None
    for name in nodes:
        node.tell_saved(name, edits, TIMEOUT)
    if left:
        raise Failure('not written: ' + '; '.join(f'{name}: {reason}' for name, reason in left.items()))


#: Stamps, in seconds, and what belongs to each: messages, or numbers.
_Series = Tuple[List[float], List[Message]]


class _Pair(NamedTuple):
    """A tracked field's value and the target value for it."""

    result: Message
    target: Message


def _pairs(bag: rosbag.Bag, fields: Sequence[str], references: Sequence[str], slack: float) -> List[List[_Pair]]:
    """The values of fields beside those of their references.

    A message is paired with the one of the reference's topic whose stamp is nearest: the stamp in its header, if it
    has one, else the time at which it was recorded.

    Args:
        bag: open.
        fields, references: as many TOPIC/FIELD each.
        slack: the largest difference of two stamps, in seconds.

    Returns:
        For each field its Pairs, in the order of the messages.

    Raises:
        Failure: there is no such topic or field, or it holds no number.
    """
    read: Dict[str, _Series] = {}

    def series(text: str) -> _Series:
        topic, field = bags.split_topic(bag, text)
        if topic not in read:
            read[topic] = _stamped(bag, topic)
        stamps, found = read[topic]
        return stamps, [_number(field_of(message, field), text) for message in found]

    return [_paired(series(field), series(reference), slack) for field, reference in zip(fields, references)]


def _stamped(bag: rosbag.Bag, topic: str) -> _Series:
    """The stamps of the messages of a topic, and the messages, by stamp; without those between whole ones."""
    decoder, found = bags.Decoder(), []
    for name, raw, recorded, header in bags.serialized(bag, [topic]):
        received = decoder.decode(name, raw, header)
        if received.is_sampled:
            continue
        message = received.message
        stamp = message.header.stamp if getattr(raw[-1], '_has_header', False) else None
        found.append(((stamp or recorded).to_sec(), message))
    found.sort(key=lambda one: one[0])
    return [stamp for stamp, _ in found], [message for _, message in found]


def _number(value: Message, text: str) -> Message:
    plain = values.untracked(value)
    if isinstance(plain, bool) or not isinstance(plain, (int, float)):
        kind = getattr(plain, '_type', type(plain).__name__)
        raise Failure(f'{text} is of type {kind}, and not a number: name a field of numbers')
    return value


def _paired(results: _Series, targets: _Series, slack: float) -> List[_Pair]:
    stamps, wanted = targets
    found = []
    for stamp, result in zip(*results):
        place = bisect.bisect_left(stamps, stamp)
        near = min(
            (each for each in (place - 1, place) if 0 <= each < len(stamps)),
            key=lambda each: abs(stamps[each] - stamp),
            default=None,
        )
        if near is not None and abs(stamps[near] - stamp) <= slack:
            found.append(_Pair(result, values.untracked(wanted[near])))
    return found
