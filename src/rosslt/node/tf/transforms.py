"""tf2's transforms for tracked values: what is given in a moving frame can be dragged in a fixed one.

tf2_geometry_msgs transforms in C++, where provenance is lost. The functions here have its names, arguments and results,
and importing this module has `tf2_ros.Buffer.transform` use them. Every value may be tracked, those of the transform
too.
"""

import contextlib
from typing import Any

import tf2_ros
from geometry_msgs.msg import PointStamped, PoseStamped, Quaternion, Vector3, Vector3Stamped, WrenchStamped

from rosslt.messages import Message
from rosslt.node.tf.quaternions import quaternion_multiply, rotated, rotation_matrix
from rosslt.values import untracked

with contextlib.suppress(ImportError):
    # It registers its functions where it is imported: before ours, so that ours stay.
    import tf2_geometry_msgs  # noqa: F401


def do_transform_point(point: Message, transform: Message) -> Message:
    """A PointStamped in the frame that a TransformStamped leads to."""
    result = PointStamped(header=transform.header)
    _place(result.point, point.point, transform.transform)
    return result


def do_transform_vector3(vector3: Message, transform: Message) -> Message:
    """A Vector3Stamped in the frame that a TransformStamped leads to: a direction, which no translation moves."""
    result = Vector3Stamped(header=transform.header)
    _turn(result.vector, vector3.vector, transform.transform)
    return result


def do_transform_pose(pose: Message, transform: Message) -> Message:
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


def do_transform_wrench(wrench: Message, transform: Message) -> Message:
    """A WrenchStamped in the frame that a TransformStamped leads to: its vectors turned."""
    result = WrenchStamped(header=transform.header)
    _turn(result.wrench.force, wrench.wrench.force, transform.transform)
    _turn(result.wrench.torque, wrench.wrench.torque, transform.transform)
    return result


def _turn(result: Message, vector: object, transform: Message) -> None:
    result.x, result.y, result.z = rotated(vector, transform.rotation)


def _place(result: Message, point: Message, transform: Message) -> None:
    turned, by = Vector3(), transform.translation
    _turn(turned, point, transform)
    result.x, result.y, result.z = turned.x + by.x, turned.y + by.y, turned.z + by.z


def _is_other_sign(quaternion: Any) -> bool:
    """Return whether KDL returns the negative of a quaternion: KDL makes the part positive that it divides by."""
    x, y, z, w = quaternion
    (xx, _, _), (_, yy, _), (_, _, zz) = rotation_matrix(quaternion)
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
