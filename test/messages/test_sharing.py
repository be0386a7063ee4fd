"""A message that is decoded after another one of its publisher shares with it what is the same, and nothing else."""

import io
import random
import sys
import types

import genpy
import genpy.dynamic
import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, TransformStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarkerInit, Marker, MarkerArray

from rosslt import Source, is_tracked, sources, track, values
from rosslt.messages import Announcer, SharingDecoder, append_provenance, blank, decode, decoder
from rosslt.messages.errors import UnknownOutline

#: Messages with arrays: the names of these, and the classes of their elements.
ARRAYS = {
    MarkerArray: [('markers', Marker)],
    TFMessage: [('transforms', TransformStamped)],
    PoseArray: [('poses', Pose)],
    JointState: [('position', float), ('velocity', float)],
    Float64MultiArray: [('data', float)],
}


def tracked(value, number=1):
    return track(value, Source('/n', number))


def in_band(message, announcer=None):
    buff = io.BytesIO()
    message.serialize(buff)
    append_provenance(message, buff, announcer=announcer)
    return buff.getvalue()


def marker(x=0.0, number=0, points=(), stamp=0, text='', y=0.0):
    made = Marker(id=number, points=[Point(each, 0.0, 0.0) for each in points], text=text)
    made.header = Header(seq=stamp, stamp=genpy.Time(stamp, stamp), frame_id='world')
    made.pose.position.x, made.pose.position.y = x, y
    return made


def described(message):
    """All of a message: its leaves, and what each comes from."""
    return [
        (path, type(leaf), repr(leaf), values.affine(leaf) if is_tracked(leaf) else None)
        for path, leaf in values.leaves(message)
    ]


class Received:
    """The messages of one publisher, each of which is compared with what it is if it comes alone."""

    def __init__(self, message_class=MarkerArray):
        self._class, self._decoder = message_class, SharingDecoder(message_class)

    def bytes(self, data):
        message = self._class()
        assert self._decoder.decode_into(message, data) is None
        assert described(message) == described(decode(data, self._class).message)
        return message

    def markers(self, *markers):
        return self.bytes(in_band(MarkerArray(list(markers)))).markers


@pytest.fixture
def received():
    return Received()


def test_what_is_the_same_is_the_same_object(received):
    before = received.markers(marker(tracked(1.0), 0), marker(tracked(2.0, 2), 1), marker(3.0, 2))
    after = received.markers(marker(tracked(1.0), 0), marker(tracked(2.0, 2), 1, y=5.0), marker(3.0, 2))
    assert [one is other for one, other in zip(before, after)] == [True, False, True]
    assert after[1].pose.position.x is before[1].pose.position.x
    assert before[1].pose.position.y == 0.0


def test_numbers_change_while_their_provenance_is_the_same(received):
    received.markers(marker(tracked(1.0), 0), marker(tracked(2.0, 2), 1))
    after = received.markers(marker(tracked(1.5), 0), marker(tracked(2.0, 2), 1))
    assert values.source_values([after[0].pose.position.x]) == {Source('/n', 1): 1.5}


def test_provenance_changes_while_the_numbers_are_the_same(received):
    before = received.markers(marker(tracked(1.0), 0), marker(tracked(2.0, 2), 1))
    after = received.markers(marker(tracked(1.0), 0), marker(tracked(2.0, 3), 1))
    assert sources(after[1].pose.position.x) == [Source('/n', 3)]
    assert after[0] is not before[0]


def test_provenance_goes_and_comes(received):
    received.markers(marker(tracked(1.0)))
    assert not is_tracked(received.markers(marker(1.0)))
    assert sources(received.markers(marker(tracked(1.0)))) == [Source('/n', 1)]


def test_other_points_before_it_move_the_leaves_of_an_element(received):
    received.markers(marker(points=[tracked(1.0, 1), 2.0]), marker(tracked(2.0, 2)))
    received.markers(marker(points=[tracked(1.0, 1)]), marker(tracked(2.0, 2)))
    # As many bytes as before, and the same provenance, of other leaves.
    one = marker(points=[0.0] * 3)
    data = in_band(MarkerArray([one, marker(tracked(2.0, 2))]))
    fewer = io.BytesIO()
    MarkerArray([marker(points=[0.0] * 2, text='x' * 24), marker(2.0)]).serialize(fewer)
    received.bytes(data)
    after = received.bytes(fewer.getvalue() + data[len(fewer.getvalue()) :])
    assert not is_tracked(after.markers[1].pose.position.x)


