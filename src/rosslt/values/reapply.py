"""Applying what was done to a value once more, to other source values, without losing its provenance."""

from typing import Any, Dict

from .graph import Graph, tracked_leaves
from .operations import AFFINE, SOURCE
from .sources import Source
from .tracked import TRACKED, apply, make
from .tree import rebuilt


def reapply(x: Any, changes: Dict[Source, Any]) -> Any:
    """As `evaluate`, but tracked: what `x` would have been had its sources had other values (paper, IV.A).

    Args:
        x: a tracked value, or a message, list or dict holding such; it is not changed.
        changes: `{Source: value}`; sources that are missing keep their values.

    Returns:
        The tracked value, or a copy of the message, list or dict holding tracked values.

    Raises:
        ArithmeticError, ValueError, TypeError: as the operations themselves do for such values.
    """
    graph = Graph(tracked_leaves(x))
    values = graph.values(changes)
    made: Dict[int, Any] = {}
    for place, (node, (form, first, second)) in enumerate(zip(graph.nodes, graph.records)):
        value = values[place]
        if form is SOURCE:
            again = make(value, (SOURCE, first, None), 1)
        elif form is AFFINE:
            terms = tuple([(made[id(leaf)], slope) for leaf, slope in first])
            again = make(value, (AFFINE, terms, second), len(terms) + 1)
        elif form.position == 1:
            again = apply(form.operation, second, made[id(first)])
        else:
            again = apply(form.operation, made[id(first)], second if form.single_operand else made[id(second)])
        made[id(node)] = again
    return rebuilt(x, lambda leaf: made[id(leaf)] if type(leaf) in TRACKED else leaf)
