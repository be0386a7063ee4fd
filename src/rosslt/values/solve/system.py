"""Several sources at once: near by first, then from other values in a fixed order.

Of all source values that give the results, those nearest the present ones are taken (Euclidean, in the scales of the
sources): dragging the tip of an arm, of which only the forward kinematics is known, turns its joints as little as
it can.
"""

import contextlib
import itertools
import math
import random
import sys
from typing import Callable, Iterator, List, Optional, Sequence

from ..annotations import Value
from ..graph import UNDEFINED
from ..sources import Source
from ..tolerances import RELATIVE, ROUNDING, ULPS, almost_meets, is_at
from .budget import FASTER, Exhausted
from .descent import ROUNDS, Descents
from .equations import Point
from .periods import turns_too_many

FOLLOWED_STEPS = 8
"""The number of steps in which the results are moved straight to their targets."""

MOST_EQUAL_MINIMA = 12
"""A target counts as out of reach once this many descents have ended equally far from it."""

FAR = 0.8
"""An unknown that turns an angle by more, in radians, is looked at for whole periods, and for a nearer answer ..."""

MOST_FURTHER = 8
"""... among as many more."""

FEW = 8
"""So many numbers are written short one by one, if they cannot be together: each takes an evaluation."""

DIGITS = 13
"""The significant digits that people may have meant. The roundings of a search change those behind."""


