"""What solving promises beyond the laws."""

import math as standard_math

import pytest

from rosslt import NotInvertible, NotTracked, Source, evaluate, math, solve, track, untracked
from rosslt.values import describe_sources_with

A, B, C = Source('/node', 1), Source('/node', 2), Source('/other', 1)


class Point:
    __slots__ = ('x', 'y', 'z')
    _slot_types = ('float64', 'float64', 'float64')

    def __init__(self, x, y, z):
        self.x, self.y, self.z = x, y, z


class Marker:
    __slots__ = ('frame', 'position', 'points', 'data')
    _slot_types = ('string', 'geometry_msgs/Point', 'geometry_msgs/Point[]', 'uint8[]')

    def __init__(self, frame, position, points=(), data=b''):
        self.frame, self.position, self.points, self.data = frame, position, list(points), data


@pytest.fixture
def x():
    return track(0.3, A)


@pytest.fixture
def y():
    return track(2.0, B)


def refusal(*arguments, **options):
    with pytest.raises(NotInvertible) as caught:
        solve(*arguments, **options)
    return str(caught.value)


def test_the_first_source_that_can_is_changed(x, y):
    assert solve(x + y, 3.0) == {A: 1.0}
    assert solve(y * 2 - x, 3.0) == {B: 1.65}
    assert solve(x + y, 3.0, B) == {B: 2.7}


def test_a_source_that_has_no_effect_is_passed_over(x, y):
    assert solve(x * 0 + y, 3.0) == {B: 3.0}
    assert solve(x - x + y, 3.0) == {B: 3.0}
    assert solve(math.floor(x) + y, 3.5) == {B: 3.5}


def test_a_read_only_source_is_passed_over(x, y):
    assert solve(x + y, 3.0, read_only={A}) == {B: 2.7}
    assert 'read-only' in refusal(x + y, 3.0, A, read_only=[A])
    assert '/node#1 is read-only' in refusal(x, 3.0, read_only=[A])
    assert solve([x + y, y], [3.0, 2.0], read_only=[B]) == {A: 1.0}


def test_what_rounding_has_left_is_no_influence():
    """The sine of half a turn is 1.2e-16 in floats."""
    noise = standard_math.sin(standard_math.pi)
    shift, place = track(0.4, A), track(3.0, B)
    assert solve(place - shift * noise, 1.0) == {B: 1.0}
    assert solve(noise * shift + place, 1.0, rank={B: 1}) == {B: 1.0}
    with pytest.raises(NotInvertible):
        solve(noise * shift + place, 1.0, bounds={B: (2.0, 4.0)})
    assert solve(1e-5 * shift + place, 1.0, rank={B: 1}) == {A: pytest.approx(-2e5)}


def test_a_source_of_a_higher_rank_is_changed_only_where_no_other_can(x, y):
    assert solve(x + y, 3.0, rank={A: 1}) == {B: 2.7}
    assert solve(x + y, 3.0, rank=lambda source: 1 if source == A else 0) == {B: 2.7}
    assert solve(x + y, 3.0, rank={A: 1}, read_only=[B]) == {A: 1.0}
    assert solve(x + y, 3.0, A, rank={A: 1}) == {A: 1.0}
    assert solve(x + y * 0, 3.0, rank={A: 1}) == {A: 3.0}
    z = track(1.0, C)
    assert solve([x + y + z, y - x], [4.3, 1.7], rank={C: 1}) == {A: pytest.approx(0.8), B: pytest.approx(2.5)}
    assert set(solve([x + y + z, y - x, x], [4.3, 1.7, 0.3], rank={C: 1})) == {C}


def test_no_other_than_the_chosen_sources_change(x, y):
    z = track(1.0, C)
    assert solve(x + y + z, 4.3, sources=[B]) == {B: 3.0}
    assert solve(x * 0 + y + z, 4.0, sources=[A, C]) == {C: 2.0}
    assert set(solve([x + y + z, z], [4.3, 1.5], sources=[B, C])) == {B, C}
    assert 'does not depend on' in refusal(x + y, 3.0, sources=[C])


def test_the_chosen_sources_may_come_one_by_one():
    a, b = track(2.0, A), track(3.0, B)
    assert solve(a + b, 6.0, sources=(source for source in (B,))) == {B: 4.0}


