"""A node that computes so much that not all of it can be recorded still sends what is tracked, and follows changes."""

import threading

import pytest
import rospy
from nav_msgs.msg import Path
from std_msgs.msg import Bool

import rosslt
from rosslt import node, values
from rosslt.instrument import sampling
from support.processes import wait_until
from support.unmodified import Unmodified

HEAVY = """
import math
import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from std_msgs.msg import Bool
from rosslt import values
from rosslt.instrument import sampling

sampling.HEAVY = sampling.WORTH = sampling.RATIO = 0.001  # this node takes too much on any machine

rospy.init_node('heavy')
pub = rospy.Publisher('heavy_path', Path, queue_size=1)
paused = rospy.Publisher('heavy_paused', Bool, queue_size=1)
radius = 2.0
height = 1.5
turn = 0.0


class Kept:
    def __init__(self):
        self.lift = 3.0


kept = Kept()
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    path = Path()
    for k in range(60):
        angle = k / 10.0
        for _ in range(30):
            x = radius * math.cos(angle + turn) + height
        pose = PoseStamped()
        pose.pose.position.x = x
        pose.pose.position.y = radius * math.sin(angle) + 0.25
        pose.pose.position.z = kept.lift * height
        pose.pose.orientation.w = 1.0
        path.poses.append(pose)
    pub.publish(path)
    paused.publish(values.RECORDING.is_paused)
    turn += 0.01
    rate.sleep()
"""

#: Turns to another source of the same field when it is told to.
TURNING = (
    HEAVY.replace('heavy', 'turning')
    .replace(
        'rate = rospy.Rate(20)',
        """low = 3.0
high = 5.0
is_high = False
def turn_over(message):
    global is_high
    is_high = message.data
rospy.Subscriber('turn_over', Bool, turn_over)
rate = rospy.Rate(20)""",
    )
    .replace('kept.lift * height', '(high if is_high else low) * 1.0')
)


def test_a_force_while_other_sources_are_told_reaches_the_field_and_changes_nothing_else(master, tmp_path):
    paused, paths = [], []
    rospy.Subscriber('turning_paused', Bool, lambda message: paused.append(message.data))
    rosslt.Subscriber('turning_path', Path, paths.append)
    turn_over = rospy.Publisher('turn_over', Bool, queue_size=1)
    with Unmodified(tmp_path, 'turning', TURNING):
        wait_until(lambda: True in paused and turn_over.get_num_connections(), 'not all is recorded', 60)
        wait_until(lambda: values.is_tracked(paths[-1].poses[3].pose.position.z), 'a path with sources', 60)
        turn_over.publish(True)
        wait_until(lambda: paths[-1].poses[3].pose.position.z == 5.0, 'it has turned to the other', 60)
        node.force_field('/turning_path', 'poses[3].pose.position.z', 9.0, timeout=30)
        wait_until(lambda: paths[-1].poses[3].pose.position.z == 9.0, 'the field is there', 60)
        now = {place.local_name: place.value for place in node.Directory().ask(['/turning'])[0]['/turning']}
        assert (now['low'], now['high']) == (3.0, 9.0)


def test_a_node_that_computes_much_stays_tracked_and_follows(master, tmp_path):
    paused, paths, came = [], [], threading.Event()
    rospy.Subscriber('heavy_paused', Bool, lambda message: paused.append(message.data))
    rosslt.Subscriber('heavy_path', Path, lambda message: (paths.append(message), came.set()))

    def next_path():
        paths.clear()
        wait_until(lambda: paths, 'a path', 60)
        return paths[0]

    with Unmodified(tmp_path, 'heavy', HEAVY):
        wait_until(lambda: True in paused, 'not all is recorded', 60)
        for _ in range(20):
            leaves = [
                value
                for path, value in values.leaves(next_path())
                if path.startswith('poses') and 'pose.position' in path
            ]
            assert sum(map(values.is_tracked, leaves)) >= 0.95 * len(leaves)
        still = next_path().poses[7].pose.position
        assert node.force_value(still.y, 4.0, timeout=30)
        wait_until(lambda: next_path().poses[7].pose.position.y == pytest.approx(4.0), 'the new path', 30)
        position = next_path().poses[3].pose.position
        assert node.force_value(position.z, 6.0, timeout=30)
        wait_until(lambda: next_path().poses[3].pose.position.z == pytest.approx(6.0), 'the new height', 30)
        # What was kept before the change never comes back.
        places = {place.local_name: place for place in node.Directory().ask(['/heavy'])[0]['/heavy']}
        wanted = 7.0 * float(places['height'].value)
        source = rosslt.Source('/heavy', places['lift'].location.id)
        node.force_value(rosslt.track(float(places['lift'].value), source), 7.0, timeout=30)
        wait_until(lambda: next_path().poses[3].pose.position.z == pytest.approx(wanted), 'the new lift', 30)
        for _ in range(100):
            assert next_path().poses[3].pose.position.z == pytest.approx(wanted)


