"""Which messages of a publisher are whole, and what a reader knows of the plain ones between them."""

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, TransformStamped
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import Source, evaluate, is_tracked, math, solve, sources, track
from rosslt.messages import LastProvenance, SampledProvenance, attach, encode
from rosslt.messages.sampling import KEPT, MOST_THINGS, thing_reader
from rosslt.values import untracked

RATE = 20.0
A, B = Source('/node', 1), Source('/node', 2)
X, Y = track(2.0, A), track(3.0, B)


class Sent:
    """What a publisher sends, at times that a test says."""

    def __init__(self):
        self.now, self.state = 100.0, 0
        self._sampled = SampledProvenance(lambda: RATE, lambda: self.now)

    def is_whole(self, message, at=None):
        self.now = self.now if at is None else 100.0 + at
        data = self._sampled.to_send(message, False, self.state)
        assert data in (b'', encode(message))
        return bool(data)


def test_the_first_message_is_whole_and_later_ones_at_the_rate():
    sent = Sent()
    whole = [step for step in range(1000) if sent.is_whole(Point(X, Y, step), step / 1000)]
    assert whole[0] == 0
    assert len(whole) == pytest.approx(RATE, abs=1)


def test_rare_messages_are_always_whole():
    sent = Sent()
    assert all(sent.is_whole(Point(X, 0, 0), step * 1.01 / RATE) for step in range(50))


def test_the_message_after_a_change_is_whole():
    sent = Sent()
    assert sent.is_whole(Point(X, 0, 0))
    assert not sent.is_whole(Point(X, 0, 0))
    sent.state += 1
    assert sent.is_whole(Point(X, 0, 0))


def test_messages_without_provenance_do_not_take_the_turn_of_those_with_it():
    sent = Sent()
    assert not sent.is_whole(Point())
    assert sent.is_whole(Point(X, 0, 0))
    assert not sent.is_whole(Point(), 0.06)
    assert sent.is_whole(Point(X, 0, 0), 0.06)


def test_each_thing_that_is_sent_in_turn_is_whole_at_the_rate():
    sent = Sent()
    for at in (0.0, 0.06, 0.12):
        for number in range(5):
            marker = Marker(id=number)
            marker.pose.position.x = X
            assert sent.is_whole(marker, at)
            assert not sent.is_whole(marker, at)
    assert sent.is_whole(PoseStamped(header=Header(frame_id='a'), pose=Pose(position=Point(X, 0, 0))))


def test_what_is_endless_is_not_remembered_for_ever():
    sent = Sent()
    for number in range(3 * MOST_THINGS):
        assert sent.is_whole(Marker(id=number, pose=Pose(position=Point(X, 0, 0))))
    assert len(sent._sampled._due) <= MOST_THINGS


def test_a_message_that_rospy_refuses_is_left_to_it():
    for wrong in (PoseArray(poses=[None]), Marker(ns=[])):
        assert SampledProvenance(lambda: RATE).to_send(wrong, False, 0) == b''


def test_a_thing_is_named_by_texts_and_whole_numbers_without_numbers_and_times_of_headers():
    read = thing_reader(Marker)
    one, other = Marker(ns='a', id=1), Marker(ns='a', id=1)
    other.header.seq, other.header.stamp.secs, other.pose.position.x = 5, 6, 7.0
    assert read(one) == read(other)
    assert len({read(Marker(ns=ns, id=number)) for ns in 'ab' for number in (1, 2)}) == 4
    frames = [TFMessage([TransformStamped(child_frame_id=name)]) for name in 'ab']
    assert len(set(map(thing_reader(TFMessage), [*frames, TFMessage()]))) == 3
    assert thing_reader(Pose)(Pose()) == ()
    assert thing_reader(PoseArray)(PoseArray(poses=[Pose()])) == thing_reader(PoseArray)(PoseArray())


def received(message):
    """A message as it comes whole."""
    plain = untracked(message)
    attach(plain, encode(message))
    return plain