def test_a_source_that_the_value_does_not_have_is_named(x):
    assert refusal(x * 2, 1.0, B) == 'cannot make 0.3 [/node#1] * 2 become 1.0: it does not depend on /node#2'


def test_what_has_no_source_is_not_tracked():
    for value in (1.0, [1.0, 'a'], Point(0.0, 0.0, 0.0)):
        with pytest.raises(NotTracked):
            solve(value, value)


def test_the_operation_that_stops_it_is_named(x):
    describe_sources_with(lambda source: 'waypoints.script:3:12' if source == A else None)
    try:
        assert refusal(math.sin(x), 1.5) == (
            'cannot make sin(0.3 [waypoints.script:3:12]) become 1.5: sin takes values in [-1, 1]'
        )
        assert refusal(track(1.0, B) ** 2, -1.0).endswith('a power with exponent 2 is not negative')
    finally:
        describe_sources_with(None)
    assert refusal(x * 0, 1.0).endswith('* cannot be undone there (division by zero)')
    assert refusal(abs(x), -1.0).endswith('abs takes values in [0, inf)')
    assert refusal(track('a', A) + 'b', 'abc').endswith("'abc' does not end with 'b'")


def test_a_target_that_fits_no_type_is_refused(x):
    assert refusal(x, 'a').endswith('it is a number')
    assert refusal(track('a', A), 1.0).endswith('it is a text')
    assert refusal(x, float('inf')).endswith('no source may hold what is not finite')
    assert refusal(x, float('nan')).endswith('no source may hold what is not finite')
    assert refusal(track(True, A), 2).endswith('it is True or False')


def test_an_aliased_source_does_not_overshoot(x):
    """The paper's trajectory: the point at time t of tau, dragged, moves the waypoint by exactly what it takes."""
    previous, t, tau = 0.1, 0.25, 2.0
    position = x * (t / tau) + x * 0.5 * (1 - t / tau) + previous
    answer = solve(position, 1.0)
    assert evaluate(position, answer) == pytest.approx(1.0, rel=1e-12)
    bezier = (1 - t) ** 2 * x + 2 * (1 - t) * t * (x + 1.0) + t**2 * 4.0
    assert evaluate(bezier, solve(bezier, 2.0)) == pytest.approx(2.0, rel=1e-12)


def test_several_occurrences_that_are_not_affine_meet_the_target_near_the_present_value(x):
    assert solve(x * x + x, 6.0) == {A: pytest.approx(2.0)}
    assert solve((-x) * x + x * 4, 3.0) == {A: pytest.approx(1.0)}
    assert solve(x * math.exp(x), math.exp(1.0)) == {A: pytest.approx(1.0)}
    assert solve(math.sin(x) + x * x, 0.0) == {A: pytest.approx(0.0, abs=1e-9)}
    assert solve((x - 1.0) * (x - 1.0), 0.0) == {A: pytest.approx(1.0, abs=1e-5)}
    assert 'no nearer than' in refusal(x * x + x, -1.0)