def test_the_number_of_elements_changes(received):
    many = [marker(tracked(float(number), number), number) for number in range(5)]
    for count in (5, 3, 5, 0, 5):
        assert len(received.markers(*many[:count])) == count


def test_a_new_stamp_alone_makes_no_new_element(received):
    before = received.markers(marker(tracked(1.0), stamp=1), marker(2.0, stamp=1))
    after = received.markers(marker(tracked(1.0), stamp=2), marker(2.0, stamp=2))
    assert [one is other for one, other in zip(before, after)] == [True, True]
    assert [one.header.stamp for one in after] == [genpy.Time(2, 2)] * 2


def test_of_a_marker_that_moves_the_pose_alone_is_another_object(received):
    one = marker(tracked(1.0), stamp=1, text='above')
    one.scale.x, one.ns = tracked(3.0, 4), 'names'
    (before,) = received.markers(one)
    one.header.stamp, one.pose.position.z = genpy.Time(2, 2), 7.0
    (after,) = received.markers(one)
    assert after.pose is not before.pose
    assert [getattr(after, name) is getattr(before, name) for name in ('scale', 'color', 'lifetime', 'points')] == [
        True
    ] * 4
    assert after.pose.position.x is before.pose.position.x
    assert sources(after.scale.x) == [Source('/n', 4)]
    assert (before.header.stamp, after.header.stamp) == (genpy.Time(1, 1), genpy.Time(2, 2))
    one.pose.position.z, one.color.r = 8.0, 0.5
    (last,) = received.markers(one)
    assert last.scale is not after.scale  # more than a part has changed
    assert (last.pose.position.z, after.pose.position.z, before.pose.position.z) == (8.0, 7.0, 0.0)


@pytest.mark.parametrize('message_class', [MarkerArray, TFMessage])
@pytest.mark.parametrize('seed', range(4))
def test_parts_stamps_and_texts_change_in_any_order(message_class, seed):
    chance, received = random.Random(seed), Received(message_class)
    ((name, element),) = ARRAYS[message_class]
    elements = [element() for _ in range(4)]
    texts = ['header.frame_id', 'ns'] if element is Marker else ['header.frame_id', 'child_frame_id']
    numbers = [path for path, leaf in values.leaves(elements[0]) if type(leaf) is float]
    owned = {}
    for _ in range(200):
        for index, one in enumerate(elements):
            one.header.stamp = genpy.Time(chance.randrange(3), 0)
            for _ in range(chance.choice((0, 1, 1, 2))):
                path = chance.choice(numbers)
                value = chance.choice((0.0, -0.0, 1.0, -2.5))
                if owned.setdefault((index, path), chance.random() < 0.3):
                    value = tracked(value, index) * 2
                put(one, path, value)
            if chance.random() < 0.05:
                put(one, chance.choice(texts), chance.choice(('', 'a', 'b', 'abc', tracked('ab'))))
        received.bytes(in_band(message_class(**{name: elements})))


def test_a_stamp_that_is_tracked_is_decoded_anew(received):
    for stamp in (1, 2):
        one = marker(tracked(1.0), stamp=stamp)
        one.header.stamp.secs = tracked(stamp, 9)
        assert sources(received.markers(one)) == [Source('/n', 9), Source('/n', 1)]


@pytest.mark.parametrize('nsecs', [0, 5])
def test_a_tracked_stamp_keeps_its_provenance_while_the_pose_moves(received, nsecs):
    for turn in range(4):
        one = marker(tracked(1.0), y=float(turn))
        one.header.stamp.secs, one.header.stamp.nsecs = tracked(7, 2), nsecs
        (shown,) = received.markers(one)
        assert sources(shown.header.stamp.secs) == [Source('/n', 2)]


def test_zeros_of_either_sign_are_told_apart(received):
    for value in (0.0, -0.0, 0.0):
        received.markers(marker(tracked(value), y=value))


def test_references_to_an_earlier_provenance_are_resolved():
    audience, received = object(), Received()
    announcer = Announcer(MarkerArray, lambda: audience)
    message = MarkerArray([marker(2 * tracked(float(number), number), number) for number in range(2)])
    sent = [in_band(message, announcer) for _ in range(4)]
    assert len(sent[-1]) < len(sent[0])
    assert len({id(received.bytes(data).markers[0]) for data in sent}) == 1


