"""Slopes of results by sweeps over their expressions, with what never changes of them added up beforehand.

The slopes of an operation that is affine in what changes are constants. Where such operations follow each other, their
products and sums are made once (automatic differentiation calls this preaccumulation), so that each Jacobian passes
only the operations that bend: a sum of 500 sources is one node with 500 slopes.
"""

import bisect
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

from ..graph import Graph, slope_or_zero, slopes_or_zeros
from .budget import WORK_OF_A_SLOPE, Budget, Trial

Slopes = Tuple[Tuple[int, Any], ...]
"""`((place of an operand, slope), ...)`."""


class Sum(NamedTuple):
    """The slopes of a node that is affine in some others.

    Attributes:
        columns: for the unknowns that it is made of, by their columns.
        others: for other nodes.
    """

    columns: Dict[int, Any]
    others: Slopes


class Preaccumulated:
    """The slopes of a graph's nodes for some unknowns, row by row of a Jacobian.

    Args:
        graph: holds the expressions.
        trial: says which nodes may change, and what the values of the others are.
        columns: `{index of a node that is an unknown: its column}`.
        roots: the indices of the nodes whose slopes are wanted.
    """

    def __init__(self, graph: Graph, trial: Trial, columns: Dict[int, int], roots: List[int]) -> None:
        self._graph = graph
        self._trial = trial
        self._columns = columns
        self._bending: List[tuple] = []
        self._slopes: Dict[int, Slopes] = {}
        self._below: Dict[int, List[int]] = {}
        self._sums: Dict[int, Sum] = {}
        sums: Dict[int, Dict[int, Any]] = {root: {} for root in roots}
        only_user: Dict[int, Tuple[Dict[int, Any], Any]] = {}

        def keep(place: int) -> None:
            # A sum of its own: else each of its users would pass all that is below it.
            sums[place] = {}
            if place in only_user:
                terms, weight = only_user.pop(place)
                terms[place] = terms.get(place, 0) + weight

        # Users come before their operands, so that a node's users are known where it is reached.
        for step in reversed(trial.steps):
            place = step[0]
            slopes = self._constant_slopes(step)
            if slopes is None:
                if place in only_user:
                    keep(place)
                sums.pop(place, None)
                self._bending.append(step)
                _, forward, first, second, _ = step
                for operand in first if forward is None else (first,) if second is None else (first, second):
                    if operand not in sums:
                        keep(operand)
                continue
            if place in sums:
                terms, weight = sums[place], 1
            elif place in only_user:
                terms, weight = only_user.pop(place)
            else:
                continue  # Nothing that is asked for is made of it.
            for operand, slope in slopes:
                if operand in columns or operand in sums:
                    terms[operand] = terms.get(operand, 0) + weight * slope
                elif operand in only_user:
                    keep(operand)
                    terms[operand] = terms.get(operand, 0) + weight * slope
                else:
                    only_user[operand] = terms, weight * slope
        self._bending.reverse()
        self._bends = {step[0] for step in self._bending}
        for place, terms in sums.items():
            if terms:
                self._sums[place] = self._split(terms)

    def _constant_slopes(self, step: tuple) -> Optional[Slopes]:
        """The slopes of a node for its operands that may change where these are constants, else None."""
        place, forward, first, second, constant = step
        base, depends = self._trial.base, self._trial.depends
        record = self._graph.records[place]
        form = record[0]
        if forward is None:
            if not form.affine:
                return None
            slopes = slopes_or_zeros(record, [base[at] for at in first])
            return tuple([pair for pair in zip(first, slopes) if depends[pair[0]]])
        if second is None:
            return ((first, slope_or_zero(form.slope, base[first], constant)),) if form.affine else None
        changing = depends[first], depends[second]
        if not form.affine and (all(changing) or not form.is_affine(record[1], record[2], changing)):
            return None
        a, b = base[first], base[second]
        pairs = (first, slope_or_zero(form.slope[0], a, b)), (second, slope_or_zero(form.slope[1], a, b))
        return pairs if all(changing) else tuple([pair for pair in pairs if depends[pair[0]]])

    def _split(self, terms: Dict[int, Any]) -> Sum:
        columns = self._columns
        direct: Dict[int, Any] = {}
        for at, slope in terms.items():
            if at in columns:
                direct[columns[at]] = direct.get(columns[at], 0) + slope
        return Sum(direct, tuple([term for term in terms.items() if term[0] not in columns]))

    def _sum_of(self, root: int) -> Sum:
        """The sum of a node that was passed over."""
        steps = self._trial.steps
        terms: Dict[int, Any] = {}
        stack: List[Tuple[int, Any]] = [(root, 1)]
        while stack:
            place, weight = stack.pop()
            for operand, slope in self._constant_slopes(steps[bisect.bisect_left(steps, (place,))]) or ():
                if operand in self._columns or operand in self._sums or operand in self._bends:
                    terms[operand] = terms.get(operand, 0) + weight * slope
                else:
                    stack.append((operand, weight * slope))
        return self._split(terms)

    def move(self, values: List[Any], places: List[int], budget: Budget) -> None:
        """Take the slopes at other values of the nodes.

        Args:
            values: the value of each node.
            places: the indices of the nodes whose gradients are wanted.
            budget: the work that it may take.
        """
        depends = self._trial.depends
        for place in places:
            if depends[place] and not (place in self._sums or place in self._bends or place in self._columns):
                self._sums[place] = self._sum_of(place)
        budget.spend(WORK_OF_A_SLOPE * len(self._bending))
        self._slopes = self._graph.partials(self._bending, values)

    def gradient(self, root: int, budget: Budget) -> Dict[int, Any]:
        """The slopes of a node for the unknowns, by their columns, by one sweep backwards."""
        below = self._below.get(root)
        if below is None:
            below = self._below[root] = self._made_of(root)
        columns = self._columns
        row: Dict[int, Any] = {columns[root]: 1} if root in columns else {}
        weights: Dict[int, Any] = {root: 1}
        for place in below:
            weight = weights.pop(place, 0)
            if not weight:
                continue
            if place in self._sums:
                direct, others = self._sums[place]
                if row or weight != 1:
                    for column, slope in direct.items():
                        row[column] = row.get(column, 0) + weight * slope
                else:
                    row = dict(direct)
            else:
                others = self._slopes.get(place, ())
            for operand, slope in others:
                if not slope:
                    continue
                if operand in columns:
                    column = columns[operand]
                    row[column] = row.get(column, 0) + weight * slope
                else:
                    weights[operand] = weights.get(operand, 0) + weight * slope
        budget.spend(2 * len(below) + len(row))
        return row

    def _made_of(self, root: int) -> List[int]:
        """List the indices of a node and of the changing nodes below it, users before operands, without unknowns."""
        found = {root}
        stack = [root]
        while stack:
            place = stack.pop()
            others = self._sums[place].others if place in self._sums else self._slopes.get(place, ())
            for operand, _ in others:
                if operand not in found and operand not in self._columns:
                    found.add(operand)
                    stack.append(operand)
        return sorted(found, reverse=True)
