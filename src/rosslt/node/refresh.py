"""Values that a node read once follow their sources: messages are evaluated anew where sources have changed since.

A node may fill a message, a list of waypoints or `self.gain` once, and send it for hours. Plain Python would go on
sending the value that was read at the start. Here, a message that is about to be sent is looked through for readings
of this node's locations that are not the latest ones, and the leaves that depend on them are computed again in a copy.
The node's own message stays as it is.

While no replaced reading is in use anywhere in the process, that look is one test of a dict.

Not evaluated anew is what is a record of several moments rather than a function of its sources:

- a value that was made from different readings of one source (a counter or an integral that went on after a change);
- a value that grows: in which a source comes up more and more often from message to message, as in `x += v * dt`, or so
  often that the expression has been folded.
"""

import itertools
import sys
import threading
import time
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

import rospy

from rosslt import messages, values
from rosslt.values import AFFINE, CONSTANT, SOURCE, Source

#: The most replaced readings of one source that are remembered: of more, the first one is kept and the latest.
MAX_READINGS = 256

#: For how many messages a sent leaf is remembered, and up to twice as many.
ROUND = 32

#: How many leaves of a message are evaluated at once, and how many in a second where messages are larger.
MOST_AT_ONCE, MOST_IN_A_SECOND = 1 << 14, 20_000

#: How many may be kept before those that nothing depends on are dropped.
_PRUNE_AT = 32


#: Sources of which replaced readings are in use: {Source: ({their values}, the latest value)}.
_Outdated = Dict[Source, Tuple[Set[Any], Any]]


def _in_use(readings: List[Any], unused: int = 0) -> List[Any]:
    """The readings that are referred to from elsewhere, for example by a value that was computed from them."""
    return [reading for reading in readings if sys.getrefcount(reading) > unused]


def _references_from_here() -> int:
    """How many references `_in_use` counts of an object that nothing but the list refers to."""
    unused = 0
    while _in_use([object()], unused):
        unused += 1
    return unused


_UNUSED = _references_from_here()


class ReplacedReadings:
    """The readings of this node's locations that later ones have replaced, for as long as values depend on them.

    A reading is the tracked value that a location gives, until its value changes, to all who read it; whatever is
    computed from it refers to it. So nothing can depend any more on a reading that only this list refers to.

    Attributes:
        replaced: {Source: [reading, ...]}; empty where all that this process holds is up to date.
        lock: held while values of locations change, of several at once for as long as it takes; setters of the user
            are called with it, so no thread that may hold a lock of the user's waits for it.
        changed: set by each change.
        count: how many changes there were.
    """

    def __init__(self) -> None:
        self.replaced: Dict[Source, List[Any]] = {}
        self.lock = threading.RLock()
        self.changed = threading.Event()
        self.count = 0
        self._latest: Dict[Source, Any] = {}
        # Nothing else is called with it. Reentrant, as a signal's handler may publish in the middle of a publish.
        self._own_lock = threading.RLock()

    def replace(self, reading: Any, value: Any) -> None:
        """Note that the location of a reading has another value now, a plain one of the location's type."""
        (source,) = values.sources(reading)
        with self._own_lock:
            self._latest[source] = value
            readings = self.replaced.setdefault(source, [])
            readings.append(reading)
            del reading
            if len(readings) >= _PRUNE_AT:
                readings[:] = _in_use(readings, _UNUSED)
                del readings[1 : len(readings) + 1 - MAX_READINGS]
        self.count += 1
        self.changed.set()

    def outdated(self) -> _Outdated:
        """The sources of which replaced readings are in use."""
        with self._own_lock:
            # Both are made anew, as a source that got the name of its node since has another hash.
            self._latest = dict(self._latest.items())
            used: Dict[Source, List[Any]] = {}
            for source, readings in self.replaced.items():
                readings[:] = _in_use(readings, _UNUSED)
                if readings:
                    used.setdefault(source, []).extend(readings)
            self.replaced = used
            return {
                source: (set(values.untracked(readings)), self._latest[source])
                for source, readings in self.replaced.items()
            }


#: Of this process, which is one node.
READINGS = ReplacedReadings()


def change_count() -> int:
    """How many changes of this node's locations there were so far."""
    return READINGS.count


