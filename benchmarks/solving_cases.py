"""How often solving refuses targets that are known to be within reach: random expressions by the million.

Run as `./run exec python3 benchmarks/solving_cases.py [--cases N] [--seed N] [--drags N] [--paths N]`.

A target is made by evaluating an expression at random source values, so that an answer exists. For each category it
prints how many cases there were, what was refused, and what must never happen: a wrong answer, another exception than
NotInvertible, a value that is not finite, a solve that takes longer than `--longest` seconds. `--drags` moves the tips
of arms instead, and counts the joints that turned further than they had to. `--paths` follows closed paths of 1,000
steps, and prints how far from where they began the sources are at the end.
"""

import argparse
import collections
import math as plain_math
import random
import time
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy

from rosslt import NotInvertible, Source, evaluate, math, solve, track
from rosslt.values import continued, reapply, slopes, source_values

UNARY = [
    math.sin,
    math.cos,
    math.tan,
    math.asin,
    math.acos,
    math.atan,
    math.exp,
    math.log,
    math.sqrt,
    math.sinh,
    math.cosh,
    math.tanh,
    math.degrees,
    math.radians,
    math.log1p,
    math.expm1,
    abs,
    lambda x: -x,
    lambda x: x**2,
    lambda x: x**3,
]
BINARY = [
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: a * b,
    lambda a, b: a / b,
    math.hypot,
    math.atan2,
]
ARITHMETIC = BINARY[:4]
LARGEST = 1e6
"""Expressions whose values grow beyond this at the present source values are not taken."""

UNDEFINED = (ArithmeticError, ValueError, TypeError)


class Case:
    """A question that has an answer.

    Args:
        values: a tracked scalar, or a list of them.
        target: what it should become.
        options: what else `solve` is given.
    """

    def __init__(self, values: Any, target: Any, **options: Any) -> None:
        self.values = values
        self.target = target
        self.options = options


def is_usable(value: Any) -> bool:
    """Whether a value is a real number of ordinary size."""
    return isinstance(value, float) and abs(value) <= LARGEST


def step(chance: random.Random, a: Any, b: Any) -> Any:
    """The result of a random operation on one or two values."""
    if b is None:
        if chance.random() < 0.55:
            constant = round(chance.uniform(-3, 3), 2)
            function = chance.choice(ARITHMETIC)
            return function(a, constant) if chance.random() < 0.6 else function(constant, a)
        return chance.choice(UNARY)(a)
    return chance.choice(BINARY if chance.random() < 0.3 else ARITHMETIC)(a, b)


def grown(chance: random.Random, leaves: List[Any], steps: int) -> Optional[Any]:
    """An expression in which each of the leaves appears, and which a number of further steps made."""
    pool = list(leaves)
    for _ in range(steps):
        try:
            a = pool.pop(chance.randrange(len(pool)))
            b = pool.pop(chance.randrange(len(pool))) if pool and chance.random() < 0.6 else None
            made = step(chance, a, b)
        except UNDEFINED:
            return None
        if not is_usable(made):
            return None
        pool.append(made)
    while len(pool) > 1:
        a, b = pool.pop(), pool.pop()
        try:
            made = chance.choice(ARITHMETIC)(a, b)
        except UNDEFINED:
            return None
        if not is_usable(made):
            return None
        pool.append(made)
    return pool[0]


def sources_of(count: int) -> List[Source]:
    """The sources that expressions are made of."""
    return [Source('/case', number) for number in range(count)]


def target_at(values: Any, changes: Dict[Source, float]) -> Optional[Any]:
    """What the values are at other source values; None where they are not defined, or not of ordinary size."""
    try:
        found = evaluate(values, changes)
    except UNDEFINED:
        return None
    return found if all(map(is_usable, found if isinstance(found, list) else [found])) else None


def random_value(chance: random.Random) -> float:
    """A source's value."""
    return round(chance.uniform(-3, 3), 4)


def one_source_once(chance: random.Random) -> Optional[Case]:
    """A chain of operations."""
    (source,) = sources_of(1)
    value: Any = track(random_value(chance), source)
    try:
        for _ in range(chance.randint(1, 6)):
            value = step(chance, value, None)
            if not is_usable(value):
                return None
    except UNDEFINED:
        return None
    target = target_at(value, {source: random_value(chance)})
    return None if target is None else Case(value, target)


