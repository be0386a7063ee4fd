"""The service by which locations are locked and unlocked, and which says who may change what."""

from typing import Any, ContextManager, Iterable, Protocol

import rospy

from rosslt import srv
from rosslt.node.access import WHOLE, Access, Lock
from rosslt.node.json_scalars import Refused
from rosslt.node.locations import Location, Locations
from rosslt.node.parameters import ParameterMirror

LOCK, UNLOCK, ASK = 'lock', 'unlock', ''


class Owner(Protocol):
    """The attributes of `server.Owner`, the owner of this node's locations, that this module uses."""

    access: Access
    locations: Locations
    mirror: ParameterMirror

    @property
    def lock(self) -> ContextManager[Any]: ...

    def known(self, location_id: int) -> Location: ...

    def wait_for_reserved(self, locations: Iterable[Location]) -> bool: ...

    def wait_for_parameters(self, written: int) -> None: ...

    def publish_locations(self) -> None: ...


class Locking:
    """`<node>/rosslt/lock_locations`.

    Args:
        owner: this node as the owner of locations.
    """

    def __init__(self, owner: Owner) -> None:
        self._owner = owner

    def serve(self) -> None:
        """Offer the service."""
        rospy.Service('~rosslt/lock_locations', srv.LockLocations, self.lock_locations)

    def lock_locations(self, request: srv.LockLocationsRequest) -> srv.LockLocationsResponse:
        """Lock or unlock locations, all or none, and say what is locked then."""
        if request.action not in (LOCK, UNLOCK, ASK):
            raise rospy.ServiceException(f'{request.action!r} is no action: lock, unlock or nothing')
        owner = self._owner
        with owner.lock:
            if request.action != ASK:
                self._act(request)
            written = owner.mirror.write(*filter(None, [owner.access.parameter] * (request.action != ASK)))
            ids = {location.name: location.id for location in owner.locations.by_id.values()}
            told = {ids.get(name, 0): lock for name, lock in owner.access.locks.items() if name in ids or name == WHOLE}
        if request.action != ASK:
            owner.publish_locations()
            owner.wait_for_parameters(written)
        return srv.LockLocationsResponse(
            owner.access.accepts,
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
                # what is under way is over when it is said that no change is taken any more
                owner.wait_for_reserved(locations or owner.locations.by_id.values())
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
            access.accepts = True
