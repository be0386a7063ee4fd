"""A node ends when it is told to, whatever it does at that moment; a change that ends it does not outlive it."""

import signal
from pathlib import Path

import pytest
import rosgraph

from support.processes import Node, wait_until
from support.shell import rosslt


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


@pytest.mark.rostest
def test_a_change_that_makes_the_main_program_raise_is_taken_back_and_named(master):
    code = """
        while not rospy.is_shutdown():
            1.0 / rosslt.location(2.0, name='gain') / rosslt.get_param('~scale', 1.0)
            print('turned', flush=True)
            rospy.sleep(0.01)
        """
    with Node('divider', code) as node:
        for name, value, kept in (('gain', '0.0', 2.0), ('~scale', '0.0', 1.0)):
            assert node.read_line() == 'turned'
            assert rosslt('set', f'/divider/{name}', value).returncode == 0
            assert node.process.wait(30) == 1
            parameter = '/divider/' + name.replace('~', '') if '~' in name else '/divider/rosslt/' + name
            parameters = rosgraph.Master('/test')
            # What the code says need not be set: the node may have ended before the change was written.
            assert not parameters.hasParam(parameter) or parameters.getParam(parameter) == kept
            log = node.logged()
            assert 'the node ends after a change, which is taken back: ' in log
            assert 'ZeroDivisionError: float division by zero' in log
            node.start()
        assert node.read_line() == 'turned'


@pytest.mark.rostest
def test_a_location_keeps_to_what_the_field_holds_that_it_is_sent_in(master):
    code = """
        from std_msgs.msg import Int32, UInt8

        publishers = [rosslt.Publisher('~' + one.__name__, one, queue_size=1) for one in (Int32, UInt8)]
        heard = [rosslt.Subscriber('~' + one.__name__, one, lambda message: None) for one in (Int32, UInt8)]
        while not rospy.is_shutdown():
            publishers[0].publish(rosslt.location(3, name='count', maximum=2 ** 40))
            publishers[1].publish(rosslt.location(4, name='level', minimum=1))
            rospy.sleep(0.02)
        """
    with Node('sender', code) as node:
        for name, value, reason in (
            ('count', 2**31, f'{2**31} is above its maximum {2**31 - 1}'),
            ('level', 256, '256 is above its maximum 255'),
            ('level', 0, '0 is below its minimum 1'),
        ):
            limit = reason.split()[-1]
            wait_until(lambda name=name, limit=limit: limit in _line_of(name), 'it is sent')
            assert reason in rosslt('set', f'/sender/{name}', str(value)).stderr
        assert rosslt('set', '/sender/level', '255').returncode == 0
        assert node.process.poll() is None


def _line_of(name):
    """What `rosslt list` says of a location of /sender."""
    return next((line for line in rosslt('list', '/sender').stdout.splitlines() if f'/{name}\t' in line), '')


@pytest.mark.rostest
def test_a_change_that_makes_a_thread_raise_is_taken_back_named_and_told_to_who_asked(master):
    code = """
        publisher = rosslt.Publisher('~ratio', Float64, queue_size=1)

        def turn(_event):
            gain = rosslt.location(2.0, name='gain')
            1.0 / gain
            publisher.publish(gain)

        rospy.Timer(rospy.Duration(0.05), turn)
        rospy.spin()
        """
    with Node('timed', code) as node:
        wait_until(lambda: '/timed/gain' in rosslt('list', '/timed').stdout, 'the timer has turned')
        refused = rosslt('force', '/timed/ratio/data', '0', '--timeout', '20')
        assert refused.returncode == 1
        assert '/timed raises ZeroDivisionError: float division by zero; taken back' in refused.stderr
        told = 'a callback of a Timer raises after a change, which is taken back: gain = 0.0'
        assert told in node.logged()
        wait_until(lambda: rosgraph.Master('/test').getParam('/timed/rosslt/gain') == 2.0, 'it is taken back')
        assert rosslt('force', '/timed/ratio/data', '3').returncode == 0, 'the timer goes on'
        assert rosslt('set', '/timed/gain', '0').returncode == 0
        wait_until(lambda: node.logged().count(told) == 2, 'it is taken back again')
        assert rosslt('force', '/timed/ratio/data', '4').returncode == 0, 'the timer goes on again'
