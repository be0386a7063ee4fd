"""The numbers of a robot that a launch file loads from its URDF are locations, and a change of them reaches the nodes
that have read it."""

import contextlib
import signal
import subprocess
from types import SimpleNamespace

import pytest
import rosgraph
import rospy
from tf2_msgs.msg import TFMessage

from rosslt import node
from rosslt.instrument.launched_robots import LaunchedRobot, is_reader
from support import saving
from support.processes import node_pid, wait_until
from support.shell import failure, lines
from support.shell import rosslt as command

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <!-- <joint name="camera_joint"><origin xyz="9 9 9"/></joint> -->
  <link name="base"/>
  <link name="camera">
    <visual><origin xyz="0 0 0.05"/><geometry><box size="0.05 0.05 0.20"/></geometry></visual>
  </link>
  <joint name="camera_joint" type="fixed">
    <parent link="base"/><child link="camera"/>
    <origin xyz="0.10 0 0.50"
            rpy="0 0 0"/>
  </joint>
</robot>
"""
PUBLISHER = '<node pkg="robot_state_publisher" type="robot_state_publisher" name="publisher"/>'


@pytest.fixture
def launch(master, tmp_path):
    """Starts a launch file with this robot: called with what is in it, the text of the URDF, and options."""
    file, log, urdf = tmp_path / 'robot.launch', tmp_path / 'robot.log', tmp_path / 'arm.urdf'
    with contextlib.ExitStack() as stack:

        def start(*options, inside=PUBLISHER, said=URDF, given='textfile="$(dirname)/arm.urdf"', where=''):
            urdf.write_bytes(said if isinstance(said, bytes) else said.encode())
            file.write_text(f'<launch>{where}<param name="robot_description" {given}/>{inside}</launch>')
            words = ['rosslt', 'launch', '--no-markers', *options, str(file)]
            with log.open('w') as printed:
                process = subprocess.Popen(words, stdout=printed, stderr=printed)
            stack.callback(forget)
            stack.callback(process.wait, 60)
            stack.callback(process.send_signal, signal.SIGINT)
            return SimpleNamespace(urdf=urdf, log=log, process=process, file=file)

        yield start


def forget():
    for name in rospy.get_param_names():
        if name.endswith('robot_description'):
            rospy.delete_param(name)


def locations(name='/robot_description'):
    wait_until(lambda: command('list', name).returncode == 0, 'its numbers')
    return lines('list', name)


def camera(x, y, z, child='camera'):
    """Wait until /tf_static has the camera there."""
    found = []
    subscriber = rospy.Subscriber('/tf_static', TFMessage, lambda message: found.extend(message.transforms))

    def is_there():
        places = [one.transform.translation for one in list(found) if one.child_frame_id == child]
        return places and (places[-1].x, places[-1].y, places[-1].z) == (x, y, z)

    wait_until(is_there, f'the camera at {x}, {y}, {z}', 60)
    subscriber.unregister()


def pid(name='/publisher'):
    return node_pid(rosgraph.Master('/test').lookupNode(name))


def test_the_place_of_a_fixed_joint_is_changed_and_saved(launch):
    launched = launch()
    first = {line[0].split('//')[1]: (line[2], line[6].rpartition('/')[2]) for line in locations()}
    assert {name: one for name, one in first.items() if '/xyz/' in name} == {
        'robot_description/camera/visual/xyz/0': ('0.0', 'arm.urdf:6:26'),
        'robot_description/camera/visual/xyz/1': ('0.0', 'arm.urdf:6:28'),
        'robot_description/camera/visual/xyz/2': ('0.05', 'arm.urdf:6:30'),
        'robot_description/camera_joint/xyz/0': ('0.1', 'arm.urdf:10:18'),
        'robot_description/camera_joint/xyz/1': ('0.0', 'arm.urdf:10:23'),
        'robot_description/camera_joint/xyz/2': ('0.5', 'arm.urdf:10:25'),
    }
    assert len(first) == 12
    camera(0.1, 0, 0.5)
    changed = command('set', '/robot_description/camera_joint/xyz/0', '0.25')
    assert changed.stdout.split('\t')[1:3] == ['0.1', '0.25']
    assert changed.stderr == 'rosslt set: it takes effect as `rosslt launch` starts /publisher again\n'
    camera(0.25, 0, 0.5)
    assert rospy.get_param('robot_description') == URDF.replace('xyz="0.10 0 0.50"', 'xyz="0.25 0 0.50"')
    assert '/publisher is started again: camera_joint/xyz/0 is 0.25' in launched.log.read_text()
    diff = command('save', '/robot_description', '--diff').stdout
    assert '-    <origin xyz="0.10 0 0.50"\n+    <origin xyz="0.25 0 0.50"\n' in diff
    assert launched.urdf.read_text() == URDF
    assert lines('save', '/robot_description')[0][1:3] == ['0.10', '0.25']
    assert launched.urdf.read_text() == URDF.replace('"0.10 0 0.50"', '"0.25 0 0.50"')
    assert command('undo').returncode == 0
    camera(0.1, 0, 0.5)
    assert lines('save', '/robot_description')[0][1:3] == ['0.25', '0.10']
    assert launched.urdf.read_text() == URDF


def change(**values):
    """Change numbers of the robot at once."""
    (owner,) = {line[0].split('//')[0] for line in locations()}
    found, _ = node.Directory().ask([owner])
    ids = {one.location.name: one.location.id for one in found[owner]}
    wanted = {f'/robot_description/camera_joint/{name[:-1]}/{name[-1]}': value for name, value in values.items()}
    saving.change(owner, {ids[name]: value for name, value in wanted.items()})


def test_several_numbers_are_one_text_and_one_start(launch):
    launched = launch()
    camera(0.1, 0, 0.5)
    change(xyz0=1.0, xyz1=2.0, rpy2=0.25)
    camera(1, 2, 0.5)
    assert rospy.get_param('robot_description') == URDF.replace(
        'xyz="0.10 0 0.50"\n            rpy="0 0 0"', 'xyz="1.00 2 0.50"\n            rpy="0 0 0.25"'
    )
    assert launched.log.read_text().count('is started again') == 1
    assert len(lines('save', '/robot_description')) == 3
    assert launched.urdf.read_text() == rospy.get_param('robot_description')


def test_after_changes_one_node_publishes_the_frames(launch):
    launched = launch()
    camera(0.1, 0, 0.5)
    locations()
    first = pid()
    for index in range(1, 4):
        assert command('set', '/robot_description/camera_joint/xyz/2', str(index)).returncode == 0
    camera(0.1, 0, 3)
    assert pid() != first
    words = ['pgrep', '--parent', str(launched.process.pid), '-f', 'robot_state_publisher __name:=publisher ']
    assert len(subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()) == 1


def test_without_restarts_only_what_nobody_has_read_is_changed(launch):
    launched = launch('--no-restart')
    camera(0.1, 0, 0.5)
    locations()
    running = pid()
    assert failure('set', '/robot_description/camera_joint/xyz/0', '0.25').endswith(
        'refuses: /publisher reads it at its start, and `rosslt launch --no-restart` does not start it again'
    )
    assert rospy.get_param('robot_description') == URDF
    shown = command('set', '/robot_description/camera/visual/size/2', '0.25')
    assert shown.stderr == 'rosslt set: it takes effect as nodes, or RViz, read /robot_description again\n'
    assert rospy.get_param('robot_description') == URDF.replace('0.20', '0.25')
    assert pid() == running
    assert 'is started again' not in launched.log.read_text()


def test_a_text_that_somebody_else_sets_is_the_one_that_is_changed(launch):
    launch()
    camera(0.1, 0, 0.5)
    locations()
    theirs = URDF.replace('<link name="base"/>', '<!-- ours --><link name="base"/>')
    theirs = theirs.replace('0.10 0 0.50', '0.10 0 0.75').replace(
        '<box size="0.05 0.05 0.20"/>', '<sphere radius="1"/>'
    )
    rospy.set_param('robot_description', theirs)
    name = '/robot_description/camera_joint/xyz/'
    wait_until(lambda: command('get', name + '2').stdout == '0.75\n', 'their number')
    assert 'size' not in command('list', '/robot_description').stdout
    assert command('set', name + '0', '0.25').returncode == 0
    camera(0.25, 0, 0.75)
    assert rospy.get_param('robot_description') == theirs.replace('0.10 0', '0.25 0')
    rospy.set_param('robot_description', '<robot')
    wait_until(lambda: command('get', name + '2').returncode != 0, 'it is gone')
    assert command('set', name + '0', '0.5').returncode != 0
    assert rospy.get_param('robot_description') == '<robot'


@pytest.mark.parametrize('theirs', [[1, 2], {'x': 1}], ids=['list', 'dict'])
def test_what_is_no_text_has_no_numbers(launch, theirs):
    launched = launch(inside='<param name="left/robot_description" textfile="$(dirname)/arm.urdf"/>' + PUBLISHER)
    name = '/robot_description/camera_joint/xyz/0'
    others = [line[0] for line in locations('/left/robot_description')]
    locations()
    rospy.set_param('robot_description', theirs)
    wait_until(lambda: command('get', name).returncode != 0, 'it is gone')
    (owner,) = {one.split('//')[0] for one in others}
    assert [line[0] for line in lines('list') if line[0].split('//')[0] == owner] == others
    rospy.delete_param('robot_description')
    rospy.set_param('robot_description', URDF)
    wait_until(lambda: command('get', name).stdout == '0.1\n', 'it is there again')
    assert 'Traceback' not in launched.log.read_text()


def test_a_file_that_was_edited_at_this_number_is_left(launch):
    launched = launch()
    locations()
    assert command('set', '/robot_description/camera_joint/xyz/0', '0.25').returncode == 0
    edited = URDF.replace('"0.10 0 0.50"', '"0.15 0 0.50"')
    launched.urdf.write_text(edited)
    why = f'it was edited since it was loaded: {launched.urdf} says 0.15 instead of 0.1'
    assert why in failure('save', '/robot_description')
    assert launched.urdf.read_text() == edited


def test_two_robots_of_one_file_are_told_apart(launch):
    inside = ''.join(
        f'<group ns="{side}"><param name="robot_description" command="cat $(dirname)/arm.urdf"/>'
        f'{PUBLISHER.replace("/>", "")}><param name="tf_prefix" value="{side}"/></node></group>'
        for side in ('left', 'right')
    )
    launched = launch(inside=inside)
    camera(0.1, 0, 0.5, 'left/camera')
    locations('/left/robot_description')
    locations('/right/robot_description')
    running = pid('/right/publisher')
    assert command('set', '/left/robot_description/camera_joint/xyz/0', '0.25').returncode == 0
    camera(0.25, 0, 0.5, 'left/camera')
    assert pid('/right/publisher') == running
    said = failure('save', '/left/robot_description')
    assert f'{launched.urdf} says it for /robot_description as well, which is 0.1' in said
    assert launched.urdf.read_text() == URDF
    for robot in ('/robot_description', '/right/robot_description'):
        assert command('set', f'{robot}/camera_joint/xyz/0', '0.25').returncode == 0
    wait_until(lambda: command('save', '/left/robot_description').returncode == 0, 'all have the number')
    assert launched.urdf.read_text() == URDF.replace('0.10 0', '0.25 0')


def test_a_publisher_does_not_read_a_robot_below_its_name(launch):
    own = '<param name="robot_description" command="sed s/0.10/0.30/ $(dirname)/arm.urdf"/>'
    launch(inside=PUBLISHER.replace('/>', f'>{own}</node>'))
    camera(0.1, 0, 0.5)
    locations()
    changed = command('set', '/robot_description/camera_joint/xyz/0', '0.25')
    assert changed.stderr == 'rosslt set: it takes effect as `rosslt launch` starts /publisher again\n'
    camera(0.25, 0, 0.5)


@pytest.mark.parametrize(
    ('said', 'given', 'reason'),
    [
        (URDF[:-10], 'textfile="$(dirname)/arm.urdf"', 'it is no XML: no element found'),
        (URDF.replace('?>', ' encoding="latin-1"?>'), 'textfile="$(dirname)/arm.urdf"', 'its encoding is latin-1'),
        (URDF, 'command="sed s/0.10/0.30/ $(dirname)/arm.urdf"', 'its command is no `cat FILE` or `xacro FILE`'),
    ],
    ids=['no XML', 'encoding', 'command'],
)
def test_what_cannot_be_changed_says_why(launch, said, given, reason):
    launched = launch(said=said, given=given, inside='')
    told = f'the numbers of /robot_description cannot be changed: {reason}'
    wait_until(lambda: told in launched.log.read_text(), reason)
    assert launched.process.poll() is None


@pytest.mark.parametrize(
    ('kind', 'namespace', 'remapped', 'expected'),
    [
        ('robot_state_publisher', '/', [], '/robot_description'),
        ('robot_state_publisher', '/left/', [], '/left/robot_description'),
        ('state_publisher', '/right/', [], '/robot_description'),
        ('joint_state_publisher', '/', [('robot_description', 'arm')], '/arm'),
        ('joint_state_publisher_gui', '/left/', [('/left/robot_description', '/arm')], '/arm'),
        ('robot_state_publisher', '/up/', [], '/robot_description'),
        ('joint_state_publisher', '/up/', [], '/up/reader/robot_description'),
        ('talker', '/', [], None),
    ],
)
def test_a_node_reads_the_robot_that_is_nearest(kind, namespace, remapped, expected):
    parameters = dict.fromkeys(
        ['/robot_description', '/left/robot_description', '/arm', '/right/rate', '/up/reader/robot_description']
    )
    one = SimpleNamespace(type=kind, namespace=namespace, name='reader', remap_args=remapped)
    assert [name for name in parameters if is_reader(one, name, parameters)] == ([expected] if expected else [])


def test_a_joint_starts_only_those_that_read_what_has_changed():
    robot = LaunchedRobot(
        '/arm', [(Reader('/state'), 'state_publisher'), (Reader('/gui'), 'joint_state_publisher_gui')], True
    )
    started = 'takes effect as `rosslt launch` starts {} again'
    assert robot.effect('/arm/elbow/rpy/2') == started.format('/state')
    assert robot.effect('/arm/elbow/limit/upper') == started.format('/gui')
    assert robot.effect('/arm/elbow/visual/xyz/0') == 'takes effect as nodes, or RViz, read /arm again'


class Reader:
    def __init__(self, name):
        self.name = name

    def effect_of_start(self):
        return ''
