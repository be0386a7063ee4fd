"""Values that a node read once follow their sources: messages are evaluated anew where sources have changed since.

A node may fill a message, a list of waypoints or `self.gain` once, and send it for hours. Plain Python would go on
sending the value that was read at the start. Here, a message that is about to be sent is searched for readings of this
node's locations that are not the latest ones, and the leaves that depend on them are computed again in a copy. The
node's own message stays as it is.

While no replaced reading is in use anywhere in the process, that search is one test of a dict.

Not evaluated anew are records of several moments, which are no functions of their sources:

- a value that was made from different readings of one source (a counter or an integral that went on after a change);
- a value that grows: in which a source comes up more and more often from message to message, as in `x += v * dt`, or so
  often that the expression has been folded.
"""

import sys
import threading
from typing import Any, Callable, Collection, Dict, Hashable, List, NamedTuple, Optional, Sequence, Set, Tuple

import rospy

from rosslt import messages, values
from rosslt.messages import Message, Scalar
from rosslt.values import AFFINE, CONSTANT, SOURCE, Source

#: Sources of which replaced readings are in use: {Source: ({their values}, the latest value)}.
_Outdated = Dict[Source, Tuple[Set[Any], Any]]


def _in_use(readings: List[Any], unused: int = 0) -> List[Any]:
    """The readings that are referred to from elsewhere, for example by a value that was computed from them."""
    return [reading for reading in readings if sys.getrefcount(reading) > unused]


