"""What the compiled core does while several sources are solved for is what Python does, to the last bit."""

import functools
import operator
import random

import pytest

from rosslt import Source, math, track
from rosslt.values.accelerator import CORE
from rosslt.values.graph import Graph
from rosslt.values.solve import least_squares
from rosslt.values.solve.budget import Budget, Trial
from rosslt.values.solve.freedom import Freedom
from rosslt.values.solve.system import System

SOURCES = [Source('/n', number) for number in range(4)]
OPERATORS = [operator.add, operator.sub, operator.mul, operator.truediv]


def expressions(chance, count):
    values = [track(chance.uniform(-2, 2), source) for source in SOURCES]
    while len(values) < len(SOURCES) + 40:
        a = chance.choice(values)
        b = chance.choice([chance.choice(values), chance.uniform(-2, 2), chance.randint(1, 4)])
        made = chance.choice([operator.neg, math.sin, math.cos])(a) if chance.random() < 0.3 else None
        if made is None:
            pair = chance.choice([(a, b), (b, a)])
            made = chance.choice(OPERATORS)(*pair) if pair[1] != 0 else a
        if abs(made) < 1e6:
            values.append(made)
    return values[-count:]


def without_tape(results, point):
    return seen(results, point, lambda system: setattr(system._trial, 'tape', None))


def seen(results, point, prepare=lambda system: None):
    """The values of the nodes, the slopes and what is left of the budget, or the error that there is instead."""
    graph = Graph(results)
    goals = [('', result, 1.0) for result in results]
    budget = Budget(1e9)
    freedom = Freedom(None, {}, (), lambda source: 0, {})
    system = System(graph, goals, [one for one in SOURCES if one in graph.occurrences], freedom, budget)
    assert CORE is None or system._trial.tape is not None
    prepare(system)
    try:
        values = system._trial.values(dict(zip(system._unknowns, point)))
        rows = system._jacobian(values, system._equations)
    except (ArithmeticError, ValueError) as error:
        return type(error)
    return repr((values, [sorted(row.items()) for row in rows], budget.left))


@pytest.mark.parametrize('count', [1, 3, 9])
def test_values_and_slopes_are_the_same(count):
    chance, compared = random.Random(count), 0
    for _ in range(100):
        results = expressions(chance, count)
        for _ in range(4):
            point = [chance.choice([0.0, chance.uniform(-3, 3), 1e-300, 1e200]) for _ in SOURCES]
            assert seen(results, point) == without_tape(results, point)
            compared += 1
    assert compared == 400


def test_a_division_by_zero_is_the_same_error():
    x, y = track(1.0, SOURCES[0]), track(2.0, SOURCES[1])
    results = [math.sin(x) / y, x * y]
    assert seen(results, [1.0, 0.0]) is without_tape(results, [1.0, 0.0]) is ZeroDivisionError


def test_slopes_that_are_whole_numbers_of_many_digits_are_the_same():
    x, y = track(1.0, SOURCES[0]), track(2.0, SOURCES[1])
    many = functools.reduce(lambda total, _: total * 3 + math.sin(total) / y, range(40), x)
    many = functools.reduce(lambda total, _: total - many, range(5), -many)
    shared = functools.reduce(lambda total, _: (total + x) * 3, range(60), y * x)
    for results in ([many], [many, shared], [many, shared, x * y]):
        assert seen(results, [0.1, 0.7]) == without_tape(results, [0.1, 0.7])


def test_a_slope_too_small_for_a_float_is_left_out():
    x, y = track(1.0, SOURCES[0]), track(2.0, SOURCES[1])
    results = [math.sin(x) * 1e-200 * 1e-123 + y * 1e200, y]
    assert seen(results, [0.1, 0.7]) == without_tape(results, [0.1, 0.7])


@pytest.mark.parametrize(('value', 'by'), [(1, 0.5), (0.5, 2**70), (0.5, 2**53 + 1), (0.5, True)])
def test_whole_numbers_are_left_to_python(value, by):
    graph = Graph([track(value, SOURCES[0]) * by])
    assert CORE is None or CORE.tape(graph.steps(), graph.records, graph.plain()) is None


@pytest.mark.parametrize('value', [3, 2**70, True])
def test_a_whole_number_where_a_float_was_is_the_same(value):
    graph = Graph([track(0.5, SOURCES[0]) * 3])
    trial = Trial(graph, SOURCES[:1], [1], graph.plain(), Budget(1e9))
    assert CORE is None or trial.tape is not None
    assert repr(trial.values({SOURCES[0]: value})) == repr([value, value * 3])


@pytest.mark.parametrize(('height', 'width'), [(1, 1), (3, 7), (7, 3), (12, 6), (6, 6), (4, 40), (40, 4)])
def test_steps_are_the_same(height, width, monkeypatch):
    chance = random.Random(height * 100 + width)
    for number in range(60):
        rows = [
            {
                place: chance.uniform(-1, 1) * 10 ** chance.uniform(-3, 3)
                for place in range(width)
                if chance.random() < 0.8
            }
            for _ in range(height)
        ]
        missing = [chance.uniform(-1, 1) for _ in range(height)]
        scales = [chance.uniform(0.1, 10) for _ in range(width)]
        assert_same_step(monkeypatch, rows, missing, scales, [0.0, 1e-6, 1.0][number % 3], bool(number % 2))


@pytest.mark.parametrize(
    ('rows', 'missing'),
    [
        ([{0: 1.0, 1: 5e-324}, {2: 3.0}, {0: 2.0, 2: 1.0}, {0: 1e3}], [1.0] * 4),  # what is scaled is 0
        ([{0: 1e-140, 1: 2e-140}, {2: 3.0}], [1e200, 1.0]),  # what is missing is infinite
        ([{0: 1e-140}, {2: 3.0}, {2: 1.0}, {2: 2.0}], [1e200, 1.0, 1.0, 1.0]),
        ([{0: 1e-200}, {2: 3.0}], [1.0, 1.0]),
        ([{}, {2: 3.0}], [1.0, 1.0]),
    ],
)
def test_steps_out_of_the_range_of_floats_are_the_same(rows, missing, monkeypatch):
    for damping in (0.0, 1.0):
        for by_row in (False, True):
            assert_same_step(monkeypatch, rows, missing, [0.5, 0.5, 2.0], damping, by_row)


def assert_same_step(monkeypatch, *arguments):
    found = []
    for core in (CORE, None):
        monkeypatch.setattr(least_squares, 'CORE', core)
        try:
            found.append(repr(least_squares.shortest_step(*arguments)))
        except (ArithmeticError, ValueError) as error:
            found.append(type(error))
    assert found[0] == found[1]
