"""Bags of messages that refer to earlier ones, cut in two: the provenance of what a recording begins with is found."""

import io

import genpy
import pytest
import rosbag
from geometry_msgs.msg import Point, Pose
from std_msgs.msg import Float64, String

from rosslt import Source, is_tracked, track
from rosslt.cli import bags
from rosslt.messages import Announcer, append_provenance, decode
from rosslt.messages.codec import OUTLINES
from rosslt.messages.codec.outlines import Outlines
from support.filling import serialized
from support.shell import lines, rosslt

NO_MASTER = {'ROS_MASTER_URI': 'http://localhost:1'}
RATE = 30


def pose(step, speed=0.25, node='/planner'):
    speed = track(speed, Source(node, 1))
    return Pose(position=Point(speed * (0.1 * step), speed + 1, 2.0))


class Recorder:
    """Writes a bag of what one publisher sends at 30 Hz, as `rosbag record` would."""

    def __init__(self, topic, message_class):
        self.topic = topic
        self.now = 0.0
        self.announcer = Announcer(message_class, lambda: self, lambda: self.now)

    def data(self, message):
        self.now += 1 / RATE
        buff = io.BytesIO()
        message.serialize(buff)
        append_provenance(message, buff, announcer=self.announcer)
        return buff.getvalue()


def written(path, messages, skipped, topic='/pose'):
    """A bag without the first messages; how many of the others are full."""
    recorder, full = Recorder(topic, type(messages[0])), 0
    with rosbag.Bag(str(path), 'w') as bag:
        for step, message in enumerate(messages):
            data = recorder.data(message)
            if step >= skipped:
                full += data.endswith(b'rSLT')
                raw = message._type, data, message._md5sum, None, type(message)
                bag.write(topic, raw, genpy.Time.from_sec(100 + recorder.now), raw=True)
    return full


@pytest.fixture
def cut(tmp_path):
    """The second part of a bag that was cut in two: 88 messages, most of them references, as the first ones are."""
    path = tmp_path / 'cut.bag'
    full = written(path, [pose(step) for step in range(90)], skipped=2)
    assert 3 <= full <= 15
    return str(path)


@pytest.fixture
def _fresh(monkeypatch):
    """This process has received nothing yet."""
    for name, value in vars(Outlines()).items():
        monkeypatch.setattr(OUTLINES, name, value)


def test_all_messages_of_a_bag_that_begins_with_references_have_their_provenance(cut):
    result = rosslt('bag', cut, **NO_MASTER)
    assert result.stderr == ''
    held = [line.split('\t') for line in result.stdout.splitlines()]
    assert held == [['/pose', 'geometry_msgs/Pose', '88', '88', '/planner#1', 'position.x,position.y']]


def test_echo_prints_the_sources_from_the_first_message_on(cut):
    result = rosslt('echo', '--bag', cut, '-n', '3', '/pose/position/x', **NO_MASTER)
    assert result.stderr == ''
    printed = [line for line in result.stdout.splitlines() if line.startswith('position.x')]
    assert len(printed) == 3
    assert all('[/planner#1]' in line for line in printed)


def test_what_if_changes_every_message_and_writes_provenance_in_full(cut, tmp_path):
    out = str(tmp_path / 'other.bag')
    assert lines('bag', cut, '--set', '/planner#1=0.5', '-o', out) == [['/pose', '88', '88']]
    with rosbag.Bag(out) as bag:
        for step, (_, raw, _) in enumerate(bag.read_messages(raw=True), 2):
            message, error = decode(raw[1], raw[-1])
            assert error is None
            assert is_tracked(message.position.x)
            assert serialized(message) == serialized(pose(step, 0.5))


@pytest.mark.usefixtures('_fresh')
def test_what_is_never_in_full_stays_plain(tmp_path):
    path = tmp_path / 'never.bag'
    assert written(path, [pose(0)] * 8, skipped=2) <= 1
    with rosbag.Bag(str(path)) as bag:
        fulls = [raw[1].endswith(b'rSLT') for _, raw, _ in bag.read_messages(raw=True)]
        found = [received.message for received in bags.messages(bag)]
    expected = any(fulls)
    assert [is_tracked(message.position.x) for message in found] == [expected] * 6
    assert [serialized(message) for message in found] == [serialized(pose(0))] * 6


@pytest.mark.usefixtures('_fresh')
def test_several_topics_and_outlines_in_turn_are_found_ahead(tmp_path):
    path = tmp_path / 'turns.bag'
    messages = [pose(step, node='/one' if step % 2 else '/two') for step in range(120)]
    written(path, messages, skipped=5)
    with rosbag.Bag(str(path)) as bag:
        found = [received.message for received in bags.messages(bag)]
    assert [serialized(one) for one in found] == [serialized(one) for one in messages[5:]]
    assert all(is_tracked(message.position.y) for message in found)


@pytest.mark.usefixtures('_fresh')
def test_a_provenance_that_is_wrong_is_still_reported(tmp_path, capsys):
    with rosbag.Bag(str(tmp_path / 'bad.bag'), 'w') as bag:
        buff = io.BytesIO()
        Float64(1.0).serialize(buff)
        data = buff.getvalue() + b'xyz' + (3).to_bytes(4, 'little') + b'rSLR'
        bag.write('/x', (Float64._type, data, Float64._md5sum, None, Float64), genpy.Time(1), raw=True)
    with rosbag.Bag(str(tmp_path / 'bad.bag')) as bag:
        assert [received.message.data for received in bags.messages(bag)] == [1.0]
    assert 'a reference of 3 bytes' in capsys.readouterr().err


def test_what_if_leaves_what_it_cannot_resolve_as_it_was_and_says_so(tmp_path):
    path, out = tmp_path / 'lost.bag', str(tmp_path / 'out.bag')
    recorder = Recorder('/words', String)
    with rosbag.Bag(str(path), 'w') as bag:
        lost = [recorder.data(String(track('lost', Source('/lost_node', 1)))) for _ in range(3)]
        kept = recorder.data(String(track('kept', Source('/planner', 1))))
        assert lost[-1].endswith(b'rSLR')
        latin = lost[-1].replace(b'lost', b'l\xf6st')  # as a node in C++ may send it
        for second, data in enumerate([latin, kept], 1):
            bag.write('/words', (String._type, data, String._md5sum, None, String), genpy.Time(second), raw=True)
    result = rosslt('bag', str(path), '--set', '/planner#1=new', '-o', out, **NO_MASTER)
    assert result.stdout == '/words\t2\t1\n'
    assert '1 messages on /words stay as they were recorded: they refer to a provenance that' in result.stderr
    with rosbag.Bag(out) as bag:
        found = [raw[1] for _, raw, _ in bag.read_messages(raw=True)]
    assert found[0] == latin
    assert decode(found[1], String).message.data == 'new'
