"""Asking other nodes: for a change of their sources, and for the values that they have now.

The paper's `force_value` and `reevaluate` (section IV-A), acknowledged: every request goes to the owning
node's service, all nodes at once, and waits for the answer, but never longer than it was told to.
"""

import time
from typing import (
    Any,
    Callable,
    Collection,
    Dict,
    Iterable,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Protocol,
    Sequence,
    Tuple,
    TypeVar,
)

from rosslt import msg, srv, values
from rosslt.node.directory import Directory
from rosslt.node.history import new_request_id
from rosslt.node.json_scalars import Refused, from_json, to_json
from rosslt.node.service_calls import ask_all
from rosslt.node.together import Part, change_together

_Solved = TypeVar('_Solved')


class Change(NamedTuple):
    """What a request changed at a source: its value before and after."""

    old: Any
    new: Any


class Asker(Protocol):
    """Who asks: its name, and what it knows of sources. The services of its own locations are its methods."""

    @property
    def name(self) -> str: ...

    @property
    def directory(self) -> Directory: ...


class SourceUnreachable(values.Error):
    """A node that owns a source does not answer.

    Attributes:
        nodes: the names of the nodes.
        changed: what the same request has changed in other nodes and could not be taken back, {Source: Change}.
        taken_back: what it had changed there, and has the former value again, {Source: Change}.
    """

    def __init__(
        self,
        message: str,
        nodes: List[str],
        changed: Optional[Dict[values.Source, Change]] = None,
        taken_back: Optional[Dict[values.Source, Change]] = None,
    ) -> None:
        super().__init__(message)
        self.nodes = nodes
        self.changed = changed or {}
        self.taken_back = taken_back or {}


class ChangeRejected(values.Error):
    """A node refuses a change of its sources.

    Attributes:
        reasons: {Source: the owner's reason}.
        changed: what the same request has changed in other nodes and could not be taken back, {Source: Change}.
        taken_back: what it had changed there, and has the former value again, {Source: Change}.
    """

    def __init__(
        self,
        message: str,
        reasons: Dict[values.Source, str],
        changed: Optional[Dict[values.Source, Change]] = None,
        taken_back: Optional[Dict[values.Source, Change]] = None,
    ) -> None:
        super().__init__(message)
        self.reasons = reasons
        self.changed = changed or {}
        self.taken_back = taken_back or {}


def force_value(
    owner: Asker,
    x: Any,
    target: Any,
    source: Optional[values.Source] = None,
    timeout: float = 1.0,
    request_id: str = '',
    sources: Optional[Collection[values.Source]] = None,
) -> Dict[values.Source, Change]:
    """`rosslt.force_value`, for a node that owns locations itself, or for a command that owns none."""
    deadline = time.monotonic() + timeout
    wanted = solved(
        owner,
        values.sources(x),
        timeout / 2,
        lambda limits: values.solve(x, target, source, sources=sources, **limits),
    )
    by_node: Dict[str, List[Tuple[values.Source, Any]]] = {}
    for changing, value in wanted.items():
        by_node.setdefault(changing.node, []).append((changing, value))
    request_id = request_id or new_request_id()
    if len(by_node) > 1:
        return _force_together(owner, by_node, request_id, deadline)
    requests = {
        node: srv.RequestChangesRequest(
            request_id,
            owner.name,
            [changing.location_id for changing, _ in pairs],
            [to_json(value) for _, value in pairs],
        )
        for node, pairs in by_node.items()
    }
    answers, silent = _ask(owner, 'request_changes', srv.RequestChanges, requests, deadline)
    changed: Dict[values.Source, Change] = {}
    reasons: Dict[values.Source, str] = {}
    for node, answer in answers.items():
        asked = [changing for changing, _ in by_node[node]]
        if answer.applied:
            changed.update(zip(asked, map(Change, answer.old_values, answer.new_values)))
        else:
            reasons.update((changing, reason) for changing, reason in zip(asked, answer.reasons) if reason)
    if reasons or silent:
        owner.directory.forget(wanted)
    if reasons:
        raise ChangeRejected(_refusal(reasons), reasons)
    if silent:
        raise _unreachable(silent)
    return changed


