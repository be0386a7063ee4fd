"""Changes of this node's locations: applied at once, or its part in the two-phase commit of several nodes.

A node that takes part says whether it would apply its part, and reserves the locations (phase `prepare`); then the
requester has all nodes `commit` or `abort`. A prepared change ends by itself. If the requester is not heard of again,
the node asks the others: if one of them has applied its part, this one does as well; while one is applying it, this one
waits. `commit_coordinator` is the side of the requester.
"""

import contextlib
import functools
import math
import threading
import time
from collections import OrderedDict
from typing import Dict, Iterable, Iterator, List, Optional, Tuple

import rosgraph
import rospy

from rosslt import srv
from rosslt.messages import Scalar
from rosslt.node.callbacks import Callbacks
from rosslt.node.change.history import NOTHING_TO_UNDO, Request, applied_change
from rosslt.node.change.owner_interface import Owner
from rosslt.node.json_scalars import Refused, from_json
from rosslt.node.locations.location import Change, Location
from rosslt.node.service_calls import ask_all

#: States of a change, as ChangeSources says them.
APPLIED, REFUSED, PREPARED, ABORTED, UNKNOWN = 'applied', 'refused', 'prepared', 'aborted', ''
#: Setters are being called, to apply a part or to take it back.
APPLYING = 'applying'

#: Phases of a change.
AT_ONCE, PREPARE, COMMIT, ABORT, ASK, OUTDATED = '', 'prepare', 'commit', 'abort', 'state', 'outdated'

#: The time that a requester has to abort changes after its own timeout, in seconds.
ABORT_TIMEOUT = 1.0

#: The wait between the end of a lease and the question to the other participants, in seconds: a requester that still
#: runs has decided by then.
GRACE = ABORT_TIMEOUT + 0.5

#: The time that other participants have to report their decisions, in seconds; and the wait before they are asked again
#: while one of them is applying its part.
ASK_TIMEOUT = 1.0

#: The longest lease, in seconds, and how many nodes may take part.
LONGEST, MOST_NODES = 5.0, 100

#: The maximal wait of another change for a reserved location, in seconds.
PATIENCE = 0.5

#: The number of ended transactions that are remembered, so that a late decision about one is recognized.
REMEMBERED = 1000


class _Transaction:
    """A change that was asked for, and its state."""

    def __init__(self, request: srv.ChangeSourcesRequest) -> None:
        self.id: str = request.transaction_id
        self.request_id: str = request.request_id
        self.requester: str = request.requester or _caller(request)
        self.nodes: List[str] = list(request.nodes)
        self.end = time.monotonic() + (min(request.lease, LONGEST) if request.phase == PREPARE else PATIENCE)
        self.asked = list(zip(request.location_ids, request.values))
        self.is_undo: bool = request.undo
        self.state = PREPARED
        self.reasons: List[str] = []
        self.wanted: List[Tuple[Location, Scalar]] = []
        self.undoes: List[Request] = []
        self.changes: List[Change] = []
        self.made: Optional[Request] = None  # in the history, once it is applied
        self.turns: Dict[Location, int] = {}

    def refuse(self, reason: str) -> None:
        """Refuse all of it for one reason."""
        self.state = REFUSED
        self.reasons = [reason] * max(1, len(self.asked))


