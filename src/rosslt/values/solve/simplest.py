"""Source values that people would write: 0.5, where a search came to 0.49999999999999983."""

from typing import Any, Callable, Dict, List, Tuple

from ..graph import Graph
from ..sources import Source
from .budget import UNDEFINED
from .equations import Goal, missed

DIGITS = 13
"""The significant digits that are tried. The roundings of a search of some dozens of steps change those behind."""


def simplest(
    graph: Graph,
    goals: List[Goal],
    found: Dict[Source, Any],
    values: List[Any],
    limits: Callable[[Source], Tuple[Any, Any]],
) -> Dict[Source, Any]:
    """Round the float source values of an answer, where the results come as near to what is wanted.

    Args:
        graph: the graph of the goals.
        goals: with the wanted results.
        found: source values that meet the goals.
        values: the values of the graph's nodes for them.
        limits: gives the lowest and the highest value of a source.

    Returns:
        The rounded source values, or `found` where these are nearer, or the rounded ones do not meet the goals.
    """
    rounded = {source: _rounded(value, *limits(source)) for source, value in found.items()}
    if rounded == found:
        return found
    try:
        rounded_values = graph.values(rounded)
        is_as_near = _error(graph, goals, rounded_values) <= _error(graph, goals, values)
    except UNDEFINED:
        return found
    # The largest error may be that of a large result, while a small one is no longer what was wanted.
    return rounded if is_as_near and missed(graph, goals, rounded_values) is None else found


def _rounded(value: Any, low: Any, high: Any) -> Any:
    short = float('%.*g' % (DIGITS, value)) if type(value) is float else value
    return short if low <= short <= high else value


def _error(graph: Graph, goals: List[Goal], values: List[Any]) -> float:
    """The largest distance of a result from what is wanted."""
    return max(abs(values[graph.index[id(value)]] - wanted) for _, value, wanted in goals)
