"""A hand on a closed path: no source drifts, none jumps, and out of reach the last good values stay."""

import math as plain_math
import os

import numpy
import pytest

from rosslt import NotInvertible, Source, math, solve, track
from rosslt.values import continued, evaluate, reapply, slopes, source_values

STEPS = 1000 if os.environ.get('ROSSLT_MANY_EXAMPLES') else 100


def arm(lengths, angles):
    """Where the tip of an arm in the plane is."""
    x = y = angle = 0.0
    for number, (length, turn) in enumerate(zip(lengths, angles)):
        angle = angle + track(turn, Source('/arm', number))
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
    return [x, y]


def bezier(points, t):
    """A point of a cubic curve in the plane, of its control points and its parameter."""
    where = track(t, Source('/curve', 8))
    numbers = [track(number, Source('/curve', place)) for place, number in enumerate(points)]
    weights = [(1 - where) ** 3, 3 * (1 - where) ** 2 * where, 3 * (1 - where) * where * where, where**3]
    return [sum(weight * number for weight, number in zip(weights, numbers[axis::2])) for axis in (0, 1)]


def circle(results, radius, direction=0.0):
    """A closed path of so many steps that begins and ends where the results are, its middle in a direction."""
    x, y = map(float, results)
    points = []
    for step in range(1, STEPS):
        turn = direction + plain_math.pi + plain_math.tau * step / STEPS
        points.append(
            [
                x + radius * (plain_math.cos(direction) + plain_math.cos(turn)),
                y + radius * (plain_math.sin(direction) + plain_math.sin(turn)),
            ]
        )
    return [*points, [x, y]]


def asked(results, here, there):
    """How far the slopes ask the sources to go, in the mean of both ends."""
    change = numpy.subtract(evaluate(results, there), evaluate(results, here))
    lengths = []
    for values in (here, there):
        jacobian = numpy.array(list(slopes(reapply(results, values)).values())).T
        lengths.append(numpy.linalg.norm(numpy.linalg.pinv(jacobian) @ change))
    return sum(lengths) / 2


def follow(results, path):
    """Follow a path.

    Returns:
        The sources' last values in relation to the first ones, how many points were out of reach, and the longest step
        of a source in relation to what the slopes ask for.
    """
    began, last, held, longest = source_values(results), {}, 0, 0.0
    for target in path:
        try:
            new = continued(results, target, last)
        except NotInvertible:
            held += 1
            continue
        here, there = {**began, **last}, {**began, **new}
        assert evaluate(results, there) == pytest.approx(target, rel=1e-9, abs=1e-9)
        moved = max(abs(there[source] - here[source]) for source in began)
        if moved > 1e-9:
            longest = max(longest, moved / asked(results, here, there))
        last = new
    return {source: last.get(source, value) - value for source, value in began.items()}, held, longest


ARMS = {
    '2 joints': arm([0.5, 0.4], [0.3, 0.9]),
    '3 joints': arm([0.5, 0.4, 0.3], [0.3, 0.7, 0.5]),
    '6 joints': arm([0.5, 0.4, 0.4, 0.3, 0.3, 0.2], [0.2, 0.5, 0.4, -0.3, 0.6, 0.4]),
    'four bars of equal length': arm([0.5] * 4, [0.4, 0.5, 0.6, 0.7]),
}
CURVE = {'a point of a curve': bezier([0.0, 0.0, 0.3, 1.0, 1.0, 0.8, 1.2, -0.1], 0.4)}


def outwards(results):
    """The direction from the base to a tip."""
    return plain_math.atan2(results[1], results[0])


@pytest.mark.parametrize('results', [*ARMS.values(), *CURVE.values()], ids=[*ARMS, *CURVE])
def test_on_a_closed_path_every_source_comes_back_without_a_jump(results, capsys):
    radius = 0.3 * plain_math.hypot(*results)
    drift, held, longest = follow(results, circle(results, radius, outwards(results) + plain_math.pi + 0.3))
    with capsys.disabled():
        print('\n%.1e drift, %d held, longest step %.2f of what is asked' % (max(drift.values()), held, longest))
    assert not held
    assert max(map(abs, drift.values())) <= 1e-9
    assert longest <= 5.0


