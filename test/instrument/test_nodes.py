"""Nodes in the manner of those that people have written: what they publish knows where it comes from, and follows."""

import contextlib
import os
import signal

import pytest
import rosgraph
import rospy
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from std_msgs.msg import Float32, Float64, Float64MultiArray, Int32
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarkerInit, MarkerArray

import rosslt
from rosslt import node, values
from support.packages import launched, package_of_node
from support.processes import node_pid, wait_until
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

MODULE_LOOP = """
import math
import rospy
from geometry_msgs.msg import PointStamped

publisher = rospy.Publisher('loop', PointStamped, queue_size=1)
radius = 2.0
t = 0
rospy.init_node('module_loop')
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = radius * math.cos(t * 0.5) + 1
    p.point.y = radius * 3
    p.point.z = 4
    publisher.publish(p)
    t += 0.1
    rospy.sleep(0.03)
"""

ROBOTS = """
import rospy
from geometry_msgs.msg import PoseStamped
from tf.transformations import quaternion_from_euler

class Robot(object):
    def __init__(self):
        self.x = 1.5
        self.yaw = 0.0

def move(robot, speed, turn):
    robot.x += speed * 0.1
    robot.yaw = robot.yaw + turn

class Simulation(object):
    def __init__(self):
        self.robots = [Robot()]
        self.pub = rospy.Publisher('robots', PoseStamped, queue_size=1)

    def step(self, event):
        for robot in self.robots:
            move(robot, 2.0, 0.0)
            p = PoseStamped()
            p.pose.position.x = robot.x
            q = quaternion_from_euler(0, 0, robot.yaw)
            p.pose.orientation.x, p.pose.orientation.y, p.pose.orientation.z, p.pose.orientation.w = q
            self.pub.publish(p)

rospy.init_node('robots')
simulation = Simulation()
rospy.Timer(rospy.Duration(0.03), simulation.step)
rospy.spin()
"""

FILLED_ONCE = """
import rospy
from geometry_msgs.msg import PoseStamped
import tf

if __name__ == '__main__':
    rospy.init_node('filled_once')
    msg = PoseStamped()
    msg.pose.position.x = rospy.get_param('~x', 1.5)
    msg.pose.position.y = 2.5
    q = tf.transformations.quaternion_from_euler(0, 0, 0.5)
    msg.pose.orientation.x, msg.pose.orientation.y = q[0], q[1]
    msg.pose.orientation.z, msg.pose.orientation.w = q[2], q[3]
    pub = rospy.Publisher('once', PoseStamped, queue_size=1)
    while not rospy.is_shutdown():
        msg.header.seq += 1
        pub.publish(msg)
        rospy.sleep(0.03)
"""

LATCHED = """
import rospy
from std_msgs.msg import Float64
rospy.init_node('latched')
pub = rospy.Publisher('latched', Float64, latch=True, queue_size=1)
pub.publish(2.5)
rospy.spin()
"""

CLASS_AND_TIMER = """
from math import *
import rospy
from std_msgs.msg import Float32, Int32

class Controller(object):
    LIMIT = 3.0

    def __init__(self, gain=2.0):
        self.gain = 0.5
        self.count = 0
        self.offsets = [0.25, 0.75]
        self.pub = rospy.Publisher('~output', Float32, queue_size=10)
        self.ids = rospy.Publisher('~id', Int32, queue_size=10)
        rospy.Timer(rospy.Duration(0.03), self.tick)

    def tick(self, event):
        self.count += 1
        self.pub.publish(self.gain * sqrt(4.0) + self.offsets[self.count % 2])
        self.ids.publish(7)

rospy.init_node('controller')
Controller()
rospy.spin()
"""

PATH = """
import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan

def corners(size):
    points = np.zeros((3, 2))
    points[1, 0] = size
    points[2] = [size, size]
    return points + np.array([0.5, 0.0])

rospy.init_node('path')
pub = rospy.Publisher('path', Path, queue_size=1)
size = 2.0
path = Path()
path.header.frame_id = 'map'
for x, y in corners(size):
    pose = PoseStamped()
    pose.pose.position.x = x
    pose.pose.position.y = y
    path.poses.append(pose)
rate = rospy.Rate(30)
while not rospy.is_shutdown():
    pub.publish(path)
    rate.sleep()
"""

