"""A value that is updated in a loop does not grow: not its expression, not its memory, not its explanation."""

import copy
import gc
import importlib
import os
import pickle
import random
import sys
import tracemalloc

import pytest

from rosslt import Source, evaluate, explain, math, solve, sources, track
from rosslt.values import affine, disassemble, linearized
from rosslt.values.affine import LIMIT

folding = importlib.import_module('rosslt.values.affine')  # the door has a function of that name

STEPS = 100_000 if os.environ.get('ROSSLT_MANY_EXAMPLES') else 20_000  # more than twice what is kept
A, B, C = Source('/node', 1), Source('/node', 2), Source('/node', 3)


def integrated(x, v, c):
    return x + v * 0.02


def low_passed(x, v, c):
    return 0.9 * x + (1 - 0.9) * v


def multiplied(x, v, c):
    return x * 1.0001


def fed_back(x, v, c):
    return math.sin(x) + c


LOOPS = [integrated, low_passed, multiplied, fed_back]


def run(update, steps=STEPS):
    x, v, c = track(0.3, A), track(2.0, B), track(0.1, C)
    for _ in range(steps):
        x = update(x, v, c)
        yield x


@pytest.mark.parametrize('update', LOOPS)
def test_a_long_loop_stays_small(update):
    sizes = []
    for step, x in enumerate(run(update)):
        if step % 1999 == 0:
            sizes.append(len(disassemble([x])[0]))
            assert len(explain(x)) < 1000
    assert max(sizes) <= LIMIT + 4
    assert len(pickle.dumps(x)) < 100 * LIMIT
    assert copy.deepcopy([x])[0] == x
    assert pickle.loads(pickle.dumps(x)) == x
    assert evaluate(x, {}) == x


@pytest.mark.parametrize('update', LOOPS)
def test_the_memory_of_a_loop_does_not_grow(update):
    tracemalloc.start()
    try:
        most = []
        for step, _ in enumerate(run(update, 5 * LIMIT)):
            if step % 1000 == 0:
                most.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    half = len(most) // 2
    assert max(most[half:]) < 1.2 * max(most[:half]) + 100_000
    assert max(most) < 10_000_000


def test_a_loop_that_folds_is_still_solved_exactly():
    *_, x = run(integrated)
    assert sources(x) == [A, B]
    assert evaluate(x, {A: 1.3}) == pytest.approx(x + 1.0, rel=1e-9)
    assert evaluate(x, {B: 1.0}) == pytest.approx(0.3 + 0.02 * STEPS, rel=1e-9)
    assert solve(x, 5000.3) == {A: pytest.approx(5000.3 - 2.0 * 0.02 * STEPS, rel=1e-9)}
    assert solve(x, 5000.3, B) == {B: pytest.approx(5000 / (0.02 * STEPS), rel=1e-9)}
    assert 'linearized' not in explain(x)

    *_, x = run(multiplied)
    assert solve(x, 1.0) == {A: pytest.approx(1.0001**-STEPS, rel=1e-8)}

    *_, x = run(low_passed)
    assert solve(x, 3.0) == {B: pytest.approx(3.0, rel=1e-9)}


def test_whole_numbers_fold_exactly():
    n, step = track(3, A), track(10**20, B)
    for _ in range(3 * LIMIT):
        n = n + step * 3 - 1
    assert affine(n) == ((A, 3, 1), (B, 10**20, 9 * LIMIT))
    assert solve(n, 9 * LIMIT * (10**20 + 1) + 3 - 3 * LIMIT, B) == {B: 10**20 + 1}


def test_a_whole_number_that_no_float_holds_folds_exactly_beside_a_zero():
    n = track(2**53 + 2, A)
    assert repr([affine(n * 0), affine(0 * n)]) == repr([((A, 2**53 + 2, 0),)] * 2)
    assert repr(affine(n * 0.0)) == repr(((A, 2**53 + 2, 0.0),))


def test_a_source_that_was_linearized_itself_stays_in_what_is_made_of_it():
    x, y = track(0.5, A), track(2.0, B)
    assert linearized(x) == ((A, 0.5, 1),)
    assert [source for source, _, _ in linearized(math.sin(x) + y * y)] == [A, B]


def test_what_cannot_fold_is_linearized_and_says_so():
    *_, x = run(fed_back, LIMIT)
    assert 'linearized' in explain(x)
    assert affine(x) is None
    assert sources(x) == [A, C]
    ((source, new),) = solve(x, x + 1e-3).items()
    assert source == C
    assert new == pytest.approx(0.1 + 1e-3 * (1 - math.cos(x - 0.1)), rel=1e-2)


def test_a_position_built_from_an_angle_stays_small():
    angle, x, y = track(0.1, A), track(0.0, B), track(0.0, C)
    for step in range(STEPS):
        angle = angle + 0.01
        x = x + math.cos(angle) * 0.1
        y = y + math.sin(angle) * 0.1
        if step % 1999 == 0:
            assert len(disassemble([angle, x, y])[0]) <= 3 * LIMIT
            assert len(explain(x)) < 1000
    assert sources(x) == [B, A]
    assert solve(angle, 2.0) == {A: pytest.approx(2.0 - 0.01 * STEPS)}
    assert solve(x, x + 0.5) == {B: pytest.approx(0.5)}


def test_a_state_whose_parts_feed_each_other_stays_small():
    state = [track(1.0, A), track(0.5, B), track(0.2, C)]
    for _ in range(3000):
        a, b, c = state
        state = [0.9 * a + 0.05 * b * c, 0.8 * b + 0.1 * a, 0.99 * c + 0.01 * math.sin(a)]
    assert len(disassemble(state)[0]) <= 3 * LIMIT
    assert evaluate(state, {}) == state