def test_a_plain_message_has_the_provenance_of_the_last_whole_one_that_it_equals():
    last = LastProvenance()
    whole = received(Point(X, X * Y, 5.0))
    assert last.completed(whole, '/node', 1.0) is whole
    plain = Point(2.0, 6.0, 7.0)
    found = last.completed(plain, '/node', 1.1)
    assert found == plain
    assert sources(found) == [A, B]
    assert not is_tracked(plain)
    assert last.completed(Point(2.0, 6.5, 5.0), '/node', 1.1) is None


def test_nan_is_no_other_number():
    last = LastProvenance()
    last.completed(received(Point(X, 0, 0)), '/node', 1.0)
    assert last.completed(Point(math.nan, 0, 0), '/node', 1.1) is None
    assert last.approximated(Point(math.nan, 0, 0), '/node', 1.1).x != X


def test_a_message_that_has_moved_is_approximated_on_request():
    last = LastProvenance()
    whole = received(Point(X, X * Y, 5.0))
    assert last.approximated(whole, '/node', 1.0) is whole
    plain = Point(2.0, 6.5, 5.0)
    found = last.approximated(plain, '/node', 1.1)
    assert found == Point(2.0, 6.5, 5.0)
    assert sources(found) == [A, B]
    assert not is_tracked(found.z)
    assert not is_tracked(plain)
    assert evaluate(found.x, {A: 7.0}) == 7.0
    # what has moved since keeps how it was computed
    assert evaluate(found.y, {A: 4.0}) == 12.5
    assert solve(found.y, 12.5, A) == {A: 4.0}


def test_nothing_is_told_of_other_things_other_publishers_other_sizes_and_long_ago():
    last = LastProvenance()
    whole = received(MarkerArray([Marker(id=1, pose=Pose(position=Point(X, 0, 0)))]))
    last.completed(whole, '/node', 1.0)
    plain = untracked(whole)
    others = [
        (MarkerArray([Marker(id=2)]), '/node', 1.1),
        (plain, '/other', 1.1),
        (plain, '/node', 1.1 + KEPT),
    ]
    for message, publisher, now in others:
        assert last.completed(message, publisher, now) is message
        assert not last.is_between(message, publisher, now)
    longer = MarkerArray([*plain.markers, Marker()])
    assert last.completed(longer, '/node', 1.1) is None
    assert last.approximated(longer, '/node', 1.1) is longer
    assert last.is_between(plain, '/node', 1.1)
    assert is_tracked(last.completed(plain, '/node', 1.1))


def test_nothing_is_told_of_another_thing_further_on_in_a_message():
    def transforms(*frames):
        message = TFMessage([TransformStamped(child_frame_id=frame) for frame in frames])
        message.transforms[1].transform.translation.x = 2.0
        return message

    whole = transforms('hand', 'camera')
    whole.transforms[1].transform.translation.x = X
    last = LastProvenance()
    last.completed(whole, '/node', 0.0)
    same = last.completed(transforms('hand', 'camera'), '/node', 0.01)
    assert sources(same.transforms[1].transform.translation.x) == [A]
    other = transforms('hand', 'laser')
    assert last.completed(other, '/node', 0.02) is None
    assert not is_tracked(last.approximated(other, '/node', 0.02).transforms[1].transform.translation.x)


def test_texts_keep_their_sources_as_long_as_they_are_the_same():
    last = LastProvenance()
    last.completed(received(String(track('a', A))), '/node', 1.0)
    assert sources(last.completed(String('a'), '/node', 1.0)) == [A]
    assert not is_tracked(last.completed(String('b'), '/node', 1.0))
    assert not is_tracked(last.approximated(String('b'), '/node', 1.0))


def test_what_moves_and_is_curved_keeps_its_sources():
    last = LastProvenance()
    last.completed(received(Point(math.sin(X), 0, 0)), '/node', 1.0)
    moved = last.approximated(Point(0.95, 0, 0), '/node', 1.01).x
    assert moved == 0.95
    assert sources(moved) == [A]
    assert evaluate(moved, {A: 2.5}) == pytest.approx(0.95 + math.sin(2.5) - math.sin(2.0))
