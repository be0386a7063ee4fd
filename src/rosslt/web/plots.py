"""Tracked numbers over time, beside those of their sources; and a window to choose any of them from."""

import collections
import time
from typing import Any, Callable, Deque, Dict, List, Optional, Sequence, Tuple

import numpy
import viser
from viser import uplot

from rosslt import values
from rosslt.flow import Flow
from rosslt.markers import Descriptions
from rosslt.web.flows import Flows, Look

#: The number of points that a plot shows: half a minute at the rate at which the page updates plots.
POINTS = 150

COLORS = ('#d62728', '#2ca02c', '#1f77b4', '#ff7f0e', '#9467bd', '#8c564b', '#e377c2')

TITLE = 'Plot a field'

#: The only entry of an empty choice.
NOTHING = 'listening to all topics'

#: (topic, publisher)
Origin = Tuple[str, str]


class Plot:
    """A plot of tracked numbers, and of all that they come from.

    Args:
        client: who sees it; the plot stands where viser's next element for them would be.
        read: gives the present numbers; with a different count than at first, or none, nothing is added.
        descriptions: says what sources are called.
        labels: what the numbers are called; by default `value 1` and so on.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        read: Callable[[], Sequence[Any]],
        descriptions: Descriptions,
        labels: Sequence[str] = (),
    ) -> None:
        self.client_id = client.client_id
        self._read, self._descriptions, self._start = read, descriptions, time.monotonic()
        tracked = read()
        sources = values.source_values(tracked)
        descriptions.look_up(sources)
        self._sources = [source for source, value in sources.items() if isinstance(value, (int, float))]
        self._names = list(labels) or ['value {}'.format(index + 1) for index in range(len(tracked))]
        self._labels = self._all_labels()
        self._rows: Deque[Tuple[float, ...]] = collections.deque([self._row(tracked)], maxlen=POINTS)
        scales = {'x': uplot.Scale(time=False)}
        self._chart = client.gui.add_uplot(self._data(), self._series(), scales=scales, aspect=2.0)

    def update(self) -> None:
        """Continue the plot."""
        tracked = self._read()
        if not tracked or len(tracked) != len(self._names):
            return
        self._rows.append(self._row(tracked))
        self._chart.data = self._data()
        labels = self._all_labels()
        if labels != self._labels:  # the name of a source becomes known some time after it is seen
            self._labels = labels
            self._chart.series = self._series()

    def remove(self) -> None:
        """Take it away."""
        self._chart.remove()

    def _row(self, tracked: Sequence[Any]) -> Tuple[float, ...]:
        present = values.source_values(tracked)
        sources = [float(present.get(source, numpy.nan)) for source in self._sources]
        return (time.monotonic() - self._start, *map(float, tracked), *sources)

    def _all_labels(self) -> List[str]:
        return [*self._names, *(self._descriptions.name(source) for source in self._sources)]

    def _data(self) -> Tuple[numpy.ndarray, ...]:
        return tuple(numpy.array(column, dtype=float) for column in zip(*self._rows))

    def _series(self) -> Tuple[uplot.Series, ...]:
        drawn = [uplot.Series(label='s')]
        for index, label in enumerate(self._labels):
            color = COLORS[index % len(COLORS)]
            is_source = index >= len(self._names)
            drawn.append(uplot.Series(label=label, stroke=color, width=2, dash=(4, 4) if is_source else None))
        return tuple(drawn)


class Plots:
    """All plots that are open, and the button that opens a window to choose any tracked number of any topic.

    Args:
        server: viser's; the button stands where its next element would be.
        flows: hears the messages of all topics.
        descriptions: says what sources are called.
    """

    def __init__(self, server: viser.ViserServer, flows: Flows, descriptions: Descriptions) -> None:
        self._server, self._flows, self._descriptions = server, flows, descriptions
        self._open: List[Plot] = []
        server.gui.add_button(TITLE).on_click(self._choose)

    def add(self, client: viser.ClientHandle, read: Callable[[], Sequence[Any]], labels: Sequence[str] = ()) -> Plot:
        """Add a Plot, which is continued until it is removed."""
        plot = Plot(client, read, self._descriptions, labels)
        self._open.append(plot)
        return plot

    def remove(self, plot: Plot) -> None:
        """Continue a plot no more."""
        self._open = [one for one in self._open if one is not plot]

    def update(self) -> None:
        """Continue the plots of those who still look."""
        clients = self._server.get_clients()
        self._open = [plot for plot in self._open if plot.client_id in clients]
        for plot in self._open:
            plot.update()

    def _choose(self, event: viser.GuiEvent) -> None:
        with self._flows.lock:
            self._flows.look(Window(event.client, self._flows, self))


class Window(Look):
    """A window of somebody in which they choose a topic, a field of it, and see it over time.

    Args:
        client: who sees it.
        flows: hears the messages of all topics.
        plots: has the plot.
    """

    def __init__(self, client: viser.ClientHandle, flows: Flows, plots: Plots) -> None:
        super().__init__(client)
        self._client, self._flows, self._plots = client, flows, plots
        self._is_open = True
        self._origins: Dict[str, Origin] = {}  # label in the list -> the number that it stands for
        self._shown: Tuple[Optional[Origin], str] = None, ''  # what the plot shows: whose message, and the field
        self._plot: Optional[Plot] = None
        self._modal = client.gui.add_modal(TITLE)
        with self._modal:
            # viser opens a list that comes first by itself
            client.gui.add_button('Close').on_click(self._close)
            self._topic = client.gui.add_dropdown('topic', (NOTHING,))
            self._field = client.gui.add_dropdown('field', (NOTHING,))
        for choice in (self._topic, self._field):
            choice.on_update(self._choose)

    def update(self, flow: Flow) -> None:
        """Offer the topics and fields that there are now."""
        with self._flows.lock:
            if self._is_open:
                origins = sorted({(reach.topic, reach.publisher) for reach in flow.provenance.fields})
                self._origins = {'{} of {}'.format(*origin): origin for origin in origins}
                _offer(self._topic, list(self._origins))
                self._choose()

    def _close(self, _event: viser.GuiEvent) -> None:
        with self._flows.lock:
            self._is_open = False
            self._flows.remove(self)
            self._remove_plot()
            self._modal.close()

    def _remove_plot(self) -> None:
        if self._plot is not None:
            self._plots.remove(self._plot)
            self._plot.remove()

    def _choose(self, _event: Optional[viser.GuiEvent] = None) -> None:
        """Show what is chosen now."""
        with self._flows.lock:
            origin = self._origins.get(self._topic.value)
            if origin != self._shown[0] or self._field.value == NOTHING:
                _offer(self._field, list(self._numbers(origin)))
            shown = origin, self._field.value
            if shown == self._shown or shown[1] == NOTHING:
                return
            self._shown = shown
            self._remove_plot()
            with self._modal:
                self._plot = self._plots.add(self._client, self._read, [shown[1]])

    def _read(self) -> List[Any]:
        """The number that is shown, as the last message has it; nothing if it has none."""
        origin, field = self._shown
        numbers = self._numbers(origin)
        return [numbers[field]] if field in numbers else []

    def _numbers(self, origin: Optional[Origin]) -> Dict[str, Any]:
        """{field: tracked number} of the last message of a topic."""
        message = None if origin is None else self._flows.newest(*origin)
        leaves = [] if message is None else values.leaves(message)
        return {path: leaf for path, leaf in leaves if values.is_tracked(leaf) and isinstance(leaf, (int, float))}


def _offer(choice: viser.GuiDropdownHandle, options: List[str]) -> None:
    """Have somebody choose from these; what they have chosen stays as long as it is among them."""
    offered = tuple(options) or (NOTHING,)
    if tuple(choice.options) != offered:
        choice.options = offered
