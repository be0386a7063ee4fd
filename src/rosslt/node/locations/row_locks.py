"""Locks that forbid an edit of the rows of a list in a file, which its node would have to take."""

from typing import Tuple

from rosslt import msg, srv, values
from rosslt.node.change.client import ChangeRejected, SourceUnreachable
from rosslt.node.change.locks import Lock, name_in_full
from rosslt.node.locations.directory import Directory
from rosslt.node.service_calls import ask_all

#: The id of the node as a whole, among those of locked locations.
_WHOLE = 0


def check_locks(node: str, name: str, timeout: float) -> None:
    """Check that neither a node is locked nor a location of the list that one of its locations is in; of those of the
    same file that are in no list, if that one is in none.

    Args:
        node: its full name.
        name: NODE/LOCATION of a number in the row.
        timeout: how long the node may take to answer each question, in seconds.

    Raises:
        ChangeRejected: one is locked; the message is what `rosslt set` says of it.
        SourceUnreachable: the node does not answer; the message is the reason alone.
    """
    answers, silent = ask_all('lock_locations', srv.LockLocations, {node: srv.LockLocationsRequest()}, timeout)
    if node not in answers:
        raise SourceUnreachable(silent[node], silent)
    answer = answers[node]
    locks = {one: Lock(*lock) for one, *lock in zip(answer.locked_ids, answer.locked_by, answer.reasons)}
    if not locks:
        return
    listed, silent = Directory().ask([node], timeout)
    if node not in listed:
        raise SourceUnreachable(silent[node], silent)
    lists = {list_of(place.location) for place in listed[node] if place.name == name}
    names = {place.location.id: place.location.name for place in listed[node] if list_of(place.location) in lists}
    for location_id, lock in locks.items():
        if location_id == _WHOLE or location_id in names:
            reason = f'{name_in_full(node, names.get(location_id, ""))} is {lock.text}'
            raise ChangeRejected(f'{node} refuses: {reason}', {values.Source(node, location_id): reason})


def list_of(location: msg.Location) -> Tuple[str, str]:
    """Return the file and the list of a location: those of the same list have the same."""
    return location.file, location.row.rpartition('[')[0]
