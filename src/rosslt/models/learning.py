"""Learns how what a running node sends depends on what it hears, by trying it on a twin of the node.

The twin hears first what the live node has heard. If it does not send the same, it has not the same state or hears
something else as well, and nothing is learned. Then its last inputs are changed: `trials` says how.
"""

import contextlib
import io
import math
import time
from collections import Counter
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Sequence, Set, Tuple

import genpy
import numpy as np

from rosslt import messages
from rosslt.models.learned import Learned
from rosslt.models.processes import LiveProcess
from rosslt.models.replays import Number, Recording, inputs_and_outputs, numbers_in, stamp_of, stamped, with_numbers
from rosslt.models.trials import learn
from rosslt.models.twin import Timed, Twin, TwinFailed

#: Two outputs are the same if they differ by this at most, in relation to the largest one there.
SAME = 1e-6

#: The part of a replay whose answers are compared: before it, the twin may still have another state; behind it, not all
#: that the live node has sent may have come.
COMPARED = 0.5, 0.9

#: An answer without a stamp is compared with what the node has sent up to this part of a replay before or after it.
NEAR = 0.25

#: A change is waited for as long as this, in seconds, until its outputs stay as they are.
LONGEST = 8.0

#: An answer that differs from the one before by more than this part of its size is waited for, this often.
AGREES, TURNS = 1e-9, 8

#: Answers that are late are looked for again in this time, and waited for as long as that, in seconds.
LATER, PATIENCE = 0.02, 2.0

#: What differs by less than this part of the largest answer has not moved: a filter never quite forgets.
RESOLUTION = 1e-8

#: The largest change of a number that is tried, as a part of its size, and that of one that is 0.
CHANGE, CHANGE_OF_0 = 0.1, 0.1

Array = Any  # numpy.ndarray: NumPy 1.17 of Noetic has no types


class NotLearned(Exception):
    """Nothing can be learned of a node; the text says why."""


class Answer(NamedTuple):
    """What a node does.

    Attributes:
        inputs, outputs: the numbers, in the order in which `learned` counts them.
        at: the values of the inputs at which it was tried.
        late: the seconds from a change of an input to the first message that shows it.
        settled: the same to the message from which on it stays.
        learned: which output depends on which input.
        is_isolated: whether the twin had a network of its own.
        asked: the full names of the parameters that the twin has asked for.
    """

    inputs: Sequence[Number]
    outputs: Sequence[Number]
    at: Sequence[float]
    late: float
    settled: float
    learned: Learned
    is_isolated: bool
    asked: Sequence[str]


