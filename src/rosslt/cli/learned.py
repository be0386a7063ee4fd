"""What `rosslt learn` has kept of nodes, for whoever asks where a field comes from."""

import math
import time
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, NamedTuple, Optional, Sequence

import rosgraph

from rosslt import messages, values
from rosslt.cli.failure import Failure
from rosslt.cli.fields import field_of, joined
from rosslt.cli.master import find_master, full_field, problem_of
from rosslt.messages import Scalar
from rosslt.node import Heard, age_text, is_any_learned, learned_folder

if TYPE_CHECKING:
    from rosslt.models import Answer, Fresh, Kept, LiveProcess


class Effect(NamedTuple):
    """An input that moves a field."""

    topic: str
    """Of the input; the full name of a parameter."""
    path: str
    """Of the input in its messages; '' of a parameter."""
    name: str
    """TOPIC/FIELD of the input, or the parameter."""
    kind: str
    slope: float
    """NaN if it has none at the messages with which it was learned."""
    uncertainty: float
    low: float
    high: float
    size: float
    """How far the field moves if the input moves by its own size, or by 1 if it is 0; 0 without slope."""

    @property
    def text(self) -> str:
        """What is known of it, as a part of a sentence."""
        if math.isnan(self.slope):
            return f'moves with {self.name}, {self.kind}'
        by = f'{self.slope:.6g} +- {self.uncertainty:.1g}'
        return f'moves with {self.name}, {by}, from {self.low:+.3g} to {self.high:+.3g}'


class Known(NamedTuple):
    """What was learned of a field, as a node sends it.

    Attributes:
        age: the seconds since then.
        leaves: (path, value, what moves it) of each number that something moves; the largest effects first.
        why_not: why there are none, as a part of a sentence.
    """

    age: float
    leaves: Sequence['Moved']
    why_not: str


class Moved(NamedTuple):
    """A number that inputs move."""

    path: str
    value: Scalar
    effects: Sequence[Effect]


def keep(process: 'LiveProcess', tree: Mapping[str, Any], answers: Sequence['Answer']) -> str:
    """Keep what was learned of a node.

    Args:
        process: the node's.
        tree: all parameters, as it was learned with them.
        answers: what was learned.

    Returns:
        the path of the file.

    Raises:
        OSError: it cannot be written.
        models.NotCopied: the node has ended.
    """
    from rosslt import models

    asked = sorted({name for answer in answers for name in answer.asked})
    return models.keep(
        learned_folder(), models.Kept(models.version_of(process, tree, asked), time.time(), tuple(answers))
    )


def known_of(master: rosgraph.Master, received: Heard, field: str) -> 'Optional[Known]':
    """What was learned of a field of a message; None if nothing was learned of its publisher.

    Args:
        master: the ROS master.
        received: the message.
        field: its path in it.

    Raises:
        Failure: a file of the node is damaged.
    """
    fresh = fresh_of(master, received.publisher)
    if fresh is None or fresh.kept is None:
        return fresh and Known(fresh.age, (), fresh.why_stale)
    kept = fresh.kept
    found = []
    for path, leaf in values.leaves(field_of(received.message, field)):
        whole = joined(field, path)
        effects = _effects(kept, received.topic, messages.thing_of(received.message), whole)
        if effects:
            found.append(Moved(whole, leaf, effects))
    return Known(fresh.age, found, '' if found else why_nothing(kept, received, field))


def fresh_of(master: rosgraph.Master, publisher: str) -> 'Optional[Fresh]':
    """What was learned of a node; None if nothing was.

    Args:
        master: the ROS master.
        publisher: the full name of the node.

    Raises:
        Failure: a file of the node is damaged.
    """
    if not is_any_learned():
        return None
    from rosslt import models  # NumPy and SciPy, which nodes of which nothing was learned do without

    try:
        return models.fresh_of(master, learned_folder(), publisher)
    except models.BadFile as error:
        raise Failure(str(error)) from None


def _effects(kept: 'Kept', topic: str, thing: object, path: str) -> List[Effect]:
    found = []
    for answer in kept.answers:
        for one in answer.learned.dependencies:
            if answer.outputs[one.output] != (topic, thing, path):
                continue
            moved_by, at = answer.inputs[one.input], answer.at[one.input]
            slope = one.slope if one.kind == 'smooth' else math.nan
            size = 0.0 if math.isnan(slope * at) else abs(slope) * (abs(at) or 1.0)
            name = moved_by.name
            found.append(
                Effect(moved_by.topic, moved_by.path, name, one.kind, slope, one.uncertainty, one.low, one.high, size)
            )
    return sorted(found, key=lambda each: (math.isnan(each.slope), -each.size, each.name))


def why_nothing(kept: 'Kept', received: Heard, field: str) -> str:
    """Why nothing moves any number of a field."""
    thing, node = messages.thing_of(received.message), kept.version.node
    paths = {joined(field, path) for path, _ in values.leaves(field_of(received.message, field))}
    of_field = [
        index in answer.learned.unrepeatable
        for answer in kept.answers
        for index, number in enumerate(answer.outputs)
        if number.topic == received.topic and number.thing == thing and number.path in paths
    ]
    if not of_field:
        return f'nothing of this field, as {node} sent no such floating-point number then'
    if all(of_field):
        return 'it is not the same each time, and nothing is known of it'
    is_whole = not any(answer.learned.untried or answer.learned.unanswered for answer in kept.answers)
    return f'it moves with nothing that was tried{"" if is_whole else ", but not all inputs were tried to the end"}'


def of_silent(text: str) -> str:
    """What was learned of a topic that nobody sends, as the end of a sentence; '' if nothing was, or if its nodes run.

    Args:
        text: TOPIC/FIELD.
    """
    if not is_any_learned():
        return ''
    from rosslt import models

    master, full = find_master(), full_field(text)
    learned: Dict[str, float] = {}
    for path in models.kept_files(learned_folder()):
        try:
            kept = models.read_kept(path)
        except models.BadFile:
            continue  # it is named when its node is asked for
        topics = {number.topic for answer in kept.answers for number in answer.outputs}
        node = kept.version.node
        if messages.topic_in(full, topics) and problem_of(master, node):
            learned[node] = max(kept.when, learned.get(node, kept.when))
    return ''.join(
        f'; what {node} sends on it was learned {age_text(max(0.0, time.time() - when))} ago; the node does not run'
        for node, when in sorted(learned.items())
    )
