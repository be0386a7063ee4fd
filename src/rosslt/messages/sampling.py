"""Provenance is sampled: a publisher writes it at a rate, and marks the messages between.

A message is whole, with the provenance of all its tracked leaves, or it is sampled: it has tracked leaves and is sent
without their provenance, which its mark says. Every other message is plain: it has no source. Results that a node
computes from a sampled message depend on `values.UNKNOWN`, and a message with such a leaf is sampled as well.
`ThingReader` decides, for publishers and readers alike, which messages are about one thing.
"""

import functools
import math
import operator
import time
from typing import Any, Callable, Dict, Hashable, List, Optional, Sequence, Tuple

from rosslt.messages.codec import SAMPLED, Encoding, encoding_to_send
from rosslt.messages.fields import HEADER, INSTANTS, Layout, Message, MessageClass, Scalar, kind_of
from rosslt.messages.leaves import has_tracked_leaf, leaf_count, locate, set_leaves, tracked_fields
from rosslt.messages.walkers import END, walkers
from rosslt.values import OPERATION, lazy_of, spend, untracked

COSTLY = 0.0001
"""The CPU time in seconds that writing the provenance of all things of a publisher once may take; from there on it is
written less often, in proportion: at 100 Hz, it takes 1 % of a core."""

LONGEST_PAUSE = 1.0
"""The longest time in seconds between whole messages of one thing, whatever they cost."""

COMES_ROUND = 2 * LONGEST_PAUSE, 20
"""What has not been known for so many seconds, in which all publishers have sent whole messages more than once, and in
so many messages, comes from the messages themselves: nodes read each other."""

TOGETHER = 0.06
"""The time in seconds, from the beginning of each second, in which all messages are whole: what a node computes of
several inputs is whole only if all of these are, and each might else be whole at another time. A topic faster
than 20 Hz has a message in this time, and the messages of a slower topic are mostly whole anyway."""

MOST_THINGS = 1024
"""The most things that a publisher, or a reader, remembers."""

ThingReader = Callable[[Any], Hashable]
"""Names the thing that a message is about, by its texts and whole numbers: frames, namespace and id of a marker. The
number and the times of headers do not count."""


@functools.lru_cache(maxsize=None)
def thing_reader(message_class: MessageClass, reads_all: bool = False) -> ThingReader:
    """The ThingReader of a message class.

    Args:
        message_class: the class of the messages.
        reads_all: read all elements of an array, and not the first one alone.
    """
    layout = walkers(message_class).layout
    return _reader(layout, layout.name, reads_all)


def _reader(layout: Layout, type_: str, reads_all: bool) -> ThingReader:
    paths: List[str] = []
    arrays: List[Tuple[Callable[[Message], Any], ThingReader]] = []
    for path, owner, field in layout.parts(type_):
        if field.length is not None:
            read = _reader(layout, field.type, reads_all)
            if read is not _read_nothing:
                arrays.append((operator.attrgetter(path), read))
        elif kind_of(field.type) in 'is' and owner not in INSTANTS and (owner, field.name) != (HEADER, 'seq'):
            paths.append(path)
    own = operator.attrgetter(*paths) if paths else _read_nothing
    if not arrays:
        return own

    def read_arrays(message: Message) -> Tuple[Hashable, ...]:
        found: List[Hashable] = [own(message)]
        for array_of, read in arrays:
            array = array_of(message)
            if reads_all:
                found.append(tuple(map(read, array)))
            else:
                found.append(read(array[0]) if array else ())
        return tuple(found)

    return read_arrays


def _read_nothing(message: Message) -> Tuple[Hashable, ...]:
    return ()


def thing_of(message: Message) -> Hashable:
    """Return the thing that a message is about, as its ThingReader names it: a key of a dictionary, kept untracked."""
    return thing_reader(message.__class__)(message)


def form_of(message: Message) -> Tuple[Hashable, ...]:
    """The number of leaves of a message and all its names. In messages of one thing and form, a leaf is the same number
    of the same thing."""
    return leaf_count(message), thing_reader(message.__class__, reads_all=True)(message)


