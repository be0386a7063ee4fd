"""Provenance as bytes: what arrives is what was sent, in the sizes that were promised."""

from concurrent.futures import ThreadPoolExecutor

import numpy
import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from hypothesis import given, strategies
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Empty, Float32, Float64, Float64MultiArray, Header, Int64, String, UInt8, UInt64
from visualization_msgs.msg import Marker

from rosslt import Source, evaluate, explain, is_tracked, math, solve, sources, track
from rosslt.messages import attach, encode, tracked_type, wrap
from rosslt.messages.codec.decoder import ReceivedHeader
from rosslt.values import AFFINE, SOURCE, assemble
from support.filling import assert_arrived, in_band, serialized

NODE = '/interactive_script'
X, Y, Z = (track(value, Source(NODE, 0x21D6A37D9B01 + place)) for place, value in enumerate((0.25, -1.5, 2.0)))


def arrived(message, **options):
    """A message after its way."""
    received = type(message)().deserialize(serialized(message))
    attach(received, encode(message, **options))
    return received


def bezier(t, b0, b1, b2):
    return t * t * b2 + 2 * t * (1 - t) * b1 + (1 - t) * (1 - t) * b0


def straight_pose():
    return Pose(position=Point(X, Y, Z))


def bezier_pose():
    return Pose(position=Point(*(bezier(0.3, 0.5, end, end) for end in (X, Y, Z))))


def bezier_strip():
    strip = Marker(type=Marker.LINE_STRIP)
    strip.header.frame_id = 'world'
    strip.points = [Point(*(bezier(step / 10, 0.5, end, end) for end in (X, Y, Z))) for step in range(11)]
    return strip


def test_sizes_are_as_promised(capsys):
    promised = [  # message, plain size, the paper's in ROS 1, the largest here
        ('Pose, x y z straight from three locations', straight_pose(), 56, 199, 120),
        ('Pose, x y z a Bezier of those', bezier_pose(), 56, 313, 160),
        ('line strip Marker, 11 Bezier points', bezier_strip(), 423, 2810, 760),
    ]
    with capsys.disabled():
        print('\n%-44s %7s %7s %7s %9s %7s' % ('message', 'plain', 'paper', 'tracked', 'in-band', 'limit'))
        for name, message, plain, paper, limit in promised:
            tracked = len(serialized(wrap(message, tracked_type(type(message)))))
            behind = len(in_band(message))
            print('%-44s %5d B %5d B %5d B %7d B %5d B' % (name, plain, paper, tracked, behind, limit))
            assert len(serialized(message)) == plain
            assert max(tracked, behind) <= limit
            assert_arrived(message, arrived(message))


@pytest.mark.parametrize(
    'message',
    [Empty(), Pose(), Marker(points=[Point()] * 3), Image(data=b'12'), String('grün')],
    ids=lambda message: message._type,
)
def test_a_message_without_a_tracked_field_is_sent_as_rospy_sends_it(message):
    assert in_band(message) == serialized(message)


def test_an_untracked_message_of_a_tracked_type_has_an_empty_provenance():
    wrapped = wrap(Pose(), tracked_type(Pose))
    assert len(serialized(wrapped)) == len(serialized(Pose())) + 4


def counted(value):
    return track(value, Source('/counter', 1))


def stamped(secs, nsecs):
    header = Header()
    header.stamp.secs, header.stamp.nsecs = secs, nsecs
    return header


CARRIED = {
    'a field that is its source': straight_pose(),
    'sums': bezier_strip(),
    'slopes of both signs and an offset': Float64(3 * X - 0.5 * Y + 4),
    'expressions': Pose(position=Point(math.hypot(X, Y) * math.cos(Z), math.sin(Z), Z)),
    'the largest integers': [Int64(counted(2**63 - 1)), Int64(counted(-(2**63))), UInt64(counted(2**64 - 1))],
    'an expression of integers': Int64(counted(2**62) - 3),
    'texts': PoseStamped(header=Header(frame_id='robot/' + counted('tür') + '_link')),
    'both parts of a time': stamped(counted(2**32 - 1), track(999999998, Source('/clock', 2)) + 1),
    'a field of 32 bits': Float32(counted(0.1)),
    'elements of an array': LaserScan(ranges=[1.0, 2 * X, 3.0], intensities=(1.0,) * 4),
    'bytes': Image(data=[1, counted(2), 255]),
    'a bool in a byte': UInt8(counted(True)),
}


