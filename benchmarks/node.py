#!/usr/bin/env python3
"""What tracking costs a rospy node, against plain rospy in the same run.

A message's time is what publishing and receiving it takes together: publisher and subscriber are in one process,
so that neither can hide behind the other. One at a time: each message is received before the next is published, as
at the rates that robots use. In a flood: published as fast as possible, which spares rospy most of its system calls.
For messages, the threads share one core and take turns only when one has to wait. Left to themselves on several cores,
plain rospy takes 18 to 50 us from run to run, and steps up as soon as reading takes one more microsecond, whatever it
is spent on: what waking each other costs, not what a message does.
A location is read in a loop, without the loop itself.
The round trip is a person's: a value of a talker at 50 Hz, in a process of its own, is forced, and shows in a message.
"""

import itertools
import math
import os
import statistics
import subprocess
import sys
import threading
import time
import warnings

import rospy
from geometry_msgs.msg import Point, Pose
from std_msgs.msg import Float64

import rosslt

MESSAGES = 2000
ROUNDS = 7
ROUND_TRIPS = 100
READINGS = 20000

TALKER = """
import rospy, rosslt
from std_msgs.msg import Float64
rosslt.init_node('bench_talker')
publisher = rosslt.Publisher('bench_value', Float64, queue_size=1)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    publisher.publish(2 * rosslt.location(1.0, name='half'))
    rate.sleep()
"""


class Channel:
    """A publisher and a subscriber of one topic."""

    def __init__(self, name, module):
        self._missing = 0
        self._all = threading.Event()
        self._subscriber = module.Subscriber(name, Pose, self._receive)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # without a queue nothing is dropped, which is what is wanted here
            self._publisher = module.Publisher(name, Pose)
        while not self._publisher.get_num_connections():
            time.sleep(0.01)

    def _receive(self, _pose):
        self._missing -= 1
        if not self._missing:
            self._all.set()

    def seconds(self, make, at_once):
        """Seconds that a message takes to make, publish and receive, where so many are published at once."""
        start = time.perf_counter()
        for _ in range(MESSAGES // at_once):
            self._missing = at_once
            self._all.clear()
            for _ in range(at_once):
                self._publisher.publish(make())
            self._all.wait()
        return (time.perf_counter() - start) / MESSAGES


def schedule(cores, policy):
    """Have all threads of this process, and those that they start, run on those cores in that way."""
    for thread in map(int, os.listdir('/proc/self/task')):
        os.sched_setaffinity(thread, cores)
        os.sched_setscheduler(thread, policy, os.sched_param(0))


def messages():
    """Print the costs of messages."""
    plain = Pose(position=Point(0.1, 0.2, 0.3))
    x, y, z = (rosslt.location(value, name=name) for name, value in (('x', 0.1), ('y', 0.2), ('z', 0.3)))
    tracked = Pose(position=Point(x, y, z))
    computed = Pose(position=Point(2 * x + 1, y - x, z * 3))
    steps = itertools.count()

    def moved():
        """Around a tracked centre, with a tracked radius, computed anew for each message."""
        angle = 0.001 * next(steps)
        return Pose(position=Point(x + z * math.cos(angle), y + z * math.sin(angle), z))

    cases = {
        'rospy, plain': (Channel('bench_rospy', rospy), lambda: plain),
        'rosslt, no field tracked': (Channel('bench_plain', rosslt), lambda: plain),
        'rosslt, x y z tracked': (Channel('bench_tracked', rosslt), lambda: tracked),
        'rosslt, x y z computed once': (Channel('bench_computed', rosslt), lambda: computed),
        'rosslt, x y z computed each time': (Channel('bench_moved', rosslt), moved),
    }
    print('a Pose, published and received     one at a time, us   of rospy     in a flood, us   of rospy')
    times = {(name, at_once): [] for name in cases for at_once in (1, MESSAGES)}
    for _ in range(ROUNDS):
        for (name, at_once), found in times.items():
            channel, make = cases[name]
            found.append(channel.seconds(make, at_once))
    for name in cases:
        single, flood = min(times[name, 1]), min(times[name, MESSAGES])
        print(
            '{:34} {:17.1f} {:10.2f} {:18.1f} {:10.2f}'.format(
                name,
                single * 1e6,
                single / min(times['rospy, plain', 1]),
                flood * 1e6,
                flood / min(times['rospy, plain', MESSAGES]),
            )
        )


def reading():
    """Print what reading a location takes."""

    def read(location, count):
        for _ in count:
            location(3.0)

    def seconds(location):
        start = time.perf_counter()
        read(location, range(READINGS))
        return (time.perf_counter() - start) / READINGS

    times = {function: min(seconds(function) for _ in range(ROUNDS * 5)) for function in (abs, rosslt.location)}
    print(
        'reading a location, nanoseconds: {:.0f}; calling abs: {:.0f}'.format(
            times[rosslt.location] * 1e9, times[abs] * 1e9
        )
    )


def round_trip():
    """Print the time from forcing a value to the message that shows it."""
    shown = {}
    arrived = threading.Condition()

    def receive(message):
        with arrived:
            shown['value'] = message.data
            arrived.notify_all()

    with subprocess.Popen([sys.executable, '-c', TALKER]) as talker:
        rosslt.Subscriber('bench_value', Float64, receive, keep_provenance=True)
        with arrived:
            arrived.wait_for(lambda: 'value' in shown)
        times, acknowledged = [], []
        for turn in range(ROUND_TRIPS):
            target = 10.0 + turn
            start = time.perf_counter()
            rosslt.force_value(shown['value'], target)
            acknowledged.append(time.perf_counter() - start)
            with arrived:
                arrived.wait_for(lambda target=target: shown['value'] == target)
            times.append(time.perf_counter() - start)
            time.sleep(0.007)  # not in step with the talker
        talker.terminate()
    print(
        'round trip at 50 Hz, milliseconds: median {:.1f}, worst of {} {:.1f}; acknowledged after {:.1f}'.format(
            statistics.median(times) * 1e3, len(times), max(times) * 1e3, statistics.median(acknowledged) * 1e3
        )
    )


if __name__ == '__main__':
    rosslt.init_node('bench', anonymous=True, log_level=rospy.WARN)
    every_core = os.sched_getaffinity(0)
    schedule({max(every_core)}, os.SCHED_BATCH)
    messages()
    reading()
    schedule(every_core, os.SCHED_OTHER)
    round_trip()
