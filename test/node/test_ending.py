"""A node ends when it is told to, whatever it does at that moment; a change that ends it does not outlive it."""

import signal
from pathlib import Path

import pytest
import rosgraph

from support.processes import Node, wait_until
from support.shell import failure, rosslt


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
        line = node.line_of('1.0 / ')
        for name, value, kept in (('gain', '0.0', 2.0), ('~scale', '0.0', 1.0)):
            assert node.read_line() == 'turned'
            told = f'rosslt set: /divider raises ZeroDivisionError: float division by zero (divider.py:{line}'
            assert failure('set', f'/divider/{name}', value).startswith(told)
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
@pytest.mark.parametrize(('line', 'told'), [('1 / gain', 'from'), ('1 / whole', 'after')])
def test_last_words_name_a_change_that_was_made_long_before(master, line, told):
    code = f"""
        import rosslt.node.location_server as owner
        owner.SUSPECT = 0.0
        while not rospy.is_shutdown():
            gain = rosslt.location(2.0, name='gain')
            whole = int(str(gain)[0])
            if rospy.get_param('/ending_{told}_now', False):
                {line}
            print('turned', flush=True)
            rospy.sleep(0.01)
        """
    with Node(f'ending_{told}', code) as node:
        assert node.read_line() == 'turned'
        assert rosslt('set', f'{node.name}/gain', '0').returncode == 0, 'the line does not run'
        rosgraph.Master('/test').setParam(node.name + '_now', True)
        assert node.process.wait(30) == 1
        log = node.logged()
        assert f'the node ends {told} what was changed before\nZeroDivisionError: ' in log
        assert f'gain 2.0 -> 0.0 (`rosslt reset {node.name}/gain` says how to take it back))' in log


@pytest.mark.rostest
@pytest.mark.parametrize('goes_on', [False, True])
def test_a_node_that_ends_takes_no_change_unless_a_thread_goes_on(master, goes_on):
    """What is changed after all was taken back would be kept, and may end each start."""
    code = f"""
        import atexit, threading

        def wait():
            print('ends', flush=True)
            sys.stdin.readline()

        gain = rosslt.location(2.0, name='gain')
        threading.Thread(target=wait).start() if {goes_on} else atexit.register(wait)
        raise RuntimeError('the main program')
        """
    with Node('lingering', code) as node:
        assert node.read_line() == 'ends'
        wait_until(lambda: 'RuntimeError: the main program' in node.logged(), 'it has raised')
        if goes_on:
            wait_until(lambda: rosslt('set', '/lingering/gain', '3').returncode == 0, 'it takes changes again')
        else:
            assert 'the node ends' in failure('set', '/lingering/gain', '3')
        node.process.stdin.write('\n')
        node.process.stdin.flush()
        assert node.process.wait(30) == 1


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
        line = node.line_of('1.0 / gain')
        wait_until(lambda: '/timed/gain' in rosslt('list', '/timed').stdout, 'the timer has turned')
        refused = rosslt('force', '/timed/ratio/data', '0', '--timeout', '20')
        assert refused.returncode == 1
        raised = f'/timed raises ZeroDivisionError: float division by zero (timed.py:{line}); taken back'
        assert raised in refused.stderr
        told = 'a callback of a Timer raises after a change, which is taken back: gain = 0.0'
        assert told in node.logged()
        wait_until(lambda: rosgraph.Master('/test').getParam('/timed/rosslt/gain') == 2.0, 'it is taken back')
        assert rosslt('force', '/timed/ratio/data', '3').returncode == 0, 'the timer goes on'
        refused = failure('set', '/timed/gain', '0')
        assert refused.startswith('rosslt set: ' + raised.partition(')')[0]), refused
        assert refused.endswith(
            ', which also reads what was changed before: gain 2.0 -> 3.0 '
            '(`rosslt set /timed/gain 2.0` takes it back)); taken back'
        ), refused
        assert rosslt('get', '/timed/gain').stdout == '3.0\n', 'an earlier change stays'
        assert node.logged().count(told) == 2, 'it is taken back again'
        assert rosslt('force', '/timed/ratio/data', '4').returncode == 0, 'the timer goes on again'


