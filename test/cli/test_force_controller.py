"""`rosslt force` on the command of a plain controller, whose robot follows: what the robot does is what counts."""

import contextlib
import re

import pytest
import rosgraph

from support.processes import wait_until
from support.shell import failure, lines, rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

CONTROLLER = """
import rospy
from geometry_msgs.msg import Point, Twist


class Controller:
    def __init__(self):
        self.kp = rospy.get_param('~kp', 1.25)
        self.goal_x = rospy.get_param('~goal_x', 4.0)
        self.command = rospy.Publisher('cmd_vel', Twist, queue_size=10)
        rospy.Subscriber('place', Point, self.take)

    def take(self, pose):
        twist = Twist()
        twist.linear.x = self.kp * (self.goal_x - pose.x)
        twist.linear.y = self.kp * (1.0 - pose.y)
        self.command.publish(twist)


rospy.init_node('controller')
controller = Controller()
rospy.spin()
"""

# It takes a step for the last command since its last step, and waits for one: no two commands come from one place while
# it moves, however slow the machine is. What is too slow for it does not move it. It writes down where it has been.
ROBOT = """
import sys

import rospy
from geometry_msgs.msg import Point, Twist


def step(speed):
    return 0.05 * speed if abs(speed) > 0.01 else 0.0


rospy.init_node('robot')
place, way, rate = Point(), open(sys.argv[1], 'w', buffering=1), rospy.Rate(50)
poses = rospy.Publisher('place', Point, queue_size=10)
commands = []
rospy.Subscriber('cmd_vel', Twist, commands.append)
while not rospy.is_shutdown():
    if commands:
        speed = commands[-1].linear
        del commands[:]
        place.x, place.y = place.x + step(speed.x), place.y + step(speed.y)
        way.write('{} {}\\n'.format(place.x, place.y))
        poses.publish(place)
    elif not place.x:
        poses.publish(place)
    rate.sleep()
"""


class Way:
    """Where the robot has been: [(x, y), ...]."""

    def __init__(self, file):
        self._file = file
        self.begin = 0

    @property
    def places(self):
        text = self._file.read_text(encoding='utf-8') if self._file.exists() else ''
        return [tuple(map(float, line.split())) for line in text.splitlines(keepends=True) if line[-1] == '\n'][
            self.begin :
        ]

    def is_at_goal(self):
        (*_, before, last) = [(0.0, 0.0), (0.0, 0.0), *self.places]
        return before == last and abs(last[0] - 4.0) < 0.01 and abs(last[1] - 1.0) < 0.01


@pytest.fixture
def way(tmp_path, master):
    """The way of a robot, while a controller drives it."""
    file = tmp_path / 'way.txt'
    programs = [
        Unmodified(tmp_path, 'controller', CONTROLLER),
        Unmodified(tmp_path, 'robot', ROBOT, str(file), tracked=False),
    ]
    try:
        made = Way(file)
        wait_until(lambda: made.places, 'the robot has a place')
        yield made
    finally:
        for program in programs:
            program.stop()
        with contextlib.suppress(rosgraph.MasterError):
            master.deleteParam('/controller')


def test_the_command_of_a_robot_that_drives_is_refused(way):
    rosslt('set', '/controller/goal_x', '400')
    told = failure('force', '/cmd_vel/linear/x', '1')
    assert re.search(r'it changes by itself: \S+ became \S+ in the next message, .*; nothing was changed; ', told), told
    named = set(told.strip().rpartition('it is moved most by ')[2].split(', '))
    assert named == {'/controller/~kp', '/controller/~goal_x'}
    assert rosslt('get', '/controller/kp').stdout == '1.25\n'
    assert rosslt('get', '/controller/goal_x').stdout == '400.0\n'


def test_at_rest_the_goal_is_tried_and_no_huge_gain(way):
    """The error is almost 0 and left of it, so the gain would have to be some -200, for all axes of the robot."""
    wait_until(way.is_at_goal, 'it is at its goal')
    (planned,) = lines('force', '/cmd_vel/linear/x', '1', '--dry-run')
    assert planned[0] == '/controller/~goal_x'
    way.begin = len(way.places)
    told = failure('force', '/cmd_vel/linear/x', '1')
    assert 'it stood still before the change, and moves since; taken back' in told, told
    assert {tuple(line[1:3]) for line in lines('log', '/controller')} == {('rosslt force', '/controller/~goal_x')}
    wait_until(way.is_at_goal, 'it is at its goal again')
    assert max(x for x, _ in way.places) < 4.81
    assert {y for _, y in way.places} == {way.places[-1][1]}


