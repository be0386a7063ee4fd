"""Pairs of values that belong together in a bag: of two fields, by the stamps of their messages."""

import bisect
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import rosbag

from rosslt import values
from rosslt.cli import bags
from rosslt.cli.failure import Failure
from rosslt.cli.fields import field_of
from rosslt.cli.reading import Decoder


class Pair(NamedTuple):
    """A tracked field's value and the target value for it."""

    result: Any
    target: Any


def pairs(bag: rosbag.Bag, fields: Sequence[str], references: Sequence[str], slack: float) -> List[List[Pair]]:
    """The values of fields beside those of their references.

    A message is paired with the one of the reference's topic whose stamp is nearest: the stamp in its header, where it
    has one, else the time at which it was recorded.

    Args:
        bag: open.
        fields, references: as many TOPIC/FIELD each.
        slack: the largest difference of two stamps, in seconds.

    Returns:
        For each field its Pairs, in the order of the messages.

    Raises:
        Failure: there is no such topic or field, or it holds no number.
    """
    read: Dict[str, Tuple[List[float], List[Any]]] = {}

    def series(text: str) -> Tuple[List[float], List[Any]]:
        topic, field = bags.split_topic(bag, text)
        if topic not in read:
            read[topic] = _stamped(bag, topic)
        stamps, found = read[topic]
        return stamps, [_number(field_of(message, field), text) for message in found]

    return [_paired(series(field), series(reference), slack) for field, reference in zip(fields, references)]


def _stamped(bag: rosbag.Bag, topic: str) -> Tuple[List[float], List[Any]]:
    """The stamps of the messages of a topic, and the messages, by stamp; without those between whole ones."""
    decoder, found = Decoder(), []
    for name, raw, recorded, _ in bags.serialized(bag, [topic]):
        _, _, _, message, _, is_sampled = decoder.decode(raw[1], raw[-1], name)
        if is_sampled:
            continue
        stamp = message.header.stamp if getattr(raw[-1], '_has_header', False) else None
        found.append(((stamp or recorded).to_sec(), message))
    found.sort(key=lambda one: one[0])
    return [stamp for stamp, _ in found], [message for _, message in found]


def _number(value: Any, text: str) -> Any:
    plain = values.untracked(value)
    if isinstance(plain, bool) or not isinstance(plain, (int, float)):
        kind = getattr(plain, '_type', type(plain).__name__)
        raise Failure(f'{text} holds a {kind}, and not a number: name a field of numbers')
    return value


def _paired(results: Tuple[List[float], List[Any]], targets: Tuple[List[float], List[Any]], slack: float) -> List[Pair]:
    stamps, wanted = targets
    found = []
    for stamp, result in zip(*results):
        place = bisect.bisect_left(stamps, stamp)
        near = min(
            (each for each in (place - 1, place) if 0 <= each < len(stamps)),
            key=lambda each: abs(stamps[each] - stamp),
            default=None,
        )
        if near is not None and abs(stamps[near] - stamp) <= slack:
            found.append(Pair(result, values.untracked(wanted[near])))
    return found