def learn_node(
    process: LiveProcess,
    parameters: Mapping[str, Any],
    recording: Recording,
    most: int = 200,
    tries_parameters: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> List[Answer]:
    """Learn what a node does on a twin.

    Args:
        process: the live node's, which is left alone.
        parameters: the tree of all parameters.
        recording: what it has heard and sent.
        most: trials, of its inputs and of its parameters each.
        tries_parameters: whether its private parameters are changed as well; the twin is started anew for each trial.
        say: is told what is done.

    Returns:
        what depends on its inputs, and on its parameters if they were tried.

    Raises:
        NotLearned: the twin does not do what the node does, there are no numbers to change or to look at, or time is
            simulated.
        TwinFailed: the twin does not come up, or ends.
    """
    inputs, outputs = inputs_and_outputs(process)
    if parameters.get('use_sim_time'):
        raise NotLearned('time is simulated (/use_sim_time), and a twin has no clock to follow')
    if not recording.outputs:
        raise NotLearned(f'{process.node} has sent nothing within {recording.seconds:g} s')
    heard = numbers_in(recording.last(recording.inputs))
    begin = [(number, value) for number, value in heard if not _is_rotation(recording, number)]
    own = _parameters_of(process.node, parameters) if tries_parameters else []
    if not begin and not own:
        topics = ', '.join(sorted({topic for _, topic, _ in recording.inputs})) or 'nothing'
        raise NotLearned(f'{process.node} has heard no numbers within {recording.seconds:g} s: {topics}')
    with Twin(process, parameters, inputs, outputs) as twin:
        say('the twin runs' + ('' if twin.is_isolated else ', without a network of its own: this user may make none'))
        differs = difference(recording, twin.play(recording.inputs, recording.seconds))
        if differs:
            raise NotLearned(
                f'the twin of {process.node} does not do what it does: {differs}; a node that follows slowly is to be '
                'listened to for longer'
            )
        say('on the same messages, it sends the same')
        if len(begin) < len(heard):
            say('rotations of frames are not changed: tf2 takes no quaternion of another length than 1')
        hand = _Hand(twin, recording, [number for number, _ in begin])
        at = np.array([value for _, value in begin])
        late = hand.settle(at)
        say(f'a change shows after {late:.3f} s, and stays after {hand.seconds:.3f} s')
        if hand.silent:
            say(f'nothing is learned of what came no more meanwhile, on {", ".join(sorted(hand.silent))}')
        found = []
        if begin:
            learned = learn(hand.ask, at, _sizes(at), most=most, resolution=RESOLUTION, confirms=True)
            found.append(hand.answer(hand.numbers, at.tolist(), late, learned))
        if own:
            numbers, present = [number for number, _ in own], np.array([float(value) for _, value in own])
            whole = np.array([type(value) is int for _, value in own])
            sizes = np.where(whole, np.maximum(1.0, np.round(_sizes(present))), _sizes(present))
            ask = hand.asker_of_parameters(numbers, whole, at)
            learned = learn(ask, present, sizes, whole=whole, most=most, resolution=RESOLUTION)
            found.append(hand.answer(numbers, present.tolist(), late, learned))
        return found


def _is_rotation(recording: Recording, number: Number) -> bool:
    """Whether a number is of the quaternion of a frame, which tf2 refuses if the length is not 1."""
    return recording.types[number.topic]._type == 'tf2_msgs/TFMessage' and '.rotation.' in number.path


def _parameters_of(node: str, tree: Mapping[str, Any]) -> List[Tuple[Number, Any]]:
    """The private parameters of a node that are finite numbers, with their values."""
    found: List[Tuple[str, Any]] = [('', tree)]
    for name in node.strip('/').split('/'):
        found = [(f'{path}/{name}', part[name]) for path, part in found if isinstance(part, dict) and name in part]
    numbers = []
    while found:
        path, part = found.pop()
        if isinstance(part, dict):
            found += [(f'{path}/{name}', one) for name, one in part.items()]
        elif type(part) in (int, float) and math.isfinite(part):
            numbers.append((Number(path, None, ''), part))
    return sorted(numbers)


def _sizes(at: Array) -> Array:
    """The largest changes that are tried."""
    return np.where(at == 0, CHANGE_OF_0, CHANGE * np.abs(at))


def difference(recording: Recording, answers: Sequence[Timed]) -> str:
    """What a twin sends otherwise than its node has sent, and by how much; '' if nothing.

    Args:
        recording: of the node.
        answers: the twin's, to the same messages.

    Raises:
        NotLearned: nothing can be compared.
    """
    begin, end, near = (part * recording.seconds for part in (*COMPARED, NEAR))
    live: Dict[Any, List[Tuple[float, Any, Dict[str, float]]]] = {}
    for when, topic, serialized in recording.outputs:
        message = recording.read(topic, serialized)
        for (_, thing), numbers in _by_thing(topic, message).items():
            live.setdefault((topic, thing), []).append((when, stamp_of(message), numbers))
    told: Dict[str, float] = {}
    topics, compared = set(), False
    for when, topic, serialized in answers:
        if not begin <= when <= end:
            continue
        topics.add(topic)
        message = recording.read(topic, serialized)
        for key, numbers in _by_thing(topic, message).items():
            stamp, known = stamp_of(message), live.get(key, [])
            if not known:
                return f'{topic} has another thing, or another number of them'
            others = [other for sent, has, other in known if (has == stamp if stamp else abs(sent - when) <= near)]
            if not others:
                continue  # a node may leave out messages that come too fast
            compared = True
            path, size = min((_largest(numbers, other) for other in others), key=lambda one: one[1])
            if size > SAME:
                name = f'{topic}/{path.replace(".", "/")}'
                told[name] = max(size, told.get(name, 0.0))
    missing = {topic for when, topic, _ in recording.outputs if begin <= when <= end} - topics
    if missing:
        return f'it sends nothing on {", ".join(sorted(missing))}'
    if not compared:
        raise NotLearned(
            'nothing that it sends can be compared: it comes too seldom for the seconds that were listened to, or has '
            'no finite numbers that are not whole'
        )
    most = sorted(told.items(), key=lambda one: -one[1])[:3]
    return ', '.join(f'{name} differs by {size:.2g} of its size' for name, size in most)


def _by_thing(topic: str, message: Any) -> Dict[Any, Dict[str, float]]:
    found: Dict[Any, Dict[str, float]] = {}
    for number, value in numbers_in({(topic, messages.thing_of(message)): message}):
        found.setdefault((topic, number.thing), {})[number.path] = value
    return found


def _largest(numbers: Mapping[str, float], others: Mapping[str, float]) -> Tuple[str, float]:
    """The path at which numbers differ most from others, and by what part of the largest one."""
    if numbers.keys() != others.keys():
        return next(iter(numbers.keys() ^ others.keys())), math.inf
    size = max([abs(value) for value in (*numbers.values(), *others.values())], default=0.0) or 1.0
    return max(((path, abs(value - others[path]) / size) for path, value in numbers.items()), key=lambda one: one[1])


class _Hand:
    """Changes the inputs of a twin, and reads its outputs.

    Attributes:
        numbers: the inputs that change.
        outputs: what is read, once it has settled.
        seconds: how long a change takes until it stays.
        silent: the topics of things that the node has sent while it was listened to, and its twin did not send once
            its inputs were held.
    """

    def __init__(self, twin: Twin, recording: Recording, numbers: Sequence[Number]) -> None:
        self._twin, self._recording, self.numbers = twin, recording, numbers
        self._things = recording.last(recording.inputs)
        self._periods = {key: recording.period(key) for key in self._things}
        self.outputs: List[Number] = []
        self.seconds = 0.0
        self.silent: Set[str] = set()
        # How many messages of each thing with numbers its node has sent.
        self._sent_live: Counter = Counter(
            (topic, number.thing)
            for _, topic, serialized in recording.outputs
            for number, _ in numbers_in(recording.last([(0.0, topic, serialized)]))[:1]
        )
        self._began = 0.0  # the time in the stamps of what is held
        self._is_stamped = False  # whether all outputs have these stamps, or later ones
        self._sent: Counter = Counter()  # how many messages, by input
        self._came: Counter = Counter()  # and by output
        self._answers: Dict[str, str] = {}  # {output: input}, if each message of the input has one answer

    def settle(self, at: Array) -> float:
        """Find out how long a change takes: when it shows, in seconds; `seconds` is when it stays."""
        hold = 0.25
        while True:
            before = self._last(self._hold(at, hold))
            missing = self._sent_live.keys() - before.keys()
            self.outputs = [number for number, _ in numbers_in(before)]
            random = np.random.RandomState(1)
            moved = at + _sizes(at) * random.uniform(0.2, 1.0, len(at))
            answers = self._hold(moved, hold)
            _, stays = self._times(before, answers)
            # What comes every now and then may come once more.
            times = Counter(topic for _, topic, _ in answers)
            gap = max([self._gap(topic, answers) for topic in times], default=0.0)
            self.seconds = stays + gap + max([0.0, *(one for one in self._periods.values() if one < hold)])
            # One message does not tell how often an output comes, if it is not the answer to the only one of an input.
            is_single = 1 in times.values() and min(self._periods.values(), default=hold) < hold
            is_short = is_single or any(self._sent_live[key] > 1 for key in missing)
            is_longest = 2 * hold > min(self._recording.seconds, LONGEST)
            if self.outputs and (is_longest or not is_short) and self.seconds <= 0.75 * hold:
                self.silent = {topic for topic, _ in missing}
                self._came.update(topic for _, topic, _ in self._twin.play([], self.seconds))
                self._answers = {
                    output: next((one for one, sent in self._sent.items() if sent == came), '')
                    for output, came in self._came.items()
                }
                end = self._last(answers)
                self._is_stamped = {number for number, _ in numbers_in(self._own(end))} >= set(self.outputs)
                # What came before the way back is known to have stayed.
                late, _ = self._times(end, self._hold(at, hold))
                return late
            hold *= 2
            if hold > LONGEST:
                what = 'does not stay the same' if self.outputs else 'is no number'
                raise NotLearned(f'what it sends {what} within {LONGEST:g} s while its inputs stay')

    def ask(self, rows: Array) -> Array:
        """The outputs (k, m) at inputs (k, n); NaN if an output has not come."""
        return np.array([self._answer(wanted) for wanted in rows]).reshape(len(rows), len(self.outputs))

    def answer(self, inputs: Sequence[Number], at: Sequence[float], late: float, learned: Learned) -> Answer:
        """What was learned, with all that is known of the twin."""
        twin = self._twin
        return Answer(inputs, self.outputs, at, late, self.seconds, learned, twin.is_isolated, twin.asked_parameters())

    def _answer(self, wanted: Array) -> Array:
        """The outputs at some inputs. On a busy machine, a message may be late, and be the answer to other inputs. Its
        stamp tells it, or that others are still to come, or that the outputs are not the same twice."""
        found = self._read(wanted)
        if self._is_stamped:
            return found
        for _ in range(TURNS):
            again, size = self._read(wanted), np.maximum(np.abs(found), 1e-300)
            if np.all((np.abs(again - found) <= AGREES * size) | (np.isnan(again) & np.isnan(found))):
                return again
            found = again
        return np.full(len(self.outputs), np.nan)

    def _read(self, wanted: Array) -> Array:
        things = self._last(self._hold(wanted, self.seconds))
        numbers = dict(numbers_in(self._own(things) if self._is_stamped else things))
        return np.array([numbers.get(one, np.nan) for one in self.outputs])

    def _own(self, things: Mapping[Any, Any]) -> Dict[Any, Any]:
        """The messages whose stamps say that they answer to what is held."""
        began = genpy.Time.from_sec(self._began)
        return {
            key: message
            for key, message in things.items()
            if (stamp_of(message) or (0, 0)) >= (began.secs, began.nsecs)
        }

    def asker_of_parameters(self, numbers: Sequence[Number], whole: Array, at: Array) -> Callable[[Array], Array]:
        """A function as `ask`, of parameters: it starts the twin anew for each row.

        Args:
            numbers: the parameters.
            whole: which of them are whole numbers.
            at: the inputs meanwhile.
        """

        def ask(rows: Array) -> Array:
            found = np.full((len(rows), len(self.outputs)), np.nan)
            for row, wanted in enumerate(rows):
                for number, value, is_whole in zip(numbers, wanted, whole):
                    self._twin.set_parameter(number.topic, int(value) if is_whole else float(value))
                with contextlib.suppress(TwinFailed):  # there is no answer with these
                    self._twin.restart()
                    self._hold(at, self.seconds)  # from how it starts to where it stays
                    found[row] = self.ask(at[None])[0]
            return found

        return ask

    def _hold(self, wanted: Array, seconds: float) -> List[Timed]:
        """What comes while the inputs have some values for so long."""
        changed: Dict[Any, Dict[str, float]] = {}
        for number, value in zip(self.numbers, wanted):
            changed.setdefault((number.topic, number.thing), {})[number.path] = float(value)
        sent: List[Timed] = []
        now = self._began = time.time()
        for key, message in self._things.items():
            held = with_numbers(message, changed.get(key, {}))
            when, period = 0.0, self._periods[key]
            while when < seconds:
                sent.append((when, key[0], _bytes(stamped(held, genpy.Time.from_sec(now + when)))))
                when += period
        everything = self._twin.play(sent, seconds)
        answers = [answer for answer in everything if answer[0] >= 0]
        # What came before the first one is an answer to something else.
        self._came.update(topic for _, topic, _ in (everything if self._sent else answers))
        self._sent.update(topic for _, topic, _ in sent)
        end = time.monotonic() + PATIENCE
        while self._is_awaited(answers) and time.monotonic() < end:
            late = [(seconds, topic, serialized) for _, topic, serialized in self._twin.play([], LATER)]
            self._came.update(topic for _, topic, _ in late)
            answers += late
        return answers

    def _is_awaited(self, answers: Sequence[Timed]) -> bool:
        """Whether answers to what is held are still to come."""
        if self._is_stamped:
            return not {number for number, _ in numbers_in(self._own(self._last(answers)))} >= set(self.outputs)
        return any(one and self._came[output] < self._sent[one] for output, one in self._answers.items())

    def _last(self, answers: Sequence[Timed]) -> Dict[Any, Any]:
        return self._recording.last(answers)

    def _gap(self, topic: str, answers: Sequence[Timed]) -> float:
        """The longest time without a message of an output."""
        came = [0.0, *(when for when, other, _ in answers if other == topic)]
        return max([later - earlier for earlier, later in zip(came, came[1:])], default=0.0)

    def _times(self, before: Mapping[Any, Any], answers: Sequence[Timed]) -> Tuple[float, float]:
        """When a change first shows, and from when on all stays as it ends, in seconds."""
        old = dict(numbers_in(before))
        end = dict(numbers_in(self._last(answers)))
        sizes = {number: max(abs(value), abs(old.get(number, value))) or 1.0 for number, value in end.items()}
        shows, stays = math.inf, 0.0
        for when, topic, serialized in answers:
            for number, value in numbers_in(self._last([(when, topic, serialized)])):
                limit = SAME * sizes.get(number, 1.0)
                if abs(value - old.get(number, value)) > limit:
                    shows = min(shows, when)
                if abs(value - end.get(number, value)) > limit:
                    stays = max(stays, when)
        return (0.0 if shows == math.inf else shows), stays


def _bytes(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