@pytest.mark.parametrize('results', ARMS.values(), ids=ARMS)
def test_out_of_reach_the_last_good_values_stay_and_the_hand_is_picked_up_again(results, capsys):
    drift, held, longest = follow(results, circle(results, 0.6, outwards(results)))
    with capsys.disabled():
        print('\n%.1e drift, %d held, longest step %.2f of what is asked' % (max(drift.values()), held, longest))
    assert 0 < held < 0.9 * STEPS
    assert max(map(abs, drift.values())) <= 1e-9
    assert longest <= 5.0


def test_around_the_base_a_joint_turns_once_and_the_others_come_back(capsys):
    """No way around the base leads back without a jump: the first link has to go around with the hand."""
    results = arm([0.5, 0.4, 0.3], [0.3, 0.7, 0.5])
    radius = plain_math.hypot(*results)
    gone, held, longest = follow(results, circle(results, radius, outwards(results) + plain_math.pi))
    turns = [way / plain_math.tau for way in gone.values()]
    with capsys.disabled():
        print('\nturns %s, %d held, longest step %.2f of what is asked' % (turns, held, longest))
    assert turns == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert not held
    assert longest <= 5.0


def test_where_a_bound_stops_a_source_another_one_moves_on_and_both_come_back():
    a, b = track(0.0, Source('/sum', 1)), track(0.0, Source('/sum', 2))
    bounds = {Source('/sum', 1): (0.0, 1.0)}
    last, steps = {}, []
    for number in [*range(1, 200), *range(200, -1, -1)]:
        new = continued([a + b], [number / 100], last, bounds=bounds)
        steps.append(max(abs(new.get(s, 0.0) - last.get(s, 0.0)) for s in bounds.keys() | {Source('/sum', 2)}))
        last = new
    assert max(steps) == pytest.approx(0.01)
    assert last == {}


@pytest.mark.parametrize('stride', [6, 8, 13])
def test_in_other_steps_back_the_second_source_goes_no_further_than_it_came(stride):
    """The first one was not quite at its limit when the second one began to move."""
    turn, length = track(0.2, Source('/lift', 1)), track(-2.0, Source('/lift', 2))
    height, last = math.cos(turn) * length * length, {}
    for number in [*range(0, 60, 5), *range(60, -1, -stride), 0]:
        wanted = float(height) + number / 200
        last = continued([height], [wanted], last)
        assert evaluate(height, last) == pytest.approx(wanted)
    assert last == {}


def test_an_answer_that_can_only_be_reached_by_a_jump_is_none():
    x = track(1.0, Source('/wave', 1))
    wave = math.sin(x) + 0.2 * x
    last = {}
    for number in range(100):
        try:
            last = continued([wave], [float(wave) + 0.02 * number], last)
        except NotInvertible:
            break
    top = plain_math.acos(-0.2)
    assert top - 0.2 < last[Source('/wave', 1)] <= top
    beyond = float(wave) + 0.02 * number
    assert solve(wave, beyond)[Source('/wave', 1)] > plain_math.pi
    with pytest.raises(NotInvertible, match='without a jump'):
        continued([wave], [beyond], last)


def test_whole_numbers_and_plain_values_are_followed():
    n = track(3, Source('/n', 1))
    x = track(1.0, Source('/n', 2))
    last = continued([n * 2, 2.0 * x, 5.0], [8, 3.0, 5.0], {})
    assert last == {Source('/n', 1): 4, Source('/n', 2): 1.5}
    assert continued([n * 2, 2.0 * x, 5.0], [10, 3.5, 5.0], last) == {Source('/n', 1): 5, Source('/n', 2): 1.75}
    assert continued([n * 2, 2.0 * x, 5.0], [6, 2.0, 5.0], last) == {}
    with pytest.raises(NotInvertible, match='no source'):
        continued([n * 2, 2.0 * x, 5.0], [6, 2.0, 6.0], last)


@pytest.mark.parametrize('start', [30.0, 0.0])
@pytest.mark.parametrize('end', [0.0, 29.0, 12.34])
@pytest.mark.parametrize(
    'compute',
    [
        lambda angle: [angle],
        lambda angle: [math.sin(angle / 2), math.cos(angle / 2)],
        lambda angle: [math.sin(angle / 2 + 0.3) * 0.7, math.cos(angle / 2 + 0.3) * 0.7],
    ],
)
def test_a_path_leaves_nothing_of_its_roundings(compute, start, end):
    source = Source('/camera', 1)
    results = compute(math.radians(track(start, source)))
    last = {}
    for step in range(1, 8):
        degrees = -40.0 + (end + 40.0) * step / 7
        targets = list(map(float, compute(plain_math.radians(degrees) * (1 + 2e-16))))
        last = continued(results, targets, last)
    assert last == ({} if start == end else {source: end})


