"""The interface of the owner of locations (`location_server.Owner`), for the modules that it imports."""

from typing import ContextManager, FrozenSet, Iterable, List, Protocol, Sequence, Tuple

from rosslt import srv
from rosslt.messages import Scalar
from rosslt.node.change.history import History, Request
from rosslt.node.change.locks import Access
from rosslt.node.locations.location import Change, Location, Locations


class Owner(Protocol):
    """What `location_server.Owner` says and does; see there."""

    name: str
    locations: Locations
    access: Access
    history: History
    settings: FrozenSet[str]

    @property
    def lock(self) -> ContextManager[bool]: ...

    def known(self, location_id: int) -> Location: ...

    def changeable(self, location: Location, requester: str) -> Location: ...

    def check_goes_on(self, requester: str) -> None: ...

    def to_undo(self, request_id: str, requester: str) -> Tuple[List[Request], List[Tuple[Location, Scalar]]]: ...

    def outcome_of(self, request_id: str) -> srv.ChangeSourcesResponse: ...

    def outdated_by(self, request_id: str) -> List[str]: ...

    def change_sources(self, request: srv.ChangeSourcesRequest) -> srv.ChangeSourcesResponse: ...

    def apply(
        self, wanted: Sequence[Tuple[Location, Scalar]], requester: str, request_id: str = '', record: bool = True
    ) -> Tuple[List[str], List[Change]]: ...

    def applied(self, changes: Sequence[Change], requester: str) -> None: ...

    def set_value(self, location: Location, value: object, requester: str) -> None: ...

    def set_setting(self, name: str, value: object) -> None: ...

    def follow(self, changed: Iterable[Location]) -> int: ...

    def wait_for_parameters(self, written: int) -> None: ...

    def publish_locations(self) -> None: ...
