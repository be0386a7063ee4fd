"""A map from sources to the topics and fields that they reach, built from received messages."""

import re
from typing import Any, Dict, Iterable, List, NamedTuple

from rosslt import values


class Reach(NamedTuple):
    """A source reaches a topic, in messages of a publisher."""

    source: values.Source
    topic: str
    publisher: str


class ProvenanceMap:
    """The topics and fields that each source reaches.

    Attributes:
        fields: {Reach: [field, ...]} in order of appearance; `[*]` stands for any index.
    """

    def __init__(self) -> None:
        self.fields: Dict[Reach, List[str]] = {}

    def add(self, topic: str, publisher: str, message: Any) -> bool:
        """Take in a message; returns whether it has any provenance."""
        leaves = [(path, leaf) for path, leaf in values.leaves(message) if values.is_tracked(leaf)]
        for path, leaf in leaves:
            field = re.sub(r'\[\d+\]', '[*]', path)
            for source in values.sources(leaf):
                fields = self.fields.setdefault(Reach(source, topic, publisher), [])
                if field not in fields:
                    fields.append(field)
        return bool(leaves)

    @property
    def sources(self) -> List[values.Source]:
        """All sources, in order of appearance."""
        return list(dict.fromkeys(reach.source for reach in self.fields))

    def reached_by(self, source: values.Source) -> List[Reach]:
        """The Reaches of one source, in order of appearance."""
        return [reach for reach in self.fields if reach.source == source]


def brief(fields: Iterable[str]) -> str:
    """Field paths as people read them: those of one part together, `pose.position.x y z`."""
    parts: Dict[str, List[str]] = {}
    for field in fields:
        head, dot, last = field.rpartition('.')
        parts.setdefault(head + dot, []).append(last)
    return ', '.join(head + ' '.join(lasts) for head, lasts in parts.items())
