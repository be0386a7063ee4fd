"""Finds handles that stand on the same thing, and selects the one that is shown."""

import collections
import itertools
import math
from typing import Any, Counter, Dict, Iterator, List, Optional, Set, Tuple

from rosslt import values
from rosslt.markers.geometry import distance
from rosslt.markers.scene.handle import Handle, has_source

#: The largest distance of two handles on one thing, against their size: their messages are not of the same time.
NEAR = 0.5

#: The relative difference that the slopes of two such values may have, for the same reason.
SLOPE_TOLERANCE = 0.05

#: The frame, and the sources of x, y and z.
Origin = Tuple[Any, ...]

Cell = Tuple[int, ...]


class Duplicates:
    """The handles that stand on one thing, by the sources that their positions come from.

    A waypoint is published as a pose and drawn as a marker by another node: both positions are the same function of the
    same sources. The handle of the lowest rank is shown; those of the same rank are different things.
    """

    def __init__(self) -> None:
        self._origins: Dict[str, Origin] = {}  # name of a handle -> its origin
        self._groups: Dict[Origin, _Group] = {}
        self._hidden_by: Dict[str, Set[str]] = {}  # names of handles -> those of lower ranks on the same thing
        self._hides: Dict[str, Set[str]] = {}

    def is_shown(self, name: str) -> bool:
        """True unless another handle on the same thing hides a handle."""
        return name not in self._hidden_by

    def put(self, handle: Handle) -> List[str]:
        """A handle is there, or has changed; gives the names of others that are shown or hidden by that."""
        name, origin = handle.name, _origin_of(handle)
        changed = self.drop(name)
        if origin is None:
            return changed
        self._origins[name] = origin
        group = self._groups.setdefault(origin, _Group())
        for other in group.near(handle):
            if _are_same(other, handle):
                lower, higher = sorted((handle, other), key=lambda one: one.rank)
                self._hidden_by.setdefault(higher.name, set()).add(lower.name)
                self._hides.setdefault(lower.name, set()).add(higher.name)
                if higher is other:
                    changed.append(other.name)
        group.add(handle)
        return changed

    def drop(self, name: str) -> List[str]:
        """A handle was removed; gives the names of others that are shown again."""
        origin = self._origins.pop(name, None)
        if origin is None:
            return []
        group = self._groups[origin]
        group.remove(name)
        if not group.handles:
            del self._groups[origin]
        for lower in self._hidden_by.pop(name, ()):
            self._hides[lower].discard(name)
        freed = []
        for higher in self._hides.pop(name, ()):
            self._hidden_by[higher].discard(name)
            if not self._hidden_by[higher]:
                del self._hidden_by[higher]
                freed.append(higher)
        return freed


class _Group:
    """Handles whose positions come from the same sources, in a grid: one is compared with those near by alone."""

    def __init__(self) -> None:
        self.handles: Dict[str, Handle] = {}
        self._ranks: Counter[int] = collections.Counter()
        self._cells: Dict[Cell, Dict[str, Handle]] = {}
        self._edge = 0.0  # of a cell: two handles on one thing are in the same cell, or in adjacent ones

    def add(self, handle: Handle) -> None:
        self.handles[handle.name] = handle
        self._ranks[handle.rank] += 1
        if NEAR * handle.size > self._edge:
            self._edge = 2.0 * NEAR * handle.size
            self._cells = {}
            for each in self.handles.values():
                self._cells.setdefault(self._cell(each), {})[each.name] = each
        else:
            self._cells.setdefault(self._cell(handle), {})[handle.name] = handle

    def remove(self, name: str) -> None:
        handle = self.handles.pop(name)
        self._ranks[handle.rank] -= 1
        cell = self._cell(handle)
        del self._cells[cell][name]
        if not self._cells[cell]:
            del self._cells[cell]

    def near(self, handle: Handle) -> Iterator[Handle]:
        """The handles of other ranks that may stand on the same thing as a handle."""
        if len(self.handles) == self._ranks[handle.rank]:
            return
        if NEAR * handle.size > self._edge:
            found = iter(self.handles.values())
        else:
            steps = [(part - 1, part, part + 1) for part in self._cell(handle)]
            found = (each for cell in itertools.product(*steps) for each in self._cells.get(cell, {}).values())
        for each in found:
            if each.rank != handle.rank:
                yield each

    def _cell(self, handle: Handle) -> Cell:
        return tuple([math.floor(part / self._edge) for part in handle.pose[:3]])


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
    """True where two handles whose positions come from the same sources stand on the same thing."""
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
