"""Forcing a field of a topic: a change is believed when a message shows it, and else it is said what came instead."""

import time
from typing import Any, Collection, Dict, FrozenSet, List, NamedTuple, Optional, Protocol, Set, Tuple

from rosslt import messages, values
from rosslt.node.client import (
    Asker,
    Change,
    ChangeRejected,
    SourceUnreachable,
    reevaluate,
    request_values,
    solved,
    undo_request,
)
from rosslt.node.closed_loop import ClosedLoop
from rosslt.node.history import new_request_id
from rosslt.node.json_scalars import Value
from rosslt.node.node_errors import NodeErrors
from rosslt.node.observation import Observation, is_equal, observe
from rosslt.values import Source

#: The timeout of owners' answers, in seconds.
OWNER_TIMEOUT = 2.0

#: The period of checking, while no message comes, whether a callback of the node has raised, in seconds.
ERROR_PERIOD = 0.1

#: Fields that say what a message is about, where a node sends several things on one topic.
NAMES = {'ns', 'id', 'name', 'frame_id', 'child_frame_id', 'joint_names'}

#: The end of the path of a goal's id in a message of an action: each goal has its own, also when sent again.
OF_GOALS = 'goal_id.id'

#: The longest value or expression in an error, in characters.
LONGEST = 160


class Heard(Protocol):
    """A message, and the node that has sent it."""

    @property
    def publisher(self) -> str: ...

    @property
    def message(self) -> Any: ...

    @property
    def is_latched(self) -> bool: ...


class Stream(Protocol):
    """The messages of a topic as they come."""

    def next_before(self, end: float) -> Optional[Heard]:
        """The next one; None where there is none until a time of `time.monotonic`."""
        ...

    def clear(self) -> None:
        """Drop those that have arrived and were not read."""
        ...


class Outcome(NamedTuple):
    """The result of forcing a field: what has changed, and what was seen then.

    Attributes:
        changes: {Source: Change(old, new)}: before the first round, and after the last one.
        wanted: the target.
        seen: the field in the last message that was looked at, plain; None where none came.
        is_reached: whether messages have the wanted value. For a field that moves by itself: whether it was solved for
            the moment it was seen at, and is no further from it than it moves by itself.
        moves: whether the field moves by itself, without a change.
        rounds: how many times it was solved.
        messages: how many messages of the publisher came after the first change, up to the one that was seen.
        milliseconds: from the first request to that message.
        reason: why it was not reached, as far as known; '' where it was.
        is_taken_back: whether all changes have been taken back.
    """

    changes: Dict[Source, Change]
    wanted: Any
    seen: Any
    is_reached: bool
    moves: bool = False
    rounds: int = 0
    messages: int = 0
    milliseconds: float = 0.0
    reason: str = ''
    is_taken_back: bool = False


class NotReached(values.Error):
    """A field has not become what was wanted, although its sources have changed.

    Attributes:
        outcome: the Outcome: what was changed, what came instead, and why.
    """

    __module__ = 'rosslt'

    def __init__(self, message: str, outcome: Outcome) -> None:
        super().__init__(message)
        self.outcome = outcome


class Field(NamedTuple):
    """A field of the messages of one publisher of a topic.

    Attributes:
        publisher: the node's full name.
        path: as `messages.part_at` takes it.
        thing: which of several things of one topic the message is about.
    """

    publisher: str
    path: str
    thing: Tuple[Any, ...]


