"""Messages that refer to the provenance of an earlier one: shorter, and never about another provenance."""

import hashlib
import io
import random
import struct
import threading

import pytest
from geometry_msgs.msg import Point, Pose, Twist, Vector3
from hypothesis import given, settings, strategies
from std_msgs.msg import Float64, Float64MultiArray, Int64, String
from visualization_msgs.msg import Marker

from rosslt import Source, evaluate, is_tracked, math, sources, track
from rosslt.messages import (
    Announcer,
    BadHeader,
    UnknownOutline,
    append_provenance,
    attach,
    decode,
    encode,
    in_full,
    provenance_size,
    split_provenance,
)
from rosslt.messages.codec import OUTLINES, announcing
from rosslt.messages.codec.announcing import MOST_ANNOUNCED, MOST_NEW, NEXT_TRY, PERIOD, SHORTEST_PERIOD
from rosslt.messages.codec.outlines import (
    KNOWN_BYTES_LIMIT,
    KNOWN_LIMIT,
    RECENT_LARGE,
    RECENT_SMALL,
    SLOPES_SENT,
    VALUES_SENT,
    Outlines,
    checksum_of,
    cut_of,
)
from support.filling import assert_arrived, serialized

FOOTER = 8
NODE = '/interactive_script'


@pytest.fixture(autouse=True)
def _nothing_known(monkeypatch):
    """Every test begins as a process does that has received nothing."""
    for name, value in vars(Outlines()).items():
        monkeypatch.setattr(OUTLINES, name, value)


class Publisher:
    """What a publisher writes, at times that the test sets."""

    def __init__(self, message_class):
        self.now = 0.0
        self.audience = [object()]
        self.announcer = Announcer(message_class, lambda: self.audience, lambda: self.now)
        self.announcer.reference(encode(Float64(track(0.5, Source('/before', 1)))))  # it has sent something before

    def sent(self, message):
        buff = io.BytesIO()
        message.serialize(buff)
        append_provenance(message, buff, announcer=self.announcer)
        return buff.getvalue()


def is_reference(data):
    return data.endswith(b'rSLR')


def framed(provenance):
    """A provenance with its footer."""
    return provenance + struct.pack('<I4s', len(provenance), b'rSLT')


def located(*numbers, node=NODE, first=0x21D6A37D9B01):
    return [track(value, Source(node, first + place)) for place, value in enumerate(numbers)]


def pose(x=0.25, y=-1.5, z=2.0, node=NODE):
    return Pose(position=Point(*located(x, y, z, node=node)))


def bezier(t, b0, b1, b2):
    return t * t * b2 + 2 * t * (1 - t) * b1 + (1 - t) * (1 - t) * b0


def bezier_pose(t, *ends):
    return Pose(position=Point(*(bezier(t, 0.5, end, end) for end in located(*ends or (0.25, -1.5, 2.0)))))


def bezier_strip(*ends):
    strip = Marker(type=Marker.LINE_STRIP)
    strip.header.frame_id = 'world'
    ends = located(*ends)
    strip.points = [Point(*(bezier(step / 10, 0.5, end, end) for end in ends)) for step in range(11)]
    return strip


def assert_all_arrive(publisher, messages):
    """All of them arrive as they were sent; the sizes of what was sent."""
    sizes = []
    for message in messages:
        data = publisher.sent(message)
        received, error = decode(data, type(message))
        assert error is None
        assert_arrived(message, received)
        sizes.append(len(data))
    return sizes


def test_what_stands_still_is_sent_by_its_checksum():
    assert assert_all_arrive(Publisher(Pose), [pose()] * 3) == [116, 72, 72]


def test_the_first_message_to_a_new_subscriber_is_full_also_where_that_came_while_one_was_sent():
    publisher = Publisher(Pose)
    assert [is_reference(publisher.sent(pose())) for _ in range(3)] == [False, True, True]
    publisher.audience = [*publisher.audience, object()]
    assert [is_reference(publisher.sent(pose())) for _ in range(4)] == [False, False, True, True]


def test_after_a_second_at_most_it_is_full_again():
    publisher = Publisher(Pose)
    full, message = [], pose()
    for step in range(3000):
        publisher.now = step * 0.01
        if not is_reference(publisher.sent(message)):
            full.append(publisher.now)
    between = [after - before for before, after in zip(full, full[1:])]
    assert min(between) >= SHORTEST_PERIOD
    assert max(between) <= PERIOD + 0.011
    assert len({round(each, 2) for each in between}) > 5, 'at random'