class Refresher:
    """Evaluates the messages of one publisher, service or caller anew."""

    def __init__(self) -> None:
        self._last: Dict[int, _Leaf] = {}  # by its index, what the message before had
        # Leaves of this round by the ids of their values, which they keep alive; and leaves of the round before.
        self._known: Dict[int, _Leaf] = {}
        self._older: Dict[int, _Leaf] = {}
        self._round = 0
        self._outdated: _Outdated = {}
        self._version = 0
        self._looked_at = 0.0

    def fresh(self, message: Any, was_sent: bool = False) -> Any:
        """A message with the present values of its sources: itself where it has them, else a copy.

        Args:
            message: an ordinary message.
            was_sent: this same message has been sent before.
        """
        outdated = READINGS.outdated()
        if not outdated:
            self._last, self._known, self._older = {}, {}, {}
            return message
        self._round = (self._round + 1) % ROUND
        if not self._round:
            self._known, self._older = {}, self._known
        if outdated != self._outdated:
            self._outdated = outdated
            self._version += 1
        try:
            fields = messages.tracked_fields(message)
        except (TypeError, AttributeError):
            return message  # it is serializing it that says what is wrong
        known = self._known
        unknown: Dict[int, Any] = {}
        for _, value, _ in fields:
            if id(value) not in known:
                if id(value) in self._older:
                    known[id(value)] = self._older[id(value)]
                else:
                    unknown[id(value)] = value
        most = self._most_at_once(was_sent)
        chosen = dict(itertools.islice(unknown.items(), most))
        made_from = dict(zip(chosen, _dependencies(list(chosen.values()))))
        last = {}
        for index, value, kind in fields:
            leaf = known.get(id(value))
            if leaf is None:
                if id(value) not in made_from:
                    continue
                leaf = _Leaf(value, kind, made_from[id(value)], self._last.get(index))
                known[id(value)] = leaf
            last[index] = leaf
            if was_sent:
                leaf.was_sent()
        others = (leaf for leaf in last.values() if leaf.version != self._version)
        _evaluate(itertools.islice(others, most), outdated, self._version)
        replaced = {}
        for index, leaf in last.items():
            leaf.was_sent()
            if leaf.fresh is not leaf.value:
                replaced[index] = leaf.fresh
        self._last = last
        return messages.with_leaves(message, replaced) if replaced else message

    def _most_at_once(self, is_all: bool) -> Optional[int]:
        """How many leaves are evaluated for this message: a node that sends more and more without a pause must answer.

        The others follow with the next messages. Where there is time enough between messages, that is all of them.
        """
        now = time.monotonic()
        most = max(MOST_AT_ONCE, int((now - self._looked_at) * MOST_IN_A_SECOND)) if self._looked_at else MOST_AT_ONCE
        self._looked_at = now
        return None if is_all else most


def _evaluate(leaves: Iterable['_Leaf'], outdated: _Outdated, version: int) -> None:
    """Give leaves the latest values of their sources. What several are computed from is evaluated once.

    Args:
        version: of what is outdated.
    """
    together: Dict[Tuple[Any, ...], List[_Leaf]] = {}
    for leaf in leaves:
        leaf.version = version
        changes = leaf.changes(outdated)
        if changes != leaf.changed:
            leaf.changed = changes
            leaf.fresh = leaf.value
            if changes:
                together.setdefault(tuple(changes.items()), []).append(leaf)
    for group in together.values():
        changes = group[0].changed
        try:
            found = values.reapply([leaf.value for leaf in group], changes)
        except (ArithmeticError, ValueError, TypeError):
            found = [_reapplied(leaf.value, changes) for leaf in group]
        for leaf, value in zip(group, found):
            leaf.take(value)


def _reapplied(value: Any, changes: Dict[Source, Any]) -> Any:
    try:
        return values.reapply(value, changes)
    except (ArithmeticError, ValueError, TypeError) as error:
        rospy.logwarn('%s is sent unchanged, as it has no value any more: %s', values.explain(value), error)
        return value


