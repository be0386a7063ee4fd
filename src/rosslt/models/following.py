"""How a field of a node that nobody tracks follows the node's inputs: as was learned, corrected by what is seen."""

import contextlib
from collections import deque
from typing import Any, Callable, Deque, Dict, Hashable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from rosslt import messages, values
from rosslt.models.learning import Answer
from rosslt.models.profiles import SMOOTH
from rosslt.models.replays import Number, stamp_of, with_numbers

#: An input at the end of its range is in it, in spite of rounding: a part of the range.
ROUNDING = 1e-9

Array = Any  # numpy.ndarray: NumPy 1.17 of Noetic has no types


class NotFollowed(Exception):
    """A field follows no input by a known slope; the text says why, as a part of a sentence."""


class Range(NamedTuple):
    """An input, and the values between which first order was seen to hold for all outputs in question."""

    number: Number
    low: float
    high: float


class Moment(NamedTuple):
    """A message, and the inputs that it was made of.

    Attributes:
        message: as it came, plain.
        inputs: the values of the inputs, tracked if their sender is.
        sent: the messages that they are of.
        is_settled: whether the inputs have been the same for so long that the message follows no former ones; without
            a stamp, they are also those of the message before, as one of two messages that come at the same time may
            be heard first.
    """

    message: messages.Message
    inputs: Sequence[Any]
    sent: Sequence[messages.Message]
    is_settled: bool


class LocalModel:
    """Outputs that follow inputs by slopes, which Broyden's rank-one updates correct.

    Args:
        slopes: an array (outputs, inputs).
        sizes: by how much each input may move; steps are compared in these units.
    """

    def __init__(self, slopes: Array, sizes: Sequence[float]) -> None:
        self.slopes = np.array(slopes, dtype=float)
        self._squares = np.square(np.asarray(sizes, dtype=float))
        self._last: Optional[Tuple[Array, Array]] = None
        self._is_confirmed = False

    def tracked(self, inputs: Sequence[Any], outputs: Sequence[float]) -> List[Any]:
        """Outputs, with the provenance that they have by way of the inputs."""
        found = []
        for value, row in zip(outputs, self.slopes.tolist()):
            whole: Any = value
            for slope, one in zip(row, inputs):
                if slope and values.is_tracked(one):
                    whole = whole + slope * (one - values.untracked(one))
            found.append(whole)
        return found

    def correct(self, inputs: Sequence[float], outputs: Sequence[float]) -> None:
        """Correct the slopes by what outputs have become since the last call.

        Raises:
            values.NotInvertible: at the first step, outputs have not moved, or have moved the other way than the slopes
                say.
        """
        now = np.array([values.untracked(one) for one in inputs], dtype=float), np.array(outputs, dtype=float)
        if self._last is not None:
            step, moved = (new - old for new, old in zip(now, self._last))
            if not step.any():
                return
            said = self.slopes @ step
            if not self._is_confirmed and not said @ moved > 0:
                how = 'moved the other way' if moved.any() else 'not moved'
                raise values.NotInvertible(f'it has {how}, and was to move by {_text(said)} as was learned')
            self._is_confirmed = True
            weighted = step / self._squares
            self.slopes = self.slopes + np.outer(moved - said, weighted) / (weighted @ step)  # others read it meanwhile
        self._last = now


