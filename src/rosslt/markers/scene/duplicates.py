"""Finds handles that stand on the same thing, and selects the one that is shown."""

from typing import Any, Dict, List, Optional, Tuple

from rosslt import values
from rosslt.markers.geometry import distance
from rosslt.markers.scene.handle import Handle, has_source

#: The largest distance of two handles on one thing, against their size: their messages are not of the same time.
NEAR = 0.5

#: The relative difference that the slopes of two such values may have, for the same reason.
SLOPE_TOLERANCE = 0.05

#: The frame, and the sources of x, y and z.
Origin = Tuple[Any, ...]


class Duplicates:
    """The handles that stand on one thing, by the sources that their positions come from.

    A waypoint is published as a pose and drawn as a marker by another node: both positions are the same function of the
    same sources. The handle of the lowest rank is shown; those of the same rank are different things.
    """

    def __init__(self) -> None:
        self._origins: Dict[str, Origin] = {}  # name of a handle -> its origin
        self._ranks: Dict[Origin, Dict[int, Dict[str, Handle]]] = {}  # origin -> rank -> {name: handle}

    def is_shown(self, name: str) -> bool:
        """True unless a handle of a lower rank on the same thing hides a handle."""
        ranks = self._ranks.get(self._origins.get(name, ()), {})
        for rank, handles in ranks.items():
            if name in handles:
                lower = [other for one in ranks if one < rank for other in ranks[one].values()]
                return not any(_are_same(other, handles[name]) for other in lower)
        return True

    def put(self, handle: Handle) -> List[str]:
        """A handle is there, or has changed; gives the names of others that may be shown or hidden by that."""
        concerned = self.drop(handle.name)
        origin = _origin_of(handle)
        if origin is not None:
            self._origins[handle.name] = origin
            self._ranks.setdefault(origin, {}).setdefault(handle.rank, {})[handle.name] = handle
            concerned += self._above(origin, handle.rank)
        return concerned

    def drop(self, name: str) -> List[str]:
        """A handle was removed; gives the names of others that may be shown again."""
        origin = self._origins.pop(name, None)
        if origin is None:
            return []
        ranks = self._ranks[origin]
        rank = next(rank for rank, handles in ranks.items() if name in handles)
        del ranks[rank][name]
        if not any(ranks.values()):
            del self._ranks[origin]
        return self._above(origin, rank)

    def _above(self, origin: Origin, rank: int) -> List[str]:
        ranks = self._ranks.get(origin, {})
        return [name for one in ranks if one > rank for name in ranks[one]]


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