def test_messages_slower_than_once_a_second_are_always_full():
    publisher = Publisher(Pose)
    for step in range(20):
        publisher.now = 1.01 * step
        assert not is_reference(publisher.sent(pose()))


def test_nothing_refers_where_all_is_to_be_full():
    publisher = Publisher(Pose)
    publisher.audience = None
    assert [is_reference(publisher.sent(pose())) for _ in range(5)] == [False] * 5


def test_a_moving_pose_sends_its_coefficients_only():
    sizes = assert_all_arrive(Publisher(Pose), [bezier_pose(0.01 * step + 0.1) for step in range(50)])
    assert sizes[0] == 157
    assert max(sizes[1:]) <= 112


def test_a_strip_of_which_the_ends_move_sends_their_values_only():
    sizes = assert_all_arrive(Publisher(Marker), [bezier_strip(0.25, 0.01 * step + 1, 2.0) for step in range(10)])
    assert sizes[0] == 679
    assert max(sizes[1:]) <= 560


def test_values_and_coefficients_that_change_both_are_sent_both():
    ways = [bezier_pose(0.013 * step + 0.1, step + 0.5, step + 1.5, step + 2.5) for step in range(20)]
    sizes = assert_all_arrive(Publisher(Pose), ways)
    assert max(sizes[1:]) < sizes[0]


def test_what_is_not_affine_refers_too_where_it_stands_still_or_its_sources_move():
    def reach(x, y):
        x, y = located(x, y)
        return Float64(math.hypot(x, y) * math.cos(x))

    publisher = Publisher(Float64)
    sizes = assert_all_arrive(publisher, [reach(3.5, 4.5)] * 2 + [reach(0.1 * step + 1, 2.5) for step in range(10)])
    assert max(sizes[1:]) < sizes[0]


def test_integers_and_texts_that_change_are_sent_in_full():
    for kind, values in ((Int64, range(10)), (String, map(str, range(10)))):
        publisher = Publisher(kind)
        messages = [kind(2 * track(value, Source(NODE, 1))) for value in values]
        assert_all_arrive(publisher, messages)


@settings(max_examples=60, deadline=None)
@given(strategies.lists(strategies.sampled_from([0.0, -0.0, 0.5, -1.25, 1e300, 5e-324, 3.0]), min_size=4, max_size=40))
def test_a_reference_stands_for_the_very_bytes_of_its_provenance(numbers):
    publisher = Publisher(Point)
    for step, (a, b, c) in enumerate(zip(numbers, numbers[1:], numbers[2:])):
        publisher.now = 0.1 * step
        x, y = located(a, b)
        message = Point(c * x + 1.0, x + c * y, y)
        data = publisher.sent(message)
        assert split_provenance(in_full(data, Point), Point) == (serialized(message), encode(message))


@settings(max_examples=40, deadline=None)
@given(strategies.lists(strategies.tuples(strategies.integers(0, 5), strategies.booleans()), max_size=60))
def test_with_messages_lost_at_random_nothing_is_ever_wrong(steps):
    publisher = Publisher(Pose)
    for step, (shape, is_lost) in enumerate(steps, 1):
        publisher.now += 0.05
        if shape < 3:
            message = (pose(0.5 * step), bezier_pose(0.01 * step), bezier_pose(0.3, step + 0.5, 1.5, 2.5))[shape]
        else:
            message = pose(float(shape), node='/node%d' % shape)
        data = publisher.sent(message)
        if not is_lost:
            received, error = decode(data, Pose)
            assert received == message
            if error is None:
                assert_arrived(message, received)
            else:
                assert isinstance(error, UnknownOutline)
                assert not is_tracked(received.position.x)


def test_a_late_joiner_that_missed_the_full_one_gets_plain_messages_and_no_wrong_ones():
    publisher = Publisher(Pose)
    publisher.sent(pose())
    received, error = decode(publisher.sent(pose()), Pose)
    assert isinstance(error, UnknownOutline)
    assert 'has not been received' in str(error)
    assert received == pose()
    assert not is_tracked(received.position.x)
    publisher.now += PERIOD
    full = publisher.sent(pose())
    assert is_tracked(decode(full, Pose).message.position.x)
    assert is_tracked(decode(publisher.sent(pose()), Pose).message.position.x)


def test_an_outline_counts_from_whichever_publisher_and_in_whichever_order_it_came():
    one, other = Publisher(Pose), Publisher(Pose)
    one.sent(pose())
    early = one.sent(pose())
    assert isinstance(decode(early, Pose).error, UnknownOutline)
    assert decode(other.sent(pose()), Pose).error is None
    assert_arrived(pose(), decode(early, Pose).message)


