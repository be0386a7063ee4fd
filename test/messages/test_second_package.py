"""A package that depends on rosslt generates tracked types of its own messages, and C++ and Python nodes use them.

It is built by `catkin build` and by `catkin_make`, and run from the devel and from the install space of each.
"""

import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.rostest]

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
GENERATED = ['ReadingTracked', 'ReportTracked', 'Temperature', 'TwistTracked']
CMAKE = ['-DPYTHON_EXECUTABLE=/usr/bin/python3', '-DCATKIN_ENABLE_TESTING=OFF']


class Workspace:
    """A catkin workspace with rosslt and the second package in it, and a master for what runs there."""

    def __init__(self, folder, tool):
        self.folder = folder
        self.tool = tool
        self.source = folder / 'src' / 'second_package'
        shutil.copytree(HERE / 'second_package', self.source)
        package = folder / 'src' / 'rosslt'
        package.mkdir()
        for entry in ROOT.iterdir():
            if entry.name != 'build' and not entry.name.startswith('.'):
                (package / entry.name).symlink_to(entry)
        with socket.socket() as free:
            free.bind(('localhost', 0))
            self.port = free.getsockname()[1]
        if tool == 'catkin build':
            self.run(['catkin', 'config', '--init', '--install', '--cmake-args', *CMAKE], None)

    def build(self):
        if self.tool == 'catkin build':
            self.run(['catkin', '--no-color', 'build', '--no-status', '--no-notify'], None)
        else:
            self.run(['catkin_make', *CMAKE, 'install'], None)

    def command(self, command, space):
        """A command in the environment of nothing but ROS, this workspace's space if one is given, and the master."""
        environment = {
            name: os.environ[name] for name in ('HOME', 'LANG', 'ROS_LOG_DIR', 'ROSSLT_RUN') if name in os.environ
        }
        environment.update(
            PATH='/usr/bin:/bin',
            ROS_MASTER_URI='http://localhost:%d' % self.port,
            ROS_HOSTNAME='localhost',
            ROS_LANG_DISABLE='genlisp',
            PYTHONUNBUFFERED='1',
        )
        if space:
            command = [
                'bash',
                '-c',
                'source "$0" && PATH=/usr/bin:$PATH exec "$@"',
                str(self.folder / space / 'setup.bash'),
                *command,
            ]
        return dict(args=command, cwd=str(self.folder), env=environment, stdin=subprocess.DEVNULL, encoding='utf-8')

    def run(self, command, space):
        """The output of a command, which must succeed."""
        done = subprocess.run(
            **self.command(command, space), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600, check=False
        )
        assert done.returncode == 0, '%s ended with %d:\n%s' % (' '.join(command), done.returncode, done.stdout)
        return done.stdout

    def start(self, command, space, log):
        """A process in the background; what it prints goes into a file."""
        with (self.folder / log).open('w') as output:
            return subprocess.Popen(
                **self.command(command, space), stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )

    def text(self, log):
        return (self.folder / log).read_text(encoding='utf-8')

    def generated(self, name):
        """The Python module of a generated message."""
        return (self.folder / 'devel/lib/python3/dist-packages/second_package/msg' / ('_%s.py' % name)).resolve()


def stop(process):
    os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(60)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def wait_for(ask, what, seconds=30):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if ask():
            return
        time.sleep(0.1)
    pytest.fail('waited %d s for %s' % (seconds, what))


@pytest.fixture(scope='module', params=['catkin build', 'catkin_make'])
def workspace(request, tmp_path_factory):
    workspace = Workspace(tmp_path_factory.mktemp('workspace'), request.param)
    workspace.build()
    return workspace


@pytest.fixture
def master(workspace):
    """A master that knows of nothing yet: parameters outlive their nodes."""
    process = workspace.start(['rosmaster', '--core', '-p', str(workspace.port)], None, 'master.log')
    try:
        yield process
    finally:
        stop(process)