def at_a_bound(chance: random.Random) -> Optional[Case]:
    """A chain whose answer is exactly at a bound of the source."""
    (source,) = sources_of(1)
    case = one_source_once(chance)
    if case is None:
        return None
    present = evaluate(track(0.0, source), {})
    low, high = sorted((random_value(chance), random_value(chance)))
    present = present_of(case.values)
    if not low <= present <= high or low == high:
        return None
    target = target_at(case.values, {source: chance.choice((low, high))})
    return None if target is None else Case(case.values, target, bounds={source: (low, high)})


def present_of(value: Any) -> float:
    """The present value of the first source of a chain."""
    from rosslt.values import SOURCE, disassemble

    return next(one[2] for one in disassemble([value])[0] if one[0] == SOURCE)


def one_source_often(chance: random.Random) -> Optional[Case]:
    """An expression in which one source appears several times."""
    (source,) = sources_of(1)
    leaf = track(random_value(chance), source)
    value = grown(chance, [leaf] * chance.randint(2, 4), chance.randint(1, 6))
    if value is None:
        return None
    target = target_at(value, {source: random_value(chance)})
    return None if target is None else Case(value, target)


def several_sources(chance: random.Random, bounded: bool = False) -> Optional[Case]:
    """A scalar of several sources, all of which moved."""
    names = sources_of(chance.randint(2, 4))
    starts = [random_value(chance) for _ in names]
    value = grown(chance, [track(start, name) for start, name in zip(starts, names)], chance.randint(1, 6))
    if value is None:
        return None
    return moved(chance, value, names, starts, 3.0, bounded)


def moved(
    chance: random.Random, values: Any, names: List[Source], starts: List[float], reach: float, bounded: bool
) -> Optional[Case]:
    """The case in which all sources moved by up to so much, within their bounds where there are any."""
    ends = [start + chance.uniform(-reach, reach) for start in starts]
    target = target_at(values, dict(zip(names, ends)))
    if target is None:
        return None
    if not bounded:
        return Case(values, target)
    bounds = {}
    for name, start, end in zip(names, starts, ends):
        bounds[name] = (
            min(start, end) - chance.uniform(0, 0.5) * reach,
            max(start, end) + chance.uniform(0, 0.5) * reach,
        )
    return Case(values, target, bounds=bounds)


def joint(results: int, count: int, reach: float, bounded: bool = False) -> Callable[[random.Random], Optional[Case]]:
    """A system of so many results of so many sources, all moved by up to so much."""

    def make(chance: random.Random) -> Optional[Case]:
        names = sources_of(count)
        starts = [random_value(chance) for _ in names]
        leaves = [track(start, name) for start, name in zip(starts, names)]
        values = []
        while len(values) < results:
            picked = chance.sample(leaves, chance.randint(2, min(count, 3)))
            value = grown(chance, picked, chance.randint(1, 4))
            if value is not None:
                values.append(value)
        return moved(chance, values, names, starts, reach, bounded)

    return make


CATEGORIES: List[Tuple[str, float, float, Callable[[random.Random], Optional[Case]]]] = [
    # what it is, the percentage of refusals to reach, its part of all cases (the slow ones have a small one), what
    # makes one
    ('one source once', 0.1, 24, one_source_once),
    ('one source once, at a bound', 0.1, 16, at_a_bound),
    ('one source several times', 0.3, 16, one_source_often),
    ('several sources, all moved', 0.3, 12, several_sources),
    ('the same with bounds', 1.0, 12, lambda chance: several_sources(chance, True)),
    ('2x2 moved by up to 0.3', 0.1, 4, joint(2, 2, 0.3)),
    ('3x3 moved by up to 0.3', 0.1, 4, joint(3, 3, 0.3)),
    ('3x6 moved by up to 0.3', 0.1, 3, joint(3, 6, 0.3)),
    ('6x6 moved by up to 0.3', 0.1, 3, joint(6, 6, 0.3)),
    ('6x6 by up to 0.3, with bounds', 0.2, 2, joint(6, 6, 0.3, True)),
    ('2x2 moved by up to 3', 2.0, 0.8, joint(2, 2, 3.0)),
    ('3x3 moved by up to 3', 3.0, 0.6, joint(3, 3, 3.0)),
    ('3x6 moved by up to 3', 2.0, 0.5, joint(3, 6, 3.0)),
    ('6x6 moved by up to 3', 10.0, 0.5, joint(6, 6, 3.0)),
    ('2x2 by up to 3, with bounds', 4.0, 0.5, joint(2, 2, 3.0, True)),
    ('3x3 by up to 3, with bounds', 6.0, 0.4, joint(3, 3, 3.0, True)),
    ('3x6 by up to 3, with bounds', 4.0, 0.4, joint(3, 6, 3.0, True)),
    ('6x6 by up to 3, with bounds', 20.0, 0.3, joint(6, 6, 3.0, True)),
]


