"""Handles on the joints of a robot, and where a drag of one stops."""

import contextlib
import math
from pathlib import Path

import pytest
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.drags import changes, joint_limits
from rosslt.markers.drags.drag import Drag
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.geometry import normalized, product, rotate_vector
from rosslt.markers.rviz.controls import handle_marker
from rosslt.markers.scene import joints, links
from rosslt.markers.scene.handle import BODY, POINTS, Settings
from rosslt.markers.scene.numbers import NumbersHandle
from rosslt.markers.scene.scene import Scene
from rosslt.node.change import change_request
from rosslt.node.robot_description import read_robot
from support.processes import wait_until
from support.scenery import take

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


ARM = """
<robot name="arm">
  <link name="world"/><link name="lamp"/>
  <link name="hand"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <link name="fore">
    <visual>
      <origin xyz="0.25 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.05" length="0.4"/></geometry><material name="red"/>
    </visual>
    <visual><origin xyz="0.75 0 0.2"/><geometry><mesh filename="package://arm/fore.stl"/></geometry></visual>
  </link>
  <material name="red"><color rgba="1 0 0 1"/></material>
  <joint name="mast" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/></joint>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="fore"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="0" upper="2"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="flange"/><origin xyz="1 0 0"/></joint>
  <joint name="grasp" type="fixed"><parent link="flange"/><child link="hand"/><axis xyz="0 0 0"/></joint>
  <joint name="finger" type="prismatic">
    <parent link="hand"/><child link="tip"/><origin xyz="0.1 0 0"/><axis xyz="0 1 0"/><limit lower="0" upper="0.1"/>
    <mimic joint="elbow" multiplier="0.02" offset="0.01"/>
  </joint>
  <joint name="bulb" type="fixed"><parent link="base"/><child link="lamp"/></joint>
</robot>
"""


LAMP = """
<link name="lamp">
  <visual><origin xyz="0 0 0.5"/><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
</link>
"""


@pytest.fixture
def crane(monkeypatch):
    describe(monkeypatch, {'/robot_description': URDF})


def scene_of(name, present, topic='/joint_states', scene=None):
    """A scene with a joint whose position is tracked."""
    scene = scene or Scene(Settings())
    take(scene, topic, JointState(name=[name], position=[tracked(present)]))
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
    assert [name for name in scene.names() if 'link' not in name] == ['/left/arm/joint_states:tower']


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


@pytest.fixture
def arm(monkeypatch):
    describe(monkeypatch, {'/robot_description': ARM})


def source(number):
    return values.Source('/owner', number)


def states(scene, **positions):
    """Have a scene take the positions of joints."""
    take(scene, '/joint_states', JointState(name=list(positions), position=list(positions.values())))
    return scene


def pose_of(**positions):
    """The handles of an arm, whose joints have these positions."""
    scene = states(Scene(Settings()), **positions)
    return {name[len('/joint_states:') :]: scene.handle(name) for name in scene.names()}


def standing(shoulder=0.5, elbow=1.0):
    return {'shoulder': values.track(shoulder, source(1)), 'elbow': values.track(elbow, source(2))}


def planned(monkeypatch, handle, pose, bounds=None, **moved):
    """{number of a source: its value} of a drag to a pose."""
    monkeypatch.setattr(
        changes.node, 'limits', lambda sources, timeout: {'bounds': dict(bounds or {}), 'read_only': []}
    )
    tracked, targets = handle.wanted(pose, **{'moved': False, 'turned': False, **moved})
    plan = changes.plan(tracked, targets, limited=handle.limits)
    joint_limits.check(handle.limits, plan.after)
    return {one.location_id: value for one, value in plan.after.items()}, plan


def moved_to(handle, x, y, z):
    return (x, y, z, *handle.pose[3:])


def test_joints_and_links_with_a_shape_or_at_an_end_have_handles(arm):
    handles = pose_of(**standing())
    assert set(handles) == {'shoulder', 'elbow', 'finger', 'link fore', 'link hand', 'link tip'}
    hand = handles['link hand']
    place = math.cos(0.5) + math.cos(1.5), math.sin(0.5) + math.sin(1.5), 1.0
    assert (hand.frame, hand.pose[:3]) == ('world', pytest.approx(place))
    assert hand.pose[3:] == pytest.approx((0.0, 0.0, math.sin(0.75), math.cos(0.75)))