FRAMES = """
import rospy, tf2_ros, tf
from geometry_msgs.msg import TransformStamped
rospy.init_node('frames')
br = tf2_ros.TransformBroadcaster()
old = tf.TransformBroadcaster()
t = TransformStamped()
t.header.frame_id = 'map'
t.child_frame_id = 'new'
t.transform.rotation.w = 1.0
while not rospy.is_shutdown():
    t.header.stamp = rospy.Time.now()
    t.transform.translation.x = 1.25
    br.sendTransform(t)
    turned = tf.transformations.quaternion_from_euler(0, 0, 0.3)
    old.sendTransform((0.5, 0.0, 2.0), turned, rospy.Time.now(), 'old', 'map')
    rospy.sleep(0.03)
"""

MARKERS = """
from interactive_markers.interactive_marker_server import *
from visualization_msgs.msg import *
rospy.init_node('boxes')
server = InteractiveMarkerServer('boxes')
marker = InteractiveMarker()
marker.header.frame_id = 'map'
marker.name = 'box'
marker.pose.position.x = 1.75
server.insert(marker, lambda feedback: None)
server.applyChanges()
rospy.spin()
"""

GROWING = """
import rospy
from visualization_msgs.msg import Marker, MarkerArray
pub = rospy.Publisher('growing', MarkerArray, queue_size=1)
rospy.init_node('growing')
array = MarkerArray()
while not rospy.is_shutdown():
    m = Marker()
    m.scale.x = 0.25
    m.pose.position.x = len(array.markers) * 0.5
    m.pose.orientation.w = 1.0
    array.markers.append(m)
    if len(array.markers) > 5:
        array.markers.pop(0)
    i = 0
    for m in array.markers:
        m.id = i
        i += 1
    pub.publish(array)
    rospy.sleep(0.03)
"""

SERVICE = """
import rospy
from nav_msgs.srv import GetPlan, GetPlanResponse
from geometry_msgs.msg import PoseStamped
height = 1.5
def answer(request):
    response = GetPlanResponse()
    pose = PoseStamped()
    pose.pose.position.x = request.start.pose.position.x + 1.0
    pose.pose.position.z = height
    response.plan.poses.append(pose)
    return response
rospy.init_node('planner')
rospy.Service('make_plan', GetPlan, answer)
rospy.spin()
"""

THREADED = """
import threading
import rospy
from std_msgs.msg import Float64
rospy.init_node('threaded')
pub = rospy.Publisher('threaded', Float64, queue_size=1)
def work():
    speed = 1.5
    while not rospy.is_shutdown():
        pub.publish(data=speed)
        rospy.sleep(0.03)
threading.Thread(target=work).start()
"""


@pytest.fixture
def run(master, tmp_path):
    """`run(code, name)`: the node, running."""
    return lambda code, name, *arguments, **options: Unmodified(tmp_path, name, code.lstrip(), *arguments, **options)


def names_of(name, *options):
    rows = [line.split('\t') for line in command('list', '/' + name, *options).stdout.splitlines()]
    return {row[0].split('/')[-1]: row for row in rows}


def test_a_module_level_loop_with_a_publisher_before_its_node(run):
    with run(MODULE_LOOP, 'module_loop') as talker, Listener('loop', PointStamped) as heard:
        message = heard.next()
        assert all(map(values.is_tracked, (message.point.x, message.point.y, message.point.z)))
        (source,) = node.force_value(message.point.y, 7.5)
        request = rosslt.srv.ListLocationsRequest(location_ids=[source.location_id])
        answers, _ = node.ask_all('list_locations', rosslt.srv.ListLocations, {'/module_loop': request}, 5)
        (one,) = answers['/module_loop'].locations
        assert (one.name, one.rank) == ('radius', 0)  # a named constant, before parts of formulas
        heard.comes(lambda message: message.point.y == 7.5)
        node.force_value(heard.next().point.z, 4.5)
        heard.comes(lambda message: message.point.z == 4.5)
        assert names_of('module_loop')['radius'][2] == '2.5'
        assert talker.stop()[0] == 0


