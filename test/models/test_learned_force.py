"""`rosslt force` of what C++ nodes send that nobody tracks, by what was learned of them."""

import contextlib
import math
import re
import signal
import subprocess
import sys
import textwrap

import pytest
import rospy

from support.opaque_nodes import ARM, STATE_PUBLISHER, running
from support.processes import Node, wait_until
from support.shell import failure, on_terminal, rosslt

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

TALKER = """
    from std_msgs.msg import Float64
    one, other = (rosslt.Publisher(name, Float64, queue_size=1) for name in ('/in', '/other'))
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        other.publish(rosslt.location({second}, name='second'))
        one.publish(rosslt.location({first}, name='first'))
        rate.sleep()
    """
JOINTS = """
import rospy
from sensor_msgs.msg import JointState
rospy.init_node('joints')
publisher, rate = rospy.Publisher('joint_states', JointState, queue_size=1), rospy.Rate(50)
while not rospy.is_shutdown():
    state = JointState(name=['shoulder', 'elbow'], position=[0.3, -0.7])
    state.header.stamp = rospy.Time.now()
    publisher.publish(state)
    rate.sleep()
"""
BY = r'rosslt force: by the slopes that were learned of /opaque \d+ (s|min) ago\n'


@contextlib.contextmanager
def learned(program, kind, *arguments, first=0.5, second=2.0, seconds=2):
    """A node of a kind, which was learned while a tracked talker sends what it hears."""
    with Node('talker', TALKER.format(first=first, second=second)), running(
        '/opaque', program, f'_kind:={kind}', *arguments
    ):
        wait_until(lambda: len(rosslt('list', '/talker').stdout.splitlines()) == 2, 'all locations are there')
        found = rosslt('learn', '/opaque', f'--seconds={seconds}')
        assert found.returncode == 0, found.stderr
        yield


def sent():
    """What the node sends."""
    return float(rosslt('echo', '--once', '/out/data').stdout.split('\t')[1])


def value(name):
    return float(rosslt('get', f'/talker/{name}').stdout.split('\t')[-1])


def forced(*arguments):
    """The columns of the changes, and what is said beside that it is by what was learned."""
    found = rosslt('force', *arguments)
    assert found.returncode == 0, found.stderr
    said = re.fullmatch(BY + '(?P<rest>.*)', found.stderr, re.DOTALL)
    assert said, found.stderr
    return [line.split('\t') for line in found.stdout.splitlines()], said['rest']


def refused(*arguments):
    """Why it is not reached; the talker's numbers are as before."""
    found = rosslt('force', *arguments)
    assert (found.returncode, found.stdout) == (1, '')
    assert (value('first'), value('second')) == (0.5, 2.0)
    return found.stderr


def set_gain(gain):
    """Give the node that runs another gain, which nobody sees."""
    subprocess.run(['rostopic', 'pub', '-1', '/set_gain', 'std_msgs/Float64', f'data: {gain}'], check=True)
    wanted = float(str(gain).strip('.')) * 0.5 + 1.0
    wait_until(lambda: str(sent()) == str(wanted), 'the node has another gain')


def test_a_gain_is_reached_in_one_round(program, master):
    with learned(program, 'gain'):
        assert sent() == 2.25
        ((name, old, new, *_),), said = forced('/out/data', '2.3')
        assert (name, old) == ('/talker/first', '0.5')
        assert float(new) == pytest.approx(0.52, rel=1e-9)
        assert said == ''
        assert sent() == pytest.approx(2.3, rel=1e-9)

        printed = on_terminal('force', '/out/data', '2.25')
        assert re.match(r'by the slopes that were learned of /opaque \d+ (s|min) ago\n/talker/first: 0.52', printed)
        assert re.search(r'\nseen after \d+ messages?, \d+ ms\n$', printed)

        planned, said = forced('/out/data', '2.3', '--dry-run')
        assert [row[:2] for row in planned] == [['/talker/first', '0.5']]
        assert (said, value('first')) == ('', 0.5)
        said = on_terminal('force', '/out/data', '2.3', '--dry-run')
        assert re.match(r'by the slopes that were .* ago\nwould change /talker/first: 0.5 -> 0.52 ', said)


def test_what_was_not_learned_or_is_stale_is_refused(program, master):
    nothing = 'nothing in it has a source, as /opaque sends it; `rosslt doctor /out/data` says why'
    with learned(program, 'gain', '_gain:=2.5'):
        beyond = refused('/out/data', '5.0')
        (low, high) = re.search(r'/in/data would be 1.6, and was learned from (\S+) to (\S+) only\n', beyond).groups()
        assert 0.44 <= float(low) <= 0.46
        assert 0.54 <= float(high) <= 0.56

        missing = failure('force', '/out/data', '2.3', '--source', '/talker/none')
        assert missing.endswith('/talker/none is not among its sources, which are /talker/first')

        rospy.set_param('/opaque/gain', 3.0)
        stale = failure('force', '/out/data', '2.3')
        assert stale.startswith(f'rosslt force: {nothing}; learned ')
        assert stale.endswith(
            ' ago, stale: it has another value of the parameter /opaque/gain; `rosslt learn /opaque` learns it anew'
        )
        assert value('first') == 0.5


def test_inputs_without_a_source_are_named(program, master):
    talker = textwrap.dedent(TALKER.format(first=0.5, second=2.0)).replace('rosslt.Publisher', 'rospy.Publisher')
    talker = re.sub(r"rosslt.location\((\S+), name='\w+'\)", r'\1', talker)
    with running('/talker', sys.executable, '-c', f"import rospy\nrospy.init_node('talker')\n{talker}"), running(
        '/opaque', program, '_kind:=gain'
    ):
        assert rosslt('learn', '/opaque').returncode == 0
        said = failure('force', '/out/data', '2.3')
    assert 'it follows /in/data, which has no source either: run the node that sends it with `rosslt run`' in said


