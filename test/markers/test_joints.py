"""Handles on the joints of a robot, and where a drag of one stops."""

import math

import pytest
from sensor_msgs.msg import JointState

from rosslt import values
from rosslt.markers.drags import changes
from rosslt.markers.drags.drag import Drag
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.geometry import normalized, product, rotate_vector
from rosslt.markers.rviz.controls import handle_marker
from rosslt.markers.scene import joints
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.node.change import change_request
from support.processes import wait_until

URDF = """
<robot name="crane">
  <joint name="tower" type="continuous">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 2"/>
  </joint>
  <joint name="trolley" type="prismatic">
    <parent link="arm"/><child link="hook"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="boom" type="revolute">
    <parent link="hook"/><child link="boom"/><axis xyz="0 0 1"/><limit lower="-2.4" upper="2.4"/>
  </joint>
  <joint name="rope" type="prismatic">
    <parent link="hook"/><child link="rope"/><axis xyz="0 0 -1"/><limit lower="0" upper="5"/>
  </joint>
  <joint name="paint" type="fixed"><parent link="arm"/><child link="paint"/></joint>
</robot>
"""


def tracked(value):
    return values.track(value, values.Source('/owner', 1))


def describe(monkeypatch, parameters):
    """Have the master give parameters, and no others."""
    joints._description_for.cache_clear()
    monkeypatch.setattr(joints.rospy, 'has_param', parameters.__contains__)
    monkeypatch.setattr(joints.rospy, 'get_param_cached', parameters.get)


@pytest.fixture
def crane(monkeypatch):
    describe(monkeypatch, {'/robot_description': URDF})


def scene_of(name, present, topic='/joint_states', scene=None):
    """A scene with a joint whose position is tracked."""
    scene = scene or Scene(Settings())
    message = JointState(name=[name], position=[tracked(present)])
    message._connection_header = {'callerid': '/owner'}
    scene.take(topic, message, is_shown=True)
    return scene


def handle_of(name, present):
    return scene_of(name, present).handle('/joint_states:' + name)


def test_a_joint_that_turns_has_a_ring_around_its_axis(crane):
    tower = handle_of('tower', 0.3)
    assert (tower.frame, tower.pose[:3]) == ('base', (0.0, 0.0, 1.0))
    drawn = handle_marker(tower, tower.motions(lambda _value: True), False, 0.5, True)
    (ring,) = [control for control in drawn.controls if control.name.startswith('rotate')]
    axis = rotate_vector(
        normalized(ring.orientation.x, ring.orientation.y, ring.orientation.z, ring.orientation.w), (1.0, 0.0, 0.0)
    )
    assert axis == pytest.approx((0.0, 0.0, 1.0))


@pytest.mark.parametrize('present', [0.3, 3.0, -7.0])
def test_a_ring_that_is_turned_turns_its_joint_by_that_angle(crane, present):
    tower = handle_of('tower', present)
    turn = (0.0, 0.0, math.sin(0.25), math.cos(0.25))
    pose = (*tower.pose[:3], *product(turn, tower.pose[3:]))
    (value,), (target,) = tower.wanted(pose, moved=False, turned=True)
    assert value == present
    assert target == pytest.approx(present + 0.5)