def test_no_parameter_is_written_for_a_literal_before_it_is_changed(run, master):
    with run(MODULE_LOOP, 'loop_2', '__name:=loop_2'), Listener('loop', PointStamped) as heard:
        # rospy's own functions keep to the master that this process has asked first
        parameters = rosgraph.Master('/test', master.uri)
        assert not [name for name in parameters.getParamNames() if name.startswith('/loop_2/rosslt')]
        assert command('set', '/loop_2/radius', '3.5').returncode == 0
        heard.comes(lambda message: message.point.y == 10.5)
        assert parameters.getParam('/loop_2/rosslt/radius') == 3.5
        parameters.setParam('/loop_2/rosslt/radius', 4.0)
        heard.comes(lambda message: message.point.y == 12.0)


def test_literals_have_the_same_identity_after_a_restart(run):
    seen = []
    for _ in range(2):
        with run(MODULE_LOOP, 'module_loop'), Listener('loop', PointStamped) as heard:
            # Of x, the first messages have more sources than later ones: its shape as well.
            seen.append(values.sources(heard.next().point.y))
    assert len(seen[0]) == 2
    assert set(seen[0]) == set(seen[1])


def test_a_message_that_was_filled_once_follows_its_sources(run):
    with run(FILLED_ONCE, 'filled_once'), Listener('once', PoseStamped) as heard:
        message = heard.next()
        node.force_value(message.pose.position.x, -3.5)
        node.force_value(message.pose.position.y, 4.5)
        turned = heard.comes(lambda m: (m.pose.position.x, m.pose.position.y) == (-3.5, 4.5)).pose.orientation
        node.force_value([turned.z, turned.w], [0.8, 0.6])
        heard.comes(lambda m: abs(m.pose.orientation.z - 0.8) < 1e-9 and abs(m.pose.orientation.w - 0.6) < 1e-9)


def test_a_state_in_an_object_that_a_function_is_handed_has_its_start_as_a_source_alone(run):
    with run(ROBOTS, 'robots'), Listener('robots', PoseStamped) as heard:
        message = heard.next()
        (start,) = node.force_value(message.pose.position.x, message.pose.position.x + 50.0)
        heard.comes(lambda m: m.pose.position.x > 50.0 and values.sources(m.pose.position.x) == [start])


def test_a_turn_about_one_axis_can_be_tilted_where_its_angle_is_a_state(run):
    with run(ROBOTS, 'robots'), Listener('robots', PoseStamped) as heard:
        node.force_value(heard.next().pose.orientation.x, 0.25)
        heard.comes(lambda m: abs(m.pose.orientation.x - 0.25) < 1e-9 and m.pose.orientation.y == 0.0)


@pytest.mark.parametrize(('name', 'code'), [('latched', LATCHED), ('threaded', THREADED)])
def test_a_latched_message_is_sent_again_and_a_thread_publishes_by_keywords(run, name, code):
    with run(code, name), Listener(name, Float64) as heard:
        node.force_value(heard.last.data, 6.5)
        heard.comes(lambda message: message.data == 6.5)


def test_a_class_with_a_timer_and_the_names_of_math(run):
    with run(CLASS_AND_TIMER, 'controller'), Listener('/controller/output', Float32) as heard, Listener(
        '/controller/id', Int32
    ) as ids:
        node.force_value(heard.next().data, 9.0)
        heard.comes(lambda message: message.data == 9.0)
        node.force_value(ids.next().data, 8)
        ids.comes(lambda message: message.data == 8)
        with pytest.raises(rosslt.Error):
            node.force_value(ids.next().data, 8.5)
        (identifier,) = [name for name, columns in names_of('controller').items() if columns[2] == '8']
        assert command('set', '/controller/' + identifier, '8.5').returncode == 1
        assert ids.next().data == 8


