"""One thing, one handle: which handles stand at one place, and which of them is shown."""

from typing import Any, Dict, List, Optional, Tuple

from rosslt import values
from rosslt.markers.geometry import distance
from rosslt.markers.scene.handle import Handle, has_source

#: How far apart two handles on one thing may be, against their size: their messages are not of the same time.
NEAR = 0.5

#: By how much the slopes of two values that mean the same may differ, for the same reason.
SLOPE_TOLERANCE = 0.05

#: The frame, and the sources of x, y and z.
Place = Tuple[Any, ...]


class Places:
    """The places of handles, by the sources that their positions come from.

    A waypoint is published as a pose and drawn as a marker by another node: both positions are the same function of the
    same sources. The handle of the lowest rank is shown; those of the same rank are different things.
    """

    def __init__(self) -> None:
        self._places: Dict[str, Place] = {}  # name of a handle -> its place
        self._at: Dict[Place, Dict[str, Handle]] = {}  # handles at a place, if there are any
        self._hidden: Dict[str, None] = {}

    def is_shown(self, name: str) -> bool:
        """Whether a handle is shown, not hidden by another one at its place."""
        return name not in self._hidden

    def put(self, handle: Handle) -> List[str]:
        """A handle is there, or has changed; gives the names of others that are shown or hidden by that."""
        name, place = handle.name, _place_of(handle)
        before = self._places.get(name)
        if before == place:
            if place is None:
                return []
            self._at[place][name] = handle
            return [] if len(self._at[place]) == 1 else self._decide(place, name)
        changed = self.drop(name)
        if place is not None:
            self._places[name] = place
            self._at.setdefault(place, {})[name] = handle
            changed += self._decide(place, name)
        return changed

    def drop(self, name: str) -> List[str]:
        """A handle was removed; gives the names of others that are shown again."""
        place = self._places.pop(name, None)
        self._hidden.pop(name, None)
        if place is None:
            return []
        there = self._at[place]
        del there[name]
        if not there:
            del self._at[place]
            return []
        return self._decide(place, name)

    def _decide(self, place: Place, but: str) -> List[str]:
        """Decide anew who is hidden at a place; gives the names, but for one, for whom that has changed."""
        there = self._at[place].values()
        changed = []
        for handle in there:
            is_hidden = any(other.rank < handle.rank and _are_same(other, handle) for other in there)
            if is_hidden == (handle.name in self._hidden):
                continue
            if is_hidden:
                self._hidden[handle.name] = None
            else:
                del self._hidden[handle.name]
            if handle.name != but:
                changed.append(handle.name)
        return changed


def _place_of(handle: Handle) -> Optional[Place]:
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
    """Whether two handles whose positions come from the same sources stand on the same thing."""
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
