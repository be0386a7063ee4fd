"""Simulated time begins anew, as where a bag is played in a loop: the nodes of the demos go on."""

import contextlib
import subprocess

import pytest
import rosgraph

from support.processes import Node

pytestmark = pytest.mark.rostest

#: The nodes that wait for a time, and what they publish; the first says so only when a waypoint comes into force.
TOPICS = {
    'interactive_script': '/waypoint',
    'slt_trajectory': '/trajectory',
    'slt_quad': '/quadcopter',
    'arm': '/arm',
    'talker': '/chatter',
    'visualization_talker': '/point',
}

#: Says what time it is, as it is told to, and prints each topic once several messages have come since.
CLOCK = f"""
import collections, select
from rosgraph_msgs.msg import Clock

now, heard = 100.0, collections.Counter()

def hear(message, topic):
    heard[topic] += 1
    if heard[topic] == (1 if topic == '/waypoint' else 5):
        print(topic, flush=True)

for topic in {list(TOPICS.values())}:
    rospy.Subscriber(topic, rospy.AnyMsg, hear, topic)
publisher = rospy.Publisher('/clock', Clock, queue_size=1)
while not rospy.is_shutdown():
    if select.select([sys.stdin], [], [], 0.01)[0]:
        now = float(sys.stdin.readline())
        heard.clear()
    now += 0.01
    publisher.publish(rospy.Time.from_sec(now))
"""


@pytest.fixture
def clock(master):
    rosgraph.Master('/test').setParam('/use_sim_time', True)
    with Node('clock', CLOCK) as node:
        yield node


@pytest.fixture
def nodes(clock, tmp_path):
    script = tmp_path / 'tour.script'
    script.write_text('goto(2.0, 1.0, 1.5)\n')
    with contextlib.ExitStack() as stack:
        started = {}
        for name in TOPICS:
            command = ['rosrun', 'rosslt', name, f'_file:={script}']
            started[name] = node = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(node.wait, 60)
            stack.callback(node.terminate)
        yield started


def hear_all(clock):
    heard = set()
    while heard != set(TOPICS.values()):
        heard.add(clock.read_line())


@pytest.mark.timeout(120)
def test_the_nodes_of_the_demos_go_on_where_simulated_time_begins_anew(clock, nodes):
    hear_all(clock)
    clock.process.stdin.write('1.0\n')
    clock.process.stdin.flush()
    hear_all(clock)
    assert [node.poll() for node in nodes.values()] == [None] * len(nodes)
