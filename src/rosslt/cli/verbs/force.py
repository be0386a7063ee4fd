"""`rosslt force`: have a field of a topic become a value, by changing where it comes from."""

import argparse
import contextlib
import signal
import sys
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple, Union

import genpy
import rosgraph

from rosslt import node, values
from rosslt.cli.directory import sources_called
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.fields import conditions, field_of, meant_where, path_where, source_values, target, values_where
from rosslt.cli.learned_forcing import NEAR, Basis, LearnedStream, basis_of
from rosslt.cli.master import TIMEOUT, find_master, split_topic
from rosslt.cli.output import is_terminal, write_change, write_note
from rosslt.cli.reading import LINK_ARGUMENTS, Messages, heard_publishers, link_of, listener, start_node
from rosslt.cli.verb import CHANGE, Argument
from rosslt.messages import Scalar, is_reached
from rosslt.node import Directory, Heard

if TYPE_CHECKING:
    from rosslt.cli.links import Link, LinkStream

GROUP = CHANGE
SUMMARY = 'have a field of a topic become a value, by changing where it comes from'
DESCRIPTION = """Take the next message of a topic, solve for the sources of a field of it, and have their nodes change
them, so that the field of the messages to come is VALUE; then look at the next message. If the field is not VALUE,
as the node has taken another branch for instance, the new message is solved, and so on. Prints what changed, and after
how many messages it was seen. If VALUE is not reached, or at Ctrl-C, changes are taken back, and the exit code is 1.
If the node has latched its last message and sends none, its change stays, and it is said that none has shown it yet. If
several nodes publish the topic, it is about the first one by name whose messages have a source, unless --node or
--source says another.

Of a node that is not tracked and of which `rosslt learn` has found something, the learned slopes say how the field
follows the node's inputs, and the sources of these change. What the node sends then corrects the slopes. A field is
reached if each number in it lacks at most a thousandth of its change. No input leaves the range that was learned.

With --frame, it is about a link of a robot, where its JointState and robot_description say it is: position/x, y and z
in metres, orientation/roll, pitch and yaw in radians, in the link --in. The joints before it move, each within its
limits."""
EXAMPLE = """\
examples:
  rosslt force /target/pose/position/x 1.5
  rosslt force /target/pose/position "{x: 1.5, y: 0.0}" --dry-run
  rosslt force /target/pose/position/x 1.5 --source /talker/radius
  rosslt force /markers/markers/pose/position/x 1.5 --where ns=base,id=3
  rosslt force /joint_states/position 0.5 --where name=elbow
  rosslt force --frame gripper position/z 0.42
  rosslt force --frame gripper --in base_link "" "{position: {x: 0.3, z: 0.4}, orientation: {pitch: 1.57}}"

In a pipe each change is a line of columns between tabs: NODE/LOCATION, old value, new value, file:line:column; and,
if something was changed, after how many messages and milliseconds it was seen.
"""
ARGUMENTS = [
    Argument(
        'field',
        completer='fields',
        metavar='TOPIC/FIELD',
        help='as /target/pose/position/x or /path/points[3]; with --frame, as position/z',
    ),
    Argument('value', metavar='VALUE', help='a scalar; YAML for a whole part of a message'),
    Argument(
        '--source',
        completer='locations',
        action='append',
        metavar='S',
        help='change this location alone: NODE/LOCATION, NODE#ID, or FILE:LINE:COLUMN as rosslt echo says; given '
        'several times, change no others than these',
    ),
    *LINK_ARGUMENTS,
    Argument('--node', completer='nodes', metavar='NODE', help='in the messages of this node'),
    Argument(
        '--where',
        default='',
        metavar='F=V,...',
        help='of several things on the topic, the one with these fields: ns=base,id=3, or name=elbow',
    ),
    Argument('--dry-run', action='store_true', help='print what would change; change nothing'),
    Argument('--rounds', type=int, default=5, metavar='N', help='solve at most N messages (default: 5)'),
    Argument('--keep-anyway', action='store_true', help='leave the changes also if VALUE is not reached'),
    Argument('--timeout', type=float, default=5.0, metavar='S', help='seconds to wait for a message (default: 5)'),
]

_SO_ALREADY = 'nothing to change: it is so already'