@pytest.mark.parametrize(
    ('make', 'target', 'found'),
    [
        (lambda v: v // 2, 3.0, 6.0),
        (lambda v: v // 2, -3.0, -4.0),
        (lambda v: v % 2, 0.5, 0.5),
        (round, 3, 2.5),
        (lambda v: round(v, 1), 0.7, 0.65),
        (abs, 4.0, 4.0),
        (lambda v: abs(v - 9), 1.0, 8.0),
        (lambda v: (v - 9) ** 2, 4.0, 7.0),
        (lambda v: v**3, -8.0, -2.0),
        (math.sin, 0.5, math.asin(0.5)),
        (lambda v: math.sin(v + 100), 0.5, None),
        (lambda v: math.cos(-v - 7), 0.5, None),
        (math.floor, 2, 2.0),
        (math.ceil, 2, 1.0),
        (lambda v: -7 % (v + 3), 1.0, None),
    ],
)
def test_of_several_preimages_the_nearest_is_taken(x, make, target, found):
    (new,) = solve(make(x), target).values()
    assert evaluate(make(x), {A: new}) == pytest.approx(target)
    if found is not None:
        assert new == pytest.approx(found, abs=0.01)
    nearer = [0.3 + (new - 0.3) * part / 100 for part in range(99)]
    assert not any(evaluate(make(x), {A: other}) == target for other in nearer if abs(other - new) > 1e-6)


def test_the_branch_of_the_present_value_is_kept():
    assert solve(math.cos(track(-0.3, A)), 0.5) == {A: -math.acos(0.5)}
    assert solve(track(-3, A) ** 2, 16) == {A: -4}
    (turned,) = solve(math.sin(track(20.0, A)), 0.9).values()
    assert abs(turned - 20.0) < math.pi


def test_whole_numbers_stay_whole_however_large():
    n = track(3, A)
    big = 10**40
    for value, target, found in (
        (n * 7 + 1, 7 * big + 1, big),
        (n - big, 5, big + 5),
        (n * n + n, big * big + big, big),
        (n**3, big**3, big),
        (n // 10, big, 10 * big),
        (-n, big, -big),
        (2**n, 2**200, 200),
        (n % big, 7, 7),
        (n + n, 2 * big, big),
        (n & 3, 1, 1),
        (n ^ big, 0, big),
    ):
        answer = solve(value, target)
        assert answer == {A: found}
        assert type(answer[A]) is int


def test_a_whole_number_takes_no_fraction():
    n = track(3, A)
    assert refusal(n * 2, 7) == (
        'cannot make 3 [/node#1] * 2 become 7: /node#1 would have to be 3.5, and is a whole number'
    )
    assert 'whole number' in refusal(n * 0.5, 1.2)
    assert refusal(n * 2, 7.5).endswith('it is a whole number')
    assert solve(n * 2, 8.0) == {A: 4}
    assert solve(n * 0.5, 2.5) == {A: 5}
    assert solve(round(n * 0.3), 2) == {A: 5}


def test_bools_and_texts_are_solved():
    flag, name = track(True, A), track('robot', B)
    assert solve(flag * 0.5, 0.0) == {A: False}
    assert type(solve(flag + 0, 0)[A]) is bool
    assert 'neither True nor False' in refusal(flag * 0.5, 0.7)
    assert solve('/' + name + '/base', '/arm/base') == {B: 'arm'}
    assert solve(name * 2, 'armarm') == {B: 'arm'}
    assert solve('ab' * track(2, C), 'ababab') == {C: 3}
    assert 'it appears more than once' in refusal(name + '/' + name, 'arm/arm')


def test_a_target_out_of_reach_names_the_bound(x):
    assert solve(x * 2, 1.0, bounds={A: (0.0, 1.0)}) == {A: 0.5}
    assert refusal(x * 2, 3.0, bounds={A: (0.0, 1.0)}) == (
        'cannot make 0.3 [/node#1] * 2 become 3.0: /node#1 would have to be 1.5, above its maximum 1.0'
    )
    assert 'below its minimum 0.1' in refusal(x + 1, 1.0, bounds={A: (0.1, None)})


def test_a_source_at_its_bound_leaves_the_change_to_the_next(x, y):
    assert solve(x + y, 5.0, bounds={A: (None, 1.0)}) == {B: 4.7}


def test_another_branch_is_taken_where_the_nearest_is_out_of_bounds(x):
    assert solve(math.sin(x), 0.5, bounds={A: (2.0, 3.0)}) == {A: pytest.approx(math.pi - math.asin(0.5))}
    assert solve(x * x, 4.0, bounds={A: (-3.0, 0.0)}) == {A: pytest.approx(-2.0)}


def test_bounds_hold_for_several_results_together(x, y):
    z = track(1.0, C)
    values = [x + y + z, x - y]
    free = solve(values, [6.0, 0.5])
    assert free[C] > 1.5
    answer = solve(values, [6.0, 0.5], bounds={C: (0.0, 1.5)})
    assert answer.get(C, 1.0) <= 1.5
    assert evaluate(values, answer) == pytest.approx([6.0, 0.5])
    refusal(values, [6.0, 0.5], bounds={A: (0, 1), B: (0, 1), C: (0, 1)})


def test_a_source_out_of_its_bounds_stays_where_it_need_not_move(x, y):
    bounds = {A: (1.0, 5.0)}
    assert not 1.0 <= x <= 5.0
    assert solve([x, x + y], [float(x), 8.0], bounds=bounds) == {B: pytest.approx(8.0 - x)}
    z = track(7.0, C)
    assert solve([x * y, x + y + z], [4.0 * x, x + 10.0], bounds=bounds) == {
        B: pytest.approx(4.0),
        C: pytest.approx(6.0),
    }
    # Where it must move, it comes back within them.
    assert solve([x + y, 2 * y], [2.5, 2.0], bounds=bounds) == {A: pytest.approx(1.5), B: pytest.approx(1.0)}


def test_a_source_out_of_its_bounds_stays_where_the_result_is_right_and_no_operation_can_be_undone():
    assert solve(track(5.0, A) * track(False, B), 0.0, bounds={A: (-1.0, 2.5)}) == {A: 5.0}
    n = track(-7, A)
    assert solve(n - n, 0, bounds={A: (-1, None)}) == {A: -7}


def test_several_results_move_all_their_sources_as_little_as_possible(x, y):
    z = track(0.0, C)
    answer = solve([x + y + z, x - y], [5.3, -1.7])
    assert answer == {A: pytest.approx(1.3), B: pytest.approx(3.0), C: pytest.approx(1.0)}


def test_the_least_change_is_found_where_the_results_are_not_affine():
    u, v = track(1.0, A), track(1.0, B)
    answer = solve([u * u + v * v, u - v], [8.0, 0.0])
    assert answer == {A: pytest.approx(2.0), B: pytest.approx(2.0)}
    w = track(3.0, C)
    answer = solve([u * u + v * v, w + u * 0 + v * 0], [4.0, 3.0])
    assert answer[A] == pytest.approx(2**0.5, rel=1e-6)
    assert answer[B] == pytest.approx(2**0.5, rel=1e-6)


def test_a_result_that_stays_at_0_comes_as_near_as_rounding_lets_it():
    """Both are at the origin, one is dragged away, and no two floats leave the other one exactly where it was."""
    u, v = track(0.0, A), track(0.0, B)
    turned = [u * 0.6 - v * 0.8, u * 0.8 + v * 0.6]
    stays, moves = evaluate(turned, solve(turned, [0.0, 0.001]))
    assert moves == pytest.approx(0.001, rel=1e-9)
    assert abs(stays) <= 1e-18


@pytest.mark.parametrize('size', [1e-300, 1e-162, 1e-20, 1e20, 1e300])
def test_several_results_are_solved_for_at_any_size(size):
    u, v = track(0.0, A), track(0.0, B)
    turned = [u * 0.6 - v * 0.8 + 3 * size, u * 0.8 + v * 0.6]
    answer = solve(turned, [0.0, -size])
    assert evaluate(turned, answer)[1] == pytest.approx(-size, rel=1e-9)
    assert answer == {A: pytest.approx(-2.6 * size), B: pytest.approx(1.8 * size)}


def arm(first, second):
    elbow = 0.5 * math.cos(first), 0.5 * math.sin(first)
    return [elbow[0] + 0.4 * math.cos(first + second), elbow[1] + 0.4 * math.sin(first + second)]


def test_dragging_the_tip_of_an_arm_turns_both_joints(x, y):
    tip = arm(x, y)
    answer = solve(tip, [0.5, 0.5])
    assert set(answer) == {A, B}
    assert evaluate(tip, answer) == pytest.approx([0.5, 0.5], rel=1e-9)


def test_a_straight_arm_can_be_pulled_in():
    tip = arm(track(0.0, A), track(0.0, B))
    assert evaluate(tip, solve(tip, [0.5, 0.0])) == pytest.approx([0.5, 0.0], abs=1e-9)


def test_a_point_beyond_the_arm_is_refused(x, y):
    assert 'together' in refusal(arm(x, y), [1.5, 0.5]) or 'become' in refusal(arm(x, y), [1.5, 0.5])


def test_results_that_contradict_each_other_are_refused_and_those_that_agree_are_not(x):
    refusal([x, x * 2], [1.0, 3.0])
    assert solve([x, x * 2, x + 1], [1.0, 2.0, 2.0]) == {A: 1.0}


def test_messages_are_solved_leaf_by_leaf(x, y):
    marker = Marker(track('map', C), Point(x * 2, y, 0.0), [Point(x * 2 + 1, 0.0, 0.0)], b'abc')
    target = Marker('odom', Point(1.0, 2.5, 0.0), [Point(2.0, 0.0, 0.0)], b'abc')
    answer = solve(marker, target)
    assert answer == {C: 'odom', A: 0.5, B: 2.5}
    found = evaluate(marker, answer)
    assert (found.frame, found.position.x, found.points[0].x) == ('odom', 1.0, 2.0)
    assert solve(marker, untracked(marker)) == {}


def test_a_part_with_the_target_none_is_left_free(x, y):
    assert solve(Point(x, x + y, 0.0), Point(1.0, None, None)) == {A: 1.0}


def test_a_leaf_without_a_source_stays(x):
    assert refusal(Point(x, 0.0, 0.0), Point(1.0, 1.0, 0.0)) == (
        'cannot make y become 1.0: it has no source, and is 0.0'
    )


def test_a_target_of_another_shape_is_refused(x):
    for target in ([1.0], {'a': 1.0}, [1.0, 2.0, 3.0], Point(1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match='shape'):
            solve([x, x], target)


def test_dicts_and_nested_sequences_are_solved(x, y):
    assert solve({'gains': [x, (y, 1)], 'name': 'a'}, {'gains': [1.0, (3.0, 1)], 'name': 'a'}) == {A: 1.0, B: 3.0}


def test_mixed_types_that_share_sources_are_solved_one_after_the_other(x):
    n, name = track(3, B), track('a', C)
    assert solve([n * 2, n + x], [8, 5.0]) == {B: 4, A: 1.0}
    assert solve([name + '/x', name + '/y', name], ['b/x', 'b/y', 'b']) == {C: 'b'}
    refusal([name + '/x', name + '/y'], ['b/x', 'c/y'])


def test_a_target_near_nothing_is_met_to_a_picometre(x):
    value = x * 0.1 + 0.3
    assert abs(evaluate(value, solve(value, 5.5e-17))) < 1e-12
    assert abs(evaluate(value, solve(value, 0.0))) < 1e-12


def test_extremes_are_solved_or_refused_but_never_wrong():
    for at in (1e-300, 1e300, 5e-324, -0.0, 1.7e308):
        value = track(at, A)
        for made, target in ((value * 2.0, 1e300), (value / 1e-300, 1e-5), (value + 1e300, 0.0), (value * 1e-300, 1.0)):
            try:
                answer = solve(made, target)
            except NotInvertible:
                continue
            assert math.isfinite(answer[A])
            assert evaluate(made, answer) == pytest.approx(target, rel=1e-9, abs=0 if target else 1e-12)
    assert 'beyond what a float holds' in refusal(track(1.0, A) * 1e-300, 1e300)


def test_results_move_together_from_the_origin_where_one_of_them_stays_at_zero():
    a, c = (track(0.0, Source('/node', number)) for number in (1, 2))
    sine = 0.7999999999999999
    found = solve([-0.6 * a + sine * c, -sine * a - 0.6 * c], [0.0, 1.0])
    assert [found[Source('/node', number)] for number in (1, 2)] == pytest.approx([-0.8, -0.6])


def test_an_answer_of_several_sources_has_the_digits_that_people_write():
    radius, offset = track(2.0, Source('/n', 1)), track(0.0, Source('/n', 2))
    answer = solve([3 * radius + 1, radius + offset * 1.1 - 0.05], [10.0, 3.5])
    assert answer == {Source('/n', 1): 3.0, Source('/n', 2): 0.5}


def test_an_answer_is_not_rounded_where_a_small_result_would_be_missed():
    """The largest error is that of results near 1, which rounding made no larger; the one near 0.04 was missed then."""
    a, b, c, d, e, f = (
        track(value, Source('/n', number))
        for number, value in enumerate((-0.1167, -0.081, -1.8171, 0.1074, -2.2031, 2.6909))
    )
    results = [
        math.tanh(f / a) / -0.68,
        1.77 + math.hypot(d + b, a),
        math.tan((0.32 + c) * (2.8 / d)),
        math.atan2(a, e) - d,
        d / f,
        math.tanh(e / (c / a) - 0.75),
    ]
    targets = [
        1.4705882352941175,
        2.1550926775897974,
        -0.04351774504629141,
        -3.0788444817409157,
        -0.004439603308134368,
        -0.729618897176517,
    ]
    assert evaluate(results, solve(results, targets)) == pytest.approx(targets, rel=1e-9, abs=1e-12)
