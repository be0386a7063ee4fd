"""Periods: by how much a source can be turned without a difference, so that no joint makes turns that nobody needs."""

import math
from typing import Any, Dict, Iterator, List, Set

from ..annotations import Value
from ..operations.table import COS, FMOD, IEEE_REMAINDER, REMAINDER, SIN, TAN
from ..sources import Source
from .budget import Trial

TURN = 2 * math.pi
OF_ANGLES = {SIN: TURN, COS: TURN, TAN: math.pi}
REMAINDERS = (REMAINDER, FMOD, IEEE_REMAINDER)


class Periods:
    """The operations with a period in some expressions.

    Args:
        trial: the expressions, and which of their nodes may change.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        records = trial.graph.records
        self._places = [step[0] for step in trial.steps if _has_period(records[step[0]][0])]

    def __bool__(self) -> bool:
        """Return True if the expressions contain any periodic operations."""
        return bool(self._places)

    def of(self, sources: List[Source], values: List[Value]) -> Iterator[List[float]]:
        """The periods that each source may have, the longest first; whether all results have them is not checked.

        Args:
            sources: the sources that may change.
            values: the value of each node.

        Raises:
            Exhausted: the budget of the trial is spent.
        """
        partials = self._trial.partials(values)
        for source in sources:
            self._trial.budget.spend(len(partials))
            yield self._longest_first(values, self._trial.graph.tangent(source, partials))

    def _longest_first(self, values: List[Value], rise: Dict[int, Value]) -> List[float]:
        graph = self._trial.graph
        found: Set[float] = set()
        for place in self._places:
            form, first, second = graph.records[place]
            slope = rise.get(graph.index[id(first)]) if place in rise else None
            if not slope:
                continue
            if form.operation in OF_ANGLES:
                period = OF_ANGLES[form.operation]
            else:
                period = second if form.single_operand else values[graph.index[id(second)]]
            try:
                found.add(float('%.14g' % abs(period / slope)))
                found.add(2 * float('%.14g' % abs(period / slope)))
            except (ArithmeticError, ValueError):
                continue
        return [period for period in sorted(found, reverse=True) if 0 < period < math.inf]


def _has_period(form: Any) -> bool:
    operation = form.operation
    return operation in OF_ANGLES or (operation in REMAINDERS and form.position != 1)


def turns_too_many(present: float, found: float, period: float) -> int:
    """Return the number of whole periods between a source's present value and the answer."""
    ratio = (found - present) / period
    return round(ratio) if math.isfinite(ratio) else 0
