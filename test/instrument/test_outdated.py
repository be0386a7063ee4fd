"""What a node has made of a number in a round, and goes on with, is named once the number has changed."""

import contextlib

import pytest
import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import Int32

from support.processes import is_published, wait_until
from support.shell import rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

PATROL = """import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import Int32
from visualization_msgs.msg import Marker

HEIGHT = 0.25
WAYPOINTS = [(0.0, 0.5), (1.5, 2.5), (3.0, 4.5)]


class Leg:
    def __init__(self, index):
        self.itself = self  # until garbage is collected
        self.end = WAYPOINTS[index]
        self.place = Point(*self.end, 0.0)


class Robot:
    def __init__(self):
        self.leg = None
        rospy.Subscriber('next', Int32, self.go_on)

    def go_on(self, index):
        self.leg = Leg(index.data)


rospy.init_node('patrol')
robot = Robot()
goals = rospy.Publisher('goal', Point, queue_size=1)
places = rospy.Publisher('places', Marker, queue_size=9)
while not rospy.is_shutdown():
    rospy.sleep(0.02)
    if robot.leg is None:
        robot.leg = Leg(1)
    goals.publish(Point(*robot.leg.end, HEIGHT))
    for number, (x, y) in enumerate(WAYPOINTS):
        made = Marker(type=Marker.CUBE, id=number)
        made.header.frame_id = 'world'
        made.pose.position.x, made.pose.position.y = x, y
        made.pose.orientation.w = made.scale.x = made.scale.y = made.scale.z = made.color.a = 1.0
        places.publish(made)
"""

KEPT = 'end and place.{} of /patrol still hold what was made of the former value, until the node makes it again'


@contextlib.contextmanager
def patrolling(folder):
    with Unmodified(folder, 'patrol', PATROL) as node:
        wait_until(lambda: is_published('/places') and 'WAYPOINTS_1_0' in rosslt('list', '/patrol').stdout, 'it drives')
        yield node


def told(*words):
    answer = rosslt(*words)
    assert answer.returncode == 0, answer.stderr
    return answer.stderr.strip()


def test_the_target_of_a_leg_that_has_begun_is_named(hearing, tmp_path):
    with patrolling(tmp_path):
        assert told('set', '/patrol/WAYPOINTS_1_0', '2.0') == f'rosslt set: {KEPT}'.format('x')
        assert hearing('/goal', Point).next().x == 1.5, 'as it was said'
        assert told('force', '/places/pose/position/y', '3.5', '--where', 'id=1') == f'rosslt force: {KEPT}'.format('y')
        assert told('reset', '/patrol/WAYPOINTS_1_0') == '', 'it is as the target has it'


def test_what_is_made_again_is_not_named(master, tmp_path):
    with patrolling(tmp_path):
        assert told('set', '/patrol/WAYPOINTS_2_0', '2.0') == ''
        assert told('set', '/patrol/HEIGHT', '0.5') == ''
        assert told('force', '/goal/z', '0.75') == ''


def test_what_nothing_refers_to_any_more_is_not_named(hearing, tmp_path):
    with patrolling(tmp_path):
        following, goals = rospy.Publisher('/next', Int32, queue_size=1, latch=True), hearing('/goal', Point)
        following.publish(2)
        goals.next(lambda goal: goal.x == 3.0)
        following.unregister()
        assert told('set', '/patrol/WAYPOINTS_1_0', '2.0') == ''
        assert told('set', '/patrol/WAYPOINTS_2_0', '2.0') == f'rosslt set: {KEPT}'.format('x')


def test_a_drag_tells_it(hand, tmp_path):
    with patrolling(tmp_path):
        wait_until(lambda: '/places::1' in hand.names(), 'the place is shown')
        hand.drag('/places::1', dx=1.0)
        note = '/places::1:note'
        wait_until(
            lambda: note in hand.names()
            and KEPT.format('x') in hand.marker(note).controls[0].markers[0].text.replace('\n', ' '),
            'it is told',
        )
