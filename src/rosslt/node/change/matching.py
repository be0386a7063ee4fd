"""Matching numbers of several topics with measured ones: one change, and the next messages of all are looked at."""

import dataclasses
import time
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt import messages, values
from rosslt.node.change.client import solved
from rosslt.node.change.closed_loop import LOOK
from rosslt.node.change.effects import solve_by_effect
from rosslt.node.change.forcing import OWNER_TIMEOUT, Forcing, Outcome, thing_of
from rosslt.node.change.observation import Observation, is_alike, observe
from rosslt.node.locations.uses import shared_in, tracked_of_thing
from rosslt.node.robot_description import check_joint_limits
from rosslt.node.topics.listening import Heard
from rosslt.values import Source

#: One thing of a publisher on a topic.
_Stream = Tuple[Any, ...]


class _NothingNearer(values.Error):
    """Numbers are as near as possible before anything was changed."""


class Aim(NamedTuple):
    """A number of a topic, and what it is to be.

    Attributes:
        heard: the latest whole message of its publisher.
        before: the whole message before that; None if there was none.
        path: of the number in the message.
        wanted: what it is to be.
        name: what it is called in texts.
    """

    heard: Heard
    before: Optional[Heard]
    path: str
    wanted: float
    name: str


@dataclasses.dataclass
class Matching(Forcing):
    """Forces numbers of one or several topics in one request.

    The closed loop is that of one field. What it looks at are all numbers together, whenever each of their publishers
    has sent a new whole message. If the numbers cannot all be as wanted, as more of them than there are sources come
    from the same ones, these are brought as near as possible, by least squares, and `wanted` is what they become then.

    The `path` and `wanted` of a Forcing are not given, but follow from the aims of `match`.

    Attributes:
        aims: those whose numbers have a source.
        is_nearest: whether numbers could only be brought as near as possible.
    """

    path: str = ''
    wanted: Any = None
    aims: List[Aim] = dataclasses.field(default_factory=list)
    is_nearest: bool = False

    def match(self, aims: Sequence[Aim]) -> Outcome:
        """Have all numbers become as wanted, or as near as possible.

        Returns:
            The Outcome: `wanted` and `seen` are lists, in the order of `aims`.

        Raises:
            NotTracked, NotInvertible: there is no answer, a number has no source or changes by itself, or a joint
                would go beyond its limits; nothing was requested.
            ChangeRejected, SourceUnreachable: as in `force_value`; nothing has changed.
            NotReached: not all messages have the wanted values; it has been taken back.
            ValueError: a field cannot hold its number.
        """
        first = self._first(aims)
        if first.is_reached:
            return Outcome({}, self.wanted, values.untracked(first.part), True)
        try:
            return self._follow(first, first)
        except _NothingNearer:
            self.is_nearest, seen = True, values.untracked(first.part)
            return Outcome({}, seen, seen, True)

    def plan(self, aims: Sequence[Aim]) -> Dict[Source, Any]:
        """Return the values with which all numbers would be as wanted, or as near as possible; nothing is requested.

        Raises:
            NotTracked, NotInvertible, ValueError: as of `match`.
        """
        first = self._first(aims)
        try:
            return {} if first.is_reached else self._answer(first.part)
        except _NothingNearer:
            self.is_nearest, self.wanted = True, values.untracked(first.part)
            return {}

    def _first(self, aims: Sequence[Aim]) -> Observation:
        """Begin with aims, and return what their numbers are in the first messages."""
        self.aims = [aim for aim in aims if _has_source(aim)]
        self._begin([aim.heard for aim in self.aims])
        heard = {_stream_of(aim.heard): aim.heard for aim in self.aims}
        self._streams = list(heard)
        self._pending: Dict[_Stream, Heard] = {}
        self.wanted = self._measured = [aim.wanted for aim in self.aims]
        for aim in self.aims:
            messages.check_range(*messages.part_at(aim.heard.message, aim.path), aim.wanted)
            check_joint_limits(aim.heard.topic, aim.heard.message, aim.path, aim.wanted)
        self._check_still()
        first = self._joined(heard)
        assert first is not None
        self._things: List[List[Any]] = []
        self._uses: List[Any] = []
        for aim in self.aims:
            thing = tracked_of_thing(aim.heard.message, aim.path)
            if not any(thing[0] is other[0] for other in self._things):
                self._things.append(thing)
                self._uses.append(shared_in(aim.heard.message, aim.path))
        return first

    def _check_still(self) -> None:
        """Check that no number changes by itself.

        Raises:
            values.NotInvertible: two messages in a row come from the same values, and differ.
        """
        later = self._later()
        for aim in self.aims:
            stream = _stream_of(aim.heard)
            before, last = (aim.before, aim.heard) if aim.before is not None else (aim.heard, later.get(stream))
            if last is None or _stream_of(before) != stream:
                continue
            one, other = (self._of([aim], {stream: heard}) for heard in (before, last))
            if one is None or other is None or is_alike(one, other):
                continue
            if one.expression.readings == other.expression.readings:
                self.aims, self.wanted = [aim], [aim.wanted]
                raise values.NotInvertible(self._why_moving(one, other))

    def _later(self) -> Dict[_Stream, Heard]:
        """The next message of whom only one was heard so far, and that was not latched."""
        awaited = {_stream_of(aim.heard) for aim in self.aims if aim.before is None and not aim.heard.is_latched}
        found: Dict[_Stream, Heard] = {}
        end = time.monotonic() + LOOK
        while awaited - found.keys():
            heard = self.stream.next_before(end)
            if heard is None:
                break
            if not heard.is_sampled:
                found.setdefault(_stream_of(heard), heard)
        return found

    def _joined(self, heard: Dict[_Stream, Heard]) -> Optional[Observation]:
        return self._of(self.aims, heard, self.wanted)

    def _of(
        self, aims: Sequence[Aim], heard: Dict[_Stream, Heard], wanted: Optional[List[float]] = None
    ) -> Optional[Observation]:
        """Return the values of some numbers in messages; None if a message lacks one of them."""
        wanted = [aim.wanted for aim in aims] if wanted is None else wanted
        try:
            found = [messages.part_at(heard[_stream_of(aim.heard)].message, aim.path) for aim in aims]
        except messages.NoSuchPart:
            return None
        are_reached = [messages.is_reached(part, target, type_) for (part, type_), target in zip(found, wanted)]
        return observe([part for part, _ in found], wanted, number=self._messages, is_reached=all(are_reached))

    def _take(self, heard: Heard) -> None:
        if heard.is_sampled or _stream_of(heard) not in self._streams:
            return
        self._messages += 1
        self._pending[_stream_of(heard)] = heard
        if len(self._pending) < len(self._streams):
            return
        old = self._loop.old
        self._loop.take(self._joined(self._pending))
        if self._loop.old == old:  # else the others have sent what they will, and one is late
            self._pending = {}

    def _answer(self, part: Any) -> Dict[Source, Any]:
        directory = self.asker.directory
        directory.learn(values.sources(self._things), OWNER_TIMEOUT)
        held = [one for thing, shared in zip(self._things, self._uses) for one in directory.held(thing, shared)]

        def solve(limits: Dict[str, Any]) -> Dict[Source, Any]:
            limits['read_only'] = [*limits['read_only'], *held]
            return solve_by_effect(self._named(part), self._named(self.wanted), self.sources, limits)

        sources = values.sources(part)
        try:
            return solved(self.asker, sources, OWNER_TIMEOUT, solve)
        except values.NotInvertible as error:
            limits = directory.limits(sources, OWNER_TIMEOUT)
            limits['read_only'] = [*limits['read_only'], *held]
            answer = self._nearest(part, limits, error)
        if not answer and not self._request.after:
            raise _NothingNearer
        self.is_nearest = True
        self.wanted = [values.untracked(one) for one in values.evaluate(part, answer)]
        return answer

    def _nearest(self, part: Sequence[Any], limits: Dict[str, Any], why: values.NotInvertible) -> Dict[Source, Any]:
        """The source values that bring numbers as near as possible to the measured ones, if more of them than there are
        sources come from the same ones; those that do not become as measured.

        Raises:
            NotInvertible: there are enough sources for some of them, and they cannot be as measured nevertheless.
        """
        answer: Dict[Source, Any] = {}
        for numbers in _connected(part, limits['read_only']):
            leaves, targets = [part[number] for number in numbers], [self._measured[number] for number in numbers]
            free = [source for source in values.sources(leaves) if source not in limits['read_only']]
            try:
                answer.update(solve_by_effect(leaves, targets, self.sources, limits))
                continue
            except values.NotInvertible:
                fixed = [number for number in numbers if not set(free).intersection(values.sources(part[number]))]
                if fixed:
                    names = ' and '.join(map(self._name, values.sources(part[fixed[0]])))
                    told = f'{why}; {self.aims[fixed[0]].name} comes from {names} alone, which takes no change'
                    raise values.NotInvertible(told) from None
                if len(leaves) <= len(free):
                    raise why from None
            answer.update(values.nearest(leaves, targets, **limits)[0])
        return answer

    def _is_awaited(self) -> bool:
        """Return whether all that no message has shown yet is latched by nodes that have the change in force."""
        silent = [aim for aim in self.aims if _stream_of(aim.heard) not in self._pending]
        heard = [aim for aim in self.aims if _stream_of(aim.heard) in self._pending]
        wanted = dict(zip(map(id, self.aims), self.wanted))
        shown = self._of(heard, self._pending, [wanted[id(aim)] for aim in heard]) if heard else None
        return (
            bool(silent)
            and not self._loop.seen
            and all(aim.heard.is_latched and aim.heard.publisher in self._request.nodes for aim in silent)
            and (not heard or (shown is not None and shown.is_reached))
            and not self._notes
            and self._is_kept()
        )

    def _named(self, numbers: Sequence[Any]) -> Dict[str, Any]:
        """Numbers with the names that errors say."""
        return {aim.name: number for aim, number in zip(self.aims, numbers)}

    def _path_of(self, leaf: str) -> str:
        return self.aims[int(leaf.strip('[]'))].name


