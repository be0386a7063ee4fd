"""Parameters that say whole numbers: degrees are dragged to fractions, counts to the nearest whole number."""

import math
import subprocess
import time

import pytest
import rosgraph
from geometry_msgs.msg import Quaternion
from std_msgs.msg import Float64MultiArray

from support.processes import wait_until
from support.unmodified import Listener, Unmodified

A_WHILE = 2.5  # longer than a drop is looked at, in seconds

NODE = """
import math
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from tf.transformations import quaternion_from_euler

STEP = float('{step}')
rospy.init_node('camera')
pan, count = rospy.get_param('~pan_deg'), rospy.get_param('~count')
poses = rospy.Publisher('camera_pose', PoseStamped, queue_size=1)
joints = rospy.Publisher('joints', JointState, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    pose = PoseStamped()
    pose.header.frame_id = 'world'
    pose.pose.position.x = count * STEP
    turn = pose.pose.orientation
    {turn}
    poses.publish(pose)
    joints.publish(JointState(name=['pan'] * len(range(count)), position=[math.radians(pan)] * count))
    rate.sleep()
"""

TURNS = {
    'half an angle': 'turn.z, turn.w = math.sin(math.radians(pan) / 2), math.cos(math.radians(pan) / 2)',
    'by pi': 'turn.z, turn.w = math.sin(pan * math.pi / 360), math.cos(pan * math.pi / 360)',
    'euler': 'turn.x, turn.y, turn.z, turn.w = quaternion_from_euler(0, 0, math.radians(pan))',
}


def parameter(name):
    return rosgraph.Master('/test').getParam('/camera/' + name)


def camera(folder, turn=TURNS['half an angle'], step=0.5):
    return Unmodified(folder, 'camera', NODE.format(turn=turn, step=step), '_pan_deg:=30', '_count:=4')


def degrees(hand):
    orientation = hand.marker('/camera_pose').pose.orientation
    return math.degrees(2 * math.atan2(orientation.z, orientation.w))


def turned(angle):
    half = math.radians(angle) / 2
    return Quaternion(0.0, 0.0, math.sin(half), math.cos(half))


def is_near(name, wanted):
    return lambda: abs(parameter(name) - wanted) < 1e-3


def is_at(hand, x):
    return lambda: abs(hand.position('/camera_pose')[0] - x) < 1e-6


@pytest.mark.parametrize('turn', TURNS.values(), ids=TURNS)
def test_degrees_are_dragged_to_fractions(hand, tmp_path, turn):
    with camera(tmp_path, turn):
        wait_until(lambda: abs(degrees(hand) - 30.0) < 1e-6, 'the camera to be shown')
        for wanted in (84.3, 12.5, -33.3):
            hand.drag('/camera_pose', orientation=turned(wanted))
            wait_until(is_near('pan_deg', wanted), lambda: 'not {}'.format(parameter('pan_deg')))
        assert parameter('count') == 4


@pytest.mark.parametrize('step', [pytest.param(0.5, marks=pytest.mark.slow), 0.0015])
def test_a_count_becomes_the_nearest_whole_number_and_stays(hand, tmp_path, step):
    with camera(tmp_path, step=step):
        wait_until(is_at(hand, 4 * step), 'the camera to be shown')
        for wanted, nearest in ((9.3, 9), (1.7, 2), (6.0, 6)):
            hand.drag('/camera_pose', dx=wanted * step - hand.position('/camera_pose')[0])
            wait_until(is_near('count', nearest), lambda: 'not {}'.format(parameter('count')))
            wait_until(is_at(hand, nearest * step), 'it to be shown there')
            time.sleep(A_WHILE)
            assert parameter('count') == nearest


LAPS = """
import rospy
from std_msgs.msg import Float64MultiArray

CONFIG = {'step': 0.5, 'laps': 3, 'points': 4}


def main():
    rospy.init_node('laps')
    publisher = rospy.Publisher('laps', Float64MultiArray, queue_size=1)
    points = CONFIG['points'] * 2
    while not rospy.is_shutdown():
        laps = list(range(CONFIG['laps'])) + list(range(points))
        publisher.publish(data=[CONFIG['step'] for _ in laps])
        rospy.sleep(0.05)


main()
"""


def test_an_int_that_is_set_to_a_whole_number_stays_one(master, tmp_path):
    """Nothing says that it counts: it might take fractions as well."""
    with Unmodified(tmp_path, 'laps', LAPS):
        heard = Listener('/laps', Float64MultiArray)
        wait_until(lambda: heard.last is not None and len(heard.last.data) == 11, 'three and eight')
        for name, value, count in (('CONFIG_laps', 5, 13), ('CONFIG_points', 2, 9)):
            subprocess.run(['rosslt', 'set', f'/laps/{name}', str(value)], check=True)
            wait_until(lambda count=count: len(heard.last.data) == count, f'{name} to be {value}')