def run(options: argparse.Namespace) -> None:
    if options.rounds < 1:
        raise Misused(f'--rounds must be at least 1, found {options.rounds}')
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does: what was changed is taken back
    master, directory = find_master(), Directory()
    start_node(disable_signals=True)  # a node that is shut down could not take it back
    link = link_of(master, options)
    topic, _, field = (link.topic, '', options.field) if link else split_topic(master, options.field)
    values.describe_sources_with(directory.describe)
    with contextlib.ExitStack() as stack:
        messages = stack.enter_context(listener(topic, is_exact=True))
        errors = stack.enter_context(node.NodeErrors())
        stream: Union[node.Listener, LinkStream, LearnedStream] = link.stream(messages) if link else messages
        heard = _heard(master, stream, topic, field, options.where, options.timeout, options.node)
        by: Union[Link, Basis, None] = link
        if not (link or any(values.sources(part) for _, _, part in heard.values())):
            by = basis = _basis(master, heard, topic, field, options)
            messages = stack.enter_context(listener(topic, *basis.following.topics, is_exact=True))
            stream = basis.stream(messages)
            timeout = options.timeout + basis.following.delay
            heard = _heard(master, stream, topic, field, options.where, timeout, basis.publisher)
            if not values.sources(heard[basis.publisher].part):
                raise Failure(basis.why_no_source())
        parts = {publisher: one.part for publisher, one in heard.items()}
        directory.learn({source for part in parts.values() for source in values.sources(part)})
        publisher, chosen = _chosen(directory, parts, options.source or [])
        if not values.sources(parts[publisher]):
            raise Failure(_no_source(publisher, topic, field))
        if isinstance(by, Basis):
            write_note('force', by.text)
        if len(parts) > 1:
            told = f'{" and ".join(parts)} publish {topic}; this is about the messages of {publisher}'
            print(f'rosslt force: {told}, --node takes another', file=sys.stderr)
        received, field, part = heard[publisher]
        wanted = target(received.message, field, options.value)
        if options.dry_run:
            node.check_joint_limits(received.topic, received.message, field, wanted)
            solve = by.solve if by else node.solve_by_effect
            planned = _planned(directory, received.message, part, field, wanted, chosen, solve)
            _show(directory, planned, is_planned=True)
            if all(old == new for old, new in planned.values()):
                write_note('force', _SO_ALREADY)
            return
        kind, requester = by.forcing if by else node.Forcing, node.Requester('rosslt force', directory)
        limits = options.rounds, options.timeout, options.keep_anyway
        stream.clear()
        outcome = _forced(directory, kind(requester, stream, errors, field, wanted, chosen, *limits), received)
    seen = (outcome.messages, f'{outcome.milliseconds:.0f}') if outcome.is_reached else ()
    _show(directory, outcome.changes, seen=seen)
    _report(outcome, publisher, isinstance(by, Basis))


class _Part(NamedTuple):
    """A field in a message: the message, the path in it, and what is there."""

    received: Heard
    path: str
    part: genpy.Message


def _heard(
    master: rosgraph.Master,
    stream: Messages,
    topic: str,
    field: str,
    thing: str,
    timeout: float,
    publisher: Optional[str],
) -> Dict[str, _Part]:
    """The field in a message of each publisher, or of one of them, {publisher: it}, in a thing as of --where."""
    where = conditions(thing)
    seen_where: Dict[str, Set[Scalar]] = {name: set() for name in where}

    def is_meant(received: Heard) -> bool:
        is_there = path_where(received.message, field, dict(where)) is not None
        for name, seen in seen_where.items():
            seen.update(values_where(received.message, field, name))
        return is_there

    heard = heard_publishers(
        master, stream, topic, timeout, publisher, is_meant, lambda: meant_where(where, seen_where)
    )
    paths = [path_where(received.message, field, dict(where)) or '' for received in heard]
    return {
        received.publisher: _Part(received, path, field_of(received.message, path))
        for received, path in zip(heard, paths)
    }


def _basis(
    master: rosgraph.Master, heard: Mapping[str, _Part], topic: str, field: str, options: argparse.Namespace
) -> Basis:
    """What was learned of a publisher of a field without sources.

    Raises:
        Failure: nothing by which the field could be forced.
    """
    found, why_not = basis_of(
        master,
        [one.received for one in heard.values()],
        {publisher: one.path for publisher, one in heard.items()},
        lambda received: target(received.message, heard[received.publisher].path, options.value),
    )
    if found is None:
        if options.source:
            _chosen(Directory(), {publisher: one.part for publisher, one in heard.items()}, options.source)
        raise Failure('; '.join([_no_source(next(iter(heard)), topic, field), *why_not]))
    return found


def _no_source(publisher: str, topic: str, field: str) -> str:
    whole = '/'.join(filter(None, (topic, field)))
    return f'nothing in it has a source, as {publisher} sends it; `rosslt doctor {whole}` says why'