def cases_of(make: Callable[[random.Random], Optional[Case]], seed: str, count: int) -> Iterator[Tuple[str, Case]]:
    """So many cases, each with the seed that makes it again."""
    number = found = 0
    while found < count:
        one_seed = '%s/%d' % (seed, number)
        number += 1
        case = make(random.Random(one_seed))
        if case is not None:
            found += 1
            yield one_seed, case


def verdict(case: Case) -> str:
    """The fault in a case; '' where it was solved rightly."""
    try:
        answer = solve(case.values, case.target, **case.options)
    except NotInvertible:
        return 'refused'
    except Exception as error:
        return 'crashed: %s' % type(error).__name__
    if not all(plain_math.isfinite(new) for new in answer.values()):
        return 'not finite'
    for source, (low, high) in case.options.get('bounds', {}).items():
        if source in answer and not low <= answer[source] <= high:
            return 'out of bounds'
    found = evaluate(case.values, answer)
    pairs = zip(found, case.target, case.values) if isinstance(found, list) else [(found, case.target, case.values)]
    triples = [tuple(map(float, triple)) for triple in pairs]
    size = max(abs(part) for _, wanted, present in triples for part in (wanted, present))
    for result, wanted, _ in triples:
        if abs(result - wanted) > max(1e-9 * abs(wanted), 1e-12 * min(1.0, size)):
            return 'wrong'
    return ''


def tip_of(lengths: List[float], angles: List[Any]) -> List[Any]:
    """Where the tip of an arm in the plane is, each joint's angle counted from the link before it."""
    x: Any = 0.0
    y: Any = 0.0
    angle: Any = 0.0
    for length, joint in zip(lengths, angles):
        angle = angle + joint
        x = x + length * math.cos(angle)
        y = y + length * math.sin(angle)
    return [x, y]


def way_of_two_joints(lengths: List[float], angles: List[float], target: List[float]) -> float:
    """How far the nearer of a two-joint arm's two ways to reach a point is away, in radians."""
    upper, lower = lengths
    x, y = target
    bend = plain_math.acos((x * x + y * y - upper * upper - lower * lower) / (2 * upper * lower))
    ways = []
    for elbow in (bend, -bend):
        shoulder = plain_math.atan2(y, x)
        shoulder -= plain_math.atan2(lower * plain_math.sin(elbow), upper + lower * plain_math.cos(elbow))
        turned = [plain_math.remainder(new - old, 2 * plain_math.pi) for new, old in zip((shoulder, elbow), angles)]
        ways.append(plain_math.hypot(*turned))
    return min(ways)