def test_a_link_is_grabbed_in_the_middle_of_its_shapes(arm):
    fore = pose_of(**standing(elbow=0.0))['link fore']
    middle = (1.5 * math.cos(0.5), 1.5 * math.sin(0.5), 1.1)
    assert fore.pose[:3] == pytest.approx(middle)
    cylinder, mesh = fore.shapes()
    assert (cylinder.type, mesh.type) == (Marker.CYLINDER, Marker.MESH_RESOURCE)
    assert mesh.mesh_resource == 'package://arm/fore.stl'
    assert (cylinder.pose.position.x, cylinder.pose.position.z) == pytest.approx((-0.25, -0.1))
    assert (cylinder.pose.orientation.y, cylinder.pose.orientation.w) == pytest.approx((0.5**0.5, 0.5**0.5))
    assert (cylinder.color.r, cylinder.color.g) == (1.0, 0.0)
    assert cylinder.scale.z > 0.4, 'larger than what it covers'
    assert cylinder.color.a < 0.5


def test_the_ring_of_a_joint_is_a_part_of_its_link_if_that_has_a_handle(arm):
    handles = pose_of(**standing())
    assert (handles['elbow'].thing, handles['elbow'].level) == (handles['link fore'].name, POINTS)
    assert (handles['shoulder'].thing, handles['shoulder'].level) == (handles['shoulder'].name, BODY)
    assert (handles['finger'].thing, handles['finger'].level) == (handles['finger'].name, BODY)


def test_a_hand_that_is_pulled_moves_the_joints_before_it(arm, monkeypatch):
    hand = pose_of(**standing())['link hand']
    after, plan = planned(monkeypatch, hand, moved_to(hand, 1.0, 1.2, 1.0), moved=True)
    assert plan.is_exact
    shoulder, elbow = after[1], after[2]
    assert math.cos(shoulder) + math.cos(shoulder + elbow) == pytest.approx(1.0)
    assert math.sin(shoulder) + math.sin(shoulder + elbow) == pytest.approx(1.2)


def test_a_hand_that_is_turned_turns_the_joints_before_it(arm, monkeypatch):
    hand = pose_of(**standing())['link hand']
    pose = (*hand.pose[:3], 0.0, 0.0, math.sin(0.85), math.cos(0.85))
    after, plan = planned(monkeypatch, hand, pose, turned=True)
    assert plan.is_exact
    assert after.get(1, 0.5) + after.get(2, 1.0) == pytest.approx(1.7)


@pytest.mark.parametrize('elbow', [0.0, 1.0], ids=['stretched out', 'bent'])
def test_a_flat_arm_has_no_way_up_and_one_ring(arm, elbow):
    handles = pose_of(**standing(elbow=elbow))
    motions = handles['link hand'].motions(lambda _value: True)
    assert motions.axes == motions.arrows == (True, True, False)
    assert [ring.name for ring in motions.rings] == ['z']
    motions = handles['link fore'].motions(lambda _value: True)
    assert (motions.axes, motions.rings) == ((True, True, False), ()), 'it has that of its joint'


def test_joints_that_take_no_change_move_nothing(arm):
    def takes(value):
        return source(1) not in values.sources(value)

    handles = pose_of(**standing())
    assert not handles['shoulder'].motions(takes).rings
    assert handles['link hand'].motions(takes).axes == (True, True, False)
    assert not handles['link hand'].motions(lambda _value: False).are_any
    plain = pose_of(shoulder=0.5, elbow=standing()['elbow'])
    assert 'shoulder' not in plain
    (value,) = plain['link hand'].tracked
    assert values.sources(value) == [source(2)]


def test_a_pull_stops_at_the_limits_of_the_joints(arm, monkeypatch):
    hand = pose_of(**standing(shoulder=1.8, elbow=0.2))['link hand']
    bounds = {source(1): (None, 1.9)}
    after, plan = planned(monkeypatch, hand, moved_to(hand, -2.0, 0.0, 1.0), bounds, moved=True)
    assert (after[1], plan.is_exact) == (1.9, False)
    assert 0.0 <= after[2] <= 2.0
    after, plan = planned(monkeypatch, hand, moved_to(hand, -2.0, 0.0, 1.0), moved=True)
    assert (after[1], plan.is_exact) == (2.0, False)


def test_the_limits_of_a_joint_in_degrees_are_those_of_its_source(arm, monkeypatch):
    degrees = values.track(100.0, source(1))
    hand = pose_of(shoulder=degrees * (-math.pi / 180) + 3.0, elbow=0.0)['link hand']
    after, plan = planned(monkeypatch, hand, moved_to(hand, 2 * math.cos(2.5), 2 * math.sin(2.5), 1.0), moved=True)
    assert (after, plan.is_exact) == ({1: pytest.approx((3.0 - 2.0) * 180 / math.pi)}, False)


