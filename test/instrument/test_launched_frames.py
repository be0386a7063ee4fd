"""The fixed frames of a robot that a launch file loads are dragged: its node is started again when the hand lets go."""

import collections
import functools
import math
import os
import re
import subprocess

import pytest
import rospy
from geometry_msgs.msg import Quaternion
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from rosslt.markers import geometry
from rosslt.markers.scene.fixed_frames import roll_pitch_yaw_of
from rosslt.markers.scene.kinematics import turned
from support.hand import Hand
from support.packages import launched
from support.processes import wait_until
from support.shell import lines, rosslt

URDF = """<robot name="arm">
  <link name="base"/> <link name="mast"/> <link name="camera"/> <link name="lens"/> <link name="bare"/>
  <link name="arm"/> <link name="tool"/>
  <joint name="mast_joint" type="fixed">
    <parent link="base"/><child link="mast"/>
    <origin xyz="0 0 1.50" rpy="0 0 1.5"/>
  </joint>
  <joint name="camera_joint" type="fixed">
    <parent link="mast"/><child link="camera"/>
    <origin xyz="0.10 0 0.50"
            rpy="0 {pitch} 0"/>
  </joint>
  <joint name="lens_joint" type="fixed"><parent link="camera"/><child link="lens"/><origin xyz="0.05 0 0"/></joint>
  <joint name="bare_joint" type="fixed"><parent link="base"/><child link="bare"/></joint>
  <joint name="tool_joint" type="fixed">
    <parent link="arm"/><child link="tool"/><origin rpy="0 0 0" xyz="0 0 .5"/>
  </joint>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="arm"/><origin xyz="1 0 0" rpy="0 0 0"/>
  </joint>
</robot>
"""
PUBLISHER = '<node pkg="robot_state_publisher" type="robot_state_publisher" name="{}">{}</node>'
ROBOT = '<param name="robot_description" textfile="$(dirname)/arm.urdf"/>'
ONE = ROBOT + PUBLISHER.format('publisher', '')


class Frames:
    """The latest transform of each frame, and where each has been."""

    def __init__(self):
        self.seen, self.places = {}, collections.defaultdict(list)
        for topic in ('/tf', '/tf_static'):
            rospy.Subscriber(topic, TFMessage, self._take)

    def _take(self, message):
        self.seen.update((one.child_frame_id, one.transform) for one in message.transforms)
        for one in message.transforms:
            self.places[one.child_frame_id].append(self.place(one.child_frame_id))

    def place(self, frame):
        there = self.seen[frame].translation
        return there.x, there.y, there.z

    def rotation(self, frame):
        turn = self.seen[frame].rotation
        return turn.x, turn.y, turn.z, turn.w


@pytest.fixture
def frames(master):
    return Frames()


@pytest.fixture
def precise(master):
    """Numbers are as exact as a hand is, instead of round."""
    rospy.set_param('/slt_visualization/resolution', 1e-8)
    yield
    rospy.delete_param('/slt_visualization/resolution')


@pytest.fixture
def hand(master):
    """A hand in RViz with a view of its own, which has seen nothing of the test before."""
    markers = subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdin=subprocess.DEVNULL)
    yield Hand()
    markers.terminate()
    markers.wait(20)


@pytest.fixture
def launch(master, tmp_path):
    """Starts a launch file: called with what is in it, options, and the text of `arm.urdf` beside it."""

    def start(inside=ONE, *options, said=None):
        file, urdf = tmp_path / 'robot.launch', tmp_path / 'arm.urdf'
        urdf.write_text(URDF.format(pitch='0') if said is None else said)
        file.write_text(f'<launch>{inside}</launch>')
        return launched(dict(os.environ), 'rosslt', 'launch', '--no-markers', *options, str(file))

    start.urdf = tmp_path / 'arm.urdf'
    yield start
    for name in rospy.get_param_names():
        if name.endswith(('robot_description', 'tf_prefix', 'use_tf_static')):
            rospy.delete_param(name)


def handle(hand, frame):
    """The name of the handle on a frame, once it is there: drawn since this hand looks, not by a view before."""
    names = (f'/tf:{frame}', f'/tf_static:{frame}')
    return wait_until(
        lambda: next((name for name in names if name in hand.inserts and name in hand.names()), None),
        lambda: f'a handle on {frame}; there are: {sorted(hand.names())}',
    )


