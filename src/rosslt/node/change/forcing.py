"""Forcing a field of a topic: a change is believed when a message shows it, and else it is said what came instead."""

import dataclasses
import time
from typing import Any, Collection, Dict, Iterable, List, Mapping, NamedTuple, Optional, Protocol, Sequence, Tuple

import rospy

from rosslt import messages, values
from rosslt.node.api import started
from rosslt.node.change.change_request import ChangeRequest, is_equal
from rosslt.node.change.client import Asker, Change, ChangeRejected, SourceUnreachable, solved
from rosslt.node.change.closed_loop import LOOK, ClosedLoop
from rosslt.node.change.effects import effects_of, moved, solve_by_effect
from rosslt.node.change.node_errors import NodeErrors
from rosslt.node.change.observation import MOST_NAMED, Observation, comes_from, is_alike, observe
from rosslt.node.locations.uses import shared_in, tracked_of_thing
from rosslt.node.robot_description import check_joint_limits
from rosslt.node.topics.listening import Heard, Listener
from rosslt.values import Source

#: The timeout of owners' answers, in seconds.
OWNER_TIMEOUT = 2.0

#: The period of checking, while no message comes, whether a callback of the node has raised, in seconds.
ERROR_PERIOD = 0.1

#: Fields that say what a message is about, if a node sends several things on one topic.
NAMES = {'ns', 'id', 'name', 'frame_id', 'child_frame_id', 'joint_names'}

#: The end of the path of a goal's id in a message of an action: each goal has its own, also when sent again.
OF_GOALS = 'goal_id.id'

#: The longest value or expression in an error, in characters.
LONGEST = 160


class Outcome(NamedTuple):
    """The result of forcing a field: what has changed, and what was seen then.

    Attributes:
        changes: {Source: Change(old, new)}: before the first round, and after the last one.
        wanted: the target.
        seen: the field in the last message that was looked at, plain; None if none came.
        is_reached: whether messages have the wanted value, to a relative 1e-6 if they come no nearer; False as well if
            the change is in force and none came, as the last message is latched.
        rounds: how many times it was solved.
        messages: how many messages of the publisher came after the first change, up to the one that was seen.
        milliseconds: from the first request to that message.
        reason: why it was not reached, as far as known; if it was, what still holds former results, or ''.
        is_taken_back: whether all changes have been taken back.
        is_near: whether messages have the wanted value to a relative 1e-6 only, and come no nearer.
    """

    changes: Dict[Source, Change]
    wanted: Any
    seen: Any
    is_reached: bool
    rounds: int = 0
    messages: int = 0
    milliseconds: float = 0.0
    reason: str = ''
    is_taken_back: bool = False
    is_near: bool = False


class NotReached(values.Error):
    """A field has not reached its target, although its sources have changed.

    Attributes:
        outcome: the Outcome: what was changed, what came instead, and why.
    """

    __module__ = 'rosslt'

    def __init__(self, message: str, outcome: Outcome) -> None:
        super().__init__(message)
        self.outcome = outcome


def thing_of(message: messages.Message, path: str) -> Tuple[Any, ...]:
    """The thing that a message is about, if nodes send several on one topic: what its names are.

    Args:
        path: the field in question, whose own text is not part of the thing.
    """
    own = path.strip('/').replace('/', '.')
    return tuple(
        leaf
        for where, leaf in values.leaves(message)
        if where.rpartition('.')[2].partition('[')[0] in NAMES
        and not where.endswith(OF_GOALS)
        and where != own
        and not values.is_tracked(leaf)
    )


