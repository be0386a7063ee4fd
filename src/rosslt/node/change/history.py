"""The history of this node: who changed what, when, and from what; and how it is taken back."""

import contextlib
import json
import threading
import time
import uuid
from collections import deque
from typing import Any, Deque, Dict, Iterator, List, Optional, Sequence, Tuple

import rospy

from rosslt import msg, values
from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.location import Change, HeldLocation, Location

#: The maximal number of remembered requests.
LENGTH = 1000

NOTHING_TO_UNDO = 'there is no change to take back'

#: Who asks for what the node reads in a file that was edited. It is on the record, and is taken back in the file.
EDITOR = 'editor'


def new_request_id() -> str:
    """An id for a request, which no other one in the ROS graph has. Later ones are greater, by the machine's clock: the
    time of ROS stands still in a simulation that is paused."""
    return f'{time.time_ns():016x}{uuid.uuid4().hex[16:]}'


class Request:
    """The changes of one request, made in one call or, as a drag does, in many.

    Attributes:
        id: the same in all nodes that it has changed.
        requester: who asked.
        stamp: when its last part was applied.
        at: the same, a time of `time.monotonic`.
        changes: {Location: (value before, value after)}.
        undone: True once it has been taken back.
        raised: the exception because of which this node takes it back, '' if it does not.
        asked_in: the thread in which somebody has asked what became of it, None if nobody has.
    """

    __slots__ = ('id', 'requester', 'stamp', 'at', 'changes', 'undone', 'raised', 'asked_in')

    def __init__(self, request_id: str, requester: str) -> None:
        self.id = request_id
        self.requester = requester
        self.stamp: Any = None
        self.at = 0.0
        self.changes: Dict[Location, Tuple[Scalar, Scalar]] = {}
        self.undone = False
        self.raised = ''
        self.asked_in: Optional[threading.Thread] = None

    def present(self) -> Dict[values.Source, Scalar]:
        """{source: its value now} of the locations that it has changed, without those that have none."""
        found = {}
        for location in list(self.changes):
            with contextlib.suppress(Refused):
                found[location.source] = location.value
        return found