def _has_source(aim: Aim) -> bool:
    """Return whether a number has a source; one that has none and is as wanted needs none.

    Raises:
        values.NotTracked: it has none, and is not as wanted.
    """
    part, type_ = messages.part_at(aim.heard.message, aim.path)
    if values.is_tracked(part):
        return True
    if not messages.is_reached(part, aim.wanted, type_):
        raise values.NotTracked(
            f'{aim.name} has no source, as {aim.heard.publisher} sends it: it is {part!r}, and {aim.wanted!r} was '
            f'measured; match those fields alone that have one, or see `rosslt doctor {aim.heard.topic}`'
        )
    return False


def _stream_of(heard: Heard) -> _Stream:
    return heard.topic, heard.publisher, thing_of(heard.message, '')


def _connected(part: Sequence[Any], fixed: Sequence[Source]) -> List[List[int]]:
    """The indices of numbers, those together that have sources in common which are not fixed."""
    groups: List[Tuple[List[int], Set[Source]]] = []
    for number, leaf in enumerate(part):
        indices, sources = [number], set(values.sources(leaf)).difference(fixed)
        for group in [group for group in groups if group[1] & sources]:
            groups.remove(group)
            indices, sources = [*group[0], *indices], group[1] | sources
        groups.append((indices, sources))
    return [indices for indices, _ in groups]
