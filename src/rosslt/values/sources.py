"""Sources: identifiers of the values that numbers are computed from, and their names in texts."""

from typing import Any, Callable, Iterator, NamedTuple, Optional

from .annotations import Value


class Source(NamedTuple):
    """Names one changeable location: a node of the ROS graph and a location in it (paper, IV.A).

    Equal sources name the same location, unequal ones different locations; they are immutable and hashable.
    """

    node: str
    location_id: int

    def __str__(self) -> str:
        return '%s#%s' % self


UNKNOWN = Source('', -1)
"""What a number of a message that came without its provenance depends on, beside all else that is computed with it.

It is nobody's location: it is never solved for, and never sent."""


class UnnamedSource(Source):
    """A source of this process before it is a node: it gets the node's name later, wherever it is already used.

    A node may read its locations before `init_node` has said what it is called. The expressions that hold such a
    source need no change when the name is known.

    Args:
        location_id: the id of the location.
    """

    def __new__(cls, location_id: int) -> 'UnnamedSource':
        return super().__new__(cls, '', location_id)

    @property
    def node(self) -> str:
        """The node's name, '' until it is known."""
        return self.__dict__.get('name', '')

    def name_node(self, node: str) -> None:
        """Set the name of the node, once."""
        self.__dict__['name'] = node

    def __getitem__(self, index: Value) -> Value:
        return (self.node, self.location_id)[index]

    def __iter__(self) -> Iterator[Value]:
        return iter((self.node, self.location_id))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Source) and (self.node, self.location_id) == (other.node, other.location_id)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((self.node, self.location_id))

    def __str__(self) -> str:
        return f'{self.node}#{self.location_id}'

    def __repr__(self) -> str:
        return f'Source(node={self.node!r}, location_id={self.location_id!r})'

    def __copy__(self) -> 'UnnamedSource':
        return self

    def __deepcopy__(self, _memo: Any) -> 'UnnamedSource':
        return self

    def __reduce__(self) -> Any:
        return Source, (self.node, self.location_id)


_describe: Optional[Callable[[Source], Optional[str]]] = None


def describe_sources_with(function: Optional[Callable[[Source], Optional[str]]]) -> None:
    """Set what error messages and `explain` call a source, e.g. `waypoints.script:3:12`.

    Args:
        function: gives the text for a Source, or None if it knows nothing of it; it must be fast and
            not raise. None restores the default, `node#location_id`.
    """
    global _describe
    _describe = function


def describe_source(source: Source) -> str:
    """Return the name of a source in a text: its file and line if these are known."""
    if source == UNKNOWN:
        return 'a message without provenance'
    return (_describe and _describe(source)) or str(source)
