"""Finds handles that stand on the same thing, and selects the one that is shown."""

from typing import Any, Dict, List, Optional, Tuple

from rosslt import values
from rosslt.markers.scene.handle import Handle, has_source

#: To how many digits after the point slopes and offsets are compared: some messages have numbers of 32 bits.
DIGITS = 5

#: The frame, and for each of x, y and z: its offset, and its slope by each source that it comes from.
Function = Tuple[Any, ...]


class Duplicates:
    """The handles that stand on one thing, by the functions that give their positions.

    A waypoint is published as a pose and drawn as a marker by another node: both positions are the same function of the
    same sources. The handle of the lowest rank is shown; those of the same rank are different things.
    """

    def __init__(self) -> None:
        self._functions: Dict[str, Function] = {}  # name of a handle -> the function that gives its position
        self._ranks: Dict[Function, Dict[str, int]] = {}  # -> the ranks of the handles there

    def is_shown(self, name: str) -> bool:
        """True unless another handle on the same thing hides a handle."""
        ranks = self._ranks.get(self._functions.get(name, ()), {name: 0})
        return ranks[name] == min(ranks.values())

    def put(self, handle: Handle) -> List[str]:
        """A handle is there, or has changed; gives the names of all that may be shown or hidden by that."""
        name, function = handle.name, _function_of(handle)
        if function == self._functions.get(name):
            return [name]
        changed = self.drop(name)
        if function is not None:
            ranks = self._ranks.setdefault(function, {})
            ranks[name] = handle.rank
            self._functions[name] = function
            changed += ranks
        return changed

    def drop(self, name: str) -> List[str]:
        """A handle was removed; gives the names of all that may be shown or hidden by that."""
        function = self._functions.pop(name, None)
        if function is None:
            return [name]
        ranks = self._ranks[function]
        del ranks[name]
        if not ranks:
            del self._ranks[function]
        return [name, *ranks]


def _function_of(handle: Handle) -> Optional[Function]:
    """The function that gives a position; None where it has no source, or is not affine in its sources."""
    position = handle.position
    if position is None or not any(map(has_source, position)):
        return None
    function: List[Any] = [handle.frame]
    for value in position:
        terms = values.affine(value)
        if terms is None:
            return None
        offset = float(value) - sum(slope * present for _, present, slope in terms)
        function.append((round(offset, DIGITS), *((source, round(slope, DIGITS)) for source, _, slope in terms)))
    return tuple(function)