class Following:
    """A field of a node's messages as a function of the inputs of the node, near where it was learned.

    Args:
        answers: what was learned of the node.
        topic, thing: of the messages, as in `Number`.
        field: the path of the field.
        paths: those of the numbers that are to change, in the message.

    Attributes:
        ranges: the inputs that it follows.
        paths: those of the numbers that follow them.
        delay: the seconds from an input to when the field stays as that makes it.

    Raises:
        NotFollowed: one of the numbers moves, but with no input of which a slope is known.
    """

    def __init__(
        self, answers: Sequence[Answer], topic: str, thing: Hashable, field: str, paths: Sequence[str]
    ) -> None:
        wanted = {Number(topic, thing, path): path for path in paths}
        slopes: Dict[Number, Dict[str, float]] = {}
        limits: Dict[Number, Tuple[float, float]] = {}
        without: Dict[str, List[str]] = {}
        for answer in answers:
            for one in answer.learned.dependencies:
                path, number, at = (
                    wanted.get(answer.outputs[one.output]),
                    answer.inputs[one.input],
                    answer.at[one.input],
                )
                if path is None:
                    continue
                if not number.path:
                    without.setdefault(path, []).append(f'{number.name}, a parameter')
                elif one.kind != SMOOTH:
                    without.setdefault(path, []).append(f'{number.name}, {one.kind}')
                else:
                    low, high = limits.get(number, (-np.inf, np.inf))
                    limits[number] = max(low, at + one.low), min(high, at + one.high)
                    slopes.setdefault(number, {})[path] = one.slope
        moved = {path for of_one in slopes.values() for path in of_one}
        for path in paths:
            if path in without and path not in moved:
                raise NotFollowed(
                    f'{Number(topic, thing, path).name} moves with {" and ".join(without[path])}, '
                    'and no slope by which a message could change it is known'
                )
        self.ranges = [Range(number, *limits[number]) for number in slopes]
        self.delay = max((answer.settled for answer in answers), default=0.0)
        self._thing, self._field = thing, field
        self.paths = [path for path in paths if path in moved]
        self._learned = [[slopes[one.number].get(path, 0.0) for one in self.ranges] for path in self.paths]
        self.begin()
        self._senders: Dict[Tuple[str, Hashable], Dict[str, None]] = {}
        self._heard: Dict[Tuple[str, Hashable], Deque[Tuple[float, messages.Message]]] = {
            (one.number.topic, one.number.thing): deque() for one in self.ranges
        }
        self._inputs: List[Any] = []  # of the last message
        self._moments: Dict[int, Tuple[Any, Moment]] = {}  # by the identity of the field, which is kept with each

    def begin(self) -> None:
        """Take the slopes as they were learned: what was seen before does not count any more."""
        self._model = LocalModel(self._learned, [(one.high - one.low) or 1.0 for one in self.ranges])

    @property
    def topics(self) -> List[str]:
        """Those of the inputs."""
        return list(dict.fromkeys(one.number.topic for one in self.ranges))

    def hear(self, topic: str, sender: str, message: messages.Message, came: float) -> None:
        """Take in a message with inputs.

        Args:
            sender: the node that sends it.
            came: when, in seconds of any clock.
        """
        key = topic, messages.thing_of(message)
        heard = self._heard.get(key)
        if heard is None:
            return
        self._senders.setdefault(key, {})[sender] = None
        heard.append((came, message))
        while len(heard) > 1 and heard[1][0] <= came - 2 * self.delay:  # of messages that wait for their inputs, too
            heard.popleft()

    def due(self, message: messages.Message, came: float) -> float:
        """Until when a message waits for the inputs of its own stamp, which may be heard after it."""
        return came + self.delay if stamp_of(message) else came

    def tracked(self, message: messages.Message, came: float, is_due: bool) -> Optional[messages.Message]:
        """A message with the provenance that its field has by way of the inputs; None if these were not heard, or it is
        about another thing.

        They are those with the same stamp; if none has it, the latest ones that the field has followed when it came.

        Args:
            message: of the node.
            came: when, by the clock of `hear`.
            is_due: whether no input of its own stamp is waited for.

        Raises:
            values.NotInvertible: none has the same stamp, and several nodes send an input.
        """
        moment = self.moment(message, came, is_due)
        if moment is None:
            return None
        made = self.made(moment)
        try:
            part = messages.part_at(made, self._field)[0]
        except messages.NoSuchPart:
            return None
        self._moments[id(part)] = part, moment
        return made

    def moment(self, message: messages.Message, came: float, is_due: bool) -> Optional[Moment]:
        """A message and the inputs that it was made of; the arguments and the rest are those of `tracked`."""
        if messages.thing_of(message) != self._thing:
            return None
        stamp, sent, is_settled, is_told = stamp_of(message), {}, True, True
        for key, heard in self._heard.items():
            same = [(when, one) for when, one in heard if stamp is not None and stamp_of(one) == stamp]
            before = [(when, one) for when, one in heard if when <= came - self.delay] if is_due else []
            if not (same or before):
                return None
            if not same and len(self._senders[key]) > 1:
                names = ' and '.join(self._senders[key])
                raise values.NotInvertible(
                    f'{names} send {key[0]}, and no stamp says of which of their messages {self._field} is made'
                )
            is_told = is_told and bool(same)
            when, sent[key] = (same or before)[-1]
            first, last = (when - self.delay, when) if same else (when, came)
            numbers = [self._numbers(key, one) for at, one in heard if first <= at <= last]
            is_settled = is_settled and all(one == numbers[0] for one in numbers)
        of_each = [sent[one.number.topic, one.number.thing] for one in self.ranges]
        try:
            inputs = [messages.part_at(one, known.number.path)[0] for one, known in zip(of_each, self.ranges)]
            self._outputs(message)
        except messages.NoSuchPart:
            return None
        known, self._inputs = self._inputs, values.untracked(inputs)
        is_settled = is_settled and (is_told or known == self._inputs)
        return Moment(values.untracked(message), inputs, of_each, is_settled)

    def _numbers(self, key: Tuple[str, Hashable], message: messages.Message) -> List[Any]:
        """The inputs in a message, as far as it has them."""
        found: List[Any] = []
        for number, _, _ in self.ranges:
            if (number.topic, number.thing) == key:
                with contextlib.suppress(messages.NoSuchPart):
                    found.append(values.untracked(messages.part_at(message, number.path)[0]))
        return found

    def made(self, moment: Moment) -> messages.Message:
        """The message with the provenance that its numbers have by way of the inputs."""
        outputs = self._outputs(moment.message)
        return with_numbers(moment.message, dict(zip(self.paths, self._model.tracked(moment.inputs, outputs))))

    def _outputs(self, message: messages.Message) -> List[float]:
        return [messages.part_at(message, path)[0] for path in self.paths]

    def correct(self, moment: Moment) -> None:
        """Correct the slopes by a message.

        Raises:
            values.NotInvertible: the node does not do what was learned.
        """
        self._model.correct(moment.inputs, self._outputs(moment.message))

    def solve(
        self,
        part: Any,
        solve: Callable[[Any], Dict[values.Source, Any]],
        check: Callable[[str, messages.Message, str, float], None],
    ) -> Dict[values.Source, Any]:
        """Correct the slopes by a message, and solve for its field.

        Args:
            part: the field, in a message of `tracked`.
            solve: solves for the same with the corrected provenance.
            check: raises if an input must not have a value: is called with the topic, its message, the path and that.

        Returns:
            {Source: its new value}.

        Raises:
            values.NotInvertible: `solve` or `check` says so, the node does not do what was learned, or an input would
                leave the range in which it was learned.
        """
        _, moment = kept = self._moments[id(part)]
        self._moments = {id(part): kept}
        self.correct(moment)
        answer = solve(messages.part_at(self.made(moment), self._field)[0])
        self.check(moment, answer, check)
        return answer

    def check(
        self,
        moment: Moment,
        answer: Mapping[values.Source, Any],
        check: Callable[[str, messages.Message, str, float], None],
    ) -> None:
        """Check the inputs that new values of sources would make.

        Args:
            moment: a message, with the inputs as they are.
            answer: {Source: its new value}.
            check: as of `solve`.

        Raises:
            values.NotInvertible: `check` says so, or an input would leave the range in which it was learned.
        """
        new = values.untracked(values.evaluate(list(moment.inputs), answer))
        for one, message, old, value in zip(self.ranges, moment.sent, moment.inputs, new):
            if value == old:
                continue
            slack = ROUNDING * (one.high - one.low)
            if not one.low - slack <= value <= one.high + slack:
                raise values.NotInvertible(
                    f'{one.number.name} would be {value:.6g}, and was learned from {one.low:.6g} to {one.high:.6g} only'
                )
            check(one.number.topic, message, one.number.path, value)


def followed_things(answers: Sequence[Answer]) -> Dict[Tuple[str, Hashable], List[str]]:
    """{(topic, thing): the paths of the numbers} of a node that follow its messages by slopes that are known."""
    found: Dict[Tuple[str, Hashable], Dict[str, None]] = {}
    for answer in answers:
        for one in answer.learned.dependencies:
            output = answer.outputs[one.output]
            if one.kind == SMOOTH and answer.inputs[one.input].path:
                found.setdefault((output.topic, output.thing), {})[output.path] = None
    return {key: list(paths) for key, paths in found.items()}


def _text(numbers: Sequence[float]) -> str:
    return ', '.join(f'{one:+.3g}' for one in numbers)
