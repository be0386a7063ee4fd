"""Provenance that is written less often than it is sent still says what holds for each message."""

import io
import itertools
import math
import random
import types

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray
from std_msgs.msg import Float64MultiArray, String

import rosslt
from rosslt import messages, values
from rosslt.messages.codec import sparing

RADIUS, TURN, OTHER = (rosslt.Source('/node', number) for number in (1, 2, 3))


@pytest.fixture
def in_debt(monkeypatch):
    """A publisher that has spent all that it may on its first message, and more with each that it writes."""
    written = []
    for share in ('SHARE', 'MOST_SHARE'):
        monkeypatch.setattr(sparing, share, 1e-9)
    for wait in ('LONGEST', 'LONGEST_OF_LARGE', 'RENEWED_EVERY'):
        monkeypatch.setattr(sparing, wait, 3600.0)
    for name in ('provenance_to_send', 'encoded_with_slopes'):
        original = getattr(sparing, name)
        monkeypatch.setattr(
            sparing, name, lambda *arguments, original=original: (written.append(1), original(*arguments))[1]
        )
    return written


def _sent(provenance, message):
    buff = io.BytesIO()
    values.untracked(message).serialize(buff)
    messages.append_provenance(message, buff, False, provenance.to_send)
    return messages.decode(buff.getvalue(), type(message))


def _circle(turn, radius=2.0, source=RADIUS):
    tracked = values.track(radius, source)
    x, y = tracked * rosslt.math.cos(values.track(turn, TURN)), tracked * 3
    return PoseArray(poses=[Pose(position=Point(x, y, tracked)), Pose(position=Point(1.0, 2.0, 3.0))])