class System(Descents):
    """Solves several results of a graph for several numeric sources, exactly or as nearly as possible.

    Args:
        graph: holds the results.
        goals: `(path, tracked value, wanted value)` each.
        unknowns: the sources to change.
        freedom: the constraints on the unknowns (`freedom.Freedom`).
        budget: the work that solving may take.
        base: the values of the graph's nodes while nothing changes; the present ones by default.
    """

    def solution(self) -> Optional[Point]:
        """The unknowns' values that give all results, None if none were found."""
        answers = self._answers()
        best = next(answers, None)
        if best is None:
            return None
        if self._periods and max([abs(a - b) for a, b in zip(best, self.start)]) > FAR:
            best = min([best, *itertools.islice(answers, MOST_FURTHER)], key=self._way)
        return self.tidied(best)

    def restarted(self) -> Optional[Point]:
        """The first answer that descents from all over the bounds lead to, None if none was found.

        An unknown without bounds starts anywhere within half a period of its present value, if it is an angle. All
        results have the same weight, as they are far from their targets. Every third descent goes on where steps gain
        little, as some answers lie at the end of a flat valley.
        """
        if self._trial.tape is not None:
            self._budget.left *= FASTER
        unit = min([equation.unit for equation in self._equations])
        alike = [equation._replace(unit=unit) for equation in self._equations]
        minima: List[str] = []
        with contextlib.suppress(Exhausted):
            for start, is_to_end in zip(self._spread(), itertools.cycle((False, False, True))):
                end = self._descend(start, alike, is_to_end=is_to_end)
                if end is not None and self.accepts(end.x):
                    return self.tidied(self._nearer(self._unwound(end.x, self._polished)))
                minima.append(f'{end.size:.3g}' if end is not None else '')
                if minima.count(minima[-1]) >= MOST_EQUAL_MINIMA:
                    break
        return None

    def _spread(self) -> Iterator[Point]:
        """Points that fill the bounds evenly: multiples of the powers of the generalized golden ratio, each modulo 1
        (a Kronecker sequence). There are none if no unknown has bounds or a period."""
        values = self._tried(self.start)
        periods = list(self._periods.of(self._unknowns, values)) if values is not None and self._periods else []
        ranges = []
        for place, (start, (low, high)) in enumerate(zip(self.start, self._limits)):
            reach = periods[place][-1] / 2 if periods and periods[place] else 0.0
            ranges.append(
                (low, high) if math.isfinite(high - low) else (max(low, start - reach), min(high, start + reach))
            )
        if all(low == high for low, high in ranges):
            return
        ratio = 1.5
        for _ in range(sys.float_info.mant_dig):  # each round halves the error at least
            ratio = (1.0 + ratio) ** (1.0 / (len(ranges) + 1))
        for number in itertools.count(1):
            yield [
                low + (high - low) * ((0.5 + number * ratio ** -(place + 1)) % 1.0)
                for place, (low, high) in enumerate(ranges)
            ]

    def fewest(self) -> List[Source]:
        """Return as few unknowns as move the results in all ways that they can move at the present values: three for a
        point.

        Each is the one that moves the results most, in its scale, in a way that those before it do not (QR with column
        pivoting; Golub and Van Loan, Matrix Computations, section 5.4); of those that move them alike, the largest.

        Raises:
            ArithmeticError, ValueError, TypeError: the slopes are not defined there.
        """
        values = self._tried(self.start)
        if values is None:
            return []
        rows = self._jacobian(values, [equation._replace(unit=1.0) for equation in self._equations])
        columns = [[row.get(place, 0.0) * scale for row in rows] for place, scale in enumerate(self._scales)]
        lengths = [math.hypot(*column) for column in columns]
        found: List[int] = []
        least = RELATIVE * max(lengths)
        while len(found) < len(rows) and max(lengths) > least:
            alike = [place for place, length in enumerate(lengths) if length >= max(lengths) * (1.0 - RELATIVE)]
            found.append(max(alike, key=lambda place: abs(self.start[place])))
            along = [part / lengths[found[-1]] for part in columns[found[-1]]]
            for column in columns:
                shared = sum([part * way for part, way in zip(column, along)])
                column[:] = [part - shared * way for part, way in zip(column, along)]
            lengths = [0.0 if place in found else math.hypot(*column) for place, column in enumerate(columns)]
        return [self._unknowns[place] for place in sorted(found)]

    def _answers(self) -> Iterator[Point]:
        """Yield the answers that starts lead to, each moved as near to the present values as it can be."""
        # First, all results get the same weight: in the plane, this leads around the middle to the other side.
        unit = min([equation.unit for equation in self._equations])
        alike = [equation._replace(unit=unit) for equation in self._equations]
        starts = itertools.chain([self.start, self.start], self._scattered())
        minima: List[str] = []
        with contextlib.suppress(Exhausted):
            for start, equations in zip(starts, itertools.chain([alike], itertools.repeat(self._equations))):
                end = self._descend(start, equations)
                if end is not None and self.accepts(end.x):
                    yield self._nearer(self._unwound(end.x, self._polished))
                    continue
                minima.append(f'{end.size:.3g}' if end is not None else '')
                if minima.count(minima[-1]) >= MOST_EQUAL_MINIMA:
                    return

    def closest(self) -> Point:
        """The unknowns' values that bring the results nearest to their targets, in the results' own units.

        If the slopes at the present values lead nowhere, it is tried from beside them (a straight arm).
        """
        self._equations = [equation._replace(unit=1.0) for equation in self._equations]
        best, least = self.start, self._distance(self.start) * (1 - ROUNDING)
        try:
            for start in (self.start, *itertools.islice(self._scattered(), 2)):
                end = self._descend(start, self._equations, 4 * ROUNDS, True)
                if end is not None and end.size < least:
                    best = end.x
                    break
            best = self._unwound(best, self._as_close_as(best))
        except Exhausted:
            pass
        return best

    def _distance(self, x: Point) -> float:
        missing = self._missing(self._tried(x), self._equations)
        return math.inf if missing is None else math.hypot(*missing)

    def _as_close_as(self, x: Point) -> Callable[[Point], Optional[Point]]:
        """Return a filter: it returns a point that is as near to the targets as this one, and None for any other."""
        limit = self._distance(x) * (1 + ROUNDING) + ROUNDING * min(1.0, self._size)
        return lambda turned: turned if self._distance(turned) <= limit else None

    def _polished(self, turned: Point) -> Optional[Point]:
        """The answer at a point that was turned by a whole period, None if it has none."""
        end = self._descend(turned, self._equations, rounds=3)
        return end.x if end is not None and self.accepts(end.x) else None

    def accepts(self, x: Point) -> bool:
        """Return True if a point gives all wanted results."""
        values = self._tried(x)
        return values is not None and self._are_met(values, self._wanted)

    def _are_met(self, values: List[Value], wanted: Sequence[Value]) -> bool:
        return all(almost_meets(values[root], goal, self._size) for root, goal in zip(self._roots, wanted))

    def _scattered(self) -> Iterator[Point]:
        """Points around the present values, half of them anywhere within the bounds."""
        chance = random.Random(1)
        while True:
            for is_anywhere in (False, True):
                radius = math.tan(math.pi / 2 * chance.random())
                start = []
                for value, (low, high), scale in zip(self.start, self._limits, self._scales):
                    if is_anywhere and math.isfinite(high - low):
                        start.append(chance.uniform(low, high))
                    else:
                        reach = max(scale, abs(value)) * radius
                        start.append(min(max(value + chance.uniform(-reach, reach), low), high))
                yield start

    def _followed(self) -> Point:
        """Move the results to the wanted values in small steps; returns the unknowns at the end."""
        x: Point = self.start
        for number in range(1, FOLLOWED_STEPS):
            part = number / FOLLOWED_STEPS
            equations = [
                equation._replace(wanted=at + part * (equation.wanted - at))
                for at, equation in zip(self._present, self._equations)
            ]
            end = self._descend(x, equations, rounds=6)
            if end is None:
                break
            x = end.x
        return x

    def _unwound(self, x: Point, kept: Callable[[Point], Optional[Point]]) -> Point:
        """Move each unknown to within half a period of its present value, if the results stay as near.

        Args:
            x: the point.
            kept: returns the point to take for a point with one unknown turned back; None if that is worse.
        """
        far = [place for place, value in enumerate(x) if abs(value - self.start[place]) > FAR]
        values = self._tried(x) if far and self._periods else None
        if values is None:
            return x
        for place, found in zip(far, self._periods.of([self._unknowns[place] for place in far], values)):
            for period in found:
                turns = turns_too_many(self.start[place], x[place], period)
                if not turns:
                    continue
                turned = list(x)
                turned[place] = self._clamped(place, x[place] - turns * period)
                if abs(turned[place] - self.start[place]) >= abs(x[place] - self.start[place]):
                    continue
                end = kept(turned)
                if end is not None and self._way(end) < self._way(x):
                    x = end
        return x

    def _nearer(self, x: Point) -> Point:
        """The solution nearest the start, from one that is near: each round steps from the start itself, along the
        slopes at the solution so far."""
        if len(self._unknowns) <= len(self._roots):
            return x
        try:
            for _ in range(ROUNDS):
                values = self._tried(x)
                missing = self._missing(values, self._equations)
                if values is None or missing is None:
                    break
                gone = [value - start for value, start in zip(x, self.start)]
                rows = self._jacobian(values, self._equations)
                needed = [
                    part + sum([slope * gone[place] for place, slope in row.items()])
                    for part, row in zip(missing, rows)
                ]
                step = self._step(self.start, rows, needed, 0.0)
                end = self._descend(
                    [self._clamped(place, start + part) for place, (start, part) in enumerate(zip(self.start, step))],
                    self._equations,
                )
                if end is None or not self.accepts(end.x) or self._way(end.x) >= self._way(x) * (1 - 1e-6):
                    break
                x = end.x
        except Exhausted:
            pass
        except UNDEFINED:
            pass
        return x

    def tidied(self, x: Point) -> Point:
        """The answer without rounding errors, as people would write it, as far as it stays an answer.

        An unknown that moved by a rounding error stays where it was, one that near to a bound or to 0 is put there, and
        0.49999999999999983 becomes 0.5.
        """
        way = self._way(x)
        tidy = []
        for value, start, scale, (low, high) in zip(x, self.start, self._scales, self._limits):
            if abs(value - start) <= ROUNDING * max(abs(start), way * scale):
                value = start
            elif is_at(value, low) or is_at(value, high):
                value = low if is_at(value, low) else high
            elif low <= 0.0 <= high and abs(value) <= ROUNDING * max(abs(start), scale):
                value = 0.0
            tidy.append(value)
        short = [
            value if value == start else self._clamped(place, float('%.*g' % (DIGITS, value)))
            for place, (value, start) in enumerate(zip(tidy, self.start))
        ]
        self._budget.left = math.inf  # looking at an answer is not part of the search for it
        limit = max(self._distance(x), ULPS)
        if self.accepts(short) and self._distance(short) <= limit:
            return short
        best = tidy if self.accepts(tidy) else x
        for place in range(min(len(x), FEW)):  # a turn of pi / 2 has no short number, and a radius beside it has
            ahead = [*best[:place], short[place], *best[place + 1 :]]
            if self.accepts(ahead) and self._distance(ahead) <= limit:
                best = ahead
        return best

    def _way(self, x: Point) -> float:
        return self._length([value - start for value, start in zip(x, self.start)])