def test_a_limit_is_refused_by_its_kind(program, master):
    with learned(program, 'saturation', first=1.0):
        said = failure('force', '/out/data', '0.95')
        assert value('first') == 1.0
    assert ' ago, /out/data moves with /in/data, saturated, and no slope by which a message could change it is' in said


def test_a_curve_is_reached_in_three_rounds(program, master):
    with learned(program, 'square'):
        printed = on_terminal('force', '/out/data', '0.28')
        assert re.search(r', solved [23] times\n', printed), printed
        assert 'rosslt force: /opaque sends 0.2' in printed  # not quite, and that is said
        assert sent() == pytest.approx(0.28, abs=3e-5)


@pytest.mark.parametrize(('kind', 'start', 'wanted'), [('low_pass', 0.5, 0.52), ('delay', 1.25, 1.3)])
def test_what_follows_slowly_or_late_is_waited_for(program, master, kind, start, wanted):
    with learned(program, kind, seconds=5):  # the low-pass filter forgets slowly
        wait_until(lambda: sent() == pytest.approx(start, rel=1e-9), 'it stays')
        (row,), _ = forced('/out/data', str(wanted))
        assert row[0] == '/talker/first'
        assert float(row[2]) == pytest.approx(0.52, rel=1e-3)


def test_a_node_that_has_changed_is_corrected(program, master):
    with learned(program, 'gain'):
        set_gain(2.5 * 1.3)
        (row,), _ = forced('/out/data', str(1.625 + 1.0 + 0.1))
        assert float(row[2]) == pytest.approx(0.5 + 0.1 / 3.25, rel=1e-4)


@pytest.mark.parametrize(('gain', 'how'), [(-2.5, 'moved the other way'), (0.0, 'not moved')])
def test_a_node_that_does_something_else_is_left(program, master, gain, how):
    with learned(program, 'gain'):
        set_gain(gain)
        said = refused('/out/data', str(gain * 0.5 + 1.0 + 0.05))
        assert f'; it has {how}, and was to move by +0.05 as was learned; taken back\n' in said
        assert sent() == gain * 0.5 + 1.0


def test_a_node_that_sends_nan_is_not_as_wanted(program, master):
    with learned(program, 'gain'):
        set_gain('.nan')
        refused('/out/data', '2.3')


def test_each_number_of_an_array_has_to_be_as_wanted(program, master):
    with learned(program, 'array'):
        assert 'nothing that was tried moves data[2], which is 7.0' in refused('/array/data', '[126.0, 2.0, 7.001]')
        assert 'nothing that was tried moves data[2], which' in refused('/array/data', '[126, 2, 8]', '--dry-run')
        rows, said = forced('/array/data', '[126.0, 2.02, 7.0]')
        assert ([row[0] for row in rows], said) == (['/talker/first', '/talker/second'], '')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_what_is_interrupted_is_taken_back(program, master, number):
    with learned(program, 'gain'):
        subprocess.run(['rostopic', 'pub', '-1', '/set_most', 'std_msgs/Float64', '0.51'], check=True)
        process = subprocess.Popen(
            ['rosslt', 'force', '/out/data', '2.3', '--timeout', '60'],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        wait_until(lambda: value('first') == 0.52, 'it is changed')
        process.send_signal(number)
        printed, said = process.communicate(timeout=60)
        assert (process.returncode, printed) == (1, '')
        assert re.fullmatch(BY + 'rosslt force: interrupted\n', said)
        assert value('first') == 0.5


def test_of_two_sources_what_is_chosen_and_not_locked_changes(program, master):
    with learned(program, 'two'):
        assert sent() == 7.25
        (row,), _ = forced('/out/data', '7.4')
        assert row[0] == '/talker/second'
        assert float(row[2]) == pytest.approx(2.05, rel=1e-9)
        (row,), _ = forced('/out/data', '7.5', '--source', '/talker/first')
        assert row[0] == '/talker/first'
        assert float(row[2]) == pytest.approx(0.54, rel=1e-9)

        assert rosslt('lock', '/talker/second').returncode == 0
        (row,), _ = forced('/out/data', '7.4')
        assert row[0] == '/talker/first'
        assert float(row[2]) == pytest.approx(0.5, rel=1e-9)
        assert rosslt('lock', '/talker/first').returncode == 0
        found = rosslt('force', '/out/data', '7.5')
        assert (found.returncode, found.stdout) == (1, '')
        assert 'locked' in found.stderr
        assert sent() == pytest.approx(7.4, rel=1e-9)


def test_a_frame_is_turned_by_the_number_of_a_joint(master, tmp_path):
    rospy.set_param('/robot_description', ARM)
    (tmp_path / 'joints.py').write_text(JOINTS, encoding='utf-8')
    with running('/joints', 'rosslt', 'run', str(tmp_path / 'joints.py')), running(
        '/robot_state_publisher', STATE_PUBLISHER, '__name:=robot_state_publisher'
    ):
        assert rosslt('learn', '/robot_state_publisher').returncode == 0
        found = rosslt('force', '/tf/transforms/transform/rotation/z', '0.155', '--where', 'child_frame_id=upper')
        assert found.returncode == 0, found.stderr
        ((name, old, new, *_),) = [line.split('\t') for line in found.stdout.splitlines()]
        assert (name.rpartition('/')[0], old) == ('/joints', '0.3')
        assert float(new) == pytest.approx(2 * math.asin(0.155), rel=1e-4)
