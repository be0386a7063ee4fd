"""A field of a node that nobody tracks, followed to a target: slopes that were learned, corrected by what is seen."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Float64, Header

from rosslt import NotInvertible, Source, messages, solve, track
from rosslt.models import Answer, Dependency, Following, Learned, LocalModel, NotFollowed, Number

A, B = Source('/talker', 'a'), Source('/talker', 'b')
THING = messages.thing_of(Float64())
#: So far an input may be from where it was learned, as a part of that.
RANGE = 0.1


def dependency(number, kind='smooth', slope=2.0):
    slope = slope if kind == 'smooth' else math.nan
    return Dependency(0, number, kind, slope, 0.0, slope, slope, -0.1, 0.1)


def following(*dependencies, at=(0.5, 2.0), inputs=('/in', '/other'), paths=('data',)):
    """`/out/data` follows these, 0.1 s later."""
    numbers = [Number(name, THING, 'data' if name in ('/in', '/other') else '') for name in inputs]
    learned = Learned(dependencies, (0.0,), (), (), (), 0.05, 10)
    answer = Answer(numbers, [Number('/out', THING, 'data')], at, 0.01, 0.1, learned, True, ())
    return Following([answer], '/out', THING, 'data', paths)


def accept(*_):
    pass


def forced(found, out, wanted):
    return found.solve(out, lambda part: solve(part, wanted), accept)


def random_function(random):
    """A smooth function near a place, its slopes there, and the place: in the range they hold within 5 %."""
    count = random.randint(1, 4)
    at = random.uniform(0.5, 2.0, count) * random.choice([-1, 1], count)
    slopes = random.uniform(0.3, 3.0, count) * random.choice([-1, 1], count)
    bends = random.uniform(-1, 1, (count, count)) * 0.05 * np.abs(slopes).min() / (RANGE * 2.0 * count)
    waves = random.uniform(-1, 1, count) * 0.01 * np.abs(slopes)

    def function(inputs):
        step = np.asarray(inputs) - at
        return float(slopes @ step + step @ bends @ step + waves @ (1 - np.cos(5 * step)) + 1.0)

    return function, slopes, at


def rounds_until(random, most=3, wrong=1.0):
    """How often a random function is solved until it lacks a thousandth of a change; most + 1 if that is too seldom."""
    function, slopes, at = random_function(random)
    model = LocalModel([wrong * slopes], 2 * RANGE * np.abs(at))
    inputs, value = list(at), function(at)
    wished = random.uniform(0.1, 0.8) * RANGE * np.abs(slopes * at).max() * random.choice([-1, 1])
    for number in range(1, most + 1):
        tracked = [track(float(one), Source('/talker', index)) for index, one in enumerate(inputs)]
        model.correct(inputs, [function(inputs)])
        (out,) = model.tracked(tracked, [function(inputs)])
        answer = solve(out, value + wished)
        inputs = [answer.get(Source('/talker', index), one) for index, one in enumerate(inputs)]
        if abs(function(inputs) - value - wished) <= 1e-3 * abs(wished):
            return number
    return most + 1


def test_smooth_functions_come_to_a_target_in_3_rounds():
    random = np.random.RandomState(1)
    rounds = [rounds_until(random) for _ in range(500)]
    assert sum(one <= 3 for one in rounds) >= 475, np.bincount(rounds)


def test_slopes_that_are_wrong_by_30_percent_are_corrected():
    random = np.random.RandomState(2)
    rounds = [rounds_until(random, most=5, wrong=random.choice([0.7, 1.3])) for _ in range(500)]
    assert sum(one <= 5 for one in rounds) >= 475, np.bincount(rounds)


def test_a_field_has_the_sources_of_what_it_follows():
    found = following(dependency(0), dependency(1, slope=-3.0))
    found.hear('/in', '/talker', Float64(track(0.25, A) * 2), 1.0)
    found.hear('/other', '/talker', Float64(track(2.0, B)), 1.0)
    out = found.tracked(Float64(7.0), 1.2, True).data
    assert out == 7.0
    assert forced(found, out, 7.1).keys() <= {A, B}
    assert found.solve(out, lambda part: solve(part, 7.1, sources=[A]), accept) == {A: pytest.approx(0.275)}


def test_an_input_counts_once_the_field_has_followed_it():
    found = following(dependency(0))
    assert found.tracked(Float64(1.0), 0.9, True) is None
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    assert found.tracked(Float64(1.0), 1.05, True) is None
    found.hear('/in', '/talker', Float64(track(0.55, A)), 1.15)
    assert forced(found, found.tracked(Float64(1.0), 1.2, True).data, 1.1) == {A: pytest.approx(0.55)}
    found = following(dependency(0))
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    found.hear('/in', '/talker', Float64(track(0.52, A)), 1.15)
    assert forced(found, found.tracked(Float64(1.0), 1.26, True).data, 1.1) == {A: pytest.approx(0.57)}


def stamped(value, stamp):
    message = PointStamped(header=Header(frame_id='map'))
    message.header.stamp.secs, message.point.x = stamp, value
    return message


def test_an_input_of_the_same_stamp_is_waited_for():
    thing = messages.thing_of(stamped(0.0, 1))
    number = Number('/in', thing, 'point.x')
    learned = Learned((dependency(0),), (0.0,), (), (), (), 0.05, 10)
    answer = Answer([number], [number._replace(topic='/out')], [0.5], 0.01, 0.1, learned, True, ())

    def fresh():
        return Following([answer], '/out', thing, 'point.x', ['point.x'])

    found, out = fresh(), stamped(1.0, 2)
    assert found.due(out, 1.0) == 1.1
    found.hear('/in', '/talker', stamped(track(0.5, A), 1), 0.5)
    assert found.tracked(out, 1.0, False) is None
    found.hear('/in', '/talker', stamped(track(0.55, A), 2), 1.01)
    made = found.tracked(out, 1.0, False)
    assert (made.header.stamp, out.point.x) == (out.header.stamp, 1.0)
    assert forced(found, made.point.x, 1.1) == {A: pytest.approx(0.6)}
    # none has this stamp: the latest one that it has followed
    found = fresh()
    found.hear('/in', '/talker', stamped(track(0.5, A), 1), 0.5)
    found.hear('/in', '/talker', stamped(track(0.55, A), 2), 1.01)
    made = found.tracked(stamped(1.0, 3), 1.0, True)
    assert forced(found, made.point.x, 1.1) == {A: pytest.approx(0.55)}


def test_of_two_senders_a_stamp_has_to_say_which_counts():
    found = following(dependency(0))
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    found.hear('/in', '/rival', Float64(0.5), 1.01)
    with pytest.raises(NotInvertible, match=r'^/talker and /rival send /in, and no stamp says of which of their'):
        found.tracked(Float64(1.0), 1.2, True)


def test_messages_about_another_thing_are_passed_over():
    thing = messages.thing_of(stamped(0.0, 1))
    number = Number('/in', thing, 'point.x')
    learned = Learned((dependency(0),), (0.0,), (), (), (), 0.05, 10)
    answer = Answer([number], [number._replace(topic='/out')], [0.5], 0.01, 0.1, learned, True, ())
    found = Following([answer], '/out', thing, 'point.x', ['point.x'])
    found.hear('/in', '/talker', stamped(track(0.5, A), 2), 1.0)
    other = stamped(1.0, 2)
    other.header.frame_id = 'odom'
    assert found.tracked(other, 1.2, True) is None
    assert found.tracked(stamped(1.0, 2), 1.2, True) is not None


def test_an_input_stays_in_the_range_that_was_learned():
    found = following(dependency(0))
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    out = found.tracked(Float64(1.0), 1.2, True).data
    assert forced(found, out, 1.2) == {A: pytest.approx(0.6)}
    with pytest.raises(NotInvertible, match=r'^/in/data would be 0\.65, and was learned from 0\.4 to 0\.6 only$'):
        forced(found, out, 1.3)


def test_what_may_not_be_sent_is_asked_of_others():
    found = following(dependency(0))
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    asked = []
    out = found.tracked(Float64(1.0), 1.2, True).data
    found.solve(out, lambda part: solve(part, 1.1), lambda topic, _, path, value: asked.append((topic, path, value)))
    assert asked == [('/in', 'data', pytest.approx(0.55))]


def test_what_moves_the_other_way_is_refused():
    for value, how in ((1.0, 'not moved'), (0.9, 'moved the other way')):
        found = following(dependency(0))
        found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
        forced(found, found.tracked(Float64(1.0), 1.2, True).data, 1.1)
        found.hear('/in', '/talker', Float64(track(0.55, A)), 1.3)
        out = found.tracked(Float64(value), 1.5, True).data
        for _ in range(2):
            with pytest.raises(NotInvertible, match=rf'^it has {how}, and was to move by \+0\.1 as was learned$'):
                forced(found, out, 1.1)


def test_what_is_seen_corrects_the_slope():
    found = following(dependency(0))
    found.hear('/in', '/talker', Float64(track(0.5, A)), 1.0)
    forced(found, found.tracked(Float64(1.0), 1.2, True).data, 1.1)
    found.hear('/in', '/talker', Float64(track(0.55, A)), 1.3)
    assert forced(found, found.tracked(Float64(1.2), 1.5, True).data, 1.1) == {A: pytest.approx(0.525)}


@pytest.mark.parametrize('kind', ['saturated', 'stepped', 'discontinuous', 'kinked', 'coupled'])
def test_what_has_no_slope_is_not_followed(kind):
    with pytest.raises(NotFollowed, match=rf'^/out/data moves with /in/data, {kind}, and no slope'):
        following(dependency(0, kind))
    assert [one.number.name for one in following(dependency(0, kind), dependency(1)).ranges] == ['/other/data']


def test_a_parameter_is_not_followed():
    with pytest.raises(NotFollowed, match=r'^/out/data moves with /opaque/gain, a parameter, and no slope'):
        following(dependency(0), inputs=('/opaque/gain',), at=(4.0,))


def test_what_moves_with_nothing_follows_nothing():
    assert following().ranges == []