def test_points_from_numpy_arrays_follow(run):
    with run(PATH, 'path'), Listener('path', Path) as heard:
        pose = heard.next().poses[2].pose
        assert values.is_tracked(pose.position.x)
        node.force_value([pose.position.x, pose.position.y], [4.0, 3.0])
        moved = heard.comes(lambda m: m.poses[2].pose.position.x == pytest.approx(4.0))
        assert moved.poses[2].pose.position.y == pytest.approx(3.0)
        assert moved.poses[1].pose.position.x == pytest.approx(4.0)


def test_frames_of_both_broadcasters_follow(run):
    seen = {}

    def take(message):
        seen.update((transform.child_frame_id, transform.transform) for transform in message.transforms)

    subscriber = rosslt.Subscriber('/tf', TFMessage, take, keep_provenance=True)
    with run(FRAMES, 'frames'):
        wait_until(lambda: {'old', 'new'} <= set(seen), 'both frames come')
        node.force_value(seen['new'].translation.x, 2.0)
        node.force_value(seen['old'].translation.z, 3.0)
        wait_until(lambda: seen['new'].translation.x == 2.0 and seen['old'].translation.z == 3.0, 'they follow')
        assert values.is_tracked(seen['old'].rotation.z)
    subscriber.unregister()


def test_an_interactive_marker_server_keeps_provenance(run):
    with run(MARKERS, 'boxes'), Listener('/boxes/update_full', InteractiveMarkerInit) as heard:
        # the first that is latched has no markers yet
        position = heard.comes(lambda message: message.markers).markers[0].pose.position
        assert position.x == 1.75
        assert values.is_tracked(position.x)


def test_an_array_that_grows_stays_small_in_its_provenance(run):
    with run(GROWING, 'growing'), Listener('growing', MarkerArray) as heard:
        message = heard.comes(lambda m: len(m.markers) == 5 and values.is_tracked(m))
        assert [marker.id for marker in message.markers] == [0, 1, 2, 3, 4]
        assert len(values.sources(message)) <= 6
        node.force_value(message.markers[2].scale.x, 0.75)
        heard.comes(lambda m: [marker.scale.x for marker in m.markers] == [0.75] * 5)


def test_a_service_answers_with_present_values(run):
    with run(SERVICE, 'planner'):
        rospy.wait_for_service('make_plan', 30)
        ask = rosslt.ServiceProxy('make_plan', GetPlan)
        start = PoseStamped()
        start.pose.position.x = 2.0
        place = ask(start, PoseStamped(), 0.0).plan.poses[0].pose.position
        assert (place.x, place.z) == (3.0, 1.5)
        node.force_value(place.z, 2.5)
        assert ask(start, PoseStamped(), 0.0).plan.poses[0].pose.position.z == 2.5


@pytest.fixture
def launched_nodes(tmp_path):
    """A package with a node; the environment in which it is found."""
    code = LATCHED.replace("'latched', Float64", "'launched', Float64")
    return package_of_node(tmp_path, 'launched_nodes', 'talker.py', code)


def test_a_launch_file_runs_its_nodes_tracked(run, tmp_path, launched_nodes):
    file = tmp_path / 'all.launch'
    file.write_text(
        '<launch><arg name="name"/><node pkg="launched_nodes" type="talker.py" name="$(arg name)"/>'
        '<node pkg="launched_nodes" type="talker.py" name="other"/></launch>'
    )
    words = ['rosslt', 'launch', '--no-markers', str(file), '--except', 'other', 'name:=one']
    with launched(launched_nodes, *words):
        wait_until(lambda: names_of('one'), 'the node is tracked', 60)
        assert command('list', '/other').returncode != 0


def test_a_launch_file_that_names_no_package_says_so(tmp_path):
    file = tmp_path / 'all.launch'
    file.write_text('<launch><include file="$(find no_such_package)/x.launch"/></launch>')
    found = command('launch', str(file))
    assert found.returncode == 1
    assert 'package no_such_package was not found; looked in /' in found.stderr