@pytest.mark.usefixtures('master')
@pytest.mark.parametrize('space', ['devel', 'install'])
def test_nodes_in_cpp_and_python_read_and_change_tracked_messages(workspace, space):
    nodes = [
        workspace.start(['rosrun', 'second_package', name], space, name)
        for name in ('report_listener', 'report_talker')
    ]
    try:
        wait_for(
            lambda: 'tracked: best 68 F of 2, provenance there' in workspace.text('report_listener'),
            'the C++ node to read a tracked message',
        )
        wait_for(
            lambda: 'ordinary: best 20 C of 2, provenance none' in workspace.text('report_listener'),
            'the C++ node to read an ordinary message with provenance behind it',
        )
        bag = str(workspace.folder / (space + '.bag'))
        workspace.run(['rosbag', 'record', '-O', bag, '-l', '3', '/report', '/report_in_band'], space)
        assert 'second_package/ReportTracked' in workspace.run(['rosbag', 'info', bag], space)
        echoed = workspace.run(['rostopic', 'echo', '-n', '1', '/report'], space)
        assert 'value: 293.15' in echoed
        changed = workspace.run(['rosrun', 'second_package', 'report_changer'], space)
        assert 'forced to 212.00 F' in changed
        assert 'forced to 300.00 K' in changed
        wait_for(
            lambda: 'tracked: best 80.33 F' in workspace.text('report_listener'),
            'the C++ node to read what was changed',
        )
    finally:
        for node in nodes:
            stop(node)
    replayed = workspace.run(['python3', '-c', READ_BAG, bag], space)
    assert replayed.splitlines() == ['68.0 /report_talker', '20.0 /report_talker']


READ_BAG = """
import sys, rosbag
from rosslt import sources
from rosslt.messages import attach, split_provenance, unwrap
with rosbag.Bag(sys.argv[1]) as bag:
    report = unwrap(next(bag.read_messages('/report')).message)
    print(report.best.value, sources(report.best.value)[0].node)
    _, data, _, _, message_class = next(bag.read_messages('/report_in_band', raw=True)).message
    plain, provenance = split_provenance(data, message_class)
    report = message_class().deserialize(plain)
    attach(report, provenance)
    print(report.best.value, sources(report.best.value)[0].node)
"""


@pytest.mark.parametrize('space', ['devel', 'install'])
@pytest.mark.parametrize('name', ['ReportTracked', 'Temperature'])
def test_ros_tools_know_the_tracked_types(workspace, space, name):
    shown = workspace.run(['rosmsg', 'show', 'second_package/' + name], space)
    assert shown.startswith('rosslt/Provenance provenance\n')
    generator = ['rosrun', 'rosslt', 'generate_tracked_msgs.py']
    listed = workspace.run([*generator, '--list', '--package', 'second_package'], space)
    assert listed.split() == ['second_package/Reading', 'second_package/Report']
    module = 'from second_package.msg import %s as m; print(m._md5sum)' % name
    assert workspace.run(['rosmsg', 'md5', 'second_package/' + name], space) == workspace.run(
        ['python3', '-c', module], space
    )


def test_what_is_not_to_be_installed_is_not(workspace):
    definitions = 'share/second_package/msg'
    assert (workspace.folder / 'devel' / definitions / 'Int8Tracked.msg').is_file()
    assert sorted(path.stem for path in (workspace.folder / 'install' / definitions).iterdir()) == [
        'Reading',
        *GENERATED[:1],
        'Report',
        *GENERATED[1:],
    ]


@pytest.mark.parametrize('space', ['devel', 'install'])
def test_the_tracked_type_of_a_message_is_that_of_its_package(workspace, space):
    ask = 'import rosslt; print(*[rosslt.tracked_type(name)._type for name in %r])' % [
        'second_package/Report',
        'geometry_msgs/Twist',
        'geometry_msgs/Pose',
    ]
    assert workspace.run(['python3', '-c', ask], space).split() == [
        'second_package/ReportTracked',
        'second_package/TwistTracked',
        'rosslt/PoseTracked',
    ]


def test_after_a_message_changed_only_what_holds_it_is_generated_anew(workspace):
    before = {name: workspace.generated(name).stat().st_mtime_ns for name in GENERATED}
    reading = workspace.source / 'msg' / 'Reading.msg'
    old = workspace.run(['rosmsg', 'md5', 'second_package/ReportTracked'], 'devel')
    reading.write_text(reading.read_text() + 'float64 deviation\n')
    workspace.build()
    after = {name: workspace.generated(name).stat().st_mtime_ns for name in GENERATED}
    assert [name for name in GENERATED if after[name] != before[name]] == ['ReadingTracked', 'ReportTracked']
    assert workspace.run(['rosmsg', 'md5', 'second_package/ReportTracked'], 'devel') != old


def test_a_type_that_is_not_there_stops_the_configuration(workspace):
    lists = workspace.source / 'CMakeLists.txt'
    right = lists.read_text()
    lists.write_text(right.replace('second_package/Report\n', 'second_package/Reprot\n'))
    try:
        with pytest.raises(AssertionError) as caught:
            workspace.build()
        assert 'found no message type second_package/Reprot: looked for' in ' '.join(str(caught.value).split())
    finally:
        lists.write_text(right)