@pytest.mark.parametrize('sent', CARRIED.values(), ids=CARRIED)
def test_every_provenance_arrives_and_is_sent_on(sent):
    for message in sent if isinstance(sent, list) else [sent]:
        received = arrived(message)
        assert_arrived(message, received)
        assert_arrived(message, arrived(received))


def test_an_expression_arrives_as_it_was_recorded():
    assert 'hypot' in explain(arrived(Float64(math.hypot(X, Y) * math.cos(Z))).data)


def test_a_value_that_was_cut_to_a_linearization_says_so_after_its_way():
    (source,) = sources(X)
    x = assemble([(SOURCE, source, 0.25), (AFFINE, 3.0, ((0, 2.0),), False)])[1]
    assert 'linearized' in explain(x)
    assert explain(arrived(Float64(x)).data) == explain(x)


def test_more_operations_than_fit_are_sent_linearized():
    points = []
    for place in range(2400):
        angle = track(0.001 * place, Source('/arm', place))
        points.append(Point(math.sin(angle) * 2, math.cos(angle) * 2, math.exp(angle)))
    received = arrived(Marker(points=points))
    tracked = [point for point in received.points if is_tracked(point.x)]
    assert len(tracked) == len(points)
    for sent, point in zip(points, received.points[:5]):
        assert point == sent
        assert 'linearized' in explain(point.x)
        nudge = {sources(sent.x)[0]: sent.x / 2 + 1e-6}
        assert evaluate(point.x, nudge) == pytest.approx(evaluate(sent.x, nudge), abs=1e-6)


def test_sums_of_more_terms_than_fit_are_sent_untracked(caplog):
    total = sum(track(0.5, Source('/wide', place)) for place in range(4100))
    received = arrived(Float64MultiArray(data=[total * (1 + place % 3) for place in range(70)]))
    assert [is_tracked(each) for each in received.data] == [True] * 63 + [False] * 7
    assert 'the sums of the message have too many terms' in caplog.text


@pytest.mark.parametrize('full_history', [False, True])
def test_expressions_over_more_terms_than_fit_are_linearized_as_far_as_they_fit(full_history):
    values = [track(0.001 * place, Source('/wide', place)) for place in range(500)]
    sent = [
        math.sin(sum([value * (1 + (place * each) % 7) for place, value in enumerate(values)])) for each in range(90)
    ]
    received = arrived(Float64MultiArray(data=sent), full_history=full_history)
    assert [is_tracked(each) for each in received.data] == [True] * 80 + [False] * 10
    assert len(sources(received.data[0])) == len(values)
    nudge = {sources(sent[1])[3]: 0.003001}
    assert evaluate(received.data[1], nudge) == pytest.approx(evaluate(sent[1], nudge), abs=1e-9)


def test_an_integer_source_of_a_float_field_stays_an_integer():
    received = arrived(Float64(track(3, Source('/counter', 1))))
    assert received.data == 3.0
    assert [type(value) for value in solve(received.data, 4.0).values()] == [
        type(value) for value in solve(track(3, Source('/counter', 1)), 4.0).values()
    ]


def test_two_readings_of_one_source_are_kept_apart():
    source = Source('/counter', 1)
    before, after = track(1.0, source), track(2.0, source)
    received = arrived(Point(2 * before, 2 * after, after))
    assert evaluate(received.x, {}) == 2.0
    assert evaluate(received.y, {}) == 4.0
    assert evaluate(received.x, {source: 5.0}) == evaluate(received.y, {source: 5.0}) == 10.0


def test_a_numpy_array_that_was_received_holds_tracked_elements():
    sent = LaserScan(ranges=[X, 1.0])
    received = LaserScan().deserialize_numpy(serialized(sent), numpy)
    attach(received, encode(sent))
    assert sources((received.ranges * 2)[0]) == sources(X)


def test_a_full_history_means_the_same_and_tells_more():
    x = (X + 1) * 2 - 3
    folded, full = arrived(Float64(x)), arrived(Float64(x), full_history=True)
    assert explain(full.data) == explain(x) != explain(folded.data)
    assert solve(full.data, 9.0) == solve(folded.data, 9.0) == solve(x, 9.0)


def test_a_full_history_that_is_too_long_is_folded():
    x = X
    points = []
    for _ in range(4000):
        x = x * 1.0001 + 0.1
        points.append(Point(x, 2.0, 3.0))
    received = arrived(Marker(points=points), full_history=True)
    assert evaluate(received.points[-1].x, {sources(X)[0]: 1.0}) == pytest.approx(
        evaluate(x, {sources(X)[0]: 1.0}), rel=1e-9
    )