class SampledProvenance:
    """Decides for one publisher which of its messages are whole.

    Args:
        rate: gives how many messages of one thing are whole in a second, at most.
        clock: gives seconds.
        shared_clock: gives the seconds since 1970, as all nodes know them.
    """

    def __init__(
        self,
        rate: Callable[[], float],
        clock: Callable[[], float] = time.monotonic,
        shared_clock: Callable[[], float] = time.time,
    ) -> None:
        self._rate = rate
        self._clock, self._shared_clock = clock, shared_clock
        self._due: Dict[Hashable, float] = {}
        # Of things of which a whole message was due: since when they depend on what is not known, and in how many.
        self._unknown: Dict[Hashable, Tuple[float, int]] = {}
        self._state: Any = None
        self._is_costly = False
        self._last: Optional[Encoding] = None  # of the last message if it was costly

    def to_send(self, message: Message, full_history: bool, state: object) -> bytes:
        """The provenance of a message that is sent now.

        Args:
            message: an ordinary one.
            full_history: as in `encode`.
            state: whatever differs after a change, and after somebody has subscribed: the next message is whole.

        Returns:
            SAMPLED between whole ones, and if a leaf depends on `UNKNOWN`: then the next message is checked again;
            b'' if no leaf is tracked.
        """
        if state != self._state:
            self._due = dict.fromkeys(self._due, -math.inf)
            self._state = state
        now, period = self._clock(), 1.0 / self._rate()
        try:
            thing = thing_of(message)
            due = self._due.get(thing, now)
            is_due = now >= due - period / 2  # the messages of a loop come a little earlier or later
            if not (is_due or self._is_together()):
                return SAMPLED if has_tracked_leaf(message) else b''
        except (TypeError, AttributeError):
            return b''  # it is serializing the message that says what is wrong
        start = time.thread_time()
        encoding = encoding_to_send(message, full_history, self._last)
        if encoding.data == SAMPLED:
            if len(self._unknown) >= MOST_THINGS:
                self._unknown.clear()
            since, count = self._unknown.get(thing, (now, 0))
            self._unknown[untracked(thing)] = since, count + 1
            seconds, messages = COMES_ROUND
            if now - since > seconds and count >= messages:
                encoding = encoding_to_send(message, full_history, None, cuts_unknown=True)
        data = encoding.data
        if data != SAMPLED:
            self._unknown.pop(thing, None)
        if data and data != SAMPLED:
            if len(self._due) >= MOST_THINGS:
                self._due.clear()
            self._due.setdefault(untracked(thing), due)
            took = time.thread_time() - start
            spend(round(took / OPERATION))
            cost = took * len(self._due)
            self._is_costly = cost > COSTLY
            if encoding is not self._last:
                self._last = encoding if self._is_costly else None
            if is_due:
                pause = max(period, min(LONGEST_PAUSE, cost / COSTLY * period))
                # on average one a pause: what comes early or late does not shift those that follow
                due = max(now, due + pause)
                if self._is_costly:
                    shared = self._shared_clock() + due - now
                    until_common = round(shared) - shared
                    if abs(until_common) <= pause / 2:
                        due += until_common + period / 2  # the time in which the others are whole, too
                self._due[untracked(thing)] = due
        return data

    def _is_together(self) -> bool:
        """Return whether it is the time in which all publishers send whole messages."""
        return not self._is_costly and self._shared_clock() % 1.0 < TOGETHER


class LastProvenance:
    """Keeps the last provenance of each thing, for a reader that needs sampled messages too. Several threads may use
    it.

    Args:
        of_moved: complete leaves that have moved since as well, by the difference: of two things on one topic that
            cannot be told from each other, one is taken for the other.
    """

    def __init__(self, of_moved: bool = True) -> None:
        self._of_moved = of_moved
        # The last whole message of each thing: its tracked leaves and its form.
        self._kept: Dict[Hashable, Tuple[Sequence[Tuple[int, Any, str]], Tuple[Hashable, ...]]] = {}

    def completed(self, message: Message, is_sampled: bool, publisher: Hashable) -> Message:
        """Complete a sampled message: each leaf is the last expression of it plus the difference.

        Args:
            message: as received; not changed.
            is_sampled: whether it came with the mark.
            publisher: the publisher of the message, with the topic if several topics are read.

        Returns:
            the message itself if it is not sampled; else a copy, untracked if nothing is kept of the same form.
        """
        fields = tracked_fields(message)
        if not (is_sampled or fields):
            return message
        thing, form = (publisher, thing_of(message)), form_of(message)
        if not is_sampled:
            if len(self._kept) >= MOST_THINGS:
                self._kept.clear()
            self._kept[thing] = fields, form
            return message
        result = untracked(message)  # its tracked leaves depend on `UNKNOWN`
        kept, kept_form = self._kept.get(thing, ((), form))
        if kept_form == form:
            found = locate(result, [*(index for index, _, _ in kept), END], [])
            pairs = [(index, leaf, now[2]) for (index, leaf, _), now in zip(kept, found)]
            set_leaves(
                result,
                {index: _moved(leaf, now) for index, leaf, now in pairs if self._of_moved or untracked(leaf) == now},
            )
        return result


def _moved(tracked: Message, value: Scalar) -> Any:
    """A value with the provenance that its field had a moment ago; a text or bool that has changed stays plain."""
    plain = untracked(tracked)
    if type(plain) is type(value) and bool(plain == value):
        return tracked
    is_number = type(value) in (float, int) and type(plain) is type(value)
    return lazy_of([value], lambda _, __: tracked)[0] if is_number else value
