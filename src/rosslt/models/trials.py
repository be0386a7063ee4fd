"""Which outputs of an opaque function depend on which inputs, and how much, found by trying it.

`learn` changes many inputs at once and halves what moves an output. Why what it finds is a dependency: each was seen
either in a trial that differs from the start in one input alone, or in two trials that differ from each other in one
input alone. If their outputs differ by more than noise explains, nothing else can explain it. A linear fit only
proposes which inputs are tried first. Why the others are called quiet: all of them were changed at once, twice, by
random sizes in opposite directions, and no output moved.

What remembers its inputs, as a switch with hysteresis does, may answer to what was asked before. So each dependency is
confirmed in the end if that is wanted: one answer, another with the one input changed, and the first again.
"""

import contextlib
from typing import Any, Callable, Dict, List, Optional, Set, Tuple

import numpy as np
from scipy.special import stdtrit

from rosslt.models.learned import Dependency, Learned
from rosslt.models.profiles import FLAT_AT, Profile
from rosslt.models.sparse import propose

Array = Any  # numpy.ndarray: NumPy 1.17 of Noetic has no types
Ask = Callable[[Array], Array]
Proof = Tuple[Array, Array, Array]
"""Two changes of the inputs (n,) that differ in one input alone, and which outputs they tell apart (m,)."""

CHANCE = 1e-7  # of noise to be taken for a movement, in one output of one trial
ROUNDING = 1e-12  # of an output's largest answer: what summing in another order may change


def learn(
    ask: Ask,
    start: Array,
    sizes: Array,
    bounds: Optional[Array] = None,
    whole: Optional[Array] = None,
    most: int = 200,
    tolerance: float = 0.05,
    seed: int = 0,
    resolution: float = ROUNDING,
    confirms: bool = False,
) -> Learned:
    """Finds by trials which outputs of a function depend on which inputs, and how.

    What shows only at changes of more than 0.6 `sizes`, or only if several inputs change in directions that were not
    tried together, may not be found. With noise the steps are large: a slope is then that over its step, and a kink
    or a limit within the step is not in its uncertainty.

    Args:
        ask: an array (k, n) of inputs to one (k, m) of outputs, a row for each trial; NaN where no answer came
        start: the present inputs (n,)
        sizes: the largest change of each input (n,), in its unit; that of one that must not change is 0
        bounds: the least and the largest value of each input (n, 2); without, none
        whole: which inputs take only whole steps (n,); those are found by halving alone, which takes more trials
        most: trials
        tolerance: relative error up to which first order is said to hold
        seed: of the random changes
        resolution: the part of an output's largest answer below which a difference is no movement
        confirms: whether the function may remember what it was asked before: each dependency takes two more trials, and
            an output that remembers is told to be unrepeatable

    Returns:
        what was learned

    Raises:
        ValueError: if the shapes do not fit, or the start is out of bounds
    """
    start = np.asarray(start, dtype=float)
    sizes = np.asarray(sizes, dtype=float)
    limits = np.full((len(start), 2), (-np.inf, np.inf)) if bounds is None else np.asarray(bounds, dtype=float)
    steps = np.zeros(len(start), dtype=bool) if whole is None else np.asarray(whole, dtype=bool)
    if start.ndim != 1 or sizes.shape != start.shape or steps.shape != start.shape or limits.shape != (len(start), 2):
        raise ValueError('start, sizes and whole need shape (n,), and bounds (n, 2)')
    if not (np.all(np.isfinite(start)) and np.all(np.isfinite(sizes)) and np.all(sizes >= 0)):
        raise ValueError('start and sizes need finite numbers, and sizes none below 0')
    if np.any(start < limits[:, 0]) or np.any(start > limits[:, 1]):
        raise ValueError('the start is out of bounds')
    room = np.minimum(sizes, np.stack([start - limits[:, 0], limits[:, 1] - start]))
    room = np.where(steps, np.floor(room), room)
    return _Search(ask, start, room, steps, most, tolerance, np.random.RandomState(seed), resolution, confirms).run()


