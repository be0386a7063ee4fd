"""The flow of provenance: from a location through nodes and topics to the fields that it reaches."""

from collections import namedtuple

Step = namedtuple('Step', 'publisher topic fields next is_known')
Step.__doc__ = """A node publishes values of a source on a topic.

next: the Steps of nodes that hear them there. is_known: whether it is told how they came to this node; a service's
answer, say, shows in no topic.
"""


class Flow:
    """How sources travel.

    Args:
        provenance: a ProvenanceMap.
        subscribers: {topic: [node, ...]}.
    """

    def __init__(self, provenance, subscribers):
        self.provenance = provenance
        self._subscribers = subscribers

    def steps(self, source):
        """Where a source goes from its node on: a list of Steps. Each node's own are told once."""
        reaches = self.provenance.reached_by(source)
        told = set()

        def steps_of(publisher, is_known=True):
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

    def paths(self, source):
        """(topic, fields, [the nodes on the way there]) for all that a source reaches."""

        def below(steps, before):
            for step in steps:
                nodes = [*before, step.publisher]
                yield step.topic, step.fields, nodes
                yield from below(step.next, nodes)

        return list(below(self.steps(source), []))

    def edges(self):
        """What is drawn: {(from, to): [field, ...]} over ('location', Source), ('node', name), ('topic', name)."""
        found = {}
        for source in self.provenance.sources:
            publishers = {reach.publisher for reach in self.provenance.reached_by(source)}
            found[('location', source), ('node', source.node)] = []
            for topic, fields, nodes in self.paths(source):
                known = found.setdefault((('node', nodes[-1]), ('topic', topic)), [])
                known += [field for field in fields if field not in known]
                for node in publishers.intersection(self._subscribers.get(topic, ())):
                    found[('topic', topic), ('node', node)] = []
        return found
