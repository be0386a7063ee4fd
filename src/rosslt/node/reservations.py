"""Changes that other nodes make together with this one: kept ready until the requester says what becomes of them.

A change of several nodes is made in two steps. Each node says whether it would take its part, and reserves the
locations (`<node>/rosslt/reserve_changes`); then the requester has all of them apply it, or take it back
(`<node>/rosslt/decide_changes`). A reservation ends by itself. Where the requester is not heard of again, the node asks
the others: if one of them has applied its part, this one does as well.
"""

import contextlib
import math
import threading
import time
from collections import OrderedDict
from typing import Any, Callable, ContextManager, Dict, Iterable, Iterator, List, Optional, Protocol, Sequence, Tuple

import rosgraph
import rospy

from rosslt import msg, srv
from rosslt.node.history import NOTHING_TO_UNDO, History, Request, applied_change
from rosslt.node.json_scalars import Refused, from_json
from rosslt.node.locations import Location
from rosslt.node.service_calls import ask_all

#: States of a change that was reserved, as DecideChanges says them.
RESERVED, APPLIED, REFUSED, TAKEN_BACK, ENDED = 'reserved', 'applied', 'refused', 'taken back', 'ended'

#: What a requester decides.
APPLY, TAKE_BACK, ASK = 'apply', 'take back', ''

#: How long a requester may take to have changes taken back after its time is over, in seconds.
TAKE_BACK_TIMEOUT = 1.0

#: After a reservation's time, the node waits so long before it asks the others, in seconds: a requester that is still
#: there has decided by then.
GRACE = TAKE_BACK_TIMEOUT + 0.5

#: How long the others may take to say what they have done, in seconds.
ASK_TIMEOUT = 1.0

#: The longest reservation, in seconds, and how many nodes may take part in one.
LONGEST, MOST_NODES = 5.0, 100

#: How long another change waits for a location that is reserved, in seconds.
PATIENCE = 0.5

#: How many changes are remembered after their end, so that a late word about one of them is recognized.
REMEMBERED = 1000

#: A location, its value before and after.
Change = Tuple[Location, Any, Any]


#: The requests that are taken back, and what is to be changed: locations with their new values.
Planned = Tuple[List[Request], List[Tuple[Location, Any]]]


class Owner(Protocol):
    """What is used of this node as the owner of locations; `server.Owner` is it."""

    name: str
    history: History

    @property
    def lock(self) -> ContextManager[Any]: ...

    def known(self, location_id: int) -> Location: ...

    def changeable(self, location: Location, requester: str) -> Location: ...

    def to_undo(self, request_id: str, requester: str) -> Planned: ...

    def apply(
        self, wanted: Sequence[Tuple[Location, Any]], requester: str, request_id: str = '', record: bool = True
    ) -> Tuple[List[str], List[Change]]: ...

    def follow(self, changed: Iterable[Location]) -> int: ...

    def wait_for_parameters(self, written: int) -> None: ...


class _Holder:
    """Whoever changes locations right now.

    Attributes:
        requester: who asked for it.
        together: the rest of the sentence, `, together with /arm`.
    """

    together = ''

    def __init__(self, requester: str) -> None:
        self.requester = requester


class _Reserved(_Holder):
    """A change that was asked for, and what has become of it."""

    def __init__(self, request: srv.ReserveChangesRequest, lease: float) -> None:
        super().__init__(request.requester)
        self.deciding = threading.Lock()  # held while it is applied or taken back
        self.transaction_id: str = request.transaction_id
        self.request_id: str = request.request_id
        self.nodes: List[str] = list(request.nodes)
        self.end = time.monotonic() + lease
        self.state = RESERVED
        self.reason = ''
        self.wanted: List[Tuple[Location, Any]] = []
        self.undoes: List[Request] = []
        self.is_undo = not request.location_ids
        self.changes: List[Change] = []
        self.made: Optional[Request] = None  # in the history, once it is applied
        self.turns: Dict[Location, int] = {}
        self.together = f', together with {" and ".join(self.nodes) or "others"}'