def test_two_publishers_of_one_topic_are_not_mixed_up():
    one, other = Publisher(Pose), Publisher(Pose)
    for _ in range(3):
        for publisher, node in ((one, '/one'), (other, '/two')):
            received = decode(publisher.sent(pose(node=node)), Pose).message
            assert {source.node for source in sources(received.position.x)} == {node}


def test_the_same_bytes_of_another_type_do_not_resolve_a_reference():
    # The leaves 0 to 2 of a Twist are those of a Pose too: the same provenance, which says something else.
    publisher = Publisher(Twist)
    twist = Twist(linear=Vector3(*located(0.25, -1.5, 2.0)))
    assert encode(twist) == encode(pose())
    reference = [publisher.sent(twist) for _ in range(2)][1]
    decode(Publisher(Pose).sent(pose()), Pose)
    assert isinstance(decode(reference, Twist).error, UnknownOutline)


def test_a_decoder_that_does_not_know_references_reads_the_ordinary_message():
    publisher = Publisher(Pose)
    publisher.sent(pose())
    data = publisher.sent(pose())
    assert Pose().deserialize(data) == pose()
    assert not data.endswith(b'rSLT')  # where such a decoder looks


@pytest.mark.parametrize('size', [0, 1, 7])
def test_what_is_too_short_for_a_reference_is_refused(size):
    received, error = decode(serialized(pose()) + behind(b'x' * size), Pose)
    assert not isinstance(error, UnknownOutline)
    assert 'a reference of %d bytes' % size in str(error)
    assert received == pose()


def behind(reference):
    return reference + len(reference).to_bytes(4, 'little') + b'rSLR'


@pytest.mark.parametrize('size', [1, 7, 8, 16, 24, 8000])
def test_a_reference_with_other_floats_than_its_outline_has_is_refused(size):
    publisher = Publisher(Pose)
    decode(publisher.sent(pose()), Pose)
    reference = split_reference(publisher.sent(pose()))
    received, error = decode(serialized(pose()) + behind(bytes(size) + reference), Pose)
    assert 'a reference of %d bytes, expected 8' % (size + 8) in str(error)
    assert not is_tracked(received.position.x)


def split_reference(data):
    size = int.from_bytes(data[-FOOTER:-4], 'little')
    return data[-FOOTER - size : -FOOTER]


@pytest.mark.parametrize('wrong', [float('nan'), float('inf')])
def test_floats_in_a_reference_are_checked_as_any(wrong):
    publisher = Publisher(Pose)
    for t in (0.3, 0.4):
        data = publisher.sent(bezier_pose(t))
        decode(data, Pose)
    reference = split_reference(data)
    bad = struct.pack('<d', wrong) + reference[8:]
    received, error = decode(serialized(pose()) + behind(bad), Pose)
    assert isinstance(error, BadHeader)
    assert not isinstance(error, UnknownOutline)
    assert 'finite' in str(error)
    assert not is_tracked(received.position.x)


def test_random_references_never_resolve_nor_raise():
    generator = random.Random(1)
    publisher = Publisher(Pose)
    for t in (0.3, 0.4):
        data = publisher.sent(bezier_pose(t))
        decode(data, Pose)
    for _ in range(3000):
        changed = bytearray(data)
        for _ in range(generator.randint(1, 3)):
            changed[generator.randrange(56, len(data))] = generator.randrange(256)
        received, error = decode(bytes(changed), Pose)
        if is_tracked(received.position.x):
            assert error is None
            assert changed[-16:] == data[-16:], 'only floats differ'


def test_memory_is_bounded_however_many_outlines_come():
    for place in range(KNOWN_LIMIT + RECENT_SMALL):
        decode(Publisher(Float64).sent(Float64(2.5 * track(1.5, Source('/n', place)))), Float64)
        if place % 500 == 0:
            decode(serialized(Float64(1.0)) + behind(place.to_bytes(8, 'big')), Float64)
    decode(serialized(Float64(1.0)) + behind(b'unknown!'), Float64)
    assert len(OUTLINES._known) <= KNOWN_LIMIT
    assert OUTLINES._bytes == sum(len(known.data) for known in OUTLINES._known.values()) <= KNOWN_BYTES_LIMIT
    assert len(OUTLINES._small) <= RECENT_SMALL


def test_memory_is_bounded_however_large_they_are():
    for node in range(200):
        outline = encode(Float64(track(1.5, Source('/n' * 100000 + str(node), 1))))
        OUTLINES.met(Float64, outline)
        with pytest.raises(UnknownOutline):
            OUTLINES.resolved(Float64, b'unknown!')
    assert 0 < OUTLINES._bytes <= KNOWN_BYTES_LIMIT


