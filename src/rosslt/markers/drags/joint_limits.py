"""The limits of numbers that a drag moves on the way, as of the joints before a link that is pulled."""

import math
from typing import Any, Dict, Mapping, Sequence, Tuple

from rosslt import values
from rosslt.markers.scene.handle import Limited

Bounds = Mapping[values.Source, Tuple[Any, Any]]


def narrowed(bounds: Bounds, limited: Sequence[Limited]) -> Dict[values.Source, Tuple[Any, Any]]:
    """The bounds of sources, narrowed by the limits of numbers that are affine in one of them.

    A number that is beyond its limits already may stay there.

    Args:
        bounds: {Source: (minimum, maximum)}, None for none.
        limited: the numbers.
    """
    found = dict(bounds)
    for number in limited:
        terms = values.affine(number.value)
        if not terms or len(terms) > 1 or terms[0][2] == 0:
            continue
        ((source, present, slope),) = terms
        ends = [present + (limit - float(number.value)) / slope for limit in (number.lower, number.upper)]
        lowest, highest = min(*ends, present), max(*ends, present)
        minimum, maximum = found.get(source, (None, None))
        lowest = lowest if minimum is None else max(lowest, minimum)
        highest = highest if maximum is None else min(highest, maximum)
        found[source] = (lowest if math.isfinite(lowest) else None, highest if math.isfinite(highest) else None)
    return found


def check(limited: Sequence[Limited], after: Mapping[values.Source, Any]) -> None:
    """Check that new values of sources bring no number beyond its limits, or further beyond them.

    Raises:
        values.NotInvertible: they bring one there.
    """
    for number in limited:
        before, now = float(number.value), float(values.evaluate(number.value, after))
        kept = min(max(now, min(number.lower, before)), max(number.upper, before))
        if not values.is_same(kept, now):
            which, limit = ('maximum', number.upper) if kept < now else ('minimum', number.lower)
            raise values.NotInvertible(f'{number.name} would come to {now:.4g}, beyond its {which} {limit!r}')
