"""Calls of functions of compiled libraries in an unmodified node are recorded, and their objects keep provenance."""

import numpy
import pytest
from geometry_msgs.msg import Point, Pose, PoseArray
from scipy.spatial.transform import Rotation

from rosslt import values
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

CAMERA = """
import rospy
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from scipy.spatial.transform import Rotation as R
from scipy.spatial.transform import Slerp

YAW = 0.4
TILT = 0.3
REACH = 1.7
MOUNT = R.from_euler('zyx', [YAW, TILT, 0.0])

rospy.init_node('camera')
poses = rospy.Publisher('camera', Pose, queue_size=1)
paths = rospy.Publisher('path', PoseArray, queue_size=1)
path = PoseArray(poses=[Pose()])
while not rospy.is_shutdown():
    seen = MOUNT.apply([REACH, 0.0, 0.0]) + R.from_rotvec([0.0, 0.0, 0.5]).inv().apply([0.0, REACH, 0.0])
    turned = MOUNT * R.from_euler('z', 0.2).inv()
    assert isinstance(turned, R) and type(turned) is R
    poses.publish(Point(*seen), Quaternion(*turned.as_quat()))
    between = Slerp([0.0, 2.0], R.concatenate([R.identity(), MOUNT]))(0.5)
    path.poses[0].orientation = Quaternion(*between.as_quat())
    path.poses[0].position.x = between.magnitude()
    paths.publish(path)
    rospy.sleep(0.03)
"""


def leaves(message):
    return [leaf for _, leaf in values.leaves(message)]


@pytest.fixture(scope='module')
def camera(master, tmp_path_factory):
    with Unmodified(tmp_path_factory.mktemp('camera'), 'camera', CAMERA.lstrip()) as started:
        yield started


def test_the_messages_are_those_of_the_plain_node(master, tmp_path):
    seen = []
    for tracked in (False, True):
        started = Unmodified(tmp_path, 'camera', CAMERA.lstrip(), tracked=tracked)
        with started, Listener('camera', Pose) as pose, Listener('path', PoseArray) as path:
            seen.append(values.untracked([leaves(pose.last), leaves(path.last.poses)]))
    assert seen[0] == seen[1]


def test_what_rotations_give_is_tracked(camera):
    with Listener('camera', Pose) as heard:
        assert all(map(values.is_tracked, leaves(heard.last)))
    with Listener('path', PoseArray) as heard:
        pose = heard.last.poses[0]
        assert values.is_tracked(pose.position.x)
        assert all(map(values.is_tracked, leaves(pose.orientation)))


def test_a_rotation_of_the_set_up_follows_a_change(camera):
    assert '[YAW, camera.py:6:7]' in command('explain', '/camera/position/y').stdout
    with Listener('camera', Pose) as heard:
        before = heard.last.position.y
        assert command('set', '/camera/YAW', '0.9').returncode == 0
        heard.comes(lambda message: message.position.y > before + 0.3)
        assert command('reset', '/camera/YAW').returncode == 0
        heard.comes(lambda message: message.position.y == before)


def test_a_field_is_forced(camera):
    with Listener('path', PoseArray) as heard:
        result = command('force', '/path/poses[0]/position/x', '0.1')
        assert result.returncode == 0, result.stderr
        heard.comes(lambda message: abs(message.poses[0].position.x - 0.1) < 1e-9)
        assert command('undo', '/camera').returncode == 0


SCALE = """
import PyKDL
import rospy
import scipy.spatial
from scipy.spatial import distance
from geometry_msgs.msg import Point

rospy.init_node('scale')
points = rospy.Publisher('scale', Point, queue_size=1)
part = 0.4
while not rospy.is_shutdown():
    ends = [part, 0.5], [0.1, 1.5]
    nearest = scipy.spatial.distance.euclidean(*ends)
    points.publish(nearest, distance.chebyshev(*ends), PyKDL.Vector(part, 0, 0).x())
    rospy.sleep(0.03)
"""


def test_functions_are_named_on_the_command_line(master, tmp_path):
    names = 'scipy.spatial.distance.euclidean', 'scipy.spatial.distance.none', 'PyKDL.Vector'
    options = [f'--pure={name}' for name in names]
    with Unmodified(tmp_path, 'scale', SCALE.lstrip(), options=options) as started, Listener('scale', Point) as heard:
        assert [values.is_tracked(leaf) for leaf in leaves(heard.last)] == [True, False, False]
        _, _, errors = started.stop()
    wrong = [line for line in errors.splitlines() if line.startswith('rosslt run:')]
    assert wrong == [
        'rosslt run: PyKDL.Vector keeps no provenance: its objects cannot be given other numbers',
        'rosslt run: scipy.spatial.distance.none keeps no provenance: there is no such name',
    ]


def test_a_node_without_such_libraries_loads_nothing_for_them(tmp_path):
    names = ('scipy', 'rosslt.values.arrays')
    code = f'import math, sys\nprint([name for name in {names} if name in sys.modules])\n'
    assert Unmodified(tmp_path, 'bare', code).end() == (0, '[]\n', '')


def test_a_name_without_a_module_is_refused():
    result = command('run', '--pure', 'euclidean', 'scale.py')
    assert result.returncode == 2
    assert "'euclidean' is not the name of a function or class in a module" in result.stderr


DRAWING = """
import numpy
import rosslt
from scipy.spatial.transform import Rotation

numpy.random.seed(1)
made = Rotation.random(rosslt.track(2, rosslt.Source('/node', 1)))
rosslt.sources(made.as_quat()[0, 0])
print(made.as_quat()[1, 1], numpy.random.rand())
"""


def test_random_rotations_are_drawn_once(tmp_path):
    numpy.random.seed(1)
    printed = f'{Rotation.random(2).as_quat()[1, 1]} {numpy.random.rand()}\n'
    assert Unmodified(tmp_path, 'drawing', DRAWING.lstrip()).end() == (0, printed, '')
