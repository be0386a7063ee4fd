"""The clicks of visitors: each selects one thing, and all see the handles of every selected thing."""

from typing import ContextManager, Dict, Set

import viser

from rosslt.markers import Selection


class Clicks:
    """The clicks of all visitors.

    Args:
        server: viser's.
        lock: of the page.

    Attributes:
        selection: what is selected.
    """

    def __init__(self, server: viser.ViserServer, lock: ContextManager[bool]) -> None:
        self._server, self._lock = server, lock
        self.selection = Selection(shows_all=False)
        self._selected: Dict[int, str] = {}  # by client
        self._on_thing: Set[int] = set()  # clients whose next click anywhere is the one on a thing
        self._all = server.gui.add_checkbox('Show all handles', False, hint='else those of what was clicked')

        async def escaped(event: viser.CommandEvent) -> None:
            if event.client is not None:
                with lock:
                    self._clear(event.client)

        server.gui.add_command('Select nothing', hotkey='escape').on_trigger(escaped)

    def update(self) -> None:
        """Update the selection, without the things of visitors who have left."""
        clients = self._server.get_clients()
        self.selection.shows_all = self._all.value
        self.selection.things = frozenset(name for client, name in self._selected.items() if client in clients)

    def select(self, client: viser.ClientHandle, name: str) -> None:
        """Somebody selects a thing."""
        if client.client_id not in self._selected:
            # Not before: as long as viser listens to clicks anywhere, the cursor is a hand everywhere.
            client.scene.on_click()(self._clicked_anywhere)
        self._selected[client.client_id] = name

    def click(self, client: viser.ClientHandle, name: str) -> None:
        """Somebody clicks on a thing; viser also reports this as a click anywhere, if it listens to those."""
        if client.client_id in self._selected:
            self._on_thing.add(client.client_id)
        self.select(client, name)

    async def _clicked_anywhere(self, event: viser.SceneClickEvent) -> None:
        with self._lock:
            if event.client_id in self._on_thing:
                self._on_thing.remove(event.client_id)
            else:
                self._clear(event.client)

    def _clear(self, client: viser.ClientHandle) -> None:
        if self._selected.pop(client.client_id, None) is not None:
            self._on_thing.discard(client.client_id)
            client.scene.remove_click_callback()
