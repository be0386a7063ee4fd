"""The parameters of C++ nodes of a launch file are locations, and a change of them reaches the node."""

import contextlib
import os
import shlex
import signal
import subprocess
from types import SimpleNamespace

import pytest
import rosgraph
import rospy
from geometry_msgs.msg import Point

from support.processes import node_pid, wait_until
from support.saving import Hearing
from support.shell import failure, lines, rosslt

NODE = r"""
#include <dynamic_reconfigure/TestConfig.h>
#include <dynamic_reconfigure/server.h>
#include <geometry_msgs/Point.h>
#include <ros/ros.h>
#include <unistd.h>

geometry_msgs::Point message;

void reconfigure(dynamic_reconfigure_test::TestConfig& config, uint32_t) { message.z = config.double_; }

int main(int argc, char** argv) {
  ros::init(argc, argv, "cpp_node");
  ros::NodeHandle node("~");
  node.getParam("gain", message.x);
  if (message.x < 0) return 3;
  std::vector<double> offsets{0};
  node.getParam("offsets", offsets);
  message.y = offsets.back();
  dynamic_reconfigure::Server<dynamic_reconfigure_test::TestConfig> server;
  server.setCallback(reconfigure);
  ros::Publisher publisher = node.advertise<geometry_msgs::Point>("sent", 1);
  while (ros::ok()) {
    publisher.publish(message);
    ros::spinOnce();
    ros::Duration(0.02).sleep();
  }
  if (message.x > 100) sleep(5);
}
"""

PYTHON = """#!/usr/bin/env python3
import rospy
from geometry_msgs.msg import Point

rospy.init_node('plain')
gain, publisher = rospy.get_param('~gain'), rospy.Publisher('~sent', Point, queue_size=1)
while not rospy.is_shutdown():
    publisher.publish(Point(x=gain))
    rospy.sleep(0.02)
"""

LAUNCH = """<launch>
  <!-- <param name="gain" value="1.50"/> -->
  <node pkg="cpp_package" type="{kind}" name="{name}" {options}>
    <param name="gain" value="1.50"/>
    <param name="double_" value="2.50"/>
    <rosparam>
      offsets: [0.0,
                10.50]  # 10.50
    </rosparam>
    <rosparam file="$(dirname)/more.yaml"/>
  </node>
  {more}
</launch>
"""


@pytest.fixture(scope='module')
def packages(tmp_path_factory):
    """A folder with a package of a C++ node."""
    folder = tmp_path_factory.mktemp('packages')
    package = folder / 'cpp_package'
    package.mkdir()
    (package / 'package.xml').write_text(
        '<package><name>cpp_package</name><version>1.0.0</version><description>d</description>'
        '<maintainer email="a@b.c">a</maintainer><license>BSD</license></package>'
    )
    (package / 'node.cpp').write_text(NODE)
    (package / 'plain.py').write_text(PYTHON)
    (package / 'plain.py').chmod(0o755)
    libraries = subprocess.check_output(
        ['pkg-config', '--cflags', '--libs', 'roscpp', 'dynamic_reconfigure'], text=True
    )
    command = ['g++', 'node.cpp', '-o', 'cpp_node', *shlex.split(libraries)]
    subprocess.run(command, cwd=package, check=True)
    return folder