# It leaves out a waypoint that is too far away, and says where it goes: at a distance, in a direction in degrees.
PATROL = """
from math import cos, radians, sin

import rospy
from geometry_msgs.msg import PointStamped

WAYPOINTS = [(1.0, 2.0, 180.0), (5.0, 6.0, 180.0)]
DISTANCE = 0.5

rospy.init_node('guard')
target, rate = rospy.Publisher('guard/target', PointStamped, queue_size=10), rospy.Rate(20)
while not rospy.is_shutdown():
    x, y, direction = next(waypoint for waypoint in WAYPOINTS if waypoint[0] < 10.0)
    message = PointStamped()
    message.point.x = x + DISTANCE * cos(radians(direction))
    message.point.y = y + DISTANCE * sin(radians(direction))
    target.publish(message)
    rate.sleep()
"""


@pytest.fixture
def guard(tmp_path, master):
    with Unmodified(tmp_path, 'guard', PATROL) as program:
        wait_until(lambda: 'WAYPOINTS_1_1' in rosslt('list', '/guard').stdout, 'its numbers')
        yield program


def test_a_patrol_that_goes_on_keeps_its_next_waypoint(guard):
    before = lines('list', '/guard')
    told = failure('force', '/guard/target/point/x', '20', '--timeout', '1')
    assert '/guard now sends 4.5 instead of 20.0; it comes from /guard/WAYPOINTS_1_0, ' in told
    assert told.endswith('; taken back')
    assert lines('list', '/guard') == before


def changed(*arguments):
    return {name: value for name, _, value, *_ in lines('force', *arguments)}


def test_a_target_is_moved_by_its_waypoint_alone(guard):
    """Of the distance, which all targets keep, rounding has left 1.2e-16 in y."""
    assert changed('/guard/target/point/y', '7') == {'/guard/WAYPOINTS_0_1': '7.0'}
    assert changed('/guard/target/point/x', '3') == {'/guard/WAYPOINTS_0_0': '3.5'}
    both = {'/guard/WAYPOINTS_0_0': '2.5', '/guard/WAYPOINTS_0_1': '1.0'}
    assert changed('/guard/target/point', '{x: 2, y: 1}') == both


# It latches its target once for each leg, and drives to it.
LEGS = """
import rospy
from std_msgs.msg import Float64

POSTS = [1.0, 2.0]


def drive():
    leg = 0
    while not rospy.is_shutdown():
        if leg < len(rospy.get_param('/legs_gone', '')):
            target.publish(POSTS[leg % 2])
            leg += 1
        heading.publish(POSTS[(leg - 1) % 2])
        rate.sleep()


rospy.init_node('legs')
target = rospy.Publisher('legs/target', Float64, queue_size=1, latch=True)
heading, rate = rospy.Publisher('legs/heading', Float64, queue_size=1), rospy.Rate(20)
drive()
"""


def sent_on(topic):
    sent = rosslt('echo', '-n', '1', topic).stdout
    return float(sent.split()[1]) if sent else None


def test_a_target_that_is_latched_for_a_leg_keeps_its_change(tmp_path, master):
    master.setParam('/legs_gone', '1')
    with Unmodified(tmp_path, 'legs', LEGS):
        wait_until(lambda: sent_on('/legs/target') == 1.0, 'its first leg')
        forced = rosslt('force', '/legs/target/data', '1.5', '--timeout', '1')
        assert forced.returncode == 0, forced
        assert forced.stdout.split('\t')[:3] == ['/legs/POSTS_0', '1.0', '1.5']
        assert forced.stderr.startswith('rosslt force: not seen: /legs has latched a message that it made before')
        assert forced.stderr.endswith('shows in the next message that is made of /legs/POSTS_0\n')
        assert (sent_on('/legs/heading'), sent_on('/legs/target')) == (1.5, 1.0)
        again = rosslt('force', '/legs/target/data', '1.5', '--timeout', '1')
        assert (again.returncode, again.stdout, again.stderr) == (0, '', forced.stderr)
        master.setParam('/legs_gone', '12')
        wait_until(lambda: sent_on('/legs/target') == 2.0, 'its second leg')
        master.setParam('/legs_gone', '121')
        wait_until(lambda: sent_on('/legs/target') == 1.5, 'its first leg')
    master.deleteParam('/legs_gone')


# Its targets are rows of a table in the code and of a parameter, scaled and moved by numbers that all of them share.
SHARING = """
import rospy
from geometry_msgs.msg import PointStamped, Pose, PoseArray

STOPS = [{'x': 2.0, 'y': -5.0}, {'x': 4.0, 'y': 3.0}]
DOCK = {'x': -2.0, 'y': 1.0}
BESIDE_X, BESIDE_Y = 0.5, 0.75
SCALE = 1.5
OFFSET = {'x': 0.5, 'y': 0.25}

rospy.init_node('sharing')
shelves = rospy.get_param('~shelves', [[1.0, 2], [30.0, 40]])
stops, rate = rospy.Publisher('sharing/stop', PointStamped, queue_size=10), rospy.Rate(20)
shelf = rospy.Publisher('sharing/shelf', PointStamped, queue_size=10)
all_places = rospy.Publisher('sharing/all', PoseArray, queue_size=10)
at = 1
while not rospy.is_shutdown():
    message = PointStamped()
    message.point.x = STOPS[at]['x'] * SCALE + OFFSET['x']
    message.point.y = OFFSET['y'] + SCALE * STOPS[at]['y']
    stops.publish(message)
    message = PointStamped()
    message.point.x = shelves[at][0] * SCALE + OFFSET['x']
    message.point.y = shelves[at][1] * SCALE + OFFSET['y']
    shelf.publish(message)
    places = PoseArray(poses=[Pose(), Pose()])
    dock, gate = (pose.position for pose in places.poses)
    dock.x, dock.y = DOCK['x'], DOCK['y']
    gate.x, gate.y = DOCK['x'] + BESIDE_X, DOCK['y'] + BESIDE_Y
    all_places.publish(places)
    rate.sleep()
"""