class Reservations:
    """The changes that are reserved in this node, and those that were.

    Args:
        owner: this node as the owner of locations.
    """

    def __init__(self, owner: Owner) -> None:
        self._owner = owner
        self._by_id: OrderedDict[str, _Reserved] = OrderedDict()
        self._holders: Dict[Location, _Holder] = {}
        self._free = threading.Condition(owner.lock)  # type: ignore[arg-type]
        self._is_watched = False

    def serve(self) -> None:
        """Offer the services."""
        rospy.Service('~rosslt/reserve_changes', srv.ReserveChanges, self.reserve_changes)
        rospy.Service('~rosslt/decide_changes', srv.DecideChanges, self.decide_changes)

    def wait_for(self, locations: Iterable[Location], timeout: float = PATIENCE) -> bool:
        """Wait until locations are free; the lock is held, and given up while this waits.

        Returns:
            Whether it had to wait: meanwhile, others may have changed, locked or removed them.

        Raises:
            Refused: they are still reserved after `timeout` seconds.
        """
        wanted, holder, has_waited = list(locations), None, False
        end = time.monotonic() + timeout
        while True:
            for location in wanted:
                holder = self._holders.get(location)
                if holder is not None:
                    break
            else:
                return has_waited
            has_waited = True
            if not self._free.wait(max(0.0, end - time.monotonic())) and time.monotonic() >= end:
                raise Refused(
                    f'{location.name} is just being changed by {holder.requester or "somebody"}{holder.together}: '
                    'try again'
                )

    @contextlib.contextmanager
    def hold(self, locations: Iterable[Location], requester: str) -> Iterator[None]:
        """Have others wait for locations that are being changed; the lock is held."""
        held = dict.fromkeys([one for one in locations if one not in self._holders], _Holder(requester))
        self._holders.update(held)
        try:
            yield
        finally:
            for location in held:
                del self._holders[location]
            self._free.notify_all()

    def once_free(self, plan: Callable[[], Planned]) -> Planned:
        """What `plan` finds to change, once none of it is reserved. The lock is held, and given up while this waits:
        then it is planned anew, as others may have changed, locked or removed something.

        Raises:
            Refused: of `plan`, or a location stays reserved.
        """
        planned = plan()
        end = time.monotonic() + PATIENCE
        while self.wait_for([location for location, _ in planned[1]], end - time.monotonic()):
            planned = plan()
        return planned

    def reserve_changes(self, request: srv.ReserveChangesRequest) -> srv.ReserveChangesResponse:
        """Keep changes ready, all or none; serves `~rosslt/reserve_changes`."""
        _check(request)
        reserved = _Reserved(request, min(request.lease, LONGEST))
        with self._owner.lock:
            if request.transaction_id in self._by_id:
                raise rospy.ServiceException(f'{request.transaction_id} was reserved or decided before')
            reasons = self._plan_once_free(reserved, request)
            if any(reasons):
                return srv.ReserveChangesResponse(False, reasons)
            self._by_id[reserved.transaction_id] = reserved
            self._holders.update((location, reserved) for location, _ in reserved.wanted)
            self._forget_oldest()
            self._watch()
        return srv.ReserveChangesResponse(True, reasons)

    def decide_changes(self, request: srv.DecideChangesRequest) -> srv.DecideChangesResponse:
        """Apply changes that were reserved, or take them back; serves `~rosslt/decide_changes`."""
        if request.decision not in (APPLY, TAKE_BACK, ASK):
            raise rospy.ServiceException(f'{request.decision!r} is no decision: apply, take back or nothing')
        reserved = self._by_id.get(request.transaction_id)
        if reserved is None:
            return srv.DecideChangesResponse('', 'this node does not know the change: it was restarted since', [])
        with reserved.deciding, self._owner.lock:
            if reserved.state == APPLIED and reserved.made is not None and reserved.made.undone:
                reserved.state = TAKEN_BACK  # the others, which ask what to do, must not follow
            reason, changes = '', reserved.changes
            if request.decision == APPLY:
                if reserved.state == RESERVED and time.monotonic() > reserved.end:
                    reason = 'the time for it was over'
                elif reserved.state == RESERVED:
                    self._apply(reserved)
                changes = reserved.changes
            elif request.decision == TAKE_BACK:
                reason, changes = self._take_back(reserved)
            written = self._owner.follow([location for location, _ in reserved.wanted])
            answer = srv.DecideChangesResponse(
                reserved.state, reason or reserved.reason, _messages(changes, reserved.requester)
            )
        if request.decision != ASK:
            self._owner.wait_for_parameters(written)
        return answer

    def _plan_once_free(self, reserved: _Reserved, request: srv.ReserveChangesRequest) -> List[str]:
        """Find out what to change, and wait until none of it is reserved; returns the reasons against it."""
        while True:
            reasons = self._plan_undo(reserved) if reserved.is_undo else self._plan(reserved, request)
            if any(reasons):
                return reasons
            try:
                if not self.wait_for([location for location, _ in reserved.wanted], reserved.end - time.monotonic()):
                    return reasons
            except Refused as refused:
                return [str(refused)]

    def _plan(self, reserved: _Reserved, request: srv.ReserveChangesRequest) -> List[str]:
        """Check what is wanted; returns the reasons against it, one a location."""
        reasons = []
        reserved.wanted = []
        for location_id, text in zip(request.location_ids, request.values):
            try:
                location = self._owner.changeable(self._owner.known(location_id), reserved.requester)
                reserved.wanted.append((location, location.checked(from_json(text))))
                reasons.append('')
            except Refused as refused:
                reasons.append(str(refused))
        return reasons

    def _plan_undo(self, reserved: _Reserved) -> List[str]:
        """Find out what takes the request back; returns the reason against it."""
        try:
            reserved.undoes, reserved.wanted = self._owner.to_undo(reserved.request_id, reserved.requester)
        except Refused as refused:
            return [str(refused)]
        return [] if reserved.wanted else [NOTHING_TO_UNDO]

    def _apply(self, reserved: _Reserved) -> None:
        for location, _ in reserved.wanted:
            try:
                is_there = self._owner.known(location.id) is location
            except Refused:
                is_there = False
            if not is_there:
                self._end(reserved, REFUSED)
                reserved.reason = f'{location.name} is there no more'
                return
        reasons, changes = self._owner.apply(
            reserved.wanted, reserved.requester, reserved.request_id, record=not reserved.is_undo
        )
        if any(reasons):
            self._end(reserved, REFUSED)
            reserved.reason = '; '.join(filter(None, reasons))
            return
        reserved.changes = changes
        if not reserved.is_undo:
            reserved.made = self._owner.history.latest(reserved.request_id)
        reserved.turns = {location: location.turn for location, _, _ in changes}
        for request in reserved.undoes:
            request.undone = True
        self._end(reserved, APPLIED)

    def _take_back(self, reserved: _Reserved) -> Tuple[str, List[Change]]:
        """Returns (why it cannot be taken back or '', what has the former value again)."""
        if reserved.state == RESERVED:
            self._end(reserved, ENDED)
        if reserved.state != APPLIED:
            return '', []
        for location, turn in reserved.turns.items():
            if location.turn != turn:
                return f'{location.name} has been changed since', []
        reasons, changes = self._owner.apply(
            [(location, old) for location, old, _ in reversed(reserved.changes)], reserved.requester, record=False
        )
        if any(reasons):
            return '; '.join(filter(None, reasons)), []
        reserved.state = TAKEN_BACK
        if reserved.is_undo:
            for request in reserved.undoes:
                request.undone = False
        else:
            self._owner.history.withdraw(reserved.request_id, {location: new for location, _, new in changes})
        return '', changes

    def _end(self, reserved: _Reserved, state: str) -> None:
        reserved.state = state
        for location, _ in reserved.wanted:
            if self._holders.get(location) is reserved:
                del self._holders[location]
        self._free.notify_all()

    def _forget_oldest(self) -> None:
        while len(self._by_id) > REMEMBERED:
            oldest = next((one for one, it in self._by_id.items() if it.state != RESERVED), None)
            if oldest is None:
                return
            del self._by_id[oldest]

    def _watch(self) -> None:
        """See to it that reservations end whose requester is not heard of again."""
        if not self._is_watched:
            self._is_watched = True
            threading.Thread(target=self._work, name='rosslt reservations', daemon=True).start()
        self._free.notify_all()

    def _work(self) -> None:
        asked: Dict[str, None] = {}
        while not rospy.is_shutdown():
            with self._owner.lock:
                waiting = [one for one in self._by_id.values() if one.state == RESERVED]
                asked = {one.transaction_id: None for one in waiting if one.transaction_id in asked}
                overdue = [one for one in waiting if one.transaction_id not in asked]
                now = time.monotonic()
                first = min((one.end + GRACE for one in overdue), default=None)
                if first is None or first > now:
                    self._free.wait(None if first is None else first - now)
                    continue
                overdue = [one for one in overdue if one.end + GRACE <= now]
                asked.update((one.transaction_id, None) for one in overdue)
            for one in overdue:
                threading.Thread(target=self._settle, args=(one,), name='rosslt reservation', daemon=True).start()

    def _settle(self, reserved: _Reserved) -> None:
        """The requester has not come back: do what the other nodes have done."""
        others = [node for node in reserved.nodes if node != self._owner.name]
        question = srv.DecideChangesRequest(reserved.transaction_id, ASK)
        try:
            answers, _ = ask_all('decide_changes', srv.DecideChanges, dict.fromkeys(others, question), ASK_TIMEOUT)
        except rospy.ROSInterruptException:
            return
        appliers = sorted(node for node, answer in answers.items() if answer.state == APPLIED)
        with reserved.deciding, self._owner.lock:
            if reserved.state != RESERVED:
                return
            if appliers:
                self._apply(reserved)
                rospy.logwarn(
                    '%s was not heard of again: its change is applied here, as in %s%s',
                    reserved.requester,
                    ' and '.join(appliers),
                    reserved.reason and '; refused: ' + reserved.reason,
                )
                self._owner.follow([location for location, _ in reserved.wanted])
            else:
                self._end(reserved, ENDED)


def _check(request: srv.ReserveChangesRequest) -> None:
    """Raises rospy.ServiceException where a request makes no sense."""
    problem: Optional[str] = None
    if len(request.location_ids) != len(request.values):
        problem = f'{len(request.location_ids)} location ids with {len(request.values)} values'
    elif not request.transaction_id:
        problem = 'the transaction_id is empty'
    elif not request.location_ids and not request.request_id:
        problem = 'neither locations nor a request to take back'
    elif not (math.isfinite(request.lease) and request.lease > 0):
        problem = f'a lease of {request.lease} s'
    elif len(request.nodes) > MOST_NODES:
        problem = f'{len(request.nodes)} nodes; at most {MOST_NODES} may take part'
    else:
        for node in request.nodes:
            if not (node.startswith('/') and rosgraph.names.is_legal_name(node)):
                problem = f'{node!r} is no full name of a node'
    if problem is not None:
        raise rospy.ServiceException(problem)


def _messages(changes: Sequence[Change], requester: str) -> List[msg.AppliedChange]:
    return [applied_change(rospy.Time.now(), *change, requester) for change in changes]
