"""Changing several nodes as one: all of them or none.

All are asked to reserve their part, one after the other in the order of their names, so that two requesters never wait
for each other; then all apply it. Where one does not, the others take it back. `reservations` is the other side.
"""

import time
import uuid
from typing import Any, Dict, List, Mapping, NamedTuple, Protocol, Sequence

import rosgraph
import rospy

from rosslt import msg, srv
from rosslt.node.reservations import APPLIED, APPLY, TAKE_BACK, TAKE_BACK_TIMEOUT, TAKEN_BACK
from rosslt.node.service_calls import ask_all


class Part(NamedTuple):
    """What one node has to do: give locations values, JSON scalars; nothing where a request is to be taken back."""

    location_ids: Sequence[int] = ()
    values: Sequence[str] = ()


class Own(Protocol):
    """This node, which asks itself without the network."""

    @property
    def name(self) -> str: ...


class Outcome(NamedTuple):
    """What has become of a change of several nodes; all dicts have the names of nodes as keys.

    Attributes:
        changes: what is changed now: everything, or, after a failure, what could not be taken back.
        reasons: why a node refuses, one for each of its locations, '' where it does not.
        silent: why a node does not answer.
        taken_back: what was changed, and has the former value again.
        left: why what a node has changed could not be taken back; of a silent node, that it is not known.
    """

    changes: Dict[str, List[msg.AppliedChange]]
    reasons: Dict[str, List[str]]
    silent: Dict[str, str]
    taken_back: Dict[str, List[msg.AppliedChange]]
    left: Dict[str, str]

    @property
    def is_done(self) -> bool:
        """Whether all nodes have done their part."""
        return not self.reasons and not self.silent


def change_together(own: Own, parts: Mapping[str, Part], requester: str, request_id: str, deadline: float) -> Outcome:
    """Have several nodes do their parts, all or none.

    Args:
        own: this node, asked at once where it takes part.
        parts: {node: what it has to do}.
        requester: who asks.
        request_id: that of the request in the nodes' histories; the one to take back where parts are empty.
        deadline: on the monotonic clock; taking back may take TAKE_BACK_TIMEOUT longer.

    Returns:
        What was done, and what could not be.

    Raises:
        rospy.ROSInterruptException: this node is being shut down.
    """
    return _Transaction(own, parts, requester, request_id).run(deadline)


