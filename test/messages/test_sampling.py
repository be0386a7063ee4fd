"""Which messages of a publisher are whole, and what a reader knows of the plain ones between them."""

import itertools
import sys

import pytest
from geometry_msgs.msg import Point, PointStamped, Pose, PoseArray, PoseStamped, TransformStamped
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import NotInvertible, Source, evaluate, is_tracked, math, solve, sources, track
from rosslt.messages import SAMPLED, LastProvenance, SampledProvenance, attach, encode, make_unknown, sampling
from rosslt.messages.leaves import tracked_fields
from rosslt.messages.sampling import MOST_THINGS, thing_reader
from rosslt.values import OPERATION, UNKNOWN, allow, untracked

RATE = 20.0
A, B = Source('/node', 1), Source('/node', 2)
X, Y = track(2.0, A), track(3.0, B)


@pytest.fixture(autouse=True)
def no_cost(monkeypatch):
    """Writing takes no CPU time but what a test says, however busy the machine is."""
    monkeypatch.setattr(sampling.time, 'thread_time', lambda: 0.0)


class Sent:
    """What a publisher sends, at times that a test says."""

    def __init__(self, shared_clock=lambda: 0.5):
        self.now, self.state = 100.0, 0
        self._sampled = SampledProvenance(lambda: RATE, lambda: self.now, shared_clock)

    def _sends(self, message, at):
        """Whether a message that depends on what is not known is sent as a whole one; notes its tracked leaves."""
        self.now = 100.0 + at
        data = self._sampled.to_send(message, False, self.state)
        if data != SAMPLED:
            plain = untracked(message)
            attach(plain, data)
            self.last_leaves = tracked_fields(plain)
        return data != SAMPLED

    def is_whole(self, message, at=None):
        self.now = self.now if at is None else 100.0 + at
        data = self._sampled.to_send(message, False, self.state)
        assert data in ((SAMPLED, encode(message)) if is_tracked(message) else (b'',))
        return data not in (b'', SAMPLED)


def test_the_first_message_is_whole_and_later_ones_at_the_rate():
    sent = Sent()
    whole = [step for step in range(1000) if sent.is_whole(Point(X, Y, step), step / 1000)]
    assert whole[0] == 0
    assert len(whole) == pytest.approx(RATE, abs=1)


def test_messages_of_the_common_time_are_beside_those_at_the_rate():
    sent = Sent(lambda: sent.now)
    whole = [step / 1000 for step in range(10000) if sent.is_whole(Point(X, Y, step), step / 1000)]
    assert all(later - before < 1.5 / RATE for before, later in zip(whole, whole[1:]))
    assert all(sent.is_whole(Point(X, Y, 0), 10.1 + step / RATE) for step in range(50))


def test_rare_messages_are_always_whole():
    sent = Sent()
    assert all(sent.is_whole(Point(X, 0, 0), step * 1.01 / RATE) for step in range(50))


def test_the_message_after_a_change_is_whole():
    sent = Sent()
    assert sent.is_whole(Point(X, 0, 0))
    assert not sent.is_whole(Point(X, 0, 0))
    sent.state += 1
    assert sent.is_whole(Point(X, 0, 0))


def unknown(message):
    """The message as it is read when it came sampled, after it had come whole."""
    plain = untracked(message)
    make_unknown(plain, attach(untracked(message), encode(message)).leaves)
    return plain


def test_what_is_computed_of_a_sampled_message_is_never_whole():
    read = unknown(Point(X, 3.0, Y))
    assert list(map(is_tracked, (read.x, read.y, read.z))) == [True, False, True]
    assert sources(read.x + track(1.0, B)) == [UNKNOWN, B]
    for leaf in (read.x, read.x + Y, math.sin(read.x) * Y):
        assert encode(Point(0.0, leaf, Y)) == SAMPLED


