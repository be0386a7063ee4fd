"""Which sources a drag changes."""

from random import Random

import pytest

from rosslt import math, msg, node, values
from rosslt.markers.drags import changes
from rosslt.markers.offers import choices_of, default_sources, together

SHOULDER, ELBOW, SIDE = [values.Source('/arm', number) for number in (1, 2, 3)]
UPPER_ARM, FOREARM = 1.2, 0.9


def tip(shoulder, elbow):
    shoulder, elbow = values.track(shoulder, SHOULDER), values.track(elbow, ELBOW)
    return [
        UPPER_ARM * math.cos(shoulder) + FOREARM * math.cos(shoulder + elbow),
        UPPER_ARM * math.sin(shoulder) + FOREARM * math.sin(shoulder + elbow),
    ]


def test_sources_without_effect_are_no_choice():
    x, y = values.track(1.0, SHOULDER), values.track(2.0, ELBOW)
    assert choices_of([x + 0 * y], ()) == [(None, [SHOULDER])]


def test_each_other_source_of_a_number_is_a_choice():
    x, y = values.track(1.0, SHOULDER), values.track(2.0, ELBOW)
    assert choices_of([x + y], ()) == [(None, [SHOULDER]), (ELBOW, [ELBOW])]
    assert choices_of([x + y], (SHOULDER,)) == [(None, [ELBOW])]
    side = values.track(3.0, SIDE)
    alone = [(source, [source]) for source in (SHOULDER, ELBOW, SIDE)]
    assert choices_of([x + y, side], ()) == [(None, [SHOULDER, SIDE]), *alone]
    assert choices_of([x, side], ()) == [(None, [SHOULDER, SIDE])], 'nothing to choose there'


def test_a_second_choice_adds_to_the_first_unless_it_does_the_same():
    x, y, side = values.track(1.0, SHOULDER), values.track(2.0, ELBOW), values.track(3.0, SIDE)
    at = [x + y, side]
    assert together(at, (), ELBOW) == (ELBOW,)
    assert together(at, (ELBOW,), SIDE) == (ELBOW, SIDE)
    assert together(at, (ELBOW, SIDE), SHOULDER) == (SIDE, SHOULDER)
    assert together(tip(0.5, 0.9), (ELBOW,), SHOULDER) == (ELBOW, SHOULDER), 'two ways for a point to go'


def test_the_default_is_the_first_source_that_can():
    x, y = values.track(1.0, SHOULDER), values.track(2.0, ELBOW)
    assert default_sources([x + y]) == [SHOULDER]
    assert default_sources([x + y], read_only=[SHOULDER]) == [ELBOW]
    assert default_sources(tip(0.5, 0.9)) == [SHOULDER, ELBOW]


def test_what_is_chosen_changes_alone(no_limits):
    x, y = values.track(1.0, SHOULDER), values.track(2.0, ELBOW)
    assert changes.plan([3 * x + y * y], [12.0], [ELBOW]).after == {ELBOW: 3.0}
    assert changes.plan([2 * x, y], [3.0, 5.0], [SHOULDER]).after == {SHOULDER: 1.5}


def test_a_hand_that_goes_back_has_its_sources_go_back_though_the_message_is_older():
    found = changes.Plan({SHOULDER: 1.0, ELBOW: 2.0}, {})
    assert changes.to_request(found, {}) == {}
    assert changes.to_request(found, {SHOULDER: 1.5}) == {SHOULDER: 1.0}


def test_only_what_differs_from_what_owners_have_is_asked_for():
    found = changes.Plan({SHOULDER: 1.0, ELBOW: 2.0}, {SHOULDER: 1.5, ELBOW: 2.5})
    assert changes.to_request(found, {SHOULDER: 1.5}) == {ELBOW: 2.5}


def fold(value):
    """x = fold^3 / 3 - fold turns round at fold = -1, where x is 2/3; beyond, only a fold above 2 gives x."""
    fold = values.track(value, SHOULDER)
    return fold * fold * fold / 3.0 - fold


@pytest.fixture
def no_limits(monkeypatch):
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})


def test_a_drag_does_not_leap_from_its_first_step_on_and_comes_as_near_as_it_can(no_limits):
    found = changes.plan([fold(-0.9)], [0.72])
    assert not found.is_exact
    assert found.after[SHOULDER] == pytest.approx(-1.0, abs=1e-3)


