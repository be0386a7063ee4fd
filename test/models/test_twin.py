"""Copies of running nodes, C++ ones of Debian among them, under masters of their own."""

import contextlib
import io
import os
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import rosgraph
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from rosslt.models import NotCopied, Twin, TwinFailed, live_process
from support.processes import unassigned_port, wait_until

pytestmark = pytest.mark.rostest

STATE_PUBLISHER = '/usr/lib/robot_state_publisher/robot_state_publisher'
RELAY = '/usr/lib/topic_tools/relay'
URDF = """<robot name="arm"><link name="base"/><link name="tip"/><joint name="hinge" type="continuous">
<parent link="base"/><child link="tip"/><axis xyz="0 0 1"/><origin xyz="1 2 3"/></joint></robot>"""
IN, OUT = {'/joints': 'sensor_msgs/JointState'}, {'/tf': 'tf2_msgs/TFMessage'}


@pytest.fixture(params=[True, False], ids=['isolated', 'loopback'])
def isolate(request):
    return request.param


@contextlib.contextmanager
def running(node, *command):
    """A node in a process of its own, from when the master knows it and its service of loggers."""
    process = subprocess.Popen(command)
    master = rosgraph.Master('/test')
    try:
        wait_until(lambda: any(f'{node}/get_loggers' == one for one, _ in master.getSystemState()[2]), node)
        yield process
    finally:
        process.kill()
        process.wait()


def script(tmp_path, code):
    file = tmp_path / 'node.py'
    file.write_text('import rospy\n' + textwrap.dedent(code), encoding='utf-8')
    return sys.executable, str(file)


