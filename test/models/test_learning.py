"""`rosslt learn`: what C++ nodes do that nobody tracks, found on copies of them."""

import math
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import rosgraph
import rospkg
import rospy
from std_srvs.srv import Empty

from rosslt.models import LiveProcess, NotLearned, Recording, learn_node
from support.opaque_nodes import ARM, STATE_PUBLISHER, running
from support.processes import wait_until
from support.shell import failure, lines, on_terminal, record_bag, rosslt

pytestmark = pytest.mark.rostest

ANGLES = [0.3, -0.7]

#: Sends what the nodes hear: the same numbers on both topics.
TALKER = """
import math, rospy
from std_msgs.msg import Float64
rospy.init_node('talker')
publishers = [rospy.Publisher(name, Float64, queue_size=1) for name in ('in', 'other')]
rate, step = rospy.Rate(50), 0
while not rospy.is_shutdown():
    step += 1
    for publisher in publishers:
        publisher.publish(0.5 + 0.2 * math.sin(0.1 * step))
    rate.sleep()
"""
#: Records a node that the system holds until a subscriber waits for it; prints how much it has heard and sent.
RECORDER = """
import os, signal, sys, threading, time
import rosgraph, rospy
from rosslt import models
process = models.live_process(rosgraph.Master('/test'), '/opaque')
rospy.init_node('recorder')
os.kill(process.pid, signal.SIGSTOP)
threading.Timer(1.0, os.kill, (process.pid, signal.SIGCONT)).start()
recording = models.record(process, 0.5)
print(len(recording.inputs), len(recording.outputs), recording.seconds)
"""
JOINTS = f"""
import rospy
from sensor_msgs.msg import JointState
rospy.init_node('talker')
publisher, rate = rospy.Publisher('joint_states', JointState, queue_size=1), rospy.Rate(50)
while not rospy.is_shutdown():
    state = JointState(name=['shoulder', 'elbow'], position={ANGLES})
    state.header.stamp = rospy.Time.now()
    publisher.publish(state)
    rate.sleep()
"""


@pytest.fixture
def talker(master):
    with running('/talker', sys.executable, '-c', TALKER):
        yield


def learned(program, kind, *arguments, seconds=2):
    """What is printed of a kind of node: the dependencies as columns, and what is said."""
    with running('/opaque', program, f'_kind:={kind}', *arguments):
        found = rosslt('learn', '/opaque', f'--seconds={seconds}')
    return found, [line.split('\t') for line in found.stdout.splitlines()]