def test_a_leap_is_made_where_the_hand_lets_go(no_limits):
    found = changes.plan([fold(-0.9)], [0.72], may_leap=True)
    assert found.is_exact
    assert found.after[SHOULDER] > 2.0


def test_what_cannot_be_reached_stays_as_near_as_it_was_where_the_hand_lets_go(no_limits):
    """The elbow does not turn over."""
    tracked = tip(0.3, 1.2)
    last = changes.plan(tracked, [2.5, 1.0]).after
    released = changes.plan(tracked, [2.5, 1.01], began={SHOULDER: 0.3, ELBOW: 1.2}, last=last, may_leap=True)
    assert [released.after[one] for one in last] == pytest.approx([last[one] for one in last], abs=0.05)


def test_a_thing_that_is_seen_at_its_bound_is_still_as_near_as_it_comes(monkeypatch):
    """The owner has followed, and a message has shown it, before the hand lets go."""
    bounds = {SHOULDER: (None, 0.5)}
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': bounds, 'read_only': []})
    for began in ({}, {SHOULDER: 0.0}):
        x = values.track(0.5 if began else 0.0, SHOULDER)
        plan = changes.plan([x], [100.0], began=began)
        assert (plan.after, plan.stops, plan.is_exact) == ({SHOULDER: 0.5}, {SHOULDER: 'maximum 0.5'}, False)
    assert changes.to_request(plan, {SHOULDER: 0.5}) == {}


@pytest.mark.parametrize(('wanted', 'nearest'), [(0.0841, 84), (0.0299, 30)])
def test_a_number_that_takes_whole_ones_alone_becomes_the_nearest_one(no_limits, wanted, nearest):
    found = changes.plan([values.track(50, SHOULDER) * 0.001], [wanted], may_leap=True)
    assert (found.after, found.whole) == ({SHOULDER: nearest}, [SHOULDER])
    assert not found.is_exact


def test_a_whole_number_that_fits_is_exact(no_limits):
    found = changes.plan([values.track(4, SHOULDER) * 0.5], [3.0])
    assert (found.after, found.whole, found.is_exact) == ({SHOULDER: 6}, [], True)


@pytest.mark.parametrize(
    ('x', 'wanted', 'resolution', 'expected'),
    [
        (values.track(1.0, SHOULDER), 1.452682166528786, 1e-3, 1.453),
        (values.track(1.0, SHOULDER), 1.4999999, 1e-3, 1.5),
        (values.track(1.0, SHOULDER), 1234.56789, 1.0, 1235.0),
        (values.track(0.0, SHOULDER), -1e-5, 1e-3, 0.0),
        (values.track(50.0, SHOULDER) * 0.001, 0.0614159, 1e-3, 61.0),
        (values.track(1.0, SHOULDER), 1.452682166528786, 1e-12, 1.452682166529),
    ],
)
def test_a_drag_gives_a_source_no_more_digits_than_a_hand_can_see(x, wanted, resolution, expected):
    assert changes.plan([x], [wanted], resolution=resolution).after == {SHOULDER: pytest.approx(expected, rel=1e-15)}


@pytest.mark.parametrize(
    ('present', 'unit', 'wanted'), [(6.0, 1.0, 6.283), (1.9, math.tau, 2.0), (350.0, math.tau / 360, 360.0)]
)
def test_a_whole_turn_is_not_rounded_to_none(no_limits, present, unit, wanted):
    turn = values.track(present, SHOULDER) * unit
    for tracked, targets in (([math.cos(turn), math.sin(turn)], [1.0, 0.0]), ([math.sin(turn)], [0.0])):
        assert changes.plan(tracked, targets, resolution=1e-3).after == {SHOULDER: pytest.approx(wanted, rel=1e-9)}


def test_a_hand_that_has_gone_around_is_not_rounded_back(no_limits):
    turn = values.track(-1.0, SHOULDER)
    began, last = {SHOULDER: -1.0}, {SHOULDER: 6.2}
    found = changes.plan([math.cos(turn), math.sin(turn)], [1.0, 0.0], began=began, last=last, resolution=1e-3)
    assert found.after == {SHOULDER: 6.283}


def test_an_angle_stays_near_where_the_hand_is_at_the_middle(no_limits):
    """There, any angle shows the same."""
    radius, angle = values.track(2.0, SHOULDER), values.track(0.5, ELBOW)
    last, wanted = {SHOULDER: 0.01, ELBOW: 1.9}, [1e-4 * math.cos(1.9), 1e-4 * math.sin(1.9)]
    tracked = [radius * math.cos(angle), radius * math.sin(angle)]
    found = changes.plan(tracked, wanted, began={SHOULDER: 2.0}, last=last, resolution=1e-3)
    assert found.after == {SHOULDER: 0.0, ELBOW: 2.0}


