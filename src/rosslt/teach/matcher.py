"""A matcher: at each press, what is commanded becomes what is measured then."""

import contextlib
import queue
import threading
import time
from typing import Any, Dict, List, Optional, Sequence, Set, Tuple

import rosgraph
import rospy

from rosslt import messages, node, values
from rosslt.node import Heard
from rosslt.teach.devices import JOINTS, PERIOD, NotTaught
from rosslt.teach.locations import LocationReader
from rosslt.teach.pairing import Field, NotYet, meant_part, paired
from rosslt.teach.presses import Answer
from rosslt.teach.rows import Appended, checked_place

#: The age from which on what was measured is old, in seconds.
OLD = 1.0


class Latest:
    """The latest messages of topics: at any time, and as they come.

    Args:
        types: {topic: its type}.
        places: locations that are read as topics, too, called NODE#ID.
    """

    def __init__(self, types: Dict[str, str], places: Sequence[node.Place]) -> None:
        self._lock = threading.Lock()
        self._whole: Dict[Tuple[str, str], Tuple[Heard, Optional[Heard]]] = {}
        self._all: Dict[Tuple[str, str, Tuple[str, ...]], Tuple[Heard, float]] = {}
        self._coming: Optional[queue.SimpleQueue[Heard]] = None
        self._reader = node.TopicReader(self._note)
        self._reader.follow(types)
        self._locations = {str(place.source): LocationReader(place, self._note) for place in places}

    @property
    def topics(self) -> Set[str]:
        """The topics whose types are installed here."""
        return self._reader.topics()

    def whole(self, topic: str) -> List[Tuple[Heard, Optional[Heard]]]:
        """The latest message with its provenance of each publisher of a topic, and that before; sorted by name."""
        with self._lock:
            return [found for (of, _), found in sorted(self._whole.items(), key=lambda one: one[0]) if of == topic]

    def renew(self, topic: str) -> None:
        """Ask for the value of a location, if a topic is one; raises as a LocationReader does."""
        if topic in self._locations:
            self._locations[topic].ask()

    def all(self, topic: str) -> List[Tuple[Heard, float]]:
        """The latest message of each publisher of a topic, and of each set of joints, with the time of its arrival.

        They are in the order of arrival: a joint may be in several sets of one publisher.
        """
        with self._lock:
            found = [one for (of, *_), one in self._all.items() if of == topic]
        return sorted(found, key=lambda one: one[1])

    @contextlib.contextmanager
    def coming(self) -> Any:
        """Have `next_before` give the messages that come from now on."""
        self._coming = queue.SimpleQueue()
        try:
            yield
        finally:
            self._coming = None

    def next_before(self, end: float) -> Optional[Heard]:
        """The next message, or None if there is none until a time of `time.monotonic`."""
        assert self._coming is not None
        with contextlib.suppress(queue.Empty):
            return self._coming.get(timeout=max(0.0, end - time.monotonic()))
        return None

    def clear(self) -> None:
        """Drop messages that have come and were not read."""
        self._coming = queue.SimpleQueue()

    def close(self) -> None:
        """Listen no more."""
        self._reader.follow({})

    def _note(self, heard: Heard) -> None:
        names = tuple(map(str, heard.message.name)) if heard.message._type == JOINTS else ()
        with self._lock:
            self._all[heard.topic, heard.publisher, names] = heard, time.monotonic()
            if not heard.is_sampled:
                before = self._whole.get((heard.topic, heard.publisher), (None,))[0]
                self._whole[heard.topic, heard.publisher] = heard, before
        coming = self._coming
        if coming is not None:
            coming.put(heard)


