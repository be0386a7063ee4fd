"""What the compiled core does while several sources are solved for is what Python does, to the last bit."""

import operator
import random

import pytest

from rosslt import Source, math, track
from rosslt.values.accelerator import CORE
from rosslt.values.graph import Graph
from rosslt.values.solve import least_squares
from rosslt.values.solve.budget import Budget
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
    assert system._trial.is_fast()
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


@pytest.mark.parametrize('values', [[1, 0.5], [0.5, 2**70]])
def test_whole_numbers_are_left_to_python(values):
    graph = Graph([track(values[0], SOURCES[0]) * values[1]])
    assert CORE is None or values[0] != 1 or CORE.tape(graph.steps(), graph.records, graph.plain()) is None
    assert CORE is None or values[1] == 0.5 or CORE.tape(graph.steps(), graph.records, graph.plain()) is None


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
        arguments = rows, missing, scales, [0.0, 1e-6, 1.0][number % 3], bool(number % 2)
        found = []
        for core in (CORE, None):
            monkeypatch.setattr(least_squares, 'CORE', core)
            try:
                found.append(repr(least_squares.shortest_step(*arguments)))
            except (ArithmeticError, ValueError) as error:
                found.append(type(error))
        assert found[0] == found[1]
