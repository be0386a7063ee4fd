"""Requests to other nodes: to change their sources (`request_values`, in which every change ends), to take a change
back, and for the values that sources have now.

The paper's `force_value` and `reevaluate` (section IV-A), acknowledged: every request goes to the owning
node's service and waits for the answer, but never longer than it was told to.
"""

import contextlib
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
from rosslt.messages import Scalar
from rosslt.node.api import started
from rosslt.node.change.commit_coordinator import Part, commit
from rosslt.node.change.commit_participant import ABORTED, APPLIED, ASK, OUTDATED
from rosslt.node.change.history import NOTHING_TO_UNDO, new_request_id
from rosslt.node.change.subscriber_calls import AWAITED
from rosslt.node.json_scalars import Refused, from_json, to_json
from rosslt.node.locations.directory import Directory
from rosslt.node.service_calls import ask_all

_Solved = TypeVar('_Solved')


class Change(NamedTuple):
    """A change of a source: its value before and after."""

    old: Scalar
    new: Scalar


class Asker(Protocol):
    """A node or command that asks for changes: its name, and what it knows of sources. If it has locations of its
    own, their services are its methods."""

    @property
    def name(self) -> str: ...

    @property
    def directory(self) -> Directory: ...


class Requester(NamedTuple):
    """An asker without locations of its own: a command.

    Attributes:
        name: who asks, as histories say it.
        directory: what it knows of sources.
    """

    name: str
    directory: Directory


class _RequestFailed(values.Error):
    """A change of sources has failed.

    Attributes:
        changed: what the same request has changed in other nodes and could not be taken back, {Source: Change}.
        taken_back: what it had changed there, and has the former value again, {Source: Change}.
    """

    def __init__(
        self,
        message: str,
        changed: Optional[Dict[values.Source, Change]] = None,
        taken_back: Optional[Dict[values.Source, Change]] = None,
    ) -> None:
        super().__init__(message)
        self.changed = changed or {}
        self.taken_back = taken_back or {}


class SourceUnreachable(_RequestFailed):
    """A node that owns a source does not answer.

    Attributes:
        silent: {name of a node: why it does not answer}.
        changed, taken_back: what the same request has changed in other nodes and could not be taken back, and what it
            could, {Source: Change}.
    """

    def __init__(self, message: str, silent: Dict[str, str], *done: Dict[values.Source, Change]) -> None:
        super().__init__(message, *done)
        self.silent = silent

    @property
    def nodes(self) -> List[str]:
        """The names of the nodes."""
        return sorted(self.silent)


class ChangeRejected(_RequestFailed):
    """A node refuses a change of its sources.

    Attributes:
        reasons: {Source: the owner's reason}.
        changed, taken_back: what the same request has changed in other nodes and could not be taken back, and what it
            could, {Source: Change}.
    """

    def __init__(self, message: str, reasons: Dict[values.Source, str], *done: Dict[values.Source, Change]) -> None:
        super().__init__(message, *done)
        self.reasons = reasons


def request_values(
    wanted: Mapping[values.Source, Scalar], timeout: float = 1.0, request_id: str = '', asker: Optional[Asker] = None
) -> Dict[values.Source, Change]:
    """Have the owners of sources give them new values, all or none: every change ends in this call.

    Args:
        wanted: {Source: new value}.
        timeout, request_id: as in `force_value`.
        asker: who asks; by default this node.

    Returns, Raises:
        As of `force_value`; nothing is solved.
    """
    asker = asker or started('request_values')
    sources: Dict[str, List[values.Source]] = {}
    for source in wanted:
        sources.setdefault(source.node, []).append(source)
    parts = {
        node: Part([one.location_id for one in owned], [to_json(wanted[one]) for one in owned])
        for node, owned in sources.items()
    }
    outcome = commit(asker, parts, asker.name, request_id or new_request_id(), time.monotonic() + timeout)
    try:
        changed, taken_back = _by_source(outcome.changes), _by_source(outcome.taken_back)
    except Refused as refused:
        raise _unreachable(dict.fromkeys(sources, f'an answer cannot be read: {refused}')) from None
    if outcome.is_done:
        return changed
    asker.directory.forget(wanted)
    reasons = {
        source: reason
        for node, said in outcome.reasons.items()
        for source, reason in zip(sources[node], said)
        if reason
    }
    told = _what_was_done(asker, changed, taken_back, outcome.left) if len(parts) > 1 else ''
    if reasons:
        raise ChangeRejected(_refusal(reasons) + told, reasons, changed, taken_back)
    raise SourceUnreachable(_cannot_reach(outcome.silent) + told, outcome.silent, changed, taken_back)


