"""How often solving refuses targets that are known to be within reach: random expressions by the million.

Run as `./run exec python3 benchmarks/solving_cases.py [--cases N] [--seed N]`.

A target is made by evaluating an expression at random source values, so that an answer exists. For each category it
prints how many cases there were, what was refused, and what must never happen: a wrong answer, another exception than
NotInvertible, a value that is not finite, a solve that takes longer than `--longest` seconds.
"""

import argparse
import collections
import math as plain_math
import random
import time
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

from rosslt import NotInvertible, Source, evaluate, math, solve, track

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
BINARY = [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b, math.hypot, math.atan2]
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


def main() -> None:
    """Solve the cases and print a line for each category."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--cases', type=int, default=20_000, help='how many in all (default: 20,000)')
    parser.add_argument('--seed', default='1', help='what all random choices come from (default: 1)')
    parser.add_argument('--longest', type=float, default=0.2, help='the seconds that a solve may take (default: 0.2)')
    parser.add_argument('--only', default='', help='only categories with this text in their name')
    parser.add_argument('--show', type=int, default=0, help='print the seeds of so many bad cases of each category')
    options = parser.parse_args()
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