def origin(joint, parameter='robot_description'):
    """The `<origin>` of a joint in the parameter: {attribute: numbers}."""
    text = re.search(rf'<joint name="{joint}".*?</joint>', rospy.get_param(parameter), re.DOTALL)[0]
    return {name: tuple(map(float, numbers.split())) for name, numbers in re.findall(r'(xyz|rpy)="([^"]*)"', text)}


def is_at(frames, frame, place):
    return frame in frames.seen and math.dist(frames.place(frame), place) < 1e-6


def is_turned(frames, frame, rotation):
    return frame in frames.seen and geometry.are_same_rotation(frames.rotation(frame), rotation, 1e-12)


def test_a_fixed_frame_is_dragged_and_saved(launch, hand, frames):
    with launch():
        name = handle(hand, 'camera')
        held = hand.press(name)
        hand.move(held, dx=0.25, dy=-0.5)
        assert rospy.get_param('robot_description') == URDF.format(pitch='0'), 'nothing is changed while it moves'
        hand.release(held)
        wait_until(lambda: is_at(frames, 'camera', (0.35, -0.5, 0.5)), 'the frame is where it was dropped', 60)
        moved = URDF.format(pitch='0').replace('"0.10 0 0.50"', '"0.35 -0.5 0.50"')
        assert rospy.get_param('robot_description') == moved
        wait_until(lambda: name in hand.names() and hand.position(name) == (0.35, -0.5, 0.5), 'the handle is there')
        assert len(lines('save', '/robot_description')) == 2
        assert launch.urdf.read_text() == moved
        hand.choose(name, 'Undo')
        wait_until(lambda: is_at(frames, 'camera', (0.1, 0, 0.5)), 'the frame is where it was', 60)
        assert origin('camera_joint') == {'xyz': (0.1, 0, 0.5), 'rpy': (0, 0, 0)}


def test_each_frame_is_moved_by_the_numbers_that_are_there(launch, hand, frames):
    with launch():
        moving = {'body', 'move_x', 'move_y', 'move_z'}
        turning = {'rotate_x', 'rotate_y', 'rotate_z'}
        for frame, ways in (('mast', moving | turning), ('camera', moving | turning), ('lens', moving)):
            name = handle(hand, frame)
            hand.release(hand.press(name))  # of several things, the one that was clicked shows its arrows
            wait_until(lambda name=name, ways=ways: set(hand.controls(name)) - {'menu'} == ways, f'ways of {frame}')
        assert rospy.get_param('robot_description') == URDF.format(pitch='0')
        assert not [name for name in hand.names() if name.endswith((':bare', ':arm'))]
        hand.drag(handle(hand, 'lens'), dz=0.25)
        wait_until(lambda: is_at(frames, 'lens', (0.05, 0, 0.25)), 'the frame is where it was dropped', 60)
        assert origin('lens_joint') == {'xyz': (0.05, 0, 0.25)}
        assert is_at(frames, 'camera', (0.1, 0, 0.5))


def test_a_frame_behind_a_joint_that_turns_is_dragged_in_its_frame(launch, hand, frames):
    with launch():
        states = rospy.Publisher('/joint_states', JointState, queue_size=1, latch=True)
        states.publish(JointState(header=Header(stamp=rospy.Time.now()), name=['shoulder'], position=[0.5]))
        name = handle(hand, 'tool')
        assert hand.marker(name).header.frame_id == 'arm'
        hand.drag(name, dx=0.25, dz=0.25)
        wait_until(lambda: is_at(frames, 'tool', (0.25, 0, 0.75)), 'the frame is where it was dropped', 60)
        assert origin('tool_joint') == {'rpy': (0, 0, 0), 'xyz': (0.25, 0, 0.75)}
        assert origin('shoulder') == {'xyz': (1, 0, 0), 'rpy': (0, 0, 0)}
        states.unregister()


def around(axis, angle, rotation):
    """A rotation turned about an axis of the frame."""
    turn = [math.sin(angle / 2) * part for part in geometry.AXES[axis]]
    return geometry.product((*turn, math.cos(angle / 2)), rotation)