def force_value(
    x: object,
    target: object,
    source: Optional[values.Source] = None,
    timeout: float = 1.0,
    request_id: str = '',
    sources: Optional[Collection[values.Source]] = None,
) -> Dict[values.Source, Change]:
    """Have `x` become `target` in the next message: solve for its sources, and have their owners change them.

    Waits for the owners' answers (the paper's `force_value`, section IV-A, acknowledged). If several nodes own
    sources of `x`, all of them change or none: each is asked first whether it would take its part, and where one
    refuses or dies nevertheless, the others are taken back.

    Args:
        x: a tracked scalar, or a message or sequence holding tracked leaves.
        target: plain, of the same shape and unit.
        source: change this Source alone; by default the first in order of appearance that can.
        timeout: how long to wait for the owners' answers, in seconds; taking back may take a second more.
        request_id: what groups several calls, those of one drag for instance: they are one change in the owners'
            histories, and taken back as one. By default each call is a request of its own.
        sources: change no other than these, such as `[first, second]`.

    Returns:
        {Source: Change(old, new)}, with the values that the owners say they had and have now.

    Raises:
        NotTracked, NotInvertible: as in `solve`; nothing was requested.
        ChangeRejected: an owner refuses.
        SourceUnreachable: an owner does not answer within the timeout.
            In both exceptions, `changed` says what could not be taken back in other nodes; it is rarely anything.
        rospy.ROSException: `init_node` has not been called.
    """
    asker, deadline = started('force_value'), time.monotonic() + timeout
    wanted = solved(
        asker,
        values.sources(x),
        timeout / 2,
        lambda limits: values.solve(x, target, source, sources=sources, **limits),
    )
    return request_values(wanted, deadline - time.monotonic(), request_id, asker)


def solved(
    asker: Asker,
    sources: Sequence[values.Source],
    timeout: float,
    solve: Callable[[Dict[str, Any]], _Solved],
    thing: Sequence[Any] = (),
    shared: Sequence[Collection[values.Source]] = (),
) -> _Solved:
    """The result of solving within what the owners of sources allow; if that is impossible, with those that take effect
    at the next start only; at last with read-only ones.

    Args:
        timeout: how long to wait for what the owners say, in seconds.
        solve: called with the limits, as arguments of `values.solve`.
        thing, shared: as in `Directory.held`.

    Raises:
        values.NotInvertible: as in `solve`.
    """
    asker.directory.learn(values.sources(thing), timeout)
    limits, held = asker.directory.limits(sources, timeout), asker.directory.held(thing, shared)
    fixed = limits['read_only']
    try:
        return solve({**limits, 'read_only': [*fixed, *held]})
    except values.NotInvertible:
        if not fixed:
            raise
    refusing = [source for source in fixed if not asker.directory.at_next_start(source)]
    if refusing != fixed:
        with contextlib.suppress(values.NotInvertible):
            return solve({**limits, 'read_only': [*refusing, *held]})
    # Their owners refuse it and say why, for instance who has locked one; or one takes changes again.
    asker.directory.forget(refusing)
    return solve({**limits, 'read_only': held})


def _by_source(changes: Mapping[str, Iterable[msg.AppliedChange]]) -> Dict[values.Source, Change]:
    """{Source: Change} of {node: changes}; raises Refused if one is no JSON scalar."""
    return {
        values.Source(node, change.location_id): Change(from_json(change.old_value), from_json(change.new_value))
        for node, changed in changes.items()
        for change in changed
    }


def _what_was_done(
    asker: Asker,
    changed: Dict[values.Source, Change],
    taken_back: Dict[values.Source, Change],
    left: Dict[str, str],
) -> str:
    """The end of an error text: the changes that were taken back, and those that could not be."""
    if not taken_back and not left:
        return '; nothing has changed'
    parts = []
    if taken_back:
        parts.append('taken back: ' + ', '.join(map(asker.directory.name, taken_back)))
    for node, why in left.items():
        kept = [
            f'{asker.directory.name(source)} = {to_json(change.new)}'
            for source, change in changed.items()
            if source.node == node
        ]
        said = 'not taken back: ' + ', '.join(kept) if kept else f'not known: whether {node} has changed its part'
        parts.append(f'{said} ({why})')
    return '; ' + '; '.join(parts)


