"""Forcing a field of a node that nobody tracks, by what `rosslt learn` has found of the node."""

import math
import time
from collections import deque
from typing import (
    TYPE_CHECKING,
    Any,
    Callable,
    Deque,
    Dict,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Union,
)

import rosgraph

from rosslt import messages, node, values
from rosslt.cli import learned
from rosslt.cli.fields import joined
from rosslt.messages import Message
from rosslt.node import Heard

if TYPE_CHECKING:
    from rosslt.models import Following, Fresh

#: A field is as wanted if each number in it lacks no more than this part of the change that was wished.
NEAR = 1e-3


class Basis(NamedTuple):
    """What a field is forced by.

    Attributes:
        following: the field as a function of the node's inputs.
        topic, publisher: of its messages.
        age: the seconds since that was learned.
    """

    following: 'Following'
    topic: str
    publisher: str
    age: float

    @property
    def text(self) -> str:
        """What it is, as a sentence."""
        return f'by the slopes that were learned of {self.publisher} {node.age_text(self.age)} ago'

    def stream(self, listener: node.Listener) -> 'LearnedStream':
        """The messages, whose field has provenance by way of the inputs.

        Args:
            listener: of the topic, and of the topics of the inputs.
        """
        return LearnedStream(listener, self)

    def solve(self, part: Any, wanted: Any, sources: Any, limits: Mapping[str, Any]) -> Dict[values.Source, Any]:
        """Solve for the field of a message.

        Args:
            part, wanted, sources, limits: as of `solve_by_effect`.

        Raises:
            values.NotInvertible: as in `Following.solve`.
        """
        return self.following.solve(
            part, lambda corrected: node.solve_by_effect(corrected, wanted, sources, limits), node.check_number
        )

    def forcing(self, *arguments: Any) -> 'LearnedForcing':
        """A Forcing of the field; the arguments are those of a Forcing."""
        forcing = LearnedForcing(*arguments)
        forcing.basis = self
        forcing.timeout += self.following.delay
        return forcing

    def why_no_source(self) -> str:
        """Say that no input of the field has a source."""
        names = ' and '.join(one.number.name for one in self.following.ranges)
        return (
            f'nothing in it has a source, as {self.publisher} sends it; {self.text} it follows {names}, which has no '
            'source either: run the node that sends it with `rosslt run`'
        )


def basis_of(
    master: rosgraph.Master, heard: Sequence[Heard], paths: Mapping[str, str], target_of: Callable[[Heard], Message]
) -> Tuple[Optional[Basis], List[str]]:
    """Find what is learned of the first of several publishers of which something is.

    Args:
        master: the ROS master.
        heard: a message of each, whose field has no source.
        paths: {publisher: the path of the field in its message}.
        target_of: gives the target of the field in a message.

    Returns:
        None if nothing is known of any; and why, as parts of sentences.

    Raises:
        Failure: a file of a node is damaged.
    """
    why_not: List[str] = []
    for received in heard:
        fresh = learned.fresh_of(master, received.publisher)
        if fresh is None:
            continue
        found = _following(fresh, received, paths[received.publisher], target_of)
        if not isinstance(found, str):
            return Basis(found, received.topic, received.publisher, fresh.age), []
        why_not.append(f'learned {node.age_text(fresh.age)} ago, {found}')
    return None, why_not


def _following(
    fresh: 'Fresh', received: Heard, field: str, target_of: Callable[[Heard], Message]
) -> 'Union[Following, str]':
    """The field of a message as a function of the inputs, or why there is none."""
    if fresh.kept is None:
        return fresh.why_stale
    from rosslt import models

    wanted = {joined(field, path): leaf for path, leaf in values.leaves(target_of(received)) if leaf is not None}
    thing = messages.thing_of(received.message)
    try:
        following = models.Following(fresh.kept.answers, received.topic, thing, field, list(wanted))
    except models.NotFollowed as error:
        return str(error)
    if not following.ranges:
        return learned.why_nothing(fresh.kept, received, field)
    for path, target in wanted.items():
        part, type_ = messages.part_at(received.message, path)
        if path not in following.paths and not messages.is_reached(part, target, type_):
            return f'nothing that was tried moves {path}, which is {part!r}'
    return following


class LearnedStream:
    """Messages whose field has provenance by way of the inputs of their node, as a Listener has messages.

    Args:
        listener: of their topic, and of the topics of the inputs.
        basis: what they come from.
    """

    def __init__(self, listener: node.Listener, basis: Basis) -> None:
        self._listener, self._basis = listener, basis
        self._waiting: Deque[Tuple[float, Heard]] = deque()  # for inputs of their stamps, since when

    def clear(self) -> None:
        """Forget what has come, but the inputs: the next messages may be made of them."""
        while True:
            heard = self._listener.next_before(time.monotonic())
            if heard is None:
                break
            self._take(heard)
        self._waiting.clear()

    def why_nothing(self, timeout: float) -> str:
        """Say why nothing has come."""
        names = ' and '.join(self._basis.following.topics)
        return f'no message on {self._basis.topic} and whole one on {names} before it within {timeout:g} s'

    def next_before(self, end: float) -> Optional[Heard]:
        """The next message, or None if there is none until a time of `time.monotonic`."""
        following = self._basis.following
        while True:
            due = end
            if self._waiting:
                came, heard = self._waiting[0]
                due = following.due(heard.message, came)
                is_due = time.monotonic() >= due
                made = following.tracked(heard.message, came, is_due)
                if made is not None or is_due:
                    self._waiting.popleft()
                    if made is not None:
                        return heard._replace(message=made)
                    continue
            received = self._listener.next_before(min(end, due))
            if received is not None:
                self._take(received)
            elif time.monotonic() >= end:
                return None

    def _take(self, heard: Heard) -> None:
        now, basis = time.monotonic(), self._basis
        if heard.topic in basis.following.topics:
            basis.following.hear(heard.topic, heard.publisher, heard.message, now)
        if heard.topic == basis.topic and heard.publisher == basis.publisher:
            self._waiting.append((now, heard))


class LearnedForcing(node.Forcing):
    """Forces a field by what was learned of its node, corrected by what the node sends then."""

    expected_by = 'what was learned'
    basis: Basis
    _wished: Optional[List[float]] = None  # how far each leaf was from its target in the first message

    def solve(self, part: Any, limits: Mapping[str, Any]) -> Dict[values.Source, Any]:
        """Solve for the field of a message."""
        return self.basis.solve(part, self.wanted, self.sources, limits)

    def _observed(self, message: Message) -> Optional[node.Observation]:
        found = super()._observed(message)
        if found is None:
            return None
        lacks = messages.lacks(found.part, self.wanted, messages.part_at(message, self.path)[1])
        self._wished = self._wished or lacks
        is_reached = len(lacks) == len(self._wished) and all(
            lack <= NEAR * wished < math.inf for lack, wished in zip(lacks, self._wished)
        )
        return found._replace(is_reached=found.is_reached or is_reached)
