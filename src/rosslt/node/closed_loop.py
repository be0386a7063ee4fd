"""The closed loop: a change is believed when a message shows it.

An expression says how a node computed a field, not how it will compute it after a change: it may take another branch,
round, or go on from what it has summed up. So the next message is looked at; where the field is not what was wanted,
the new message's expression is solved, and so on.
"""

import time
from typing import Any, Collection, Dict, FrozenSet, List, NamedTuple, Optional, Protocol, Set, Tuple

from rosslt import messages, values
from rosslt.node.branches import Difference
from rosslt.node.client import Asker, Change, ChangeRejected, SourceUnreachable, force_value, solved, undo_request
from rosslt.node.history import new_request_id
from rosslt.node.sights import Look, Sight, is_equal, sight_of
from rosslt.values import Source

#: How long owners may take to answer, in seconds.
OWNER_TIMEOUT = 2.0

#: How many rounds that come no nearer are made, and how many a field that moves by itself is solved for.
PATIENCE = 2

#: Fields that say what a message is about, where a node sends several things on one topic.
NAMES = {'ns', 'id', 'name', 'frame_id', 'child_frame_id', 'joint_names'}

#: How the path ends of what names a goal of an action: each has another one, also where it is sent again.
OF_GOALS = 'goal_id.id'

#: How many other branches are described.
MOST_BRANCHES = 3

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
    """What forcing a field has changed, and what was seen then.

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
    """Which of several things a message is about, where nodes send several on one topic: what its names are.

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
    return _Loop(asker, stream, field, wanted, sources, timeout).run(heard.message, rounds, keep_anyway)