def test_who_subscribes_to_a_node_that_nobody_listened_to_gets_sources_with_the_first_message(master, tmp_path):
    paused, paths = [], []
    rospy.Subscriber('lonely_paused', Bool, lambda message: paused.append(message.data))
    with Unmodified(tmp_path, 'lonely', HEAVY.replace('heavy', 'lonely')):
        wait_until(lambda: True in paused, 'not all is recorded', 60)
        rosslt.Subscriber('lonely_path', Path, paths.append)
        wait_until(lambda: paths, 'a path', 60)
        position = paths[0].poses[7].pose.position
        assert values.is_tracked(position.y)
        assert values.is_tracked(position.x)


class _Publisher:
    recorded_since = 0


class _Clock:
    """A process whose time goes as it is told to."""

    def __init__(self, monkeypatch):
        self.now = self.cpu = 100.0
        monkeypatch.setattr(sampling.time, 'monotonic', lambda: self.now)
        monkeypatch.setattr(sampling.time, 'process_time', lambda: self.cpu)

    def run(self, decides, publishers, rounds, plain, recorded, seconds=0.05):
        """Rounds in which each takes so much CPU time; returns how many of them were recorded."""
        count = 0
        for _ in range(rounds):
            is_recorded = not values.RECORDING.is_paused
            count += is_recorded
            self.now += seconds
            self.cpu += recorded if is_recorded else plain
            for publisher in publishers:
                decides.published(publisher)
        return count


@pytest.fixture
def clock(monkeypatch):
    yield _Clock(monkeypatch)
    values.resume_recording()


def test_a_node_that_costs_little_is_recorded_always(clock):
    decides = sampling.Sampling()
    assert clock.run(decides, [_Publisher()], 400, 0.0005, 0.002) == 400
    assert not decides.is_on


def test_a_node_of_which_recording_is_a_small_part_is_left_alone(clock):
    decides = sampling.Sampling()
    assert clock.run(decides, [_Publisher()], 390, 0.020, 0.021) > 350
    assert not decides.is_on


def test_a_node_that_recording_makes_expensive_is_recorded_in_some_rounds(clock):
    decides, publishers = sampling.Sampling(), [_Publisher(), _Publisher()]
    clock.run(decides, publishers, 100, 0.001, 0.010)
    assert decides.is_on
    before = clock.cpu
    recorded = clock.run(decides, publishers, 2000, 0.001, 0.010)
    assert 20 < recorded < 500
    assert clock.cpu - before < 2000 * 0.0035


def test_a_node_of_which_a_round_takes_long_is_recorded_in_few_of_them(clock):
    decides, publishers = sampling.Sampling(), [_Publisher(), _Publisher()]
    clock.run(decides, publishers, 20, 0.004, 0.080, seconds=0.5)
    before = clock.cpu
    recorded = clock.run(decides, publishers, 200, 0.004, 0.080, seconds=0.5)
    assert 10 < recorded < 60
    assert clock.cpu - before < 200 * 0.5 * (0.008 + 0.05)


def test_a_node_that_publishes_rarely_is_recorded_as_a_whole_for_one_round_only(clock):
    decides, publishers = sampling.Sampling(), [_Publisher()]
    # What it takes before its first message says nothing.
    assert clock.run(decides, publishers, 1, 0.5, 0.5, seconds=1.0) == 1
    assert clock.run(decides, publishers, 1, 0.01, 0.3, seconds=1.0) == 1
    assert decides.is_on
    assert clock.run(decides, publishers, 12, 0.01, 0.3, seconds=1.0) == 1


def test_pauses_stay_short_where_a_publisher_sends_several_things_in_turn(clock):
    decides, publishers = sampling.Sampling(), [_Publisher()]
    decides.takes_turns = True
    clock.run(decides, publishers, 20, 0.004, 0.080, seconds=0.5)
    assert clock.run(decides, publishers, 200, 0.004, 0.080, seconds=0.5) > 70


def test_each_publisher_gets_rounds_of_its_own(clock):
    decides, publishers = sampling.Sampling(), [_Publisher() for _ in range(3)]
    clock.run(decides, publishers, 100, 0.001, 0.010)
    seen = set()
    for _ in range(300):
        clock.run(decides, publishers, 1, 0.001, 0.010)
        seen |= {index for index, publisher in enumerate(publishers) if decides.is_recorded(publisher)}
    assert seen == {0, 1, 2}


def test_all_is_recorded_after_a_change(clock):
    decides, publishers = sampling.Sampling(), [_Publisher()]
    clock.run(decides, publishers, 100, 0.001, 0.010)
    wait = 0
    while not values.RECORDING.is_paused:
        clock.run(decides, publishers, 1, 0.001, 0.010)
        wait += 1
        assert wait < 100
    decides.changed()
    assert clock.run(decides, publishers, 2000, 0.001, 0.010) == 2000
