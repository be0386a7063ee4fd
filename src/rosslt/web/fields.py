"""A plot over time of any tracked number of any topic, beside its sources, whether or not it can be dragged."""

import threading
from typing import Any, Collection, Dict, List, Optional, Tuple

from rosslt import values
from rosslt.flow import Flow
from rosslt.markers import Descriptions
from rosslt.web.flows import Flows
from rosslt.web.plots import Plot

TITLE = 'Plot a field'

#: The only entry of an empty choice.
NOTHING = 'listening to all topics'

#: (topic, publisher)
Origin = Tuple[str, str]


class Window:
    """A window of somebody in which they choose a topic, a field of it, and see it over time.

    Args:
        client: who sees it.
        flows: hears the messages of all topics.
        descriptions: says what sources are called.
    """

    def __init__(self, client: Any, flows: Flows, descriptions: Descriptions) -> None:
        self.client_id = client.client_id
        self._client, self._flows, self._descriptions = client, flows, descriptions
        self._lock = threading.RLock()
        self._origins: Dict[str, Origin] = {}  # what is chosen from -> what it stands for
        self._shown: Tuple[Optional[Origin], str] = None, ''  # what the plot shows: whose message, and the field
        self._plot: Optional[Plot] = None
        self._is_closed = False
        self._modal = client.gui.add_modal(TITLE)
        with self._modal:
            # viser opens a list that comes first by itself
            self.close_button = client.gui.add_button('Close')
            self._topic = client.gui.add_dropdown('topic', (NOTHING,))
            self._field = client.gui.add_dropdown('field', (NOTHING,))
        for choice in (self._topic, self._field):
            choice.on_update(lambda event: self._choose())
        flows.look(self)

    def update(self, flow: Flow) -> None:
        """Offer the topics and fields that there are now."""
        with self._lock:
            if self._is_closed:
                return
            origins = sorted({(reach.topic, reach.publisher) for reach in flow.provenance.fields})
            self._origins = {'{} of {}'.format(*origin): origin for origin in origins}
            _offer(self._topic, list(self._origins))
            self._choose()

    def continue_plot(self) -> None:
        """Continue the plot, if there is one."""
        with self._lock:
            if self._plot is not None and not self._is_closed:
                self._plot.update()

    def close(self) -> None:
        """Take the window away."""
        self._flows.remove(self)
        with self._lock:
            self._is_closed = True
            self._modal.close()

    def _choose(self) -> None:
        """Show what is chosen now."""
        with self._lock:
            origin = self._origins.get(self._topic.value)
            if origin != self._shown[0] or self._field.value == NOTHING:
                _offer(self._field, list(self._numbers(origin)))
            shown = origin, self._field.value
            if shown == self._shown or shown[1] == NOTHING:
                return
            self._shown = shown
            if self._plot is not None:
                self._plot.remove()
            with self._modal:
                self._plot = Plot(self._client, self._read, self._descriptions, [shown[1]])

    def _read(self) -> List[Any]:
        """The number that is shown, as the last message has it; nothing where it has none."""
        origin, field = self._shown
        numbers = self._numbers(origin)
        return [numbers[field]] if field in numbers else []

    def _numbers(self, origin: Optional[Origin]) -> Dict[str, Any]:
        """{field: tracked number} of the last message of a topic."""
        message = None if origin is None else self._flows.newest(*origin)
        leaves = [] if message is None else values.leaves(message)
        return {path: leaf for path, leaf in leaves if values.is_tracked(leaf) and isinstance(leaf, (int, float))}


class Fields:
    """The button that opens such windows, and the windows that are open.

    Args:
        server: viser's; the button stands where its next element would be.
        flows, descriptions: as of a Window.
    """

    def __init__(self, server: Any, flows: Flows, descriptions: Descriptions) -> None:
        self._flows, self._descriptions = flows, descriptions
        self._lock = threading.Lock()
        self._windows: List[Window] = []
        server.gui.add_button(TITLE).on_click(lambda event: self._open(event.client))

    def update(self, clients: Collection[int]) -> None:
        """Continue the plots.

        Args:
            clients: the ids of those who still look.
        """
        with self._lock:
            self._windows = [window for window in self._windows if window.client_id in clients]
            windows = list(self._windows)
        for window in windows:
            window.continue_plot()

    def _open(self, client: Any) -> None:
        window = Window(client, self._flows, self._descriptions)
        window.close_button.on_click(lambda event: self._close(window))
        with self._lock:
            self._windows.append(window)

    def _close(self, window: Window) -> None:
        with self._lock:
            self._windows = [one for one in self._windows if one is not window]
        window.close()


def _offer(choice: Any, options: List[str]) -> None:
    """Have somebody choose from these; what they have chosen stays as long as it is among them."""
    offered = tuple(options) or (NOTHING,)
    if tuple(choice.options) != offered:
        choice.options = offered
