"""What tracking costs: recording, reapplying and solving, as ratios to the same loop on plain floats.

Run as `./run bench values`. Each figure is the best of several, with the garbage collector off, as `timeit` has it,
where the line does not say otherwise. With ROSSLT_PURE=1 it measures the Python without the compiled core. The other
libraries in docs/performance.md were measured with the same loop.
"""

import gc
import operator
import random
import time

from rosslt import Source, evaluate, math, solve, track
from rosslt.values import lazy
from rosslt.values.accelerator import CORE

A = Source('/bench', 1)
REPEATS = 60


def best(function, rounds, collecting=False):
    """The shortest time of one call, in seconds."""
    times = []
    for _ in range(REPEATS):
        gc.collect()
        if not collecting:
            gc.disable()
        try:
            start = time.perf_counter()
            for _ in range(rounds):
                function()
            times.append((time.perf_counter() - start) / rounds)
        finally:
            gc.enable()
    return min(times)


def chain(length):
    """Random + - * / with constants, as (function, constant)."""
    choose = random.Random(1)
    operators = [operator.add, operator.sub, operator.mul, operator.truediv]
    return [(choose.choice(operators), choose.uniform(0.5, 2.0)) for _ in range(length)]


def applied(x, operations):
    """The loop that everything is compared to."""
    for function, constant in operations:
        x = function(x, constant)
    return x


def row(name, seconds, plain, limit=None):
    """One line of the table."""
    print(
        '%-44s %9.2f us %7.2f %s'
        % (name, seconds * 1e6, seconds / plain, '' if limit is None else '(at most %g)' % limit)
    )


def chains():
    """The figures for 50 and for 5,000 operations on one value."""
    short, long = chain(50), chain(5000)
    x = track(0.3, A)
    value = applied(x, short)
    plain = best(lambda: applied(0.3, short), 300)
    print('with the compiled core' if CORE else 'in Python alone')
    print('%-44s %12s %7s' % ('50 random + - * / on one value', 'best time', 'ratio'))
    row('plain floats', plain, plain)
    record = best(lambda: applied(x, short), 50)
    row('record', record, plain, 3.5)
    row('reapply', best(lambda: evaluate(value, {A: 0.4}), 100), plain, 2)
    row('solve back', best(lambda: solve(value, 5.0), 100), plain, 3)
    many = best(lambda: applied(x, long), 1)
    print('%-44s %20.2f (at most 1.3)' % ('record, per operation, 5000 against 50', many / 100 / record))
    collecting = best(lambda: applied(x, long), 1, True) / 100 / best(lambda: applied(x, short), 50, True)
    print('%-44s %20.2f (at most 1.3)' % ('the same, garbage collector on', collecting))
    row('a lazy value', best(lambda: lazy([0.5], [None]), 500), plain)
    try:
        from uncertainties import ufloat
    except ImportError:
        print('%-44s %12s' % ('uncertainties, record', 'not installed'))
    else:
        number = ufloat(0.3, 0.01)
        row('uncertainties, record', best(lambda: applied(number, short), 5), plain)


def forward_kinematics(numpy, joints):
    """The pose of a 6-joint arm's tip: a chain of six 4x4 object-array products."""
    pose = None
    for angle, axis, length in zip(joints, 'zyyzyz', (0.3, 0.4, 0.35, 0.2, 0.1, 0.08)):
        c, s = math.cos(angle), math.sin(angle)
        step = numpy.array(
            [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, length], [0.0, 0.0, 0.0, 1.0]]
            if axis == 'z'
            else [[c, 0.0, s, s * length], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, c * length], [0.0, 0.0, 0.0, 1.0]],
            dtype=object,
        )
        pose = numpy.identity(4).astype(object) @ step if pose is None else pose @ step
    return pose


def arm():
    """The figures for the arm."""
    try:
        import numpy
    except ImportError:
        print('6-joint arm: needs NumPy')
        return
    joints = [track(angle, Source('/arm', number)) for number, angle in enumerate((0.1, 0.4, 0.5, 0.2, 0.3, 0.1))]
    tip = forward_kinematics(numpy, joints)[:3, 3]
    target = [float(at) + shift for at, shift in zip(tip, (0.05, 0.1, -0.08))]
    print(
        '%-44s %9.2f ms %7s (at most 2)'
        % ('6-joint arm, record', 1e3 * best(lambda: forward_kinematics(numpy, joints), 2), '')
    )
    print(
        '%-44s %9.2f ms %7s (at most 50)'
        % ('6-joint arm, solve the tip for all joints', 1e3 * best(lambda: solve(tip, target), 1), '')
    )


def loops():
    """The figures for values that are updated for ever: the time per step must not grow."""
    x0, v, c = track(0.3, A), track(2.0, Source('/bench', 2)), track(0.1, Source('/bench', 3))
    updates = {
        'x + v * dt': lambda x: x + v * 0.02,
        'a * y + (1 - a) * x': lambda x: 0.9 * x + (1 - 0.9) * v,
        'x * k': lambda x: x * 1.0001,
        'sin(x) + c': lambda x: math.sin(x) + c,
    }
    print('%-44s %12s %12s' % ('100,000 steps of, best tenth of the', 'first half', 'second half'))
    for name, update in updates.items():
        x, times = x0, []
        for _ in range(10):
            start = time.perf_counter()
            for _ in range(10_000):
                x = update(x)
            times.append((time.perf_counter() - start) / 10_000)
        print('%-44s %9.2f us %9.2f us' % (name, min(times[:5]) * 1e6, min(times[5:]) * 1e6))


if __name__ == '__main__':
    chains()
    arm()
    loops()
