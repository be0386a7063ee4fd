"""Numbers at which a function takes a wanted value, if the source appears too often for a formula.

Newton's method with the table's slopes, safeguarded: a step that makes things worse is halved. If it does not converge,
it is searched outward: an answer lies between two points where the function is too small and too large.
"""

import math
from typing import Callable, Dict, Iterator, List, Optional, Tuple

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
        f: the function; it may raise if it is not defined.
        slope: its derivative, 0 if there is none.
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
                return found
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
        """By how much f(x) is too large; None if f is not defined."""
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

    def _scanned(self, start: float) -> Iterator[float]:
        """Scan outward from the start, over all magnitudes, then between the bounds; yields candidate answers."""
        yield from self._crossings(start, [max(abs(start), 1.0) * 1.06**n for n in range(-100, 300)])
        if math.isfinite(self._low) and math.isfinite(self._high):
            yield from self._crossings(self._low, [(self._high - self._low) * n / 200 for n in range(1, 201)])
        if self._closest[1] is not None:
            yield self.descend(self._closest[1])

    def _crossings(self, start: float, ways: List[float]) -> Iterator[float]:
        """Answers outward from a start, on both sides, where f passes the wanted value."""
        ends: Dict[int, Sample] = dict.fromkeys((1, -1), (start, self.missing(start)))
        for way in ways:
            for side, (before, was) in ends.items():
                x = self._clamped(start + side * way)
                if x == before:
                    continue
                missing = self.missing(x)
                ends[side] = x, missing
                if missing is not None and was is not None and (missing > 0) != (was > 0):
                    yield self.between(before, x) if was < missing else self.between(x, before)

    def between(self, low: float, high: float) -> float:
        """Newton's method, else bisection, between an x where f is below the wanted value and one where it is above."""
        ends = sorted((low, high))
        found = self.descend(low + (high - low) / 2, 8)
        if ends[0] <= found <= ends[1] and self.is_met(found):
            return found
        while True:
            middle = low + (high - low) / 2
            missing = self.missing(middle)
            if not missing or middle in (low, high):
                return middle
            low, high = (middle, high) if missing < 0 else (low, middle)

    def _whole(self, start: int) -> int:
        """The whole number near the start at which f takes the wanted value: where it passes that, by bisection."""
        try:
            ends: Dict[int, Sample] = dict.fromkeys((1, -1), (start, self.missing(start)))
            if self.is_met(start):
                return start
            size = int(abs(start) + abs(self._wanted)).bit_length()
            for step in (*range(1, 41), *[40 * 2**n for n in range(1, 64 + size)]):
                for side, (before, was) in ends.items():
                    x = start + side * step
                    if not self._low <= x <= self._high:
                        continue
                    missing = self.missing(x)
                    ends[side] = x, missing
                    if missing is not None and was is not None and (missing >= 0) != (was >= 0):
                        x = self._between_whole(*((before, x) if was < missing else (x, before)))
                    if self.is_met(x):
                        return x
        except Exhausted as error:
            return self._refused(str(error))
        return self._refused('')

    def _between_whole(self, low: int, high: int) -> int:
        while abs(high - low) > 1:
            middle = (low + high) // 2
            missing = self.missing(middle)
            if missing is None:
                break
            low, high = (middle, high) if missing < 0 else (low, middle)
        return high if self.is_met(high) else low
