"""tracked_type gives the tracked class of any message type, generated or made at run time."""

import genpy.dynamic
import pytest
import rosslt.msg
from geometry_msgs.msg import Point, Pose, PoseStamped, Twist
from std_msgs.msg import String

import rosslt
from rosslt import Error, Source, is_tracked, track
from rosslt.messages import BadHeader, UnknownType, is_tracked_type, plain_type, tracked_type, unwrap, wrap
from support.filling import Filling, assert_arrived, serialized

X = track(0.25, Source('/node', 1))


def test_the_generated_class_is_taken_first():
    assert rosslt.tracked_type('geometry_msgs/Pose') is rosslt.msg.PoseTracked
    assert tracked_type(Pose) is rosslt.msg.PoseTracked


def test_a_class_is_made_where_none_is_generated():
    made = tracked_type('geometry_msgs/Twist')
    assert made._type == 'rosslt/TwistTracked'
    assert plain_type(made) is Twist
    assert isinstance(made().data, Twist)
    assert tracked_type(Twist) is made


def test_a_made_class_is_like_the_generated_one():
    from rosslt.messages.tracked_types import _compiled

    texts = {'rosslt/PoseTracked': rosslt.msg.PoseTracked._full_text.split('\n' + '=' * 80)[0]}
    for part in rosslt.msg.PoseTracked._full_text.split('\n' + '=' * 80 + '\nMSG: ')[1:]:
        name, _, text = part.partition('\n')
        texts[name] = text
    made = _compiled('rosslt/PoseTracked', texts)
    assert made._md5sum == rosslt.msg.PoseTracked._md5sum
    assert made._full_text == rosslt.msg.PoseTracked._full_text
    pose = Filling(1).message(Pose)
    assert serialized(wrap(pose, made)) == serialized(wrap(pose, rosslt.msg.PoseTracked))


def test_a_tracked_class_is_its_own():
    assert tracked_type(rosslt.msg.PoseTracked) is rosslt.msg.PoseTracked
    assert tracked_type('rosslt/PoseTracked') is rosslt.msg.PoseTracked


def test_tracked_classes_can_be_told():
    assert is_tracked_type(rosslt.msg.PoseTracked)
    assert is_tracked_type(tracked_type(Twist))
    for other in (Pose, PoseStamped, String, rosslt.msg.Provenance, int, None):
        assert not is_tracked_type(other)
    with pytest.raises(TypeError, match='geometry_msgs/Pose is no tracked message type'):
        plain_type(Pose)


def test_a_type_with_a_name_that_is_taken_carries_its_package():
    sim = genpy.dynamic.generate_dynamic('turtlesim/Pose', 'float32 x\nfloat32 y\n')['turtlesim/Pose']
    made = tracked_type(sim)
    assert made._type == 'rosslt/TurtlesimPoseTracked'
    assert_arrived(sim(X, 1.0), unwrap(made().deserialize(serialized(wrap(sim(X, 1.0), made)))))


def test_a_class_that_a_bag_brings_along_will_do():
    recorded = genpy.dynamic.generate_dynamic('geometry_msgs/PoseStamped', PoseStamped._full_text)
    assert tracked_type(recorded['geometry_msgs/PoseStamped']) is rosslt.msg.PoseStampedTracked


def test_a_definition_that_has_changed_since_gets_a_class_of_its_own():
    old = genpy.dynamic.generate_dynamic('geometry_msgs/Pose', 'float64 x\n')['geometry_msgs/Pose']
    made = tracked_type(old)
    assert made is not rosslt.msg.PoseTracked
    assert made().deserialize(serialized(wrap(old(X), made))).data.x == 0.25


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('geometry_msgs/Pos', 'found no Python class of geometry_msgs/Pos|found no message type geometry_msgs/Pos'),
        ('no_such_package/Pose', 'found no message type no_such_package/Pose: looked for'),
        ('Pose', 'it must be a package and a type'),
    ],
)
def test_a_type_that_is_not_there_is_said(name, reason):
    with pytest.raises(UnknownType, match=reason):
        tracked_type(name)
    assert issubclass(UnknownType, Error)


def test_what_is_no_message_type_is_said():
    for other in (int, 3, Pose()):
        with pytest.raises((TypeError, UnknownType)):
            tracked_type(other)


def test_a_message_of_another_type_is_not_wrapped():
    with pytest.raises(TypeError, match='geometry_msgs/Pose for rosslt/PoseTracked, found one of type std_msgs/Strin'):
        wrap(String(), rosslt.msg.PoseTracked)


def test_a_wrapped_message_is_the_message_itself():
    pose = Pose(position=Point(X, 0, 0))
    assert wrap(pose, rosslt.msg.PoseTracked).data is pose
    assert is_tracked(pose.position.x)


def test_a_bad_header_leaves_the_message_untracked():
    tracked = rosslt.msg.PoseTracked()
    tracked.provenance.data = b'nonsense'
    with pytest.raises(BadHeader, match='found version 110, expected 1'):
        unwrap(tracked)
    assert not is_tracked(tracked.data)
