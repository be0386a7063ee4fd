"""Messages of nodes that nobody tracks, by what was learned of the nodes: when they wait, and when they are plain."""

import os
import random
import subprocess
import sys
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import PointStamped

from rosslt import node, values
from rosslt.markers.scene import learned
from rosslt.markers.scene.learned import Stream
from rosslt.messages import thing_of
from rosslt.models import Answer, Dependency, Following, Learned, Number

SOURCE = values.Source('/talker', 1)

#: Prints which of the rooms and packages that nobody needs are loaded, and what is subscribed to.
NOTHING_LEARNED = """
import sys
from rosslt import markers
from rosslt.markers.scene.learned import LearnedNodes
nodes = LearnedNodes(None, None)
nodes.follow({'/out'}, {'/out': ['/opaque']}, {'/in': ['/opaque']}, {'/in': 'std_msgs/Float64'})
print(nodes._reader.topics(), [name for name in ('rosslt.models', 'scipy') if name in sys.modules])
"""


def point(x, stamp):
    message = PointStamped()
    message._connection_header = {'callerid': '/opaque'}
    message.header.frame_id, message.header.stamp.secs, message.point.x = 'map', stamp, x
    return message


@pytest.fixture
def clock(monkeypatch):
    """The time that passes for streams: [seconds]."""
    now = [100.0]
    monkeypatch.setattr(learned, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    return now


class Learnt:
    """A node whose output is 2 * input, with a stream of it; what is shown is noted."""

    def __init__(self, clock):
        number = Number('/in', thing_of(point(0.0, 1)), 'point.x')
        dependency = Dependency(0, 0, 'smooth', 2.0, 0.0, 2.0, 2.0, -0.1, 0.1)
        found = Learned([dependency], (0.0,), (), (), (), 0.05, 10)
        answer = Answer([number], [number._replace(topic='/out')], [0.5], 0.01, 0.1, found, True, ())
        self.following = Following([answer], '/out', number.thing, '', ['point.x'])
        self._clock, self._shown = clock, []
        self.stream = Stream(self.following, '/opaque', 0.0, self._show)

    def _show(self, heard, message, basis):
        assert message._connection_header == {'callerid': '/opaque'}
        self._shown.append((message, basis))

    def hear(self, x, stamp=0, after=0.0):
        self._clock[0] += after
        self.following.hear('/in', '/talker', point(values.track(x, SOURCE), stamp), self._clock[0])
        self.stream.go_on()
        return self.shown()

    def send(self, x, stamp=0, after=0.0):
        self._clock[0] += after
        self.stream.take(node.Heard('/out', '/opaque', PointStamped._type, point(x, stamp)))
        return self.shown()

    def shown(self):
        """(x, whether it has provenance) of each message shown since the last call."""
        found = [(message.point.x, values.is_tracked(message.point.x)) for message, _ in self._shown]
        assert [is_tracked for _, is_tracked in found] == [basis is not None for _, basis in self._shown]
        self._shown.clear()
        return found

    def is_settled(self, x, stamp=0, after=0.0):
        """Whether a message tells what its inputs do."""
        self._clock[0] += after
        self.stream.take(node.Heard('/out', '/opaque', PointStamped._type, point(x, stamp)))
        _, basis = self._shown.pop()
        return basis.is_settled


def test_a_message_that_comes_before_its_input_has_its_provenance(clock):
    found = Learnt(clock)
    assert found.send(1.0, stamp=1) == [(1.0, False)], 'plain, at once'
    assert found.hear(0.5, stamp=1) == [(1.0, True)]
    assert found.send(1.0, stamp=2, after=0.02) == [], 'what has a handle keeps it'
    assert found.hear(0.5, stamp=2) == [(1.0, True)]


def test_a_message_whose_input_is_never_heard_takes_the_one_before(clock):
    found = Learnt(clock)
    found.hear(0.5, stamp=1)
    assert found.send(1.0, stamp=1) == [(1.0, True)]
    assert found.send(1.2, stamp=2, after=0.2) == []
    clock[0] += 0.11
    found.stream.go_on()
    assert found.shown() == [(1.2, True)]


def test_a_message_without_inputs_is_plain_at_once(clock):
    found = Learnt(clock)
    assert found.send(1.0) == [(1.0, False)]
    found.hear(0.5)
    assert found.send(1.0, after=0.05) == [(1.0, False)], 'it cannot follow the input yet'
    assert found.send(1.0, after=0.05) == [(1.0, True)]


def test_of_two_senders_without_a_stamp_nothing_is_known(clock, monkeypatch):
    told = []
    monkeypatch.setattr(learned.rospy, 'logwarn_throttle_identical', lambda _, text: told.append(text))
    found = Learnt(clock)
    found.hear(0.5)
    found.following.hear('/in', '/other', point(0.5, 0), clock[0])
    assert found.send(1.0, after=0.2) == [(1.0, False)]
    (text,) = told
    assert text.startswith('/out stays without what was learned of /opaque: /talker and /other send /in, and no stamp')


def test_a_message_on_the_way_to_another_value_tells_nothing(clock):
    found = Learnt(clock)
    found.hear(0.5)
    found.send(1.0, after=0.2)
    assert found.is_settled(1.0, after=0.02)
    found.hear(0.52)
    assert not found.is_settled(1.02, after=0.05)
    assert not found.is_settled(1.04, after=0.06), 'the first with another input: which was heard first is chance'
    assert found.is_settled(1.04, after=0.02)


def test_stamps_tell_at_once_if_the_inputs_stay(clock):
    found = Learnt(clock)
    found.hear(0.5, stamp=1)
    assert found.is_settled(1.0, stamp=1)
    found.hear(0.52, stamp=2, after=0.02)
    assert not found.is_settled(1.04, stamp=2), 'a filter may still follow the input before'
    found.hear(0.52, stamp=3, after=0.2)
    assert found.is_settled(1.04, stamp=3)


@pytest.mark.parametrize('is_stamped', [True, False])
def test_no_random_message_is_plain_after_a_tracked_one(clock, is_stamped):
    """Inputs and outputs come in any order, and some inputs are not heard at all."""
    chance = random.Random(1)
    for _ in range(100):
        found = Learnt(clock)
        shown = found.hear(0.5, 0, chance.uniform(0.0, 0.2))
        for number in range(1, 30):
            stamp = number if is_stamped else 0
            after = chance.uniform(0.0, 0.05)
            shown += found.send(float(number), stamp, after) if chance.random() < 0.5 else []
            shown += found.hear(0.5, stamp, after) if chance.random() < 0.9 else []
            shown += found.send(number + 0.5, stamp, after) if chance.random() < 0.5 else []
        clock[0] += 1.0
        found.stream.go_on()
        shown += found.shown()
        tracked = [x for x, is_tracked in shown if is_tracked]
        first = [is_tracked for _, is_tracked in shown].index(True)
        assert len(tracked) > 5
        assert tracked == sorted(tracked)
        assert all(is_tracked for _, is_tracked in shown[first:])


def test_nothing_is_loaded_if_nothing_was_learned(tmp_path):
    printed = subprocess.run(
        [sys.executable, '-c', NOTHING_LEARNED],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env={**os.environ, 'ROS_HOME': str(tmp_path)},
    ).stdout
    assert printed == 'set() []\n'
