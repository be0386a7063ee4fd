"""Provenance is sampled: a publisher writes it at a rate, and who asks for it keeps the last one of each thing.

A message is either whole, with the provenance of all its tracked leaves, or plain. What is one thing for publishers and
readers alike, `ThingReader` says.
"""

import functools
import threading
import time
from typing import Any, Callable, Dict, Hashable, List, NamedTuple, Optional, Tuple

from rosslt.messages.codec import provenance_to_send
from rosslt.messages.codegen.walkers import END, walkers
from rosslt.messages.fields import INSTANTS, SCALARS, Layout, kind_of
from rosslt.messages.leaves import locate, with_leaves
from rosslt.values import TRACKED_CLASSES, lazy_of, untracked

COSTLY = 0.0025
"""The CPU time in seconds from which on a provenance is written less often, in proportion: at 20 Hz, 5 % of a core."""

KEPT = 2.0
"""Time in seconds that a provenance is kept; a publisher that is still alive writes a new one sooner."""

MOST_THINGS = 1024
"""The most things that a publisher, or a reader, remembers."""

ThingReader = Callable[[Any], Tuple[Hashable, ...]]
"""Names the thing that a message is about, by its texts and whole numbers: frames, namespace and id of a marker. The
number and the times of headers do not count."""


@functools.lru_cache(maxsize=None)
def thing_reader(message_class: Any, reads_all: bool = False) -> ThingReader:
    """The ThingReader of a message class, compiled when first asked for.

    Args:
        message_class: the class of the messages.
        reads_all: read all elements of an array, and not the first one alone.
    """
    layout = walkers(message_class).layout
    functions: Dict[str, Any] = {}
    reader: ThingReader = functions[_write_reader(layout, layout.name, functions, reads_all)]
    return reader


def _write_reader(layout: Layout, type_: str, functions: Dict[str, Any], reads_all: bool) -> str:
    """Compile the ThingReader of a type into functions that call each other; returns its name."""
    read: List[str] = []

    def descend(owner: str, path: str) -> None:
        for field in layout.definitions[owner]:
            part = '%s.%s' % (path, field.name)
            if field.type in INSTANTS or (field.type in SCALARS and field.length is not None):
                continue
            if field.length is not None:
                name = _write_reader(layout, field.type, functions, reads_all)
                if functions[name] is not _read_nothing:
                    elements = 'tuple(map(%s, %s))' if reads_all else '%s(%s[0])'
                    read.append('%s if %s else ()' % (elements % (name, part), part))
            elif field.type not in SCALARS:
                descend(field.type, part)
            elif kind_of(field.type) in 'is' and (owner, field.name) != ('std_msgs/Header', 'seq'):
                read.append(part)

    descend(type_, 'm')
    name = 'thing_%d' % len(functions)
    functions[name] = _read_nothing
    if read:
        code = 'lambda m: (%s,)' % ', '.join(read)
        functions[name] = eval(compile(code, '<thing of %s>' % type_, 'eval'), functions)
    return name


def _read_nothing(message: Any) -> Tuple[Hashable, ...]:
    return ()