def test_a_joint_that_slides_has_a_ball_that_moves_along_its_axis(crane):
    trolley = handle_of('trolley', 0.2)
    assert trolley.pose[:3] == pytest.approx((0.5, 0.2, 0.0))
    assert rotate_vector(trolley.pose[3:], (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
    (_,), (target,) = trolley.wanted((0.5, 0.7, 0.0, *trolley.pose[3:]), moved=True, turned=False)
    assert target == pytest.approx(0.7)


def drag_of(name, present):
    handle = handle_of(name, present)
    return handle, Drag(handle, 1.0)


def turned_about_z(handle, angle):
    return (*handle.pose[:3], 0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def asked(handle, drag, pose):
    """What a drag asks for where a hand has come to a pose, and what is said."""
    drag.move(handle.frame, pose)
    _, (target,), said = drag.wanted(handle, pose)
    return target, said


def test_a_ring_stops_at_its_limit_however_far_the_hand_goes_round(crane):
    handle, drag = drag_of('boom', 2.0)
    assert asked(handle, drag, turned_about_z(handle, 2.3)) == (pytest.approx(2.3), '')
    for step in range(25, 120):  # more than once around
        there = turned_about_z(handle, step / 10)
        assert asked(handle, drag, there) == (2.4, 'boom is at its maximum 2.4 in robot_description'), step
    for step in reversed(range(-23, 120)):  # and back again
        target, _ = asked(handle, drag, turned_about_z(handle, step / 10))
        assert target == pytest.approx(min(2.4, step / 10)), step
    assert asked(handle, drag, turned_about_z(handle, -2.5))[1] == 'boom is at its minimum -2.4 in robot_description'


def test_a_ball_that_slides_stops_at_its_limits(crane):
    handle, drag = drag_of('rope', 1.0)
    below, above = (0.0, 0.0, -7.0, *handle.pose[3:]), (0.0, 0.0, 1.0, *handle.pose[3:])
    assert asked(handle, drag, below) == (5.0, 'rope is at its maximum 5.0 in robot_description')
    assert asked(handle, drag, above) == (0.0, 'rope is at its minimum 0.0 in robot_description')


def test_a_joint_beyond_its_limits_moves_back_and_no_further_out(crane):
    handle, drag = drag_of('boom', 3.0)
    beyond = 'boom is beyond its maximum 2.4 in robot_description'
    assert asked(handle, drag, turned_about_z(handle, 3.1)) == (3.0, beyond)
    assert asked(handle, drag, turned_about_z(handle, 2.7)) == (pytest.approx(2.7), '')
    assert asked(handle, drag, turned_about_z(handle, 3.0)) == (pytest.approx(3.0), '')
    assert asked(handle, drag, turned_about_z(handle, 1.0)) == (pytest.approx(1.0), '')


def test_a_person_is_told_of_the_limit_that_a_drag_has_met(crane, monkeypatch):
    requested = []
    monkeypatch.setattr(changes.node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})
    monkeypatch.setattr(
        change_request,
        'request_values',
        lambda wanted, timeout, request_id, asker: requested.append(wanted) or {},
    )
    scene = scene_of('boom', 2.0)
    handle = scene.handle('/joint_states:boom')
    drags, said = Drags(scene, Rules(rate=1000.0), str), []
    assert drags.hold(handle.name)
    assert drags.move(handle.name, handle.frame, turned_about_z(handle, 3.0))
    wait_until(lambda: said.extend(scene.news().said) or said, 'the person to be told')
    assert (said[0][0].name, said[0][1]) == (handle.name, 'boom is at its maximum 2.4 in robot_description')
    assert requested[0] == {values.Source('/owner', 1): 2.4}


def test_the_robot_is_that_of_the_namespace_of_the_topic(monkeypatch):
    describe(monkeypatch, {'/left/robot_description': URDF})
    scene = Scene(Settings())
    for topic in ('/left/arm/joint_states', '/right/arm/joint_states'):
        scene_of('tower', 0.3, topic, scene)
    assert list(scene.names()) == ['/left/arm/joint_states:tower']


def test_joints_without_a_description_have_no_handle(monkeypatch):
    parameters = {}
    describe(monkeypatch, parameters)
    assert not scene_of('tower', 0.3).names()
    parameters['/robot_description'] = URDF
    assert scene_of('tower', 0.3).names()
    parameters['/robot_description'] = {}  # as rospy says that it was deleted
    assert not scene_of('tower', 0.3).names()


def test_a_description_that_cannot_be_read_is_named_in_the_log(monkeypatch):
    logged = []
    monkeypatch.setattr(joints.rospy, 'logerr_throttle', lambda period, text: logged.append(text))
    describe(monkeypatch, {'/robot_description': '<robot>'})
    assert not scene_of('tower', 0.3).names()
    assert logged[0].startswith('/robot_description cannot be read: ')
