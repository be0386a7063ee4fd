"""Which sources change for a field: those that move it most for their size."""

import contextlib
from typing import Any, Collection, Dict, List, Mapping, Optional, Sequence, Tuple

from rosslt import values
from rosslt.values import Source


def solve_by_effect(
    part: Any, wanted: Any, sources: Optional[Collection[Source]], limits: Mapping[str, Any]
) -> Dict[Source, Any]:
    """Solve for a part of a message as `values.solve` does. For one number, the sources that move it most for their
    size are tried first: at rest an error of a controller is almost 0, and its gain would have to be huge. For several,
    as many change as suffice, as in a drag. As there, what rounding has done to the numbers is taken off.

    Args:
        part, wanted, sources: as those of a Forcing.
        limits: as of `Directory.limits`.
    """
    leaves, targets = moved(part, wanted)
    if len(leaves) > 1:
        with contextlib.suppress(values.NotInvertible):
            return values.continued(leaves, targets, values.source_values(leaves), sources=sources, **limits)
    if len(leaves) == 1:
        effects = effects_of(leaves, limits)
        least = min(filter(None, effects.values()), default=1.0)
        limits = {**limits, 'weights': {source: 1.0 / (effect or least) for source, effect in effects.items()}}
        return values.continued(leaves, targets, {}, sources=sources, **limits)
    return values.solve(part, wanted, sources=sources, **limits)


def moved(part: Any, wanted: Any) -> Tuple[List[Any], List[Any]]:
    """The tracked leaves of a part of a message that are to have a value, and these values."""
    targets = dict(values.leaves(wanted))
    found = [(leaf, targets.get(path)) for path, leaf in values.leaves(part) if values.is_tracked(leaf)]
    return [leaf for leaf, target in found if target is not None], [target for _, target in found if target is not None]


def effects_of(leaves: Sequence[Any], limits: Mapping[str, Any]) -> Dict[Source, float]:
    """By how much each source moves, for its size, the one of several numbers that it moves most."""
    found: Dict[Source, float] = {}
    for leaf in leaves:
        if isinstance(leaf, (int, float)):
            of_one = values.effects(leaf, bounds=limits['bounds'], weights=limits.get('weights'))
            found.update({source: max(effect, found.get(source, 0.0)) for source, effect in of_one.items()})
    return found