def test_large_ones_that_are_few_among_many_others_are_known():
    def large(node, step):
        return Float64MultiArray(
            data=[1.5 * value for value in located(*[step + 0.1 * each for each in range(400)], node=node)]
        )

    publisher, full, found = Publisher(Float64MultiArray), 0, []
    for step in range(30):
        publisher.now += 0.1
        data = publisher.sent(large('/slow', step))
        full += not is_reference(data)
        message = decode(data, Float64MultiArray).message
        if full > 1 and is_reference(data):  # before, nobody knew that there are references
            found.append(is_tracked(message.data[0]))
        for other in range(2 * RECENT_LARGE):
            sent = large('/fast', 100 * step + other)
            decode(serialized(sent) + framed(encode(sent)), Float64MultiArray)
    assert found
    assert all(found)


def test_an_outline_that_was_dropped_is_known_again_once_it_is_repeated():
    publisher = Publisher(Pose)
    decode(publisher.sent(pose()), Pose)
    reference = publisher.sent(pose())
    decode(reference, Pose)
    OUTLINES._known.clear()
    assert isinstance(decode(reference, Pose).error, UnknownOutline)
    publisher.now += PERIOD
    decode(publisher.sent(pose()), Pose)
    assert decode(reference, Pose).error is None


def test_what_is_new_with_every_message_is_not_looked_at_each_time(monkeypatch):
    looked = []
    monkeypatch.setattr(announcing, 'cut_of', lambda *each: looked.append(1) or cut_of(*each))
    publisher = Publisher(Pose)
    for number in range(MOST_NEW + 10 * NEXT_TRY):
        assert not is_reference(publisher.sent(pose(node='/n%d' % number)))
    assert len(looked) <= MOST_NEW + 11
    assert len(publisher.announcer._announced) <= MOST_ANNOUNCED
    for _ in range(NEXT_TRY + 1):
        last = publisher.sent(pose())
    assert is_reference(last), 'what stays is found again'


def test_what_no_reader_takes_is_sent_in_full_and_stops_nobody():
    publisher = Publisher(Float64)
    assert [publisher.announcer.reference(b'\x01\x00 no provenance') for _ in range(3)] == [b''] * 3


def test_several_outlines_in_turn_are_all_remembered():
    publisher = Publisher(Pose)
    poses = [pose(node='/n%d' % number) for number in range(5)]
    assert [is_reference(publisher.sent(each)) for each in poses * 3] == [False] * 5 + [True] * 10


def test_the_checksum_is_that_of_the_page():
    data = encode(bezier_pose(0.3))
    cut = cut_of(Pose, data)
    text = (
        Pose._md5sum.encode()
        + bytes([SLOPES_SENT])
        + data[: cut.slopes_at]
        + bytes(cut.slopes_to - cut.slopes_at)
        + data[cut.slopes_to :]
    )
    assert checksum_of(Pose, data, cut, SLOPES_SENT) == hashlib.blake2b(text, digest_size=8).digest()
    assert list(cut.kinds()) == [0, VALUES_SENT, SLOPES_SENT, VALUES_SENT | SLOPES_SENT]


def test_sizes_count_a_reference_as_provenance():
    publisher = Publisher(Pose)
    assert [provenance_size(publisher.sent(pose()), Pose) for _ in range(2)] == [60, 16]


def test_threads_share_what_is_known():
    publishers = [Publisher(Pose) for _ in range(4)]
    faults = []

    def receive(place):
        for step in range(300):
            publishers[place].now += 0.01
            message = pose(0.25 * step, node='/n%d' % place)
            received, error = decode(publishers[place].sent(message), Pose)
            if error is not None or {source.node for source in sources(received.position.x)} != {'/n%d' % place}:
                faults.append(error)

    threads = [threading.Thread(target=receive, args=(place,)) for place in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults


def test_a_changed_source_is_followed_through_references():
    publisher = Publisher(Float64)
    for value in (0.5, 0.75, 1.5):
        received = decode(publisher.sent(Float64(3.5 * track(value, Source('/n', 1)))), Float64).message
        assert evaluate(received.data, {Source('/n', 1): 2.0}) == 7.0


def test_attaching_what_a_reference_stands_for_is_attaching_the_provenance():
    publisher = Publisher(Pose)
    decode(publisher.sent(pose()), Pose)
    plain, provenance = split_provenance(publisher.sent(pose()), Pose)
    received = Pose().deserialize(plain)
    attach(received, provenance)
    assert_arrived(pose(), received)
