"""Provenance for messages that are sent more often than their provenance can be written.

All publishers of a process together may spend a share of a core on it. What they spend more, they make up for: until
then messages carry the provenance that was written last, as long as it holds for them. A field that stands still holds
its expression; one that moves, the slopes that it had then, and its present value. A field that is made in another way
than what was written says has none until then; where that are many, they are written earlier, at a larger share.
"""

import dataclasses
import functools
import time
from typing import Any, Callable, Dict, List, Optional, Set, Tuple, TypeVar

from rosslt.messages.codec.encoder import Leaf, Written, encoded_with_slopes, provenance_to_send, sent_fields
from rosslt.messages.codec.wire_format import BYTES_LIMIT
from rosslt.messages.codegen.walkers import END, walkers
from rosslt.messages.leaves import locate
from rosslt.values import (
    HOLDS,
    HOLDS_NOT,
    IS_PLAIN,
    Source,
    WrittenFields,
    are_made_alike,
    is_same,
    made_alike,
    origins,
    replaced_fields,
    source_values,
    written_fields,
)

SHARE, MOST_SHARE = 0.01, 0.015
"""The share of a core that is spent on provenance; and where messages are made in other ways again and again."""

SAVED = 1.0
"""Of how many seconds what was not spent may be spent at once: what is sent together is written together."""

FIRST_WRITINGS = 5
"""How many messages of a publisher are written whatever that costs: by then it shows what moves."""

COSTLY = 0.02
"""The CPU time of a writing, in seconds, from which on the first two show enough."""

LONGEST, LONGEST_OF_LARGE = 2.0, 10.0
"""After how many seconds a publisher has its next whole message written, whatever others spend; and at most, where that
takes more than MOST_SHARE."""

MOST_KNOWN = 4
"""How many sorts of messages of one publisher are remembered."""

MOST_NEW, MOST_NEW_IN_DEBT = 0.05, 0.3
"""The share of tracked leaves that may be new since a provenance was written; and where very much was spent on it."""

LOOKING_SHARE = 0.02
"""The share of a core that is spent on finding out what else could hold, where what was written last does not."""

RENEWED_EVERY, RENEWING_SHARE = 0.1, 0.1
"""After how many seconds it is looked whether a source has another value by now than what was written says, as one of
another node may; and the share of a core that is spent on writing it anew while it goes on changing."""

DEEP_DEBT = 0.5
"""How many seconds there are to wait where very much was spent."""

TURN_REMEMBERED = 60.0
"""For how many seconds after a publisher has sent two things in turn, the same fields made from other sources, nothing
is recalled: a message that was not recorded may be about either."""


@dataclasses.dataclass(eq=False)
class _Known:
    """What was written for a message."""

    found: List[Leaf]
    """Its leaves in their order,"""
    leaves: Dict[int, Leaf]
    """and by their indices;"""
    plain: Dict[int, Any]
    """what they are without provenance."""
    moving: Set[int]
    """The indices of the leaves of which the slopes were written."""
    size: int
    """The number of all leaves of the message."""
    written: Written
    part: Tuple[bytes, bytes] = dataclasses.field(init=False, default=(b'', b''))
    """What was sent of it last, where it did not hold as a whole: what `compare_fields` told, and the provenance."""

    @functools.cached_property
    def fields(self) -> WrittenFields:
        """The leaves, to be compared with those of later messages."""
        return written_fields(self.found, self.moving)

    @functools.cached_property
    def source_values(self) -> Dict[int, Dict[Source, Any]]:
        """Of some leaves the values that their sources had."""
        return {index: source_values([self.leaves[index][1]]) for index in sorted(self.written.witnesses)}

    def is_outdated(self, message: Any) -> bool:
        """Whether a source has another value in a message that is made in the same way."""
        located = locate(message, [*self.source_values, END], [])
        for (_, _, value, _), earlier in zip(located, self.source_values.values()):
            present = source_values([value])
            if present.keys() == earlier.keys() and not all(map(is_same, present.values(), earlier.values())):
                return True
        return False

    def part_told(self, told: bytes) -> bytes:
        """The provenance of the leaves that hold, as `compare_fields` tells it."""
        if told.count(HOLDS) == len(told):
            return self.written.data
        if self.part[0] != told:
            held = {leaf[0] for leaf, one in zip(self.found, told) if one == HOLDS}
            self.part = told, self.written.only(held)
        return self.part[1]

    def is_near(self, missing: int, count: int, size: int, debt: float) -> bool:
        """Whether the tracked leaves of a message are mostly those that were written.

        Args:
            missing: how many of those that were written are plain in the message.
            count, size: how many leaves of the message are tracked, and how many it has in all.
            debt: in seconds, as of `_most_new`.
        """
        new = count - len(self.leaves) + missing
        if missing and (self.size != size or missing > MOST_NEW * size):
            return False
        return new <= _most_new(debt) * count