def test_what_is_not_known_is_never_solved_for():
    read = unknown(Point(X, 0.0, 0.0))
    assert solve(read.x * 2 + Y, 9.0) == {B: 5.0}
    for solved in (read.x, read.x * 2, [read.x, read.x + 1]):
        with pytest.raises(NotInvertible):
            solve(solved, [5.0, 6.0] if isinstance(solved, list) else 5.0)


def test_a_message_that_waits_for_what_is_not_known_is_whole_next():
    sent = Sent()
    read = unknown(Point(X, 0.0, 0.0))
    assert sent.is_whole(Point(X, Y, 0), 0.0)
    for at in (0.06, 0.07, 0.3):
        assert not sent.is_whole(Point(read.x, Y, 0), at)
    assert sent.is_whole(Point(X, Y, 0), 0.31)


def test_what_stays_unknown_comes_round_and_is_sent_as_plain():
    sent = Sent()
    read = unknown(Point(X, 0.0, 0.0))
    whole = [at / 100 for at in range(500) if sent._sends(Point(read.x, Y, read.x + Y), at / 100)]
    assert len(whole) == 2
    assert min(whole[0], whole[1] - whole[0]) > sampling.COMES_ROUND[0]
    ((index, leaf, _),) = sent.last_leaves
    assert (index, sources(leaf)) == (1, [B])


def test_what_is_rarely_known_does_not_come_round():
    """A node that sends every three seconds, and reads an input of which one message in four is whole."""
    sent = Sent()
    read = unknown(Point(X, 0.0, 0.0))
    assert [sent._sends(Point((X if step % 4 == 3 else read.x), Y, 0.0), 3.0 * step) for step in range(40)] == [
        step % 4 == 3 for step in range(40)
    ]


def test_all_publishers_send_whole_messages_at_the_same_time():
    both = [SampledProvenance(lambda: RATE, lambda: now, lambda: now) for _ in range(2)]
    whole = []
    for step in range(3000):
        now = step / 1000
        sent = [one.to_send(Point(X, 0.0, 0.0), False, 0) for one in both[: 1 + (step > 17)]]
        if len(sent) == 2 and SAMPLED not in sent:
            whole.append(now)
    assert {int(at) for at in whole} == {0, 1, 2}


@pytest.mark.parametrize('phase', [0.0, 0.3, 0.71])
@pytest.mark.parametrize('cost', [0.005, 0.0175, 0.03, 0.075])
def test_a_costly_message_is_whole_at_the_same_time_as_others(monkeypatch, cost, phase):
    used = itertools.count()
    monkeypatch.setattr(sampling.time, 'thread_time', lambda: next(used) * cost)
    costly = Sent(lambda: costly.now)
    times = [phase + step / 100 for step in range(2000)]
    whole = [at for at in times if costly.is_whole(Point(X, 0.0, 0.0), at)]
    both = [at for at in whole if at % 1.0 < sampling.TOGETHER]
    assert len(whole) * cost < 0.03 * 20 or len(whole) <= 21
    assert all(later - before < 1.02 for before, later in zip(both, both[1:]))
    assert len(both) > 18


def test_a_publisher_of_many_things_writes_each_less_often(monkeypatch):
    """Frames, say: 100 of them at 20 Hz, each of which takes 1 ms."""
    used = itertools.count()
    monkeypatch.setattr(sampling.time, 'thread_time', lambda: next(used) * 0.001)
    sent = Sent(lambda: sent.now)
    whole = {number: [] for number in range(100)}
    for step in range(100):
        for number in whole:
            made = PointStamped(point=Point(X, 0.0, 0.0))
            made.header.frame_id = str(number)
            if sent.is_whole(made, step / 20):
                whole[number].append(step / 20)
    assert {len(times) for times in whole.values()} <= {5, 6}


def test_the_time_of_writing_provenance_is_taken_from_the_allowance(monkeypatch):
    used = itertools.count()
    monkeypatch.setattr(sampling.time, 'thread_time', lambda: next(used) * 0.005)
    before = allow(sys.maxsize)
    Sent().is_whole(Point(X, 0.0, 0.0))
    assert sys.maxsize - allow(before) == round(0.005 / OPERATION)


