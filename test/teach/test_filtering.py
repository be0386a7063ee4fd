"""A hand that trembles moves nothing at rest, and is followed as it moves. The stamps are made up."""

import math
import random

import pytest

from rosslt.teach.devices import Options
from rosslt.teach.filtering import Filter
from rosslt.teach.turning import rotation_vector

JITTER = 0.002  # m
SPEED = 0.25  # m/s
STILL = (0.0, 0.0, 0.0)


def regular(_):
    return 0.02


def irregular(chance):
    return 1.0 / chance.uniform(20.0, 200.0)


def with_gaps(chance):
    return 0.19 if chance.random() < 0.02 else irregular(chance)


STAMPS = pytest.mark.parametrize('period', [regular, irregular, with_gaps], ids=lambda period: period.__name__)
SEEDS = pytest.mark.parametrize('seed', range(4))


def filtered(period, seed, until, place, jitter):
    """Yield the time, where the hand is, and where the filter has it: in metres, from where the hand is at 0."""
    chance = random.Random(seed)
    smooth, now = Filter(Options().smooth), 0.0
    seen = began = [chance.uniform(-jitter, jitter) for _ in range(3)]
    at = seen
    while now < until:
        passed = period(chance)
        now += passed
        before, seen = seen, [chance.uniform(-jitter, jitter) for _ in range(3)]
        seen[0] += place(now)
        move, _ = smooth.step(tuple(b - a for a, b in zip(before, seen)), STILL, passed)
        at = [a + b for a, b in zip(at, move)]
        yield now, place(now), at
    assert began != at


@STAMPS
@SEEDS
def test_jitter_at_rest_moves_by_at_most_a_tenth_of_it(period, seed):
    rest = [at for now, _, at in filtered(period, seed, 80.0, lambda now: 0.0, JITTER) if now > 30.0]
    for axis in zip(*rest):
        middle = sum(axis) / len(axis)
        assert max(abs(one - middle) for one in axis) <= 0.0002
        assert max(map(abs, axis)) <= 0.0003, 'it is where the hand is'


@STAMPS
@SEEDS
def test_a_hand_that_moves_is_followed_within_80_ms(period, seed):
    """Also as it sets off, after a long rest."""

    def place(now):
        return SPEED * max(now - 20.0, 0.0)

    lags = [(x - at[0]) / SPEED for now, x, at in filtered(period, seed, 24.0, place, 0.0001) if now > 20.0]
    assert len(lags) > 100
    assert max(lags) <= 0.08


@SEEDS
def test_a_trembling_hand_that_moves_lags_by_80_ms_at_most(seed):
    """In the mean of 0.2 s: the lag of one sample has its jitter in it."""
    lags = [
        (x - at[0]) / SPEED
        for now, x, at in filtered(regular, seed, 30.0, lambda now: SPEED * max(now - 20.0, 0.0), JITTER)
        if now > 20.0
    ]
    assert max(sum(lags[start : start + 10]) / 10 for start in range(len(lags) - 10)) <= 0.08


def test_a_hand_that_stops_is_reached_but_for_its_jitter():
    def place(now):
        return SPEED * min(now, 2.0)

    stopped = [at[0] for now, _, at in filtered(regular, 0, 4.0, place, JITTER) if now > 3.0]
    assert max(abs(2.0 * SPEED - x) for x in stopped) <= JITTER


def test_a_rotation_is_filtered_around_any_axis():
    axis = (2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0)
    chance = random.Random(0)
    smooth, angle, at, rest = Filter(Options().smooth), 0.0, 0.0, []
    for sample in range(4000):
        before, angle = angle, chance.uniform(-0.01, 0.01)
        _, turn = smooth.step(STILL, tuple((angle - before) * part for part in axis), 0.02)
        at += math.copysign(math.sqrt(sum(part * part for part in turn)), sum(a * b for a, b in zip(turn, axis)))
        rest += [at] * (sample > 1500)
    assert max(rest) - min(rest) <= 0.002
    for _ in range(100):
        _, turn = smooth.step(STILL, tuple(0.02 * part for part in axis), 0.02)
    assert turn == pytest.approx([0.02 * part for part in axis], abs=1e-3), 'it keeps up, beyond half a turn'


def test_the_time_constant_is_that_at_rest():
    smooth = Filter(0.5)
    move, turn = smooth.step((1e-5, 0.0, 0.0), STILL, 0.02)
    assert move == pytest.approx((1e-5 * 0.02 / 0.52, 0.0, 0.0))
    assert turn == STILL
    assert rotation_vector((0.0, 0.0, 0.0, -1.0)) == STILL