def force_field(
    topic: str,
    field: str,
    target: object,
    source: Optional[values.Source] = None,
    sources: Optional[Sequence[values.Source]] = None,
    rounds: int = 5,
    timeout: float = 5.0,
    keep_anyway: bool = False,
) -> Outcome:
    """Bring a field of a topic to a target, and check in messages that it is there.

    Looks at two messages, solves for the later one, has the owners change its sources, and looks at the messages that
    the same publisher sends then. If the field is not as wanted, because the node takes another branch for instance,
    the new message's expression is solved, until the field is as wanted (to a relative 1e-9) or comes no nearer (then a
    relative 1e-6 is enough). A field that changes by itself, such as a controller's command, is refused: it would have
    the target for a moment only. One that changes by less than 1e-6 of its way to the target stands still.

    Args:
        topic: as in `rospy.Subscriber`. Of several publishers, the first one whose message has a source is taken.
        field: `pose/position/x`, `points[3].x`; '' for the whole message.
        target: plain, of the field's shape, in its unit; in a message or array None leaves a part free.
        source: change this Source alone; by default, for a number, the one that moves it most for its size, of those
            that can, and of what `Directory.held` leaves.
        sources: change no other than these.
        rounds: how many times it is solved at most.
        timeout: how long to wait for the first message, and for each message that shows a change, in seconds.
        keep_anyway: leave the changes if the target is not reached; otherwise they are taken back.

    Returns:
        The Outcome: what has changed, what was seen, and after how many messages and milliseconds. If the publisher has
        latched its last message, and sends none although it has the change in force, `is_reached` is False and the
        change stays: the node sends the next message when it makes one.

    Raises:
        NotTracked, NotInvertible: there is no answer to begin with, or none but by what takes effect at the next start
            only (unless `keep_anyway`), the field changes by itself, or a joint would go beyond its limits in
            `robot_description`; nothing was requested.
        ChangeRejected, SourceUnreachable: as in `force_value`.
        NotReached: the sources have changed, but no message shows the target; the error says what came instead, and
            why as far as it is known, and has the Outcome.
        ValueError: the topic's messages have no such field, it cannot hold the target (400 in a `uint8`), or both
            `source` and `sources` were given.
        rospy.ROSException: nobody publishes the topic, no message came in time, or `init_node` has not been called.
    """
    if source is not None and sources is not None:
        raise ValueError('give either source or sources')
    owner = started('force_field')
    with Listener(rospy.resolve_name(topic), is_exact=True) as stream, NodeErrors() as errors:
        heard = stream.first(field, timeout)
        chosen = sources if source is None else [source]
        return Forcing(owner, stream, errors, field, target, chosen, rounds, timeout, keep_anyway).run(heard)


class Stream(Protocol):
    """Messages as they come, as a Listener has them."""

    def next_before(self, end: float) -> Optional[Heard]: ...

    def clear(self) -> None: ...