Result = TypeVar('Result')


class Allowance:
    """What may be spent on provenance.

    Attributes:
        free_at: when what was spent is made up for, by the monotonic clock.
        urgent_at: when it is for what is urgent.
        took: the CPU time of what was written last, in seconds.
    """

    def __init__(self) -> None:
        self.free_at = self.urgent_at = self.took = 0.0

    def charge(self, now: float, write: Callable[[], Result]) -> Result:
        """Write something, whatever it costs."""
        start = time.thread_time()
        result = write()
        self.took = time.thread_time() - start
        self.free_at = max(now - SAVED, self.free_at) + self.took / SHARE
        self.urgent_at = max(now - SAVED, self.urgent_at) + self.took / MOST_SHARE
        return result


class SparingProvenance:
    """The provenance of the messages of one publisher.

    Args:
        allowance: that of all publishers of the process.
    """

    def __init__(self, allowance: Allowance) -> None:
        self._allowance = allowance
        self._known: List[_Known] = []
        self._moved: Set[int] = set()
        self._turned_at = -TURN_REMEMBERED
        self._first = FIRST_WRITINGS
        self._due = 0.0
        self._nearest: Optional[_Known] = None  # of which something holds, when nothing held as a whole
        self._look_again = self._renew_at = 0.0

    @property
    def takes_turns(self) -> bool:
        """Whether the publisher has sent several things in turn, so that nothing is recalled."""
        return time.monotonic() < self._turned_at + TURN_REMEMBERED

    def forget(self) -> None:
        """Write the next provenance anew: something has changed that it is made of."""
        self._known = []
        self._first = FIRST_WRITINGS

    def to_send(self, message: Any, full_history: bool = False) -> bytes:
        """As `provenance_to_send`, or what that gave for an earlier message."""
        now = time.monotonic()
        debt = self._allowance.free_at - now
        if full_history or (debt <= 0 and not self._known):
            return self._allowance.charge(now, lambda: provenance_to_send(message, full_history))
        if debt > 0 and self._known:
            if now >= self._renew_at and self._is_outdated(message, now):
                return self._write(now, message, *self._collected(message))
            data = self._compared(message, now, debt)
            if data is not None:
                return data
        start = time.thread_time()
        leaves, size = self._collected(message)
        if not leaves:
            return b''
        if debt > 0:
            present = _Present(leaves)
            known = self._holding(present, size, debt)
            if known is not None:
                return known.written.only(present.by_index)
            if not self._first and now < self._due:
                held = self._held(present, now, debt)
                if held is not None:
                    self._look_again = now + (time.thread_time() - start) / LOOKING_SHARE
                    return held
        return self._write(now, message, leaves, size)

    def remembered(self, message: Any) -> bytes:
        """The provenance of a message, written anew, which is sent with later ones that are not recorded."""
        if self.takes_turns:
            return self.to_send(message)  # nothing is recalled
        leaves, size = self._collected(message)
        if not self._known:  # whatever was computed may move
            self._moved |= {index for index, value, _ in leaves if origins([value]) is None}
        return self._write(time.monotonic(), message, leaves, size)

    def recalled(self, message: Any) -> bytes:
        """The provenance of a message of which not all that it was computed by was recorded: that of an earlier one,
        or, where the publisher sends several things in turn, of what was recorded."""
        leaves, size = self._collected(message)
        present = _Present(leaves)
        if self.takes_turns:
            now = time.monotonic()
            held = self._held(present, now, self._allowance.free_at - now) if self._allowance.free_at > now else None
            return self._allowance.charge(now, lambda: provenance_to_send(message)) if held is None else held
        for known in sorted(self._known, key=lambda one: -len(one.leaves)):
            if known.size == size and known.leaves.keys() >= present.by_index.keys():
                doubtful = _changed(known, message, present)
                if doubtful is None:
                    continue
                if doubtful:
                    known = self._without(known, message, doubtful)
                moved = present.moved(known)
                if moved is not None:
                    if moved:
                        known = self._with_slopes(known, message, known.moving | moved)
                    return known.written.data
        return self.to_send(message)

    def _collected(self, message: Any) -> Tuple[List[Leaf], int]:
        """The tracked leaves of a message, and the number of all of its leaves."""
        return sent_fields(message, self._known[0].found if self._known else ())

    def _is_outdated(self, message: Any, now: float) -> bool:
        """Whether what was written for messages like this one says another value of a source."""
        start = time.thread_time()
        found = any(known.is_outdated(message) for known in self._known)
        self._renew_at = now + max(RENEWED_EVERY, (time.thread_time() - start) / LOOKING_SHARE)
        return found

    def _compared(self, message: Any, now: float, debt: float) -> Optional[bytes]:
        """What was written that holds for a message, as a comparison field by field tells it; None where it has to be
        looked into."""
        compare = walkers(message.__class__).compare
        last = self._known[0]
        told, count, size = compare(message, last.fields)
        if HOLDS_NOT not in told and last.is_near(told.count(IS_PLAIN), count, size, debt):
            return last.part_told(told)
        if self._first or now >= min(self._due, self._look_again):
            return None
        nearest = self._nearest
        if nearest is None or not any(nearest is one for one in self._known):
            return None
        if nearest is not last:
            told, count, _ = compare(message, nearest.fields)
        if self._is_to_be_written(told.count(HOLDS), count, now, debt):
            return None
        return nearest.part_told(told)

    def _without(self, known: _Known, message: Any, doubtful: Set[int]) -> _Known:
        """What is known of a message, without what was computed and stood still, and does so no more: it may be made of
        other sources by now, which nobody recorded."""
        leaves = {index: leaf for index, leaf in known.leaves.items() if index not in doubtful}
        made = dataclasses.replace(known, found=list(leaves.values()), leaves=leaves)
        self._known = [made if one is known else one for one in self._known]
        return self._with_slopes(made, message, made.moving)

    def _with_slopes(self, known: _Known, message: Any, moving: Set[int]) -> _Known:
        leaves = list(known.leaves.values())
        written = self._allowance.charge(time.monotonic(), lambda: encoded_with_slopes(message._type, leaves, moving))
        made = dataclasses.replace(known, moving=moving, written=written)
        self._known = [made if one is known else one for one in self._known]
        return made

    def _holding(self, present: '_Present', size: int, debt: float) -> Optional[_Known]:
        """What was written that holds for a message, None where nothing does."""
        count = len(present.leaves)
        for place, known in enumerate(self._known):
            if not present.has_fields_of(known):
                missing = len(known.leaves.keys() - present.by_index.keys())
                if not known.is_near(missing, count, size, debt):
                    continue
            moved = present.moved(known)
            if not moved and moved is not None:
                if any(one.leaves.keys() == known.leaves.keys() for one in self._known[:place]):
                    self._turned_at = time.monotonic()
                    self._known.insert(0, self._known.pop(place))
                return known
            self._moved |= moved or set()
        return None

    def _held(self, present: '_Present', now: float, debt: float) -> Optional[bytes]:
        """What was written of those leaves of a message for which it holds; None where it is time to write it."""
        if not self._known:
            return None if now >= self._allowance.urgent_at else b''
        known = next((one for one in self._known if present.has_fields_of(one)), self._known[0])
        held = present.held(known)
        if self._is_to_be_written(len(held), len(present.leaves), now, debt):
            return None
        self._nearest = known
        return known.written.only(held)

    def _is_to_be_written(self, held: int, count: int, now: float, debt: float) -> bool:
        """Whether what was written holds for so few leaves of a message that it is written anew."""
        return now >= self._allowance.urgent_at and held < (1 - _most_new(debt)) * count

    def _write(self, now: float, message: Any, leaves: List[Leaf], size: int) -> bytes:
        data = self._allowance.charge(now, lambda: self._written(message, leaves, size))
        is_enough = self._allowance.took >= COSTLY and self._first < FIRST_WRITINGS
        self._first = 0 if is_enough else max(0, self._first - 1)
        self._renew_at = now + max(RENEWED_EVERY, self._allowance.took / RENEWING_SHARE)
        self._due = now + min(max(LONGEST, self._allowance.took / MOST_SHARE), LONGEST_OF_LARGE)
        return data

    def _written(self, message: Any, leaves: List[Leaf], size: int) -> bytes:
        by_index = {leaf[0]: leaf for leaf in leaves}
        values = [value for _, value, _ in leaves]
        # What became doubtful since is not among those that were written before.
        alike = [known for known in self._known if known.size == size and known.leaves.keys() <= by_index.keys()]
        same = [known for known in alike if len(known.leaves) == len(by_index)]
        replaced = [known for known in same if are_made_alike(values, [value for _, value, _ in known.found])]
        before = next((known.leaves for known in (*replaced, *same, *alike)), {})
        pairs = [(index, value, before[index][1]) for index, value, _ in leaves if index in before]
        if replaced:
            is_turned = replaced[0] is not same[0]
        else:
            is_turned = not are_made_alike([value for _, value, _ in pairs], [earlier for _, _, earlier in pairs])
        if is_turned:
            self._turned_at = time.monotonic()
        moving = self._moved | {
            index for index, value, earlier in pairs if value is not earlier and not is_same(value, earlier)
        }
        self._moved = set()
        written = encoded_with_slopes(message._type, leaves, moving)
        if len(written.data) > BYTES_LIMIT:
            return provenance_to_send(message)
        plain = {index: value._plain for index, value, _ in leaves}
        known = _Known(leaves, by_index, plain, moving, size, written)
        others = [one for one in self._known if not any(one is another for another in replaced)]
        self._known = [known, *others[: MOST_KNOWN - 1]]
        return written.data


