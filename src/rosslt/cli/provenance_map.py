"""Where values come from, topic by topic: gathered from messages that pass."""

import re
from collections import namedtuple

from rosslt import values

Reach = namedtuple('Reach', 'source topic publisher')
Reach.__doc__ = 'A source reaches a topic, in messages of a publisher.'


class ProvenanceMap:
    """Which source reaches which fields of which topics.

    Attributes:
        fields: {Reach: [field, ...]} in order of appearance; `[*]` stands for any index.
    """

    def __init__(self):
        self.fields = {}

    def add(self, received):
        """Take in a message; returns whether it has any provenance."""
        leaves = [(path, leaf) for path, leaf in values.leaves(received.message) if values.is_tracked(leaf)]
        for path, leaf in leaves:
            field = re.sub(r'\[\d+\]', '[*]', path)
            for source in values.sources(leaf):
                fields = self.fields.setdefault(Reach(source, received.topic, received.publisher), [])
                if field not in fields:
                    fields.append(field)
        return bool(leaves)

    @property
    def sources(self):
        """All sources, in order of appearance."""
        return list(dict.fromkeys(reach.source for reach in self.fields))

    def reached_by(self, source):
        """The Reaches of one source, in order of appearance."""
        return [reach for reach in self.fields if reach.source == source]


def brief(fields):
    """Field paths as people read them: those of one part together, `pose.position.x y z`."""
    parts = {}
    for field in fields:
        head, dot, last = field.rpartition('.')
        parts.setdefault(head + dot, []).append(last)
    return ', '.join(head + ' '.join(lasts) for head, lasts in parts.items())
