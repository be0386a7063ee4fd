"""Arrays of objects in messages that NumPy serializes are sent by their values."""

import io

import genpy
import numpy
import pytest
from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Float64MultiArray, Int8MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from rosslt import Source, sources, track
from rosslt.messages import decode, packed_arrays, set_leaves, tracked_fields, tracked_type, wrap
from rosslt.node.topics.serialization import serializer
from support.filling import assert_arrived, serialized

# genpy's classes call it
pytestmark = pytest.mark.filterwarnings('ignore:tostring')

X = track(0.75, Source('/n', 1))


def arrived(message, cls):
    """What a subscriber of the ordinary class gets."""
    received = decode(serialized(serializer(type(message))(message)), cls)
    assert received.error is None
    return received.message


def test_tracked_elements_arrive_by_value_with_their_sources():
    sent = numpy_msg(Float64MultiArray)(data=numpy.array([1.0, 2.0]) * X)
    assert arrived(sent, Float64MultiArray).data == (0.75, 1.5)
    assert_arrived(Float64MultiArray(data=[X * 1.0, X * 2.0]), arrived(sent, Float64MultiArray))
    assert sources(sent.data) == sources(X)  # the message is as it was


def test_32_bits_and_a_fixed_length_arrive_by_value():
    scan = numpy_msg(LaserScan)(ranges=numpy.array([X, 3.0], dtype=object), intensities=numpy.ones(1, numpy.float32))
    assert arrived(scan, LaserScan).ranges == (0.75, 3.0)
    assert arrived(scan, LaserScan).intensities == (1.0,)
    covariance = numpy.zeros(36, dtype=object)
    covariance[7] = X
    pose = numpy_msg(PoseWithCovarianceStamped)(pose=PoseWithCovariance(covariance=covariance))
    received = arrived(pose, PoseWithCovarianceStamped).pose.covariance
    assert received[7] == 0.75
    assert sources(received) == sources(X)


def test_arrays_within_arrays_of_messages_arrive_by_value():
    none = numpy.zeros(0)
    points = [
        JointTrajectoryPoint(positions=each, velocities=none, accelerations=none, effort=none)
        for each in (numpy.ones(2), numpy.ones(2) * X)
    ]
    sent = numpy_msg(JointTrajectory)(points=points)
    received = arrived(sent, JointTrajectory)
    assert [point.positions for point in received.points] == [(1.0, 1.0), (0.75, 0.75)]
    assert sent.points[1] is points[1]
    assert sources(points[1].positions) == sources(X)


def test_bytes_arrive_by_value():
    pixels = numpy.array([1, track(2, Source('/n', 2)), 255], dtype=object)
    assert list(arrived(numpy_msg(Image)(data=pixels), Image).data) == [1, 2, 255]


def test_a_tracked_type_of_numpy_arrives_by_value():
    cls = tracked_type(Float64MultiArray)
    sent = wrap(Float64MultiArray(data=numpy.ones(2) * X), numpy_msg(cls))
    received = decode(serialized(sent), cls).message
    assert received.data == (0.75, 0.75)
    assert sources(received.data[1]) == sources(X)


def test_other_values_of_its_leaves_leave_an_array_what_it_is():
    for sort in (list, tuple, lambda items: numpy.array(items, dtype=object)):
        data = sort([X, 3.0])
        message = Float64MultiArray(data=data)
        set_leaves(message, {index: 2 * value for index, value, _ in tracked_fields(message)})
        assert type(message.data) is type(data)
        assert list(message.data) == [1.5, 3.0]
        assert sources(message.data[0]) == sources(X)
        assert list(data) == [0.75, 3.0]
    sent = numpy_msg(Float64MultiArray)(data=numpy.array([X, 3.0], dtype=object))
    set_leaves(sent, {index: 2 * value for index, value, _ in tracked_fields(sent)})
    assert arrived(sent, Float64MultiArray).data == (1.5, 3.0)


@pytest.mark.parametrize('wrong', [300, 1.5, 'a'], ids=['too large', 'no integer', 'a text'])
def test_what_does_not_fit_the_field_is_an_error_that_names_it(wrong):
    message = numpy_msg(Int8MultiArray)(data=numpy.array([wrong], dtype=object))
    with pytest.raises(genpy.SerializationError, match='data'):
        serializer(type(message))(message).serialize(io.BytesIO())


def test_arrays_of_numbers_are_not_copied():
    for cls in (numpy_msg(Float64MultiArray), Float64MultiArray):
        message = cls(data=numpy.ones(2))
        assert packed_arrays(cls)(message) is message
