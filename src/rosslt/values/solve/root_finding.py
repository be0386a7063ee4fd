"""Numbers at which a function takes a wanted value, where the source appears too often for a formula.

Newton's method with the table's slopes, safeguarded: a step that makes things worse is halved, and where the slope
leads nowhere, the neighbourhood is searched outward for a change of sign, which is then halved down.
"""

import math
from fractions import Fraction
from typing import Any, Callable, Iterator, List, Optional, Tuple

from ..operations.inverses import refuse

STEPS = 80
HALVINGS = 30


class Search:
    """A search for x with `f(x) == wanted`.

    Args:
        f: the function; it may raise where it is not defined.
        slope: its derivative, 0 where there is none.
        wanted: the value to be met.
        meets: whether a value of f counts as the wanted one.
    """

    def __init__(
        self, f: Callable[[Any], Any], slope: Callable[[Any], Any], wanted: Any, meets: Callable[[Any], bool]
    ) -> None:
        self._f = f
        self._slope = slope
        self._wanted = wanted
        self._meets = meets
        self._closest: Tuple[float, Any] = (math.inf, None)

    def near(self, start: Any) -> Any:
        """The x found from a start, of the start's type.

        Raises:
            NoPreimage: none was found; it says how near the function came.
        """
        whole = isinstance(start, int)
        x = (self._whole_descent if whole else self._descent)(start)
        if self._met(x):
            return x
        for low, high in self._sign_changes(start, whole):
            x = (self._between_whole if whole else self._between)(low, high)
            if self._met(x):
                return x
        x = self._closest[1]
        if not whole and x is not None:
            x = self._descent(x)
            if self._met(x):
                return x
        return (
            refuse('it was found to come no nearer than %.7g', self._f(x))
            if x is not None
            else refuse('it is defined nowhere near')
        )

    def _missing(self, x: Any) -> Optional[Any]:
        """By how much f(x) is too large; None where f is not defined."""
        try:
            missing = self._f(x) - self._wanted
            if isinstance(missing, complex) or missing - missing != 0:
                return None
            if abs(missing) < self._closest[0]:
                self._closest = abs(missing), x
            return missing
        except (ArithmeticError, ValueError, TypeError):
            return None

    def _met(self, x: Any) -> bool:
        try:
            return self._meets(self._f(x))
        except (ArithmeticError, ValueError, TypeError):
            return False

    def _descent(self, x: float) -> float:
        missing = self._missing(x)
        for _ in range(STEPS):
            if not missing:
                break
            try:
                step = -missing / self._slope(x)
            except (ArithmeticError, ValueError, TypeError):
                break
            for _ in range(HALVINGS):
                left = self._missing(x + step)
                if left is not None and abs(left) < abs(missing):
                    break
                step /= 2
            else:
                break
            x, missing = x + step, left
        return x

    def _whole_descent(self, x: int) -> int:
        seen = set()
        for _ in range(STEPS * 4):
            missing = self._missing(x)
            seen.add(x)
            if not missing:
                break
            try:
                step = -round(Fraction(missing) / Fraction(self._slope(x)))
            except (ArithmeticError, ValueError, TypeError):
                break
            if x + step in seen:
                break
            x += step
        return x

    def _sign_changes(self, start: Any, whole: bool) -> Iterator[Tuple[Any, Any]]:
        """Pairs of numbers between which f passes the wanted value, the nearest to the start first."""
        steps: List[Any] = [1] if whole else [max(abs(start) * 1e-4, 1e-300) if start else 1e-4]
        fine = 1e8 * steps[0]
        far = (abs(start) + 1) * 2**70 if whole else 1e290
        while steps[-1] < far:
            growth = 2 if whole else 1.6 if steps[-1] < fine else 8.0 if steps[-1] < 1e9 else 1e6
            steps.append(steps[-1] * growth)
        missing = self._missing(start)
        ends = {1: (start, missing), -1: (start, missing)}
        for step in steps:
            for side in (1, -1):
                x = start + side * step
                missing = self._missing(x)
                before, was = ends[side]
                ends[side] = x, missing
                if missing is not None and was is not None and (missing > 0) != (was > 0):
                    yield (before, x) if was < missing else (x, before)

    def _between(self, low: float, high: float) -> float:
        """Where f passes the wanted value, between one x where it is below and another where it is above."""
        for _ in range(200):
            middle = low + (high - low) / 2
            missing = self._missing(middle)
            if missing is None or middle in (low, high):
                break
            low, high = (middle, high) if missing < 0 else (low, middle)
        found = low + (high - low) / 2
        return self._descent(found)

    def _between_whole(self, low: int, high: int) -> int:
        while abs(high - low) > 1:
            middle = (low + high) // 2
            missing = self._missing(middle)
            if missing is None:
                break
            low, high = (middle, high) if missing < 0 else (low, middle)
        return low if self._met(low) else high
