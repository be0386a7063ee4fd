"""Access rules of nodes and locks of their locations, for `rosslt list`, `lock` and `unlock`."""

import argparse
import getpass
import socket
from typing import Dict, Iterable, List, Tuple

from rosslt import node, srv
from rosslt.cli.directory import call, find
from rosslt.cli.master import TIMEOUT, find_master, full_name, tracked_nodes
from rosslt.node import Directory


def locks_of(nodes: Iterable[str]) -> Dict[str, srv.LockLocationsResponse]:
    """{node: its answer} of nodes that answer."""
    answers, _ = node.ask_all(
        'lock_locations', srv.LockLocations, dict.fromkeys(nodes, srv.LockLocationsRequest()), TIMEOUT
    )
    return answers


def note_of(answer: srv.LockLocationsResponse, location_id: int = 0) -> str:
    """Describe the lock on a location, or on the node for id 0: `locked by ada@desk: it runs`; '' without one."""
    for locked, who, reason in zip(answer.locked_ids, answer.locked_by, answer.reasons):
        if locked == location_id:
            return f'locked by {who}' + (f': {reason}' if reason else '')
    return ''


def notes_of(answer: srv.LockLocationsResponse) -> List[str]:
    """List a node's own restrictions on changes as short texts."""
    notes = [note_of(answer)] if note_of(answer) else []
    if answer.accepted_from:
        notes.append('takes changes from {} only'.format(' and '.join(answer.accepted_from)))
    return notes


def lock_or_unlock(options: argparse.Namespace, action: str, reason: str = '') -> Tuple[str, str]:
    """Have a node lock or unlock the argument `location`; returns (node, what is locked or unlocked).

    Raises:
        Failure: there is no such location, or its node does not answer.
    """
    master = find_master()
    name, ids, text = full_name(options.location.partition('#')[0]), [], ''
    if '#' in options.location or name not in tracked_nodes(master):
        place = find(master, Directory(), options.location)
        name, ids, text = place.node, [place.location.id], place.name
    call(master, name, 'lock_locations', srv.LockLocations, srv.LockLocationsRequest(action, ids, _person(), reason))
    return name, text or name


def _person() -> str:
    return f'{getpass.getuser()}@{socket.gethostname()}'