def test_a_costly_message_that_is_sent_again_is_not_encoded_again():
    sent, poses = Sent(), PoseArray(poses=[Pose(position=Point(X * step, Y, 0)) for step in range(4000)])
    assert sent.is_whole(poses)
    before = sent._sampled._last
    for at in (100.0, 200.0, 300.0):
        assert sent.is_whole(poses, at)
        assert sent._sampled._last is before
    poses.poses[17].position.x = 1.0 * Y + 0 * X  # equal numbers of other sources
    poses.poses[3].position.x, poses.poses[3].position.y = poses.poses[3].position.y, poses.poses[3].position.x
    assert sent.is_whole(poses, 400.0)


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


def test_a_sampled_message_has_the_provenance_of_the_last_whole_one_and_what_is_plain_stays_plain():
    last = LastProvenance()
    whole = received(Point(X, X * Y, 5.0))
    assert last.completed(whole, False, '/node') is whole
    message = Point(2.0, 6.5, 5.0)
    found = last.completed(message, True, '/node')
    assert found == message
    assert sources(found) == [A, B]
    assert not is_tracked(found.z)
    assert not is_tracked(message)
    assert evaluate(found.x, {A: 7.0}) == 7.0
    # what has moved since keeps how it was computed
    assert evaluate(found.y, {A: 4.0}) == 12.5
    assert solve(found.y, 12.5, A) == {A: 4.0}
    assert last.completed(message, False, '/node') is message
    assert sources(last.completed(message, True, '/node')) == [A, B]


def test_what_has_moved_is_left_plain_on_request():
    last = LastProvenance(of_moved=False)
    last.completed(received(Point(X, X * Y, 5.0)), False, '/node')
    found = last.completed(Point(2.0, 6.5, 5.0), True, '/node')
    assert sources(found.x) == [A]
    assert (found.y, is_tracked(found.y)) == (6.5, False)


def test_nothing_is_told_of_other_things_other_publishers_and_other_sizes():
    last = LastProvenance()
    whole = received(MarkerArray([Marker(id=1, pose=Pose(position=Point(X, 0, 0)))]))
    last.completed(whole, False, '/node')
    same = untracked(whole)
    longer = MarkerArray([*same.markers, Marker()])
    others = (MarkerArray([Marker(id=2)]), '/node'), (same, '/other'), (longer, '/node')
    for message, publisher in others:
        assert last.completed(message, True, publisher) == message
        assert not is_tracked(last.completed(message, True, publisher))
    assert is_tracked(last.completed(same, True, '/node'))


def test_nothing_is_told_of_another_thing_further_on_in_a_message():
    def transforms(*frames):
        message = TFMessage([TransformStamped(child_frame_id=frame) for frame in frames])
        message.transforms[1].transform.translation.x = 2.0
        return message

    whole = transforms('hand', 'camera')
    whole.transforms[1].transform.translation.x = X
    last = LastProvenance()
    last.completed(whole, False, '/node')
    assert sources(last.completed(transforms('hand', 'camera'), True, '/node')) == [A]
    assert not is_tracked(last.completed(transforms('hand', 'laser'), True, '/node'))


def test_texts_keep_their_sources_as_long_as_they_are_the_same():
    last = LastProvenance()
    last.completed(received(String(track('a', A))), False, '/node')
    assert sources(last.completed(String('a'), True, '/node')) == [A]
    assert not is_tracked(last.completed(String('b'), True, '/node'))


def test_what_moves_and_is_curved_keeps_its_sources():
    last = LastProvenance()
    last.completed(received(Point(math.sin(X), 0, 0)), False, '/node')
    moved = last.completed(Point(0.95, 0, 0), True, '/node').x
    assert moved == 0.95
    assert sources(moved) == [A]
    assert evaluate(moved, {A: 2.5}) == pytest.approx(0.95 + math.sin(2.5) - math.sin(2.0))