def test_what_other_numbers_bring_to_zero_is_zero():
    sources = [Source('/pose', number) for number in range(3)]
    roll, pitch, yaw = map(track, (0.3, 0.2, 0.5), sources)
    results = [math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch), math.sin(roll + yaw)]
    last = {}
    for step in range(1, 8):
        there = dict(zip(sources, (0.3, 0.2, 0.5 - 0.5 * step / 7)))
        last = continued(results, [float(evaluate(result, there)) for result in results], last)
    assert last == {sources[2]: 0.0}


def turned_between_waypoints():
    """An orientation about z between two waypoints, of the time that a node takes from one to the other."""
    first, second, hold = (track(value, Source('/arm', place)) for place, value in enumerate((0.2, 1.0, 2.0)))
    half = (first + (second - first) * (0.7 / hold)) / 2
    return [math.sin(half), math.cos(half)]


def test_a_ring_moves_one_source_and_holds_the_others():
    results, last = turned_between_waypoints(), {}
    began = 2 * plain_math.asin(results[0])
    for step in range(1, 50):
        half = (began + 0.05 * step) / 2
        last = continued(results, [plain_math.sin(half), plain_math.cos(half)], last or source_values(results))
        assert list(last) == [Source('/arm', 0)]
    assert evaluate(results, last) == pytest.approx([plain_math.sin(half), plain_math.cos(half)])


def test_a_point_moves_as_many_joints_as_it_has_coordinates():
    results = arm([1.0, 0.8, 0.6, 0.4], [0.3, 0.5, 0.7, 0.9])
    last = source_values(results)
    for point in circle(results, 0.2)[:-1]:
        last = {**last, **continued(results, point, last)}
        assert evaluate(results, last) == pytest.approx(point)
    assert len(continued(results, point, last)) == 2


def test_of_those_that_move_a_point_alike_the_largest_move():
    x, y, away, turn = (Source('/n', number) for number in range(4))
    angle = math.radians(track(90.0, turn))
    goal = [track(4.0, x) - track(0.5, away) * math.cos(angle), track(-2.0, y) - track(0.5, away) * math.sin(angle)]
    assert continued(goal, [3.0, -3.0], source_values(goal)) == pytest.approx({x: 3.0, y: -2.5})


def test_where_few_joints_do_not_suffice_all_move():
    """The two that move the point most may turn by 0.05 only."""
    results = arm([1.0, 0.8, 0.6, 0.4], [0.3, 0.5, 0.7, 0.9])
    bounds = {Source('/arm', place): (value - 0.05, value + 0.05) for place, value in enumerate((0.3, 0.5))}
    last = source_values(results)
    x, y = map(float, results)
    for step in range(1, 20):
        target = [x - 0.02 * step, y - 0.01 * step]
        last = {**last, **continued(results, target, last, bounds=bounds)}
        assert evaluate(results, last) == pytest.approx(target)
    assert abs(last[Source('/arm', 2)] - 0.7) > 0.05


def test_the_first_source_follows_the_hand_though_another_would_move_less():
    offset, length = Source('/lever', 1), Source('/lever', 2)
    tip = track(1.0, offset) + 10.0 * track(1.0, length)
    last = source_values([tip])
    for number in [*range(1, 20), *range(20, 0, -1)]:
        last = continued([tip], [11.0 + number / 100], last)
        assert last == {offset: pytest.approx(1.0 + number / 100)}
    assert continued([tip], [11.0], last) == {}


def test_numbers_of_unlike_size_follow_the_hand_where_their_results_have_one_answer():
    size, bend = Source('/plate', 1), Source('/plate', 2)
    lift = track(3e-4, bend) * 1000.0
    results = [track(860.0, size) / 1000.0 + lift, lift]
    assert continued(results, [1.2, 0.31], source_values(results)) == {size: 890.0, bend: 0.00031}