def solved(
    owner: Asker, sources: Sequence[values.Source], timeout: float, solve: Callable[[Dict[str, Any]], _Solved]
) -> _Solved:
    """The result of solving within what the owners of sources allow.

    Args:
        timeout: how long to wait for what the owners say, in seconds.
        solve: called with the limits, as arguments of `values.solve`.

    Raises:
        values.NotInvertible: as of `solve`.
        ChangeRejected: a lock stands in the way.
    """
    limits = owner.directory.limits(sources, timeout)
    try:
        return solve(limits)
    except values.NotInvertible:
        if not limits['read_only']:
            raise
    owner.directory.forget(limits['read_only'])  # one may have been unlocked since
    limits = owner.directory.limits(sources, timeout)
    try:
        return solve(limits)
    except values.NotInvertible:
        locked = _locked(limits['read_only'], timeout)
        if not locked:
            raise
    raise ChangeRejected(_refusal(locked), locked)


def _locked(sources: Sequence[values.Source], timeout: float) -> Dict[values.Source, str]:
    """Those of sources of other nodes that are locked, with who and why."""
    nodes = {source.node for source in sources}
    answers, _ = ask_all('lock_locations', srv.LockLocations, dict.fromkeys(nodes, srv.LockLocationsRequest()), timeout)
    return {
        values.Source(node, location_id): f'locked by {who}' + (f': {reason}' if reason else '')
        for node, answer in answers.items()
        for location_id, who, reason in zip(answer.locked_ids, answer.locked_by, answer.reasons)
        if values.Source(node, location_id) in sources
    }


def _force_together(
    owner: Asker, by_node: Dict[str, List[Tuple[values.Source, Any]]], request_id: str, deadline: float
) -> Dict[values.Source, Change]:
    """Change sources of several nodes, all or none; raises as `force_value` does."""
    parts = {
        node: Part([changing.location_id for changing, _ in pairs], [to_json(value) for _, value in pairs])
        for node, pairs in by_node.items()
    }
    outcome = change_together(owner, parts, owner.name, request_id, deadline)
    changed, taken_back = _by_source(outcome.changes), _by_source(outcome.taken_back)
    if outcome.is_done:
        return changed
    sources = {node: [changing for changing, _ in pairs] for node, pairs in by_node.items()}
    owner.directory.forget(changing for node in sources for changing in sources[node])
    reasons = {
        changing: reason
        for node, said in outcome.reasons.items()
        # a node that refuses when it is to apply its part says one reason for all
        for changing, reason in zip(
            sources[node], said if len(said) == len(sources[node]) else said * len(sources[node])
        )
        if reason
    }
    told = _what_was_done(owner, changed, taken_back, outcome.left)
    if reasons:
        raise ChangeRejected(_refusal(reasons) + told, reasons, changed, taken_back)
    raise SourceUnreachable(_cannot_reach(outcome.silent) + told, sorted(outcome.silent), changed, taken_back)


def _by_source(changes: Mapping[str, Iterable[msg.AppliedChange]]) -> Dict[values.Source, Change]:
    return {
        values.Source(node, change.location_id): Change(from_json(change.old_value), from_json(change.new_value))
        for node, changed in changes.items()
        for change in changed
    }


def _what_was_done(
    owner: Asker,
    changed: Dict[values.Source, Change],
    taken_back: Dict[values.Source, Change],
    left: Dict[str, str],
) -> str:
    """The end of an error: what was taken back, and what could not be."""
    if not taken_back and not left:
        return '; nothing has changed'
    parts = []
    if taken_back:
        parts.append('taken back: ' + ', '.join(map(owner.directory.name, taken_back)))
    for node, why in left.items():
        kept = [
            f'{owner.directory.name(source)} = {to_json(change.new)}'
            for source, change in changed.items()
            if source.node == node
        ]
        said = 'not taken back: ' + ', '.join(kept) if kept else f'not known: whether {node} has changed its part'
        parts.append(f'{said} ({why})')
    return '; ' + '; '.join(parts)


