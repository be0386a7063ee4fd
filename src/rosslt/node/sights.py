"""What is seen of a field after a change of its sources: whether it has the wanted value, and stays so."""

import time
from typing import Any, Dict, FrozenSet, List, NamedTuple, Optional, Set

from rosslt import messages, values
from rosslt.node.branches import Expression
from rosslt.node.client import Change
from rosslt.values import Source

#: How long a second message is waited for, which shows whether a field stays as it is, in seconds.
SECOND_MESSAGE = 1.0

#: For how long messages without the changed sources may be about another thing, in seconds.
OTHER_THINGS = 0.5

#: How many times as far as it moves by itself a moving field may be from the target.
LEEWAY = 3.0

#: How many messages have come at least between the one that was solved and the first one that shows it.
FEWEST_STEPS = 2

#: From how many versions of one expression on that differ in their numbers alone something moves by itself.
FEWEST_MOMENTS = 3


class Sight(NamedTuple):
    """A field as a message has it.

    Attributes:
        number: how many messages there were up to this one, since the first change.
        at: when it came, a time of `time.monotonic`.
        part: the field, with its provenance.
        expression: how it was computed.
        distance: how far it is from the target.
        is_reached: whether it is the target.
    """

    number: int
    at: float
    part: Any
    expression: Expression
    distance: float
    is_reached: bool


def sight_of(part: Any, wanted: Any, type_: str = '', number: int = 0) -> Sight:
    """The Sight of a part of a message that has just come.

    Args:
        part, wanted, type_: as of `messages.is_reached`.
        number: of the message.
    """
    return Sight(
        number,
        time.monotonic(),
        part,
        Expression(part),
        messages.distance(part, wanted),
        messages.is_reached(part, wanted, type_),
    )


class Look:
    """What the messages after a change show.

    Args:
        changed: {Source: Change}.
        timeout: how long to wait for a message that shows it, in seconds.

    Attributes:
        end: when to stop looking, a time of `time.monotonic`.
        reached: the first of two sights in a row with the wanted value, where a second one comes soon; or None.
        new: the sights that show the change.
        other: those without any of the changed sources: the field was computed from others.
        old: how many still had an old value of a changed source.
        missing: how many messages had no such field.
    """

    def __init__(self, changed: Dict[Source, Change], timeout: float) -> None:
        self._changed = changed
        self._last_end = self.end = time.monotonic() + timeout
        self.new: List[Sight] = []
        self.other: List[Sight] = []
        self.old = self.missing = 0

    @property
    def reached(self) -> Optional[Sight]:
        if not self.new or not self.new[-1].is_reached:
            return None
        return self.new[-2] if len(self.new) > 1 and self.new[-2].is_reached else self.new[-1]

    def is_over_after(self, sight: Optional[Sight], is_latched: bool = False) -> bool:
        """Take a sight in.

        Args:
            sight: None where the message has no such field.
            is_latched: whether its publisher sends again only what has changed.

        Returns:
            Whether no more has to be looked at.
        """
        if sight is None:
            self.missing += 1
        elif not sight.is_reached and self._is_older(sight.expression):
            self.old += 1
        elif sight.is_reached or self._changed.keys() & set(sight.expression.sources):
            self.new.append(sight)
            return (sight.is_reached and is_latched) or self._is_last(sight)
        elif not self.new:
            self.other.append(sight)
            # A topic may tell of several things in turn: the one that has changed would come within this time.
            return len(self.other) > 1 and sight.at - self.other[0].at >= OTHER_THINGS
        return False

    def _is_last(self, sight: Sight) -> bool:
        if len(self.new) == 1:
            self.end = min(self._last_end, sight.at + SECOND_MESSAGE)
            return False
        before = self.new[-2]
        if sight.is_reached and before.is_reached:
            return True
        if sight.distance >= before.distance * (1 - 1e-12):
            return True
        # it comes nearer by itself
        self.end = sight.at + SECOND_MESSAGE if sight.is_reached else self._last_end
        return False

    def _is_older(self, expression: Expression) -> bool:
        """Whether a message was computed before the change, or from a value that was kept from before."""
        for source, change in self._changed.items():
            readings = expression.readings.get(source)
            if (
                readings
                and not is_equal(*change)
                and all(messages.is_sent_as(change.old, reading) for reading in readings)
            ):
                return True
        return False

    @property
    def moving(self) -> FrozenSet[int]:
        """The places of the numbers that differ from one sight to the next, although no source was changed."""
        places: Set[int] = set()
        for one, other in zip(self.new, self.new[1:]):
            places.update(one.expression.difference(other.expression).numbers)
        return frozenset(places)

    @property
    def moves(self) -> bool:
        """Whether the field moves by itself."""
        return any(
            not messages.is_reached(other.part, values.untracked(one.part))
            for one, other in zip(self.new, self.new[1:])
        )

    def is_solved_for_its_moment(self, solved: Sight) -> bool:
        """Whether the field moves by itself, and is no further from the target than it has moved since it was solved.

        Args:
            solved: the sight that was solved.
        """
        if not self.moves or solved.expression.difference(self.new[0].expression).is_branch(self.moving):
            return False
        reach = 0.0
        for one, other in zip(self.new, self.new[1:]):
            step = messages.distance(other.part, values.untracked(one.part))
            steps = (self.new[0].at - solved.at) / max(other.at - one.at, 1e-6)
            # messages may have been read later than they came, which says little of the time between them
            reach = max(reach, LEEWAY * step * max(steps, FEWEST_STEPS))
        return self.new[0].distance <= reach


class Motion:
    """Whether something moves by itself, from what messages show of it while its sources may change.

    Other numbers come into its expression then: the time, a counter. They do where its node takes another branch, too,
    but of branches there are few.
    """

    def __init__(self) -> None:
        self._seen: List[Expression] = []

    def see(self, part: Any) -> None:
        """Take in what a message has: a list of tracked values."""
        if not self.is_seen:
            expression = Expression(part)
            if all(one.difference(expression).numbers for one in self._seen):
                self._seen.append(expression)

    @property
    def is_seen(self) -> bool:
        """Whether there is no other explanation."""
        return len(self._seen) >= FEWEST_MOMENTS


def is_equal(one: Any, other: Any) -> bool:
    """Whether two values of a source are the same, and of one type."""
    return type(one) is type(other) and bool(one == other)