def _forced(directory: Directory, forcing: node.Forcing, received: Heard) -> node.Outcome:
    """Force the field of a message; returns what has changed.

    Raises:
        Failure: the field has not reached its target; the changes that were kept are printed.
    """
    try:
        return forcing.run(received)
    except KeyboardInterrupt as error:
        raise Failure('; '.join(['interrupted', *map(str, error.args)])) from None
    except node.NotReached as error:
        if not error.outcome.is_taken_back:
            _show(directory, error.outcome.changes)
            sys.stdout.flush()
        raise Failure(str(error)) from None


def _show(
    directory: Directory,
    changes: Dict[values.Source, node.Change],
    is_planned: bool = False,
    seen: Sequence[object] = (),
) -> None:
    """Print changes of sources, and what takes them at the next start only."""
    for changed, (old, new) in changes.items():
        if old != new:
            write_change(directory, changed, node.to_json(old), node.to_json(new), is_planned, seen)
            place = directory.of(changed)
            if place is not None and place.location.plain_copies:
                said = f'of a change of {place.name}, {place.location.plain_copies}'
                print(f'rosslt force: {said}; what else uses it follows', file=sys.stderr)


def _report(outcome: node.Outcome, publisher: str, is_learned: bool) -> None:
    """Print how messages have shown the changes.

    Args:
        outcome: the changes.
        publisher: of the messages.
        is_learned: whether the field was forced by what was learned.
    """
    if outcome.is_near:
        print(f'rosslt force: {publisher} sends {outcome.seen}, and comes no nearer', file=sys.stderr)
    elif is_learned and outcome.is_reached and not is_reached(outcome.seen, outcome.wanted):
        print(f'rosslt force: {publisher} sends {outcome.seen}, within {NEAR:g} of the change', file=sys.stderr)
    if not outcome.rounds:
        write_note('force', _SO_ALREADY)
    if outcome.reason:
        print(f'rosslt force: {outcome.reason}', file=sys.stderr)
    if not (outcome.rounds and outcome.is_reached and is_terminal()):
        return
    messages = f'{outcome.messages} message{"s" * (outcome.messages != 1)}'
    solved = f', solved {outcome.rounds} times' if outcome.rounds > 1 else ''
    print(f'seen after {messages}, {outcome.milliseconds:.0f} ms{solved}')


def _chosen(
    directory: Directory, parts: Dict[str, object], texts: Sequence[str]
) -> Tuple[str, Optional[List[values.Source]]]:
    """Choose the publisher whose message is solved, and the sources to change if some were named.

    Args:
        directory: knows what sources are called.
        parts: {publisher: the field in its message}.
        texts: the sources' names for people.
    """
    found: Dict[values.Source, List[str]] = {}  # the publishers of each
    for text in texts:
        called = {
            source: [name for name, part in parts.items() if source in values.sources(part)]
            for part in parts.values()
            for source in sources_called(directory, values.sources(part), text)
        }
        if not called:
            sources = dict.fromkeys(source for part in parts.values() for source in values.sources(part))
            names = ', '.join(map(directory.name, sources)) or 'none'
            raise Failure(f'{text} is not among its sources, which are {names}')
        if len(called) > 1:
            raise Failure('{} is ambiguous: it may be {}'.format(text, ' or '.join(map(directory.name, called))))
        found.update(called)
    if not found:
        return next((name for name, part in parts.items() if values.sources(part)), next(iter(parts))), None
    publishers = [name for name in parts if all(name in names for names in found.values())]
    if not publishers:
        raise Failure('no message comes from all of {}'.format(' and '.join(map(directory.name, found))))
    return publishers[0], list(found)


def _planned(
    directory: Directory,
    message: genpy.Message,
    part: genpy.Message,
    field: str,
    wanted: object,
    chosen: Optional[List[values.Source]],
    solve: Callable[..., Dict[values.Source, Any]],
) -> Dict[values.Source, node.Change]:
    """{Source: Change(old, new)} as far as it is known without requesting the change."""
    thing = node.tracked_of_thing(message, field) if chosen is None else []
    shared = node.shared_in(message, field) if chosen is None else []
    directory.learn(values.sources(thing))
    limits = directory.limits(values.sources(part), TIMEOUT)
    limits['read_only'] = [*limits['read_only'], *directory.held(thing, shared)]
    new = solve(part, wanted, chosen, limits)
    old = source_values(part)
    places = {changing: directory.of(changing) for changing in new}
    old.update({changing: place.value for changing, place in places.items() if place and not place.location.fault})
    return {changing: node.Change(old[changing], value) for changing, value in new.items()}
