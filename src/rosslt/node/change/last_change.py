"""Finding what takes changes back: the last one, the nodes that have a part in it, and what the code says."""

from typing import Any, Dict, Iterable, List, Optional, Tuple

from rosslt import msg, srv, values
from rosslt.messages import Scalar
from rosslt.node.change.history import EDITOR
from rosslt.node.json_scalars import from_json
from rosslt.node.locations.directory import Place
from rosslt.node.service_calls import ask_all, has_ended


def histories(
    nodes: Iterable[str], request_id: str, timeout: float, limit: int = 0
) -> Tuple[Dict[str, List[msg.RecordedChange]], Dict[str, str]]:
    """The changes that nodes remember.

    Args:
        nodes: their full names.
        request_id: what this request has changed; '' for all.
        timeout: for all together, in seconds.
        limit: only the latest changes of each node, so many; 0: all.

    Returns:
        ({node: its changes, the oldest first} of nodes that have any, {node: why it does not answer}).
    """
    requests: Dict[str, Any] = dict.fromkeys(nodes, srv.GetHistoryRequest(request_id, limit))
    answers, silent = ask_all('get_history', srv.GetHistory, requests, timeout)
    return {name: list(answer.changes) for name, answer in answers.items() if answer.changes}, silent


def taking_part(
    nodes: Iterable[str], request_id: str, timeout: float
) -> Tuple[Dict[str, List[msg.RecordedChange]], Dict[str, str]]:
    """Like `histories`, but without nodes that have ended, which have nothing to take back.

    If a running node is silent, it is not known what that node has changed: nothing is to be taken back.
    """
    found, silent = histories(nodes, request_id, timeout)
    return found, {name: reason for name, reason in silent.items() if not has_ended(reason)}


def to_take_back(changes: Iterable[msg.RecordedChange]) -> List[msg.RecordedChange]:
    """Return a node's changes that have not been taken back, and are not taken back in a file."""
    return [one for one in changes if not one.undone and one.change.requester != EDITOR]


def last_change(found: Dict[str, List[msg.RecordedChange]]) -> Optional[msg.RecordedChange]:
    """The last change in histories that is to be taken back; None if there is none.

    A node says in which order its own changes came. Those of several nodes are compared by the time of ROS and, where
    that has stood still, by their ids (`history.new_request_id`).
    """
    left = [to_take_back(changes) for changes in found.values()]
    last = [changes[-1] for changes in left if changes]
    return max(last, key=lambda recorded: (recorded.change.stamp, recorded.request_id)) if last else None


def values_in_code(places: Iterable[Place]) -> Dict[values.Source, Scalar]:
    """{Source: the value in the code} of those locations whose present value differs."""
    return {
        place.source: from_json(place.location.literal)
        for place in places
        if place.location.literal and place.value != from_json(place.location.literal)
    }
