"""Periods: by how much a source can be turned without a difference, so that no joint makes turns that nobody needs."""

import math
from typing import Any, Dict, List, Set

from ..graph import Graph
from ..operations.table import COS, FMOD, IEEE_REMAINDER, REMAINDER, SIN, TAN

TURN = 2 * math.pi
OF_ANGLES = {SIN: TURN, COS: TURN, TAN: math.pi}
REMAINDERS = (REMAINDER, FMOD, IEEE_REMAINDER)
MOST = 8
"""The most periods that are tried for one source."""


def has_periods(graph: Graph) -> bool:
    """Whether there is an operation with a period in some expressions."""
    return any(form.operation in OF_ANGLES or form.operation in REMAINDERS for form, _, _ in graph.records)


def periods(graph: Graph, values: List[Any], rise: Dict[int, Any]) -> List[float]:
    """The periods that a source may have, the longest first; whether all results have them is left to be checked.

    Args:
        graph: holds the expressions.
        values: the value of each node.
        rise: the slope of each node for the source, as `Graph.tangent` gives it.
    """
    found: Set[float] = set()
    for place in rise:
        form, first, second = graph.records[place]
        slope = rise.get(graph.index.get(id(first), -1)) if form.operation is not None else None
        if not slope:
            continue
        if form.operation in OF_ANGLES:
            period = OF_ANGLES[form.operation]
        elif form.operation in REMAINDERS and form.position != 1:
            period = second if form.single_operand else values[graph.index[id(second)]]
        else:
            continue
        try:
            found.add(float('%.14g' % abs(period / slope)))
            found.add(2 * float('%.14g' % abs(period / slope)))
        except (ArithmeticError, ValueError):
            continue
    return [period for period in sorted(found, reverse=True) if 0 < period < math.inf][:MOST]


def turns_too_many(present: float, found: float, period: float) -> int:
    """How many whole periods lie between a source's present value and the one found."""
    ratio = (found - present) / period
    return round(ratio) if math.isfinite(ratio) else 0
