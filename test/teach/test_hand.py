"""How a hand moves a thing: which ways, how far, and to which places. The stamps are made up."""

import math
from types import SimpleNamespace

import pytest
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Float64MultiArray

from rosslt.markers import Motions
from rosslt.teach.devices import Joints, Joystick, Knob, Options, Tracker, Velocity
from rosslt.teach.hand import Hand, NumbersHand

FREE = Motions((True, True, True), True)
PERIOD = 0.02


class Drags:
    """Hands that hold whatever they are to hold."""

    def __init__(self):
        self.poses, self.released = [], []

    def hold(self, *_):
        return True

    def keep(self, *_):
        pass

    def move(self, thing, frame, pose, name):
        self.poses.append(pose)
        return True

    def release(self, thing, frame, pose, name):
        self.released.append(pose)


class Played:
    """A hand with a device whose messages are made up."""

    def __init__(self, device, motions=FREE, at=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), **options):
        self.drags, self.said, self.now = Drags(), [], 0.0
        chosen = Options(**options)
        handle = SimpleNamespace(name='/box', frame='world')
        self.device = device(chosen)
        kind = Hand if len(at) == 7 else NumbersHand
        self.hand = kind(self.device, self.drags, '/device', chosen, lambda: (handle, motions, at), self.said.append)

    def take(self, message, after=PERIOD):
        self.now += after
        if hasattr(message, 'header'):
            message.header.stamp = rospy.Time.from_sec(100.0 + self.now)
        self.hand.take(message, self.now)

    def pose(self, x=0.0, y=0.0, z=0.0, yaw=0.0, roll=0.0):
        message = PoseStamped()
        message.pose.position.x, message.pose.position.y, message.pose.position.z = x, y, z
        turned = message.pose.orientation
        turned.z, turned.x, turned.w = math.sin(yaw / 2), math.sin(roll / 2), math.cos((yaw or roll) / 2)
        self.take(message)

    def joy(self, *axes):
        self.take(Joy(axes=list(axes), buttons=[1]))

    def joints(self, a, b):
        self.take(JointState(name=['a', 'b'], position=[a, b]))

    @property
    def place(self):
        return self.hand.pose[:3]


def turning(*axes):
    """Motions of a thing that turns around axes of its frame."""
    half = math.sqrt(0.5)
    onto = {'x': (0.0, 0.0, 0.0, 1.0), 'z': (0.0, -half, 0.0, half)}
    rings = [SimpleNamespace(orientation=lambda _, rotation=onto[axis]: rotation) for axis in axes]
    return Motions((True, True, True), True, rings=tuple(rings))


def test_only_some_ways_are_moved():
    played = Played(Tracker, turning('x', 'z'), smooth=0.0, only=frozenset(['x', 'yaw']))
    played.pose()
    played.pose(0.01, 0.02, 0.03, yaw=0.05)
    assert played.hand.pose == pytest.approx((0.01, 0.0, 0.0, 0.0, 0.0, math.sin(0.025), math.cos(0.025)))
    played.pose(0.01, 0.05, 0.03, yaw=0.05)
    assert played.place == pytest.approx((0.01, 0.0, 0.0))
    assert not played.said
    other = Played(Tracker, turning('x', 'z'), smooth=0.0, only=frozenset(['x', 'yaw']))
    other.pose()
    other.pose(roll=0.05)
    assert other.hand.pose[3:] == (0.0, 0.0, 0.0, 1.0)


def test_a_movement_is_scaled_after_it_was_found_to_be_no_leap():
    played = Played(Tracker, smooth=0.0, scale=5.0)
    played.pose()
    played.pose(0.09)
    assert played.place == pytest.approx((0.45, 0.0, 0.0))
    fine = Played(Tracker, smooth=0.0, scale=0.1)
    fine.pose()
    fine.pose(0.2)
    fine.pose(0.21)
    assert fine.place == pytest.approx((0.001, 0.0, 0.0))
    assert fine.said == ['a message of /device moves nothing: it leaps by more than 0.1 m']


def test_places_are_multiples_while_it_moves_and_after():
    played = Played(Tracker, at=(0.013, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0), smooth=0.0, snap=0.05, only=frozenset('x'))
    for step in range(30):
        played.pose(0.004 * step)
    played.hand.let_go()
    places = [pose[:3] for pose in played.drags.poses]
    assert {round(x, 12) for x, _, _ in places} == {0.0, 0.05, 0.1, 0.15}
    assert {y for _, y, _ in places} == {0.5}
    assert played.drags.released[0][:3] == pytest.approx((0.15, 0.5, 0.0))


def test_a_thing_that_was_not_moved_stays_between_multiples():
    played = Played(Tracker, turning('z'), at=(0.013, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), smooth=0.0, snap=0.05)
    played.pose()
    played.pose(yaw=0.05)
    assert played.place == (0.013, 0.0, 0.0)


def test_on_an_oblique_rail_there_are_no_multiples():
    turned = (0.0, 0.0, math.sin(math.pi / 8), math.cos(math.pi / 8))
    played = Played(Tracker, Motions((True, False, False)), at=(0.0, 0.0, 0.0, *turned), smooth=0.0, snap=0.05)
    played.pose()
    played.pose(0.02, 0.02)
    assert played.place == pytest.approx((0.02, 0.02, 0.0))


def test_a_pose_is_smoothed_and_a_leap_is_not():
    played = Played(Tracker)
    played.pose()
    played.pose(0.001)
    assert 0.0 < played.place[0] < 0.0001
    before = played.place
    played.pose(1.001)
    played.pose(1.001)
    assert played.place[0] - before[0] < 0.0001
    assert played.said == ['a message of /device moves nothing: it leaps by more than 0.1 m']


