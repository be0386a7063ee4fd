"""What is missing of several results, with their outermost operations undone and without the poles of quotients."""

import random

import pytest

from rosslt import Source, math, track
from rosslt.values.graph import Graph
from rosslt.values.solve.budget import Budget
from rosslt.values.solve.equations import Equations

SOURCES = [Source('/equations', number) for number in range(3)]

QUOTIENTS = {
    'a constant over a source': lambda a, b, c: [2.0 / a + b],
    'a sum of quotients': lambda a, b, c: [b / a - c / b],
    'a quotient of quotients': lambda a, b, c: [(a / b) / (c / a)],
    'a product of quotients with one denominator': lambda a, b, c: [(b / a) * (c / a) - c],
    'below operations that are undone': lambda a, b, c: [math.atan(b / a + c) * 3.0 - 1.0],
    'of which the denominator is a sum': lambda a, b, c: [b / (a + c * a) + 1.0],
}


def equations_of(make, values):
    """The equations of results that are to become 0.1 more, before and after undoing."""
    results = make(*[track(value, source) for value, source in zip(values, SOURCES)])
    graph = Graph(results)
    goals = [('', result, float(result) + 0.1) for result in results]
    system = Equations(graph, goals, list(graph.occurrences), Budget(1e6), None)
    return system, system._undone(system.start)


@pytest.mark.parametrize('name', QUOTIENTS)
def test_what_is_missing_stays_finite_across_a_pole(name):
    """The pole lies where the source `a` is 0."""
    system, equations = equations_of(QUOTIENTS[name], (-0.5, 1.3, 0.7))
    place = system._unknowns.index(SOURCES[0])
    sides = []
    for value in (-1e-9, 1e-9):
        x = list(system.start)
        x[place] = value
        sides.append(system._missing(system._tried(x), equations)[0])
    before, after = sides
    assert abs(before) < 1e3
    assert before == pytest.approx(after, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize('name', QUOTIENTS)
def test_slopes_of_what_is_missing_are_those_of_small_differences(name):
    chance = random.Random(name)
    for _ in range(20):
        values = [chance.choice((-1, 1)) * chance.uniform(0.3, 2) for _ in SOURCES]
        system, equations = equations_of(QUOTIENTS[name], values)
        at = [value + chance.uniform(-0.1, 0.1) for value in system.start]
        (row,) = system._jacobian(system._tried(at), equations)
        for place in range(len(at)):
            low, high = list(at), list(at)
            low[place] -= 1e-6
            high[place] += 1e-6
            (before,), (after,) = (system._missing(system._tried(x), equations) for x in (low, high))
            assert row.get(place, 0.0) == pytest.approx((before - after) / 2e-6, rel=1e-4, abs=1e-5)
