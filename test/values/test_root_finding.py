"""Finding a number at which a function takes a wanted value."""

import math

import pytest

from rosslt.values.operations.inverses import NoPreimage
from rosslt.values.solve.budget import Budget, Exhausted
from rosslt.values.solve.root_finding import Search


def search(f, slope, wanted, low=-math.inf, high=math.inf):
    return Search(f, slope, wanted, lambda found: abs(found - wanted) <= 1e-9 * max(1.0, abs(wanted)), low, high)


def test_newton_meets_the_value_of_a_smooth_function_in_few_steps():
    calls = []

    def cube(x):
        calls.append(x)
        return x**3

    assert search(cube, lambda x: 3 * x * x, 8.0).descend(3.0) == pytest.approx(2.0, rel=1e-12)
    assert len(calls) < 25


def test_newton_halves_a_step_that_makes_things_worse():
    # From 2, full steps of Newton's method on atan go ever further away.
    assert search(math.atan, lambda x: 1 / (1 + x * x), 0.0).descend(2.0) == pytest.approx(0.0, abs=1e-9)


def test_newton_stops_where_there_is_no_slope():
    assert search(lambda x: x * x + 1, lambda x: 2 * x, 0.0).descend(0.0) == 0.0


def test_newton_keeps_to_the_limits():
    assert search(lambda x: x, lambda x: 1.0, 5.0, -1.0, 2.0).descend(0.0) == 2.0


def test_of_several_answers_the_one_nearest_the_start_is_taken():
    found = search(math.sin, math.cos, 0.9)
    assert found.near(0.2) == pytest.approx(math.asin(0.9), abs=1e-8)
    assert found.near(1.5) == pytest.approx(math.asin(0.9), abs=1e-8)
    assert found.near(6.0) == pytest.approx(math.asin(0.9) + 2 * math.pi, abs=1e-8)


def test_an_answer_is_found_where_the_slope_leads_away_from_it():
    # From 3 the slope leads down to the minimum at 2; the answer lies beyond the maximum at -2.
    f, slope = (lambda x: x**3 / 3 - 4 * x), (lambda x: x * x - 4)
    assert f(search(f, slope, -20.0).near(3.0)) == pytest.approx(-20.0)


def test_a_value_that_is_only_touched_is_found():
    found = search(lambda x: (x - 3) ** 2 + 1, lambda x: 2 * (x - 3), 1.0).near(0.0)
    assert found == pytest.approx(3.0, abs=1e-4)


def test_a_pole_is_no_answer():
    with pytest.raises(NoPreimage, match='no nearer'):
        search(lambda x: 1 / x if x else math.inf, lambda x: -1 / x / x, 0.0, -5.0, 5.0).near(1.0)


def test_what_is_out_of_reach_is_refused_with_how_near_it_came():
    with pytest.raises(NoPreimage, match='no nearer than 2'):
        search(lambda x: x * x + 2, lambda x: 2 * x, 1.0).near(0.7)
    with pytest.raises(NoPreimage, match='defined nowhere near'):
        search(lambda x: math.sqrt(-1.0), lambda x: 0.0, 1.0).near(0.7)


def test_answers_are_within_the_limits():
    assert search(math.sin, math.cos, 0.5, 2.0, 3.0).near(2.9) == pytest.approx(math.pi - math.asin(0.5))
    with pytest.raises(NoPreimage):
        search(math.sin, math.cos, 0.5, 3.0, 4.0).near(3.5)


def test_whole_numbers_are_found_exactly():
    big = 10**40
    exact = Search(lambda n: n * n + n, lambda n: 2 * n + 1, big * big + big, lambda found: found == big * big + big)
    assert exact.near(3) == big
    steps = Search(lambda n: n // 7, lambda n: 0, 5, lambda found: found == 5)
    assert steps.near(1) == 35
    with pytest.raises(NoPreimage):
        Search(lambda n: 2 * n, lambda n: 2, 7, lambda found: found == 7).near(0)


def test_a_search_ends_with_its_budget_and_says_so():
    budget = Budget(50)

    def costly(x):
        budget.spend(1)
        return x * x + 1

    with pytest.raises(NoPreimage, match='given up'):
        search(costly, lambda x: 2 * x, 0.0).near(1.0)
    with pytest.raises(Exhausted):
        costly(1.0)