def test_a_filter_begins_anew_with_each_hold():
    played = Played(Tracker)
    played.pose()
    played.pose(0.05)
    played.hand.expire(played.now + 1.0)
    played.pose(0.05)
    played.pose(0.05)
    assert played.place == (0.0, 0.0, 0.0)


@pytest.mark.parametrize('expo', [0.0, 0.4, 1.0])
def test_a_stick_begins_at_the_edge_of_its_dead_zone(expo):
    def moved(deflection):
        played = Played(Joystick, expo=expo, speed=1.0)
        played.joy(0.0, 0.0, 0.0)
        played.joy(deflection, 0.0, 0.0)
        return played.place[0] / PERIOD

    assert moved(0.1) == moved(-0.1) == moved(0.05) == 0.0
    assert 0.0 <= moved(0.101) < 0.002
    for sign in (1.0, -1.0):
        assert moved(sign * 0.55) == pytest.approx(sign * ((1.0 - expo) * 0.5 + expo * 0.125), abs=1e-6)
        assert moved(sign) == pytest.approx(sign, abs=1e-6)


def test_a_joystick_turns():
    played = Played(Joystick, turning('z'), turn=(1, 1, 2), turn_speed=2.0)
    played.joy(0.0, 0.0, 0.0)
    played.joy(0.0, 0.0, -1.0)
    assert played.hand.pose[3:] == pytest.approx((0.0, 0.0, math.sin(-0.02), math.cos(-0.02)))
    assert played.place == pytest.approx((0.0, 0.0, -0.01)), 'axis 2 is z as well'
    for bad, said in (((0.0, 0.0, math.nan), 'a number is not finite'), ((0.0, 0.0), 'it has 2 axes, and no axis 2')):
        played.joy(*bad)
        assert played.said[-1].endswith(said)
    assert played.hand.pose[3:] == pytest.approx((0.0, 0.0, math.sin(-0.02), math.cos(-0.02)))


def knob(options):
    return Knob('data[1]', options)


def turned(number):
    return Float64MultiArray(data=[math.nan, number])


def test_a_stick_that_is_let_go_moves_nothing_more():
    played = Played(Joystick)
    for _ in range(5):
        played.joy(1.0, 0.0, 0.0)
    held = played.hand.pose
    moved = list(played.drags.poses)
    for _ in range(5):
        played.take(Joy(axes=[1.0, 0.0, 0.0], buttons=[0]))
        assert (played.hand.pose, played.drags.released) == (None, [held]), 'from the first such message on'
    assert played.drags.poses == moved


def test_a_twist_that_is_zero_moves_nothing_more():
    played, way = Played(Velocity), Twist()
    way.linear.x = 0.5
    for _ in range(5):
        played.take(way)
    held = played.hand.pose
    played.take(Twist())
    assert (played.hand.pose, played.drags.released) == (None, [held])
    assert len(played.drags.poses) == 4


def test_a_number_goes_as_a_knob_does_times_the_scale():
    played = Played(knob, at=(3.0,), smooth=0.0, scale=10.0)
    for number in (0.5, 0.55, 0.6, 0.52):
        played.take(turned(number))
    assert played.hand.pose == pytest.approx((3.2,))
    played.take(turned(0.9))
    assert played.said == ['a message of /device moves nothing: it leaps by more than 0.1']
    played.take(turned(0.91))
    assert played.hand.pose == pytest.approx((3.3,)), 'it goes on from there'


@pytest.mark.parametrize(
    ('message', 'told'),
    [
        (turned(math.nan), 'a number is not finite'),
        (Float64MultiArray(data=[1.0]), 'data has no [1]'),
    ],
)
def test_what_is_no_number_of_a_knob_moves_nothing(message, told):
    played = Played(knob, at=(3.0,), smooth=0.0)
    played.take(turned(0.5))
    played.take(message)
    assert played.said == ['a message of /device moves nothing: ' + told]
    assert played.hand.pose == (3.0,)
    played.take(turned(0.55))
    assert played.hand.pose == pytest.approx((3.05,))


def test_numbers_are_smoothed_each_by_itself_and_become_multiples():
    played = Played(leader, at=(0.013, 1.0))
    played.joints(0.0, 0.0)
    played.joints(0.001, 0.09)
    assert 0.0 < played.hand.pose[0] - 0.013 < 0.0001
    assert played.hand.pose[1] > 1.01
    snapped = Played(leader, at=(0.013, 1.01), smooth=0.0, snap=0.05)
    snapped.joints(0.0, 0.0)
    snapped.joints(0.06, 0.0)
    assert snapped.hand.pose == pytest.approx((0.05, 1.01)), 'what was not moved stays between multiples'


def leader(options):
    device = Joints(options)
    device.names = ['a', 'b']
    return device


def test_joints_are_read_by_name_in_any_order():
    played = Played(leader, at=(1.0, 2.0), smooth=0.0)
    played.joints(0.0, 0.0)
    played.take(JointState(name=['b', 'c', 'a'], position=[0.03, 7.0, -0.02]))
    assert played.hand.pose == pytest.approx((0.98, 2.03))
    played.take(JointState(name=['c'], position=[9.0]))
    assert not played.said, 'another publisher has other joints'
    played.joints(-0.02, 0.5)
    assert played.hand.pose == pytest.approx((0.98, 2.03)), 'a leap of one joint moves none'
