"""Constraints on an answer: the sources that may change, their bounds, ranks and weights."""

import math
from typing import Callable, Collection, Iterable, List, Mapping, NamedTuple, Optional, Tuple, Union

from ..annotations import Value
from ..sources import UNKNOWN, Source

ORDINARY = 2 * math.pi
"""Sources without bounds move alike up to this size, so that angles do, and in proportion to their size beyond it."""

Bounds = Mapping[Source, Tuple[Value, Value]]
Rank = Union[Mapping[Source, int], Callable[[Source], int]]


class Freedom(NamedTuple):
    """The sources that may change, with their bounds, ranks and weights.

    Attributes:
        only: the sources that may change, None for any.
        bounds: `{Source: (minimum or None, maximum or None)}`.
        read_only: sources that may not change.
        rank: gives each source's rank; one of a higher rank changes only if those of lower ranks do not suffice.
        weights: `{Source: how hard it is to move}`.
        restarts: whether a search that has failed near the present values begins again anywhere within the bounds.
    """

    only: Optional[Collection[Source]]
    bounds: Bounds
    read_only: Collection[Source]
    rank: Callable[[Source], int]
    weights: Mapping[Source, float]
    restarts: bool = False

    def allows(self, source: Source) -> bool:
        """Return True if a source may change."""
        return source != UNKNOWN and source not in self.read_only and (self.only is None or source in self.only)

    def takes(self, source: Source, value: float) -> bool:
        """Return True if a source may become a number."""
        low, high = self.limits(source)
        return self.allows(source) and low <= value <= high

    def ranked(self, sources: Iterable[Source]) -> List[Source]:
        """Sources in the order in which they are tried: by rank, then the stiff ones last, else in the order given."""
        return sorted(sources, key=lambda source: (self.rank(source), self.weights.get(source, 1.0)))

    def limits(self, source: Source) -> Tuple[float, float]:
        """A source's minimum and maximum, infinite if there is none."""
        low, high = self.bounds.get(source, (None, None))
        return -math.inf if low is None else low, math.inf if high is None else high

    def scale(self, source: Source, value: float) -> float:
        """Return the scale of a source: a change by it counts as much as a change by 1 of an ordinary unbounded source.

        The scale follows from the source's weight, else from the range of its bounds, else from its size.

        Args:
            value: the source's present value.
        """
        if source in self.weights:
            return 1.0 / self.weights[source]
        low, high = self.limits(source)
        return high - low if 0 < high - low < math.inf else max(1.0, abs(value) / ORDINARY)


def in_floats(limits: Tuple[Value, Value]) -> Tuple[float, float]:
    """A minimum and a maximum as floats, infinite if no float holds them."""
    low, high = map(_in_float, limits)
    return low, high


def _in_float(limit: Value) -> float:
    try:
        return float(limit)
    except OverflowError:
        return math.inf if limit > 0 else -math.inf


def rank_of(rank: Optional[Rank]) -> Callable[[Source], int]:
    """Ranks as a function of a Source."""
    if rank is None:
        return lambda source: 0
    if isinstance(rank, Mapping):
        ranks = rank
        return lambda source: ranks.get(source, 0)
    return rank