def drags_of_arms(seed: str, count: int) -> None:
    """Drag the tips of two- and three-joint arms to points within reach, and print what the joints did.

    A joint turns too far where it turns by more than half a turn, as a whole turn less gives the same.
    """
    print('seed %s' % seed)
    print('%-32s %9s %9s %9s %9s %9s' % ('drags by at most', 'drags', 'refused', 'wrong', 'too far', 'not nearest'))
    for joints in (2, 3):
        names = sources_of(joints)
        for part in (0.1, 0.4, 0.8):
            chance = random.Random('%s/%d/%s' % (seed, joints, part))
            done = refused = wrong = too_far = longer = 0
            while done < count:
                lengths = [chance.uniform(0.2, 1) for _ in names]
                angles = [chance.uniform(-3, 3) for _ in names]
                tip = tip_of(lengths, [track(angle, name) for angle, name in zip(angles, names)])
                far = part * sum(lengths)
                target = [float(at) + chance.uniform(-far, far) for at in tip]
                hole = max(0.0, 2 * max(lengths) - sum(lengths))
                if not 1.0001 * hole < plain_math.hypot(*target) < 0.9999 * sum(lengths):
                    continue
                done += 1
                try:
                    answer = solve(tip, target)
                except NotInvertible:
                    refused += 1
                    continue
                turns = [answer.get(name, angle) - angle for name, angle in zip(names, angles)]
                reached = evaluate(tip, answer)
                wrong += max(abs(a - b) for a, b in zip(reached, target)) > 1e-9
                too_far += max(map(abs, turns)) > plain_math.pi + 1e-9
                if joints == 2:
                    longer += plain_math.hypot(*turns) > way_of_two_joints(lengths, angles, target) + 1e-6
            print(
                '%-32s %9d %9d %9d %9d %9s'
                % (
                    '%d joints, %g of the reach' % (joints, part),
                    done,
                    refused,
                    wrong,
                    too_far,
                    longer if joints == 2 else '',
                ),
                flush=True,
            )


STEPS = 1000
"""The steps of a closed path."""


def curve_point(chance: random.Random) -> List[Any]:
    """A point of a cubic curve in the plane, of its control points and its parameter."""
    *numbers, t = [track(chance.uniform(-1, 1), source) for source in sources_of(8)] + [track(0.4, Source('/case', 8))]
    weights = [(1 - t) ** 3, 3 * (1 - t) ** 2 * t, 3 * (1 - t) * t * t, t**3]
    return [sum(weight * number for weight, number in zip(weights, numbers[axis::2])) for axis in (0, 1)]


def random_arm(chance: random.Random, joints: int, length: Optional[float] = None) -> List[Any]:
    """The tip of an arm that is neither stretched nor folded."""
    lengths = [length or chance.uniform(0.3, 1.0) for _ in range(joints)]
    return tip_of(lengths, [track(chance.uniform(0.3, 0.9), source) for source in sources_of(joints)])


PATHS: Dict[str, Callable[[random.Random], List[Any]]] = {
    '2 joints': lambda chance: random_arm(chance, 2),
    '3 joints': lambda chance: random_arm(chance, 3),
    '6 joints': lambda chance: random_arm(chance, 6),
    'four bars of equal length': lambda chance: random_arm(chance, 4, 0.5),
    "a Bezier's point": curve_point,
}


def closed_path(tip: List[Any], radius: float, direction: float) -> Iterator[List[float]]:
    """The points of a circle that begins and ends at a tip, its middle in a direction from there."""
    x, y = map(float, tip)
    for number in range(1, STEPS):
        turn = direction + plain_math.pi + 2 * plain_math.pi * number / STEPS
        yield [
            x + radius * (plain_math.cos(direction) + plain_math.cos(turn)),
            y + radius * (plain_math.sin(direction) + plain_math.sin(turn)),
        ]
    yield [x, y]


def follow(tip: List[Any], path: Iterator[List[float]]) -> Tuple[float, int, float, float]:
    """Follow a path.

    Returns:
        How far a source is from where it began, how many points were held, the longest step of a source in relation to
        what the slopes at its end ask for, and the milliseconds of a step.
    """
    began = source_values(tip)
    last: Dict[Source, Any] = {}
    held, longest, spent = 0, 0.0, 0.0
    for target in path:
        start = time.thread_time()
        try:
            new = continued(tip, target, last)
        except NotInvertible:
            held += 1
            continue
        finally:
            spent += time.thread_time() - start
        here, there = {**began, **last}, {**began, **new}
        moved = max(abs(there[source] - here[source]) for source in began)
        if moved > 1e-9:
            jacobian = numpy.array(list(slopes(reapply(tip, there)).values())).T
            asked = numpy.linalg.pinv(jacobian) @ numpy.subtract(evaluate(tip, there), evaluate(tip, here))
            longest = max(longest, moved / float(numpy.linalg.norm(asked)))
        last = new
    drift = max(abs(last.get(source, value) - value) for source, value in began.items())
    return drift, held, longest, 1e3 * spent / STEPS