def test_several_sources_are_rounded_together_within_what_a_hand_can_see():
    shoulder, elbow = values.track(0.3, SHOULDER), values.track(1.2, ELBOW)
    tracked = [math.cos(shoulder) + math.cos(shoulder + elbow), math.sin(shoulder) + math.sin(shoulder + elbow)]
    after = changes.plan(tracked, [1.1, 1.3], resolution=1e-3).after
    assert values.evaluate(tracked, after) == pytest.approx([1.1, 1.3], abs=5e-4)
    assert all(len(repr(value)) <= 6 for value in after.values()), after


@pytest.mark.parametrize('seed', range(50))
def test_a_point_gets_the_decimals_that_a_hand_means(no_limits, seed):
    """Its x and y have a number each: neither leaves less of the resolution to the other."""
    random = Random(seed)
    meant = [round(random.uniform(-5.0, 5.0), random.choice([1, 2])) for _ in range(2)]
    targets = [number + random.uniform(-0.49e-3, 0.49e-3) for number in meant]
    at = [values.track(7.5, SHOULDER), values.track(-6.25, ELBOW)]
    assert changes.plan(at, targets, resolution=1e-3).after == dict(zip((SHOULDER, ELBOW), meant))


def test_a_source_at_its_bound_is_not_rounded_beyond_it(monkeypatch):
    bounds = {SHOULDER: (None, 2.3456789)}
    monkeypatch.setattr(changes.node, 'limits', lambda sources, timeout: {'bounds': bounds, 'read_only': []})
    for wanted, expected in ((2.3456789, 2.3456789), (2.34567, 2.34567), (2.3421, 2.342)):
        found = changes.plan([values.track(1.0, SHOULDER)], [wanted], resolution=2e-3).after
        assert found == {SHOULDER: pytest.approx(expected, abs=1e-12)}


def test_what_comes_as_near_as_possible_is_round_as_well(monkeypatch):
    """As where somebody has locked the x of a point."""
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': [SHOULDER]})
    at = [values.track(4.0, SHOULDER), values.track(-2.0, ELBOW)]
    found = changes.plan(at, [4.5, -1.710702896118164], resolution=2e-3)
    assert (found.after, found.gap) == ({ELBOW: -1.71}, pytest.approx(0.5))


@pytest.mark.parametrize('kind', [float, int])
def test_what_is_a_things_own_changes_alone_and_is_what_the_menu_says(no_limits, monkeypatch, kind):
    """As the row of a waypoint beside a scale and an offset that all waypoints share."""
    x, y, scale, *offset = [values.Source('/owner', number) for number in range(5)]
    directory = node.Directory()
    rows = ['f.py:3:1[1]', 'f.py:3:1[1]', '', '', '']
    directory.take('/owner', [msg.Location(id=number, row=row) for number, row in enumerate(rows)])
    monkeypatch.setattr(node, 'directory', lambda: directory)
    track = values.track
    at = [track(4.0, x) * track(1.5, scale) + track(0.5, offset[0])]
    at.append(track(kind(-3), y) * track(1.5, scale) + track(0.25, offset[1]))
    found = changes.plan(at, [9.5, -1.2], thing=at, may_leap=True)
    assert set(found.after) == {x, y}
    assert found.after[x] == pytest.approx(6.0)
    assert found.after[y] == pytest.approx(-1.4500000000000002 / 1.5) if kind is float else found.after[y] == -1
    assert found.whole == ([] if kind is float else [y])
    assert default_sources(at, directory.held(at)) == ([x, y] if kind is float else [x])
    assert set(changes.plan(at, [9.5, -1.25], [scale], thing=at, may_leap=True).after) == {scale}


@pytest.mark.parametrize('compute', [math.atan, math.tanh, lambda x: -math.exp(-x)])
def test_what_comes_nearer_for_ever_goes_as_far_as_a_hand_sees(compute, monkeypatch):
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})
    monkeypatch.setattr(node, 'directory', node.Directory)
    source = values.Source('/owner', 1)
    found = changes.plan([compute(values.track(0.5, source))], [5.0], resolution=1e-3)
    assert 2.0 < found.after[source] < 1e4
    assert not found.is_exact