def reevaluate(x: Any, timeout: float = 1.0, asker: Any = None) -> Any:
    """`x` as it would be had its sources' current values been used (the paper's `reevaluate`, section IV-A).

    Args:
        x: a tracked scalar, or a message, list or dict holding tracked leaves; plain ones stay as they are.
        timeout: how long to wait for the owners' answers, in seconds.
        asker: who asks; by default this node.

    Returns:
        The same with new values and the same provenance; containers are copied.

    Raises:
        SourceUnreachable: an owner does not answer within the timeout, or does not know the source any more.
        rospy.ROSException: `init_node` has not been called.
    """
    asker = asker or started('reevaluate')
    by_node: Dict[str, List[values.Source]] = {}
    for source in values.sources(x):
        by_node.setdefault(source.node, []).append(source)
    requests = {
        node: srv.GetValuesRequest([source.location_id for source in wanted]) for node, wanted in by_node.items()
    }
    others = {node: request for node, request in requests.items() if node != asker.name}
    answers, silent = ask_all('get_values', srv.GetValues, others, timeout)
    if asker.name in requests:
        answers[asker.name] = asker.get_values(requests[asker.name])
    current: Dict[values.Source, Optional[Scalar]] = {}
    for node, answer in answers.items():
        if len(answer.values) != len(by_node[node]):
            silent[node] = f'it gives {len(answer.values)} values of {len(by_node[node])} locations'
        for source, text, reason in zip(by_node[node], answer.values, answer.reasons):
            try:
                current[source] = None if reason else from_json(text)
            except Refused as refused:
                reason = f'its answer cannot be read: {refused}'
            if reason:
                silent[node] = reason
    if silent:
        raise _unreachable(silent)
    return values.reapply(x, current)


def undo() -> Dict[values.Source, Change]:
    """Take the last change of this node's locations back.

    Returns:
        {Source: Change(old, new)}, empty if there was nothing to take back.

    Raises:
        ChangeRejected: the node takes no changes now, or a setter refuses the old value.
        rospy.ROSException: `init_node` has not been called.
    """
    owner = started('undo')
    answer = owner.change_sources(srv.ChangeSourcesRequest(undo=True, requester=owner.name))
    if answer.state != APPLIED and answer.reasons != [NOTHING_TO_UNDO]:
        raise ChangeRejected(answer.reasons[0], {})
    return _by_source({owner.name: answer.changes})


class Undone(NamedTuple):
    """The result of taking a request back: what has changed in each node, and the reasons if not all of it was
    taken back; then nothing has changed, except what could not be restored."""

    changes: Dict[str, List[msg.AppliedChange]]
    reasons: Dict[str, str]


def undo_request(request_id: str, nodes: Iterable[str], requester: str, timeout: float) -> Undone:
    """Take back what a request has changed, in all nodes that have a part in it or, if one does not, in none.

    Args:
        request_id: as in their histories.
        nodes: their full names.
        requester: who asks.
        timeout: for all together, in seconds.

    Returns:
        The changes taken back, and the reasons of nodes that took part and now refuse or do not answer.
    """
    parts = dict.fromkeys(nodes, Part())
    outcome = commit(Requester('', Directory()), parts, requester, request_id, time.monotonic() + timeout)
    reasons = {node: '; '.join(filter(None, said)) for node, said in outcome.reasons.items()}
    reasons.update(outcome.silent)
    for node, why in outcome.left.items():
        reasons.setdefault(node, f'it has changed, and could not be restored: {why}')
    return Undone(outcome.changes, reasons)


def raised_after(request_id: str, nodes: Iterable[str], timeout: float) -> Tuple[Dict[str, str], Dict[str, str]]:
    """Ask nodes what became of a request that has changed them; waits for a round of the main program, and for the
    callbacks that are called often.

    Args:
        request_id: that of the request.
        nodes: their full names.
        timeout: for their answers once the wait is over, in seconds.

    Returns:
        ({node: the exception with which it has taken the change back}, {node: why it does not answer}).
    """
    question = srv.ChangeSourcesRequest(request_id=request_id, phase=ASK)
    answers, silent = ask_all('change_sources', srv.ChangeSources, dict.fromkeys(nodes, question), AWAITED + timeout)
    raised = {node: '; '.join(answer.reasons) for node, answer in answers.items() if answer.state == ABORTED}
    return raised, silent


def outdated_after(request_id: str, nodes: Iterable[str], timeout: float) -> str:
    """Say what in the memory of nodes that a request has changed still holds results of the former values; '' if
    nothing does, or if a node does not answer in time. To be asked after `raised_after`, which waits for a round.

    Args:
        request_id, nodes, timeout: as of `raised_after`.
    """
    question = srv.ChangeSourcesRequest(request_id=request_id, phase=OUTDATED)
    answers, _ = ask_all('change_sources', srv.ChangeSources, dict.fromkeys(nodes, question), timeout)
    told = []
    for node, answer in sorted(answers.items()):
        if answer.outdated:
            holds = 'hold' if answer.outdated[1:] else 'holds'
            names = f'{" and ".join(answer.outdated)} of {node}'
            told.append(f'{names} still {holds} what was made of the former value, until the node makes it again')
    return '; '.join(told)


def _refusal(reasons: Dict[values.Source, str]) -> str:
    said = dict.fromkeys(f'{rejected.node}: {reason}' for rejected, reason in reasons.items())
    return 'the change is refused: ' + '; '.join(said)


def _cannot_reach(silent: Dict[str, str]) -> str:
    return '; '.join(f'cannot reach {node}: {why}' for node, why in silent.items())


def _unreachable(silent: Dict[str, str]) -> SourceUnreachable:
    return SourceUnreachable(_cannot_reach(silent), silent)