@pytest.mark.parametrize(('pitch', 'angle'), [('0', 0.75), ('1.5707963267948966', 0.25), ('1.57', 0.25)])
def test_rings_turn_it_also_where_it_looks_up(launch, precise, hand, frames, pitch, angle):
    del precise
    with launch(said=URDF.format(pitch=pitch)):
        name, rotation = handle(hand, 'camera'), turned((0.0, float(pitch), 0.0))
        wait_until(lambda: is_turned(frames, 'camera', rotation), 'the frame')
        for axis in range(3):
            rotation = around(axis, angle, rotation)
            hand.drag(name, orientation=Quaternion(*rotation))
            wait_until(functools.partial(is_turned, frames, 'camera', rotation), f'it is turned about {axis}', 60)
            wait_until(functools.partial(is_shown_turned, hand, name, rotation), 'the handle is turned')
        assert frames.place('camera') == (0.1, 0, 0.5)
        angles = origin('camera_joint')
        assert angles['xyz'] == (0.1, 0, 0.5)
        assert geometry.are_same_rotation(turned(angles['rpy']), rotation)


def is_shown_turned(hand, name, rotation):
    turn = hand.marker(name).pose.orientation
    return geometry.are_same_rotation((turn.x, turn.y, turn.z, turn.w), rotation)


def test_place_and_turn_are_one_change(launch, precise, hand, frames):
    del precise
    with launch():
        name = handle(hand, 'camera')
        turn = around(0, 0.5, around(2, 1.25, geometry.IDENTITY))
        hand.drag(name, dx=1.0, dy=2.0, dz=-3.0, orientation=Quaternion(*turn))
        wait_until(lambda: is_at(frames, 'camera', (1.1, 2.0, -2.5)), 'the frame is where it was dropped', 60)
        assert is_turned(frames, 'camera', turn)
        assert len([place for place in frames.places['camera'] if place != (0.1, 0, 0.5)]) == 1, 'one start'
        assert rosslt('undo').returncode == 0
        wait_until(lambda: is_at(frames, 'camera', (0.1, 0, 0.5)), 'the frame is where it was', 60)
        assert is_turned(frames, 'camera', geometry.IDENTITY)


def test_without_restarts_the_handle_goes_back_and_says_why(launch, hand, frames):
    logged = []
    rospy.Subscriber('/rosout', Log, lambda message: logged.append(message.msg))
    with launch(ONE, '--no-restart'):
        name = handle(hand, 'camera')
        drawn = hand.inserts.count(name)
        hand.drag(name, dx=0.25)
        why = '/publisher reads it at its start, and `rosslt launch --no-restart` does not start it again'
        wait_until(lambda: f'{name} snaps back: {why}' in logged, lambda: f'the reason, not {logged}')
        # with its arrows, as it has been clicked
        wait_until(lambda: hand.inserts.count(name) > drawn, 'the handle is put back')
        assert hand.position(name) == (0.1, 0, 0.5)
        wait_until(lambda: any('note' in one for one in hand.names()), lambda: f'the reason, of {hand.names()}')
        assert is_at(frames, 'camera', (0.1, 0, 0.5))
        assert rospy.get_param('robot_description') == URDF.format(pitch='0')


def sides(*insides):
    """Two robots of one file in namespaces, each with what is in the tag of its publisher."""
    return ''.join(
        f'<group ns="{side}">{ROBOT}{PUBLISHER.format("publisher", inside)}</group>'
        for side, inside in zip(('left', 'right'), insides)
    )


def test_of_two_robots_the_one_that_is_dragged_changes(launch, hand, frames):
    world = '<node pkg="tf2_ros" type="static_transform_publisher" name="{0}_tf" args="0 0 0 0 0 0 world {0}/base"/>'
    prefixed = sides(*(f'<param name="tf_prefix" value="{side}"/>' for side in ('left', 'right')))
    with launch(world.format('left') + world.format('right') + prefixed):
        handle(hand, 'right/camera')
        hand.drag(handle(hand, 'left/camera'), dx=0.25)
        wait_until(lambda: is_at(frames, 'left/camera', (0.35, 0, 0.5)), 'the frame is where it was dropped', 60)
        assert origin('camera_joint', '/left/robot_description')['xyz'] == (0.35, 0, 0.5)
        assert rospy.get_param('/right/robot_description') == URDF.format(pitch='0')
        assert is_at(frames, 'right/camera', (0.1, 0, 0.5))


