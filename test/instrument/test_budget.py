"""Recording stops if it takes more than its share, and begins again with a later round."""

import sys
from collections import Counter

import pytest
from geometry_msgs.msg import Point
from nav_msgs.srv import GetPlan
from std_msgs.msg import Float64

import rosslt
from rosslt import values
from rosslt.instrument.budget import MOST, MOST_AT_FIRST, MOST_OF_ROUND, OF_CORE, OF_NODE, Budget
from rosslt.values import OPERATION
from support import shell
from support.processes import wait_until
from support.unmodified import Listener, Unmodified

HEAVY = """
import math
import rospy
from std_msgs.msg import Float64
rospy.init_node('heavy')
pub = rospy.Publisher('heavy', Float64, queue_size=1)
gain = 0.5
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    total = gain
    for n in range(40000):
        total = total * 0.999 + gain * 0.001
    pub.publish(total)
    rate.sleep()
"""

LATCHED = HEAVY.replace("'heavy'", "'latched'").replace('queue_size=1', 'queue_size=1, latch=True')
LATCHED = LATCHED.replace('40000', '600000')


FAST_AND_SLOW = """
import threading
import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import Float64
rospy.init_node('several')
both = rospy.Publisher('both', Point, queue_size=1)
once = rospy.Publisher('once', Float64, queue_size=1)
fast = rospy.Publisher('fast', Float64, queue_size=1)
first, second = 0.5, 0.25
def slow():
    while not rospy.is_shutdown():
        total = first * 1.5
        for n in range(200000):
            total = total * 0.99999 + second * 0.00001
        both.publish(total, 0.0, 1.0)
        rospy.sleep(0.05)
threading.Thread(target=slow, daemon=True).start()
once.publish(first)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    fast.publish(first * 2)
    both.publish(first * 0.5, 0.0, 2.0)
    rate.sleep()
"""

SERVICE = """
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
rospy.init_node('planner')
first, second = 0.5, 0.25
def plan(request):
    total = first * 1.5
    for n in range(400000):
        total = total * 0.999 + second * 0.001
    pose = PoseStamped()
    pose.pose.position.x = total
    return Path(poses=[pose])
rospy.Service('plan', GetPlan, plan)
rospy.spin()
"""


class Machine:
    """A processor that takes some seconds for an operation of the program, and more for recording it."""

    def __init__(self, own):
        self.now, self.idle, self._own = 0.0, 0.0, own
        self._x = rosslt.track(1.0, rosslt.Source('/node', 1))

    def clock(self):
        return self.now

    def wall_clock(self):
        return self.now + self.idle

    def compute(self, seconds):
        """Compute for so many seconds of the program's own; returns the share of operations that were recorded."""
        count = round(seconds / self._own / 1000)
        recorded = 0
        for _ in range(count):
            is_recorded = values.spend(1000)
            recorded += is_recorded
            self.now += 1000 * (self._own + (OPERATION if is_recorded else 0.0))
        return recorded / count


@pytest.fixture
def started():
    def start(machine):
        budget = Budget(machine.clock, machine.wall_clock)
        budget.begin()
        return budget

    yield start
    values.limit_recording(lambda overdrawn: sys.maxsize)


def test_what_takes_three_times_its_recording_is_always_recorded(started):
    machine = Machine(own=3.1 * OPERATION)
    budget = started(machine)
    assert machine.compute(10.0) == 1.0
    assert (budget.stops, budget.spent) == (0, pytest.approx(10.0 / 3.1, rel=0.01))