@pytest.mark.rostest
def test_what_does_not_reach_the_line_of_a_timer_that_raises_stays(master):
    code = """
        import rosslt.node.location_server as owner
        owner.SUSPECT = 600.0
        publisher = rosslt.Publisher('~ratio', Float64, queue_size=1)

        def turn(_event):
            divisor = rosslt.location(4.0, name='divisor')
            publisher.publish(rosslt.location(2.0, name='gain'))
            if rospy.get_param('/driving', False):
                1.0 / divisor

        rospy.Timer(rospy.Duration(0.05), turn)
        rospy.spin()
        """
    with Node('ticking', code) as node:
        wait_until(lambda: '/ticking/gain' in rosslt('list', '/ticking').stdout, 'the timer has turned')
        assert rosslt('set', '/ticking/gain', '5').returncode == 0
        assert rosslt('set', '/ticking/divisor', '0').returncode == 0, 'the line does not run'
        rosgraph.Master('/test').setParam('/driving', True)
        told = 'a callback of a Timer raises after a change, which is taken back: divisor = 0.0'
        wait_until(lambda: told in node.logged(), node.logged)
        wait_until(lambda: rosslt('get', '/ticking/divisor').stdout == '4.0\n', 'it is taken back')
        assert rosslt('get', '/ticking/gain').stdout == '5.0\n'


FOLLOWER = """
    publishers = [rosslt.Publisher('~' + name, Float64, queue_size=1) for name in ('error', 'broken', 'command')]

    def follow(error):
        gain = rosslt.location(2.0, name='gain')
        publishers[2].publish(error.data / gain)

    def fail(message):
        rosslt.location(1.0, name='other')
        raise ValueError('as ever')

    plain = rospy.Subscriber('~error', Float64, follow)
    broken = rosslt.Subscriber('~broken', Float64, fail)
    while not rospy.is_shutdown():
        publishers[0].publish(1.0)
        publishers[1].publish(1.0)
        rospy.sleep(0.02)
    """


@pytest.mark.rostest
def test_a_change_that_makes_a_callback_raise_is_taken_back(master):
    with Node('follower', FOLLOWER) as node:
        wait_until(lambda: '/follower/gain' in rosslt('list', '/follower').stdout, 'it follows')
        wait_until(lambda: 'as ever' in node.logged(), 'the other callback raises')
        assert rosslt('set', '/follower/other', '3').returncode == 0
        code = Path(node.file).read_text(encoding='utf-8')
        line = code[: code.index('/ gain')].count('\n') + 1
        told = 'a callback of a Subscriber raises after a change, which is taken back: gain = 0.0'
        told += f'\nZeroDivisionError: float division by zero (follower.py:{line})'
        for times in (1, 2):
            refused = rosslt('set', '/follower/gain', '0')
            assert refused.returncode == 1
            raised = f'/follower raises ZeroDivisionError: float division by zero (follower.py:{line}); taken back\n'
            assert refused.stderr == 'rosslt set: ' + raised
            assert node.logged().count(told) == times
            assert rosgraph.Master('/test').getParam('/follower/rosslt/gain') == 2.0
        assert rosslt('get', '/follower/other').stdout == '3.0\n', 'the callback was called with that before'
        assert 'bad callback: <function follow at ' in node.logged(), 'rospy names the callback as it does'
        forced = rosslt('force', '/follower/command/data', '0.25')
        assert (forced.returncode, rosslt('get', '/follower/gain').stdout) == (0, '4.0\n'), 'the callback goes on'


@pytest.mark.rostest
def test_an_exception_from_before_a_change_takes_nothing_back(master):
    with Node('failing', FOLLOWER) as node:
        wait_until(lambda: '/failing/other' in rosslt('list', '/failing').stdout, 'it has read the number')
        wait_until(lambda: node.logged().count('ValueError: as ever') > 1, 'the callback raises')
        assert rosslt('set', '/failing/other', '3').returncode == 0
        seen = node.logged().count('ValueError: as ever')
        wait_until(lambda: node.logged().count('ValueError: as ever') > seen + 1, 'it raises again')
        assert rosslt('get', '/failing/other').stdout == '3.0\n'
