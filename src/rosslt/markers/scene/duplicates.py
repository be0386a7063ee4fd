"""Finds handles that stand on the same thing, and selects the one that is shown."""

import itertools
from typing import Any, Dict, Iterator, List, Optional, Tuple

from rosslt import values
from rosslt.markers.geometry import distance
from rosslt.markers.scene.handle import Handle, has_source

#: The largest distance of two handles on one thing, against their size: their messages are not of the same time.
NEAR = 0.5

#: The relative difference that the slopes of two such values may have, for the same reason.
SLOPE_TOLERANCE = 0.05

#: The smallest width of a cell in which handles are searched, in metres.
SMALLEST = 1e-6

_Cell = Tuple[float, float, float]

#: From a cell to those around it, and to itself.
_AROUND = list(itertools.product((-1, 0, 1), repeat=3))

#: The frame, and the sources of x, y and z.
Origin = Tuple[Any, ...]


class Duplicates:
    """The handles that stand on one thing, by the sources that their positions come from.

    A waypoint is published as a pose and drawn as a marker by another node: both positions are the same function of the
    same sources. The handle of the lowest rank is shown; those of the same rank are different things.
    """

    def __init__(self) -> None:
        self._origins: Dict[str, Origin] = {}  # name of a handle -> its origin
        self._related: Dict[Origin, _Related] = {}

    def is_shown(self, name: str) -> bool:
        """True unless a handle of a lower rank on the same thing hides a handle."""
        origin = self._origins.get(name)
        if origin is None:
            return True
        handle = self._related[origin].handles[name]
        lower = (other for other in self._related[origin].near(handle) if other.rank < handle.rank)
        return not any(_are_same(other, handle) for other in lower)

    def put(self, handle: Handle) -> List[str]:
        """A handle is there, or has changed; gives the names of others that may be shown or hidden by that."""
        concerned = self.drop(handle.name)
        origin = _origin_of(handle)
        if origin is not None:
            self._origins[handle.name] = origin
            related = self._related.setdefault(origin, _Related())
            related.put(handle)
            concerned += related.above(handle)
        return concerned

    def drop(self, name: str) -> List[str]:
        """A handle was removed; gives the names of others that may be shown again."""
        origin = self._origins.pop(name, None)
        if origin is None:
            return []
        related = self._related[origin]
        handle = related.drop(name)
        if not related.handles:
            del self._related[origin]
        return related.above(handle)


class _Related:
    """The handles whose positions come from the same sources, by the cells of a grid that they stand in.

    Attributes:
        handles: {name: handle}.
    """

    def __init__(self) -> None:
        self.handles: Dict[str, Handle] = {}
        self._width = SMALLEST  # of a cell: as large as the largest distance of two handles on one thing
        self._cells: Dict[_Cell, Dict[str, Handle]] = {}
        self._cell_of: Dict[str, _Cell] = {}

    def put(self, handle: Handle) -> None:
        """Add a handle."""
        self.handles[handle.name] = handle
        if NEAR * handle.size > self._width:
            self._width = 2 * NEAR * handle.size  # not grown by each of many
            self._cells = {}
            for one in self.handles.values():
                self._put(one)
        else:
            self._put(handle)

    def _put(self, handle: Handle) -> None:
        x, y, z = handle.pose[:3]
        width = self._width
        cell = self._cell_of[handle.name] = x // width, y // width, z // width
        self._cells.setdefault(cell, {})[handle.name] = handle

    def drop(self, name: str) -> Handle:
        """Remove a handle, and return it."""
        cell = self._cell_of.pop(name)
        del self._cells[cell][name]
        if not self._cells[cell]:
            del self._cells[cell]
        return self.handles.pop(name)

    def near(self, handle: Handle) -> Iterator[Handle]:
        """The handles that may be on the thing of a handle."""
        if len(self.handles) <= len(_AROUND):
            yield from self.handles.values()
            return
        column, row, layer = (at // self._width for at in handle.pose[:3])
        for right, back, up in _AROUND:
            yield from self._cells.get((column + right, row + back, layer + up), {}).values()

    def above(self, handle: Handle) -> List[str]:
        """The names of handles of a higher rank that may be on its thing."""
        return [other.name for other in self.near(handle) if other.rank > handle.rank]


def _origin_of(handle: Handle) -> Optional[Origin]:
    position = handle.position
    if position is None:
        return None
    tracked = [value for value in position if has_source(value)]
    if not tracked:
        return None
    which = tuple([has_source(value) for value in position])
    # Most values are a source itself, which is recognized much faster.
    origins = values.origins(tracked)
    if origins is not None:
        return (handle.frame, which, tuple([(source,) for source in origins]))
    return (handle.frame, which, tuple([tuple(values.sources(value)) for value in tracked]))


def _are_same(first: Handle, second: Handle) -> bool:
    """True if two handles whose positions come from the same sources stand on the same thing."""
    if distance(first.pose[:3], second.pose[:3]) > NEAR * max(first.size, second.size):
        return False
    for one, other in zip(first.position or (), second.position or ()):
        terms, other_terms = values.affine(one), values.affine(other)
        if terms is None or other_terms is None or len(terms) != len(other_terms):
            return False
        for (_, _, slope), (_, _, other_slope) in zip(terms, other_terms):
            if abs(slope - other_slope) > SLOPE_TOLERANCE * max(abs(slope), abs(other_slope)):
                return False
    return True
