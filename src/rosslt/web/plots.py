"""The numbers of a thing over time, beside those of their sources."""

import collections
import time
from typing import Any, Deque, List, Tuple

import numpy
from viser import uplot

from rosslt import values
from rosslt.markers import Descriptions, Scene

#: How far back a plot goes, in seconds, and how often it is continued.
SPAN, PERIOD = 30.0, 0.2

COLORS = ('#d62728', '#2ca02c', '#1f77b4', '#ff7f0e', '#9467bd', '#8c564b', '#e377c2')


class Plot:
    """A plot of what a drag of one thing can change, and of all that this comes from.

    Args:
        client: who sees it; the plot stands where viser's next element for them would be.
        scene: has the thing.
        name: of the thing.
        descriptions: says what sources are called.
    """

    def __init__(self, client: Any, scene: Scene, name: str, descriptions: Descriptions) -> None:
        self._scene, self._name = scene, name
        handle = scene.handle(name)
        tracked = [] if handle is None else handle.tracked
        self._sources = [
            source for source, value in values.source_values(tracked).items() if isinstance(value, (int, float))
        ]
        self._count = len(tracked)
        self._start = self._next = time.monotonic()
        self._rows: Deque[Tuple[float, ...]] = collections.deque(maxlen=int(SPAN / PERIOD))
        labels = ['value {}'.format(index + 1) for index in range(self._count)]
        self._labels = labels + [descriptions.name(source) for source in self._sources]
        self.update()
        self._chart = client.gui.add_uplot(
            self._data(), self._series(), scales={'x': uplot.Scale(time=False)}, aspect=2.0
        )

    def update(self) -> None:
        """Continue the plot, if it is time."""
        handle, now = self._scene.handle(self._name), time.monotonic()
        if handle is None or now < self._next:
            return
        self._next = now + PERIOD
        present = values.source_values(handle.tracked)
        numbers = [float(value) for value in handle.tracked]
        if len(numbers) != self._count:
            return
        sources = [float(present.get(source, numpy.nan)) for source in self._sources]
        self._rows.append((now - self._start, *numbers, *sources))
        if hasattr(self, '_chart'):
            self._chart.data = self._data()

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