class Matcher:
    """Makes numbers behind topics what was measured.

    Args:
        fields: the fields, each with the one that it is to become.
        directory: what is known of sources.
    """

    def __init__(self, fields: Sequence[Tuple[Field, Field]], directory: node.Directory) -> None:
        self._fields, self._directory, self._appended = fields, directory, Appended()
        topics = {field.topic for pair in fields for field in pair if field.place is None}
        published = dict(rosgraph.Master('/rosslt_teach').getPublishedTopics('/'))
        types = {topic: published.get(topic, '') for topic in topics}
        self._errors = node.NodeErrors()
        self._latest = Latest(types, [field.place for field, _ in fields if field.place is not None])
        for topic, type_ in types.items():
            if topic not in self._latest.topics:
                raise NotTaught(f'{topic} has the type {type_ or "unknown"}, which is not installed here')

    def wait(self, timeout: float) -> None:
        """Wait until there is all that a press needs.

        Raises:
            NotTaught: a topic is silent, a field has no source, or two fields do not fit together.
        """
        end = time.monotonic() + timeout
        while True:
            try:
                self._aims()
                return
            except NotYet as error:
                if time.monotonic() > end or rospy.is_shutdown():
                    raise NotTaught(f'{error} (after {timeout:g} s)') from None
            time.sleep(PERIOD / 10)

    def match(self) -> Answer:
        """Do as a press says: all that is commanded becomes what is measured now, or nothing changes."""
        try:
            aims, notes = self._aims()
            with self._latest.coming():
                matching = self._matching()
                outcome = matching.match(aims)
        except (values.Error, ValueError, rospy.ROSException) as error:
            return Answer(False, str(error))
        changes = [(self._directory.name(source), *change) for source, change in outcome.changes.items()]
        if matching.is_nearest:
            notes = [_distances(matching.aims, outcome.seen or outcome.wanted), *notes]
        if outcome.is_near:
            notes = ['it comes no nearer', *notes]
        text = outcome.reason or 'nothing to change: it is so already'
        if outcome.rounds and outcome.is_reached:
            text = (
                f'seen after {outcome.messages} message{"s" * (outcome.messages != 1)}, {outcome.milliseconds:.0f} ms'
            )
        elif matching.is_nearest and not changes:
            text = 'nothing to change: nothing comes nearer'
        return Answer(True, text, changes, notes)

    def check_row(self) -> None:
        """Check that rows can be added for what is commanded; raises as `checked_place` does."""
        checked_place(_tracked(self._aims()[0]))

    def append(self) -> Answer:
        """Do as a press says: what is measured now becomes a row below that of what is commanded, which stays."""
        try:
            aims, notes = self._aims()
            with self._latest.coming():
                matching = self._matching()
                found = matching.plan(aims)
        except (values.Error, ValueError, rospy.ROSException) as error:
            return Answer(False, f'nothing is written: {error}')
        if matching.is_nearest:
            notes = [_distances(matching.aims, matching.wanted), *notes]
        # six digits are as many as a sensor has
        short = {source: float(f'{one:g}') if type(one) is float else one for source, one in found.items()}
        answer = self._appended.append(_tracked(matching.aims), short)
        return answer._replace(notes=[*answer.notes, *notes])

    def close(self) -> None:
        """Listen no more."""
        self._latest.close()

    def _matching(self) -> node.Matching:
        return node.Matching(node.Requester(rospy.get_name(), self._directory), self._latest, self._errors)

    def _aims(self) -> Tuple[List[node.Aim], List[str]]:
        """All numbers and what they are to be now, and what is left out."""
        now, aims, notes = time.monotonic(), [], []
        found: Dict[Tuple[str, str], str] = {}
        for wanted, measured in self._fields:
            others = self._measured(measured, now)
            (heard, before), *more = self._commanded(wanted)
            if more:
                who = ' and '.join(one.publisher for one, _ in more)
                notes.append(f'{who} publish {wanted.topic}, too; this is about the messages of {heard.publisher}')
            pairs, left_out = paired(wanted, heard, measured, others)
            for pair in pairs:
                other = found.setdefault((wanted.topic, pair.path), measured.name)
                if other != measured.name:
                    raise NotTaught(f'{pair.name} is to become what {other} is, and what {measured.name} is')
                aims.append(node.Aim(heard, before, pair.path, pair.number, pair.name))
            notes += left_out
        return aims, notes

    def _measured(self, field: Field, now: float) -> List[Heard]:
        heard = self._latest.all(field.topic)
        if not heard:
            raise NotYet(f'no message on {field.topic}')
        fresh = [one for one, arrived in heard if now - arrived <= OLD]
        if not fresh:
            age = now - max(arrived for _, arrived in heard)
            raise NotYet(
                f'{field.topic} is silent: its last message came {age:.1f} s ago, and {field.name} may have changed'
            )
        return fresh

    def _commanded(self, field: Field) -> List[Tuple[Heard, Optional[Heard]]]:
        """The latest whole message of each publisher whose field has a source, by name, and the one before."""
        self._latest.renew(field.topic)
        heard = self._latest.whole(field.topic)
        if not heard:
            raise NotYet(f'no message with provenance on {field.topic}')
        found, missing = [], None
        for one in heard:
            try:
                if values.is_tracked(meant_part(field, one[0].message)[0]):
                    found.append(one)
            except NotYet as error:
                missing = error
        if found:
            return found
        if missing is not None:
            raise missing
        raise NotYet(
            f'nothing in {field.name} has a source, as {heard[0][0].publisher} sends it; '
            f'`rosslt doctor {field.topic}` says why'
        )


def _tracked(aims: Sequence[node.Aim]) -> List[Any]:
    """The numbers of aims that have a source."""
    parts = [messages.part_at(aim.heard.message, aim.path)[0] for aim in aims]
    return [part for part in parts if values.is_tracked(part)]


def _distances(aims: Sequence[node.Aim], seen: Sequence[float]) -> str:
    """Return the distance of each number from its measured value."""
    told, is_off = [], False
    for aim, value in zip(aims, seen):
        _, type_ = messages.part_at(aim.heard.message, aim.path)
        is_off = is_off or not messages.is_reached(value, aim.wanted, type_)
        told.append(f'{aim.name} is {value:g}, {abs(value - aim.wanted):.3g} off')
    return ('as near as possible: ' if is_off else '') + ', '.join(told)
