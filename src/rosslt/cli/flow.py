"""The flow of provenance: from a location through nodes and topics to the fields that it reaches."""

from typing import Dict, Iterator, List, Mapping, NamedTuple, Sequence, Set, Tuple

from rosslt import values
from rosslt.cli.provenance_map import ProvenanceMap

#: What is drawn: ('location', Source), ('node', name) or ('topic', name).
Thing = Tuple[str, object]


class Step(NamedTuple):
    """A node publishes values of a source on a topic."""

    publisher: str
    topic: str
    fields: List[str]
    next: List['Step']
    """The Steps of the nodes that subscribe to the topic."""
    is_known: bool
    """Whether it is known how the values came to this node; for example, the answer of a service is on no topic."""


class Flow:
    """How sources travel.

    Args:
        provenance: a ProvenanceMap.
        subscribers: {topic: [node, ...]}.
    """

    def __init__(self, provenance: ProvenanceMap, subscribers: Mapping[str, Sequence[str]]) -> None:
        self.provenance = provenance
        self._subscribers = subscribers

    def steps(self, source: values.Source) -> List[Step]:
        """Where a source's values go from its node: a list of Steps. The steps of each node are given once."""
        reaches = self.provenance.reached_by(source)
        told: Set[str] = set()

        def steps_of(publisher: str, is_known: bool = True) -> List[Step]:
            if publisher in told:
                return []
            told.add(publisher)
            return [
                Step(
                    publisher,
                    reach.topic,
                    self.provenance.fields[reach],
                    [step for node in self._subscribers.get(reach.topic, ()) for step in steps_of(node)],
                    is_known,
                )
                for reach in reaches
                if reach.publisher == publisher
            ]

        found = steps_of(source.node)
        for reach in reaches:
            found += steps_of(reach.publisher, is_known=False)
        return found

    def paths(self, source: values.Source) -> List[Tuple[str, List[str], List[str]]]:
        """(topic, fields, [the nodes on the way there]) for all that a source reaches."""

        def below(steps: List[Step], before: List[str]) -> Iterator[Tuple[str, List[str], List[str]]]:
            for step in steps:
                nodes = [*before, step.publisher]
                yield step.topic, step.fields, nodes
                yield from below(step.next, nodes)

        return list(below(self.steps(source), []))

    def edges(self) -> Dict[Tuple[Thing, Thing], List[str]]:
        """What is drawn: {(from, to): [field, ...]} over ('location', Source), ('node', name), ('topic', name)."""
        found: Dict[Tuple[Thing, Thing], List[str]] = {}
        for source in self.provenance.sources:
            publishers = {reach.publisher for reach in self.provenance.reached_by(source)}
            found[('location', source), ('node', source.node)] = []
            for topic, fields, nodes in self.paths(source):
                known = found.setdefault((('node', nodes[-1]), ('topic', topic)), [])
                known += [field for field in fields if field not in known]
                for node in publishers.intersection(self._subscribers.get(topic, ())):
                    found[('topic', topic), ('node', node)] = []
        return found
