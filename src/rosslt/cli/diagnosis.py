"""Examinations of topics: why something on them cannot be dragged or forced.

A change needs publishers that send provenance, owners that take it, a message afterwards that shows it, and, for a drag
in RViz, a node that makes interactive markers and a display that shows them. Each of these is looked at in turn.
"""

import contextlib
import io
import os
import threading
import time
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Set, Tuple

import rosgraph

from rosslt import messages, srv, values
from rosslt.cli.locks import locks_of, note_of
from rosslt.cli.master import TIMEOUT, SystemState, problem_of
from rosslt.cli.output import few
from rosslt.cli.slave_api import About, about, other_type
from rosslt.node import Directory, Heard, Listener, ask_all

#: The kinds of findings: nothing is wrong; it may hinder a change; it prevents a change.
FINE, NOTE, FAULT = 'ok', 'note', 'fault'

#: The message type that a node with interactive markers publishes.
_UPDATE_TYPE = 'visualization_msgs/InteractiveMarkerUpdate'

#: At which service a node that `rosslt run` runs says where it makes plain numbers of tracked ones.
_FIND_LOSSES = '/rosslt/find_losses'

#: The ends of the paths of numbers that a message always has, and that nobody drags.
_NO_RESULTS = '.secs', '.nsecs', '.seq'


class Finding(NamedTuple):
    """Something that was looked at."""

    kind: str
    """FINE, NOTE or FAULT."""
    text: str


class Stream:
    """The messages that a node sent on a topic, counted.

    Attributes:
        count: the number of messages.
        whole: the number of those with provenance.
        sampled: the number of those between them.
        size: the bytes of all.
        provenance_size: the bytes of them that were provenance.
        sources: those in the messages, in order of appearance.
        type: the type of the messages; '' if there is none.
        is_latched: whether the publisher is a latched one.
        fields: {path: sources} of the numbers in the first message, or in the first with provenance if one has it.
        is_varied: whether numbers and texts differ from message to message, as long as none has a source.
        is_zero: whether no message has a number other than 0, the default of a field, nor a text but names of frames.
        frames: the names of the frames in the headers.
    """

    def __init__(self) -> None:
        self.count = self.whole = self.sampled = self.size = self.provenance_size = 0
        self.sources: Dict[values.Source, None] = {}
        self.type = ''
        self.is_latched = False
        self.fields: Dict[str, List[values.Source]] = {}
        self.is_varied = False
        self.is_zero = True
        self.frames: Set[str] = set()
        self._first: List[Any] = []

    def add(self, received: Heard, field: str) -> None:
        """Take a message; `field` is the path of the part that is looked at, '' for all."""
        sources, leaves = values.sources(received.message), values.leaves(received.message)
        if not self.count or (sources and not any(self.fields.values())):
            self.fields = {path: values.sources(leaf) for path, leaf in leaves if _is_result(path, leaf, field)}
        if not self.sources:
            scalars = _scalars(received.message, field)
            self._first = scalars if not self.count else self._first
            self.is_varied = self.is_varied or scalars != self._first
        self.is_zero = self.is_zero and not any(
            leaf for path, leaf in leaves if not path.endswith((*_NO_RESULTS, '.frame_id'))
        )
        self.frames.update(leaf.lstrip('/') for path, leaf in leaves if path.endswith('header.frame_id'))
        self.count += 1
        self.sampled += received.is_sampled
        self.whole += bool(sources) and not received.is_sampled
        buff = io.BytesIO()
        received.message.serialize(buff)
        plain_size = buff.tell()
        messages.append_provenance(received.message, buff, messages.SAMPLED if received.is_sampled else None)
        self.size += buff.tell()
        self.provenance_size += buff.tell() - plain_size
        self.sources.update(dict.fromkeys(sources))
        self.type, self.is_latched = received.type, received.is_latched


