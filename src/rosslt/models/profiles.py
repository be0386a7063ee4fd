"""What one input does when it is changed alone, by several steps: the slope, its range, and the kind."""

from dataclasses import dataclass, field
from typing import Any, Dict, List, Tuple

import numpy as np

Array = Any  # numpy.ndarray
SMOOTH, KINKED, SATURATED = 'smooth', 'kinked', 'saturated'
STEPPED, DISCONTINUOUS, COUPLED, UNSETTLED = 'stepped', 'discontinuous', 'coupled', 'unsettled'

FLAT_AT = 0.53  # part of the room at which it is tried whether the output is flat there; steps seldom begin there

Described = Tuple[str, float, float, float, float, float, float]


@dataclass
class Profile:
    """The trials of one input.

    Attributes:
        deltas: for each step of the input, in its unit, how far all outputs moved (m,)
        fitted: the slope of an output, and its uncertainty, from trials in which others changed, too
        small: the step of differences; 0 if none was needed yet
        is_looked_at: whether trials were made to tell the kind
    """

    deltas: Dict[float, Array] = field(default_factory=dict)
    fitted: Dict[int, Tuple[float, float]] = field(default_factory=dict)
    small: float = 0.0
    is_looked_at: bool = False

    def points(self, output: int) -> List[Tuple[float, float]]:
        """Steps with answers, and how far the output moved, from the smallest step on."""
        found = [(step, float(delta[output])) for step, delta in self.deltas.items() if not np.isnan(delta[output])]
        return sorted(found, key=lambda each: abs(each[0]))

    def sides(self, output: int) -> Tuple[float, float]:
        """The slope from the nearest step of differences down, and up; NaN without a trial."""
        small = self.small or min((abs(step) for step in self.deltas), default=0.0)
        near = {np.sign(step): moved / step for step, moved in self.points(output) if abs(step) == small}
        return near.get(-1.0, np.nan), near.get(1.0, np.nan)

    def slope(self, output: int, threshold: Array) -> Tuple[float, float]:
        """The slope at the start and its uncertainty; NaN if no trial tells."""
        down, up = self.sides(output)
        both = [each for each in (down, up) if not np.isnan(each)]
        found = [self.fitted[output]] if output in self.fitted else []
        if both and self.small:
            noise = threshold[output] / self.small / (10 if len(both) > 1 else 5)
            bend = self.bend(output, float(np.mean(both))) if len(both) > 1 else abs(both[0]) * 1e-3
            found.append((float(np.mean(both)), float(noise + bend)))
        return min(found, key=lambda each: each[1], default=(np.nan, np.nan))

    def secants(self, output: int) -> Dict[float, float]:
        """For each step that was tried in both directions, the slope between the two."""
        moved = dict(self.points(output))
        return {step: (moved[step] - moved[-step]) / 2 / step for step in moved if step > 0 and -step in moved}

    def agrees(self, outputs: Array, threshold: Array) -> bool:
        """Whether large steps say what the small ones say, so that no more are needed for the slopes."""
        for output in np.flatnonzero(outputs):
            found = self.secants(int(output))
            if self.small not in found:
                return True
            slope, limit = found[self.small], threshold[output] / self.small
            if any(abs(each - slope) > 1e-3 * abs(slope) + limit for each in found.values()):
                return False
        return True

    def bend(self, output: int, slope: float) -> float:
        """The error of central differences by the third derivative.

        What larger steps say differs by the square of the step if the output is smooth. If it differs by more, that is
        the error.
        """
        differences = {step: abs(each - slope) for step, each in self.secants(output).items() if step > self.small}
        if not differences:
            return 0.0
        near, far = min(differences), max(differences)
        if near == far and differences[far] <= 1e-3 * abs(slope):  # no more trials were made then
            return differences[far]
        if near < far and differences[near] > 4 * differences[far] * (near / far) ** 2:
            return differences[near]
        return differences[near] * (self.small / near) ** 2

    def holds(self, step: float, moved: float, slope: float, tolerance: float, threshold: float) -> bool:
        return abs(moved - slope * step) <= tolerance * abs(slope * step) + threshold

    def reach(self, output: int, tolerance: float, threshold: Array) -> Tuple[float, float]:
        """How far down and up first order holds in all trials."""
        slope, _ = self.slope(output, threshold)
        ends = {-1.0: 0.0, 1.0: 0.0}
        broken = set()
        for step, moved in self.points(output):
            side = float(np.sign(step))
            if not self.holds(step, moved, slope, tolerance, threshold[output]):
                broken.add(side)
            if side not in broken:
                ends[side] = step
        return ends[-1.0], ends[1.0]

    def is_plain(self, output: int, tolerance: float, threshold: Array) -> bool:
        """Whether all steps do what the slope says."""
        slope, _ = self.slope(output, threshold)
        return all(self.holds(*point, slope, tolerance, threshold[output]) for point in self.points(output))

    def has_range(self, output: int, tolerance: float, threshold: Array) -> bool:
        """Whether first order holds beyond the step of differences on each side, and is not just rest."""
        slope, _ = self.slope(output, threshold)
        low, high = self.reach(output, tolerance, threshold)
        steps = [step for step, _ in self.points(output)]
        first, last = min([0.0, *steps]), max([0.0, *steps])
        if abs(slope) * max(-first, last) <= threshold[output]:
            return False
        near = 16 * self.small
        return (low < -near or low == first) and (high > near or high == last)

    def next_steps(self, outputs: List[int], tolerance: float, threshold: Array) -> List[float]:
        """Steps, one for each side, up to which first order should hold if the function is a parabola near by."""
        nearest: Dict[float, float] = {}
        for output in outputs:
            slope, _ = self.slope(output, threshold)
            low, high = self.reach(output, tolerance, threshold)
            for side, end in ((-1.0, low), (1.0, high)):
                beyond = [p for p in self.points(output) if np.sign(p[0]) == side and abs(p[0]) > abs(end)]
                if beyond and abs(end) <= 16 * self.small:
                    step, moved = beyond[0]
                    error = abs(moved - slope * step)
                    part = 0.7 * tolerance * abs(slope * step) / error if error > 0 else 0.5
                    wanted = step * min(max(part, 1 / 64), 0.7)
                    nearest[side] = min(nearest.get(side, wanted), wanted, key=abs)
        return [step for step in nearest.values() if abs(step) > 2 * self.small]

    def describe(self, output: int, tolerance: float, threshold: Array) -> Described:
        """Kind, slope, uncertainty, slopes to the left and to the right, and the range."""
        limit = float(threshold[output])
        points = self.points(output)
        if points and all(abs(moved) <= limit for _, moved in points):
            first, last = min(0.0, *(p[0] for p in points), 0.0), max(0.0, *(p[0] for p in points), 0.0)
            return COUPLED, 0.0, limit / max(-first, last), 0.0, 0.0, first, last
        slope, error = self.slope(output, threshold)
        low, high = self.reach(output, tolerance, threshold)
        kind = UNSETTLED
        if self.is_looked_at:
            kind = self.kind(output, limit)
            steps = {np.sign(step) for step, _ in points}
            is_short = (low > -self.small and -1.0 in steps) or (high < self.small and 1.0 in steps)
            is_steep = abs(slope) * self.small > 4 * limit
            if kind == SMOOTH and is_short and is_steep and not self.is_parabola(output):
                kind = UNSETTLED
        else:
            is_fitted = output in self.fitted and abs(slope) * max(abs(step) for step in self.deltas) > limit
            if is_fitted or self.has_range(output, tolerance, threshold):
                kind = SMOOTH
        if kind == SMOOTH:
            return kind, slope, error, slope, slope, low, high
        down, up = (np.nan, np.nan)
        if kind in (KINKED, SATURATED):
            down, up = (0.0 if abs(each) * self.small <= limit else each for each in self.sides(output))
        return kind, np.nan, np.nan, down, up, 0.0, 0.0

    def is_parabola(self, output: int) -> bool:
        """Whether the slopes of the two sides approach each other as the step shrinks."""
        moved = dict(self.points(output))
        found = [abs(moved[h] + moved[-h]) / h for h in (self.small, self.small / 8) if h in moved and -h in moved]
        return len(found) == 2 and found[1] <= found[0] / 2

    def kind(self, output: int, limit: float) -> str:
        """The kind, from trials near the start and far from it."""
        moved = dict(self.points(output))
        small = self.small
        near = {step: moved[step] for step in (-small, small) if step in moved}
        levels = len({round(each / max(limit, 1e-300)) for each in moved.values()} | {0})
        if all(abs(each) <= limit for each in near.values()):
            if self.is_flat_far(moved, limit):
                return STEPPED if levels > 3 else DISCONTINUOUS
            if self.is_line_far(moved):
                return STEPPED
            return SMOOTH if self.shrinks(moved, limit) else SATURATED
        for side, size in near.items():
            if abs(size) <= 4 * limit or side / 8 not in moved:
                continue
            ratio = moved[side / 8] / size
            is_lost = abs(moved[side / 8]) <= limit < abs(size) / 1024  # more than by the third power of the step
            if not (is_lost or ratio < 0 or ratio > 0.25):
                continue
            if self.is_flat_far(moved, limit):
                return STEPPED if levels > 3 else DISCONTINUOUS
            if self.is_line_far(moved):
                return STEPPED
            return DISCONTINUOUS if ratio > 0.5 else UNSETTLED
        if len(near) < 2 or -small / 8 not in moved or small / 8 not in moved:
            return SMOOTH
        bends = [abs(moved[h] + moved[-h]) / h for h in (small, small / 8)]
        if bends[0] * small <= 4 * limit or bends[1] <= bends[0] / 2:
            is_even = bends[0] > 0.1 * max(abs(each) for each in near.values()) / small
            return UNSETTLED if is_even and 4 * limit < bends[0] * small <= 64 * limit else SMOOTH
        if bends[1] * small / 8 <= 2 * limit:
            return UNSETTLED
        sizes = sorted(abs(each) for each in near.values())
        return SATURATED if sizes[0] <= limit else KINKED

    def is_flat_far(self, moved: Dict[float, float], limit: float) -> bool:
        """Whether the output does not move by a small step far from the start, on each side that was tried."""
        ends = [end for end in (min(moved), max(moved)) if abs(end) > 2 * self.small]
        pairs = [(FLAT_AT * end, FLAT_AT * end - np.sign(end) * self.small) for end in ends]
        told = [abs(moved[one] - moved[other]) <= limit for one, other in pairs if one in moved and other in moved]
        return bool(told) and all(told)

    def is_line_far(self, moved: Dict[float, float]) -> bool:
        """Whether all large steps have one slope."""
        largest = max(abs(step) for step in moved)
        slopes = [each / step for step, each in moved.items() if abs(step) > largest / 5]
        return len(slopes) > 2 and float(np.ptp(slopes)) <= 0.1 * abs(float(np.mean(slopes)))

    def shrinks(self, moved: Dict[float, float], limit: float) -> bool:
        """Whether what is flat at the start moves at every larger step, less than in proportion."""
        for side in (-1.0, 1.0):
            sizes = sorted((abs(step), abs(each)) for step, each in moved.items() if np.sign(step) == side)
            tried = [each for step, each in sizes if step > 2 * self.small]
            if tried and (tried[0] <= limit or tried[0] > tried[-1] / 8):
                return False
        return True
