"""The fewest waypoints that say a movement: each pose stays within the tolerance of the way between them."""

import math
import random

import numpy
import pytest

from rosslt.teach.thinning import distances, thinned

TOLERANCE, LEVER = 0.005, 0.1


def pose(x=0.0, y=0.0, z=0.0, yaw=0.0):
    return x, y, z, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)


def nearest(one, first, last):
    """The distance of a pose from the way between two others, found by trying many places on it."""
    best = math.inf
    (*_, z1, w1), (*_, z2, w2), (*_, z, w) = first, last, one
    start = 2 * math.atan2(z1, w1)
    way = math.remainder(2 * math.atan2(z2, w2) - start, 2 * math.pi)
    for part in numpy.linspace(0.0, 1.0, 1001):
        there = [a + part * (b - a) for a, b in zip(first[:3], last[:3])]
        angle = math.remainder(2 * math.atan2(z, w) - start - part * way, 2 * math.pi)
        best = min(best, math.hypot(math.dist(one[:3], there), LEVER * angle))
    return best


@pytest.mark.parametrize('seed', range(20))
def test_random_curves_stay_within_the_tolerance(seed):
    chance = random.Random(seed)
    waves = [
        [(chance.uniform(0.0, 0.3), chance.uniform(1.0, 6.0), chance.uniform(0.0, 6.0)) for _ in '123'] for _ in '1234'
    ]
    led = []
    for step in range(300):
        x, y, z, yaw = (sum(a * math.sin(f * step / 300 + p) for a, f, p in wave) for wave in waves)
        led.append(pose(x + chance.gauss(0.0, 0.0005), y, z, 3.0 * yaw))
    kept = thinned(led, TOLERANCE, LEVER)
    assert kept == sorted(set(kept))
    assert (kept[0], kept[-1]) == (0, 299)
    assert len(kept) < 150
    for first, last in zip(kept, kept[1:]):
        for one in led[first : last + 1]:
            assert nearest(one, led[first], led[last]) <= TOLERANCE + 1e-9


@pytest.mark.parametrize('seed', range(20))
def test_a_minute_of_reaches_becomes_few_waypoints(seed):
    """Reaches of a hand between places, as bowed as those of an arm are, with pauses, at 50 Hz."""
    chance = random.Random(seed)
    count = chance.randint(2, 5)
    places = [[chance.uniform(-0.4, 0.4) for _ in 'xyz'] + [chance.uniform(-0.7, 0.7)] for _ in range(count + 1)]
    bows = [[chance.uniform(-0.02, 0.02) for _ in 'xyz'] for _ in range(count)]
    led = []
    for first, last, bow in zip(places, places[1:], bows):
        for step in range(3000 // count):
            t = min(1.0, step * count / 2400)
            s = t**3 * (10 - 15 * t + 6 * t**2)
            x, y, z, yaw = (a + s * (b - a) + 4 * s * (1 - s) * off for a, b, off in zip(first, last, [*bow, 0.0]))
            led.append(pose(x, y, z, yaw))
    kept = thinned(led, 0.8 * TOLERANCE, LEVER)
    assert len(kept) - 1 <= 20, 'the first is there already'
    for first, last in zip(kept, kept[1:]):
        assert max(distances(led[first : last + 1], LEVER)) <= 0.8 * TOLERANCE + 1e-9


def test_a_straight_line_is_its_two_ends_at_any_speed():
    led = [pose(s**3, 2.0 * s**3, 0.0, s**3) for s in numpy.linspace(0.0, 1.0, 200)]
    assert thinned(led, TOLERANCE, LEVER) == [0, 199]


def test_repeats_and_pauses_add_none():
    once = [pose(n / 100) for n in range(100)] + [pose(0.99, n / 100) for n in range(100)]
    led = [one for n, one in enumerate(once) for _ in range(50 if n in (0, 30, 99, 150, 199) else 1 + n % 3)]
    places = [led[index][:3] for index in thinned(led, TOLERANCE, LEVER)]
    assert len(places) == 3
    assert math.dist(places[1], (0.99, 0.0, 0.0)) <= TOLERANCE


def test_a_way_back_over_the_same_line_is_kept():
    xs = [n / 100 for n in [*range(100), *range(100, 50, -1), *range(50, 200)]]
    places = [round(xs[index], 2) for index in thinned([pose(x) for x in xs], TOLERANCE, LEVER)]
    assert places == [0.0, 1.0, 0.5, 1.99]


def test_a_turn_on_the_spot_counts_by_the_lever():
    led = [pose(yaw=0.5 * math.sin(n / 50)) for n in range(200)]
    assert len(thinned(led, TOLERANCE, LEVER)) == 3
    assert thinned(led, TOLERANCE, 0.001) == [0]


def test_a_whole_turn_is_kept_as_parts_of_less_than_half_of_one():
    led = [pose(yaw=2 * math.pi * n / 100) for n in range(101)]
    kept = thinned(led, TOLERANCE, LEVER)
    assert all(later - sooner < 50 for sooner, later in zip(kept, kept[1:]))


def test_the_sign_of_a_quaternion_does_not_count():
    led = [pose(n / 100, yaw=n / 100) for n in range(100)]
    led = [(*one[:3], *(-part for part in one[3:])) if n % 2 else one for n, one in enumerate(led)]
    assert thinned(led, TOLERANCE, LEVER) == [0, 99]


def test_what_does_not_move_is_one_waypoint_and_nothing_is_none():
    assert thinned([], TOLERANCE, LEVER) == []
    assert thinned([pose(1.0)], TOLERANCE, LEVER) == [0]
    assert thinned([pose(1.0 + 0.004 * (n % 2)) for n in range(50)], TOLERANCE, LEVER) == [0]
    assert len(thinned([pose(), pose(1.0), pose()], TOLERANCE, LEVER)) == 3


def test_distances_are_from_the_nearest_place_not_behind_the_last():
    assert distances([pose(), pose(0.5, 0.1), pose(0.2), pose(1.0)], LEVER) == pytest.approx([0.0, 0.1, 0.3, 0.0])