class _Loop:
    def __init__(
        self,
        asker: Asker,
        stream: Stream,
        field: Field,
        wanted: Any,
        sources: Optional[Collection[Source]],
        timeout: float,
    ) -> None:
        self._asker, self._stream, self._field, self._wanted = asker, stream, field, wanted
        self._sources, self._timeout = sources, timeout
        self._request_id = new_request_id()
        self._changes: Dict[Source, Change] = {}
        self._began = 0.0
        self._messages = self._rounds = 0
        self._last: Optional[Sight] = None
        # source values -> what the field was then, and its slopes
        self._tried: Dict[FrozenSet[Tuple[Source, Any]], Tuple[Any, Any]] = {}
        self._branches: List[Difference] = []
        self._moves = False
        self._notes: List[str] = []  # what else explains that it was not reached

    def run(self, message: Any, rounds: int, keep_anyway: bool) -> Outcome:
        sight = self._sight(message)
        if sight is None:
            raise ValueError(f'the message has no field {self._field.path}')
        messages.check_range(*messages.part_at(message, self._field.path), self._wanted)
        if sight.is_reached:
            return Outcome({}, self._wanted, values.untracked(sight.part), True)
        best, worse, moments = float('inf'), 0, 0
        for _ in range(rounds):
            try:
                changed = self._change(sight)
            except (values.NotInvertible, values.NotTracked, ChangeRejected, SourceUnreachable) as error:
                if not self._changes:
                    raise
                self._notes.append(str(error))
                break
            if changed is None:
                break
            look = self._look(changed)
            if look.reached is not None:
                self._last, self._moves = look.reached, False
                return self._outcome(is_reached=True)
            seen = look.new or look.other
            if not seen:
                self._notes.append(self._why_silent(look, changed))
                self._last = None
                break
            first, self._last = seen[0], seen[-1]
            self._moves = look.moves
            moments = moments + 1 if look.is_solved_for_its_moment(sight) else 0
            if moments >= min(PATIENCE, rounds):
                self._last = first
                return self._outcome(is_reached=True)
            slopes = values.slopes([leaf for _, leaf in values.leaves(self._last.part) if values.is_tracked(leaf)])
            self._tried[self._state()] = values.untracked(self._last.part), slopes
            difference = sight.expression.difference(self._last.expression)
            if difference.is_branch(look.moving):
                self._branches.append(difference)
            worse = worse + 1 if first.distance >= best else 0
            best = min(best, first.distance)
            sight = self._last
            if worse >= PATIENCE:
                break
        raise self._not_reached(keep_anyway)

    def _change(self, sight: Sight) -> Optional[Dict[Source, Change]]:
        """Have the sources become what a sight's expression needs; None where that has been tried already."""
        concerned = values.sources(sight.part)
        new = solved(self._asker, concerned, OWNER_TIMEOUT, lambda limits: self._untried(sight, limits))
        if new is None:
            return None
        present = sight.expression.readings
        self._stream.clear()
        self._began = self._began or time.monotonic()
        self._rounds += 1
        changed = force_value(
            self._asker,
            [values.track(present[source][-1], source) for source in new],
            list(new.values()),
            timeout=OWNER_TIMEOUT,
            request_id=self._request_id,
        )
        for source, change in changed.items():
            first = self._changes.get(source, change)
            self._changes[source] = Change(first.old, change.new)
            if not is_equal(change.new, new[source]):
                self._notes.append(f'{self._name(source)} became {change.new!r} where {new[source]!r} was asked for')
        return changed

    def _untried(self, sight: Sight, limits: Dict[str, Any]) -> Optional[Dict[Source, Any]]:
        """What the sources must become; of other sources than before where going on with these would go in circles."""
        state = {source: change.new for source, change in self._changes.items()}
        chosen = self._sources
        left: Dict[str, Any] = {'source': next(iter(chosen))} if chosen and len(chosen) == 1 else {'sources': chosen}
        held: Set[Source] = set()
        while True:
            try:
                answer = values.solve(
                    sight.part, self._wanted, **left, **{**limits, 'read_only': [*limits['read_only'], *held]}
                )
            except values.NotInvertible:
                if held:
                    return None
                raise
            present = {source: readings[-1] for source, readings in sight.expression.readings.items()}
            new = {source: value for source, value in answer.items() if not is_equal(present[source], value)}
            if new and frozenset({**state, **new}.items()) not in self._tried:
                return new
            if not new or held & new.keys():
                return None
            held |= new.keys()

    def _look(self, changed: Dict[Source, Change]) -> Look:
        """Look at the next messages, for as long as the field comes nearer by itself."""
        look = Look(changed, self._timeout)
        while True:
            heard = self._stream.next_before(look.end)
            if heard is None:
                return look
            if heard.publisher != self._field.publisher or self._thing(heard) != self._field.thing:
                continue
            self._messages += 1
            if look.is_over_after(self._sight(heard.message), heard.is_latched):
                return look

    def _thing(self, heard: Heard) -> Tuple[Any, ...]:
        return thing_of(heard.message, self._field.path)

    def _sight(self, message: Any) -> Optional[Sight]:
        try:
            part, type_ = messages.part_at(message, self._field.path)
        except messages.NoSuchPart:
            return None
        return sight_of(part, self._wanted, type_, self._messages)

    def _state(self) -> FrozenSet[Tuple[Source, Any]]:
        return frozenset((source, change.new) for source, change in self._changes.items())

    def _name(self, source: Source) -> str:
        return self._asker.directory.name(source)

    def _outcome(self, is_reached: bool, reason: str = '', is_taken_back: bool = False) -> Outcome:
        return Outcome(
            {source: change for source, change in self._changes.items() if not is_equal(*change)},
            self._wanted,
            None if self._last is None else values.untracked(self._last.part),
            is_reached,
            self._moves,
            self._rounds,
            self._messages if self._last is None else self._last.number,
            1e3 * ((time.monotonic() if self._last is None else self._last.at) - self._began),
            reason,
            is_taken_back,
        )

    def _not_reached(self, keep_anyway: bool) -> NotReached:
        """What to raise, once the changes have been taken back."""
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
        """What came instead, and why as far as it is known."""
        parts = []
        if self._last is not None:
            parts.append(
                f'{self._field.publisher} now sends {_differing(self._last.part, self._wanted)} instead of '
                f'{_differing(self._wanted, self._last.part)}'
            )
            parts += self._whys(self._last)
        return '; '.join(dict.fromkeys([*parts, *self._notes]))

    def _whys(self, last: Sight) -> List[str]:
        whys = []
        branches = dict.fromkeys(difference.describe(self._name) for difference in self._branches)
        whys += [f'it takes another branch: {text}' for text in list(branches)[:MOST_BRANCHES]]
        if self._moves:
            whys.append('it moves by itself')
        for source, change in self._changes.items():
            readings = last.expression.readings.get(source)
            if readings and not any(messages.is_sent_as(change.new, reading) for reading in readings):
                whys.append(f'{self._name(source)} is {readings[-1]!r} by now, it was made {change.new!r}')
        alike: Dict[str, FrozenSet[Tuple[Source, Any]]] = {}
        for state, seen in () if self._moves else self._tried.items():
            other = alike.setdefault(repr(seen), state)
            if other != state:
                told = [
                    ' and '.join(f'{self._name(one)} = {value!r}' for one, value in each) for each in (other, state)
                ]
                whys.append('it is {} for {} and for {}: the node rounds or limits it'.format(_short(seen[0]), *told))
                break
        return whys

    def _why_silent(self, look: Look, changed: Dict[Source, Change]) -> str:
        """Why no message shows a change."""
        publisher = self._field.publisher
        if look.old:
            names = ' and '.join(map(self._name, changed))
            return f'the {look.old} messages of {publisher} since then still come from the old value of {names}'
        if look.missing:
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


def _short(value: Any) -> str:
    text = ' '.join(str(value).split())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + '...'
