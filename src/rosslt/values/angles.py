"""Angles in expressions: numbers that are in degrees, or of which a sine, cosine or tangent is taken."""

import math
from typing import Iterable, List, Optional, Tuple

from .annotations import Value
from .graph import Graph
from .operations import SOURCE
from .operations import table as ops
from .sources import Source
from .tolerances import is_rounded
from .tracked import TRACKED, resolve

_WAVES = (ops.SIN, ops.COS, ops.TAN)
_DEGREE = math.radians(1.0)


def sources_of_angles(xs: Iterable[Value]) -> List[Source]:
    """The sources that are angles if values were computed from them, each once.

    A number is an angle if it is converted from degrees to radians, or if its sine, cosine or tangent is taken,
    also after it was multiplied by plain numbers. A count is not an angle, though a circle may be divided by it.

    Args:
        xs: tracked or plain scalars.
    """
    graph = Graph(x for x in xs if type(x) in TRACKED)
    found = []
    for node, (form, first, _) in zip(graph.nodes, graph.records):
        if form.single_operand:
            is_wave = form.operation in _WAVES
            source, factor = _multiple(first if is_wave else node)
            if source is not None and (is_wave or is_rounded(abs(factor), _DEGREE)):
                found.append(source)
    return list(dict.fromkeys(found))


def _multiple(value: Value) -> Tuple[Optional[Source], float]:
    """The source that a value is a multiple of, and by which factor; no source if it is not such a multiple."""
    factor = 1.0
    form, first, second = resolve(value)
    while form.single_operand and _multiplies(form, second):
        factor *= form.slope(first, second)
        form, first, second = resolve(first)
    return (first if form is SOURCE else None), factor


def _multiplies(form: Value, second: Value) -> bool:
    """Return whether a record with a single operand is that operand times a plain number."""
    if form.operation in (ops.ADD, ops.SUBTRACT):
        return form is not ops.SUBTRACT.right and bool(second == 0)
    return form.operation in (ops.MULTIPLY, ops.NEGATE, ops.RADIANS, ops.DEGREES) or form is ops.DIVIDE.left
