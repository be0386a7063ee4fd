"""Whatever goes wrong in reading provenance, the message is delivered untracked, and the next one is read as before."""

import genpy.dynamic
import pytest
from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header, String
from visualization_msgs.msg import Marker

from rosslt import Source, is_tracked, sources, track
from rosslt.messages import (
    BadHeader,
    attach,
    decode,
    encode,
    inband,
    split_provenance,
    tracked_type,
    tracked_types,
    wrap,
)
from rosslt.messages.walkers import BYTES_LIMIT
from rosslt.node.topics.serialization import received_class
from support.filling import Filling, assert_arrived, in_band, serialized

ONE, TWO = Source('/n', 1), Source('/n', 2)
X = track(0.25, ONE)


def test_provenance_of_a_byte_of_a_long_array_goes_to_no_other_field():
    """Nobody tracks such bytes, but others may write so."""
    text = 'uint8[] data\nfloat64 x\nstd_msgs/Header[] headers\n' + 80 * '=' + '\nMSG: std_msgs/Header\n'
    long = genpy.dynamic.generate_dynamic('long_msgs/Long', text + Header._full_text)['long_msgs/Long']
    size = BYTES_LIMIT + 10
    for index in (1, size - 4, size - 2, size - 1):
        numbers = [0.0] * size
        numbers[index - 1] = X  # behind the offset in the layout
        message = long(bytes(size), 1.0, [Header()])
        with pytest.raises(BadHeader, match='leaf %d, .* a byte of an array of more than' % index):
            attach(message, encode(Float64MultiArray(data=numbers)))
        assert not is_tracked(message.x)


@pytest.mark.parametrize('cls', [Pose, Marker, JointState, PoseArray, String], ids=lambda cls: cls._type)
def test_messages_of_all_sorts_arrive_among_each_other(cls):
    sent = [Filling(seed % 7).message(cls) for seed in range(7)]
    for message in sent:
        received = decode(in_band(message), cls)
        assert received.error is None
        assert_arrived(message, received.message)


def spoilt(message):
    """The message in-band, its provenance of an unknown version."""
    plain, provenance = split_provenance(in_band(message), type(message))
    return plain + in_band(message)[len(plain) :].replace(provenance, b'\x63' + provenance[1:])


def test_a_bad_provenance_comes_with_the_untracked_message():
    received = decode(spoilt(Pose(position=Point(X, 0.0, 0.0))), Pose)
    assert isinstance(received.error, BadHeader)
    assert 'version 99' in str(received.error)
    assert received.message == Pose(position=Point(0.25, 0.0, 0.0))
    assert not is_tracked(received.message)


class Unforeseen(Exception):
    """An exception that the decoder does not expect."""


def fail_half_way(message, data):
    message.position.x = track(message.position.x, TWO)
    raise Unforeseen('of no known kind')


@pytest.mark.parametrize('transport', [lambda cls: cls, tracked_type], ids=['in-band', 'tracked type'])
def test_an_exception_of_any_class_leaves_the_message_untracked_and_is_named(transport, monkeypatch):
    sent = Pose(position=Point(X, 0.0, 0.0))
    cls = transport(Pose)
    data = in_band(sent) if cls is Pose else serialized(wrap(sent, cls))
    with monkeypatch.context() as patched:
        patched.setattr(inband, 'attach', fail_half_way)
        patched.setattr(tracked_types, 'attach', fail_half_way)
        received = decode(data, cls)
    assert isinstance(received.error, BadHeader)
    assert 'Unforeseen: of no known kind' in str(received.error)
    assert not is_tracked(received.message)
    assert received.message == sent
    assert_arrived(sent, decode(data, cls).message)


def test_a_subscriber_goes_on_after_an_exception_and_reports_it_once_a_publisher(monkeypatch):
    reported = []
    monkeypatch.setattr('rospy.logwarn', lambda text, *arguments: reported.append(text % arguments))
    cls = received_class(Pose, '/a_topic_of_its_own')
    sent = Pose(position=Point(X, 0.0, 0.0))
    with monkeypatch.context() as patched:
        patched.setattr(inband, 'attach', fail_half_way)
        for publisher in ('/one', '/one', '/two'):
            message = cls().deserialize(in_band(sent))
            message._connection_header = {'callerid': publisher}
            assert type(message) is Pose
            assert not is_tracked(message)
            assert message == sent
    assert [text.split()[0] for text in reported] == ['/one', '/two']
    assert sources(cls().deserialize(in_band(sent))) == [ONE]


def test_an_exception_in_decoding_an_expression_leaves_its_field_untracked(monkeypatch, caplog):
    def fail(*arguments):
        raise Unforeseen('of no known kind')

    received = decode(in_band(Pose(position=Point(X * X, X, 0.0))), Pose).message
    monkeypatch.setattr('rosslt.messages.codec.expressions.bounded_size', fail)
    assert sources(received.position.x) == []
    assert sources(received.position.y) == [ONE]
    assert 'of no known kind' in caplog.text


def test_a_message_whose_provenance_cannot_be_encoded_is_sent_without(monkeypatch, caplog):
    def fail(*_):
        raise Unforeseen('of no known kind')

    sent = Pose(position=Point(X, 0.0, 0.0))
    monkeypatch.setattr('rosslt.messages.codec.encoder.sent_fields', fail)
    assert in_band(sent) == serialized(sent)
    assert 'Unforeseen' in caplog.text


def refused_text():
    """A text that was received with an expression that does not make it."""
    message = String('zz')
    attach(message, encode(String(track('a', ONE) + 'b')))
    return message


def test_a_message_whose_provenance_was_refused_is_sent_on_without(caplog):
    received = refused_text()
    for full in (False, True):
        assert encode(received, full) == b''
    assert encode(String('frame/' + received.data)) == b''
    message = String(received.data + track('b', TWO))
    assert decode(in_band(message), String).error is None
    assert sources(decode(in_band(message), String).message) == [TWO]


@pytest.mark.parametrize('start', [track('a', ONE), track(True, ONE)], ids=['text', 'bool'])
def test_an_expression_over_no_numbers_that_is_too_long_is_left_out_and_named(start, caplog):
    value = start
    for _ in range(9000):
        value = value + ('b' if isinstance(value, str) else 0.5)
    message = String(value) if isinstance(value, str) else Float64MultiArray(data=[value, X])
    received = decode(in_band(message), type(message))
    assert received.error is None
    if not isinstance(value, str):
        assert sources(received.message) == [ONE]
        assert not is_tracked(received.message.data[0])
    assert 'too long' in caplog.text


def test_slopes_beyond_all_floats_do_no_harm(caplog):
    y = track(0.0, ONE)
    for _ in range(9000):
        y = y + y
    message = Float64MultiArray(data=[y * y + y, track(1.5, TWO)])
    for full in (False, True):
        assert sources(decode(in_band(message), Float64MultiArray).message.data[1]) == [TWO]
        assert encode(message, full)
    # other threads may ask services meanwhile
    assert not [one for one in caplog.records if one.name == 'rosout' and 'failed' in one.getMessage()]