class CommitParticipant:
    """Changes the locations of this node, and remembers the transactions that it takes part in.

    Args:
        owner: this node as the owner of locations.
        background: asks other nodes in a thread of its own.
    """

    def __init__(self, owner: Owner, background: Callbacks) -> None:
        self._owner, self._background = owner, background
        self._by_id: OrderedDict[str, _Transaction] = OrderedDict()
        self._holders: Dict[Location, str] = {}  # location -> who is changing it
        self._free = threading.Condition(owner.lock)  # type: ignore[arg-type]

    def wait_for(self, locations: Iterable[Location], timeout: float = PATIENCE) -> bool:
        """Wait until locations are free; the lock is held, and given up while this waits.

        Returns:
            Whether it had to wait: meanwhile, others may have changed, locked or removed them.

        Raises:
            Refused: they are still reserved after `timeout` seconds.
        """
        wanted, has_waited = list(locations), False
        end = time.monotonic() + timeout
        while True:
            location = next(filter(self._holders.__contains__, wanted), None)
            if location is None:
                return has_waited
            has_waited, holder = True, self._holders[location]
            if not self._free.wait(max(0.0, end - time.monotonic())) and time.monotonic() >= end:
                raise Refused(f'{location.name} is just being changed by {holder}: try again')

    @contextlib.contextmanager
    def hold(self, locations: Iterable[Location], requester: str) -> Iterator[None]:
        """Have others wait for locations that are being changed; the lock is held, and may be given up meanwhile."""
        held = dict.fromkeys([one for one in locations if one not in self._holders], requester or 'somebody')
        self._holders.update(held)
        try:
            yield
        finally:
            self._release(held)

    def change_sources(self, request: srv.ChangeSourcesRequest) -> srv.ChangeSourcesResponse:
        """Change locations, all or none, or do one phase of it; serves `~rosslt/change_sources`."""
        _check(request)
        if request.phase == ASK and not request.transaction_id:
            return self._owner.outcome_of(request.request_id)
        if request.phase == OUTDATED:
            return srv.ChangeSourcesResponse(outdated=self._owner.outdated_by(request.request_id))
        with self._owner.lock:
            if request.phase in (AT_ONCE, PREPARE):
                change = self._prepared(request)
                if request.phase == AT_ONCE and change.state == PREPARED:
                    self._apply(change)
                reasons = change.reasons
            elif request.transaction_id in self._by_id:
                change = self._by_id[request.transaction_id]
                reasons = self._decided(change, request.phase)
            else:
                reason = 'this node does not know the change: it was restarted since'
                return srv.ChangeSourcesResponse(state=UNKNOWN, reasons=[reason])
            written = self._owner.follow([location for location, _ in change.wanted])
            changes = [applied_change(rospy.Time.now(), *one, change.requester) for one in change.changes]
        if request.phase in (AT_ONCE, COMMIT, ABORT):
            self._owner.wait_for_parameters(written)
        return srv.ChangeSourcesResponse(state=change.state, reasons=reasons, changes=changes)

    def _prepared(self, request: srv.ChangeSourcesRequest) -> _Transaction:
        """The transaction of a request: prepared, or refused."""
        change = _Transaction(request)
        if request.phase == PREPARE and change.id in self._by_id:
            raise rospy.ServiceException(f'{change.id} was prepared or decided before')
        try:
            self._plan(change)
            # others may have changed, locked or removed something meanwhile
            while change.state == PREPARED and self.wait_for(
                [location for location, _ in change.wanted], change.end - time.monotonic()
            ):
                self._plan(change)
        except Refused as refused:
            change.refuse(str(refused))
        if request.phase == PREPARE and change.state == PREPARED:
            self._by_id[change.id] = change
            together = f'{change.requester or "somebody"}, together with {" and ".join(change.nodes) or "others"}'
            self._holders.update((location, together) for location, _ in change.wanted)
            while len(self._by_id) > REMEMBERED:
                self._by_id.popitem(last=False)
            # its requester may not be heard of again
            settle = functools.partial(self._settle, change)
            self._background.call_soon(settle, change.end + GRACE - time.monotonic())
        return change

    def _plan(self, change: _Transaction) -> None:
        """Find out which locations get which values.

        Raises:
            Refused: the request cannot be taken back.
        """
        if change.is_undo:
            change.undoes, change.wanted = self._owner.to_undo(change.request_id, change.requester)
            # this node takes back by itself what makes it raise
            if not change.wanted and not self._owner.history.is_taken_back(change.request_id):
                raise Refused(NOTHING_TO_UNDO)
            return
        change.wanted, change.reasons = [], []
        for location_id, text in change.asked:
            try:
                location = self._owner.changeable(self._owner.known(location_id), change.requester)
                change.wanted.append((location, location.checked(from_json(text))))
                change.reasons.append('')
            except Refused as refused:
                change.reasons.append(str(refused))
        if any(change.reasons):
            change.state = REFUSED

    def _apply(self, change: _Transaction) -> None:
        """Put a prepared change in force."""
        change.state = APPLYING
        try:
            for location, _ in change.wanted:
                if self._owner.known(location.id) is not location:
                    raise Refused(f'{location.name} was replaced meanwhile; list the locations and try again')
            self._owner.check_goes_on(change.requester)
            change.reasons, change.changes = self._owner.apply(
                change.wanted, change.requester, change.request_id, record=not change.is_undo
            )
            if change.is_undo and any(change.reasons):
                raise Refused('; '.join(filter(None, change.reasons)))
        except Refused as refused:
            change.refuse(str(refused))
        else:
            change.state = REFUSED if any(change.reasons) else APPLIED
        finally:
            self._end(change)
        if change.state == APPLIED:
            if not change.is_undo:
                change.made = self._owner.history.latest(change.request_id)
            change.turns = {location: location.turn for location, _, _ in change.changes}
            for request in change.undoes:
                request.undone = True

    def _decided(self, change: _Transaction, phase: str) -> List[str]:
        """Commit or abort a prepared change; returns the reasons if this node could not do as decided."""
        if phase != ASK:
            self._free.wait_for(lambda: change.state != APPLYING)
        if change.state == APPLIED and change.made is not None and change.made.undone:
            change.state = ABORTED  # the others, which ask what to do, must not follow
        if phase == COMMIT and change.state == PREPARED:
            if time.monotonic() > change.end:
                return ['the time for it was over'] * max(1, len(change.asked))
            self._apply(change)
        elif phase == ABORT:
            if change.state == PREPARED:
                self._abort(change)
            elif change.state == APPLIED:
                return self._take_back(change)
        return change.reasons

    def _take_back(self, change: _Transaction) -> List[str]:
        """Give locations the values again that they had before; returns the reason against it."""
        try:
            self.wait_for(change.turns)
        except Refused as refused:
            return [str(refused)]
        for location, turn in change.turns.items():
            if location.turn != turn:
                return [f'{location.name} has been changed since']
        change.state = APPLYING
        try:
            reasons, changes = self._owner.apply(
                [(location, old) for location, old, _ in reversed(change.changes)], change.requester, record=False
            )
        finally:
            change.state = APPLIED
            self._free.notify_all()
        if any(reasons):
            return list(filter(None, reasons))
        change.state, change.changes = ABORTED, changes
        if change.is_undo:
            for request in change.undoes:
                request.undone = False
        else:
            self._owner.history.withdraw(change.request_id, {location: new for location, _, new in changes})
        return []

    def _abort(self, change: _Transaction) -> None:
        change.state = ABORTED
        self._end(change)

    def _end(self, change: _Transaction) -> None:
        if change.id:
            self._release(location for location, _ in change.wanted)

    def _release(self, locations: Iterable[Location]) -> None:
        for location in locations:
            self._holders.pop(location, None)
        self._free.notify_all()

    def _settle(self, change: _Transaction) -> None:
        """Do what the other nodes have done: the requester has not come back."""
        if change.state != PREPARED:
            return
        others = [node for node in change.nodes if node != self._owner.name]
        question = srv.ChangeSourcesRequest(transaction_id=change.id, phase=ASK)
        try:
            answers, _ = ask_all('change_sources', srv.ChangeSources, dict.fromkeys(others, question), ASK_TIMEOUT)
        except rospy.ROSInterruptException:
            return
        if any(answer.state == APPLYING for answer in answers.values()):
            self._background.call_soon(functools.partial(self._settle, change), ASK_TIMEOUT)
            return
        appliers = sorted(node for node, answer in answers.items() if answer.state == APPLIED)
        with self._owner.lock:
            if change.state != PREPARED:
                return
            if not appliers:
                self._abort(change)
                return
            self._apply(change)
            refused = '; '.join(filter(None, change.reasons))
            rospy.logwarn(
                '%s was not heard of again: its change is applied here, as in %s%s',
                change.requester,
                ' and '.join(appliers),
                refused and '; refused: ' + refused,
            )
            self._owner.follow([location for location, _ in change.wanted])


