"""tf2 and the usual functions of quaternions, for tracked values.

`TransformBroadcaster`, `StaticTransformBroadcaster`, `Buffer` and `TransformListener` are tf2_ros' own with provenance:
a frame that is broadcast with tracked numbers is looked up with them, over chains of frames and between two samples.
What is looked up agrees with what tf2 says to 1e-9.

    from rosslt import tf
    buffer = tf.Buffer()
    listener = tf.TransformListener(buffer)
    tip = buffer.transform(tip_in_gripper, 'world', rospy.Duration(0.1))

tf2_geometry_msgs transforms in C++, where provenance is lost. The functions here have its names, arguments and results.
Importing this module has `tf2_ros.Buffer.transform` use them.

Quaternions are sequences or messages with x, y, z and w, and come out as tuples, for `Quaternion(*q)`. The functions
for them have the names that they have in tf.transformations. Every value may be tracked, those of the transform too.
"""

from rosslt.node.tf.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
from rosslt.node.tf.buffer import Buffer
from rosslt.node.tf.listener import TransformListener
from rosslt.node.tf.quaternions import (
    euler_from_quaternion,
    quaternion_about_axis,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_inverse,
    quaternion_multiply,
    rotated,
)
from rosslt.node.tf.transforms import (
    do_transform_point,
    do_transform_pose,
    do_transform_vector3,
    do_transform_wrench,
)

__all__ = [
    'Buffer',
    'StaticTransformBroadcaster',
    'TransformBroadcaster',
    'TransformListener',
    'do_transform_point',
    'do_transform_pose',
    'do_transform_vector3',
    'do_transform_wrench',
    'euler_from_quaternion',
    'quaternion_about_axis',
    'quaternion_conjugate',
    'quaternion_from_euler',
    'quaternion_inverse',
    'quaternion_multiply',
    'rotated',
]