def test_a_pull_beyond_limits_that_no_bound_says_is_refused(arm, monkeypatch):
    both = values.track(1.0, source(1)) + values.track(0.9, source(2))
    hand = pose_of(shoulder=both, elbow=0.0)['link hand']
    with pytest.raises(values.NotInvertible, match=r'shoulder would come to 2\.5, beyond its maximum 2\.0'):
        planned(monkeypatch, hand, moved_to(hand, 2 * math.cos(2.5), 2 * math.sin(2.5), 1.0), moved=True)


def test_a_joint_that_is_beyond_its_limits_may_stay_there_in_a_pull(arm, monkeypatch):
    hand = pose_of(shoulder=standing(shoulder=2.5)['shoulder'], elbow=0.0)['link hand']
    after, plan = planned(monkeypatch, hand, moved_to(hand, 2 * math.cos(2.6), 2 * math.sin(2.6), 1.0), moved=True)
    assert (after.get(1, 2.5), plan.is_exact) == (pytest.approx(2.5), False)
    after, plan = planned(monkeypatch, hand, moved_to(hand, 2 * math.cos(2.3), 2 * math.sin(2.3), 1.0), moved=True)
    assert (after, plan.is_exact) == ({1: pytest.approx(2.3)}, True)


def test_a_message_with_some_joints_has_handles_in_the_frame_of_a_link(arm):
    handles = pose_of(elbow=standing()['elbow'])
    assert {name: (handles[name].frame, handles[name].pose[:3]) for name in ('elbow', 'link hand')} == {
        'elbow': ('upper', pytest.approx((1.0, 0.0, 0.0))),
        'link hand': ('upper', pytest.approx((1.0 + math.cos(1.0), math.sin(1.0), 0.0))),
    }


def test_a_joint_that_mimics_another_is_that_one(arm):
    finger = pose_of(**standing())['finger']
    (value,) = finger.tracked
    assert (value, values.sources(value)) == (pytest.approx(0.03), [source(2)])


def test_joints_of_one_robot_are_no_others_of_each_other(arm):
    scene = states(Scene(Settings()), **standing())
    assert [set(), set()] == scene.shared(scene.handle('/joint_states:link hand'))


def test_a_view_that_draws_the_robot_draws_what_does_not_move_as_well(arm, monkeypatch):
    describe(monkeypatch, {'/robot_description': ARM.replace('<link name="lamp"/>', LAMP)})
    for draws_all in (False, True):
        scene = states(Scene(Settings(draws_all=draws_all)), elbow=tracked(1.0))
        lamp, fore = scene.handle('/joint_states:link lamp'), scene.handle('/joint_states:link fore')
        assert (lamp is not None) == draws_all
        assert fore.draws_thing == draws_all
        assert (fore.shapes()[0].color.a == 1.0) == draws_all
    assert not lamp.motions(lambda _value: True).are_any
    assert lamp.pose[:3] == pytest.approx((0.0, 0.0, 1.5))


def test_what_mimics_a_joint_stays_within_its_limits_as_well(arm, monkeypatch):
    describe(monkeypatch, {'/robot_description': ARM.replace('upper="0.1"', 'upper="0.03"')})
    handles = pose_of(**standing(elbow=0.5))
    elbow = handles['elbow']
    turn = product(elbow.pose[3:], (0.0, 0.0, math.sin(0.6), math.cos(0.6)))
    after, plan = planned(monkeypatch, elbow, (*elbow.pose[:3], *turn), turned=True)
    assert (after, plan.is_exact) == ({2: pytest.approx(1.0)}, False), 'the finger is at 0.03 then'


def test_messages_of_several_publishers_keep_each_others_handles(arm):
    scene = Scene(Settings(draws_all=True))
    shoulder = set(states(scene, shoulder=standing()['shoulder']).names())
    both = set(states(scene, elbow=standing()['elbow']).names())
    assert shoulder < both
    assert set(states(scene, shoulder=standing(1.0)['shoulder']).names()) == both
    assert scene.handle('/joint_states:link fore').frame == 'upper'


def test_handles_of_a_description_that_is_no_more_go(monkeypatch):
    parameters = {'/robot_description': ARM}
    describe(monkeypatch, parameters)
    scene = states(Scene(Settings()), **standing())
    parameters['/robot_description'] = ARM.replace('"hand"', '"gripper"')
    states(scene, **standing())
    assert '/joint_states:link gripper' in scene.names()
    assert '/joint_states:link hand' not in scene.names()
    parameters['/robot_description'] = '<robot/>'
    states(scene, **standing())
    assert not scene.names()


