"""Which number of a field becomes which number of another one."""

import math

import pytest
from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped, Vector3Stamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64MultiArray, Header, Int32
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from rosslt.node import Heard
from rosslt.teach.devices import NotTaught
from rosslt.teach.matcher import Latest
from rosslt.teach.pairing import Field, paired


def heard(message, publisher='/node'):
    return Heard('/topic', publisher, message._type, message)


def numbers(wanted, path, measured, at, *publishers):
    """Paths of fields; :NAME is a joint."""
    pairs, left_out = paired(
        Field('/wanted', *path.split(':')),
        heard(wanted),
        Field('/measured', *at.split(':')),
        [heard(measured)] if not isinstance(measured, list) else list(map(heard, measured, publishers)),
    )
    return {pair.path: pair.number for pair in pairs}, left_out


def joints(**positions):
    return JointState(name=list(positions), position=list(positions.values()))


def trajectory(*names):
    return JointTrajectory(joint_names=list(names), points=[JointTrajectoryPoint(positions=[0.0] * len(names))])


def in_frame(kind, frame, **parts):
    return kind(header=Header(frame_id=frame), **parts)


def test_joints_of_a_trajectory_are_matched_by_name():
    found, left_out = numbers(trajectory('a', 'b'), 'points[0]/positions', joints(b=2.0, c=3.0, a=1.0), '')
    assert found == {'points[0].positions[0]': 1.0, 'points[0].positions[1]': 2.0}
    assert left_out == []


def test_joints_of_several_publishers_are_put_together():
    both = [joints(a=1.0), joints(b=2.0)]
    assert numbers(joints(a=0.0, b=0.0), '', both, '', '/arm', '/hand')[0] == {'position[0]': 1.0, 'position[1]': 2.0}
    with pytest.raises(NotTaught, match='/arm and /hand both send the joint a on /measured'):
        numbers(joints(a=0.0), '', [joints(a=1.0), joints(a=2.0)], '', '/arm', '/hand')


def test_one_joint_is_matched_alone_on_both_sides():
    wanted, measured = joints(a=0.0, b=0.0), joints(c=3.0, b=2.0)
    for path, one, at, expected in (
        (':b', measured, ':c', 3.0),
        (':b', measured, ':b', 2.0),
        (':b', measured, '', 2.0),
        (':b', measured, 'position', 2.0),
        (':b', trajectory('b'), 'points[0]/positions', 0.0),
        (':b', Int32(7), 'data', 7.0),
        ('position[1]', measured, ':c', 3.0),
    ):
        assert numbers(wanted, path, one, at) == ({'position[1]': expected}, [])
    assert numbers(Int32(), 'data', measured, ':b') == ({'data': 2}, [])


def test_a_joint_is_measured_by_the_one_publisher_that_has_it():
    both = [joints(a=1.0), joints(b=2.0)]
    assert numbers(joints(c=0.0), ':c', both, ':b', '/arm', '/hand')[0] == {'position[0]': 2.0}
    with pytest.raises(NotTaught, match='/arm and /hand both send the joint a on /measured'):
        numbers(joints(a=0.0), ':a', [joints(a=1.0), joints(a=2.0)], ':a', '/arm', '/hand')


def test_a_joint_in_two_sets_of_one_publisher_is_the_latest():
    latest = Latest({}, ())
    for message in (joints(a=1.0), joints(a=2.0, b=0.0), joints(a=3.0)):
        latest._note(heard(message))
    measured = [one.message for one, _ in latest.all('/topic')]
    for path in ('', ':a'):
        assert numbers(joints(a=0.0), path, measured, path, '/node', '/node')[0] == {'position[0]': 3.0}


def test_an_array_without_names_keeps_its_order():
    found, _ = numbers(Float64MultiArray(data=[0.0, 0.0]), 'data', joints(b=2.0, a=1.0), '')
    assert found == {'data[0]': 2.0, 'data[1]': 1.0}


def test_numbers_of_the_same_names_are_matched_whatever_the_types():
    measured = in_frame(Vector3Stamped, 'world')
    measured.vector.x, measured.vector.z = 1.0, 3.0
    found, _ = numbers(in_frame(PointStamped, '/world'), 'point', measured, 'vector')
    assert found == {'point.x': 1.0, 'point.y': 0.0, 'point.z': 3.0}


def test_a_whole_message_is_matched_without_its_header():
    measured = in_frame(PointStamped, 'world')
    measured.header.seq, measured.header.stamp.secs, measured.point.y = 7, 8, 2.0
    assert numbers(in_frame(PointStamped, ''), '', measured, '')[0] == {'point.x': 0.0, 'point.y': 2.0, 'point.z': 0.0}


def test_the_nearer_of_a_quaternion_and_its_negative_is_taken():
    wanted, measured = PoseStamped(), PoseStamped()
    wanted.pose.orientation.w = 1.0
    measured.pose.orientation.z, measured.pose.orientation.w = -0.6, -0.8
    found, _ = numbers(wanted, 'pose/orientation', measured, 'pose/orientation')
    assert (found['pose.orientation.z'], found['pose.orientation.w']) == (0.6, 0.8)


@pytest.mark.parametrize(
    ('wanted', 'path', 'measured', 'at', 'told'),
    [
        (
            Int32(),
            'data',
            Float64MultiArray(data=[1.5]),
            'data[0]',
            'what was measured: 1.5 is not a whole number',
        ),
        (Bool(), 'data', Int32(), 'data', '/wanted/data is a bool, and has no number'),
        (Int32(), 'data', Float64MultiArray(data=[math.inf]), 'data[0]', 'cannot become inf'),
        (Int32(), 'data', Float64MultiArray(), 'data[0]', '/measured has no field'),
        (PoseStamped(), 'pose', PoseWithCovarianceStamped(), 'pose', '/wanted/pose has position.x, .*, 2 more, which'),
        (Float64MultiArray(data=[1.0]), 'data', Float64MultiArray(), 'data', '/wanted/data has 1 elements'),
        (joints(a=1.0), '', joints(b=1.0), '', r'no joint of /wanted \(a\) is among those of /measured'),
        (joints(a=1.0), '', joints(a=1.0), 'velocity', '/wanted stands for its positions'),
        (joints(a=1.0), 'effort', joints(a=1.0), '', '/measured stands for its positions'),
        (joints(a=1.0), '', joints(a=1.0), 'position[0]', 'and /measured/position'),
        (joints(a=1.0), ':b', joints(a=1.0), ':a', '/wanted has no joint b; it has: a'),
        (joints(a=1.0), ':a', joints(b=1.0, c=1.0), ':a', '/measured has no joint a that was heard .*; it has: b, c'),
        (joints(a=1.0), ':a', joints(b=1.0), '', '/measured has no joint a that was heard .*; it has: b'),
        (joints(a=1.0), ':a', joints(a=1.0), 'velocity', '/wanted stands for its positions'),
        (joints(a=1.0), '', joints(a=1.0), ':a', r'/wanted is a float64\[\] and /measured:a a float64'),
        (in_frame(PointStamped, 'a'), 'point/x', in_frame(PointStamped, 'b'), 'point/x', "in the frame 'b' and"),
    ],
)
def test_what_does_not_fit_is_refused(wanted, path, measured, at, told):
    with pytest.raises(NotTaught, match=told):
        numbers(wanted, path, measured, at)


def test_who_is_meant_of_two_is_not_guessed():
    with pytest.raises(NotTaught, match='/a and /b send /measured, and it is not known whose is meant'):
        numbers(Int32(), 'data', [Int32(1), Int32(2)], 'data', '/a', '/b')