def test_two_launch_files_are_refused_in_words(tmp_path):
    files = [tmp_path / name for name in ('one.launch', 'two.launch')]
    for file in files:
        file.write_text('<launch/>')
    found = command('launch', *map(str, files))
    assert found.returncode == 1
    assert f'one launch file at a time, or a package and a file of it: {files[0]}, {files[1]}' in found.stderr


def test_interactive_markers_run_beside_a_launch_file(run, tmp_path, launched_nodes):
    file = tmp_path / 'one.launch'
    file.write_text('<launch><node pkg="launched_nodes" type="talker.py" name="alone"/></launch>')

    def pid():
        with contextlib.suppress(rosgraph.MasterError, OSError):
            return node_pid(rosgraph.Master('/test').lookupNode('/slt_visualization'))

    with launched(launched_nodes, 'rosslt', 'launch', str(file)):
        first = wait_until(pid, 'slt_visualization is started, too', 60)
        wait_until(lambda: names_of('alone'), 'the node is tracked', 60)
        os.kill(first, signal.SIGKILL)
        wait_until(lambda: pid() not in (None, first), 'it is started again', 60)


def test_a_launch_prefix_tracks_one_node(run, tmp_path, launched_nodes):
    file = tmp_path / 'prefix.launch'
    file.write_text(
        '<launch><node pkg="launched_nodes" type="talker.py" name="prefixed" launch-prefix="rosslt run"/></launch>'
    )
    with launched(launched_nodes, 'roslaunch', str(file)):
        wait_until(lambda: names_of('prefixed'), 'the node is tracked', 60)


TRANSFORMED = """
import rospy, tf2_ros, tf2_geometry_msgs
from geometry_msgs.msg import PointStamped, TransformStamped
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker

rospy.init_node('transformed')
server = InteractiveMarkerServer('handles')
marker = InteractiveMarker()
marker.name, marker.scale = 'a', 0.75
server.insert(marker, lambda feedback: None)
server.applyChanges()
pub = rospy.Publisher('tip', PointStamped, queue_size=1)
frame = TransformStamped()
frame.transform.rotation.w = 1.0
frame.transform.translation.y = 0.5
while not rospy.is_shutdown():
    point = PointStamped()
    point.point.x = 1.25
    pub.publish(tf2_geometry_msgs.do_transform_point(point, frame))
    rospy.sleep(0.03)
"""


def test_a_point_in_another_frame_keeps_its_sources(run):
    with run(TRANSFORMED, 'transformed'), Listener('tip', PointStamped) as heard:
        node.force_value(heard.next().point.x, 2.0)
        node.force_value(heard.next().point.y, -1.0)
        heard.comes(lambda message: (message.point.x, message.point.y) == (2.0, -1.0))
        with Listener('/handles/update_full', InteractiveMarkerInit) as shown:
            assert values.is_tracked(shown.last.markers[0].scale)


WAVE = """
import math
import rospy
from geometry_msgs.msg import PointStamped
pub = rospy.Publisher('wave', PointStamped, queue_size=1)
rospy.init_node('wave')
count = 0
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = math.cos(count / 50.0)
    p.point.y = 2.5 * math.cos(count / 40.0)
    pub.publish(p)
    count += 1
    rospy.sleep(0.03)
"""


def test_what_gives_a_formula_its_shape_is_tracked_where_nothing_else_is(run):
    with run(WAVE, 'wave'), Listener('wave', PointStamped) as heard:
        for _ in range(10):
            point = heard.next().point
        assert values.is_tracked(point.x)
        assert len(values.sources(point.y)) == 1
        names = names_of('wave', '--all')
        assert {columns[2] for columns in names.values()} == {'50.0', '2.5', '40.0', '1'}