def _caller(request: srv.ChangeSourcesRequest) -> str:
    """The node that a request came from; '' if this process has made it."""
    return (getattr(request, '_connection_header', None) or {}).get('callerid', '')


def _check(request: srv.ChangeSourcesRequest) -> None:
    """Raises rospy.ServiceException if a request makes no sense."""
    problem: Optional[str] = None
    if request.phase not in (AT_ONCE, PREPARE, COMMIT, ABORT, ASK, OUTDATED):
        problem = f'{request.phase!r} is not a phase: prepare, commit, abort, state, outdated or nothing'
    elif len(request.location_ids) != len(request.values):
        problem = f'{len(request.location_ids)} location ids with {len(request.values)} values'
    elif len(set(request.location_ids)) < len(request.location_ids):
        problem = 'one location is given several values: give each location once'
    elif request.phase in (AT_ONCE, PREPARE) and request.undo == bool(request.location_ids):
        problem = 'both locations and undo' if request.undo else 'no location to change'
    elif request.phase == PREPARE:
        problem = _problem_of_prepare(request)
    if problem is not None:
        raise rospy.ServiceException(problem)


def _problem_of_prepare(request: srv.ChangeSourcesRequest) -> Optional[str]:
    if not request.transaction_id:
        return 'the transaction_id is empty'
    if request.undo and not request.request_id:
        return 'no request to take back'
    if not (math.isfinite(request.lease) and request.lease > 0):
        return f'a lease of {request.lease} s'
    if len(request.nodes) > MOST_NODES:
        return f'{len(request.nodes)} nodes; at most {MOST_NODES} may take part'
    for node in request.nodes:
        if not (node.startswith('/') and rosgraph.names.is_legal_name(node)):
            return f'{node!r} is not the full name of a node'
    return None
