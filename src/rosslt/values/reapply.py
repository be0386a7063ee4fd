"""Evaluating an expression with other source values, keeping its provenance."""

from typing import Any, Dict, Mapping

from .graph import Graph, check_changes, tracked_leaves
from .recording import make, size_of
from .sources import Source
from .tracked import TRACKED
from .tree import rebuilt


def reapply(x: Any, changes: Mapping[Source, Any]) -> Any:
    """Evaluate `x` for other source values (paper, IV.A); the result is tracked, unlike that of `evaluate`.

    Args:
        x: a tracked value, or a message, list or dict holding such; it is not changed.
        changes: `{Source: value}`; sources that are missing keep their values.

    Returns:
        The tracked value, or a copy of the message, list or dict holding tracked values.

    Raises:
        TypeError: a key of `changes` is no Source, or as the operations themselves do.
        ArithmeticError, ValueError: as the operations themselves do for such values.
    """
    check_changes(changes)
    graph = Graph(tracked_leaves(x))
    made: Dict[int, Any] = {}
    for node, (form, first, second), value in zip(graph.nodes, graph.records, graph.values(changes)):
        operands = [made[id(operand)] for operand in form.operands(first, second)]
        if all(type(operand) in TRACKED for operand in operands):
            size = size_of(operands) if operands else 1
            made[id(node)] = make(value, form.with_operands(first, second, operands), size)
        else:
            made[id(node)] = value  # of an operand that is a complex number there
    return rebuilt(x, lambda leaf: made[id(leaf)] if type(leaf) in TRACKED else leaf)