class _Transaction:
    def __init__(self, own: Own, parts: Mapping[str, Part], requester: str, request_id: str) -> None:
        self._own = own
        self._parts = dict(sorted(parts.items()))
        self._requester = requester
        self._request_id = request_id
        self._id = uuid.uuid4().hex
        self._reserved: List[str] = []
        self._older: List[str] = []  # nodes of an earlier version, which cannot reserve
        self._outcome = Outcome({}, {}, {}, {}, {})

    def run(self, deadline: float) -> Outcome:
        outcome = self._outcome
        try:
            for node, part in self._parts.items():
                self._reserve(node, part, deadline)
            if outcome.is_done:
                for node in self._older:
                    if outcome.is_done:
                        self._change_older(node, deadline)
            if outcome.is_done:
                self._decide(deadline)
        finally:
            # a requester that is interrupted takes back as well
            if not outcome.is_done or len(outcome.changes) < len(self._parts):
                self._take_back()
        return outcome

    def _reserve(self, node: str, part: Part, deadline: float) -> None:
        left = deadline - time.monotonic()
        request = srv.ReserveChangesRequest(
            self._id,
            self._request_id,
            self._requester,
            list(self._parts),
            max(left, 0.001),
            list(part.location_ids),
            list(part.values),
        )
        answers, silent = self._ask('reserve_changes', srv.ReserveChanges, {node: request}, left)
        for answer in answers.values():
            if answer.reserved:
                self._reserved.append(node)
            else:
                self._outcome.reasons[node] = list(answer.reasons)
        if any('unavailable' in why for why in silent.values()) and _is_older(node):
            self._older.append(node)
        else:
            self._outcome.silent.update(silent)

    def _decide(self, deadline: float) -> None:
        """Have all apply what they have reserved."""
        request = srv.DecideChangesRequest(self._id, APPLY)
        answers, silent = self._ask(
            'decide_changes',
            srv.DecideChanges,
            dict.fromkeys(self._reserved, request),
            deadline - time.monotonic(),
        )
        self._outcome.silent.update(silent)
        for node, answer in answers.items():
            if answer.state == APPLIED:
                self._outcome.changes[node] = list(answer.changes)
            elif answer.state:
                self._outcome.reasons[node] = [answer.reason]
            else:
                self._outcome.silent[node] = answer.reason

    def _take_back(self) -> None:
        """Have everybody be as before who has reserved or applied a part."""
        outcome = self._outcome
        request = srv.DecideChangesRequest(self._id, TAKE_BACK)
        answers, silent = self._ask(
            'decide_changes', srv.DecideChanges, dict.fromkeys(self._reserved, request), TAKE_BACK_TIMEOUT
        )
        for node, answer in answers.items():
            if answer.state == TAKEN_BACK:
                outcome.taken_back[node] = list(answer.changes)
                outcome.changes.pop(node, None)
            elif answer.state == APPLIED:
                outcome.changes[node] = list(answer.changes) or outcome.changes.get(node, [])
                outcome.left[node] = answer.reason
            elif not answer.state:
                outcome.left[node] = 'it was restarted meanwhile, and may have been changed before'
        for node, why in silent.items():
            # one that has not been asked to apply its part has not changed, and forgets it
            if node in outcome.changes or node in outcome.silent:
                outcome.left[node] = why
        for node in self._older:
            if node in outcome.changes:
                self._restore_older(node)

    def _change_older(self, node: str, deadline: float) -> None:
        part, outcome = self._parts[node], self._outcome
        left = deadline - time.monotonic()
        if not part.location_ids:
            undo = srv.UndoRequestRequest(self._request_id, self._requester)
            answers, silent = self._ask('undo_request', srv.UndoRequest, {node: undo}, left)
            for answer in answers.values():
                if answer.success:
                    outcome.changes[node] = list(answer.changes)
                else:
                    outcome.reasons[node] = [answer.message]
        else:
            request = srv.RequestChangesRequest(
                self._request_id, self._requester, list(part.location_ids), list(part.values)
            )
            answers, silent = self._ask('request_changes', srv.RequestChanges, {node: request}, left)
            for answer in answers.values():
                if answer.applied:
                    outcome.changes[node] = [
                        msg.AppliedChange(
                            location_id=one, old_value=old, new_value=new, requester=self._requester, name=str(one)
                        )
                        for one, old, new in zip(part.location_ids, answer.old_values, answer.new_values)
                    ]
                else:
                    outcome.reasons[node] = list(answer.reasons)
        outcome.silent.update(silent)

    def _restore_older(self, node: str) -> None:
        outcome = self._outcome
        changes = outcome.changes[node]
        request = srv.RequestChangesRequest(
            self._request_id,
            self._requester,
            [change.location_id for change in changes],
            [change.old_value for change in changes],
        )
        answers, silent = self._ask('request_changes', srv.RequestChanges, {node: request}, TAKE_BACK_TIMEOUT)
        outcome.left.update(silent)
        for answer in answers.values():
            if answer.applied:
                outcome.taken_back[node] = outcome.changes.pop(node)
            else:
                outcome.left[node] = '; '.join(filter(None, answer.reasons))

    def _ask(self, service: str, service_class: Any, requests: Dict[str, Any], timeout: float) -> Any:
        """As `ask_all`, but this node is asked at once."""
        others = {node: request for node, request in requests.items() if node != self._own.name}
        answers, silent = ask_all(service, service_class, others, timeout)
        if self._own.name in requests:
            try:
                answers[self._own.name] = getattr(self._own, service)(requests[self._own.name])
            except rospy.ServiceException as error:
                silent[self._own.name] = str(error)
        return answers, silent


def _is_older(node: str) -> bool:
    """Whether a node changes its locations and cannot reserve changes: it runs an earlier version."""
    master = rosgraph.Master(rospy.get_name())

    def offers(service: str) -> bool:
        try:
            return bool(master.lookupService(f'{node}/rosslt/{service}'))
        except (OSError, rosgraph.MasterException):
            return False

    return not offers('reserve_changes') and offers('request_changes')
