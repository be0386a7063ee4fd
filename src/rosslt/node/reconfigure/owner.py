"""The node whose locations the server offers, as far as it is used."""

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
