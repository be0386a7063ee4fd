"""Limits the work of a solve, and evaluates expressions within that limit.

Work is counted, not timed, so that the same question has the same answer on every machine. A unit is one operation
of the expression evaluated once, 0.2 to 0.4 microseconds; the derivative of one costs several.
"""

from typing import Dict, Iterable, List, Mapping, Optional

from ..accelerator import CORE
from ..annotations import Value
from ..graph import UNDEFINED, Graph
from ..operations.inverses import NoPreimage
from ..operations.table import MOST_BITS
from ..sources import Source

WORK = 450_000
"""The work that may be done in an expression of ordinary size: 150 milliseconds ..."""

WORK_PER_NODE = 400
"""... and for each node besides, as a long chain may need many evaluations."""

RESTARTS_PER_NODE = 2_000
"""The work of restarts for each node, of some ten descents; it is at most that of the search near by."""

FASTER = 5
"""How many times as much work is done in the same time if the compiled core does it, as measured for arms."""

WORK_OF_A_SLOPE = 3
"""The work of a node's slopes, in evaluations of that node."""


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
    def of(cls, graph: Graph) -> 'Budget':
        """The budget for solving for results of a graph."""
        return cls(WORK + WORK_PER_NODE * len(graph.nodes))

    @classmethod
    def of_restarts(cls, graph: Graph) -> 'Budget':
        """The budget for starting again from other values."""
        return cls(min(RESTARTS_PER_NODE * len(graph.nodes), cls.of(graph).left))

    def share(self, part: float) -> 'Budget':
        """Take a part out of the budget; `refund` gives back the work that was not needed."""
        work = self.left * part
        self.left -= work
        return Budget(work)

    def refund(self, rest: 'Budget') -> None:
        """Take back what a share has left."""
        self.left += max(rest.left, 0)
        rest.left = 0

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
    """

    def __init__(
        self, graph: Graph, changing: Iterable[Source], roots: List[int], base: List[Value], budget: Budget
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
        self._most_bits = MOST_BITS if int in map(type, base) else 0
        self.work = len(steps) + len(base) // 16 + 10
        self.tape = None if CORE is None else CORE.tape(steps, graph.records, base)
        budget.spend(len(base))

    def operands(self) -> Dict[int, tuple]:
        """The operands of the nodes that may change, as `partials` gives them, with 0 for each slope; for a tape."""
        return {
            place: ((first, 0),) if second is None else ((first, 0), (second, 0))
            for place, _, first, second, _ in self.steps
        }

    def values(self, changes: Mapping[Source, Value]) -> List[Value]:
        """The values of all nodes for other source values.

        Raises:
            Exhausted: the budget is spent.
            ArithmeticError, ValueError, TypeError: an operation is not defined there.
        """
        self.budget.spend(self.work)
        values = list(self.base)
        if self.tape is None or not all(type(value) is float for value in changes.values()):
            self.graph.run(self.steps, values, changes, self._most_bits)
            return values
        for source, value in changes.items():
            for place in self.graph.occurrences.get(source, ()):
                values[place] = value
        CORE.run_tape(self.tape, values)
        return values

    def tried(self, changes: Mapping[Source, Value]) -> Optional[List[Value]]:
        """`values`, None if an operation is not defined there."""
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