def closed_paths(seed: str, count: int) -> None:
    """Follow closed paths towards the base of an arm and beyond its reach, and print how the sources moved."""
    print('seed %s' % seed)
    print('%-42s %6s %9s %9s %6s %12s %8s' % ('', 'paths', 'largest', 'drifted', 'held', 'longest step', 'mean ms'))
    print('%-42s %6s %9s %9s %6s %12s %8s' % ('', '', 'drift', '', '', '/ asked for', ''))
    for name, make in PATHS.items():
        for where, radius in (('towards the base', -0.3), ('beyond the reach', 0.6)):
            if make is curve_point and radius > 0:
                continue  # it reaches everything
            found = []
            for number in range(count):
                chance = random.Random('%s/%s/%d' % (seed, name, number))
                tip = make(chance)
                x, y = map(float, tip)
                direction = plain_math.atan2(y, x) + (plain_math.pi + chance.uniform(-0.5, 0.5) if radius < 0 else 0.0)
                found.append(follow(tip, closed_path(tip, abs(radius) * plain_math.hypot(x, y), direction)))
            drifts, held, longest, spent = zip(*found)
            print(
                '%-42s %6d %9.1e %9d %6d %12.2f %8.2f'
                % (
                    '%s, %s' % (name, where),
                    count,
                    max(drifts),
                    sum(drift > 1e-9 for drift in drifts),
                    sum(held) / count,
                    max(longest),
                    sum(spent) / count,
                ),
                flush=True,
            )


def main() -> None:
    """Solve the cases and print a line for each category."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--cases', type=int, default=20_000, help='how many in all (default: 20,000)')
    parser.add_argument('--seed', default='1', help='what all random choices come from (default: 1)')
    parser.add_argument('--longest', type=float, default=0.2, help='the seconds that a solve may take (default: 0.2)')
    parser.add_argument('--only', default='', help='only categories with this text in their name')
    parser.add_argument('--show', type=int, default=0, help='print the seeds of so many bad cases of each category')
    parser.add_argument('--drags', type=int, default=0, help="drag arms' tips instead, so many times of each kind")
    parser.add_argument('--paths', type=int, default=0, help='follow closed paths instead, so many of each kind')
    options = parser.parse_args()
    if options.paths:
        closed_paths(options.seed, options.paths)
        return
    if options.drags:
        drags_of_arms(options.seed, options.drags)
        return
    chosen = [category for category in CATEGORIES if options.only in category[0]]
    total = sum(part for _, _, part, _ in chosen)
    print('seed %s' % options.seed)
    print('%-32s %9s %9s %9s %8s %9s %9s  %s' % ('', 'cases', 'refused', 'at most', 'bad', 'mean ms', 'max ms', ''))
    for name, limit, part, make in chosen:
        count = max(1, round(options.cases * part / total))
        verdicts: Dict[str, List[str]] = collections.defaultdict(list)
        times = []
        for seed, case in cases_of(make, '%s/%s' % (options.seed, name), count):
            start = time.thread_time()
            said = verdict(case)
            times.append(time.thread_time() - start)
            if times[-1] > options.longest:
                verdicts['too long'].append(seed)
            if said:
                verdicts[said].append(seed)
        refused = verdicts.pop('refused', [])
        print(
            '%-32s %9d %8.3f%% %8.3f%% %8d %9.2f %9.1f  %s'
            % (
                name,
                count,
                100 * len(refused) / count,
                limit,
                sum(map(len, verdicts.values())),
                1e3 * sum(times) / count,
                1e3 * max(times),
                ', '.join('%s %d' % (what, len(seeds)) for what, seeds in verdicts.items()),
            ),
            flush=True,
        )
        for what, seeds in [('refused', refused)] + list(verdicts.items()):
            for seed in seeds[: options.show]:
                print('    %s: %s' % (what, seed))


if __name__ == '__main__':
    main()
