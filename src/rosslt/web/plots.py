"""Tracked numbers over time, beside those of their sources."""

import collections
import time
from typing import Any, Callable, Deque, List, Sequence, Tuple

import numpy
from viser import uplot

from rosslt import values
from rosslt.markers import Descriptions

#: The time span of a plot and the period of its updates, in seconds.
SPAN, PERIOD = 30.0, 0.2

COLORS = ('#d62728', '#2ca02c', '#1f77b4', '#ff7f0e', '#9467bd', '#8c564b', '#e377c2')


class Plot:
    """A plot of tracked numbers, and of all that they come from.

    Args:
        client: who sees it; the plot stands where viser's next element for them would be.
        read: gives the numbers as they are now; other than at first, or none, where there is nothing to show.
        descriptions: says what sources are called.
        labels: what the numbers are called; by default `value 1` and so on.
    """

    def __init__(
        self, client: Any, read: Callable[[], Sequence[Any]], descriptions: Descriptions, labels: Sequence[str] = ()
    ) -> None:
        self._read = read
        tracked = read()
        sources = values.source_values(tracked)
        descriptions.look_up(sources)
        self._sources = [source for source, value in sources.items() if isinstance(value, (int, float))]
        self._count = len(tracked)
        self._start = self._next = time.monotonic()
        self._rows: Deque[Tuple[float, ...]] = collections.deque(maxlen=int(SPAN / PERIOD))
        self._descriptions = descriptions
        self._names = list(labels) or ['value {}'.format(index + 1) for index in range(self._count)]
        self._labels = self._all_labels()
        self.update()
        self._chart = client.gui.add_uplot(
            self._data(), self._series(), scales={'x': uplot.Scale(time=False)}, aspect=2.0
        )

    def update(self) -> None:
        """Continue the plot, if it is time."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PERIOD
        tracked = self._read()
        if not tracked or len(tracked) != self._count:
            return
        present = values.source_values(tracked)
        numbers = [float(value) for value in tracked]
        sources = [float(present.get(source, numpy.nan)) for source in self._sources]
        self._rows.append((now - self._start, *numbers, *sources))
        if hasattr(self, '_chart'):
            self._chart.data = self._data()
            labels = self._all_labels()
            if labels != self._labels:  # what a source is called is known some time after it is seen
                self._labels = labels
                self._chart.series = self._series()

    def remove(self) -> None:
        """Take it away."""
        self._chart.remove()

    def _all_labels(self) -> List[str]:
        return [*self._names, *(self._descriptions.name(source) for source in self._sources)]

    def _data(self) -> Tuple[Any, ...]:
        columns = list(zip(*self._rows)) or [()] * (1 + len(self._labels))
        return tuple(numpy.array(column, dtype=float) for column in columns)

    def _series(self) -> Tuple[Any, ...]:
        drawn: List[Any] = [uplot.Series(label='s')]
        for index, label in enumerate(self._labels):
            color = COLORS[index % len(COLORS)]
            is_source = index >= self._count
            drawn.append(uplot.Series(label=label, stroke=color, width=2, dash=(4, 4) if is_source else None))
        return tuple(drawn)