def serialized(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def joint_state(angle):
    message = JointState(name=['hinge'], position=[angle])
    message.header.stamp.secs = 12
    return serialized(message)


def arm(*options):
    rosgraph.Master('/test').setParam('/robot_description', URDF)
    return running('/arm', STATE_PUBLISHER, '__name:=arm', 'joint_states:=/joints', *options)


def transforms(twin, angle):
    """The first answer that has the time of the joint's state."""
    answers = twin.play([(0.0, '/joints', joint_state(angle))], until=1.0)
    return next(data for _, topic, data in answers if topic == '/tf' and TFMessage().deserialize(data).transforms)


def processes_with(text):
    """The command lines of all processes in which a text is."""
    found = []
    for file in Path('/proc').glob('[0-9]*/environ'):
        with contextlib.suppress(OSError):
            if text.encode() in file.read_bytes():
                found.append(file.parent.name)
    return found


def may_make_namespaces():
    """Whether this machine lets this user do so; a container mostly does not."""
    command = ['unshare', '--map-root-user', '--net', '--mount', '--pid', '--fork', '--mount-proc', 'true']
    return subprocess.run(command, stderr=subprocess.DEVNULL, check=False).returncode == 0


def test_a_twin_answers_with_the_bytes_of_the_live_node(master, isolate):
    with arm('_publish_frequency:=20.0'):
        api = rosgraph.Master('/test')
        process = live_process(api, '/arm')
        parameters = api.getParam('/')
        with Twin(process, parameters, IN, OUT, isolate=isolate) as live_like:
            assert live_like.is_isolated == (isolate and may_make_namespaces())
            first = transforms(live_like, 0.5)
        live = subprocess.run(
            [sys.executable, '-c', LIVE, joint_state(0.5).hex()], stdout=subprocess.PIPE, text=True, check=True
        )
    assert live.stdout.strip() == first.hex()


LIVE = """
import sys, rospy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
rospy.init_node('hand', disable_rosout=True)
heard = []
rospy.Subscriber('/tf', rospy.AnyMsg, lambda message: heard.append(message._buff))
publisher = rospy.Publisher('/joints', JointState, queue_size=1, latch=True)
publisher.publish(JointState().deserialize(bytes.fromhex(sys.argv[1])))
while not heard:
    rospy.sleep(0.01)
print(heard[0].hex())
"""


def test_name_remappings_and_parameters_are_the_live_nodes(master, isolate, tmp_path):
    code = """
    from std_msgs.msg import Float64, String
    rospy.init_node('echo')
    out = rospy.Publisher('out', String, queue_size=9)
    def tell(_):
        out.publish('%s %s %s' % (rospy.get_name(), rospy.get_param('~gain'), rospy.get_param('/shared')))
    rospy.Subscriber('in', Float64, tell)
    rospy.spin()
    """
    api = rosgraph.Master('/test')
    api.setParam('/shared', 'a')
    with running('/other', *script(tmp_path, code), '__name:=other', 'in:=/x', 'out:=/y', '_gain:=2'):
        process = live_process(api, '/other')
        assert (process.subscribed['/x'], process.published['/y']) == ('std_msgs/Float64', 'std_msgs/String')
        inputs, outputs = {'/x': 'std_msgs/Float64'}, {'/y': 'std_msgs/String'}
        with Twin(process, api.getParam('/'), inputs, outputs, isolate=isolate) as twin:

            def said():
                return [data[4:].decode() for _, _, data in twin.play([(0.0, '/x', serialized(Float64()))], until=1.0)]

            assert said() == ['/other 2 a']
            assert {'/other/gain', '/shared', '/use_sim_time'} <= set(twin.asked_parameters())
            twin.set_parameter('/shared', 'b')
            assert said() == ['/other 2 b']
            twin.restart()
            assert said() == ['/other 2 b']
        assert api.getParam('/shared') == 'a'


def test_nothing_reaches_the_live_master(master, isolate, monkeypatch):
    with arm(), socket.create_server(('127.0.0.1', unassigned_port())) as stand_in:
        api = rosgraph.Master('/test')
        uri = f'http://127.0.0.1:{stand_in.getsockname()[1]}'
        process, parameters, before = live_process(api, '/arm'), api.getParam('/'), api.getSystemState()
        process = process._replace(
            environment={**process.environment, 'ROS_MASTER_URI': uri},
            arguments=(*process.arguments, '__master:=' + uri),
        )
        monkeypatch.setenv('ROS_MASTER_URI', uri)
        with Twin(process, parameters, IN, OUT, isolate=isolate) as twin:
            transforms(twin, 1.0)
        stand_in.setblocking(False)
        with pytest.raises(BlockingIOError):
            stand_in.accept()
        assert api.getSystemState() == before
        assert api.getParam('/') == parameters


@pytest.mark.parametrize(
    ('line', 'held'),
    [
        ("held = open('/dev/fuse' if os.path.exists('/dev/fuse') else '/dev/kmsg')", 'the device /dev/'),
        ('held = open(__file__); fcntl.flock(held, fcntl.LOCK_EX)', 'a lock on .*node.py'),
        ("held = open(__file__ + '.lock', 'w')", 'the lock file .*node.py.lock'),
        ("held = open(__file__, 'r+'); fcntl.fcntl(held, 37, struct.pack('hhqqi4x', 1, 0, 0, 0, 0))", 'a lock on .*'),
        ("held = socket.create_server(('localhost', 0))", r'the port \d+'),
        ("held = socket.socket(type=socket.SOCK_DGRAM); held.bind(('', 12368))", 'the port 12368'),
        ("held = socket.socket(socket.AF_UNIX); held.bind(__file__ + '_socket')", 'the socket .*node.py_socket'),
    ],
    ids=['device', 'lock', 'lock_file', 'lock_of_file_description', 'port', 'udp_port', 'unix_socket'],
)
def test_a_node_that_holds_something_is_refused(master, tmp_path, line, held):
    code = f"import fcntl, os, socket, struct\n{line}\nrospy.init_node('holder')\nrospy.spin()\n"
    with running('/holder', *script(tmp_path, code)), pytest.raises(NotCopied, match='/holder holds .*' + held):
        live_process(rosgraph.Master('/test'), '/holder')


def test_unknown_nodes_and_ended_ones_are_named(master):
    api = rosgraph.Master('/test')
    with pytest.raises(NotCopied, match='the master knows no node /nobody'):
        live_process(api, '/nobody')
    with arm():
        assert live_process(api, '/arm').executable == STATE_PUBLISHER
    with pytest.raises(NotCopied, match='/arm does not answer'):
        live_process(api, '/arm')


def test_a_copy_that_crashes_gives_its_last_lines(master, isolate, tmp_path):
    file = tmp_path / 'once'
    code = f"import os\nos.mkdir({str(file)!r})\nrospy.init_node('once')\nrospy.spin()\n"
    with running('/once', *script(tmp_path, code)):
        process = live_process(rosgraph.Master('/test'), '/once')
        twin = Twin(process, {}, {'/x': 'std_msgs/Float64'}, {}, isolate=isolate)
        with pytest.raises(TwinFailed, match=r'(?s)/once has ended with status 1.*FileExistsError'), twin:
            pass


def test_a_node_whose_program_is_gone_is_refused(master, tmp_path):
    program = shutil.copy(STATE_PUBLISHER, str(tmp_path / 'program'))
    rosgraph.Master('/test').setParam('/robot_description', URDF)
    with running('/gone', program, '__name:=gone'):
        os.remove(program)
        with pytest.raises(NotCopied, match=r'/gone was started from what is no longer there: .*program'):
            live_process(rosgraph.Master('/test'), '/gone')


def test_a_node_of_any_type_is_refused(master):
    with running('/relay', RELAY, '/x', '/y', '__name:=relay'), pytest.raises(NotCopied, match='of any type on /x'):
        live_process(rosgraph.Master('/test'), '/relay')


def test_a_copy_of_an_anonymous_node_has_its_name(master, isolate, tmp_path):
    code = """
    from std_msgs.msg import Float64
    rospy.init_node('someone', anonymous=True)
    out = rospy.Publisher('out', Float64, queue_size=9)
    rospy.Subscriber('in', Float64, out.publish)
    rospy.spin()
    """
    with subprocess.Popen(script(tmp_path, code)) as started:
        try:
            api = rosgraph.Master('/test')

            def names():
                return [names[0] for name, names in api.getSystemState()[2] if name.startswith('/someone')]

            wait_until(names, 'the node runs')
            process = live_process(api, names()[0])
            types = {'/in': 'std_msgs/Float64'}, {'/out': 'std_msgs/Float64'}
            with Twin(process, {}, *types, isolate=isolate) as twin:
                assert twin.play([(0.0, '/in', serialized(Float64(3.0)))], until=1.0)
        finally:
            started.kill()


def test_what_a_copy_has_started_ends_with_it(master, isolate, tmp_path):
    mark = 'STARTED_BY=' + str(tmp_path)
    code = """
    import os, subprocess
    subprocess.Popen(['sleep', '1000'], start_new_session=True, env={'STARTED_BY': os.environ.get('TWIN', '')})
    rospy.init_node('starter')
    rospy.spin()
    """
    with running('/starter', *script(tmp_path, code)):
        process = live_process(rosgraph.Master('/test'), '/starter')
        process = process._replace(environment={**process.environment, 'TWIN': str(tmp_path)})
        with Twin(process, {}, {}, {}, isolate=isolate):
            wait_until(lambda: processes_with(mark), 'the copy has started a process')
        assert not processes_with(mark)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_is_left_when_the_parent_ends(master, isolate, number, tmp_path, monkeypatch):
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    mark = 'TWIN_MARK=' + str(tmp_path)
    code = f"""
    import rosgraph
    from rosslt.models import Twin, live_process
    process = live_process(rosgraph.Master('/test'), '/arm')
    process = process._replace(environment={{**process.environment, 'TWIN_MARK': {str(tmp_path)!r}}})
    with Twin(process, rosgraph.Master('/test').getParam('/'), {IN!r}, {OUT!r}, isolate={isolate}) as twin:
        print('up', flush=True)
        twin.play([], until=1000.0)
    """
    with arm():
        parent = subprocess.Popen(script(tmp_path, code), stdout=subprocess.PIPE, text=True)
        with parent:
            assert parent.stdout.readline() == 'up\n'
            assert processes_with(mark)
            parent.send_signal(number)
        wait_until(lambda: not processes_with(mark), 'the copy ends')
        wait_until(lambda: not list(tmp_path.glob('rosslt_twin_*')), 'its directory goes')