def test_recording_that_takes_longer_stops_soon_and_for_good(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    machine.compute(10.0)
    assert budget.stops == 1
    assert MOST_AT_FIRST < budget.spent < 1.1 * MOST_AT_FIRST


def test_recording_begins_again_once_its_debt_is_paid(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    shares = []
    for _ in range(400):
        shares.append(machine.compute(0.05))
        budget.begin_round('a publisher')
    assert {0.0, 1.0} <= set(shares)
    assert budget.stops > 10
    assert 0.8 < budget.spent / (OF_NODE * 20.0) < 1.1


def test_short_rounds_are_recorded_in_turns_of_a_tenth_of_a_second(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    spent = [0.0]
    for _ in range(4000):
        machine.compute(0.002)
        stops = budget.stops
        budget.begin_round('a publisher')
        if budget.stops % 2 and not stops % 2:
            spent.append(budget.spent)
    assert len(spent) > 20
    for before, after in zip(spent, spent[1:]):
        assert MOST < after - before < 1.2 * MOST


def test_each_publisher_of_a_heavy_loop_has_whole_rounds(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    stops, whole = dict.fromkeys('abc', 0), Counter()
    for _ in range(400):
        for publisher in 'abc':
            machine.compute(0.02)  # 0.08 s of recording
            whole[publisher] += stops[publisher] == budget.stops and not budget.stops % 2
            budget.begin_round(publisher)
            stops[publisher] = budget.stops
    assert min(whole.values()) > 10
    assert budget.spent < 0.5 * machine.now


def turns_of(budget, machine, messages):
    """Send messages, each (publisher, seconds to compute); returns how many of each publisher's are whole."""
    stops, whole = {}, Counter()
    for publisher, seconds in messages:
        machine.compute(seconds)
        whole[publisher] += budget.is_recorded(stops.get(publisher, 0))
        budget.begin_round(publisher)
        stops[publisher] = budget.stops
    return whole


def test_a_slow_publisher_beside_a_fast_one_has_whole_rounds(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    messages = [*[('fast', 0.015)] * 10, ('slow', 0.001)] * 100  # 0.6 s of recording for a slow round
    whole = turns_of(budget, machine, messages)
    assert whole['slow'] > 3
    assert whole['fast'] >= 10 * whole['slow']
    assert budget.spent < 0.5 * machine.now


def test_one_that_sends_once_keeps_no_other_from_its_turns(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    turns_of(budget, machine, [('often', 0.01)] * 1000)
    while not budget.stops % 2:
        turns_of(budget, machine, [('often', 0.01)])
    machine.compute(10.0)
    turns_of(budget, machine, [('once', 0.01)])
    assert not budget.stops % 2  # it has begun the turn
    stops = budget.stops
    whole = turns_of(budget, machine, [('often', 0.01)] * 2000)
    assert budget.stops > stops + 20
    assert whole['often'] > 100


def test_one_that_is_always_cut_off_is_given_up_for_a_while(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    messages = [*[('often', 0.02)] * 100, ('rare', 0.001)] * 20  # 8 s of recording for a rare round
    whole = turns_of(budget, machine, messages)
    assert whole['rare'] == 0
    assert whole['often'] > 100
    assert budget.stops > 30


def test_threads_that_stop_and_refill_at_once_leave_no_wrong_state(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    turns_of(budget, machine, [('a', 0.01)] * 10)
    budget.stops += budget.stops % 2
    values.allow(0)  # as if another thread had begun again before a refill of none has come
    stops = budget.stops
    assert not budget.is_recorded(stops)
    turns_of(budget, machine, [('a', 0.1)] * 20)
    assert budget.is_recorded(budget.stops) == (budget.stops % 2 == 0)
    assert not budget.is_recorded(stops)
    while budget.stops % 2:
        turns_of(budget, machine, [('a', 0.1)])
    budget.stops += 1
    stops = budget.stops
    assert not budget.is_recorded(stops)
    turns_of(budget, machine, [('a', 0.001)])
    assert budget.is_recorded(budget.stops)
    assert budget.stops > stops


def test_a_node_that_mostly_waits_has_a_share_of_a_core_for_recording(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    for _ in range(400):
        machine.compute(0.005)
        budget.begin_round('a publisher')
        machine.idle += 0.09
    assert budget.spent > OF_NODE * 2.0
    assert 0.8 < budget.spent / (OF_CORE * machine.wall_clock()) < 1.1


def test_who_asks_gets_an_answer_whatever_is_owed(started):
    machine = Machine(own=0.05 * OPERATION)
    budget = started(machine)
    machine.compute(0.1)
    assert budget.stops == 1
    for _ in range(3):
        budget.ask('a publisher')
        budget.begin_round('a publisher')
        assert machine.compute(0.04) == 1.0  # 0.8 s of recording
        budget.answer('a publisher')
        assert machine.compute(0.04) < 1.0
        budget.begin_round('a publisher')
        assert machine.compute(0.04) == 0.0
    budget.ask('a publisher that sends nothing')
    budget.begin_round('a publisher')
    assert 0.0 < machine.compute(0.5) < 1.0


def test_what_takes_long_at_once_is_no_time_of_the_program(started):
    machine = Machine(own=0.25 * OPERATION)
    budget = started(machine)
    values.spend(1)
    machine.now += 2 * MOST_OF_ROUND
    values.spend(round(2 * MOST_OF_ROUND / OPERATION))
    assert budget.stops == 1


def test_a_heavy_node_sends_whole_and_sampled_messages(master, tmp_path):
    with Unmodified(tmp_path, 'heavy', HEAVY.lstrip()), Listener('heavy', Float64) as heard:
        message = heard.comes(lambda message: values.is_tracked(message.data))
        every = []
        subscriber = rosslt.Subscriber('heavy', Float64, every.append)
        wait_until(lambda: len(set(map(is_known, every))) == 2, 'whole messages and others')
        subscriber.unregister()
        assert all(map(values.is_tracked, every))
        gain = values.sources(message.data)[0]
        assert rosslt.force_value(message.data, 0.75, source=gain, timeout=20.0)[gain].new == pytest.approx(0.75)
        heard.comes(lambda message: abs(message.data - 0.75) < 1e-6)


def test_a_latched_message_that_was_not_recorded_as_a_whole_is_none(master, tmp_path):
    with Unmodified(tmp_path, 'latched', LATCHED.lstrip()):
        every = []
        subscriber = rosslt.Subscriber('latched', Float64, every.append)
        wait_until(lambda: len(set(map(is_known, every))) == 2, 'whole messages and others')
        subscriber.unregister()
        assert all(map(values.is_tracked, every))


def test_threads_of_one_publisher_have_rounds_of_their_own(master, tmp_path):
    every = []
    with Unmodified(tmp_path, 'several', FAST_AND_SLOW.lstrip()):
        fast = rosslt.Subscriber('fast', Float64, lambda _: None)
        subscriber = rosslt.Subscriber('both', Point, every.append)
        wait_until(lambda: len(list(filter(is_whole, every))) >= 5, 'whole messages of the slow thread', 60)
        subscriber.unregister()
        fast.unregister()
    for message in filter(is_whole, every):
        assert len(values.sources(message.x)) == 5


def test_a_response_that_was_not_recorded_as_a_whole_is_sampled(master, tmp_path):
    with Unmodified(tmp_path, 'planner', SERVICE.lstrip()):
        ask = rosslt.ServiceProxy('/plan', GetPlan)
        ask.wait_for_service(60)
        found = [values.sources(ask().plan.poses[0].pose.position.x) for _ in range(12)]
    whole = [one for one in found if values.UNKNOWN not in one]
    assert set(map(len, whole)) == {5}
    assert 0 < len(whole) < len(found)


def is_whole(message):
    """Whether a message of the slow thread has provenance."""
    return message.z == 1.0 and values.is_tracked(message.x) and values.UNKNOWN not in values.sources(message.x)


@pytest.mark.parametrize('size', [20000, 200000])
def test_a_heavy_topic_is_asked_for_by_each_command(master, tmp_path, size):
    """A round takes a tenth of a second to record, and half a one."""
    code = HEAVY.replace('heavy', 'asked').replace('40000', str(size)).lstrip()
    with Unmodified(tmp_path, 'asked', code), Listener('asked', Float64):
        for _ in range(2):
            assert 'gain' in command('echo', '-n', '1', '/asked')
            assert 'gain' in command('explain', '/asked/data')
        assert 'gain' in command('force', '/asked/data', '0.75')


def command(*arguments):
    found = shell.rosslt(*arguments)
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


def is_known(message):
    return values.UNKNOWN not in values.sources(message.data)
