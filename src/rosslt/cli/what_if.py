"""Rewrites the messages of a bag for other source values: evaluates the provenance that the messages carry."""

import io
from typing import Dict, Mapping, Optional

import genpy
import rosbag

from rosslt import messages, values
from rosslt.cli import bags
from rosslt.values import AFFINE, Source


class Topic:
    """Counts of the messages of one topic after rewriting.

    Attributes:
        count: the number of messages.
        changed: the number of messages with changed values.
        left_out: the number of messages that were left out as they have no value any more; `reason` says why.
        is_approximate: True if some of them come from the provenance of the message before, or from a linearization,
            which holds near the recorded values only.
    """

    def __init__(self) -> None:
        self.count = self.changed = self.left_out = 0
        self.is_approximate = False
        self.reason = ''


def rewrite(bag: rosbag.Bag, output: rosbag.Bag, changes: Mapping[Source, messages.Scalar]) -> Dict[str, Topic]:
    """Write the messages that a bag would have had with other source values.

    A message keeps its time, its connection and its provenance, which says the new source values. What was computed
    without provenance stays as it was recorded; `if`s are not decided again.

    Returns:
        {name: Topic}.
    """
    topics: Dict[str, Topic] = {}
    rewriter, writer = _Rewriter(changes), bags.ConnectionWriter(output)
    for name, raw, stamp, header in bags.serialized(bag):
        topic = topics.setdefault(name, Topic())
        topic.count += 1
        data = rewriter.rewritten(name, topic, raw, header)
        if data is not None:
            writer.write(name, (raw[0], data, *raw[2:]), stamp, header)
    return topics


class _Rewriter:
    def __init__(self, changes: Mapping[Source, messages.Scalar]) -> None:
        self._changes = dict(changes)
        self._decoder = bags.Decoder()

    def rewritten(self, name: str, topic: Topic, raw: bags.Raw, header: bags.Header) -> Optional[bytes]:
        """The data of a message with the other source values; None if it has no value."""
        data, message_class = raw[1], raw[-1]
        received = self._decoder.decode(name, raw, header)
        message = received.message
        fields = messages.tracked_fields(message)
        if not fields:
            return data
        topic.is_approximate = topic.is_approximate or received.is_sampled
        leaves = [leaf for _, leaf, _ in fields]
        if self._changes.keys().isdisjoint(values.sources(leaves)):
            return data
        try:
            new = values.reapply(leaves, self._changes)
            held = {index: messages.as_held(made, kind) for (index, _, kind), made in zip(fields, new)}
            messages.set_leaves(message, held)
            written = _serialized(message, message_class, messages.SAMPLED if received.is_sampled else None)
        except (ArithmeticError, ValueError, TypeError, genpy.SerializationError) as error:
            topic.left_out += 1
            topic.reason = topic.reason or str(error)
            return None
        topic.changed += any(made != leaf for made, leaf in zip(new, leaves))
        topic.is_approximate = topic.is_approximate or any(map(_is_linearized, leaves))
        return written


def _is_linearized(leaf: messages.Message) -> bool:
    if values.affine(leaf) is not None:
        return False
    instructions, _ = values.disassemble([leaf])
    return any(instruction[0] == AFFINE and not instruction[-1] for instruction in instructions)


def _serialized(message: messages.Message, message_class: type, provenance: Optional[bytes]) -> bytes:
    buff = io.BytesIO()
    if messages.is_tracked_type(message_class):
        messages.wrap(message, message_class, provenance).serialize(buff)
    else:
        message.serialize(buff)
        messages.append_provenance(message, buff, provenance)
    return buff.getvalue()
