"""Limits the work of a solve, and evaluates expressions within that limit.

Work is counted, not timed, so that the same question has the same answer on every machine. A unit is one operation
of the expression evaluated once, 0.2 to 0.4 microseconds; the derivative of one costs several.
"""

import contextlib
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional

from ..annotations import Value
from ..graph import Graph
from ..operations.inverses import NoPreimage
from ..operations.table import POWER
from ..sources import Source

WORK_OF_A_RESULT = 150_000
"""The work that may be done for each result that is wanted: 40 milliseconds ..."""

MOST_WORK_OF_RESULTS = 300_000
"""... and for all of them, in expressions of ordinary size."""

WORK_PER_NODE = 40
"""The additional work for each node of a large expression ..."""

WORK_PER_NODE_ALONE = 400
"""... and for each node of one result alone, as a long chain may need many evaluations."""

WORK_OF_A_CALL = 12
"""The work of an evaluation besides its operations."""

WORK_OF_A_SLOPE = 3
"""The work of a node's slopes, in evaluations of that node."""

MOST_BITS = 2**14
"""While an answer is looked for, longer whole numbers are refused: repeated squaring would fill the memory."""

UNDEFINED = (ArithmeticError, ValueError, TypeError)
"""Exceptions of undefined arithmetic: a result that is not real or not finite, or unsuitable operands."""


class Exhausted(NoPreimage):
    """The budget is spent."""


class Budget:
    """The work that may still be done.

    Args:
        work: in units, see above.
    """

    def __init__(self, work: float) -> None:
        self.left = work

    @classmethod
    def of(cls, graph: Graph, results: int = 1) -> 'Budget':
        """The budget for solving for so many results of a graph."""
        work = min(WORK_OF_A_RESULT * results, MOST_WORK_OF_RESULTS)
        return cls(work + (WORK_PER_NODE + WORK_PER_NODE_ALONE / results) * len(graph.nodes))

    def share(self, part: float) -> 'Budget':
        """A part of what is left, taken out of it; give back with `refund` what of it was not needed."""
        work = self.left * part
        self.left -= work
        return Budget(work)

    def refund(self, rest: 'Budget') -> None:
        """Take back what a share has left."""
        self.left += max(rest.left, 0)
        rest.left = 0

    @contextlib.contextmanager
    def part_of(self, trial: 'Trial', part: float) -> Iterator[None]:
        """Let a trial spend no more than a part of what is left."""
        share = self.share(part)
        trial.budget = share
        try:
            yield
        finally:
            trial.budget = self
            self.refund(share)

    def spend(self, work: float) -> None:
        """Do work.

        Raises:
            Exhausted: there is not that much left.
        """
        self.left -= work
        if self.left < 0:
            raise Exhausted('it was given up, as the search took too long')


class Trial:
    """A graph's nodes as functions of some sources, evaluated within a budget.

    Args:
        graph: holds the expressions.
        changing: the sources that may change.
        roots: the indices of the wanted nodes.
        base: the values of the nodes while nothing changes.
        budget: the work that it may take.
        wanted: the results that are wanted, which may be long whole numbers themselves.
    """

    def __init__(
        self,
        graph: Graph,
        changing: Iterable[Source],
        roots: List[int],
        base: List[Value],
        budget: Budget,
        wanted: Iterable[Value] = (),
    ) -> None:
        self.graph = graph
        self.base = base
        self.depends = graph.depending(changing)
        self.budget = budget
        last = max(roots)
        steps = graph.steps(self.depends)
        if last < len(base) - 1:
            steps = [step for step in steps if step[0] <= last]
        self.steps = steps
        whole = [value.bit_length() for value in base if type(value) is int]
        whole += [value.bit_length() for value in wanted if type(value) is int] if whole else []
        self._most_bits = max([MOST_BITS] + [2 * bits for bits in whole]) if whole else 0
        self._safe_steps = _with_small_powers(graph, steps, self._most_bits) if whole else steps
        self.work = WORK_OF_A_CALL + len(steps) + len(base) // 16

    def values(self, changes: Mapping[Source, Value]) -> List[Value]:
        """The values of all nodes for other source values.

        Raises:
            Exhausted: the budget is spent.
            ArithmeticError, ValueError, TypeError: an operation is not defined there.
        """
        self.budget.spend(self.work)
        values = list(self.base)
        self.graph.run(self._safe_steps, values, changes, self._most_bits)
        return values

    def tried(self, changes: Mapping[Source, Value]) -> Optional[List[Value]]:
        """`values`, None where an operation is not defined there."""
        try:
            return self.values(changes)
        except Exhausted:
            raise
        except UNDEFINED:
            return None

    def partials(self, values: List[Value]) -> Dict[int, tuple]:
        """The slopes of all nodes that may change for their operands, at such values."""
        self.budget.spend(self.work * WORK_OF_A_SLOPE)
        return self.graph.partials(self.steps, values)


def _with_small_powers(graph: Graph, steps: List[tuple], most_bits: int) -> List[tuple]:
    """The steps, with powers of whole numbers refused before they are computed where they are too long."""
    capped = []
    for place, forward, first, second, constant in steps:
        form = graph.records[place][0]
        if form.operation is POWER:
            forward = _capped(forward, form.position == 1, most_bits)
        capped.append((place, forward, first, second, constant))
    return capped


def _capped(forward: Any, swapped: bool, most_bits: int) -> Any:
    def small(x: Value, y: Value) -> Value:
        base, exponent = (y, x) if swapped else (x, y)
        are_whole = isinstance(base, int) and isinstance(exponent, int) and base not in (0, 1, -1)
        if are_whole and base.bit_length() * exponent > 2 * most_bits:
            raise OverflowError('a power of too many digits')
        return forward(x, y)

    return small