def test_what_stands_still_is_written_once_and_stays_exact(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for _ in range(5):
        message, error = _sent(provenance, _circle(0.5))
        assert error is None
        assert values.explain(message.poses[0].position.x) == '2.0 [/node#1] * cos(0.5 [/node#2])'
        assert values.explain(message.poses[0].position.y) == '3 * 2.0 [/node#1]'
        assert values.sources(message.poses[0].position.z) == [RADIUS]
    assert len(in_debt) == 2


def test_what_moves_has_its_present_value_and_the_slopes_of_the_last_writing(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    turning = [values.track(2.0, RADIUS) * math.cos(turn / 100) for turn in range(40)]
    for x in turning:
        curved = rosslt.math.sin(x * 0.1)
        message, error = _sent(provenance, PoseArray(poses=[Pose(position=Point(x, curved, 7.0))]))
        position = message.poses[0].position
        assert error is None
        assert (position.x, position.y) == (values.untracked(x), values.untracked(curved))
        assert values.sources(position.x) == values.sources(position.y) == [RADIUS]
        assert values.solve(position.y, position.y + 0.001)[RADIUS] == pytest.approx(2.0, abs=0.1)
    assert len(in_debt) <= 4


def test_another_source_or_another_operation_is_written_anew(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for _ in range(3):
        _sent(provenance, _circle(0.5))
    message, _ = _sent(provenance, _circle(0.5, source=OTHER))
    assert values.sources(message.poses[0].position.z) == [OTHER]
    other = _circle(0.5)
    other.poses[0].position.y = values.track(2.0, RADIUS) + 4
    message, _ = _sent(provenance, other)
    assert values.explain(message.poses[0].position.y) == '2.0 [/node#1] + 4.0'


def test_two_sorts_of_messages_in_turn_are_both_remembered(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    longer = _circle(0.5)
    longer.poses += _circle(0.5).poses
    for _ in range(6):
        assert values.sources(_sent(provenance, _circle(0.5)).message.poses[0].position.z) == [RADIUS]
        assert values.sources(_sent(provenance, longer).message.poses[2].position.z) == [RADIUS]
    assert len(in_debt) <= 4


def test_a_growing_message_keeps_the_provenance_of_what_was_there(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    message = Float64MultiArray(data=[values.track(1.5, RADIUS) * (n + 1) for n in range(100)])
    for count in range(10):
        message.data = [*message.data, values.track(1.5, RADIUS) * (count + 0.5)]
        received, error = _sent(provenance, message)
        assert error is None
        assert sum(values.is_tracked(one) for one in received.data) >= 0.9 * len(message.data)
        assert values.untracked(received.data) == tuple(values.untracked(message.data))
    assert len(in_debt) < 10


def test_what_is_forgotten_is_written_anew(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for _ in range(3):
        _sent(provenance, _circle(0.5))
    provenance.forget()
    message, _ = _sent(provenance, _circle(0.5, radius=4.0))
    assert values.solve(message.poses[0].position.y, 15.0) == {RADIUS: 5.0}


def test_a_source_of_another_node_that_has_changed_is_written_anew(in_debt, monkeypatch):
    provenance = messages.SparingProvenance(messages.Allowance())
    monkeypatch.setattr(sparing, 'RENEWED_EVERY', 0.0)
    for share in ('RENEWING_SHARE', 'LOOKING_SHARE'):
        monkeypatch.setattr(sparing, share, 1e9)
    for turn in range(30):
        present = 2.0 + turn // 3
        radius = values.track(present, RADIUS)
        x, y = radius * 2.0 + turn, radius * values.track(3.0, OTHER)
        message, error = _sent(provenance, Point(x, y, 1.0))
        assert error is None
        assert values.solve(message.x, 5.0) == {RADIUS: pytest.approx((5.0 - turn) / 2)}
        assert values.source_values([message.y])[RADIUS] == present
    monkeypatch.undo()
    monkeypatch.setattr(sparing, 'SHARE', 1e-9)
    written = []
    for turn in range(300):  # it changes all the time
        data = provenance.to_send(Point(values.track(2.0 + turn, RADIUS) * 2.0, 0.0, 1.0))
        written += [data] if data not in written else []
    assert len(written) < 100


def test_what_has_become_plain_has_no_provenance(in_debt):
    """Not that of what was in its place, whether it is equal to that or not."""
    for moves in (False, True):
        provenance = messages.SparingProvenance(messages.Allowance())
        for turn in range(40):
            factor = 1.0 + turn / 10 if moves else 1.0
            data = [values.track(2.0, rosslt.Source('/node', number)) * factor for number in range(100)]
            plain = {turn % 100, (7 * turn) % 100} if turn > 10 else set()
            for place in plain:
                data[place] = values.untracked(data[place]) + (turn % 2 if moves else 0)
            message, error = _sent(provenance, Float64MultiArray(data=data))
            assert error is None
            assert message.data == values.untracked(data) or list(message.data) == values.untracked(data)
            for place, one in enumerate(message.data):
                assert values.is_tracked(one) == (place not in plain), (moves, turn, place)


def test_texts_that_change_and_whole_numbers_that_turn_stay_right(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for word in ('one', 'two', 'three', 'four'):
        text = values.track('the ', RADIUS) + word
        message, error = _sent(provenance, String(text))
        assert error is None
        assert message.data == 'the ' + word
        assert not values.is_tracked(message.data) or values.explain(message.data).endswith(f"'{word}'")


def test_while_there_is_time_each_message_is_written_as_it_is(monkeypatch):
    monkeypatch.setattr(sparing, 'SHARE', 1e9)
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(5):
        message, _ = _sent(provenance, _circle(turn / 10))
        assert values.explain(message.poses[0].position.x) == f'2.0 [/node#1] * cos({turn / 10} [/node#2])'


def test_two_things_sent_in_turn_keep_their_own_sources(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(20):
        for source in (RADIUS, OTHER):
            message, error = _sent(provenance, Point(values.track(1.5, source) * 2 + turn, 0.0, 0.0))
            assert error is None
            assert values.sources(message.x) == [source]
    assert len(in_debt) <= 6
    assert provenance.takes_turns


def _seen(turn, misses=True):
    """What a sensor sees that turns: each beam ends at this wall or that, or at none."""
    walls = values.track(2.0, RADIUS) * 1.5, values.track(3.0, OTHER) + 0.5
    ends = [*walls, 9.0] if misses else walls
    seen = [ends[(beam + turn * turn) % 7 % len(ends)] for beam in range(40)]
    return Float64MultiArray(data=[walls[0], *seen, *[walls[1]] * (turn % 4 if misses else 1)])


def _sources_of_all(message):
    return [values.sources(one) if values.is_tracked(one) else [] for one in message.data]


def test_what_is_made_in_another_way_each_time_has_the_part_that_still_holds(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(50):
        message = _seen(turn)
        received, error = _sent(provenance, message)
        assert error is None
        assert received.data == tuple(values.untracked(message.data))
        assert values.sources(received.data[0]) == [RADIUS]
        for found, right in zip(_sources_of_all(received), _sources_of_all(message)):
            assert found in ([], right)
    assert len(in_debt) <= sparing.FIRST_WRITINGS + 1


def test_what_is_made_in_another_way_each_time_is_written_whole_now_and_then(in_debt, monkeypatch):
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(20):
        _sent(provenance, _seen(turn))
    written = len(in_debt)
    later = sparing.time.monotonic() + 3601
    monkeypatch.setattr(sparing.time, 'monotonic', lambda: later)
    message = _seen(20)
    assert _sources_of_all(_sent(provenance, message).message) == _sources_of_all(message)
    for turn in range(20):
        _sent(provenance, _seen(turn))
    assert len(in_debt) == written + 1


def test_a_change_has_what_is_made_in_another_way_written_whole(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(20):
        _sent(provenance, _seen(turn))
    provenance.forget()
    for turn in range(3):
        message = _seen(turn)
        assert _sources_of_all(_sent(provenance, message).message) == _sources_of_all(message)


def test_what_was_recorded_of_things_sent_in_turn_is_not_written_each_time(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for turn in range(10):
        _sent(provenance, _seen(turn, misses=False))
    assert provenance.takes_turns
    written = len(in_debt)
    for turn in range(20):
        message, buff = _seen(turn, misses=False), io.BytesIO()
        values.untracked(message).serialize(buff)
        messages.append_provenance(message, buff, False, lambda one, _: provenance.recalled(one))
        received, error = messages.decode(buff.getvalue(), Float64MultiArray)
        assert error is None
        assert values.sources(received.data[0]) == [RADIUS]
        for found, right in zip(_sources_of_all(received), _sources_of_all(message)):
            assert found in ([], right)
    assert len(in_debt) == written


def test_what_was_not_recorded_is_not_taken_for_another_thing_sent_in_turn(in_debt):
    provenance = messages.SparingProvenance(messages.Allowance())
    for source in (RADIUS, OTHER, RADIUS):
        _sent(provenance, Point(values.track(1.5, source) * 2, values.track(1.0, TURN), 0.0))
    buff = io.BytesIO()
    message = Point(3.0, values.track(1.0, TURN), 0.0)
    values.untracked(message).serialize(buff)
    messages.append_provenance(message, buff, False, lambda one, _: provenance.recalled(one))
    received, error = messages.decode(buff.getvalue(), Point)
    assert error is None
    assert not values.is_tracked(received.x)
    assert values.sources(received.y) == [TURN]


def test_what_is_sent_together_once_in_a_while_is_written_together(monkeypatch):
    seconds, milliseconds = [100.0], itertools.count()
    clock = types.SimpleNamespace(monotonic=lambda: seconds[0], thread_time=lambda: next(milliseconds) * 1e-3)
    monkeypatch.setattr(sparing, 'time', clock)
    provenance = messages.SparingProvenance(messages.Allowance())
    growing = []
    for _ in range(20):
        seconds[0] += 1.0
        growing += _circle(0.5).poses
        for source in (RADIUS, OTHER):
            message, _ = _sent(provenance, PoseArray(poses=[*_circle(0.5, source=source).poses, *growing]))
            assert values.sources(message.poses[0].position.z) == [source]
            assert values.sources(message.poses[-2].position.z) == [RADIUS]


def _robot(chance, poses):
    """Poses as a robot that goes on sends them: some go, some come, some move, some are made in another way."""
    if len(poses) > 8 or (poses and chance.random() < 0.3):
        poses.pop(chance.choice([0, -1]))
    while len(poses) < 4 or chance.random() < 0.4:
        source = chance.choice([RADIUS, TURN, OTHER])
        value = values.track(round(chance.uniform(1, 5), 3), source)
        made = chance.choice([value * 2, value + 1.5, value * 3 - 1, 4 - value])
        beside = chance.choice([made - values.track(1.0, TURN), 0.25, made])
        poses.append(Pose(position=Point(made, beside, chance.choice([1.0, values.track(4.0, OTHER)]))))
    return PoseArray(poses=list(poses))


@pytest.mark.parametrize('seed', range(12))
def test_whatever_is_sent_each_provenance_is_that_of_its_field(in_debt, monkeypatch, seed):
    """Of values that are affine in their sources, what was written is exact whatever they are later."""
    chance = random.Random(seed)
    provenance, poses = messages.SparingProvenance(messages.Allowance()), []
    monkeypatch.setattr(sparing, 'LOOKING_SHARE', chance.choice([1e-9, 1e9]))
    tracked = count = 0
    for step in range(150):
        message = _robot(chance, poses) if chance.random() < 0.7 else PoseArray(poses=list(poses))
        received, error = _sent(provenance, message)
        assert error is None
        if step in (40, 80, 120):
            provenance._due = 0.0  # now and then all is written
        for (path, value), (_, there) in zip(values.leaves(message.poses), values.leaves(received.poses)):
            assert values.untracked(there) == values.untracked(value)
            count += values.is_tracked(value)
            if values.is_tracked(there):
                tracked += 1
                assert values.slopes([there]) == pytest.approx(values.slopes([value])), path
    assert tracked > 0.05 * count
