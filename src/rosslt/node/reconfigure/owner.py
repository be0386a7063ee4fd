"""What the server needs of the node whose locations it offers."""

from typing import ContextManager, Protocol

from rosslt import srv
from rosslt.node.locations import Locations


class Owner(Protocol):
    """The owner of the locations: its name, its locations, and the one way to change them."""

    name: str
    locations: Locations

    @property
    def lock(self) -> ContextManager[bool]: ...

    def change_sources(self, request: srv.ChangeSourcesRequest) -> srv.ChangeSourcesResponse: ...
