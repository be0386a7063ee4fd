"""Two-phase commit: changes of several nodes, all of them or none.

All nodes are asked to prepare their part, one after the other in the order of their names, so that two requesters never
wait for each other; then all commit it. If one does not, the others abort, and take back what they have committed. A
single node changes at once. `commit_participant` is the side of the nodes.
"""

import time
import uuid
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence

import rospy

from rosslt import msg, srv
from rosslt.node.change.commit_participant import ABORT, ABORT_TIMEOUT, ABORTED, APPLIED, COMMIT, PREPARE, PREPARED
from rosslt.node.service_calls import ask_all


class Part(NamedTuple):
    """The part of one node: locations that get values, JSON scalars; none if a request is to be taken back."""

    location_ids: Sequence[int] = ()
    values: Sequence[str] = ()


class Committed(NamedTuple):
    """The result of a change of several nodes; all dicts have the names of nodes as keys.

    Attributes:
        changes: the changes in force: all, or, after a failure, those that could not be taken back.
        reasons: why a node refuses, one for each of its locations, '' if it does not.
        silent: why a node does not answer.
        taken_back: the changes that were applied and undone again.
        left: why what a node has changed could not be taken back; of a silent node, that it is not known.
    """

    changes: Dict[str, List[msg.AppliedChange]]
    reasons: Dict[str, List[str]]
    silent: Dict[str, str]
    taken_back: Dict[str, List[msg.AppliedChange]]
    left: Dict[str, str]

    @property
    def is_done(self) -> bool:
        """True if all nodes have done their part."""
        return not self.reasons and not self.silent


def commit(own: object, parts: Mapping[str, Part], requester: str, request_id: str, deadline: float) -> Committed:
    """Have nodes do their parts, all or none.

    Args:
        own: this node, which has a name and is asked without the network if it takes part.
        parts: {node: what it has to do}.
        requester: who asks.
        request_id: that of the request in the nodes' histories; the one to take back if parts are empty.
        deadline: on the monotonic clock; taking back may take ABORT_TIMEOUT longer.

    Raises:
        rospy.ROSInterruptException: this node is being shut down.
    """
    return _Coordinator(own, parts, requester, request_id).run(deadline)


class _Coordinator:
    def __init__(self, own: Any, parts: Mapping[str, Part], requester: str, request_id: str) -> None:
        self._own = own
        self._parts = dict(sorted(parts.items()))
        self._requester = requester
        self._request_id = request_id
        self._id = uuid.uuid4().hex
        self._prepared: List[str] = []
        self._outcome = Committed({}, {}, {}, {}, {})

    def run(self, deadline: float) -> Committed:
        outcome = self._outcome
        if len(self._parts) < 2:
            for node in self._parts:
                self._take_changes(self._ask([node], '', deadline - time.monotonic()))
            return outcome
        try:
            for node in self._parts:
                answers = self._ask([node], PREPARE, deadline - time.monotonic())
                for answer in answers.values():
                    if answer.state == PREPARED:
                        self._prepared.append(node)
                    else:
                        outcome.reasons[node] = list(answer.reasons)
            if outcome.is_done:
                self._take_changes(self._ask(self._prepared, COMMIT, deadline - time.monotonic()))
        finally:
            # a requester that is interrupted takes back as well
            if not outcome.is_done or len(outcome.changes) < len(self._parts):
                self._abort()
        return outcome

    def _take_changes(self, answers: Dict[str, srv.ChangeSourcesResponse]) -> None:
        """Note what nodes have changed."""
        for node, answer in answers.items():
            if answer.state == APPLIED:
                self._outcome.changes[node] = list(answer.changes)
            elif answer.state:
                self._outcome.reasons[node] = list(answer.reasons)
            else:
                self._outcome.silent[node] = '; '.join(answer.reasons)

    def _abort(self) -> None:
        """Have every node that has prepared or committed its part undo it."""
        outcome = self._outcome
        were_silent = set(outcome.silent)
        answers = self._ask(self._prepared, ABORT, ABORT_TIMEOUT, outcome.left)
        for node in outcome.left.keys() - outcome.changes.keys() - were_silent:
            del outcome.left[node]  # it was not asked to commit: nothing has changed, and it aborts by itself
        for node, answer in answers.items():
            if answer.state == ABORTED:
                outcome.changes.pop(node, None)
                if answer.changes:
                    outcome.taken_back[node] = list(answer.changes)
            elif answer.state == APPLIED:
                outcome.changes[node] = list(answer.changes)
                outcome.left[node] = '; '.join(filter(None, answer.reasons))
            elif not answer.state:
                outcome.left[node] = 'it was restarted meanwhile, and may have been changed before'

    def _ask(self, nodes: Sequence[str], phase: str, timeout: float, silent: Any = None) -> Dict[str, Any]:
        """The answers of nodes to a phase; why there is none is noted in `silent`, by default that of the outcome."""
        silent = self._outcome.silent if silent is None else silent
        requests = {
            node: srv.ChangeSourcesRequest(
                undo=not self._parts[node].location_ids,
                request_id=self._request_id,
                requester=self._requester,
                location_ids=list(self._parts[node].location_ids),
                values=list(self._parts[node].values),
                phase=phase,
                transaction_id=self._id if phase else '',
                nodes=list(self._parts) if phase == PREPARE else [],
                lease=max(timeout, 0.001) if phase == PREPARE else 0.0,
            )
            for node in nodes
        }
        others = {node: request for node, request in requests.items() if node != self._own.name}
        answers, unheard = ask_all('change_sources', srv.ChangeSources, others, timeout)
        silent.update(unheard)
        if self._own.name in requests:
            try:
                answers[self._own.name] = self._own.change_sources(requests[self._own.name])
            except rospy.ServiceException as error:
                silent[self._own.name] = str(error)
        return answers
