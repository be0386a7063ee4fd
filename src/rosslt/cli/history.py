"""The changes of their locations that nodes remember."""

from typing import Any, Dict, Iterable, List, NamedTuple, Tuple

from rosslt import node, values
from rosslt.cli.master import TIMEOUT
from rosslt.node import Directory


class Recorded(NamedTuple):
    """A change in the history of a node."""

    node: str
    recorded: Any
    """rosslt/RecordedChange."""

    @property
    def source(self) -> values.Source:
        """The location that was changed."""
        return values.Source(self.node, self.recorded.change.location_id)

    def name(self, directory: Directory) -> str:
        """NODE/LOCATION, also of a location that is gone."""
        place = directory.of(self.source)
        return place.name if place else f'{self.node}/{self.recorded.change.name}'


def recorded_changes(nodes: Iterable[str], count: int = 0) -> Tuple[List[Recorded], Dict[str, str]]:
    """The changes that nodes remember, the oldest first.

    Args:
        nodes: their full names.
        count: only the latest ones, so many; 0: all.

    Returns:
        (the changes, {node: why it does not answer}).
    """
    histories, silent = node.histories(nodes, '', TIMEOUT, count)
    found = [Recorded(name, recorded) for name, changes in histories.items() for recorded in changes]
    found.sort(key=lambda each: each.recorded.change.stamp)
    return (found[-count:] if count else found), silent