def test_the_slope_of_a_gain_is_that_of_its_parameters(program, talker):
    found, (row,) = learned(program, 'gain', '_gain:=4.0')
    assert row[:3] == ['/out/data', '/in/data', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(4.0, rel=1e-9)
    assert 'on the same messages, it sends the same' in found.stderr
    assert rosslt('list', '/opaque').returncode == 1  # the live one has become nothing else


def test_a_recording_begins_when_all_are_connected(program, talker):
    with running('/opaque', program, '_kind:=gain'):
        found = subprocess.run([sys.executable, '-c', RECORDER], stdout=subprocess.PIPE, text=True, check=True)
    heard, sent, seconds = found.stdout.split()
    assert int(heard) > 0
    assert int(sent) > 0
    assert seconds == '0.5'


def test_a_node_that_ends_while_it_is_listened_to_is_said(program, talker):
    ending = RECORDER.replace('SIGCONT', 'SIGKILL').replace('os.kill(process.pid, signal.SIGSTOP)', '')
    with running('/opaque', program, '_kind:=gain'):
        found = subprocess.run(
            [sys.executable, '-c', ending.replace('0.5', '2.0')], stderr=subprocess.PIPE, text=True, check=False
        )
    assert '/opaque has ended while it was listened to' in found.stderr


@pytest.mark.slow
def test_what_a_node_sends_to_itself_is_no_input(master, tmp_path):
    code = """
    import rospy
    from std_msgs.msg import Float64
    rospy.init_node('both')
    state, out = (rospy.Publisher(name, Float64, queue_size=5) for name in ('state', 'out'))
    rospy.Subscriber('in', Float64, lambda message: state.publish(2 * message.data))
    rospy.Subscriber('state', Float64, lambda message: out.publish(message.data + 1))
    rospy.spin()
    """
    with running('/talker', sys.executable, '-c', TALKER), running(
        '/both', sys.executable, '-c', textwrap.dedent(code)
    ):
        found = rosslt('learn', '/both')
    rows = [line.split('\t') for line in found.stdout.splitlines()]
    assert [row[:3] for row in rows] == [
        ['/out/data', '/in/data', 'smooth'],
        ['/state/data', '/in/data', 'smooth'],
    ], found.stderr


@pytest.mark.slow
def test_of_two_that_move_together_the_one_that_matters_is_found(program, talker):
    found, (row,) = learned(program, 'other')
    assert row[:3] == ['/out/data', '/other/data', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(2.5, rel=1e-9)


@pytest.mark.slow
def test_what_follows_slowly_or_late_is_waited_for(program, talker):
    found, rows = learned(program, 'low_pass', seconds=5)
    assert len(rows) == 1, found
    (row,) = rows
    assert row[:3] == ['/out/data', '/in/data', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(1.0, rel=1e-3)
    found, (row,) = learned(program, 'delay')
    assert row[:3] == ['/out/data', '/in/data', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(2.5, rel=1e-6)
    late = float(found.stderr.split('a change shows after ')[1].split()[0])
    assert late >= 0.2


@pytest.mark.slow
def test_a_parameter_moves_what_is_sent(program, talker):
    with running('/opaque', program, '_kind:=gain', '_gain:=4.0', '_unused:=3'):
        found = rosslt('learn', '/opaque', '--parameters')
    rows = [line.split('\t') for line in found.stdout.splitlines()]
    assert [row[:3] for row in rows] == [
        ['/out/data', '/in/data', 'smooth'],
        ['/out/data', '/opaque/gain', 'smooth'],
    ], found.stderr
    assert 0.3 <= float(rows[1][3]) <= 0.7  # what was heard last
    assert float(rows[1][5]) <= -0.39
    assert float(rows[1][6]) >= 0.39


@pytest.mark.slow
def test_an_output_that_comes_no_more_is_named(master, tmp_path):
    code = """
    import rospy
    from std_msgs.msg import Float64
    rospy.init_node('twice')
    version, out = (rospy.Publisher(name, Float64, queue_size=5, latch=True) for name in ('version', 'out'))
    version.publish(3.0)
    rospy.Subscriber('in', Float64, lambda message: out.publish(2 * message.data))
    rospy.spin()
    """
    with running('/talker', sys.executable, '-c', TALKER), running(
        '/twice', sys.executable, '-c', textwrap.dedent(code)
    ):
        found = rosslt('learn', '/twice')
    assert [line.split('\t')[:3] for line in found.stdout.splitlines()] == [['/out/data', '/in/data', 'smooth']]
    assert 'nothing is learned of what came no more meanwhile, on /version\n' in found.stderr


def kept_files():
    return list(Path(rospkg.get_ros_home(), 'rosslt', 'learned').glob('opaque-*.json'))


@pytest.mark.slow
def test_explain_has_what_was_learned_until_it_is_stale(program, master, tmp_path):
    for file in kept_files():
        file.unlink()
    (tmp_path / 'talker.py').write_text(TALKER, encoding='utf-8')
    plain = 'rosslt explain: nothing in it has a source, as /opaque sends it; `rosslt doctor /out/data` says why; '
    with running('/talker', 'rosslt', 'run', str(tmp_path / 'talker.py')):
        with running('/opaque', program, '_kind:=gain', '_gain:=4.0'):
            wait_until(lambda: 'as /opaque sends it' in rosslt('explain', '/out/data').stderr, '/opaque sends')
            assert failure('explain', '/out/data') == plain + '`rosslt learn /opaque` can find out what moves it'
            assert rosslt('learn', '/opaque').returncode == 0
            (file,) = kept_files()

            first, *rest = lines('explain', '/out/data')
            assert (first[0], *first[2:5]) == ('data', 'learned', '/in/data', 'smooth')
            assert float(first[5]) == pytest.approx(4.0, rel=1e-9)
            # and where the input comes from, which its node knows
            assert {row[0] for row in rest} == {'/in/data'}
            assert {'0.5', '0.2'} <= {row[4] for row in rest if row[3].startswith('/talker/')}
            printed = on_terminal('explain', '/out/data')
            assert ' ago: moves with /in/data, 4 +- ' in printed
            assert '\n/in data = ' in printed

            rospy.set_param('/opaque/gain', 5.0)
            stale = failure('explain', '/out/data')
            assert stale.startswith(plain + 'learned ')
            assert stale.endswith(
                ' ago, stale: it has another value of the parameter /opaque/gain; `rosslt learn /opaque` learns it anew'
            )
            rospy.set_param('/opaque/gain', 4.0)
            assert lines('explain', '/out')[0][:1] == ['data']

            content = file.read_text(encoding='utf-8')
            file.write_text(content.replace('"smooth"', '"sure"'), encoding='utf-8')
            assert failure('explain', '/out/data').startswith(f'rosslt explain: {file} is not what `rosslt learn` has ')
            file.write_text(content, encoding='utf-8')
        gone = failure('explain', '/out/data')
        assert 'what /opaque sends on it was learned ' in gone
        assert gone.endswith(' ago; the node does not run')


@pytest.mark.slow
def test_explain_has_no_slope_of_what_stops_at_a_limit(program, master):
    with running('/talker', sys.executable, '-c', TALKER.replace('0.5 + 0.2', '1.0 + 0.0')), running(
        '/opaque', program, '_kind:=saturation'
    ):
        assert rosslt('learn', '/opaque').returncode == 0
        ((*_, kind, slope, _, _),) = lines('explain', '/out/data')
        assert (kind, slope) == ('saturated', 'nan')
        assert on_terminal('explain', '/out/data').endswith(' ago: moves with /in/data, saturated\n')


@pytest.mark.slow
def test_another_program_of_a_node_makes_what_was_learned_stale(program, talker, tmp_path):
    copied = str(tmp_path / 'copied')
    shutil.copy(program, copied)
    with running('/opaque', copied, '_kind:=gain'):
        assert rosslt('learn', '/opaque').returncode == 0
        assert lines('explain', '/out/data')
    with open(copied, 'ab') as built_anew:
        built_anew.write(b'0')
    with running('/opaque', copied, '_kind:=gain'):
        assert f" ago, stale: '{copied}' has changed since; `rosslt learn " in failure('explain', '/out/data')


@pytest.mark.slow
def test_what_was_recorded_in_a_bag_is_played(program, talker, tmp_path):
    file = str(tmp_path / 'run.bag')
    with running('/opaque', program, '_kind:=gain'):
        record_bag(file, 120, '/in', '/out')
        found = rosslt('learn', '/opaque', '--bag', file)
    assert found.returncode == 0, found.stderr
    (row,) = (line.split('\t') for line in found.stdout.splitlines())
    assert row[:3] == ['/out/data', '/in/data', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(2.5, rel=1e-9)


@pytest.mark.slow
def test_a_limit_is_said_to_be_one(program, master):
    with running('/talker', sys.executable, '-c', TALKER.replace('0.5 + 0.2', '1.0 + 0.0')):
        found, (row,) = learned(program, 'saturation')
    assert row[:3] == ['/out/data', '/in/data', 'saturated'], found.stderr
    assert row[3] == 'nan'


@pytest.mark.parametrize(
    ('kind', 'reason'),
    [
        ('random', 'the twin of /opaque does not do what it does: /out/data differs by '),
        ('sum', 'the twin of /opaque does not do what it does: /out/data differs by '),
        ('nothing', '/opaque has sent nothing within 2 s'),
    ],
)
def test_what_a_twin_does_otherwise_is_refused(program, talker, kind, reason):
    found, _ = learned(program, kind)
    assert (found.returncode, found.stdout) == (1, '')
    assert reason in found.stderr


@pytest.mark.slow
def test_the_angles_of_a_robot_state_publisher_turn_its_frames(master):
    rospy.set_param('/robot_description', ARM)
    with running('/talker', sys.executable, '-c', JOINTS), running(
        '/robot_state_publisher', STATE_PUBLISHER, '__name:=robot_state_publisher'
    ):
        found = rosslt('learn', '/robot_state_publisher')
        explained = lines('explain', '/tf/transforms[0]/transform/rotation')
        rospy.set_param('/robot_description', ARM.replace('0 0 1', '1 0 0'))  # which it has asked for
        stale = failure('explain', '/tf/transforms[0]/transform/rotation/z')
    rows = {tuple(line.split('\t')[:2]): line.split('\t') for line in found.stdout.splitlines()}
    expected = {
        # in the order of their names
        (f'/tf/transforms[{1 - joint}]/transform/rotation/{axis}', f'/joint_states/position[{joint}]'): slope
        for joint, turning in enumerate('zy')
        for axis, slope in (
            (turning, math.cos(ANGLES[joint] / 2) / 2),
            ('w', -math.sin(ANGLES[joint] / 2) / 2),
        )
    }
    assert rows.keys() == expected.keys(), found.stderr
    for names, slope in expected.items():
        assert float(rows[names][3]) == pytest.approx(slope, rel=1e-3)
    assert {(row[0], row[2], row[3]) for row in explained} == {
        ('transforms[0].transform.rotation.' + axis, 'learned', '/joint_states/position[1]') for axis in 'yw'
    }
    assert 'stale: it has another value of the parameter /robot_description; ' in stale


@pytest.mark.slow
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_ends_it_and_leaves_nothing(program, talker, number, tmp_path, monkeypatch):
    with running('/opaque', program, '_kind:=gain'):
        monkeypatch.setenv('TMPDIR', str(tmp_path))
        with subprocess.Popen(['rosslt', 'learn', '/opaque'], stderr=subprocess.PIPE, text=True) as learning:
            assert learning.stderr.readline().startswith('rosslt learn: the twin runs')
            learning.send_signal(number)
            said = learning.stderr.read()
        assert learning.returncode == (-signal.SIGKILL if number == signal.SIGKILL else 1)
        assert said == ('' if number == signal.SIGKILL else 'rosslt learn: interrupted\n')
        wait_until(lambda: not list(tmp_path.glob('rosslt_twin_*')), 'the directory of the twin goes')
        assert '/rosslt' not in str(rosgraph.Master('/test').getSystemState())


def test_simulated_time_is_refused():
    process = LiveProcess('/opaque', 1, '', (), {}, '/', {'/in': 'std_msgs/Float64'}, {'/out': 'std_msgs/Float64'})
    with pytest.raises(NotLearned, match=r'time is simulated \(/use_sim_time\)'):
        learn_node(process, {'use_sim_time': True}, Recording([], [], {}, 2.0))


@pytest.mark.slow
def test_a_slow_timer_is_waited_for(master):
    code = """
    import rospy
    from std_msgs.msg import Float64
    rospy.init_node('slow')
    out, heard = rospy.Publisher('out', Float64, queue_size=5), []
    rospy.Subscriber('in', Float64, heard.append)
    rospy.Timer(rospy.Duration(0.5), lambda _: heard and out.publish(3 * heard[-1].data))
    rospy.spin()
    """
    with running('/talker', sys.executable, '-c', TALKER.replace('0.2 *', '0.0 *')), running(
        '/slow', sys.executable, '-c', textwrap.dedent(code)
    ):
        found = rosslt('learn', '/slow', '--seconds=4')
    assert [line.split('\t')[:3] for line in found.stdout.splitlines()] == [['/out/data', '/in/data', 'smooth']], found


@pytest.mark.slow
def test_a_state_that_shows_in_an_order_is_seen(master):
    code = """
    import rospy
    from std_msgs.msg import Float64
    from std_srvs.srv import Empty
    rospy.init_node('mode')
    out, sign = rospy.Publisher('out', Float64, queue_size=5), [1]
    rospy.Service('turn', Empty, lambda _: sign.append(-1) or [])
    rospy.Subscriber('in', Float64, lambda message: out.publish(message.data * sign[-1]))
    rospy.spin()
    """
    # Of 5 s, 2 s are compared, each answer with those up to 1.25 s before and after it.
    talker = TALKER.replace('0.5 + 0.2 * math.sin(0.1 * step)', '(0, 1, 0, -1)[step // 70 % 4]')
    with running('/talker', sys.executable, '-c', talker), running(
        '/mode', sys.executable, '-c', textwrap.dedent(code)
    ):
        rospy.ServiceProxy('/turn', Empty)()
        found = rosslt('learn', '/mode', '--seconds=5')
    assert (found.returncode, found.stdout) == (1, '')
    assert 'the twin of /mode does not do what it does: /out/data differs by' in found.stderr


@pytest.mark.slow
def test_the_places_of_frames_are_changed_and_not_their_turns(master):
    broadcaster = """
    import rospy
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage
    rospy.init_node('talker')
    publisher, rate = rospy.Publisher('/tf', TFMessage, queue_size=1), rospy.Rate(50)
    while not rospy.is_shutdown():
        frame = TransformStamped(child_frame_id='tip')
        frame.header.frame_id, frame.header.stamp = 'base', rospy.Time.now()
        frame.transform.translation.x, frame.transform.rotation.z, frame.transform.rotation.w = 0.4, 0.6, 0.8
        publisher.publish(TFMessage([frame]))
        rate.sleep()
    """
    listener = """
    import rospy, tf2_ros
    from std_msgs.msg import Float64
    rospy.init_node('reader')
    buffer, out = tf2_ros.Buffer(), rospy.Publisher('out', Float64, queue_size=5)
    listening = tf2_ros.TransformListener(buffer)
    def tell(_):
        if buffer.can_transform('base', 'tip', rospy.Time()):
            out.publish(2 * buffer.lookup_transform('base', 'tip', rospy.Time()).transform.translation.x)
    rospy.Timer(rospy.Duration(0.02), tell)
    rospy.spin()
    """
    with running('/talker', sys.executable, '-c', textwrap.dedent(broadcaster)), running(
        '/reader', sys.executable, '-c', textwrap.dedent(listener)
    ):
        found = rosslt('learn', '/reader')
    (row,) = (line.split('\t') for line in found.stdout.splitlines())
    assert row[:3] == ['/out/data', '/tf/transforms[0]/transform/translation/x', 'smooth'], found.stderr
    assert float(row[3]) == pytest.approx(2, rel=1e-6)
    assert 'rotations of frames are not changed' in found.stderr


def test_what_cannot_be_copied_is_said(master):
    missing = rosslt('learn', '/nobody')
    assert (missing.returncode, missing.stderr) == (1, 'rosslt learn: the master knows no node /nobody\n')


def test_nothing_to_hear_is_said(master, tmp_path):
    code = textwrap.dedent(
        """
        import rospy
        from std_msgs.msg import Float64
        rospy.init_node('alone')
        publisher, rate = rospy.Publisher('alone', Float64, queue_size=1), rospy.Rate(20)
        while not rospy.is_shutdown():
            publisher.publish(1.0)
            rate.sleep()
        """
    )
    with running('/alone', sys.executable, '-c', code):
        found = rosslt('learn', '/alone')
    assert (found.returncode, found.stderr) == (1, 'rosslt learn: /alone has heard no numbers within 2 s: nothing\n')