def test_positions_are_those_that_robot_state_publisher_takes(arm):
    assert pose_of(**standing(), finger=0.07)['link tip'].limits[-1].name == 'elbow', 'the finger is plain'
    scene = Scene(Settings())
    for names, positions, there in (
        (['elbow', 'elbow'], [tracked(0.5), tracked(1.0)], 0.5),
        (['elbow', 'shoulder'], [tracked(1.0)], 0.5),
    ):
        take(scene, '/joint_states', JointState(name=names, position=positions))
        (position,) = scene.handle('/joint_states:elbow').tracked
        assert position == there, names


def test_a_pull_beyond_a_limit_does_not_come_round_from_the_other_side(arm, monkeypatch):
    description = ARM.replace('lower="-2" upper="2"', 'lower="-2.9" upper="2.9"')
    describe(monkeypatch, {'/robot_description': description})
    for way in ('moved', 'turned'):
        shoulder = 2.5
        for step in range(26, 56):
            hand = pose_of(shoulder=standing(shoulder=shoulder)['shoulder'], elbow=0.0)['link hand']
            at, turn = step / 10, (0.0, 0.0, math.sin(step / 20), math.cos(step / 20))
            pose = (2 * math.cos(at), 2 * math.sin(at), 1.0, *turn)
            with contextlib.suppress(values.NotInvertible):
                after, _ = planned(monkeypatch, hand, pose, **{way: True})
                shoulder = after.get(1, shoulder)
            assert shoulder == pytest.approx(min(at, 2.9)), (way, at)


def test_a_hand_that_can_go_all_ways_is_turned_where_it_stands(monkeypatch):
    urdf = (Path(__file__).parents[2] / 'config' / 'robot.urdf').read_text(encoding='utf-8')
    describe(monkeypatch, {'/robot_description': urdf})
    rest = {'j1': 0.3, 'j2': -0.4, 'j3': 0.2, 'j4': -1.8, 'j5': 0.1, 'j6': 1.6, 'j7': 0.8}
    handles = pose_of(**{name: values.track(value, source(int(name[1]))) for name, value in rest.items()})
    hand = handles['link hand']
    turn = product((0.0, 0.0, math.sin(0.1), math.cos(0.1)), hand.pose[3:])
    after, plan = planned(monkeypatch, hand, (*hand.pose[:3], *turn), turned=True)
    assert plan.is_exact
    moved = pose_of(**{name: values.track(after.get(int(name[1]), value), source(1)) for name, value in rest.items()})
    assert moved['link hand'].pose == pytest.approx((*hand.pose[:3], *turn))


def test_the_place_of_a_link_with_its_provenance_is_where_it_stands(arm):
    urdf = (Path(__file__).parents[2] / 'config' / 'robot.urdf').read_text(encoding='utf-8')
    for text, names in ((urdf, [*(f'j{number}' for number in range(1, 8)), 'left']), (ARM, ['shoulder', 'elbow'])):
        positions = {name: values.track(0.1 + 0.3 * index, source(index)) for index, name in enumerate(names)}
        robot = read_robot(text)
        pose = links.RobotPose('/joint_states', robot, positions, Settings())
        for link in robot.holding:
            place = pose.plain.link(link)
            there, turned = pose.with_provenance(link, (0.1, -0.2, 0.3))
            offset = rotate_vector(place.rotation, (0.1, -0.2, 0.3))
            assert list(map(float, there)) == pytest.approx([a + b for a, b in zip(place.position, offset)])
            assert list(map(float, turned)) == pytest.approx(place.rotation), link
            moving = {found for joint in place.moved_by for found in values.sources(pose.position(joint))}
            assert set(values.sources([there, turned])) == moving


def test_what_a_joint_cannot_move_does_not_come_from_it(arm):
    robot = read_robot(ARM)
    pose = links.RobotPose('/joint_states', robot, standing(), Settings())
    (_, _, z), (x, y, _, _) = pose.with_provenance('hand', (0.0, 0.0, 0.5))
    assert (z, x, y) == (1.5, 0.0, 0.0)
    assert not values.sources([z, x, y])


def test_joints_that_are_moved_by_name_stop_at_their_limits():
    found = read_robot(URDF).joints
    handle = NumbersHandle('/command', [tracked(2.0), tracked(9.0)], [found['boom'], None])
    drag = Drag(handle, 1.0)
    drag.move('', (3.0, 20.0))
    numbers, targets, told = drag.wanted(handle, drag.pose)
    assert (numbers, targets) == ([2.0, 9.0], [2.4, 20.0])
    assert told == 'boom is at its maximum 2.4 in robot_description'
