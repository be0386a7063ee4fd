"""The functions of quaternions give what those of tf.transformations give, and keep provenance."""

import math

import numpy
import pytest
from geometry_msgs.msg import Quaternion, Vector3
from hypothesis import assume, given
from hypothesis import strategies as st

import rosslt
from rosslt import tf
from tf import transformations

angles = st.floats(-math.pi, math.pi)
parts = st.floats(-1, 1)
quaternions = st.tuples(parts, parts, parts, parts).filter(lambda q: math.hypot(*q) > 0.1)
axes = st.tuples(parts, parts, parts).filter(lambda axis: math.hypot(*axis) > 0.1)


def located(numbers):
    """The numbers, each a location of its own."""
    return tuple(rosslt.track(number, rosslt.Source('/arm', index)) for index, number in enumerate(numbers))


def close(got, expected):
    assert [float(part) for part in got] == pytest.approx(list(expected), abs=1e-12)


def unit(quaternion):
    return tuple(numpy.array(quaternion) / math.hypot(*quaternion))


@given(angles, angles, angles)
def test_quaternion_from_euler(roll, pitch, yaw):
    for given_angles in ((roll, pitch, yaw), located((roll, pitch, yaw))):
        close(tf.quaternion_from_euler(*given_angles), transformations.quaternion_from_euler(roll, pitch, yaw))


@given(quaternions)
def test_euler_from_quaternion(quaternion):
    expected = transformations.euler_from_quaternion(unit(quaternion))
    assume(abs(math.cos(expected[1])) > 1e-6)
    for given_quaternion in (quaternion, located(quaternion), Quaternion(*quaternion)):
        got = tf.euler_from_quaternion(given_quaternion)
        assert [math.remainder(a - b, 2 * math.pi) for a, b in zip(got, expected)] == pytest.approx([0] * 3, abs=1e-9)


@pytest.mark.parametrize('pitch', [math.pi / 2, -math.pi / 2])
def test_euler_from_a_quaternion_that_points_straight_up_or_down(pitch):
    quaternion = tf.quaternion_from_euler(0.3, pitch, 0.0)
    close(tf.quaternion_from_euler(*tf.euler_from_quaternion(quaternion)), quaternion)


@given(quaternions, quaternions)
def test_quaternion_multiply(second, first):
    close(
        tf.quaternion_multiply(located(second), Quaternion(*first)), transformations.quaternion_multiply(second, first)
    )


@given(quaternions)
def test_quaternion_inverse_and_conjugate(quaternion):
    inverse = tf.quaternion_inverse(located(quaternion))
    close(inverse, transformations.quaternion_inverse(quaternion))
    close(tf.quaternion_conjugate(located(quaternion)), transformations.quaternion_conjugate(quaternion))
    close(tf.quaternion_multiply(inverse, quaternion), (0, 0, 0, 1))


@given(angles, axes)
def test_quaternion_about_axis(angle, axis):
    expected = transformations.quaternion_about_axis(angle, axis)
    close(tf.quaternion_about_axis(rosslt.track(angle, rosslt.Source('/arm', 0)), axis), expected)
    close(tf.quaternion_about_axis(angle, Vector3(*located(axis))), expected)


@given(axes, quaternions)
def test_rotated(vector, quaternion):
    quaternion = unit(quaternion)
    close(
        tf.rotated(Vector3(*located(vector)), Quaternion(*quaternion)),
        transformations.quaternion_matrix(quaternion)[:3, :3] @ numpy.array(vector),
    )


def test_turning_an_orientation_changes_the_angle_that_it_comes_from():
    yaw = rosslt.track(0.5, rosslt.Source('/arm', 7))
    orientation = Quaternion(*tf.quaternion_from_euler(0, 0, yaw))
    assert not rosslt.is_tracked(orientation.x)
    (changed,) = rosslt.solve(orientation, Quaternion(*transformations.quaternion_from_euler(0, 0, 1.25))).items()
    assert changed[0] == rosslt.Source('/arm', 7)
    assert changed[1] == pytest.approx(1.25)
