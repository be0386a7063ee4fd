"""Observations of a field after a change of its sources: whether it has the wanted value, stays so, and is computed in
another way than before."""

import time
from typing import AbstractSet, Any, Dict, List, NamedTuple, Optional, Set, Tuple

from rosslt import messages, values
from rosslt.node.client import Change
from rosslt.values import AFFINE, CONSTANT, SOURCE, Source

#: Numbers that differ by less than this, relative to the size of what they are computed from, count as equal.
TOLERANCE = 1e-9

#: The maximal wait for a message that shows whether a field stays the same, or comes to rest, in seconds.
SECOND_MESSAGE = 1.0

#: The time in which messages without the changed sources are taken to be about another thing, in seconds.
OTHER_THINGS = 0.5


class Expression:
    """The expression that computed a part of a message, without the values of its sources.

    It shows which locations a node has used, what it has done to them, and the numbers in its code that are none.
    Where a node takes another branch (`a if x < 5 else b`), some of them come and others go.

    Args:
        part: a scalar, a message or an array, with tracked leaves.
    """

    def __init__(self, part: Any) -> None:
        tracked = [leaf for _, leaf in values.leaves(part) if values.is_tracked(leaf)]
        instructions, roots = values.disassemble(tracked)
        self.sources: List[Source] = values.sources(tracked)
        #: {source: its values that were used}; of a counter or an integral several.
        self.readings: Dict[Source, List[Any]] = {}
        self._numbers: List[Tuple[Any, float]] = []  # (number, size of what it belongs to)
        form: List[Any] = [tuple(roots)]
        at: List[Any] = []  # the value of each source, by index
        for kind, *rest in instructions:
            at.append(rest[1] if kind == SOURCE else None)
            if kind == SOURCE:
                self.readings.setdefault(rest[0], []).append(rest[1])
                form.append((SOURCE, rest[0]))
            elif kind == CONSTANT:
                self._numbers.append((rest[0], 0.0))
                form.append(CONSTANT)
            elif kind == AFFINE:
                value, terms, is_exact = rest
                form.append((AFFINE, tuple(index for index, _ in terms), is_exact))
                if is_exact:
                    size = abs(value) + sum(abs(slope * at[index]) for index, slope in terms)
                    self._numbers += [(slope, 0.0) for _, slope in terms]
                    self._numbers.append((value - sum(slope * at[index] for index, slope in terms), size))
            else:
                form.append((kind.name, *rest))
        self._form = tuple(form)

    def other_numbers(self, other: 'Expression') -> Set[int]:
        """The indices of the numbers, which are no sources, that differ in an expression of the same form."""
        if self._form != other._form:
            return set()
        pairs = enumerate(zip(self._numbers, other._numbers))
        return {index for index, pair in pairs if not _are_equal(*pair)}

    def is_other_branch(self, other: 'Expression', moving: AbstractSet[int] = frozenset()) -> bool:
        """Return whether another expression shows another branch.

        Args:
            moving: the indices of numbers that change by themselves from message to message.
        """
        return self._form != other._form or bool(self.other_numbers(other) - moving)


def _are_equal(old: Tuple[Any, float], new: Tuple[Any, float]) -> bool:
    (one, size), (other, other_size) = old, new
    if one == other:
        return True
    try:
        return bool(abs(one - other) <= TOLERANCE * max(abs(one), abs(other), size, other_size))
    except TypeError:
        return False


class Observation(NamedTuple):
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


def observe(part: Any, wanted: Any, type_: str = '', number: int = 0) -> Observation:
    """The Observation of a part of a message that has just come.

    Args:
        part, wanted, type_: as of `messages.is_reached`.
        number: of the message.
    """
    return Observation(
        number,
        time.monotonic(),
        part,
        Expression(part),
        messages.distance(part, wanted),
        messages.is_reached(part, wanted, type_),
    )


class ChangeObserver:
    """Sorts the messages after a change by what they show of it.

    Args:
        changed: {Source: Change}.
        timeout: how long to wait for a message that shows it, in seconds.

    Attributes:
        end: when to stop looking, a time of `time.monotonic`.
        new: the observations that show the change.
        other: those without any of the changed sources: the field was computed from others.
        old: how many still had an old value of a changed source.
        moves: whether the field moves by itself: it differs from one of `new` to the next.
        moving: the indices of the numbers in its expression that do.
    """

    def __init__(self, changed: Dict[Source, Change], timeout: float) -> None:
        self._changed = changed
        self._last_end = self.end = time.monotonic() + timeout
        self.new: List[Observation] = []
        self.other: List[Observation] = []
        self.old = 0
        self.moves = False
        self.moving: Set[int] = set()

    @property
    def rests(self) -> bool:
        """True if the last two of `new` are equal."""
        return len(self.new) > 1 and messages.is_reached(self.new[-1].part, values.untracked(self.new[-2].part))

    @property
    def reached(self) -> Optional[Observation]:
        """The first of two observations in a row with the wanted value, where a second one comes soon; or None."""
        if not self.new or not self.new[-1].is_reached:
            return None
        return self.new[-2] if len(self.new) > 1 and self.new[-2].is_reached else self.new[-1]

    def take(self, observation: Optional[Observation]) -> bool:
        """Take an observation in.

        Args:
            observation: None where the message has no such field.

        Returns:
            Whether no more has to be looked at.
        """
        if observation is None:
            return False
        if not observation.is_reached and self._is_older(observation.expression):
            self.old += 1
        elif observation.is_reached or self._changed.keys() & set(observation.expression.sources):
            return self._is_last(observation)
        elif not self.new:
            self.other.append(observation)
            # A topic may tell of several things in turn: the one that has changed would come within this time.
            return len(self.other) > 1 and observation.at - self.other[0].at >= OTHER_THINGS
        return False

    def _is_last(self, observation: Observation) -> bool:
        self.new.append(observation)
        if len(self.new) == 1:
            self.end = min(self._last_end, observation.at + SECOND_MESSAGE)
            return False
        before = self.new[-2]
        self.moving |= before.expression.other_numbers(observation.expression)
        self.moves = self.moves or not messages.is_reached(observation.part, values.untracked(before.part))
        if observation.is_reached and before.is_reached:
            return True
        if observation.distance >= before.distance * (1 - 1e-12):
            return True
        # it comes nearer by itself
        self.end = observation.at + SECOND_MESSAGE if observation.is_reached else self._last_end
        return False

    def _is_older(self, expression: Expression) -> bool:
        """Return whether a message was computed before the change, or from a value that was kept from before."""
        for source, change in self._changed.items():
            readings = expression.readings.get(source)
            if (
                readings
                and not is_equal(*change)
                and all(messages.is_sent_as(change.old, reading) for reading in readings)
            ):
                return True
        return False


def is_equal(one: Any, other: Any) -> bool:
    """Return whether two values of a source are the same, and of one type."""
    return type(one) is type(other) and bool(one == other)
