"""How near sources bring results to what cannot be met, and how they move them."""

import math as plain_math
import random

import pytest

from rosslt import Source, evaluate, math, track
from rosslt.values import effects, nearest, slopes, source_values
from rosslt.values.tolerances import is_at

A, B, C = Source('/arm', 1), Source('/arm', 2), Source('/arm', 3)


def tip(shoulder, elbow):
    first, second = track(shoulder, A), track(elbow, B)
    return [
        1.2 * math.cos(first) + 0.9 * math.cos(first + second),
        1.2 * math.sin(first) + 0.9 * math.sin(first + second),
    ]


@pytest.mark.parametrize('seed', range(40))
def test_an_arm_comes_as_near_as_its_reach_allows(seed):
    chance = random.Random(seed)
    target = [chance.uniform(-4, 4), chance.uniform(-4, 4)]
    arm = tip(chance.uniform(-3, 3), chance.uniform(-3, 3))
    changes, gap = nearest(arm, target)
    distance = plain_math.hypot(*target)
    assert gap == pytest.approx(max(0.0, distance - 2.1, 0.3 - distance), abs=1e-5)
    assert plain_math.dist(evaluate(arm, changes), target) == pytest.approx(gap, abs=1e-9)


def test_no_joint_of_an_arm_turns_more_than_half_a_turn():
    chance = random.Random(5)
    for _ in range(300):
        present = [chance.uniform(-3, 3), chance.uniform(-3, 3)]
        arm = tip(*present)
        reached = [plain_math.cos(0.5 * plain_math.pi * number) for number in (chance.random(), chance.random())]
        changes, _gap = nearest(arm, [chance.choice([1.0, 4.0]) * coordinate for coordinate in reached])
        for source, value in zip((A, B), present):
            assert abs(changes.get(source, value) - value) <= plain_math.pi + 1e-9


def test_effects_are_slopes_times_the_sizes_of_sources():
    number = 0.5 * track(4.0, C) - 3 * track(1.0, B) + 2 * track(9.0, A)
    found = effects(number, bounds={A: (0.0, 10.0), C: (0.0, 100.0)}, weights={C: 0.25})
    assert list(found.items()) == [(A, 20.0), (B, 3.0), (C, 2.0)]


def test_a_number_that_no_float_holds_stays():
    assert nearest([track(3, A) * 10**400], [5.0]) == ({}, float('inf'))


def test_a_drag_past_a_bound_goes_to_the_bound_exactly():
    x, y = track(1.0, A), track(1.0, B)
    assert nearest([2 * x], [10.0], bounds={A: (0.0, 1.7)}) == ({A: 1.7}, pytest.approx(6.6))
    changes, _ = nearest([x + y, 0.5 * x], [10.0, 0.5], bounds={A: (0.1, 2.3), B: (None, 3.1)})
    assert changes[B] == 3.1
    assert 0.1 <= changes[A] <= 2.3
    arm = tip(0.3, 0.5)
    changes, _gap = nearest(arm, [-1.0, 1.0], bounds={A: (0.0, 0.9), B: (0.0, 1.1)})
    assert changes == {A: 0.9, B: 1.1}


def test_a_bounded_answer_is_the_best_within_the_bounds():
    arm, bounds = tip(0.3, 0.5), {A: (-0.4, 1.0), B: (0.1, 1.4)}
    for target in ([1.0, 1.5], [2.5, 0.0], [0.5, -0.5], [0.0, 2.0]):
        _, gap = nearest(arm, target, bounds=bounds)
        best = min(
            plain_math.dist(evaluate(arm, {A: -0.4 + 1.4 * i / 60, B: 0.1 + 1.3 * j / 60}), target)
            for i in range(61)
            for j in range(61)
        )
        assert gap <= best + 1e-9


def test_what_depends_on_one_source_moves_along_its_line():
    x = track(1.0, A)
    changes, gap = nearest([x, 2 * x], [4.0, 1.0])
    assert changes[A] == pytest.approx(1.2)
    assert gap == pytest.approx(plain_math.hypot(2.8, 1.4))


def test_a_rounded_quaternion_is_met_as_well_as_it_can_be():
    angle = track(0.4, A)
    target = [plain_math.sin(0.45) * (1 + 3e-8), plain_math.cos(0.45) * (1 - 5e-8)]
    changes, gap = nearest([math.sin(angle / 2), math.cos(angle / 2)], target)
    assert changes[A] == pytest.approx(0.9, abs=1e-6)
    assert gap < 1e-7


def test_whole_numbers_stay_whole_and_texts_stay():
    changes, gap = nearest([track(3, A) * 0.5], [4.3])
    assert changes == {A: 9}
    assert type(changes[A]) is int
    assert gap == pytest.approx(0.2)
    assert nearest([math.hypot(track(True, B), 1.0)], [5.0])[0] == {}


def test_no_number_is_at_a_bound_that_there_is_not():
    assert all(is_at(5.0, bound) for bound in (5.0, 5.0 + 2**-50))
    assert not any(is_at(5.0, bound) for bound in (5.001, math.inf, -math.inf))


def test_what_cannot_come_nearer_stays():
    assert nearest([math.cos(track(0.0, A))], [3.0]) == ({}, 2.0)
    assert nearest([2 * track(1.0, A), 5.0], [2.0, 5.0]) == ({}, 0.0)
    assert nearest([track(1.0, A)], [2.0], read_only=[A]) == ({}, 1.0)
    assert nearest([1.5], [2.0]) == ({}, 0.5)


def test_whole_numbers_are_rounded_within_their_bounds():
    n = track(1, A)
    assert nearest([n * 1.0], [100.0], bounds={A: (0, 2.7)}) == ({A: 2}, 98.0)
    assert nearest([n * 1.0], [-100.0], bounds={A: (-1.7, None)}) == ({A: -1}, 99.0)
    assert nearest([n * 1.0], [0.0], bounds={A: (0.4, 0.6)}) == ({}, 1.0)


def test_only_the_chosen_sources_move():
    x, y = track(1.0, A), track(1.0, B)
    assert nearest([x + y], [5.0], sources=[B]) == ({B: pytest.approx(4.0)}, pytest.approx(0.0))
    assert nearest([x + y], [5.0], read_only={B})[0] == {A: pytest.approx(4.0)}


def test_a_straight_arm_bends():
    changes, gap = nearest(tip(0.0, 0.0), [1.5, 0.0])
    assert gap == pytest.approx(0.0, abs=1e-6)
    assert changes


def test_slopes_are_the_derivatives_of_every_value_for_every_number():
    x, n, word = track(0.3, A), track(2, B), track('a', C)
    found = slopes([n * math.sin(x), x + x, word, 7.0])
    assert list(found) == [B, A]
    assert found[A] == pytest.approx((2 * plain_math.cos(0.3), 2.0, 0.0, 0.0))
    assert found[B] == pytest.approx((plain_math.sin(0.3), 0.0, 0.0, 0.0))


def test_the_sources_values_are_known():
    assert source_values([2 * track(0.3, A) + track(1, B), 4.0, track('a', C)]) == {A: 0.3, B: 1, C: 'a'}