class History:
    """The requests that have changed locations of this node, the oldest first.

    The last one is kept over a restart: a node may end in the middle of a drag, and what it comes back with can be
    taken back all the same.
    """

    def __init__(self) -> None:
        self._requests: Deque[Request] = deque(maxlen=LENGTH)
        self._earlier: Optional[Request] = None
        # Its changes in an earlier run whose locations were not looked up yet: {id: (name, value before, value after)}.
        self._unclaimed: Dict[int, Tuple[str, Scalar, Scalar]] = {}

    def begin(self, text: Any) -> None:
        """Begin with the last request of an earlier run, as `last` has written it, and without if none has."""
        try:
            request_id, requester, secs, nsecs, changes = json.loads(text)
            stamp = rospy.Time(secs, nsecs)
            unclaimed = {location_id: (name, old, new) for name, (location_id, old, new) in changes.items()}
        except (TypeError, ValueError, AttributeError, RecursionError):
            return
        self._earlier, self._unclaimed = Request(str(request_id), str(requester)), unclaimed
        self._earlier.stamp = stamp
        self._requests.appendleft(self._earlier)

    def claim(self, location: Location, value: Scalar) -> None:
        """Make the change that an earlier run made to a location undoable, if the location still has that value."""
        if self._earlier is None or location.id not in self._unclaimed:
            return
        _, old, new = self._unclaimed.pop(location.id)
        if not differing([(location, new, value)]):
            self._earlier.changes[location] = old, new

    def last(self) -> str:
        """The last request that has not been taken back, as a text for `begin`; '' if there is none."""
        request = next(self._to_take_back(), None)
        if request is None:
            return ''
        left = self._unclaimed if request is self._earlier else {}
        changes: Dict[str, Any] = {name: (location_id, old, new) for location_id, (name, old, new) in left.items()}
        for location, (old, new) in request.changes.items():
            if isinstance(location, HeldLocation):
                changes[location.name] = location.next_id, old, new
        return json.dumps([request.id, request.requester, request.stamp.secs, request.stamp.nsecs, changes])

    def record(self, request_id: str, requester: str, stamp: object, changes: Sequence[Change]) -> None:
        """Remember changes that have been applied.

        Args:
            request_id: that of the request before continues it; '' for one of its own.
            stamp: when they were applied.
            changes: (location, value before, value after).
        """
        for location, old, _ in changes:
            self.claim(location, old)
        last = self._requests[-1] if self._requests else None
        if last is None or last.undone or not request_id or last.id != request_id:
            last = Request(request_id or new_request_id(), requester)
            self._requests.append(last)
        last.stamp, last.at = stamp, time.monotonic()
        for location, old, new in changes:
            first, _ = last.changes.get(location, (old, None))
            last.changes[location] = first, new

    def since(self, start: float) -> List[Request]:
        """The requests that were applied since a time of `time.monotonic` and not taken back, from the latest one."""
        return [request for request in self._left() if request.at >= start]

    def in_force(self, but: Sequence[Request] = ()) -> Dict[Location, Tuple[Scalar, Scalar]]:
        """{Location: (value before, value after)} of the latest change of each that was not taken back, from the latest
        one; without those that have their first value again.

        Args:
            but: requests that do not count.
        """
        latest: Dict[Location, Tuple[Scalar, Scalar]] = {}
        first: Dict[Location, Scalar] = {}
        for request in self._left():
            for location, change in request.changes.items() if request not in but else ():
                latest.setdefault(location, change)
                first[location] = change[0]
        return {one: change for one, change in latest.items() if differing([(one, first[one], change[1])])}

    def is_taken_back(self, request_id: str) -> bool:
        """Return whether a request of that id has changed something, and all of it was taken back."""
        return bool(request_id) and {one.undone for one in self._requests if one.id == request_id} == {True}

    def last_part(self, request_id: str) -> Optional[Request]:
        """The latest part of a request, taken back or not; None if there is none."""
        return next((one for one in reversed(self._requests) if one.id == request_id), None)

    def latest(self, request_id: str) -> Optional[Request]:
        """The latest part of a request that has not been taken back; None if there is none."""
        return next((one for one in self._left() if one.id == request_id), None)

    def withdraw(self, request_id: str, values: Dict[Location, Scalar]) -> None:
        """Note that the last part of a request was taken back, because other nodes have not done theirs.

        Args:
            request_id: that of the request.
            values: {Location: the value that it has again}.
        """
        request = self.latest(request_id)
        if request is not None:
            for location, value in values.items():
                first, _ = request.changes.get(location, (value, value))
                request.changes[location] = first, value
            request.undone = all(old == new for old, new in request.changes.values())

    def to_undo(self, request_id: str, present: Dict[int, Location]) -> Tuple[List[Request], Dict[Location, Scalar]]:
        """Find what has to be done to take a request back.

        Args:
            request_id: '' for the last request that has not been taken back.
            present: the existing locations, by id; changes of other locations cannot be taken back.

        Returns:
            (the requests, {Location: value that it gets again}); both empty if there is nothing to take back.

        Raises:
            Refused: another request has changed one of the locations since.
        """
        if not request_id:
            request_id = next((one.id for one in self._to_take_back() if self._values(one, present)), '')
        taken: List[Request] = []
        others: Dict[Location, Request] = {}
        back: Dict[Location, Scalar] = {}
        for request in self._left():  # from the latest one
            if request.id != request_id:
                for location in request.changes:
                    if location not in others or others[location].requester == EDITOR:
                        others[location] = request
                continue
            taken.append(request)
            for location, old in self._values(request, present).items():
                other = others.get(location)
                # An edit may have been taken back in the file.
                if other is not None and (
                    other.requester != EDITOR or differing([(location, request.changes[location][1], location.value)])
                ):
                    raise Refused(
                        f'{location.name} has been changed since by {other.requester or "somebody"}: '
                        f'take that back {"in the file " if other.requester == EDITOR else ""}first'
                    )
                back[location] = old
        return (taken, back) if back else ([], {})

    def messages(self, request_id: str, limit: int) -> List[msg.RecordedChange]:
        """The changes as messages, the oldest first; the arguments are those of the service GetHistory."""
        found = [
            msg.RecordedChange(
                request.id,
                applied_change(request.stamp, location, old, new, request.requester),
                request.undone,
            )
            for request in self._requests
            if request_id in ('', request.id)
            for location, (old, new) in request.changes.items()
        ]
        return found[-limit:] if limit else found

    def _left(self) -> Iterator[Request]:
        """The requests that have not been taken back, from the latest one."""
        return (request for request in reversed(self._requests) if not request.undone)

    def _to_take_back(self) -> Iterator[Request]:
        """Return the changes that can be taken back, from the latest one."""
        return (request for request in self._left() if request.requester != EDITOR)

    def _values(self, request: Request, present: Dict[int, Location]) -> Dict[Location, Scalar]:
        """The values before a request, of the locations that are still there."""
        return {location: old for location, (old, _) in request.changes.items() if present.get(location.id) is location}


def applied_change(stamp: object, location: Location, old: Scalar, new: Scalar, requester: str) -> msg.AppliedChange:
    """A change as a message."""
    return msg.AppliedChange(stamp, location.id, location.name, to_json(old), to_json(new), requester)


def differing(changes: Sequence[Change]) -> List[Change]:
    """Return the (location, value before, value after) whose value or type has changed."""
    return [(location, old, new) for location, old, new in changes if type(old) is not type(new) or old != new]