@pytest.mark.parametrize('value', [float('inf'), float('nan')])
def test_a_field_that_is_not_finite_is_its_source_still(value):
    received = arrived(Float64(track(value, Source('/sensor', 1))))
    assert sources(received.data) == [Source('/sensor', 1)]


def test_one_expression_that_is_not_finite_leaves_the_others_tracked(caplog):
    x = track(1000.0, Source('/sensor', 1))
    huge = (x * 1e200) * (x * 1e200)
    received = arrived(Pose(position=Point(math.sin(x), huge, huge - huge), orientation=Quaternion(w=math.sqrt(x) * x)))
    assert explain(received.position.x) == 'sin(1000.0 [/sensor#1])'
    assert sources(received.orientation.w) == [Source('/sensor', 1)]
    assert not sources(received.position.y)
    assert not sources(received.position.z)
    assert 'delivered untracked: an operation gives inf' in caplog.text


def test_what_cannot_be_sent_is_left_out_with_a_warning(caplog):
    far = track(float('inf'), Source('/sensor', 1))
    received = arrived(Point(1 / far, X, math.atan(far)))
    assert [is_tracked(each) for each in (received.x, received.y, received.z)] == [False, True, False]
    assert 'untracked' in caplog.text
    assert 'inf' in caplog.text


@pytest.mark.parametrize(
    ('node', 'count'), [('/node_%d' % 0, 20000), ('/' + 'long_name_' * 9 + '%d', 12000)], ids=['leaves', 'bytes']
)
def test_of_what_is_too_much_for_one_message_the_first_part_arrives(node, count, caplog):
    names = [node % place if '%' in node else node for place in range(count)]
    sent = Marker(points=[Point(track(2.0, Source(name, place)), 0.0, 0.0) for place, name in enumerate(names)])
    received = arrived(sent)
    tracked = [is_tracked(point.x) for point in received.points]
    assert tracked == sorted(tracked, reverse=True)
    assert count // 2 <= sum(tracked) < count
    assert 'visualization_msgs/Marker' in caplog.text


def test_a_location_id_has_48_bits(caplog):
    received = arrived(Point(track(1.0, Source('/node', 2**48 - 1)), track(1.0, Source('/node', 2**48)), 0))
    assert sources(received.x) == [Source('/node', 2**48 - 1)]
    assert not is_tracked(received.y)
    assert '48 bits' in caplog.text


def test_what_is_never_looked_at_is_never_decoded(monkeypatch):
    decoded = []
    terms = ReceivedHeader._terms
    monkeypatch.setattr(ReceivedHeader, '_terms', lambda self, *field: decoded.append(field) or terms(self, *field))
    received = arrived(bezier_strip())
    assert received.points[3].x + 1.0 == bezier_strip().points[3].x + 1.0
    assert is_tracked(received)
    assert decoded == []
    explain(received.points[3].x)
    assert len(decoded) == 1


def test_a_value_is_decoded_once_for_all_that_ask(monkeypatch):
    received = arrived(bezier_strip()).points[3].x
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(sources, [received] * 64))
    assert found == [sources(X)] * 64


def test_provenance_of_an_earlier_way_is_replaced():
    received = arrived(straight_pose())
    attach(received, encode(bezier_pose()))
    assert solve(received.position.x, 1.0) != {sources(X)[0]: 1.0}


@given(
    strategies.lists(strategies.floats(allow_nan=False, allow_infinity=False, width=64), min_size=1, max_size=5),
    strategies.floats(-1e6, 1e6),
    strategies.floats(-1e6, 1e6),
)
def test_affine_values_arrive_for_all_numbers(values, slope, offset):
    x = sum(slope * track(value, Source('/node', place)) for place, value in enumerate(values)) + offset
    if abs(x) < 1e300 and is_tracked(x):
        received = arrived(Float64(x)).data
        assert received == x
        assert sources(received) == sources(x)
        changes = dict.fromkeys(sources(x), 1.0)
        assert evaluate(received, changes) == pytest.approx(
            evaluate(x, changes), rel=1e-6, abs=1e-6 * (1 + max(map(abs, values)) * abs(slope))
        )


@pytest.mark.parametrize('kind', [Float64, Float32], ids=lambda cls: cls._type)
def test_a_location_that_is_not_set_yet_is_itself_after_its_way(kind):
    x = track(float('nan'), Source(NODE, 1))
    received = arrived(kind(x)).data
    assert evaluate(received, {Source(NODE, 1): 2.0}) == 2.0
    assert solve(received, 3.0) == {Source(NODE, 1): 3.0}