def _most_new(debt: float) -> float:
    return MOST_NEW if debt < DEEP_DEBT else MOST_NEW_IN_DEBT


def _changed(known: _Known, message: Any, present: '_Present') -> Optional[Set[int]]:
    """The leaves that stood still when they were written, are plain in a message and have other values there.

    None where one of them was a source itself, which has not changed.
    """
    tracked, moving = present.by_index, known.moving
    plain = [index for index in known.leaves if index not in tracked and index not in moving]
    values = [value for _, _, value, _ in locate(message, [*plain, END], [])]
    befores = [known.plain[index] for index in plain]
    changed: Set[int] = set()
    if values == befores:  # which takes a fraction of what follows
        return changed
    for index, value, before in zip(plain, values, befores):
        if not is_same(value, before):
            if origins([known.leaves[index][1]]):
                return None
            changed.add(index)
    return changed


class _Present:
    """The tracked leaves of a message that is to be sent.

    Attributes:
        leaves: in their order.
    """

    def __init__(self, leaves: List[Leaf]) -> None:
        self.leaves = leaves
        self._by_index: Optional[Dict[int, Leaf]] = None
        self._replaced: Dict[int, Tuple[_Known, Optional[List[int]]]] = {}  # by the ids of what was written

    @property
    def by_index(self) -> Dict[int, Leaf]:
        """The leaves by their indices."""
        if self._by_index is None:
            self._by_index = {leaf[0]: leaf for leaf in self.leaves}
        return self._by_index

    def has_fields_of(self, known: _Known) -> bool:
        """Whether the same fields were tracked when something was written."""
        return self._replaced_since(known) is not None

    def _replaced_since(self, known: _Known) -> Optional[List[int]]:
        # Thousands of leaves may stand still, so this is asked once.
        if id(known) not in self._replaced:
            self._replaced[id(known)] = known, replaced_fields(self.leaves, known.found)
        return self._replaced[id(known)][1]

    def held(self, known: _Known) -> Set[int]:
        """Those of these leaves of which holds what was written."""
        common = [leaf for leaf in self.leaves if leaf[0] in known.leaves]
        befores = [known.leaves[index] for index, _, _ in common]
        alike = made_alike([value for _, value, _ in common], [value for _, value, _ in befores])
        return {
            index
            for is_alike, (index, value, kind), (_, before, kind_before) in zip(alike, common, befores)
            if is_alike and kind == kind_before and (index in known.moving or value is before or is_same(value, before))
        }

    def moved(self, known: _Known) -> Optional[Set[int]]:
        """Which of these leaves are others than they were, though made in the same way; None where some were made in
        another way. What moved when it was written may have moved again."""
        leaves, befores, places = self.leaves, known.found, self._replaced_since(known)
        if places is None:
            leaves = [leaf for leaf in leaves if leaf[0] in known.leaves]
            befores = [known.leaves[index] for index, _, _ in leaves]
            places = replaced_fields(leaves, befores)
            if places is None:
                return None  # a field of another kind
        values, earlier = [leaves[place][1] for place in places], [befores[place][1] for place in places]
        if not are_made_alike(values, earlier):
            return None
        indices = [leaves[place][0] for place in places]
        return {
            index
            for index, value, before in zip(indices, values, earlier)
            if index not in known.moving and not is_same(value, before)
        }