class SampledProvenance:
    """Decides for one publisher which of its messages are whole.

    Args:
        rate: gives how many messages of one thing are whole in a second, at most.
        clock: gives seconds.
    """

    def __init__(self, rate: Callable[[], float], clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._clock = clock
        self._due: Dict[Hashable, float] = {}
        self._state: Any = None

    def to_send(self, message: Any, full_history: bool, state: Any) -> bytes:
        """The provenance of a message that is sent now: b'' where it is sent plain.

        Args:
            message: an ordinary one.
            full_history: as of `encode`.
            state: whatever differs after a change, and after somebody has subscribed: the next message is whole.
        """
        if state != self._state:
            self._due.clear()
            self._state = state
        now, period = self._clock(), 1.0 / self._rate()
        try:
            thing = thing_reader(message.__class__)(message)
            due = self._due.get(thing)
        except (TypeError, AttributeError):
            return b''  # it is serializing the message that says what is wrong
        if due is not None and now < due - period / 2:  # the messages of a loop come a little earlier or later
            return b''
        start = time.thread_time()
        data = provenance_to_send(message, full_history)
        if data:
            if len(self._due) >= MOST_THINGS:
                self._due.clear()
            pause = min(max(1.0, (time.thread_time() - start) / COSTLY) * period, max(period, KEPT / 2))
            # on average one a pause: what comes early or late does not shift those that follow
            self._due[_plain(thing)] = now + pause if due is None else max(now, due + pause)
        return data


def _plain(thing: Tuple[Any, ...]) -> Hashable:
    return tuple(
        [
            _plain(each) if type(each) is tuple else untracked(each) if type(each) in TRACKED_CLASSES else each
            for each in thing
        ]
    )


class LastProvenance:
    """Keeps the last provenance of each thing, for a reader. Several threads may use it."""

    def __init__(self) -> None:
        self._kept: Dict[Hashable, _Kept] = {}
        self._lock = threading.Lock()

    def completed(self, message: Any, publisher: Hashable, now: Optional[float] = None) -> Any:
        """Complete a plain message that equals the last whole one of the same thing in each leaf that has provenance.

        Args:
            message: as received; not changed.
            publisher: the publisher of the message, with the topic if several topics are read.
            now: when it came, in seconds; by default now.

        Returns:
            the message itself where it is whole, or nothing is kept; a copy with provenance where it equals what is
            kept; None where it does not: its sources are told by the next whole one.
        """
        kept = self._of(message, publisher, now)
        if kept is None:
            return message
        found = kept.located(message)
        is_same = found is not None and all(map(_is_same, map(untracked, kept.leaves), found))
        return with_leaves(message, dict(zip(kept.wanted, kept.leaves))) if is_same else None

    def approximated(self, message: Any, publisher: Hashable, now: Optional[float] = None) -> Any:
        """Complete a message, also one that has moved: its expression is the last one plus the difference.

        Args:
            message, publisher, now: as of `completed`.
        """
        kept = self._of(message, publisher, now)
        found = None if kept is None else kept.located(message)
        if kept is None or found is None:
            return message
        return with_leaves(message, dict(zip(kept.wanted, map(_moved, kept.leaves, found))))

    def is_between(self, message: Any, publisher: Hashable, now: Optional[float] = None) -> bool:
        """Return True for a plain message whose publisher has just sent provenance for the same thing."""
        return self._of(message, publisher, now) is not None

    def _of(self, message: Any, publisher: Hashable, now: Optional[float]) -> 'Optional[_Kept]':
        """Return the stored provenance for a plain message; store the provenance of any other and return None."""
        now = time.monotonic() if now is None else now
        fields: List[Tuple[int, Any, str]] = []
        size = walkers(message.__class__).collect(message, 0, fields)
        thing = publisher, thing_reader(message.__class__)(message)
        with self._lock:
            if fields:
                if len(self._kept) >= MOST_THINGS:
                    self._kept.clear()
                wanted = [*(index for index, _, _ in fields), END]
                names = thing_reader(message.__class__, reads_all=True)(message)
                self._kept[thing] = _Kept(wanted, [each[1] for each in fields], size, names, now)
                return None
            kept = self._kept.get(thing)
        return kept if kept is not None and now <= kept.at + KEPT else None


class _Kept(NamedTuple):
    """The provenance of a whole message."""

    wanted: List[int]
    """The indices of its tracked leaves, and END."""
    leaves: List[Any]
    size: int
    """The number of all leaves of the message."""
    names: Tuple[Hashable, ...]
    """All texts and whole numbers of the message."""
    at: float

    def located(self, message: Any) -> Optional[List[Any]]:
        """The leaves of a plain message in the order of `leaves`; None where it tells of other things further on."""
        if walkers(message.__class__).collect(message, 0, []) != self.size:
            return None
        if thing_reader(message.__class__, reads_all=True)(message) != self.names:
            return None
        return [leaf[2] for leaf in locate(message, self.wanted, [])]


def _is_same(one: Any, other: Any) -> bool:
    """Return whether two plain values are the same, as NaN is the same as NaN."""
    return type(one) is type(other) and bool(one == other or (one != one and other != other))


def _moved(tracked: Any, value: Any) -> Any:
    """A plain value with the provenance that it had a moment ago; itself where it is no number and another one now."""
    plain = untracked(tracked)
    if _is_same(plain, value):
        return tracked
    is_number = type(value) in (float, int) and type(plain) is type(value)
    return lazy_of([value], lambda _, __: tracked)[0] if is_number else value