@pytest.mark.parametrize('message_class', [*ARRAYS, Pose])
def test_any_messages_one_after_the_other_are_what_each_is_alone(message_class):
    chance, received = random.Random(0), Received(message_class)
    message = message_class()
    for name, element in ARRAYS.get(message_class, ()):
        setattr(message, name, [element() for _ in range(6)])
    numbers = [path for path, leaf in values.leaves(message) if type(leaf) is float]
    for _ in range(300):
        for path in chance.sample(numbers, min(len(numbers), chance.choice((0, 0, 1, 3)))):
            value = chance.choice((0.0, 1.0, -2.5))
            source = Source('/n', chance.randrange(3))
            put(message, path, chance.choice((value, track(value, source), 0.5 * track(value, source) + 1)))
        for one in getattr(message, 'markers', ()) if message_class is MarkerArray else ():
            if chance.random() < 0.02:
                one.points = [Point(tracked(1.0, chance.randrange(3)), 0.0, 0.0)] * chance.randrange(3)
        received.bytes(in_band(message))


NESTED = """Robot[] robots
================================================================================
MSG: nested_msgs/Robot
float64 speed
Team[] teams
float64 load
================================================================================
MSG: nested_msgs/Team
float64[] weights
"""


def test_elements_may_have_arrays_of_messages_with_arrays(monkeypatch):
    classes = genpy.dynamic.generate_dynamic('nested_msgs/Fleet', NESTED)
    monkeypatch.setitem(sys.modules, 'nested_msgs', types.ModuleType('nested_msgs'))
    monkeypatch.setitem(sys.modules, 'nested_msgs.msg', types.ModuleType('nested_msgs.msg'))
    sys.modules['nested_msgs'].msg = sys.modules['nested_msgs.msg']
    fleet, robot, team = (classes['nested_msgs/' + name] for name in ('Fleet', 'Robot', 'Team'))
    for message_class, name in ((robot, 'Robot'), (team, 'Team')):
        setattr(sys.modules['nested_msgs.msg'], name, message_class)
    chance, received = random.Random(0), Received(fleet)

    def number():
        return tracked(1.0, chance.randrange(9)) if chance.random() < 0.2 else 1.0

    robots = []
    for _ in range(200):
        if chance.random() < 0.5:
            teams = [team([number() for _ in range(chance.randrange(4))]) for _ in range(chance.randrange(3))]
            robots = [*robots[-2:], robot(number(), teams, number())]
        received.bytes(in_band(fleet(robots)))


def put(message, path, value):
    """Set a field of a message by its path, as of `values.leaves`."""
    owner, _, name = path.rpartition('.')
    exec('message.%s.%s = value' % (owner, name) if owner else 'message.%s = value' % name)


def test_what_is_bad_is_said_as_always_and_the_next_message_is_read(received):
    good = in_band(MarkerArray([marker(tracked(1.0))]))
    one = received.bytes(good).markers[0]
    for place in range(4, len(good)):
        data = bytearray(good)
        data[place] ^= 0x55
        message, alone = MarkerArray(), MarkerArray()
        try:
            error = decoder(MarkerArray)(alone, bytes(data))
        except genpy.DeserializationError:
            with pytest.raises(genpy.DeserializationError):
                received._decoder.decode_into(message, bytes(data))
        else:
            assert str(received._decoder.decode_into(message, bytes(data))) == str(error)
            for one_of_both in (*message.markers, *alone.markers):
                one_of_both.lifetime.canon()  # genpy reads 1e9 nanoseconds as a second, but not in an array
            assert described(message) == described(alone)
        assert described(received.bytes(good).markers[0]) == described(one)


def test_an_unknown_reference_is_said_to_be_one(received):
    plain = io.BytesIO()
    MarkerArray([marker(1.0)]).serialize(plain)
    data = plain.getvalue() + b'12345678' + b'\x08\x00\x00\x00rSLR'
    assert isinstance(received._decoder.decode_into(MarkerArray(), data), UnknownOutline)


@pytest.mark.parametrize('message_class', [Marker, TransformStamped, JointState, Pose, InteractiveMarkerInit])
def test_a_blank_message_is_what_its_class_makes(message_class):
    make = blank(message_class)
    assert make() == message_class()
    assert described(make()) == described(message_class())
    first = make()
    for name in first.__slots__:
        part = getattr(first, name)
        assert isinstance(part, (int, float, str, bytes)) or getattr(make(), name) is not part