@dataclasses.dataclass
class Forcing:
    """Solves for a field, changes its sources, and looks at the next messages, until the field is as wanted.

    Attributes:
        asker: who asks for changes.
        stream: the messages of the topic from now on.
        errors: those of nodes, heard since before the first message.
        path: of the field in the message.
        wanted: plain, of the field's shape; None leaves a part free.
        sources: change no other than these.
        rounds: how many times it is solved at most.
        timeout: how long to wait for a message that shows a change, in seconds.
        keep_anyway: leave the changes if the target is not reached.
        expected_by: what says how the field is computed.
    """

    expected_by = 'its provenance'  # of the class: no annotation makes it a field

    asker: Asker
    stream: Stream
    errors: NodeErrors
    path: str
    wanted: Any
    sources: Optional[Collection[Source]] = None
    rounds: int = 5
    timeout: float = 5.0
    keep_anyway: bool = False

    def run(self, heard: Heard) -> Outcome:
        """Begin with a message.

        Raises:
            values.NotTracked, values.NotInvertible: as in `force_field`; nothing was requested.
            ChangeRejected, SourceUnreachable: as in `force_value`, in the first round.
            NotReached: no message has the wanted value.
            ValueError: the message has no such field, or that cannot hold what is wanted.
        """
        if self.rounds < 1:
            raise ValueError(f'rounds must be at least 1, found {self.rounds}')
        self._begin([heard])
        self._thing = thing_of(heard.message, self.path)
        first = self._observed(heard.message)
        if first is None:
            raise ValueError(f'the message has no field {self.path}')
        self._of_thing = tracked_of_thing(heard.message, self.path) if self.sources is None else []
        self._shared = shared_in(heard.message, self.path) if self.sources is None else []
        messages.check_range(*messages.part_at(heard.message, self.path), self.wanted)
        check_joint_limits(heard.topic, heard.message, self.path, self.wanted)
        if first.is_reached:
            return Outcome({}, self.wanted, values.untracked(first.part), True)
        before = None if heard.is_latched else self._next_like(first)
        if before is not None and not is_alike(first, before):
            raise values.NotInvertible(self._why_moving(first, before))
        return self._follow(first, before or first)

    def _begin(self, heard: Sequence[Heard]) -> None:
        """Begin a request with the first messages of publishers."""
        self._publishers = list(dict.fromkeys(one.publisher for one in heard))
        self._is_latched = any(one.is_latched for one in heard)
        self._request = ChangeRequest(OWNER_TIMEOUT, self.asker)
        self._messages = 0
        self._is_as_asked = True  # whether owners have given sources what was asked for
        self._notes: List[str] = []  # what else explains that it was not reached

    def _follow(self, first: Observation, before: Observation) -> Outcome:
        """Solve for the later of two observations before the change, and look at the messages after it."""
        self._before = before
        self._loop = loop = ClosedLoop(self._request, self._change, self.rounds, self.timeout)
        try:
            loop.solve(before)
            if self.sources is None:
                self.sources = first.expression.sources  # later rounds change no others
            self._look()
            is_reached = loop.is_reached and self._is_kept()
        except BaseException as error:  # an interrupt among them
            why = '' if self.keep_anyway else self._request.take_back()
            if why:
                error.args = ('; '.join(filter(None, [str(error), f'the change could not be taken back: {why}'])),)
            raise
        if is_reached:
            return self._outcome(is_reached=True, reason=self._request.outdated())
        if self._is_latched and self._is_awaited():
            names = ' and '.join(map(self._name, self._request.after))
            return self._outcome(
                False,
                f'not seen: {self._publisher} has latched a message that it made before the change, and has not sent '
                f'it again; the change is in force, and shows in the next message that is made of {names}',
            )
        if loop.last is None and not self._notes:
            self._notes.append(self._why_silent() if loop.rounds else 'its sources have the values that should do it')
        raise self._not_reached()

    def _look(self) -> None:
        """Look at the messages after a change, until they have shown what has come of it."""
        loop = self._loop
        while not loop.is_over:
            latest = self.stream.next_before(min(loop.end, time.monotonic() + ERROR_PERIOD))
            error = self._why_raised()
            if error:
                self._notes.append(error)
                break
            if time.monotonic() >= loop.end:
                loop.pass_time()
            elif latest is not None:
                self._take(latest)

    def _why_moving(self, first: Observation, later: Observation) -> str:
        """Say that the field changes by itself, and which numbers move it."""
        limits = self.asker.directory.limits(values.sources(later.part), OWNER_TIMEOUT)
        effects = effects_of(moved(later.part, self.wanted)[0], limits)
        movable = [source for source, effect in effects.items() if effect and source not in limits['read_only']]
        most = sorted(movable, key=lambda source: -effects[source])[:MOST_NAMED]
        told = (
            f'it changes by itself: {self._differing(first.part, later.part)} became '
            f'{self._differing(later.part, first.part)} in the next message, '
            'and a target would hold for a moment only; nothing was changed'
        )
        if most:
            told += '; it is moved most by ' + ', '.join(map(self._name, most))
        return '; '.join([told, *self._late(effects).values()])

    def _late(self, sources: Iterable[Source]) -> Dict[Source, str]:
        """Say of the sources whose change takes effect at the next start only that it does."""
        why = {source: self.asker.directory.at_next_start(source) for source in sources}
        return {source: f'a change of {self._name(source)} {late}' for source, late in why.items() if late}

    @property
    def _publisher(self) -> str:
        return ' and '.join(self._publishers)

    def _take(self, heard: Heard) -> None:
        if self._is_of_thing(heard):
            self._messages += 1
            self._loop.take(self._observed(heard.message))

    def _is_of_thing(self, heard: Heard) -> bool:
        return [heard.publisher] == self._publishers and thing_of(heard.message, self.path) == self._thing

    def _next_like(self, first: Observation) -> Optional[Observation]:
        """The next message of the thing with the same sources, which tells whether it moves by itself; None if none
        comes within LOOK."""
        end = time.monotonic() + LOOK
        while time.monotonic() < end:
            heard = self.stream.next_before(end)
            observation = self._observed(heard.message) if heard is not None and self._is_of_thing(heard) else None
            if observation is not None and set(observation.expression.sources) == set(first.expression.sources):
                return observation
        return None

    def _change(self, observation: Observation) -> bool:
        """Give the sources the values that an observation needs; False if they have them already."""
        part, present = observation.part, observation.expression.readings
        try:
            answer = self._answer(part)
            new = {source: value for source, value in answer.items() if not is_equal(present[source][-1], value)}
            if not new:
                return False
            late = self._late(new)
            if late and not self.keep_anyway:
                raise values.NotInvertible(
                    '; '.join([*late.values(), 'no message would show it, so it was not asked for'])
                )
            self.stream.clear()
            changed = self._request.step(new)
        except (values.NotInvertible, values.NotTracked, ChangeRejected, SourceUnreachable) as error:
            if not self._request.after:
                raise
            self._notes.append(str(error))
            return False
        for source, change in changed.items():
            if not is_equal(change.new, new[source]):
                self._is_as_asked = False
                self._notes.append(f'{self._name(source)} became {change.new!r} where {new[source]!r} was asked for')
        return bool(changed)

    def _answer(self, part: Any) -> Dict[Source, Any]:
        """The values with which a part of a message is as wanted."""
        return solved(
            self.asker,
            values.sources(part),
            OWNER_TIMEOUT,
            lambda limits: self.solve(part, limits),
            self._of_thing,
            self._shared,
        )

    def solve(self, part: Any, limits: Mapping[str, Any]) -> Dict[Source, Any]:
        """Solve for a part of a message, within limits as of `Directory.limits`."""
        return solve_by_effect(part, self.wanted, self.sources, limits)

    def _observed(self, message: messages.Message) -> Optional[Observation]:
        try:
            part, type_ = messages.part_at(message, self.path)
        except messages.NoSuchPart:
            return None
        return observe(part, self.wanted, type_, self._messages)

    def _is_kept(self) -> bool:
        """Return whether owners still have the requested values: one may clamp its value after a message or two."""
        try:
            lost = [self._became(source, now) for source, now in self._request.lost().items()]
        except SourceUnreachable:
            return self._loop.is_reached  # the messages have shown it
        if lost:
            raised = self._request.raised('')
            self._notes, self._loop.last = [raised] if raised else lost, None
        return not lost

    def _is_awaited(self) -> bool:
        """Return whether the node that makes the messages has the change in force, and has sent none since."""
        is_its_own = self._request.nodes == set(self._publishers)
        return is_its_own and not self._messages and not self._notes and self._is_kept()

    def _why_raised(self) -> str:
        """The error that a change has made a node raise; '' if there is none, or a message shows the change."""
        if self._loop.seen:
            return ''
        logged = self.errors.raised_since({*self._publishers, *self._request.nodes}, self._request.requested)
        return self._request.raised(logged) if logged else ''

    def _became(self, source: Source, now: object) -> str:
        return f'{self._name(source)} is {now!r} by now, it was made {self._request.after[source]!r}'

    def _name(self, source: Source) -> str:
        return self.asker.directory.name(source)

    def _outcome(self, is_reached: bool, reason: str = '') -> Outcome:
        last = self._loop.last
        return Outcome(
            self._request.changes,
            self.wanted,
            None if last is None else values.untracked(last.part),
            is_reached,
            self._loop.rounds,
            self._messages if last is None else last.number,
            1e3 * max(0.0, (time.monotonic() if last is None else last.at) - self._request.began),
            reason,
            is_near=is_reached and last is not None and not last.is_reached,
        )

    def _not_reached(self) -> NotReached:
        """The error to raise, once the changes have been taken back."""
        reason = self._reason()
        outcome = self._outcome(False, reason)
        afterwards = 'the change was left'
        if not self.keep_anyway:
            why = self._request.take_back()
            outcome = outcome._replace(is_taken_back=not why)
            afterwards = f'the change could not be taken back: {why}' if why else 'taken back'
        return NotReached(f'{reason}; {afterwards}', outcome)

    def _reason(self) -> str:
        """Say what came instead, and why as far as it is known."""
        parts, last = [], self._loop.last
        late = self._late(self._request.after)
        if last is not None:
            has_left = last is self._loop.other
            parts += [self._why_silent()] if has_left else []
            if not last.is_reached:
                parts.append(
                    f'{self._publisher} now send{"s" * (len(self._publishers) == 1)} '
                    f'{self._differing(last.part, self.wanted)} instead of {self._differing(self.wanted, last.part)}'
                )
            others = [
                f'its messages have {self._name(source)} = {readings[-1]!r}, and it was made {new!r}'
                for source, new in self._request.after.items()
                for readings in [last.expression.readings.get(source)]
                if readings
                and source not in late
                and not any(messages.is_sent_as(new, reading) for reading in readings)
            ]
            if has_left:
                parts.append(comes_from(self.asker.directory.own_first(last.expression.sources), self._name))
            elif self._loop.moves:
                parts.append('it stood still before the change, and moves since')
            elif is_alike(self._before, last):
                parts.append('it has not followed the change')
            elif self._is_as_asked and not others:
                parts.append(f'it is not computed as {self.expected_by} said before the change')
            parts += others
        return '; '.join(dict.fromkeys([*parts, *late.values(), *self._notes]))

    def _differing(self, part: object, other: object) -> str:
        """The leaves in which two parts of messages differ, in one line."""
        others = dict(values.leaves(other))
        found = []
        for path, leaf in values.leaves(part):
            if leaf is None or (path in others and (others[path] is None or values.is_same(leaf, others[path]))):
                continue
            name = self._path_of(path)
            found.append(f'{name}: {values.untracked(leaf)!r}' if name else repr(values.untracked(leaf)))
        return _short(', '.join(found) or str(values.untracked(part)))

    def _path_of(self, leaf: str) -> str:
        """The name of a leaf of the field, by its path in it."""
        return leaf

    def _why_silent(self) -> str:
        """Why no message shows a change."""
        publisher, names = self._publisher, ' and '.join(map(self._name, self._request.after))
        if self._loop.old:
            return f'the {self._loop.old} messages of {publisher} since then come from what it made of {names} before'
        which = f' that was computed from {names}' if self._messages else ''
        return f'no message of {publisher}{which} came within {self.timeout:g} s'


def _short(value: object) -> str:
    text = ' '.join(str(value).split())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + '...'
