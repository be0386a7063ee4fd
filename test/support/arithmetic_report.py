"""Prints what random arithmetic of tracked values gives, and all that is known of each result.

A program of its own: run with the compiled core of the room `values` and without it, it prints the same.
"""

import copy
import math
import operator
import pickle
import random
import sys

from rosslt import Error, Source, evaluate, explain, is_tracked, solve, sources, track
from rosslt.values import MATH, affine, disassemble, lazy, reapply, to_float, to_int
from rosslt.values.recording import make

SOURCES = [Source('/node', number) for number in range(3)]
EXTREMES = [
    0.0,
    -0.0,
    5e-324,
    1e308,
    -1e300,
    math.inf,
    math.nan,
    2.0**53,
    0,
    1,
    -1,
    2**30,
    -(2**31),
    2**63,
    10**40,
    True,
]
BINARY = [
    *[operator.add, operator.sub, operator.mul, operator.truediv] * 3,
    operator.floordiv,
    operator.mod,
    divmod,
    operator.and_,
    operator.pow,
    MATH['atan2'],
    MATH['hypot'],
    MATH['log'],
    MATH['ldexp'],
]
UNARY = [
    *[operator.neg, operator.pos, abs, abs, round, math.floor, int, float, bool],
    *[MATH['sin'], MATH['sqrt'], MATH['log'], MATH['hypot'], MATH['floor'], to_int, to_float],
]


def number(choose):
    """A plain number, or seldom a text."""
    kind = choose.random()
    if kind < 0.6:
        return choose.randint(-10_000, 10_000) / 1000
    if kind < 0.8:
        return choose.randint(-20, 20)
    return 'a_' if kind > 0.99 else choose.choice(EXTREMES)


def outcome(function, *operands):
    """What a function gives, or what it raises."""
    try:
        return function(*operands)
    except (ArithmeticError, ValueError, TypeError, Error) as error:
        return '%s: %s' % (type(error).__name__, error)


def is_small(value):
    """Whether a value may be an operand: nothing of thousands of digits."""
    return not isinstance(value, int) or value.bit_length() < 2000


def leaf(choose, source):
    """A tracked value that is read, or received."""
    value = number(choose)
    if choose.random() < 0.8:
        return track(value, source)
    return lazy([value], [lambda plain: track(plain, source)])[0]


def report(value, other, target):
    """All that is known of a tracked value."""
    print(type(value).__mro__[1].__name__, type(value).__name__, repr(value), repr(value._plain), value._size)
    print(
        ' ',
        explain(value),
        hash(value) == hash(value._plain),
        value == value._plain,
        outcome(operator.lt, value, 1),
        bool(value),
        str(value),
        f'{value}',
    )
    print(' ', disassemble([value]), sources(value), outcome(affine, value))
    changes = {SOURCES[0]: other}
    changed = outcome(reapply, value, changes)
    print(' ', repr(outcome(evaluate, value, changes)), explain(changed) if is_tracked(changed) else repr(changed))
    print(' ', outcome(solve, value, target), outcome(solve, value, value._plain))
    again = pickle.loads(pickle.dumps(value))
    print(' ', explain(again), again._size, type(again) is type(value), copy.deepcopy(value) is value)
    kind = type(value)
    print(' ', kind.__name__, kind.__module__, isinstance(value, (float, int)), type(kind(0)), kind.__mul__(value, 2))


def main(rounds, seed):
    """Report on some random expressions."""
    choose = random.Random(seed)
    for _ in range(rounds):
        pool = [leaf(choose, source) for source in SOURCES[: choose.choice([1, 1, 1, 2, 3])]]
        for _ in range(choose.choice([1, 2, 4, 8, 30])):
            a, b = choose.choice(pool[-3:]), choose.choice(pool) if choose.random() < 0.3 else number(choose)
            if choose.random() < 0.2:
                made = outcome(choose.choice(UNARY), a)
            else:
                function = choose.choice(BINARY)
                if function is operator.pow:
                    b = choose.choice([2, 3, 0.5, -1])
                made = outcome(function, *((a, b) if choose.random() < 0.6 else (b, a)))
            for part in made if isinstance(made, tuple) else (made,):
                if is_tracked(part) and is_small(part):
                    pool.append(part)
                else:
                    print(type(part).__name__, repr(part)[:100])
        report(pool[-1], choose.choice([0.25, -3.5, 2, 0]), choose.choice([0.5, -2.25, 100.0, 3]))
    value = track(1.5, SOURCES[0])
    print([make(complex(1), value._record, 1), make(True, value._record, 1), make('a', value._record, 1)])
    # far beyond the size at which expressions are folded
    for step in (lambda x: x + 0.5, lambda x: x + value, lambda x: MATH['sin'](x) + value, lambda x: 1.0 - x * value):
        grown = value
        for _ in range(20_000):
            grown = step(grown)
        print(repr(grown), grown._size, explain(grown)[:200])


if __name__ == '__main__':
    main(int(sys.argv[1]), int(sys.argv[2]))