class _OutOfTrials(Exception):
    """There are no more trials."""


class _Search:
    """One run of `learn`. Changes are in the units of the inputs; `room` (2, n) is how far each can go down and up."""

    def __init__(
        self,
        ask: Ask,
        start: Array,
        room: Array,
        whole: Array,
        most: int,
        tolerance: float,
        random: Any,
        resolution: float,
        confirms: bool,
    ) -> None:
        self.ask, self.start, self.room, self.whole = ask, start, room, whole
        self.left = most
        self.trials = 0
        self.tolerance, self.resolution, self.confirms = tolerance, resolution, confirms
        self.random = random
        self.largest: Array = None
        self.is_single = True  # whether all answers fit in 32 bits
        self.profiles: Dict[int, Profile] = {}
        self.seen: Dict[int, Array] = {}  # which outputs an input moved, (m,)
        self.proofs: Dict[int, List[Proof]] = {}  # among changes of others
        self.unconfirmed: Set[int] = set()
        self.quiet = np.max(room, axis=0) == 0
        self.unanswered: Set[int] = set()
        self.mute: List[int] = []  # the inputs that a path goes on without: they took the answer away
        self.changes = np.zeros((0, len(start)))  # of the trials by small steps, and what they moved
        self.moved = np.zeros((0, 0))
        self.far = np.zeros((0, len(start)))

    # Asking

    def answers(self, changes: Array) -> Array:
        """The outputs (k, m) at these changes (k, n) of the start. A trial without an answer is made once more."""
        changes = np.asarray(changes)
        result = self._asked(changes)
        lost = np.flatnonzero(np.any(np.isnan(result), axis=1))
        if self.largest is not None:
            lost = np.flatnonzero(np.any(np.isnan(result[:, self.answering]), axis=1))
            if 0 < len(lost) <= self.left:
                result[lost] = self._asked(changes[lost])
        return result

    def _asked(self, changes: Array) -> Array:
        kept = 2 * len(self.seen) + 1 if self.confirms else 0
        if len(changes) > self.left - kept:
            raise _OutOfTrials
        self.left -= len(changes)
        self.trials += len(changes)
        result = np.array(self.ask(self.start + changes), dtype=float)
        if result.ndim != 2 or len(result) != len(changes):
            raise ValueError('ask gave shape {} for {} rows'.format(result.shape, len(changes)))
        result[~np.isfinite(result)] = np.nan
        self.is_single = self.is_single and bool(np.all((result == result.astype(np.float32)) | np.isnan(result)))
        if self.largest is not None:
            self.largest = np.fmax(self.largest, np.max(np.abs(np.nan_to_num(result)), axis=0))
        return result

    @property
    def rounding(self) -> Array:
        return self.largest * max(2.0**-22 if self.is_single else 0.0, self.resolution)

    @property
    def threshold(self) -> Array:
        """What noise and rounding do not explain, (m,)."""
        return self.factor * self.noise + self.rounding

    def differ(self, one: Array, other: Array) -> Array:
        """Which outputs moved (m,). No answer counts as moved here: such a group is split."""
        return self.answering & ~(np.abs(one - other) <= self.threshold)

    def is_move(self, delta: Array) -> Array:
        """Which outputs moved (m,), from how far they did."""
        return self.answering & (np.abs(np.nan_to_num(delta)) > self.threshold)

    # The run

    def run(self) -> Learned:
        self.begin()
        is_complete = False
        with contextlib.suppress(_OutOfTrials):
            is_complete = self.find()
        for step in (self.measure, self.refine, self.walk):
            with contextlib.suppress(_OutOfTrials):
                step()
        for index in self.seen.keys() & self.profiles.keys():
            for delta in self.profiles[index].deltas.values():
                self.seen[index] = self.seen[index] | self.is_move(delta)
        if self.confirms:
            self.confirm()
        self.end()
        return self.result(is_complete)

    def begin(self) -> None:
        """Asks the start a few times: the noise."""
        if self.left < 6:
            raise ValueError('learn needs at least 6 trials')
        self.left -= 1  # the last one, at the start again
        still = np.zeros((3, len(self.start)))
        asked = self._asked(still)
        if np.any(np.ptp(asked, axis=0) > 0) and self.left > 14:
            asked = np.concatenate([asked, self._asked(np.repeat(still[:1], 7, axis=0))])
        self.answering = ~np.any(np.isnan(asked), axis=0)
        self.base = np.mean(asked, axis=0)
        self.noise = np.std(asked, axis=0, ddof=1)
        self.noise[np.ptp(asked, axis=0) == 0] = 0.0  # the mean of equal numbers need not be that number
        self.base = np.where(self.noise == 0, asked[0], self.base)
        self.factor = float(stdtrit(len(asked) - 1, 1 - CHANCE)) * np.sqrt(2)
        self.largest = np.max(np.abs(np.nan_to_num(asked)), axis=0)
        self.moved = np.zeros((0, asked.shape[1]))
        self.drifted = np.zeros(asked.shape[1], dtype=bool)

    def end(self) -> None:
        """The start again: an output that has drifted meanwhile has shown nothing."""
        self.left = 1
        again = self._asked(np.zeros((1, len(self.start))))[0]
        self.drifted |= self.answering & ~(np.abs(again - self.base) <= self.threshold)

    def confirm(self) -> None:
        """Asks for each dependency again: an output that is not the same before and after has shown nothing."""
        self.confirms = False  # the trials that were kept are for this
        last: Array = None
        for index in sorted(self.seen):
            with contextlib.suppress(_OutOfTrials):
                for before, after, moved in self.proofs_of(index):
                    if last is None or np.any(before) or np.any(last[0]):
                        last = before, self.answers(before[None])[0]
                    changed, again = self.answers(np.array([after, before]))
                    is_same = ~self.differ(last[1], again) & (np.any(before) | ~self.differ(again, self.base))
                    self.drifted |= moved & ~(is_same & self.differ(again, changed) & ~np.isnan(changed))
                    last = before, again
                continue
            self.unconfirmed.add(index)

    def proofs_of(self, index: int) -> List[Proof]:
        """Few proofs of all that an input moves."""
        still, alone = np.zeros(len(self.start)), np.eye(len(self.start))[index]
        deltas = self.profiles[index].deltas if index in self.profiles else {}
        steps = sorted(deltas, key=abs, reverse=True)
        changes = [(still, step * alone, self.is_move(deltas[step])) for step in steps]
        missing, found = self.seen[index] & ~self.drifted, []
        for before, after, moved in changes + self.proofs.get(index, []):
            if np.any(moved & missing):
                found.append((before, after, moved & missing))
                missing = missing & ~moved
        return found

    def find(self) -> bool:
        """Finds which inputs matter; whether all others are quiet."""
        far = self.far = self.far_changes()
        ends = self.answers(far)
        moving = [self.differ(end, self.base) for end in ends]
        if not np.any(moving):
            return True
        self.propose(np.max(np.abs(np.nan_to_num(ends - self.base)), axis=0))
        for change, end in zip(far, ends):
            while self.halve_rest(change, end):  # what is known changes first, and may free others
                if self.mute[-1:] and change[self.mute[-1]]:
                    change[self.mute] = 0
                    end = self.answers(change[None])[0]
            self.mute.clear()
        return True

    def far_changes(self) -> Array:
        """All inputs changed by random sizes, in random directions, and the same in the other directions (2, n).

        An input that can change in one direction only changes in one of the two rows: it may be a switch for others.
        """
        up = self.random.rand(len(self.start)) < 0.5
        rows = []
        for is_up in (up, ~up):
            room = np.where(is_up, self.room[1], -self.room[0])
            size = room * (1 - 0.4 * self.random.rand(len(room)))
            rows.append(np.where(self.whole, np.sign(room) * np.ceil(np.abs(size)), size))
        return np.array(rows)

    def halve_rest(self, change: Array, end: Array) -> bool:
        """Finds what else matters along a path: first what is known, then the others. Whether it found something."""
        count = len(self.seen) + len(self.mute)
        known = [i for i in range(len(self.start)) if i in self.seen]
        rest = [i for i in np.flatnonzero(change) if i not in self.seen]
        if not rest:
            return False
        first = np.zeros(len(self.start))
        first[known] = change[known]
        begin = self.answers(first[None])[0] if known else self.base
        self.halve(first, begin, end, rest, change)
        return len(self.seen) + len(self.mute) > count

    def halve(self, before: Array, begin: Array, end: Array, inputs: List[int], change: Array) -> None:
        """Splits inputs whose changes together lead from one answer to another."""
        moved = self.differ(begin, end) & ~np.isnan(begin)
        if not np.any(moved):
            return
        if len(inputs) == 1:
            proven = moved & ~np.isnan(end)
            if np.any(proven):
                self.seen[inputs[0]] = self.seen.get(inputs[0], False) | proven
                after = before.copy()
                after[inputs] = change[inputs]
                self.proofs.setdefault(inputs[0], []).append((before, after, proven))
            else:
                self.mute.append(inputs[0])
                self.unanswered.add(inputs[0])
            return
        half = len(inputs) // 2
        between = before.copy()
        between[inputs[:half]] = change[inputs[:half]]
        middle = self.answers(between[None])[0]
        self.halve(before, begin, middle, inputs[:half], change)
        self.halve(between, middle, end, inputs[half:], change)

    def single(self, index: int) -> bool:
        """Changes one input alone, as far as it goes in both directions; whether something moved."""
        profile = self.profiles.setdefault(index, Profile())
        moved = self.try_steps(index, [-self.room[0, index], self.room[1, index]])
        if np.any(moved):
            self.seen[index] = self.seen.get(index, False) | moved
        elif any(np.any(np.isnan(delta[self.answering])) for delta in profile.deltas.values()):
            self.unanswered.add(index)
        return bool(np.any(moved))

    def try_steps(self, index: int, steps: List[float]) -> Array:
        """Changes one input alone by steps that its room allows; which outputs moved (m,)."""
        profile = self.profiles[index]
        low, high = -self.room[0, index], self.room[1, index]
        steps = [float(np.round(step)) if self.whole[index] else step for step in steps]
        steps = sorted({step for step in steps if low <= step <= high and step != 0} - set(profile.deltas))
        if not steps:
            return np.zeros(len(self.base), dtype=bool)
        rows = np.zeros((len(steps), len(self.start)))
        rows[:, index] = steps
        answers = self.answers(rows)
        profile.deltas.update(zip(steps, answers - self.base))
        return np.any([self.differ(answer, self.base) & ~np.isnan(answer) for answer in answers], axis=0)

    # Small changes of many inputs at once

    def propose(self, far: Array) -> None:
        """Proposes inputs by sparse linear fits of small changes, and changes each of them alone.

        Args:
            far: how much each output moved by large changes of all inputs (m,)
        """
        free = np.flatnonzero(~self.whole & ~self.quiet)
        told = np.flatnonzero(self.answering & (far > self.threshold))
        if len(free) <= 16 or not len(told):  # halving takes no more trials then
            return
        ratio = np.max(np.maximum(self.noise, self.rounding)[told] / far[told])
        fraction = float(np.clip(np.sqrt(ratio), 1e-5, 0.5))
        enough = min(self.left // 2, len(free) // 4)  # more would cost about what halving does
        refuted: Set[int] = set()
        while True:
            found = self.explain(free, told, refuted) if len(self.moved) else None
            if found is not None and found[0]:
                for index in found[0]:
                    if not self.single(index):
                        refuted.add(index)
            elif found is not None and found[1]:
                return
            elif len(self.moved) < enough:
                self.change_many(free, fraction, 2 if len(self.moved) else 8)
            elif found is not None and found[2] is not None and len(refuted) < 4:
                if not self.single(found[2]):
                    refuted.add(found[2])
            else:
                return

    def change_many(self, free: Array, fraction: float, count: int) -> None:
        """Makes trials in which all these inputs change by a fraction of their room."""
        size = np.max(self.room[:, free], axis=0) * fraction * (0.5 + 0.5 * self.random.rand(count, len(free)))
        is_up = self.random.rand(count, len(free)) < 0.5
        is_up = np.where(self.room[1, free] < size, False, np.where(self.room[0, free] < size, True, is_up))
        rows = np.zeros((count, len(self.start)))
        rows[:, free] = np.where(is_up, size, -size)
        self.moved = np.concatenate([self.moved, self.answers(rows) - self.base])
        self.changes = np.concatenate([self.changes, rows])

    def explain(self, free: Array, told: Array, refuted: Set[int]) -> Tuple[List[int], bool, Optional[int]]:
        """What few inputs explain the trials by small steps.

        Returns:
            new inputs that explain some outputs well; whether all outputs are explained; else the likeliest input
        """
        columns = [int(i) for i in free if i not in refuted]
        forced = [n for n, i in enumerate(columns) if i in self.seen]
        matrix = self.changes[:, columns] / np.max(self.room[:, columns], axis=0)
        rows = ~np.any(np.isnan(self.moved[:, told]), axis=1)
        matrix, moved = matrix[rows], self.moved[rows][:, told]
        noise = 1.5 * np.sqrt(len(moved)) * np.maximum(self.noise, self.rounding)[told]
        floor = np.maximum(0.01 * np.linalg.norm(moved, axis=0), noise)
        new, is_all, likeliest = propose(matrix, moved, floor, forced)
        return [columns[n] for n in new], is_all, None if likeliest is None else columns[likeliest]

    # Measuring what was found

    def measure(self) -> None:
        """Slopes: from the trials by small steps, or from two more for an input."""
        for index in sorted({*self.seen, *self.unanswered}):
            if index not in self.profiles:
                self.single(index)
        self.fit_slopes()
        for index in sorted(self.seen):
            if not all(self.is_measured(index, output) for output in np.flatnonzero(self.seen[index])):
                step = self.small_step(index)
                self.try_steps(index, [-step, step])
                self.profiles[index].small = step
                if not self.profiles[index].agrees(self.seen[index], self.threshold):
                    self.try_steps(index, [-8 * step, 8 * step])

    def fit_slopes(self) -> None:
        """Least squares over the trials by small steps, for the outputs that they fit."""
        inputs = [i for i in sorted(self.seen) if not self.whole[i]]
        matrix = self.changes[:, inputs]
        spare = len(matrix) - len(inputs)
        if spare < 2 or not inputs or np.any(np.isnan(self.moved[:, self.answering])):
            return
        scale = np.max(np.abs(matrix), axis=0)
        slopes = np.linalg.lstsq(matrix / scale, self.moved, rcond=None)[0]
        rest = self.moved - (matrix / scale) @ slopes
        deviation = np.sqrt(np.sum(rest**2, axis=0) / spare)
        spread = np.sqrt(np.diag(np.linalg.pinv((matrix / scale).T @ (matrix / scale))))
        for output in np.flatnonzero(self.answering):
            size = np.linalg.norm(self.moved[:, output])
            noise = np.sqrt(len(matrix)) * max(self.noise[output] * 2, self.rounding[output])
            if np.linalg.norm(rest[:, output]) <= max(1e-3 * size, noise):
                error = max(deviation[output], self.noise[output])
                for n, index in enumerate(inputs):
                    fitted = (slopes[n, output] / scale[n], spread[n] * error / scale[n])
                    self.profiles[index].fitted[int(output)] = fitted

    def is_measured(self, index: int, output: int) -> bool:
        slope, error = self.profiles[index].fitted.get(int(output), (0.0, np.inf))
        return error <= 1e-3 * abs(slope)

    def small_step(self, index: int) -> float:
        """The step at which the error by noise is about that by the third derivative."""
        far = np.max([np.abs(np.nan_to_num(delta)) for delta in self.profiles[index].deltas.values()], axis=0)
        moving = self.answering & (far > self.threshold)
        room = float(np.max(self.room[:, index]))
        if not np.any(moving):
            return room / 8
        ratio = np.max(np.maximum(self.noise, self.rounding) / np.where(moving, far, np.inf))
        hidden = np.max(self.threshold / np.where(moving, far, np.inf))
        step = room * float(np.clip(max(np.cbrt(ratio), 16 * hidden), 1e-4, 0.5))
        sides = [side for side in self.room[:, index] if side > 0]
        step = min(step, *sides) if len(sides) > 1 else step
        return max(1.0, round(step)) if self.whole[index] else step

    def refine(self) -> None:
        """More trials of each input whose large steps do not do what its slope says: the range, or the kind."""
        for index in sorted(set(self.seen) & set(self.profiles)):
            profile = self.profiles[index]
            odd = self.odd(index)
            for _ in range(2):
                if odd:
                    self.try_steps(index, profile.next_steps(odd, self.tolerance, self.threshold))
                    odd = [n for n in odd if not profile.has_range(n, self.tolerance, self.threshold)]
            if not odd:
                continue
            small = profile.small or self.small_step(index)
            profile.small = small
            low, high = -self.room[0, index], self.room[1, index]
            self.try_steps(index, [-small, small, -small / 8, small / 8])
            self.try_steps(index, [part * side for part in (0.07, 0.23, FLAT_AT, 0.79) for side in (low, high)])
            self.try_steps(index, [FLAT_AT * low + small, FLAT_AT * high - small])
            profile.is_looked_at = True

    def walk(self) -> None:
        """Changes what is known one after the other: an output may need several inputs before it moves."""
        known = sorted(i for i in self.seen if i not in self.unanswered)
        for change, order in zip(self.far, (known, known[::-1]) if len(known) > 1 else ()):
            rows = np.zeros((len(order) + 1, len(self.start)))
            for n, index in enumerate(order):
                rows[n + 1 :, index] = change[index]
            answers = np.concatenate([self.base[None], self.answers(rows[1:])])
            for n, index in enumerate(order):
                is_told = ~np.isnan(answers[n]) & ~np.isnan(answers[n + 1])
                proven = self.differ(answers[n], answers[n + 1]) & is_told
                self.seen[index] = self.seen[index] | proven
                self.proofs.setdefault(index, []).append((rows[n], rows[n + 1], proven))

    def odd(self, index: int) -> List[int]:
        """The outputs that an input does not move in first order over its whole room."""
        profile = self.profiles[index]
        outputs = [int(n) for n in np.flatnonzero(self.seen[index])]
        return [n for n in outputs if not profile.is_plain(n, self.tolerance, self.threshold)]

    # The result

    def result(self, is_complete: bool) -> Learned:
        moved = np.any([*self.seen.values(), np.zeros(len(self.base), dtype=bool)], axis=0)
        bad = ~self.answering | self.drifted | ((self.noise > 0) & ~moved)
        found = []
        for index in self.seen.keys() - self.unconfirmed:
            profile = self.profiles.get(index, Profile())
            for output in np.flatnonzero(self.seen[index] & ~bad):
                record = profile.describe(int(output), self.tolerance, self.threshold)
                found.append(Dependency(int(output), int(index), *record))
        told = {*self.seen, *self.unanswered, *np.flatnonzero(self.quiet)} - self.unconfirmed
        rest = set(range(len(self.start))) - told
        return Learned(
            dependencies=tuple(sorted(found, key=lambda each: (each.output, each.input))),
            noise=tuple(float(each) for each in self.noise),
            unrepeatable=tuple(int(n) for n in np.flatnonzero(bad)),
            unanswered=tuple(sorted(int(i) for i in self.unanswered - set(self.seen))),
            untried=tuple(sorted(self.unconfirmed if is_complete else rest)),
            tolerance=self.tolerance,
            trials=self.trials,
        )