def test_a_text_that_is_appended_to_stays_bounded():
    text = track('', A)
    for _ in range(LIMIT + 100):
        text = text + 'a'
    assert text == 'a' * (LIMIT + 100)
    assert len(disassemble([text])[0]) <= LIMIT


def test_nothing_recurses_into_a_deep_expression():
    x = y = track(0.3, A)
    depth = LIMIT - 10
    assert depth > 2 * sys.getrecursionlimit()
    for number in range(depth // 2):
        x = (x + 0.001) * 0.9999
        y = math.sin(y) + x * 1e-9 if number % 100 == 0 else y * 0.999
    for value in (x, y):
        for other in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert other == value
            assert evaluate(other, {A: 0.2}) == evaluate(value, {A: 0.2})
        explain(value)
        assert solve(value, value * 1.01)
        assert sources(value) == [A]
    del x, y, value, other
    gc.collect()


def summed(n):
    return sum(track(float(number), Source('/node', number)) for number in range(n))


def always_a_new_source(n):
    x = track(0.0, Source('/node', 0))
    for number in range(1, n):
        x = x * 0.999 + track(float(number), Source('/node', number))
    return x


def always_a_new_source_that_cannot_fold(n):
    x = track(0.0, Source('/node', 0))
    for number in range(1, n):
        x = math.sin(x) + track(float(number), Source('/node', number))
    return x


@pytest.fixture
def visits(monkeypatch):
    """How often folding has looked at a node, in a list of one number."""
    count = [0]

    def counted(function):
        def call(*arguments):
            count[0] += 1
            return function(*arguments)

        return call

    monkeypatch.setattr(folding, 'CORE', None)
    for name in ('resolve', '_is_exact'):  # a walk calls one for each node, a sweep the other
        monkeypatch.setattr(folding, name, counted(getattr(folding, name)))
    return count


def covariance(steps):
    """P = F P F' + Q of three states, by scalars; F has sources, too."""
    size, where = range(3), (Source('/filter', number) for number in range(15))
    f = [[track(1.0 if i == j else 0.01 * (j - i), next(where)) for j in size] for i in size]
    q = [track(0.01 * (i + 1), next(where)) for i in size]
    p = [[track(1.0, next(where)) if i == j else 0.0 for j in size] for i in size]
    for _ in range(steps):
        fp = [[sum(f[i][k] * p[k][j] for k in size) for j in size] for i in size]
        p = [[0.9 * sum(fp[i][k] * f[j][k] for k in size) + (q[i] if i == j else 0.0) for j in size] for i in size]
    return p, steps * 117


def tree(nodes):
    """Nodes of a planner, each a step from one of those before it, with what it costs to get there."""
    chance, step, x, y = random.Random(1), track(0.1, A), track(0.0, B), track(0.0, C)
    found = [(x, y, track(0.0, Source('/tree', 1)))]
    for _ in range(nodes):
        x, y, cost = found[-1 - int(chance.random() ** 4 * len(found))]
        to = chance.uniform(-9, 9), chance.uniform(-9, 9)
        away = math.hypot(to[0] - x, to[1] - y)
        found.append((x + (to[0] - x) / away * step, y + (to[1] - y) / away * step, cost + away * 0.5))
    return found, nodes * 13


def position(steps):
    """x = x + v * dt."""
    x, v, dt = track(0.0, A), track(2.0, B), 0.02
    for _ in range(steps):
        x = x + v * dt
    return x, steps * 2


@pytest.mark.parametrize(('make', 'count', 'most'), [(covariance, 450, 12), (tree, 4500, 4), (position, 20_000, 4)])
def test_each_operation_is_folded_once_whatever_the_shape(make, count, most, visits):
    """Nine values are swept at each border of a covariance, one or two of the others."""
    _, operations = make(count)
    assert visits[0] < most * operations


@pytest.mark.parametrize('make', [covariance, tree])
def test_what_was_folded_at_its_older_half_foretells_small_changes(make):
    values, _ = make(400)
    last = values[-1][-1]
    source, at, slope = linearized(last)[0]
    assert evaluate(last, {source: at + 1e-5}) == pytest.approx(last + 1e-5 * slope, rel=1e-6)


@pytest.mark.parametrize('make', [summed, always_a_new_source, always_a_new_source_that_cannot_fold])
def test_folding_many_sources_takes_bounded_work_for_each(make, visits):
    value = make(20_000)
    assert len(sources(value)) == 20_000
    assert visits[0] / 20_000 < 30


@pytest.mark.parametrize('make', [summed, always_a_new_source])
def test_many_sources_take_memory_in_proportion_to_them(make):
    peaks = {}
    for n in (5_000, 20_000):
        tracemalloc.start()
        try:
            value = make(n)
            assert len(affine(value)) == n
            peaks[n] = tracemalloc.get_traced_memory()[1] / n
        finally:
            tracemalloc.stop()
    assert peaks[20_000] < 1.5 * peaks[5_000]
    assert peaks[20_000] < 4000  # bytes


@pytest.mark.slow
def test_adding_a_value_of_many_sources_again_and_again_stays_bounded():
    many, x = summed(5_000), track(0.0, A)
    for _ in range(STEPS):
        x = x + many
    assert len(disassemble([x])[0]) < 3 * 5_000 + LIMIT
    assert solve(x, x + STEPS, Source('/node', 7)) == {Source('/node', 7): pytest.approx(8.0)}