WHOLE_PARAMETERS = """
import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('whole')
x, y = rospy.get_param('~x'), float(rospy.get_param('~y'))
n = rospy.get_param('~n')
msg = PointStamped()
msg.point.x = x
msg.point.y = y
msg.point.z = 5.0 / n
pub = rospy.Publisher('whole', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    msg.header.frame_id = repr([rospy.get_param('~n') for i in range(n)])
    pub.publish(msg)
    rospy.sleep(0.03)
"""


def test_a_parameter_that_says_3_where_a_float_is_meant_takes_fractions(run):
    arguments = '_x:=3', '_y:=4', '_n:=2'
    with run(WHOLE_PARAMETERS, 'whole', *arguments), Listener('whole', PointStamped) as heard:
        heard.next()
        node.force_value(heard.next().point.x, 3.25)
        node.force_value(heard.next().point.y, 4.5)
        message = heard.comes(lambda message: (message.point.x, message.point.y) == (3.25, 4.5))
        assert rosgraph.Master('/test').getParam('/whole/x') == 3.25
        assert message.header.frame_id == '[2, 2]'
        node.force_value(message.point.z, 1.25)
        heard.comes(lambda message: message.point.z == 1.25)


WAVES = """
import math
import rospy
from std_msgs.msg import Float64MultiArray
pub = rospy.Publisher('waves', Float64MultiArray, queue_size=1)
rospy.init_node('waves')
count = 0
array = Float64MultiArray()
while not rospy.is_shutdown():
    array.data.append(math.cos(count / 50.0))
    del array.data[:-100]
    pub.publish(array)
    count += 1
    rospy.sleep(0.02)
"""


def test_very_many_leaves_of_shapes_alone_stay_tracked(run):
    with run(WAVES, 'waves'), Listener('waves', Float64MultiArray) as heard:
        heard.comes(lambda message: message.data and values.is_tracked(message.data[0]))
        heard.comes(lambda message: len(message.data) == 100 and sum(map(values.is_tracked, message.data)) >= 95)


FILTERED = """
import message_filters, rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('filtered')
pub = rospy.Publisher('sum', PointStamped, queue_size=1)
def both(a, b):
    total = PointStamped(header=a.header)
    total.point.x = a.point.x + b.point.x
    pub.publish(total)
parts = [message_filters.Subscriber(name, PointStamped) for name in ('left', 'right')]
message_filters.TimeSynchronizer(parts, 10).registerCallback(both)
left = rospy.Publisher('left', PointStamped, queue_size=1)
right = rospy.Publisher('right', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    point = PointStamped()
    point.header.stamp = rospy.Time.now()
    point.point.x = 1.5
    left.publish(point)
    point.point.x = 2.25
    right.publish(point)
    rospy.sleep(0.03)
"""


def test_synchronized_messages_keep_their_sources(run):
    with run(FILTERED, 'filtered'), Listener('sum', PointStamped) as heard:
        message = heard.next()
        assert message.point.x == 3.75
        assert len(values.sources(message.point.x)) == 2
        node.force_value(message.point.x, 5.0)
        heard.comes(lambda message: message.point.x == 5.0)


NO_QUEUE_SIZE = """
import rospy, sys, traceback
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
rospy.init_node('no_queue_size')
pub = rospy.Publisher('no_queue_size', Float64)
def handle(request):
    raise ValueError('not now')
def report(error, kind, value, tb):
    print(traceback.extract_tb(tb)[-1].name, flush=True)
rospy.Service('no_queue_size/go', Trigger, handle, error_handler=report)
try:
    rospy.ServiceProxy('no_queue_size/go', Trigger)()
except rospy.ServiceException as error:
    print(error)
print(pub.impl.queue_size, flush=True)
"""


def test_warnings_and_tracebacks_name_the_lines_that_they_name_without_it(master, tmp_path):
    said = {}
    for tracked in (False, True):
        with Unmodified(tmp_path, 'no_queue_size', NO_QUEUE_SIZE, tracked=tracked) as program:
            said[tracked] = program.end()
    assert said[True] == said[False]
    code, output, errors = said[True]
    assert code == 0
    assert output.splitlines()[0] == 'handle'
    assert 'no_queue_size.py:6: SyntaxWarning' in errors