def _references_from_here() -> int:
    """The number of references that `_in_use` counts of an object which nothing but the list refers to."""
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
        lock: held while readings are replaced, for a moment: those of a change of several locations together.
            Reentrant, as a signal's handler may publish in the middle of a publish.
        on_change: what is called soon after each change.
        count: how many changes there were.
        rebind: is called with a reading and the one that follows it.
    """

    def __init__(self) -> None:
        self.replaced: Dict[Source, List[Any]] = {}
        self.lock = threading.RLock()
        self.on_change: Callable[[], None] = lambda: None
        self.count = 0
        self.rebind: Callable[[Any, Any], None] = lambda before, following: None
        self._latest: Dict[Source, Any] = {}

    def replace(self, reading: Any, value: Scalar, following: Any = None) -> None:
        """Note that the location of a reading has another value now.

        Args:
            reading: the one before.
            value: the plain one, of the location's type.
            following: the reading that is given from now on, where there is one.
        """
        if following is not None:
            self.rebind(reading, following)
        (source,) = values.sources(reading)
        with self.lock:
            self._latest[source] = value
            readings = self.replaced.setdefault(source, [])
            readings[:] = _in_use(readings, _UNUSED)
            readings.append(reading)
        self.count += 1
        self.on_change()

    def outdated(self) -> _Outdated:
        """The sources of which replaced readings are in use."""
        with self.lock:
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


#: The replaced readings of this process, which is one node.
READINGS = ReplacedReadings()


class Refresher:
    """Evaluates the messages of one publisher, service or caller anew. Several threads may use it."""

    def __init__(self) -> None:
        self._last: Dict[Hashable, Dict[int, _Sent]] = {}  # the leaves of the last message of each thing, by index

    def fresh(self, message: Message, was_sent: bool = False) -> Any:
        """A message with the present values of its sources: itself where it has them, else a copy.

        Args:
            message: an ordinary message.
            was_sent: this same message has been sent before.
        """
        outdated = READINGS.outdated()
        if not outdated:
            self._last = {}
            return message
        try:
            fields = messages.tracked_fields(message)
            thing = values.untracked(messages.thing_reader(message.__class__)(message))
        except (TypeError, AttributeError):
            return message  # its serialization reports the fault
        last, sent = self._last.get(thing, {}), {}
        groups: Dict[Tuple[Any, ...], List[Tuple[int, Any, str]]] = {}  # what is evaluated together, by the changes
        for field, made_from in zip(fields, _dependencies([value for _, value, _ in fields])):
            index, value, _ = field
            sent[index], growing = _compared(value, made_from, last.get(index), was_sent)
            changes = _changes(made_from, growing, outdated)
            if changes:
                groups.setdefault(tuple(changes.items()), []).append(field)
        if len(self._last) >= messages.MOST_THINGS:
            self._last = {}
        self._last[thing] = sent
        replaced = {}
        for changed, group in groups.items():
            for (index, value, kind), fresh in zip(group, _reapplied([value for _, value, _ in group], dict(changed))):
                replaced[index] = _fitted(value, fresh, kind)
        return messages.with_leaves(message, replaced) if replaced else message


#: {Source: (the reading that a value was made from, how often it comes up)}.
_MadeFrom = Dict[Source, Tuple[Any, int]]

#: Instead of the number of times that a source comes up, where that was another one in the message before.
GROWS = 0


class _Sent(NamedTuple):
    """A tracked leaf that was sent, and how often each source comes up in it, where that is more than once."""

    value: Scalar
    counts: Dict[Source, int]


def _compared(
    value: Scalar, made_from: _MadeFrom, before: Optional[_Sent], was_sent: bool
) -> Tuple[_Sent, Collection[Source]]:
    """A leaf that is sent, and the sources in which it grows or may do so, which are not followed.

    Args:
        before: the leaf at its index in the message before.
        was_sent: it has been sent before.
    """
    if before is not None and before.value is value:
        return before, [source for source, count in before.counts.items() if count == GROWS]
    known = {} if before is None else before.counts
    counts = {
        source: count if known.get(source, count) == count else GROWS
        for source, (_, count) in made_from.items()
        if count > 1
    }
    if was_sent:
        known = counts
    return _Sent(value, counts), [source for source, count in counts.items() if count == GROWS or source not in known]


def _changes(made_from: _MadeFrom, growing: Collection[Source], outdated: _Outdated) -> Dict[Source, Any]:
    """The latest values of those sources of a leaf of which it was made from an earlier one."""
    changes = {}
    for source, (reading, _) in made_from.items():
        if source in outdated and source not in growing and reading is not _SEVERAL:
            replaced, latest = outdated[source]
            is_other = reading != latest or type(reading) is not type(latest)
            if is_other and reading in replaced and _is_number(reading) == _is_number(latest):
                changes[source] = latest
    return changes


def _fitted(value: Scalar, fresh: Any, kind: str) -> Any:
    """The fresh value of a leaf where its field takes that, else the value that it has.

    Args:
        kind: what the field takes: 'd' or 'f' for numbers, 'i' for whole ones, 'b', 's'.
    """
    if type(fresh) is type(value) or (kind in 'df' and _is_number(fresh)):
        return fresh
    if kind == 'i' and isinstance(fresh, float):
        # An int literal may have become a float; a field of whole numbers accepts no float.
        whole = values.to_int(fresh)
        return whole if whole == fresh else value
    return value


#: Instead of a reading, where a value was made from several of one source, or folded.
_SEVERAL = object()


def _reapplied(leaves: Sequence[Any], changes: Dict[Source, Any]) -> Sequence[Any]:
    """The values of leaves after changes; those that have none any more stay as they are."""
    try:
        return values.reapply(leaves, changes)
    except (ArithmeticError, ValueError, TypeError) as error:
        if len(leaves) > 1:
            return [fresh for leaf in leaves for fresh in _reapplied([leaf], changes)]
        rospy.logwarn('%s is sent unchanged, as it has no value any more: %s', values.explain(leaves[0]), error)
        return leaves


def _is_number(value: Scalar) -> bool:
    return isinstance(value, (int, float)) and not isinstance(values.untracked(value), bool)


def _dependencies(leaves: Sequence[Any]) -> List[_MadeFrom]:
    """The sources of each of several values. What the values have in common is visited once."""
    instructions, indices = values.disassemble(leaves)
    made: List[_MadeFrom] = []
    for kind, *rest in instructions:
        if kind == SOURCE:
            source, reading = rest
            made.append({source: (reading, 1)})
        elif kind == CONSTANT:
            made.append({})
        elif kind == AFFINE:
            joined = _joined([made[index] for index, _ in rest[1]])
            made.append({source: (_SEVERAL, count) for source, (_, count) in joined.items()})
        else:
            made.append(_joined([made[index] for index in rest]))
    return [made[index] for index in indices]


def _joined(parts: List[_MadeFrom]) -> _MadeFrom:
    """The sources of an operation on several values."""
    if len(parts) == 1:
        return parts[0]
    joined: _MadeFrom = {}
    for part in parts:
        for source, (reading, count) in part.items():
            other, others = joined.get(source, (reading, 0))
            joined[source] = (reading if reading == other else _SEVERAL), count + others
    return joined
