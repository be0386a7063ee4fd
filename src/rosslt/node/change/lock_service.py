"""The service by which locations are locked and unlocked, and which says who may change what."""

from typing import Callable, Iterable

import rospy

from rosslt import srv
from rosslt.node.change.locks import LOCKS, WHOLE, Lock
from rosslt.node.change.owner_interface import Owner
from rosslt.node.json_scalars import Refused
from rosslt.node.locations.location import Location
from rosslt.node.parameters.mirror import Parameters
from rosslt.node.parameters.server import as_sent

LOCK, UNLOCK, ASK = 'lock', 'unlock', ''


class Locking:
    """`<node>/rosslt/lock_locations`.

    Args:
        owner: this node as the owner of locations.
        parameters: its parameters.
        wait_for_reserved: waits until nobody is changing locations; raises Refused if that takes too long.
    """

    def __init__(
        self, owner: Owner, parameters: Parameters, wait_for_reserved: Callable[[Iterable[Location]], bool]
    ) -> None:
        self._owner, self._parameters, self._wait_for_reserved = owner, parameters, wait_for_reserved

    def serve(self) -> None:
        """Offer the service."""
        rospy.Service('~rosslt/lock_locations', srv.LockLocations, self.lock_locations)

    def lock_locations(self, request: srv.LockLocationsRequest) -> srv.LockLocationsResponse:
        """Lock or unlock locations, all or none, and say what is locked then."""
        if request.action not in (LOCK, UNLOCK, ASK):
            raise rospy.ServiceException(f'{request.action!r} is not an action: lock, unlock or nothing')
        owner = self._owner
        with owner.lock:
            if request.action != ASK:
                self._act(request)
            written = self._parameters.write(*[LOCKS] * (request.action != ASK))
            ids = {location.name: location.id for location in owner.locations.by_id.values()}
            told = {ids.get(name, 0): lock for name, lock in owner.access.locks.items() if name in ids or name == WHOLE}
        if request.action != ASK:
            owner.publish_locations()
            owner.wait_for_parameters(written)
        return srv.LockLocationsResponse(
            [] if owner.access.accepted_from is None else owner.access.accepted_from or ['nobody'],
            list(told),
            [lock.who for lock in told.values()],
            [lock.reason for lock in told.values()],
        )

    def _act(self, request: srv.LockLocationsRequest) -> None:
        owner, access = self._owner, self._owner.access
        try:
            locations = [owner.known(one) for one in request.location_ids]
            if request.action == LOCK:
                as_sent([request.who, request.reason])
                # changes under way end before the lock is confirmed
                self._wait_for_reserved(locations or owner.locations.by_id.values())
        except Refused as refused:
            raise rospy.ServiceException(str(refused)) from None
        names = [location.name for location in locations] or [WHOLE]
        if request.action == LOCK:
            who = request.who or request._connection_header.get('callerid', '')
            access.locks.update(dict.fromkeys(names, Lock(who, request.reason)))
        elif locations:
            for name in names:
                access.locks.pop(name, None)
        else:
            access.locks.clear()