class Traffic:
    """The messages that came on topics while the command listened.

    Args:
        stream: listens to them.
        seconds: for how long.
        field: the path of the part of its messages that is looked at; '' for all.

    Attributes:
        seconds: for how long it listened.
        latched: {(topic, publisher)} of latched publishers, also of those that have sent nothing.
    """

    def __init__(self, stream: Listener, seconds: float, field: str = '') -> None:
        begin = time.monotonic()
        self._streams: Dict[Tuple[str, str], Stream] = {}
        for message in stream.during(seconds):
            self._streams.setdefault((message.topic, message.publisher), Stream()).add(message, field)
        self.seconds = time.monotonic() - begin
        self.latched = stream.latched()

    def of(self, topic: str, publisher: str) -> Stream:
        """The messages that a node sent on a topic."""
        return self._streams.get((topic, publisher)) or Stream()

    def frames(self, topic: str) -> Set[str]:
        """The frames that the messages of a topic are in."""
        return {frame for (name, _), stream in self._streams.items() if name == topic for frame in stream.frames}

    def all_sources(self) -> Set[values.Source]:
        """The sources in all messages."""
        return {source for stream in self._streams.values() for source in stream.sources}

    def is_tracked(self, topic: str) -> bool:
        """Return whether any message of a topic has provenance."""
        return any(stream.whole for (name, _), stream in self._streams.items() if name == topic)


def _is_result(path: str, value: object, field: str) -> bool:
    """Return whether a leaf of a message is a value that somebody may want to force: one of the field that was asked
    for, else one that has been computed."""
    plain = values.untracked(value)
    if field:
        return type(plain) in (float, int, str) and _is_within(path, field)
    return type(plain) is float and (plain != 0 or values.is_tracked(value)) and not path.endswith(_NO_RESULTS)


def _is_within(path: str, field: str) -> bool:
    return path.startswith(field) and path[len(field) : len(field) + 1] in '.['


def _scalars(message: messages.Message, field: str) -> List[Any]:
    """The numbers and texts in a part of a message, without times and counts."""
    return [
        value
        for path, value in values.leaves(message)
        if isinstance(value, (float, int, str))
        and not path.endswith(_NO_RESULTS)
        and (not field or _is_within(path, field))
    ]


class Losses:
    """The lines at which the publishers of topics make plain numbers of those with provenance.

    They are asked from now on, and look for so many seconds.
    """

    def __init__(self, state: SystemState, topics: Iterable[str], seconds: float) -> None:
        publishers = {one for topic in topics for one in state.publishers.get(topic, ())}
        self._requests = {
            one: srv.FindLossesRequest(seconds) for one in publishers if one + _FIND_LOSSES in state.services
        }
        self._timeout = seconds + TIMEOUT
        self._answers: Dict[str, Any] = {}
        self._asking = threading.Thread(target=self._ask, name='rosslt losses', daemon=True)
        self._asking.start()

    def _ask(self) -> None:
        self._answers, _ = ask_all('find_losses', srv.FindLosses, self._requests, self._timeout)

    def of(self, publisher: str) -> str:
        """List the positions in a node's files, as a part of a sentence; '' if none was seen."""
        self._asking.join()
        answer = self._answers.get(publisher)
        if answer is None or not answer.files:
            return ''
        lines = zip(answer.files, answer.lines, answer.texts)
        return few([f'{os.path.basename(file)}:{line}: {text}' for file, line, text in lines], '; ')

    def steps_of(self, publisher: str) -> str:
        """List the lines that carry numbers on from one round to the next, as a part of a sentence; '' if none did."""
        self._asking.join()
        answer = self._answers.get(publisher)
        return few(answer.steps, '; ') if answer is not None else ''

    def why_plain(self, publisher: str, topic: str, sent: Stream) -> str:
        """Say why messages of a node that `rosslt run` runs have no provenance; '' if the node does not say how it
        sends them."""
        self._asking.join()
        answer, lines = self._answers.get(publisher), self.of(publisher)
        if answer is None:
            return ''
        index = answer.topics.index(topic) if topic in answer.topics else None
        if lines and (index is None or not answer.had_sources[index]):
            return f'{publisher} makes plain numbers of tracked ones at {lines}'
        if index is None:
            return f'{publisher} sends it by a Publisher that `rosslt run` has not replaced: a library has made it'
        is_constant = sent.count > 1 and not sent.is_varied
        values_sent = 'the same values in each message' if is_constant else 'values'
        at, steps = _at(answer.sent_at[index]), self.steps_of(publisher)
        carried = f'what its code carries on from round to round ({steps})' if steps else ''
        taker = f'what was received, or {carried},' if steps else 'what was received'
        why = (
            f'Earlier messages had some: another branch of its code runs now, or {taker} has taken their place'
            if answer.had_sources[index]
            else 'Constants, text that is made of numbers, what is received without sources'
            f'{carried and ", and "}{carried} have none; another branch of its code may compute them from a location'
        )
        return f'{publisher} sends {values_sent} without sources{at}. {why}'

    def why_zero(self, publisher: str, topic: str, type_: str) -> str:
        """Say that messages with no number but 0 come from no location, as a robot's command while it waits; '' unless
        the node has made no plain numbers of tracked ones on their way, as far as it says."""
        self._asking.join()
        answer = self._answers.get(publisher)
        if answer is None or topic not in answer.topics:
            return ''
        index = answer.topics.index(topic)
        if answer.files and not answer.had_sources[index]:
            return ''
        earlier = '; earlier messages had sources' if answer.had_sources[index] else ''
        return f'{publisher} sends {type_}() with no number in it now{_at(answer.sent_at[index])}{earlier}'

    def recording_of(self, publisher: str) -> str:
        """Say what recording provenance costs a node, as a sentence; '' if it is not known, or nothing."""
        self._asking.join()
        answer = self._answers.get(publisher)
        if answer is None or not answer.recording or not answer.cpu:
            return ''
        share = 100 * answer.recording / answer.cpu
        at = f', most of it at {"; ".join(answer.costly)}' if answer.costly else ''
        return f'recording takes {share:.0f} % of the CPU time of {publisher}{at}'


