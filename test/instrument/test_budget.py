"""Recording stops if it takes more than its share, and begins again with a later round."""

import sys
from collections import Counter

import pytest
from std_msgs.msg import Float64

import rosslt
from rosslt import values
from rosslt.instrument.budget import MOST, MOST_OF_ROUND, OF_CORE, OF_NODE, Budget
from rosslt.values import OPERATION
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
    assert MOST_OF_ROUND < budget.spent < 1.1 * MOST_OF_ROUND


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


def is_known(message):
    return values.UNKNOWN not in values.sources(message.data)
