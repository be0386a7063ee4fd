"""Sources: the places that numbers come from, and how to call them in a sentence."""

from typing import Callable, NamedTuple, Optional


class Source(NamedTuple):
    """Names one changeable location: a node of the ROS graph and a location in it (paper, IV.A).

    Two sources are the same place exactly if they are equal; they are immutable and hashable.
    """

    node: str
    location_id: int

    def __str__(self) -> str:
        return '%s#%s' % self


_describe: Optional[Callable[[Source], Optional[str]]] = None


def describe_sources_with(function: Optional[Callable[[Source], Optional[str]]]) -> None:
    """Set what error messages and `explain` call a source, e.g. `waypoints.script:3:12`.

    Args:
        function: gives the text for a Source, or None where it knows nothing of it; it must be fast and
            not raise. None restores the default, `node#location_id`.
    """
    global _describe
    _describe = function


def describe_source(source: Source) -> str:
    """What to call a source in a sentence: its place in a file where that is known."""
    return (_describe and _describe(source)) or str(source)
