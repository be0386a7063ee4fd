"""A node ends when it is told to, whatever it does at that moment."""

import signal
from pathlib import Path

import pytest

from support.processes import Node, wait_until


def state(process):
    """The state of the main thread of a process: S while it waits in a system call."""
    return Path(f'/proc/{process.pid}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()[0]


@pytest.mark.rostest
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_middle_of_a_call_of_the_master_ends_the_node(master, number):
    code = """
        print('ready', flush=True)
        sys.stdin.readline()
        print('asks', flush=True)
        rospy.get_param('/nothing', 0)
        rospy.spin()
        """
    with Node('asker', code) as node:
        assert node.read_line() == 'ready'
        master.process.send_signal(signal.SIGSTOP)
        node.process.stdin.write('\n')
        node.process.stdin.flush()
        assert node.read_line() == 'asks'
        wait_until(lambda: all(state(node.process) == 'S' for _ in range(100)), 'it waits for the master')
        node.process.send_signal(number)
        wait_until(lambda: all(state(node.process) == 'S' for _ in range(100)), 'it has taken the signal')
        master.process.send_signal(signal.SIGCONT)
        assert node.process.wait(30) == 0