class _Leaf:
    """A tracked leaf of a message, and what it depends on.

    Args:
        value: of the leaf.
        kind: what its field takes: 'd' or 'f' for numbers, 'i' for whole ones, 'b', 's'.
        made_from: what it depends on.
        before: what the message before had in its place, or None.

    Attributes:
        changed: the changes of its sources that it was evaluated for.
        fresh: its value with them, the very same one where there are none.
        version: of what was outdated when it was evaluated.
    """

    def __init__(self, value: Any, kind: str, made_from: '_Dependencies', before: 'Optional[_Leaf]') -> None:
        self.value = value
        self._kind = kind
        self._readings, self._joins = made_from
        #: Sources that come up in an expression more than once, where it is not known yet whether it grows.
        self._undecided: Set[Source] = set()
        for source, joins in self._joins.items():
            if before is None or source not in before._joins:
                self._undecided.add(source)
            elif source not in before._readings or joins != before._joins[source]:
                self._readings.pop(source, None)
        self.changed: Dict[Source, Any] = {}
        self.fresh = value
        self.version = 0

    def was_sent(self) -> None:
        """This same value has been sent: it does not grow."""
        if self._undecided:
            self._undecided.clear()
            self.version = 0

    def changes(self, outdated: _Outdated) -> Dict[Source, Any]:
        """The latest values of those of its sources of which it was made from an earlier one."""
        changes = {}
        for source, reading in self._readings.items():
            if source in outdated and source not in self._undecided:
                replaced, latest = outdated[source]
                is_other = reading != latest or type(reading) is not type(latest)
                if is_other and reading in replaced and _is_number(reading) == _is_number(latest):
                    changes[source] = latest
        return changes

    def take(self, found: Any) -> None:
        """Have a value that it was found to have, where its field takes that."""
        if type(found) is type(self.value) or (self._kind in 'df' and _is_number(found)):
            self.fresh = found
        elif self._kind == 'i' and isinstance(found, float):
            # An int literal may have become a float; a field of whole numbers accepts no float.
            whole = values.to_int(found)
            self.fresh = whole if whole == found else self.value


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(values.untracked(value), bool)


class _Dependencies(NamedTuple):
    """What a value was made from.

    Attributes:
        readings: {Source: the reading}, of those sources of which one reading was used, and not in a folded expression.
        joins: {Source: number of operations of which both operands depend on it}, where there are such.
    """

    readings: Dict[Source, Any]
    joins: Dict[Source, int]


def _dependencies(leaves: Sequence[Any]) -> List[_Dependencies]:
    """What each of several values was made from. What they have in common is gone through once.

    Sets of sources, of readings and of operations are the bits of ints, which are joined in no time.
    """
    instructions, places = values.disassemble(leaves)
    bits: Dict[Source, int] = {}
    readings: List[Tuple[Source, Any]] = []
    joins: Dict[int, int] = {}  # by the sources that both operands depend on, the operations
    depends: List[int] = []  # of each instruction the sources
    read: List[int] = []  # of each the readings,
    folded: List[int] = []  # the sources that it depends on by a folded expression,
    joined: List[int] = []  # and the operations that join
    for number, (kind, *rest) in enumerate(instructions):
        operands = rest if kind not in (SOURCE, CONSTANT, AFFINE) else ()
        if kind == AFFINE:
            operands = [place for place, _ in rest[1]]
        sources = used = lost = made = 0
        for operand in operands:
            sources |= depends[operand]
            used |= read[operand]
            lost |= folded[operand]
            made |= joined[operand]
        if kind == SOURCE:
            source, reading = rest
            sources = bits.setdefault(source, 1 << len(bits))
            used = 1 << len(readings)
            readings.append((source, reading))
        elif kind == AFFINE:
            lost = sources
        elif len(operands) == 2:
            both = depends[operands[0]] & depends[operands[1]]
            if both:
                made |= 1 << number
                joins[both] = joins.get(both, 0) | 1 << number
        depends.append(sources)
        read.append(used)
        folded.append(lost)
        joined.append(made)
    return [
        _Dependencies(
            _single([readings[number] for number in _numbers(read[place])], bits, folded[place]),
            _counts({both: bin(of & joined[place]).count('1') for both, of in joins.items()}, bits),
        )
        for place in places
    ]


def _numbers(bits: int) -> Iterator[int]:
    """The numbers of the bits that are set."""
    while bits:
        lowest = bits & -bits
        yield lowest.bit_length() - 1
        bits ^= lowest


def _single(readings: List[Tuple[Source, Any]], bits: Dict[Source, int], folded: int) -> Dict[Source, Any]:
    """The readings of those sources of which there is one, and not in a folded expression."""
    found: Dict[Source, Any] = {}
    dropped = folded
    for source, reading in readings:
        if found.setdefault(source, reading) != reading:
            dropped |= bits[source]
    return {source: reading for source, reading in found.items() if not bits[source] & dropped}


def _counts(joins: Dict[int, int], bits: Dict[Source, int]) -> Dict[Source, int]:
    found = {both: count for both, count in joins.items() if count}
    sums = {source: sum([count for both, count in found.items() if both & bit]) for source, bit in bits.items()}
    return {source: count for source, count in sums.items() if count}
