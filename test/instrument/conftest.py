"""A master for the tests beside this file, and what `rosslt run` sets for a whole process."""

import subprocess
from pathlib import Path

import pytest
import rospy

import rosslt
from support.hand import Hand
from support.masters import reached_master
from support.memory_oracle import Pair
from support.saving import Hearing


@pytest.fixture(scope='session')
def master(tmp_path_factory):
    """A master for all tests of nodes; this process is a node of it, /test."""
    with reached_master(tmp_path_factory.mktemp('log'), Path(__file__).parent) as started:
        rosslt.init_node('test', argv=[], disable_signals=True)
        yield started
        rospy.signal_shutdown('the tests are over')


@pytest.fixture
def hearing(master):
    """Hears topics: called with a topic and a type, it gives a Hearing."""
    made = []

    def hear(topic, kind):
        made.append(Hearing(topic, kind))
        return made[-1]

    yield hear
    for one in made:
        one.stop()


@pytest.fixture
def pair(master):
    """A plain node and one with provenance beside each other."""
    made = Pair()
    yield made
    made.close()


@pytest.fixture(scope='module')
def hand(master):
    """A hand in RViz, as far as `slt_visualization` can tell."""
    markers = subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdin=subprocess.DEVNULL)
    yield Hand()
    markers.terminate()
    markers.wait(20)
