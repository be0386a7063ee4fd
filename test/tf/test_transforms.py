"""`rosslt.tf` gives what tf2_geometry_msgs gives, and keeps provenance."""

import math

import PyKDL
import pytest
import rospy
import tf2_geometry_msgs
import tf2_ros
from geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)
from hypothesis import assume, given
from hypothesis import strategies as st
from std_msgs.msg import Header

import rosslt
from rosslt import values

#: Against the size of what is transformed: PyKDL has the products and sums in the same order, but for the quaternion,
#: whose way leads through a matrix there.
PRECISION = 1e-14
QUATERNION_PRECISION = 1e-9

coordinates = st.floats(-1e3, 1e3)


@st.composite
def quaternions(draw):
    """Of length 1, as those of rotations are."""
    parts = [draw(st.floats(-1, 1)) for _ in range(4)]
    length = math.sqrt(sum(part * part for part in parts))
    assume(length > 0.1)
    return Quaternion(*(part / length for part in parts))


points = st.builds(Point, coordinates, coordinates, coordinates)
vectors = st.builds(Vector3, coordinates, coordinates, coordinates)
transforms = st.builds(
    TransformStamped,
    st.just(Header(frame_id='world')),
    st.just('gripper'),
    st.builds(Transform, vectors, quaternions()),
)


def tracked(message):
    """A message whose every number is a location of its own, and those locations."""
    sources = iter(range(100))

    def with_source(part):
        for name, slot in zip(part.__slots__, part._slot_types):
            if slot == 'float64':
                setattr(part, name, rosslt.track(getattr(part, name), rosslt.Source('/gripper', next(sources))))
            elif slot.startswith('geometry_msgs/'):
                with_source(getattr(part, name))
        return part

    return with_source(rosslt.untracked(message))


def check(stamped, transform, ours, theirs, precision=PRECISION):
    """Ours gives what theirs gives, of plain values and tracked ones, and all numbers know where they come from."""
    expected = values.leaves(theirs(stamped, transform))
    size = max([1.0] + [abs(leaf) for _, leaf in values.leaves([stamped, transform]) if type(leaf) is float])
    result = ours(tracked(stamped), transform)
    for got in (values.leaves(ours(stamped, transform)), values.leaves(rosslt.untracked(result))):
        assert [path for path, _ in got] == [path for path, _ in expected]
        for (path, leaf), (_, wanted) in zip(got, expected):
            assert leaf == wanted or abs(leaf - wanted) <= precision * size * 10, path
    assert all(rosslt.is_tracked(leaf) for path, leaf in values.leaves(result) if not path.startswith('header'))


@given(points, transforms)
def test_a_point_is_transformed_as_by_tf2(point, transform):
    check(PointStamped(point=point), transform, rosslt.tf.do_transform_point, tf2_geometry_msgs.do_transform_point)


@given(vectors, transforms)
def test_a_vector_is_transformed_as_by_tf2(vector, transform):
    check(
        Vector3Stamped(vector=vector), transform, rosslt.tf.do_transform_vector3, tf2_geometry_msgs.do_transform_vector3
    )


@given(vectors, vectors, transforms)
def test_a_wrench_is_transformed_as_by_tf2(force, torque, transform):
    check(
        WrenchStamped(wrench=Wrench(force, torque)),
        transform,
        rosslt.tf.do_transform_wrench,
        tf2_geometry_msgs.do_transform_wrench,
    )


@given(points, quaternions(), transforms)
def test_a_pose_is_transformed_as_by_tf2(point, quaternion, transform):
    pose = PoseStamped(pose=Pose(point, quaternion))
    result = rosslt.tf.do_transform_pose(pose, transform).pose.orientation
    assume(not is_half_turn(result))
    check(pose, transform, rosslt.tf.do_transform_pose, tf2_geometry_msgs.do_transform_pose, QUATERNION_PRECISION)


def is_half_turn(quaternion):
    """Whether rounding decides which sign KDL gives the quaternion: both are the same rotation."""
    rotation = PyKDL.Rotation.Quaternion(quaternion.x, quaternion.y, quaternion.z, quaternion.w)
    diagonal = sorted(rotation[axis, axis] for axis in range(3))
    return abs(sum(diagonal)) < 1e-9 or diagonal[2] - diagonal[1] < 1e-9


@given(points, transforms, points)
def test_a_point_of_a_moving_frame_is_dragged_in_the_fixed_one(point, transform, wanted):
    moving = tracked(PointStamped(point=point))
    seen = rosslt.tf.do_transform_point(moving, transform).point
    change = rosslt.solve(seen, wanted)
    dragged = rosslt.evaluate(seen, change)
    for axis in 'xyz':
        assert getattr(dragged, axis) == pytest.approx(getattr(wanted, axis), rel=1e-9, abs=1e-6)


@given(transforms)
def test_a_transform_that_is_tracked_itself_keeps_its_provenance(transform):
    seen = rosslt.tf.do_transform_point(PointStamped(point=Point(1.0, 2.0, 3.0)), tracked(transform)).point
    *rotation, translation = rosslt.sources(seen.x)
    assert len(rotation) == 4
    assert rosslt.evaluate(seen.x, {translation: 0.0}) == pytest.approx(
        seen.x - transform.transform.translation.x, abs=1e-9
    )


def test_what_does_not_depend_on_a_number_does_not_have_it_as_a_source():
    turn = TransformStamped(transform=Transform(Vector3(), Quaternion(0.0, 0.0, math.sin(0.2), math.cos(0.2))))
    point = tracked(PointStamped(point=Point(1.0, 2.0, 3.0)))
    seen = rosslt.tf.do_transform_point(point, turn).point
    assert [len(rosslt.sources(part)) for part in (seen.x, seen.y, seen.z)] == [2, 2, 1]


def test_a_buffer_uses_them():
    buffer = tf2_ros.Buffer(debug=False)
    half_turn = Transform(Vector3(1, 2, 3), Quaternion(0, 0, 1, 0))
    buffer.set_transform_static(TransformStamped(Header(frame_id='world'), 'gripper', half_turn), 'test')
    point = tracked(PointStamped(header=Header(frame_id='gripper', stamp=rospy.Time(0)), point=Point(1.0, 0.0, 0.0)))
    seen = buffer.transform(point, 'world').point
    assert (seen.x, seen.y, seen.z) == (0.0, 2.0, 3.0)
    assert rosslt.solve(seen.x, -1.0) == {rosslt.Source('/gripper', 0): 2.0}