def thing_of(message: Any, path: str) -> Tuple[Any, ...]:
    """The thing that a message is about, where nodes send several on one topic: what its names are.

    Args:
        path: the field in question, which is no name of it.
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


def close_loop(
    asker: Asker,
    stream: Stream,
    errors: NodeErrors,
    heard: Heard,
    path: str,
    wanted: Any,
    sources: Optional[Collection[Source]] = None,
    rounds: int = 5,
    timeout: float = 5.0,
    keep_anyway: bool = False,
) -> Outcome:
    """Solve for a field of a message, change its sources, and look at the next messages, until the field is as wanted.

    Args:
        asker: who asks for changes.
        stream: the messages of the topic from now on.
        errors: those of nodes, heard since before the first message.
        heard: the message to begin with.
        path: of the field in the message.
        wanted: plain, of the field's shape; None leaves a part free.
        sources: change no other than these.
        rounds: how many times it is solved at most.
        timeout: how long to wait for a message that shows a change, in seconds.
        keep_anyway: leave the changes where the target is not reached.

    Raises:
        values.NotTracked, values.NotInvertible: there is no answer to begin with; nothing was requested.
        ChangeRejected, SourceUnreachable: as of `force_value`, in the first round.
        NotReached: no message has the wanted value.
        ValueError: the message has no such field, or that cannot hold what is wanted.
    """
    if rounds < 1:
        raise ValueError(f'rounds must be at least 1, found {rounds}')
    field = Field(heard.publisher, path, thing_of(heard.message, path))
    return _Force(asker, stream, field, wanted, sources, rounds, timeout, errors).run(heard.message, keep_anyway)


class _Force:
    """Feeds a ClosedLoop with the messages of a topic."""

    def __init__(
        self,
        asker: Asker,
        stream: Stream,
        field: Field,
        wanted: Any,
        sources: Optional[Collection[Source]],
        rounds: int,
        timeout: float,
        errors: NodeErrors,
    ) -> None:
        self._asker, self._stream, self._field, self._wanted = asker, stream, field, wanted
        self._sources, self._timeout, self._errors = sources, timeout, errors
        self._loop = ClosedLoop(self._change, rounds, timeout)
        self._request_id = new_request_id()
        self._changes: Dict[Source, Change] = {}
        self._began = self._requested = 0.0
        self._messages = self._other_goals = 0
        self._tried: Set[FrozenSet[Tuple[Source, Value]]] = set()  # values of the sources
        self._notes: List[str] = []  # what else explains that it was not reached

    def run(self, message: Any, keep_anyway: bool) -> Outcome:
        first = self._observed(message)
        if first is None:
            raise ValueError(f'the message has no field {self._field.path}')
        messages.check_range(*messages.part_at(message, self._field.path), self._wanted)
        if first.is_reached:
            return Outcome({}, self._wanted, values.untracked(first.part), True)
        loop = self._loop
        loop.begin(first)
        while not loop.is_over:
            heard = self._stream.next_before(min(loop.end, time.monotonic() + ERROR_PERIOD))
            error = self._why_raised()
            if error:
                self._notes.append(error)
                loop.stop()
            elif time.monotonic() >= loop.end:
                loop.pass_time()
            elif heard is None:
                continue
            elif heard.publisher == self._field.publisher and self._thing(heard) == self._field.thing:
                self._messages += 1
                observation = self._observed(heard.message)
                if loop.rounds and self._is_other_goal(heard.message, observation):
                    self._other_goals += 1
                else:
                    loop.take(observation, heard.is_latched)
        if loop.is_reached and (loop.moves or self._is_kept()):
            return self._outcome(is_reached=True)
        if loop.last is None and not self._notes:
            self._notes.append(self._why_silent() if loop.rounds else 'its sources have the values that should do it')
        raise self._not_reached(keep_anyway)

    def _change(self, observation: Observation) -> Dict[Source, Change]:
        """Have the sources become what an observation needs; {} where that has been tried already."""
        state = {source: change.new for source, change in self._changes.items()}
        self._tried.add(frozenset(state.items()))
        try:
            new = solved(
                self._asker,
                values.sources(observation.part),
                OWNER_TIMEOUT,
                lambda limits: self._untried(observation, state, limits),
            )
            if not new:
                return {}
            self._stream.clear()
            self._requested = time.monotonic()
            self._began = self._began or self._requested
            changed = request_values(self._asker, new, OWNER_TIMEOUT, self._request_id)
        except (values.NotInvertible, values.NotTracked, ChangeRejected, SourceUnreachable) as error:
            if not self._changes:
                raise
            self._notes.append(str(error))
            return {}
        for source, change in changed.items():
            first = self._changes.get(source, change)
            self._changes[source] = Change(first.old, change.new)
            if not is_equal(change.new, new[source]):
                self._notes.append(f'{self._name(source)} became {change.new!r} where {new[source]!r} was asked for')
        return changed

    def _untried(
        self, observation: Observation, state: Dict[Source, Value], limits: Dict[str, Any]
    ) -> Dict[Source, Value]:
        """Solve an observation; for other sources than before where going on with these would go in circles."""
        chosen = self._sources
        left: Dict[str, Any] = {'source': next(iter(chosen))} if chosen and len(chosen) == 1 else {'sources': chosen}
        held: Set[Source] = set()
        while True:
            try:
                answer = values.solve(
                    observation.part, self._wanted, **left, **{**limits, 'read_only': [*limits['read_only'], *held]}
                )
            except values.NotInvertible:
                if held:
                    return {}
                raise
            present = {source: readings[-1] for source, readings in observation.expression.readings.items()}
            new = {source: value for source, value in answer.items() if not is_equal(present[source], value)}
            if new and frozenset({**state, **new}.items()) not in self._tried:
                return new
            if not new or held & new.keys():
                return {}
            held |= new.keys()

    def _thing(self, heard: Heard) -> Tuple[Any, ...]:
        return thing_of(heard.message, self._field.path)

    def _observed(self, message: Any) -> Optional[Observation]:
        try:
            part, type_ = messages.part_at(message, self._field.path)
        except messages.NoSuchPart:
            return None
        return observe(part, self._wanted, type_, self._messages)

    def _is_other_goal(self, message: Any, observation: Optional[Observation]) -> bool:
        """Return whether a message is a goal of an action that has none of the changed sources.

        Each goal is a thing of its own: such a one says nothing of the goal that was changed, and stays as it is.
        """
        is_goal = hasattr(message, 'goal_id') and hasattr(message, 'goal')
        return is_goal and observation is not None and not self._changes.keys() & set(observation.expression.sources)

    def _is_kept(self) -> bool:
        """Return whether owners still have what they were given: one may have clamped it after a message or two."""
        given = [values.track(change.new, source) for source, change in self._changes.items()]
        try:
            present = reevaluate(self._asker, given, OWNER_TIMEOUT)
        except SourceUnreachable:
            return True  # the messages have shown it
        lost = [
            f'{self._name(source)} is {now!r} by now, it was made {asked!r}'
            for source, now, asked in zip(self._changes, values.untracked(present), values.untracked(given))
            if now != asked
        ]
        if lost:
            self._notes, self._loop.last = lost, None
        return not lost

    def _why_raised(self) -> str:
        """The error that a change has made a node raise; '' where there is none, or a message shows the change."""
        if self._loop.observer.new:
            return ''
        nodes = {self._field.publisher, *(source.node for source in self._changes)}
        return self._errors.raised_since(nodes, self._requested)

    def _name(self, source: Source) -> str:
        return self._asker.directory.name(source)

    def _outcome(self, is_reached: bool, reason: str = '', is_taken_back: bool = False) -> Outcome:
        last = self._loop.last
        return Outcome(
            {source: change for source, change in self._changes.items() if not is_equal(*change)},
            self._wanted,
            None if last is None else values.untracked(last.part),
            is_reached,
            self._loop.moves,
            self._loop.rounds,
            self._messages if last is None else last.number,
            1e3 * ((time.monotonic() if last is None else last.at) - self._began),
            reason,
            is_taken_back,
        )

    def _not_reached(self, keep_anyway: bool) -> NotReached:
        """The error to raise, once the changes have been taken back."""
        reason = self._reason()
        afterwards, is_taken_back = 'the change was left', False
        if not keep_anyway:
            nodes = {source.node for source, change in self._changes.items() if not is_equal(*change)}
            undone = undo_request(self._request_id, nodes, self._asker.name, OWNER_TIMEOUT)
            is_taken_back = not undone.reasons
            afterwards = 'taken back'
            if undone.reasons:
                whys = '; '.join(f'{node}: {why}' for node, why in undone.reasons.items())
                afterwards = f'the change could not be taken back: {whys}'
        return NotReached(f'{reason}; {afterwards}', self._outcome(False, reason, is_taken_back))

    def _reason(self) -> str:
        """Say what came instead, and why as far as it is known."""
        parts, last = [], self._loop.last
        if last is not None:
            parts.append(
                f'{self._field.publisher} now sends {_differing(last.part, self._wanted)} instead of '
                f'{_differing(self._wanted, last.part)}'
            )
            if self._loop.moves:
                parts.append('it changes by itself')
            elif self._loop.has_branched:
                parts.append('it is computed in another way than before: the node takes another branch')
            for source, change in self._changes.items():
                readings = last.expression.readings.get(source)
                if readings and not any(messages.is_sent_as(change.new, reading) for reading in readings):
                    parts.append(f'{self._name(source)} is {readings[-1]!r} by now, it was made {change.new!r}')
        return '; '.join(dict.fromkeys([*parts, *self._notes]))

    def _why_silent(self) -> str:
        """Why no message shows a change."""
        publisher, observer = self._field.publisher, self._loop.observer
        if observer.old:
            names = ' and '.join(map(self._name, self._changes))
            return f'the {observer.old} messages of {publisher} since then still come from the old value of {names}'
        if self._other_goals:
            names = ' and '.join(map(self._name, self._changes))
            return (
                f'none of the {self._other_goals} goals that {publisher} has sent within {self._timeout:g} s '
                f'was computed from {names}'
            )
        if observer.missing:
            return f'the messages of {publisher} have no {self._field.path} any more'
        return f'no message of {publisher} came within {self._timeout:g} s'


def _differing(part: Any, other: Any) -> str:
    """The leaves of a part of a message that differ from those of another one, in one line."""
    others = dict(values.leaves(other))
    found = []
    for path, leaf in values.leaves(part):
        if leaf is None or (path in others and (others[path] is None or values.is_same(leaf, others[path]))):
            continue
        found.append(f'{path}: {values.untracked(leaf)!r}' if path else repr(values.untracked(leaf)))
    return _short(', '.join(found) or str(values.untracked(part)))


def _short(value: Value) -> str:
    text = ' '.join(str(value).split())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + '...'