def reevaluate(owner: Asker, x: Any, timeout: float = 1.0) -> Any:
    """`rosslt.reevaluate`, for a node that owns locations itself."""
    by_node: Dict[str, List[values.Source]] = {}
    for source in values.sources(x):
        by_node.setdefault(source.node, []).append(source)
    requests = {
        node: srv.GetValuesRequest([source.location_id for source in wanted]) for node, wanted in by_node.items()
    }
    answers, silent = _ask(owner, 'get_values', srv.GetValues, requests, time.monotonic() + timeout)
    current: Dict[values.Source, Any] = {}
    for node, answer in answers.items():
        for source, value, reason in zip(by_node[node], answer.values, answer.reasons):
            if reason:
                silent[node] = reason
            else:
                current[source] = value
    if silent:
        raise _unreachable(silent)
    return values.reapply(x, current)


class Undone(NamedTuple):
    """The result of taking a request back: what has changed in each node, and the reasons where not all of it was
    taken back; then nothing has changed, but for what could not be restored."""

    changes: Dict[str, List[msg.AppliedChange]]
    reasons: Dict[str, str]


def undo_request(request_id: str, nodes: Iterable[str], requester: str, timeout: float) -> Undone:
    """Take back what a request has changed, in all nodes that have a part in it or, where one does not, in none.

    Args:
        request_id: as in their histories.
        nodes: their full names.
        requester: who asks.
        timeout: for all together, in seconds.

    Returns:
        What was taken back, and why a node that has a part in it refuses or does not answer.
    """
    asked = list(nodes)
    if len(asked) > 1:
        parts = dict.fromkeys(asked, Part())
        outcome = change_together(_Nobody(), parts, requester, request_id, time.monotonic() + timeout)
        reasons = {node: '; '.join(filter(None, said)) for node, said in outcome.reasons.items()}
        reasons.update(outcome.silent)
        for node, why in outcome.left.items():
            reasons.setdefault(node, f'it has changed, and could not be restored: {why}')
        return Undone(outcome.changes, reasons)
    requests = {node: srv.UndoRequestRequest(request_id, requester) for node in asked}
    answers, reasons = ask_all('undo_request', srv.UndoRequest, requests, timeout)
    changes = {node: list(answer.changes) for node, answer in answers.items() if answer.success}
    reasons.update((node, answer.message) for node, answer in answers.items() if not answer.success)
    return Undone(changes, reasons)


class _Nobody:
    """An asker without locations: every node is asked by its services."""

    name = ''


def _refusal(reasons: Dict[values.Source, str]) -> str:
    said = dict.fromkeys(f'{rejected.node}: {reason}' for rejected, reason in reasons.items())
    return 'the change is refused: ' + '; '.join(said)


def _cannot_reach(silent: Dict[str, str]) -> str:
    return '; '.join(f'cannot reach {node}: {why}' for node, why in silent.items())


def _unreachable(silent: Dict[str, str]) -> SourceUnreachable:
    return SourceUnreachable(_cannot_reach(silent), sorted(silent))


def _ask(
    owner: Asker, service: str, service_class: Any, requests: Dict[str, Any], deadline: float
) -> Tuple[Dict[str, Any], Dict[str, str]]:
    """Ask other nodes by their services, and this one at once.

    Returns:
        ({node: response, its values read from JSON}, {node: why there is none}).
    """
    others = {node: request for node, request in requests.items() if node != owner.name}
    answers, silent = ask_all(service, service_class, others, deadline - time.monotonic())
    if owner.name in requests:
        answers[owner.name] = getattr(owner, service)(requests[owner.name])
    for node in list(answers):
        try:
            answers[node] = _read(answers[node], len(requests[node].location_ids))
        except Refused as refused:
            silent[node] = f'its answer cannot be read: {refused}'
            del answers[node]
    return answers, silent


def _read(answer: Any, count: int) -> Any:
    """An answer with its lists of JSON scalars read.

    Raises:
        Refused: it has not as many of each as were asked for, or a text is no JSON scalar.
    """
    for field in answer.__slots__:
        column = getattr(answer, field)
        if isinstance(column, list):
            if len(column) != count:
                raise Refused(f'{len(column)} {field} for {count} locations')
            if field != 'reasons':
                setattr(answer, field, [from_json(text) if text else None for text in column])
    return answer
