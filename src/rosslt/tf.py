"""tf2's transforms and the usual functions of quaternions, for tracked values: what is given in a moving frame can be
dragged in a fixed one.

tf2_geometry_msgs transforms in C++, where provenance is lost. The functions here have its names, arguments and results.
Importing this module has `tf2_ros.Buffer.transform` use them:

    from rosslt import tf
    tip = buffer.transform(tip_in_gripper, 'world', rospy.Duration(0.1))

Quaternions are sequences or messages with x, y, z and w, and come out as tuples, for `Quaternion(*q)`. The functions
for them have the names that they have in tf.transformations. Every value may be tracked, those of the transform too.
"""

import contextlib
import functools
import operator

import tf2_ros
from geometry_msgs.msg import PointStamped, PoseStamped, Quaternion, Vector3, Vector3Stamped, WrenchStamped

from rosslt.values import MATH, is_tracked, untracked

with contextlib.suppress(ImportError):
    # It registers its functions where it is imported: before ours, so that ours stay.
    import tf2_geometry_msgs  # noqa: F401

_sin, _cos, _atan2, _hypot = (MATH[name] for name in ('sin', 'cos', 'atan2', 'hypot'))

#: A quaternion this near to straight up or down, against its own length, does not tell roll from yaw.
_GIMBAL_LOCK = 1e-15


def do_transform_point(point, transform):
    """A PointStamped in the frame that a TransformStamped leads to."""
    result = PointStamped(header=transform.header)
    _place(result.point, point.point, transform.transform)
    return result


def do_transform_vector3(vector3, transform):
    """A Vector3Stamped in the frame that a TransformStamped leads to: a direction, which no translation moves."""
    result = Vector3Stamped(header=transform.header)
    _turn(result.vector, vector3.vector, transform.transform)
    return result


def do_transform_pose(pose, transform):
    """A PoseStamped in the frame that a TransformStamped leads to.

    The orientation has the sign that tf2_geometry_msgs gives it.
    """
    result = PoseStamped(header=transform.header)
    _place(result.pose.position, pose.pose.position, transform.transform)
    turned = quaternion_multiply(transform.transform.rotation, pose.pose.orientation)
    if _is_other_sign(untracked(turned)):
        turned = tuple(-part for part in turned)
    result.pose.orientation = Quaternion(*turned)
    return result


def do_transform_wrench(wrench, transform):
    """A WrenchStamped in the frame that a TransformStamped leads to: its vectors turned."""
    result = WrenchStamped(header=transform.header)
    _turn(result.wrench.force, wrench.wrench.force, transform.transform)
    _turn(result.wrench.torque, wrench.wrench.torque, transform.transform)
    return result


def quaternion_from_euler(roll, pitch, yaw):
    """The quaternion of a rotation around the fixed axes x, then y, then z."""
    return quaternion_multiply(
        quaternion_about_axis(yaw, (0, 0, 1)),
        quaternion_multiply(quaternion_about_axis(pitch, (0, 1, 0)), quaternion_about_axis(roll, (1, 0, 0))),
    )


def euler_from_quaternion(quaternion):
    """(roll, pitch, yaw) around the fixed axes x, then y, then z; any length of the quaternion will do."""
    (xx, _, _), (yx, yy, yz), (zx, zy, zz) = _matrix(quaternion)
    level = _hypot(xx, yx)
    if level > _GIMBAL_LOCK * sum(part * part for part in _xyzw(quaternion)):
        return _atan2(zy, zz), _atan2(-zx, level), _atan2(yx, xx)
    return _atan2(-yz, yy), _atan2(-zx, level), 0.0


def quaternion_about_axis(angle, axis):
    """The quaternion of a rotation by an angle around an axis, a sequence or message of any length but zero."""
    axis = _xyz(axis)
    length = _hypot(*axis)
    sine = _sin(angle / 2)
    return (*(_products((sine, part / length)) for part in axis), _cos(angle / 2))


def quaternion_multiply(second, first):
    """The rotation `first`, and then `second`."""
    (x2, y2, z2, w2), (x1, y1, z1, w1) = _xyzw(second), _xyzw(first)
    return (
        _products((w2, x1), (x2, w1), (y2, z1), (-z2, y1)),
        _products((w2, y1), (-x2, z1), (y2, w1), (z2, x1)),
        _products((w2, z1), (x2, y1), (-y2, x1), (z2, w1)),
        _products((w2, w1), (-x2, x1), (-y2, y1), (-z2, z1)),
    )


def quaternion_conjugate(quaternion):
    """The rotation back, of a quaternion of length 1."""
    x, y, z, w = _xyzw(quaternion)
    return -x, -y, -z, w


def quaternion_inverse(quaternion):
    """The rotation back, of a quaternion of any length but zero."""
    square = sum(part * part for part in _xyzw(quaternion))
    return tuple(part / square for part in quaternion_conjugate(quaternion))


def rotated(vector, quaternion):
    """A vector, given as a sequence or message with x, y and z, turned by a quaternion of length 1: a tuple."""
    vector = _xyz(vector)
    return tuple(_products(*zip(row, vector)) for row in _matrix(quaternion))


def _products(*pairs):
    """The sum of the products of pairs. What a plain 0 multiplies counts for nothing, and does not become a source."""
    counting = [a * b for a, b in pairs if not (_is_zero(a) or _is_zero(b))]
    return functools.reduce(operator.add, counting) if counting else 0.0


def _is_zero(number):
    return number == 0 and not is_tracked(number)


def _xyzw(quaternion):
    return (quaternion.x, quaternion.y, quaternion.z, quaternion.w) if hasattr(quaternion, 'w') else quaternion


def _xyz(vector):
    return (vector.x, vector.y, vector.z) if hasattr(vector, 'z') else vector


def _matrix(quaternion):
    """The rows of the rotation matrix, as KDL has them."""
    x, y, z, w = _xyzw(quaternion)
    return (
        (w * w + x * x - y * y - z * z, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y),
        (2 * x * y + 2 * w * z, w * w - x * x + y * y - z * z, 2 * y * z - 2 * w * x),
        (2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, w * w - x * x - y * y + z * z),
    )


def _turn(result, vector, transform):
    result.x, result.y, result.z = rotated(vector, transform.rotation)


def _place(result, point, transform):
    turned, by = Vector3(), transform.translation
    _turn(turned, point, transform)
    result.x, result.y, result.z = turned.x + by.x, turned.y + by.y, turned.z + by.z


def _is_other_sign(quaternion):
    """Whether KDL gives a rotation's quaternion with the other sign: it has the part positive that it divides by."""
    x, y, z, w = quaternion
    (xx, _, _), (_, yy, _), (_, _, zz) = _matrix(quaternion)
    if xx + yy + zz > 1e-12:
        return w < 0
    return (x if xx > yy and xx > zz else y if yy > zz else z) < 0


for _stamped, _transform in (
    (PointStamped, do_transform_point),
    (Vector3Stamped, do_transform_vector3),
    (PoseStamped, do_transform_pose),
    (WrenchStamped, do_transform_wrench),
):
    tf2_ros.TransformRegistration().add(_stamped, _transform)