def test_a_frame_that_is_sent_again_and_again_is_dragged(launch, hand, frames):
    with launch(ROBOT + PUBLISHER.format('publisher', '<param name="use_tf_static" value="false"/>')):
        name = handle(hand, 'camera')
        assert name == '/tf:camera'
        hand.drag(name, dx=0.25)
        wait_until(lambda: is_at(frames, 'camera', (0.35, 0, 0.5)), 'the frame is where it was dropped', 60)
        wait_until(lambda: name in hand.names() and hand.position(name) == (0.35, 0, 0.5), 'the handle is there')
        assert origin('camera_joint') == {'xyz': (0.35, 0, 0.5), 'rpy': (0, 0, 0)}


def test_what_somebody_else_sets_meanwhile_stays(launch, hand, frames):
    with launch():
        held = hand.press(handle(hand, 'camera'))
        hand.move(held, dx=0.25)
        theirs = URDF.format(pitch='0').replace('0 0 1.50', '0 0 1.75')
        rospy.set_param('robot_description', theirs)
        said = []

        def is_known():
            hand.keep(held)
            said.append(rosslt('get', '/robot_description/mast_joint/xyz/2').stdout)
            return said[-1] == '1.75\n'

        wait_until(is_known, lambda: f'their number, not {said[-1]}')
        hand.release(held)
        wait_until(lambda: is_at(frames, 'camera', (0.35, 0, 0.5)), 'the frame is where it was dropped', 60)
        assert is_at(frames, 'mast', (0, 0, 1.75))
        assert rospy.get_param('robot_description') == theirs.replace('0.10 0', '0.35 0')


def test_a_frame_of_two_robots_has_no_handle(launch, hand, frames):
    lone = '<param name="alone/robot_description" command="cat $(dirname)/other.urdf"/>'
    (launch.urdf.parent / 'other.urdf').write_text(URDF.format(pitch='0').replace('"camera"', '"eye"'))
    with launch(sides('', '') + lone + PUBLISHER.replace('name=', 'ns="alone" name=').format('publisher', '')):
        handle(hand, 'eye')
        frames_of_robots = ('base', 'mast', 'camera', 'lens', 'tool', 'eye')
        assert [name for name in hand.names() if name.endswith(tuple(f'static:{one}' for one in frames_of_robots))] == [
            handle(hand, 'eye')
        ]


def test_a_text_that_no_node_has_read_moves_nothing(launch, hand, frames):
    with launch():
        handle(hand, 'camera')
        theirs = URDF.format(pitch='0').replace('0.10 0 0.50', '0.10 0 0.75')
        rospy.set_param('robot_description', theirs)
        wait_until(lambda: not [one for one in hand.names() if one.endswith(':camera')], 'no handle on the camera')
        hand.drag(handle(hand, 'mast'), dx=0.25)
        wait_until(lambda: is_at(frames, 'mast', (0.25, 0, 1.5)), 'the other one is where it was dropped', 60)
        assert is_at(frames, 'camera', (0.1, 0, 0.75))
        assert rospy.get_param('robot_description') == theirs.replace('0 0 1.50', '0.25 0 1.50')
        handle(hand, 'camera')


def test_angles_are_those_of_the_rotation_nearest_to_the_present_ones():
    right = math.pi / 2
    for pitch in (-3.0, -right, -1.57, -1.0, 0.0, 0.5, 1.57, right, 1.58, 2.5):
        near = (0.25, pitch, -0.75)
        assert roll_pitch_yaw_of(turned(near), near) == pytest.approx(near, abs=1e-7)
        for axis in range(3):
            for angle in (-1.0, -1e-3, 1e-3, 1.0):
                rotation = around(axis, angle, turned(near))
                found = roll_pitch_yaw_of(rotation, near)
                assert geometry.are_same_rotation(turned(found), rotation, 1e-12)
                assert all(abs(one - other) <= math.pi + 1e-9 for one, other in zip(found, near))
    assert roll_pitch_yaw_of(turned((6.0, 0.0, 9.0)), (6.25, 0.0, 9.25)) == pytest.approx((6.0, 0.0, 9.0))
    assert roll_pitch_yaw_of(turned((0.0, right + 0.1, 0.0)), (0.0, right, 0.0)) == pytest.approx((0, right + 0.1, 0))
