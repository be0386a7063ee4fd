"""Observations: what a message shows of a field that was to be changed."""

import math
import time
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence

from rosslt import messages, values
from rosslt.values import SOURCE, Source

#: How near a number that comes no nearer must be, relative to the target: the node may have iterated.
NEAR = 1e-6

#: The most numbers that a text about a field names.
MOST_NAMED = 3


class Expression:
    """The expression that computed a part of a message, without its numbers.

    Args:
        part: a scalar, a message or an array, with tracked leaves.

    Attributes:
        sources: what it was computed from. If a node takes another branch (`a if x < 5 else b`), sources come and go.
        readings: {source: its values that were used}; of a counter or an integral several.
    """

    def __init__(self, part: Any) -> None:
        tracked = [leaf for _, leaf in values.leaves(part) if values.is_tracked(leaf)]
        self.sources: List[Source] = values.sources(tracked)
        self.readings: Dict[Source, List[messages.Scalar]] = {}
        for kind, *rest in values.disassemble(tracked)[0]:
            if kind == SOURCE:
                self.readings.setdefault(rest[0], []).append(rest[1])


class Observation(NamedTuple):
    """A field as a message has it.

    Attributes:
        number: how many messages there were up to this one, since the first change.
        at: when it came, a time of `time.monotonic`.
        part: the field, with its provenance.
        expression: how it was computed.
        distance: how far it is from the target.
        is_reached: whether it is the target.
        is_near: whether it is within NEAR of the target.
    """

    number: int
    at: float
    part: Any
    expression: Expression
    distance: float
    is_reached: bool
    is_near: bool


def observe(
    part: object, wanted: object, type_: str = '', number: int = 0, is_reached: Optional[bool] = None
) -> Observation:
    """The Observation of a part of a message that has just come.

    Args:
        part, wanted, type_: as in `messages.is_reached`.
        number: of the message.
        is_reached: whether it is the target, if that is judged in another way.
    """
    return Observation(
        number,
        time.monotonic(),
        part,
        Expression(part),
        messages.distance(part, wanted),
        messages.is_reached(part, wanted, type_) if is_reached is None else is_reached,
        messages.is_reached(part, wanted, type_, NEAR),
    )


def comes_from(sources: Sequence[Source], name_of: Callable[[Source], str]) -> str:
    """Say what a thing comes from that no longer comes from what was changed."""
    names = [name_of(source) for source in sources]
    more = [f'{len(names) - MOST_NAMED} more'] if len(names) > MOST_NAMED else []
    return f'it comes from {", ".join([*names[:MOST_NAMED], *more]) or "no known number"} now'


def is_alike(one: Observation, other: Observation) -> bool:
    """Return whether a field stands still in two observations: it is the same, or has moved by less than NEAR of its
    way to the target, as the command of a robot that settles at its goal."""
    before = values.untracked(one.part)
    moved = messages.distance(other.part, before)
    return messages.is_reached(other.part, before) or moved <= NEAR * min(one.distance, other.distance) < math.inf
