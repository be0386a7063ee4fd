"""Numbers at which a function takes a wanted value, where the source appears too often for a formula.

Newton's method with the table's slopes, safeguarded: a step that makes things worse is halved. If it does not converge,
the neighbourhood is searched outward: an answer lies between two points where the function is too small and too large,
and may lie near a point where the function comes nearest to the wanted value. Of several answers, the one nearest to
the start is taken.
"""

import math
from typing import Callable, Iterator, List, Optional, Tuple

from ..annotations import Value
from ..graph import UNDEFINED
from ..operations.inverses import refuse
from .budget import Exhausted

STEPS = 60
HALVINGS = 20
LONG_STEPS = 8
"""Newton's steps may grow to so many times the size of where they start before they count as lost."""

Real = Callable[[Value], Value]
Sample = Tuple[Value, Optional[Value]]


class Search:
    """A search for x with `f(x) == wanted`.

    Args:
        f: the function; it may raise where it is not defined.
        slope: its derivative, 0 where there is none.
        wanted: the value to be met.
        meets: returns True if a value of f counts as the wanted one.
        low, high: the smallest and the largest x to try; infinite for no limit.
    """

    def __init__(
        self,
        f: Real,
        slope: Real,
        wanted: Value,
        meets: Callable[[Value], bool],
        low: float = -math.inf,
        high: float = math.inf,
    ) -> None:
        self._f = f
        self._slope = slope
        self._wanted = wanted
        self._meets = meets
        self._low = low
        self._high = high
        self._closest: Tuple[Value, Value] = (math.inf, None)

    def near(self, start: Value) -> Value:
        """The x found from a start, of the start's type.

        Raises:
            NoPreimage: none was found; it says how near the function came.
        """
        start = min(max(start, self._low), self._high)
        if isinstance(start, int):
            return self._whole(start)
        try:
            found = self.descend(start)
            if self.is_met(found):
                return self.nearer(start, found)
            for x in self._scanned(start):
                if self.is_met(x):
                    return x
        except Exhausted as error:
            return self._refused(str(error))
        return self._refused('')

    def _refused(self, reason: str) -> Value:
        """Say how near the function came to the wanted value."""
        missing, x = self._closest
        if x is None:
            return refuse(reason or 'it is defined nowhere near')
        nearest = 'it was found to come no nearer than %.7g' % (self._wanted + missing)
        return refuse('%s', '%s; %s' % (nearest, reason) if reason else nearest)

    def missing(self, x: Value) -> Optional[Value]:
        """By how much f(x) is too large; None where f is not defined."""
        try:
            missing = self._f(x) - self._wanted
            if isinstance(missing, complex) or missing - missing != 0:
                return None
            if abs(missing) < abs(self._closest[0]):
                self._closest = missing, x
            return missing
        except Exhausted:
            raise
        except UNDEFINED:
            return None

    def is_met(self, x: Value) -> bool:
        """Return True if f(x) counts as the wanted value, and x is finite and within the limits."""
        if x is None or x - x != 0 or not self._low <= x <= self._high:
            return False
        try:
            return self._meets(self._f(x))
        except Exhausted:
            raise
        except UNDEFINED:
            return False

    def descend(self, x: float, steps: int = STEPS) -> float:
        """Run Newton's method from x; a step that does not bring f nearer is halved."""
        missing = self.missing(x)
        longest = LONG_STEPS * max(1.0, abs(x))
        slow = 0
        for _ in range(steps):
            if not missing or slow > 3:
                break
            try:
                step = float(-missing / self._slope(x))
            except Exhausted:
                raise
            except UNDEFINED:
                break
            if not math.isfinite(step):
                break
            straight = self._clamped(x + step)
            left = self.missing(straight)
            if left is not None and abs(left) <= 1e-3 * abs(missing):
                # f is nearly a line here: the step may be long.
                x, missing = straight, left
                continue
            step = math.copysign(min(abs(step), longest), step)
            for _ in range(HALVINGS):
                ahead = self._clamped(x + step)
                left = self.missing(ahead)
                if left is not None and abs(left) < abs(missing):
                    break
                step /= 2
            else:
                break
            if ahead == x:
                break
            slow = slow + 1 if abs(left) > 0.99 * abs(missing) else 0
            x, missing = ahead, left
            longest *= 2
        return x

    def _clamped(self, x: float) -> float:
        return min(max(x, self._low), self._high)

    def nearer(self, start: float, found: float) -> float:
        """An answer between the start and one that was found, on either side, that one where there is none."""
        way = abs(found - start)
        if not way > 0.05 * max(1.0, abs(start)):
            return found
        try:
            for x in self._crossings(start, [way * part / 16 for part in range(1, 16)]):
                if self.is_met(x) and abs(x - start) < way:
                    return x
        except Exhausted:
            pass
        return found

    def _scanned(self, start: float) -> Iterator[float]:
        """Scan outward from the start, over all magnitudes, then between the bounds; yields candidate answers."""
        size = max(abs(start), 1e-3)
        fine = [0.02 * (1.05**n) for n in range(24)]
        ways = [size * 10.0**n for n in range(-6, -1)] + fine + [fine[-1] + 0.05 * n for n in range(1, 120)]
        ways += [6.5 * 1.12**n for n in range(1, 60)] + [6000.0 * 2.0**n for n in range(60)]
        for span in (1.0, size):
            if (span < 1 and size > 0.1) or span > 1e3:
                continue
            yield from self._crossings(start, [way * span for way in ways])
        yield from self._crossings(0.0, [10.0**n for n in range(-300, -6, 12)] + [10.0**n for n in range(-6, 300, 12)])
        if math.isfinite(self._low) and math.isfinite(self._high):
            part = (self._high - self._low) / 200
            yield from self._crossings(self._low, [part * n for n in range(1, 201)])
        best = self._closest[1]
        if best is not None:
            yield self.descend(best)

    def _crossings(self, start: float, ways: List[float]) -> Iterator[float]:
        """Answers outward from a start: where f passes the wanted value, and where it comes near and turns back."""
        first = self.missing(start)
        lines: List[List[Sample]] = [[(start, first)], [(start, first)]]
        turns: List[Tuple[float, float]] = []
        for way in ways:
            for side, line in zip((1, -1), lines):
                x = start + side * way
                if not self._low <= x <= self._high:
                    bound = self._clamped(x)
                    if line[-1][0] == bound:
                        continue
                    x = bound
                missing = self.missing(x)
                before, was = line[-1]
                line.append((x, missing))
                if missing is not None and was is not None:
                    if (missing > 0) != (was > 0):
                        yield self.between(before, x) if was < missing else self.between(x, before)
                    elif len(line) > 2 and line[-3][1] is not None and abs(was) <= min(abs(missing), abs(line[-3][1])):
                        turns.append((abs(was), before))
        for _, x in sorted(turns)[:6]:
            yield self.descend(x, STEPS // 2)

    def between(self, low: float, high: float) -> float:
        """Bisect between an x where f is below the wanted value and one where it is above."""
        largest = max([abs(missing) for missing in (self.missing(low), self.missing(high)) if missing is not None])
        is_polished = False
        for _ in range(120):
            middle = low + (high - low) / 2
            missing = self.missing(middle)
            if not missing or middle in (low, high):
                return middle
            if abs(missing) > 2 * largest and abs(high - low) <= 1e-3 * abs(middle):
                return middle  # f changes its sign at a pole here, not at an answer
            low, high = (middle, high) if missing < 0 else (low, middle)
            if not is_polished and abs(high - low) <= 1e-3 * abs(middle):
                is_polished = True
                polished = self.descend(middle, 8)
                if min(low, high) <= polished <= max(low, high) and self.is_met(polished):
                    return polished
        return self.descend(low + (high - low) / 2, 8)

    def _whole(self, start: int) -> int:
        """Find the whole number near the start at which f takes the wanted value."""
        try:
            x = self.descend_whole(start)
            if self.is_met(x):
                return x
            for low, high in self._whole_sign_changes(start):
                x = self._between_whole(low, high)
                if self.is_met(x):
                    return x
        except Exhausted as error:
            return self._refused(str(error))
        return self._refused('')

    def descend_whole(self, x: int) -> int:
        """Run Newton's method over whole numbers: each step is rounded."""
        seen = set()
        for _ in range(STEPS * 4):
            missing = self.missing(x)
            seen.add(x)
            if not missing:
                break
            try:
                step = -_rounded_quotient(missing, self._slope(x))
            except Exhausted:
                raise
            except UNDEFINED:
                break
            if x + step in seen or not self._low <= x + step <= self._high:
                break
            x += step
        return x

    def _whole_sign_changes(self, start: int) -> Iterator[Tuple[int, int]]:
        """Pairs of numbers between which f passes the wanted value, the nearest to the start first."""
        missing = self.missing(start)
        ends = {1: (start, missing), -1: (start, missing)}
        steps = list(range(1, 41)) + [40 * 2**n for n in range(1, 70 + abs(start).bit_length())]
        for step in steps:
            for side in (1, -1):
                x = start + side * step
                if not self._low <= x <= self._high:
                    continue
                missing = self.missing(x)
                before, was = ends[side]
                ends[side] = x, missing
                if (missing is not None and was is not None and (missing >= 0) != (was >= 0)) or missing == 0:
                    yield (before, x) if missing == 0 or was < missing else (x, before)

    def _between_whole(self, low: int, high: int) -> int:
        while abs(high - low) > 1:
            if self.missing(high) == 0:
                return high
            middle = (low + high) // 2
            missing = self.missing(middle)
            if missing is None:
                break
            low, high = (middle, high) if missing < 0 else (low, middle)
        return low if self.is_met(low) else high


def _rounded_quotient(a: Value, b: Value) -> int:
    """`a / b` to the nearest whole number, exactly for whole numbers."""
    if isinstance(a, int) and isinstance(b, int):
        return (2 * a + b) // (2 * b)
    return round(a / b)