def _at(places: str) -> str:
    """The lines that send messages, as a part of a sentence."""
    return f' at {places}' if places else ''


class Examination:
    """Looks at topics.

    Args:
        master: the ROS master.
        state: the master's system state.
        traffic: the messages received on the topics, and on the topics that their publishers subscribe to.
        directory: has learned the sources in it.
        losses: the lines at which the publishers lose provenance.
    """

    def __init__(
        self, master: rosgraph.Master, state: SystemState, traffic: Traffic, directory: Directory, losses: Losses
    ) -> None:
        self._master, self._state, self._traffic, self._directory = master, state, traffic, directory
        self._losses = losses
        self._types: Dict[str, str] = dict(master.getTopicTypes())
        self._about: Dict[str, About] = {}
        self._recording_said: Set[str] = set()  # nodes: it is the same for all of their topics

    def _about_node(self, node: str) -> About:
        if node not in self._about:
            self._about[node] = about(self._master, node)
        return self._about[node]

    def findings(self, topic: str) -> Iterator[Finding]:
        """All that is found about one topic."""
        publishers = sorted(self._state.publishers.get(topic, ()))
        if not publishers:
            kept = f'; the master keeps it as {self._types[topic]}' if topic in self._types else ''
            yield Finding(FAULT, f'nobody publishes it{kept}')
            return
        for publisher in publishers:
            yield from self._of_publisher(topic, publisher)
        sources = list(
            dict.fromkeys(source for publisher in publishers for source in self._traffic.of(topic, publisher).sources)
        )
        yield from self._of_sources(self._directory.own_first(sources))
        if sources:
            heard = (self._traffic.of(topic, publisher) for publisher in publishers)
            yield from self._of_display(topic, next(sent.type for sent in heard if sent.sources))

    def _of_publisher(self, topic: str, publisher: str) -> Iterator[Finding]:
        sent, seconds = self._traffic.of(topic, publisher), self._traffic.seconds
        within = f'within {round(seconds, 1):g} s'
        said = {one: self._about_node(one).published for one in self._state.publishers[topic]}
        other = other_type(topic, publisher, self._types[topic], said)
        if other:
            yield Finding(FAULT, other)
        if not sent.count:
            if other:
                return
            why = problem_of(self._master, publisher)
            if not why and (topic, publisher) in self._traffic.latched:
                yield Finding(
                    NOTE, f'{publisher} has sent nothing yet; it is latched: each subscriber gets its last one'
                )
                return
            silent = f'{publisher} sends nothing {within}: its code has published nothing meanwhile, or once before: '
            once = 'without latch=True, that does not reach later subscribers'
            yield Finding(FAULT, f'{publisher}: {why}' if why else silent + once)
        elif not (sent.whole or sent.sampled):
            zero = self._losses.why_zero(publisher, topic, sent.type.rpartition('/')[2]) if sent.is_zero else ''
            yield Finding(NOTE, zero) if zero else Finding(FAULT, self._why_plain(topic, publisher))
        else:
            others = f' ({sent.sampled} sampled, {sent.count - sent.whole - sent.sampled} plain)'
            yield Finding(
                FINE if sent.whole else FAULT,
                f'{publisher} sends provenance in {sent.whole} of {sent.count} messages'
                f'{others if sent.whole < sent.count else ""}: {sent.count / seconds:.1f} a second, '
                f'{sent.size / sent.count:.0f} B each, {sent.provenance_size / sent.count:.0f} B of them provenance',
            )
            if sent.count == 1 and not sent.is_latched:
                yield Finding(
                    NOTE,
                    f'{publisher} sent one message {within}: a change is seen in the next one; give its '
                    'Publisher latch=True, or publish again when a location changes',
                )
            yield from self._of_fields(sent.fields, publisher)
            lines = self._losses.of(publisher) if not all(sent.fields.values()) else ''
            if lines:
                yield Finding(NOTE, f'{publisher} makes plain numbers of tracked ones at {lines}')
            recording = self._losses.recording_of(publisher) if publisher not in self._recording_said else ''
            if recording:
                self._recording_said.add(publisher)
                yield Finding(FINE, recording)

    def _of_fields(self, fields: Dict[str, List[values.Source]], publisher: str) -> Iterator[Finding]:
        """The fields that cannot be forced, although others can."""
        plain = [path for path, sources in fields.items() if not sources]
        if plain:
            steps = self._losses.steps_of(publisher)
            others = 'what is received without sources has none, nor what its code carries on from round to round'
            why = f'; {others}, as at {steps}' if steps else ''
            yield Finding(NOTE, f'{few(plain)} cannot be forced: it has no source, as {publisher} sends it{why}')
        fixed = [path for path, sources in fields.items() if sources and not any(map(self._can_change, sources))]
        if fixed:
            yield Finding(NOTE, f'{few(fixed)} cannot be forced: none of its locations can be changed')

    def _can_change(self, source: values.Source) -> bool:
        place = self._directory.of(source)
        return place is not None and not place.is_fixed

    def _heard_by(self, node: str) -> List[str]:
        """The topics that a node subscribes to."""
        return sorted(name for name, nodes in self._state.subscribers.items() if node in nodes)

    def _why_plain(self, topic: str, publisher: str) -> str:
        entering = [name for name in self._heard_by(publisher) if name != topic and self._traffic.is_tracked(name)]
        if publisher not in self._state.tracked_nodes:
            how = self._why_untracked(publisher)
        elif self._losses.why_plain(publisher, topic, self._traffic.of(topic, publisher)):
            how = self._losses.why_plain(publisher, topic, self._traffic.of(topic, publisher))
        elif entering:
            how = (
                f"{publisher} loses it: it uses rospy's Publisher or Subscriber in place of rosslt's, or turns the "
                'numbers into plain ones, for example with the functions of `math`, or sends others'
            )
        else:
            how = (
                f"{publisher} has locations, but what it sends now comes from none: its Publisher is rospy's, the "
                'numbers are not locations, or the branch of its code that runs sends constants'
            )
        if entering:
            return 'provenance enters {} on {} and does not leave it: {}'.format(publisher, ' and '.join(entering), how)
        return f'{topic} is plain: {how}'

    def _why_untracked(self, publisher: str) -> str:
        node = self._about_node(publisher)
        if node.is_other:
            return f'{publisher} is not a Python node: only those can be tracked'
        how = 'start it with `rosslt run`, or have its code use init_node, Publisher and Subscriber of rosslt'
        if node.is_python:
            return f'{publisher} uses rospy as it is: {how}'
        return f'{publisher} has no locations, and does not say what it is. If it is a Python node, {how}'

    def _of_sources(self, sources: List[values.Source]) -> Iterator[Finding]:
        can_change = []
        for node in dict.fromkeys(source.node for source in sources):
            why = None if node in self._state.tracked_nodes else 'it has ended, so its locations cannot be changed'
            locks = locks_of([node])
            why = why or problem_of(self._master, node) or ''.join(map(note_of, locks.values()))
            if why:
                yield Finding(FAULT, f'{node}: {why}')
                continue
            for source in (source for source in sources if source.node == node):
                place = self._directory.of(source)
                if place is None:
                    yield Finding(FAULT, f'{node} does not know the location {source}: it was started with other code')
                elif place.location.read_only:
                    lock = ''.join(note_of(answer, source.location_id) for answer in locks.values())
                    yield Finding(NOTE, f'{place.name} is {lock or "read-only"}')
                elif place.location.at_next_start:
                    yield Finding(NOTE, f'a change of {place.name} {place.location.at_next_start}')
                else:
                    can_change.append(place.name)
                    if place.location.plain_copies:
                        yield Finding(NOTE, f'of a change of {place.name}, {place.location.plain_copies}')
        if can_change:
            yield Finding(FINE, 'it comes from ' + ', '.join(can_change))
        elif sources:
            yield Finding(FAULT, 'none of the locations that it comes from can be changed')

    def _of_display(self, topic: str, sent_type: str) -> Iterator[Finding]:
        """Find whether it can be dragged in RViz: which node makes handles for it, and whether they are shown."""
        updates = {
            name: set(nodes) for name, nodes in self._state.publishers.items() if self._types.get(name) == _UPDATE_TYPE
        }
        if not updates:
            yield Finding(NOTE, 'no node makes handles to drag it with: rosrun rosslt slt_visualization does')
            return
        listening = set(self._state.subscribers.get(topic, ()))
        makers = sorted({node for nodes in updates.values() for node in nodes})
        deaf = {maker: self._about_node(maker).subscribed.get(topic) for maker in makers if maker in listening}
        deaf = {maker: type_ for maker, type_ in deaf.items() if type_ not in (None, sent_type)}
        for maker, type_ in deaf.items():
            yield Finding(FAULT, f'{maker} takes it for {type_}, but it is sent as {sent_type}')
        listening -= deaf.keys()
        serving = {name for name, nodes in updates.items() if nodes & listening}
        if not serving:
            why = f'{sent_type} has no handles, or is not watched'
            yield Finding(NOTE, f'{", ".join(makers)} makes no handles for it: {"its types differ" if deaf else why}')
            return
        shown = {name for name in updates if set(self._state.subscribers.get(name, ())) - updates[name]}
        if serving & shown:
            apart = self._frames_apart({node for name in serving & shown for node in updates[name] & listening})
            frames = self._traffic.frames(topic)
            for frame in sorted(frames & apart.keys()):
                fixed = apart[frame]
                why = f'no transform joins it to {fixed}, the root of the frames of most topics'
                yield Finding(FAULT, f'RViz gets no handles of what is in the frame {frame}: {why}; a static one would')
            if frames - apart.keys() or not frames:
                yield Finding(FINE, 'its handles are shown, through ' + ', '.join(sorted(serving & shown)))
            return
        elsewhere = f'; RViz shows {", ".join(sorted(shown))}' if shown else ''
        yield Finding(
            FAULT if shown else NOTE,
            f'nobody shows its handles{elsewhere}: roslaunch rosslt rviz.launch does; in an RViz of your own, add a '
            'display InteractiveMarkers with the Update Topic ' + ' or '.join(sorted(serving)),
        )

    def _frames_apart(self, makers: Iterable[str]) -> Dict[str, str]:
        """{frame that no transform joins to RViz's fixed frame: the fixed frame}, as nodes that make handles say."""
        found: Dict[str, str] = {}
        for maker in makers:
            with contextlib.suppress(rosgraph.MasterException):  # other nodes say nothing of that
                found.update(self._master.getParam(f'{maker}/frames_apart'))
        return found
