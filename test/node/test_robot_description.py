"""Which joints a robot has, how far they may move, and what is forced of them."""

import math

import pytest
from geometry_msgs.msg import Point
from sensor_msgs.msg import JointState

from rosslt import node, values
from rosslt.node import robot_description
from rosslt.node.robot_description import read_robot

URDF = """
<robot name="arm">
  <joint name="base" type="continuous"><parent link="world"/>{limit}</joint>
  <joint name="elbow" type="revolute"><parent link="upper"/>{limit}</joint>
  <joint name="wrist" type="revolute"><parent link="lower"/></joint>
  <joint name="finger" type="prismatic"><parent link="hand"/><limit upper="0.04" effort="1" velocity="1"/></joint>
</robot>
"""
LIMIT = '<limit lower="-2.4" upper="2.4" effort="1" velocity="1"/>'
SOFT = '<safety_controller soft_lower_limit="-2" soft_upper_limit="3" k_velocity="1"/>'


def limits(limit):
    return {name: (joint.lower, joint.upper) for name, joint in read_robot(URDF.format(limit=limit)).joints.items()}


def test_limits_are_read_and_what_a_limit_does_not_mention_is_0():
    none = (-math.inf, math.inf)
    assert limits(LIMIT) == {'base': none, 'elbow': (-2.4, 2.4), 'wrist': none, 'finger': (0.0, 0.04)}


@pytest.mark.parametrize(
    ('written', 'read'),
    [(LIMIT + SOFT, (-2.0, 2.4)), (SOFT, (-2.0, 3.0)), (LIMIT + '<safety_controller k_velocity="1"/>', (-2.4, 2.4))],
)
def test_a_safety_controller_narrows_the_limits(written, read):
    assert limits(written)['elbow'] == read


def test_limits_that_leave_nothing_between_are_none():
    with pytest.raises(ValueError, match=r'the lower limit 1\.0 of the joint elbow is above the upper limit -1\.0'):
        limits('<limit lower="1" upper="-1"/>')


def fixed(name, parent, child):
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


@pytest.mark.parametrize(
    ('joints', 'told'),
    [
        (fixed('one', 'base', 'arm') + fixed('two', 'mast', 'arm'), 'the link arm hangs on two joints, one and two'),
        (fixed('one', 'base', 'arm') + fixed('two', 'arm', 'base'), 'the link (base|arm) hangs on itself'),
        (fixed('one', 'arm', 'arm'), 'the link arm hangs on itself'),
        (fixed('one', 'base', 'arm').replace('</', '<origin xyz="0 nan 0"/></'), 'the origin of the joint one is not'),
    ],
)
def test_a_robot_that_cannot_be_is_refused(joints, told):
    with pytest.raises(ValueError, match=told):
        read_robot(f'<robot>{joints}</robot>')


@pytest.fixture
def arm(monkeypatch):
    """Has `robot_description` in the namespace of all topics of `/lab`."""
    described = {'/lab/robot_description': URDF.format(limit=LIMIT)}
    monkeypatch.setattr(robot_description.rospy, 'has_param', described.__contains__)
    monkeypatch.setattr(robot_description.rospy, 'get_param', described.get)
    return JointState(name=['base', 'elbow'], position=[9.0, values.track(0.5, values.Source('/arm', 1))])


@pytest.mark.parametrize(
    ('path', 'wanted'),
    [
        ('position[1]', 9.0),
        ('/position[1]', 9.0),
        ('position', [0.0, 9.0]),
        ('position', (None, 9.0)),
        ('', JointState(position=[0.0, 9.0])),
    ],
)
def test_no_joint_is_forced_beyond_its_limits(arm, path, wanted):
    with pytest.raises(values.NotInvertible) as refused:
        node.check_joint_limits('/lab/arm/joint_states', arm, path, wanted)
    assert str(refused.value) == (
        '9.0 is above the limits of the joint elbow, which are -2.4 .. 2.4 in /lab/robot_description'
    )


@pytest.mark.parametrize(
    ('path', 'wanted'),
    [
        ('position[1]', 2.4),
        ('position[0]', 9.0),
        ('position', [9.0, None]),
        ('position', None),
        ('velocity', [9.0, 9.0]),
        ('velocity[1]', 9.0),
        ('header/seq', 9),
        ('', None),
        ('', JointState(position=None)),
    ],
)
def test_all_else_may_be_forced(arm, path, wanted):
    node.check_joint_limits('/lab/arm/joint_states', arm, path, wanted)


def test_a_joint_beyond_its_limits_is_forced_back_but_no_further_out(arm):
    arm.position[1] = 3.0
    for allowed in (3.0, 2.9, -2.4):
        node.check_joint_limits('/lab/joint_states', arm, 'position[1]', allowed)
    for refused in (3.1, -2.5):
        with pytest.raises(values.NotInvertible):
            node.check_joint_limits('/lab/joint_states', arm, 'position[1]', refused)


def test_without_a_description_there_are_no_limits(arm):
    node.check_joint_limits('/joint_states', arm, 'position[1]', 9.0)
    node.check_joint_limits('/lab/points', Point(), 'x', 9.0)
