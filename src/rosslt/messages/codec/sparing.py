"""Provenance for messages that are sent more often than their provenance can be written.

All publishers of a process together may spend a share of a core on it. What they spend more, they make up for: until
then messages carry the provenance that was written last, as long as it holds for them. A field that stands still holds its expression; one
that moves, the slopes that it had then, and its present value.
"""

import time
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt.messages.codec.encoder import Leaf, encoded_with_slopes, provenance_to_send
from rosslt.messages.codec.wire_format import BYTES_LIMIT, FIELD_LIMIT
from rosslt.messages.codegen.walkers import walkers
from rosslt.values import has_form_of, is_same

SHARE = 0.02
"""The share of a core that is spent on provenance."""

MOST_KNOWN = 4
"""How many sorts of messages of one publisher are remembered."""

MOST_NEW, MOST_NEW_IN_DEBT = 0.05, 0.5
"""The share of tracked leaves that may be new since a provenance was written; and where very much was spent on it."""

DEEP_DEBT = 0.5
"""How many seconds there are to wait where very much was spent."""


class _Known(NamedTuple):
    """What was written for a message."""

    indices: List[int]
    ids: List[int]
    leaves: Dict[int, Leaf]
    moving: Set[int]
    """The indices of the leaves of which the slopes were written."""
    data: bytes


class Allowance:
    """What may be spent on provenance.

    Attributes:
        free_at: when what was spent is made up for, by the monotonic clock.
    """

    def __init__(self) -> None:
        self.free_at = 0.0

    def charge(self, now: float, write: Callable[[], bytes]) -> bytes:
        """Write something, whatever it costs."""
        start = time.thread_time()
        data = write()
        self.free_at = max(now, self.free_at) + (time.thread_time() - start) / SHARE
        return data


class SparingProvenance:
    """The provenance of the messages of one publisher.

    Args:
        allowance: that of all publishers of the process.
    """

    def __init__(self, allowance: Allowance) -> None:
        self._allowance = allowance
        self._known: List[_Known] = []
        self._moved: Set[int] = set()

    def forget(self) -> None:
        """Write the next provenance anew: something has changed that it is made of."""
        self._known = []

    def to_send(self, message: Any, full_history: bool = False) -> bytes:
        """As `provenance_to_send`, or what that gave for an earlier message."""
        now = time.monotonic()
        debt = self._allowance.free_at - now
        if full_history or (debt <= 0 and not self._known):
            return self._allowance.charge(now, lambda: provenance_to_send(message, full_history))
        leaves: List[Leaf] = []
        walkers(message.__class__).collect(message, 0, leaves.append)
        if not leaves:
            return b''
        if debt > 0:
            known = self._holding(leaves, debt)
            if known is not None:
                return known.data
        return self._allowance.charge(now, lambda: self._written(message, leaves))

    def _holding(self, leaves: Sequence[Leaf], debt: float) -> Optional[_Known]:
        """What was written that holds for these leaves, None where nothing does."""
        indices = [index for index, _, _ in leaves]
        ids = [id(value) for _, value, _ in leaves]
        for known in self._known:
            if known.ids == ids and known.indices == indices:
                return known
        by_index: Dict[int, Tuple[Any, str]] = {}
        for known in self._known:
            by_index = by_index or {index: (value, kind) for index, value, kind in leaves}
            most_new = MOST_NEW if debt < DEEP_DEBT else MOST_NEW_IN_DEBT
            if len(leaves) - len(known.leaves) <= most_new * len(leaves) and self._holds(known, by_index):
                return known
        return None

    def _holds(self, known: _Known, by_index: Dict[int, Tuple[Any, str]]) -> bool:
        moved = []
        for index, leaf, kind in known.leaves.values():
            value, present_kind = by_index.get(index, (None, ''))
            if value is leaf:
                continue
            if present_kind != kind or not has_form_of(value, leaf):
                return False
            if index not in known.moving and not is_same(value, leaf):
                moved.append(index)
        self._moved.update(moved)
        return not moved

    def _written(self, message: Any, leaves: List[Leaf]) -> bytes:
        if len(leaves) > FIELD_LIMIT:
            return provenance_to_send(message)
        indices = [index for index, _, _ in leaves]
        before = next((known.leaves for known in self._known if known.indices == indices), {})
        moving = self._moved | {
            index for index, value, _ in leaves if index in before and not is_same(value, before[index][1])
        }
        self._moved = set()
        data = encoded_with_slopes(message._type, leaves, moving)
        if len(data) > BYTES_LIMIT:
            return provenance_to_send(message)
        known = _Known(indices, [id(value) for _, value, _ in leaves], {leaf[0]: leaf for leaf in leaves}, moving, data)
        others = [one for one in self._known if one.indices != indices]
        self._known = [known, *others[: MOST_KNOWN - 1]]
        return data
