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

import sys
import threading
from typing import Any, Dict, List, Optional, Set, Tuple

import rospy

from rosslt import messages, values
from rosslt.values import AFFINE, CONSTANT, SOURCE, Source

#: The most replaced readings of one source that are remembered: of more, the first one is kept and the latest.
MAX_READINGS = 256

#: For how many messages a sent leaf is remembered, and up to twice as many.
ROUND = 32

#: How many may be kept before those that nothing depends on are dropped.
_PRUNE_AT = 32


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

    def replace(self, reading: Any, latest: Any) -> None:
        """Note that a location has a new reading."""
        (source,) = values.sources(reading)
        value = values.untracked(latest)
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

    def outdated(self) -> Dict[Source, Tuple[Set[Any], Any]]:
        """The sources of which replaced readings are in use: {Source: ({their values}, the latest value)}."""
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
        last, replaced = {}, {}
        for index, value, kind in messages.tracked_fields(message):
            leaf = last[index] = self._leaf(index, value, kind)
            if was_sent:
                leaf.was_sent()
            fresh = leaf.fresh(outdated)
            leaf.was_sent()
            if fresh is not value:
                replaced[index] = fresh
        self._last = last
        return messages.with_leaves(message, replaced) if replaced else message

    def _leaf(self, index: int, value: Any, kind: str) -> '_Leaf':
        leaf = self._known.get(id(value))
        if leaf is None:
            leaf = self._older.get(id(value)) or _Leaf(value, kind, self._last.get(index))
            self._known[id(value)] = leaf
        return leaf


class _Leaf:
    """A tracked leaf of a message, and what it depends on.

    Args:
        value: of the leaf.
        kind: what its field takes: 'd' or 'f' for numbers, 'i' for whole ones, 'b', 's'.
        before: what the message before had in its place, or None.
    """

    def __init__(self, value: Any, kind: str, before: 'Optional[_Leaf]') -> None:
        self.value = value
        self._kind = kind
        self._readings, self._joins = _dependencies(value)
        #: Sources that come up in an expression more than once, where it is not known yet whether it grows.
        self._undecided: Set[Source] = set()
        for source, joins in self._joins.items():
            if before is None or source not in before._joins:
                self._undecided.add(source)
            elif source not in before._readings or joins != before._joins[source]:
                self._readings.pop(source, None)
        self._changes: Dict[Source, Any] = {}
        self._fresh = value

    def was_sent(self) -> None:
        """This same value has been sent: it does not grow."""
        self._undecided.clear()

    def fresh(self, outdated: Dict[Source, Tuple[Set[Any], Any]]) -> Any:
        """The value with the latest values of its sources, the very same one where it has them."""
        changes = {}
        for source, reading in self._readings.items():
            if source in outdated and source not in self._undecided:
                replaced, latest = outdated[source]
                is_other = reading != latest or type(reading) is not type(latest)
                if is_other and reading in replaced and _is_number(reading) == _is_number(latest):
                    changes[source] = latest
        if changes != self._changes:
            self._changes = changes
            self._fresh = self._evaluated(changes) if changes else self.value
        return self._fresh

    def _evaluated(self, changes: Dict[Source, Any]) -> Any:
        try:
            found = values.reapply(self.value, changes)
        except (ArithmeticError, ValueError, TypeError) as error:
            rospy.logwarn('%s is sent unchanged, as it has no value any more: %s', values.explain(self.value), error)
            return self.value
        if type(found) is type(self.value) or (self._kind in 'df' and _is_number(found)):
            return found
        # An int literal may have become a float; a field of whole numbers accepts no float.
        whole = values.to_int(found) if self._kind == 'i' and isinstance(found, float) else None
        return whole if whole is not None and whole == found else self.value


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(values.untracked(value), bool)


def _dependencies(value: Any) -> Tuple[Dict[Source, Any], Dict[Source, int]]:
    """What a value was made from.

    Returns:
        {Source: the reading}, of those sources of which one reading was used, and not in a folded expression; and
        {Source: number of operations of which both operands depend on it}, where there are such.
    """
    instructions, _ = values.disassemble([value])
    bits: Dict[Source, int] = {}
    readings: Dict[Source, Any] = {}
    dropped = 0
    joins: Dict[int, int] = {}
    depends: List[int] = []  # of each instruction the sources, as a sum of their bits
    for kind, *rest in instructions:
        if kind == SOURCE:
            source, reading = rest
            depends.append(bits.setdefault(source, 1 << len(bits)))
            if readings.setdefault(source, reading) != reading:
                dropped |= bits[source]
        elif kind == CONSTANT:
            depends.append(0)
        elif kind == AFFINE:
            depends.append(0)
            for index, _ in rest[1]:
                depends[-1] |= depends[index]
            dropped |= depends[-1]
        else:
            depends.append(depends[rest[0]] | depends[rest[-1]])
            both = depends[rest[0]] & depends[rest[-1]] if len(rest) == 2 else 0
            if both:
                joins[both] = joins.get(both, 0) + 1
    return (
        {source: reading for source, reading in readings.items() if not bits[source] & dropped},
        {
            source: sum(count for both, count in joins.items() if both & bit)
            for source, bit in bits.items()
            if any(both & bit for both in joins)
        },
    )