@pytest.fixture
def sharing(tmp_path, master):
    with Unmodified(tmp_path, 'sharing', SHARING) as program:
        wait_until(lambda: 'STOPS_1_y' in rosslt('list', '/sharing').stdout, 'its numbers')
        yield program
    with contextlib.suppress(rosgraph.MasterError):
        master.deleteParam('/sharing')


def test_what_a_target_has_for_itself_changes_first(sharing):
    assert changed('/sharing/stop/point/x', '8') == {'/sharing/STOPS_1_x': '5.0'}
    both = {'/sharing/STOPS_1_x': '1.0', '/sharing/STOPS_1_y': '0.5'}
    assert changed('/sharing/stop/point', '{x: 2, y: 1, z: 0}') == both
    assert changed('/sharing/shelf/point/x', '8') == {'/sharing/~shelves/1/0': '5.0'}
    assert changed('/sharing/shelf/point/y', '6.25') == {'/sharing/~shelves/1/1': '4'}
    told = failure('force', '/sharing/shelf/point/y', '7')
    assert 'whole' in told, told


def test_what_others_of_a_message_come_from_stays(sharing):
    both = {'/sharing/BESIDE_X': '3.0', '/sharing/BESIDE_Y': '-1.0'}
    assert changed('/sharing/all/poses[1]/position', '{x: 1, y: 0, z: 0}') == both
    assert changed('/sharing/all/poses[0]/position/x', '-3') == {'/sharing/DOCK_x': '-3.0'}


def test_what_a_target_has_for_itself_is_told_first(sharing):
    told = [line[3] for line in lines('explain', '/sharing/stop/point/y')]
    assert told == ['/sharing/STOPS_1_y', '/sharing/OFFSET_y', '/sharing/SCALE']
    found = rosslt('doctor', '/sharing/stop', '--time', '1').stdout
    assert 'it comes from /sharing/STOPS_1_x, /sharing/STOPS_1_y, /sharing/SCALE, ' in found


@pytest.mark.parametrize(
    ('name', 'meant'),
    [
        ('STOPS', 'one of STOPS_0_x, STOPS_0_y, STOPS_1_x, STOPS_1_y'),
        ('stops[1]', 'one of STOPS_1_x, STOPS_1_y'),
        ('STOPS[7].x', 'one of STOPS_0_x, STOPS_0_y, STOPS_1_x, STOPS_1_y'),
        ('STOPS.1.z', 'one of STOPS_1_x, STOPS_1_y'),
        ('STOPS[1].x', 'STOPS_1_x'),
        ('shelves[1]', 'one of ~shelves/1/0, ~shelves/1/1'),
        ('SCAL', 'SCALE'),
        ('OFFSET', 'one of OFFSET_x, OFFSET_y'),
    ],
)
def test_of_a_table_its_locations_are_meant(sharing, name, meant):
    said = f'rosslt get: /sharing has no location {name} (did you mean {meant}?); see rosslt list /sharing'
    assert failure('get', f'/sharing/{name}') == said


@pytest.mark.parametrize(
    ('name', 'begun'),
    [('STOPS', 'STOPS_'), ('STOPS_1', 'STOPS_1_'), ('~shelves', '~shelves/'), ('shelves/1', '~shelves/1/')],
)
def test_the_numbers_of_a_table_are_listed_by_its_name(sharing, name, begun):
    every = [line for line in lines('list', '/sharing', '--all') if line[0].startswith('/sharing/' + begun)]
    assert len(every) > 1
    assert lines('list', f'/sharing/{name}') == every


def test_what_all_targets_share_changes_where_it_is_said(sharing):
    told = ('--source', 'OFFSET_x', '--source', '/sharing/OFFSET_y')
    both = {'/sharing/OFFSET_x': '1.0', '/sharing/OFFSET_y': '0.75'}
    assert changed('/sharing/stop/point', '{x: 7, y: 5.25, z: 0}', *told) == both
    rosslt('lock', '/sharing/STOPS_1_x')
    try:
        assert changed('/sharing/stop/point/x', '8') == {'/sharing/OFFSET_x': '2.0'}
    finally:
        rosslt('unlock', '/sharing/STOPS_1_x')
