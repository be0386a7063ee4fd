"""The flow of provenance: from a location through nodes and topics to the fields that it reaches."""

from typing import Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from rosslt import values
from rosslt.flow.provenance_map import ProvenanceMap

#: A vertex of the drawing: ('location', Source), ('node', name) or ('topic', name).
Thing = Tuple[str, object]


class Step(NamedTuple):
    """A node publishes values of a source on a topic."""

    publisher: str
    topic: str
    fields: List[str]
    next: List['Step']
    """The Steps of the nodes that subscribe to the topic."""
    is_known: bool
    """False if the route of the values to this node is unknown; for example, a service's answer is on no topic."""


class Flow:
    """The routes that sources take through nodes and topics.

    Args:
        provenance: a ProvenanceMap.
        subscribers: {topic: [node, ...]}.
    """

    def __init__(self, provenance: ProvenanceMap, subscribers: Mapping[str, Sequence[str]]) -> None:
        self.provenance = provenance
        self._subscribers = subscribers

    def steps(self, source: values.Source) -> List[Step]:
        """List the Steps from a source's node to the topics that its values reach, those of each node once."""
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

    def ways(self, source: values.Source) -> List[List[Step]]:
        """The Steps to each topic that a source reaches, from its own node to the one that publishes there."""

        def below(steps: List[Step], before: List[Step]) -> Iterator[List[Step]]:
            for step in steps:
                way = [*before, step]
                yield way
                yield from below(step.next, way)

        return list(below(self.steps(source), []))

    def paths(self, source: values.Source) -> List[Tuple[str, List[str], List[str]]]:
        """(topic, fields, [the nodes on the way there]) for all that a source reaches."""
        return [(way[-1].topic, way[-1].fields, [step.publisher for step in way]) for way in self.ways(source)]

    def edges(self, sources: Optional[Iterable[values.Source]] = None) -> Dict[Tuple[Thing, Thing], List[str]]:
        """List the edges: {(from, to): [field, ...]} over ('location', Source), ('node', name), ('topic', name).

        Args:
            sources: the sources whose flow is drawn; by default all.
        """
        found: Dict[Tuple[Thing, Thing], List[str]] = {}
        for source in self.provenance.sources if sources is None else sources:
            publishers = {reach.publisher for reach in self.provenance.reached_by(source)}
            found[('location', source), ('node', source.node)] = []
            for topic, fields, nodes in self.paths(source):
                known = found.setdefault((('node', nodes[-1]), ('topic', topic)), [])
                known += [field for field in fields if field not in known]
                for node in publishers.intersection(self._subscribers.get(topic, ())):
                    found[('topic', topic), ('node', node)] = []
        return found
