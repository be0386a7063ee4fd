"""One slt_visualization at a time: which one runs, and which one waits for its turn."""

import signal
import subprocess
import sys

import pytest

from support.processes import Node, wait_until

pytestmark = pytest.mark.rostest

#: A node of that name that does what slt_visualization does first.
FIRST = """
rospy.Publisher('~update', String, queue_size=1)
rospy.spin()
"""

WAITING = """
from rosslt import markers
markers.wait_for_turn('slt_visualization')
print('it is my turn', flush=True)
"""


@pytest.fixture
def waiting(master):
    """Starts a process that waits for its turn."""
    started = []

    def start(*arguments):
        command = [sys.executable, '-c', WAITING, *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_the_first_one_does_not_wait(waiting):
    assert waiting().communicate(timeout=60) == ('it is my turn\n', '')


@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGKILL], ids=['ended', 'killed'])
def test_another_one_takes_over_when_the_first_one_ends(waiting, end):
    with Node('slt_visualization', FIRST) as first:
        other = waiting()
        told = other.stderr.readline()
        assert 'takes over when it ends, with its own settings' in told
        assert f'/slt_visualization runs already, in process {first.process.pid} (`' in told
        assert waiting('__name:=something_else').communicate(timeout=60)[0] == 'it is my turn\n'
        assert other.poll() is None
        assert first.process.poll() is None
        first.stop(end)
        assert other.stdout.readline() == 'it is my turn\n'


def test_who_waits_can_be_ended(waiting):
    with Node('slt_visualization', FIRST):
        other = waiting()
        other.stderr.readline()
        other.send_signal(signal.SIGINT)
        wait_until(lambda: other.poll() is not None, 'it has ended')