@pytest.fixture
def launch(master, packages, tmp_path):
    """Starts the launch file: called with the name of the node, attributes of it, options of `rosslt launch`, and
    another node."""
    with contextlib.ExitStack() as stack:

        def start(name, attributes='', *options, kind='cpp_node', more=''):
            file, log = tmp_path / f'{name}.launch', tmp_path / f'{name}.log'
            said = LAUNCH.format(name=name, options=attributes, kind=kind, more=more)
            file.write_text(said)
            (tmp_path / 'more.yaml').write_text('limits: {low: -1.0, is_strict: true, frame: map}\nnothing: .nan\n')
            environment = dict(os.environ, ROS_PACKAGE_PATH=f'{packages}:{os.environ["ROS_PACKAGE_PATH"]}')
            words = ['rosslt', 'launch', '--no-markers', *options, str(file)]
            with log.open('w') as printed:
                process = subprocess.Popen(words, env=environment, stdout=printed, stderr=printed)
            stack.callback(process.wait, 60)
            stack.callback(process.send_signal, signal.SIGINT)
            heard = Hearing(f'/{name}/sent', Point)
            stack.callback(heard.stop)
            wait_until(lambda: rosslt('list', f'/{name}').returncode == 0, 'its parameters')
            owner = rosslt('list', f'/{name}').stdout.split('//')[0]
            return SimpleNamespace(file=file, said=said, log=log, process=process, owner=owner, heard=heard)

        yield start


def sends(launched, **wanted):
    launched.heard.next(lambda point: all(getattr(point, name) == value for name, value in wanted.items()))


def pid(name):
    return node_pid(rosgraph.Master('/test').lookupNode(name))


def test_parameters_of_a_node_in_cpp_are_changed_and_saved(launch):
    launched = launch('tuned', 'required="true"')
    first = lines('list', '/tuned')
    assert {line[0].split('//')[1]: (line[2], line[6].rpartition('/')[2]) for line in first} == {
        'tuned/gain': ('1.5', 'tuned.launch:4:31'),
        'tuned/double_': ('2.5', 'tuned.launch:5:34'),
        'tuned/offsets/0': ('0.0', 'tuned.launch:7:17'),
        'tuned/offsets/1': ('10.5', 'tuned.launch:8:17'),
        'tuned/limits/low': ('-1.0', 'more.yaml:1:15'),
        'tuned/limits/is_strict': ('true', 'more.yaml:1:32'),
        'tuned/limits/frame': ('"map"', 'more.yaml:1:45'),
    }
    sends(launched, x=1.5, y=10.5, z=2.5)
    changed = rosslt('set', '/tuned/gain', '2.25')
    assert changed.stdout.split('\t')[:3] == [f'{launched.owner}//tuned/gain', '1.5', '2.25']
    assert changed.stderr == 'rosslt set: it takes effect as `rosslt launch` starts /tuned again\n'
    sends(launched, x=2.25, y=10.5)
    assert rosslt('undo').returncode == 0
    sends(launched, x=1.5, y=10.5)
    assert rosslt('set', '/tuned/~offsets/1', '-3.5').returncode == 0
    sends(launched, x=1.5, y=-3.5)
    assert rosslt('save', '/tune').returncode == 1
    assert lines('save', '/tuned')[0][1:3] == ['10.50', '-3.50']
    assert launched.file.read_text() == launched.said.replace(' 10.50]', ' -3.50]')
    said = launched.log.read_text()
    assert [said.count(f'/tuned is started again: {one}') for one in ('gain is 2.25', 'gain is 1.5')] == [1, 1]
    assert '/tuned is started again: offsets/1 is -3.5' in said
    assert 'REQUIRED' not in said
    running = pid('/tuned')
    launched.process.send_signal(signal.SIGINT)
    assert launched.process.wait(60) == 0
    with pytest.raises(ProcessLookupError):
        os.kill(running, 0)
    assert launched.owner not in str(rosgraph.Master('/test').getSystemState())


def test_dynamic_reconfigure_takes_a_change_at_once(launch):
    launched = launch('quick')
    sends(launched, z=2.5)
    running = pid('/quick')
    assert lines('set', '/quick/double_', '7.5')[0][1:3] == ['2.5', '7.5']
    sends(launched, x=1.5, z=7.5)
    assert failure('set', '/quick/double_', '99').endswith(
        'refuses: /quick/set_parameters makes 10.0 of 99.0; it has 7.5 again'
    )
    sends(launched, z=7.5)
    assert rospy.get_param('/quick/double_') == 7.5
    assert lines('get', '/quick/double_') == [['7.5']]
    assert pid('/quick') == running
    assert rosslt('undo').returncode == 0
    sends(launched, z=2.5)


def test_without_restarts_a_change_that_needs_one_is_refused(launch):
    launched = launch('kept', '', '--no-restart')
    sends(launched, x=1.5, z=2.5)
    running = pid('/kept')
    assert failure('set', '/kept/gain', '2.5').endswith(
        'refuses: /kept reads it at its start, and `rosslt launch --no-restart` does not start it again'
    )
    assert lines('set', '/kept/double_', '4')[0][1:3] == ['2.5', '4.0']
    sends(launched, x=1.5, z=4.0)
    assert rospy.get_param('/kept/gain') == 1.5
    assert pid('/kept') == running


def test_a_node_that_ends_at_its_start_waits_for_a_change(launch):
    launched = launch('ending', 'required="true"')
    sends(launched, x=1.5)
    assert rosslt('set', '/ending/gain', '--', '-1').returncode == 0
    wait_until(lambda: '/ending has ended with exit code 3 since gain is -1.0;' in launched.log.read_text(), 'its end')
    assert rosslt('undo').returncode == 0
    sends(launched, x=1.5)
    assert launched.process.poll() is None


def test_a_respawned_node_runs_once_after_changes(launch):
    launched = launch('back', 'respawn="true" respawn_delay="0.2"')
    sends(launched, x=1.5)
    os.kill(pid('/back'), signal.SIGKILL)
    for gain in (2.0, 3.0, 4.0, 5.0):
        assert rosslt('set', '/back/gain', str(gain)).returncode == 0
    sends(launched, x=5.0)
    command = ['pgrep', '-f', 'cpp_node __name:=back ']
    assert len(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()) == 1


def test_what_others_set_starts_no_node_again(launch):
    launched = launch('left')
    sends(launched, x=1.5)
    running = pid('/left')
    rospy.set_param('/left/gain', 6.5)
    wait_until(lambda: lines('get', '/left/gain') == [['6.5']], 'its value')
    rospy.set_param('/left/offsets', [0.0, 1.0, 2.0])
    wait_until(lambda: rosslt('get', '/left/offsets/2').stdout == '2.0\n', 'a further element')
    assert rosslt('set', '/left/double_', '4').returncode == 0
    sends(launched, x=1.5, z=4.0)
    assert pid('/left') == running


def test_a_node_in_python_that_runs_as_it_is_is_treated_alike(launch):
    launched = launch('plain', '', '--except', 'plain', kind='plain.py')
    sends(launched, x=1.5)
    assert rosslt('set', '/plain/gain', '2.25').returncode == 0
    sends(launched, x=2.25)
    assert '/plain is started again: gain is 2.25' in launched.log.read_text()


def test_a_launch_that_ends_starts_no_node_again(launch):
    launched = launch('slow')
    sends(launched, x=1.5)
    assert rosslt('set', '/slow/gain', '101').returncode == 0
    sends(launched, x=101.0)
    assert rosslt('set', '/slow/gain', '2').returncode == 0
    wait_until(lambda: '/slow is started again: gain is 2.0' in launched.log.read_text(), 'it is being ended')
    launched.process.send_signal(signal.SIGINT)
    assert launched.process.wait(60) == 0
    said = launched.log.read_text()
    assert said.count('started with pid') == 2
    assert 'has ended with exit code' not in said


def test_a_change_of_a_node_that_has_ended_says_so(launch):
    launched = launch('gone', more='<node pkg="cpp_package" type="cpp_node" name="other"/>')
    sends(launched, x=1.5)
    os.kill(pid('/gone'), signal.SIGKILL)
    wait_until(lambda: 'exit code -9' in launched.log.read_text(), 'its end')
    changed = rosslt('set', '/gone/gain', '2')
    assert changed.stderr == 'rosslt set: it has no effect now: /gone has ended, and is not started again\n'
    assert rosslt('save', '/gone').returncode == 0
    assert '<param name="gain" value="2.00"/>\n' in launched.file.read_text()
