"""tf2_ros' broadcasters, whose transforms keep provenance."""

from typing import Any

import tf2_ros
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from rosslt.node.topics.topics import Publisher

# The __init__ of tf2_ros' classes makes a plain publisher and nothing else; those here make one that keeps provenance.


class TransformBroadcaster(tf2_ros.TransformBroadcaster):
    """`tf2_ros.TransformBroadcaster`, whose transforms keep provenance.

    It also takes what `tf.TransformBroadcaster`, the older one, takes.
    """

    def __init__(self, queue_size: int = 100) -> None:
        self.pub_tf = Publisher('/tf', TFMessage, queue_size=queue_size)

    def sendTransform(self, *transform: Any, **named: Any) -> None:  # noqa: N802 (tf2_ros' name)
        """Broadcast a TransformStamped or a list of them; or, as in tf, `translation, rotation, time, child, parent`.

        Args:
            translation, rotation: `(x, y, z)` in metres, `(x, y, z, w)`.
            time: a rospy.Time.
            child, parent: the names of the frames.
        """
        if len(transform) + len(named) == 1:
            super().sendTransform(*transform, **named)
        else:
            self.sendTransformMessage(_stamped(*transform, **named))

    def sendTransformMessage(self, transform: TransformStamped) -> None:  # noqa: N802 (tf's name)
        """Broadcast a TransformStamped, as `tf.TransformBroadcaster.sendTransformMessage` does."""
        super().sendTransform([transform])


class StaticTransformBroadcaster(tf2_ros.StaticTransformBroadcaster):
    """`tf2_ros.StaticTransformBroadcaster`, whose transforms keep provenance.

    The topic is latched: when a source of the transforms changes, they are broadcast again.
    """

    def __init__(self) -> None:
        self.pub_tf = Publisher('/tf_static', TFMessage, queue_size=100, latch=True)


def _stamped(translation: object, rotation: object, time: object, child: str, parent: str) -> TransformStamped:
    transform = Transform(Vector3(*translation), Quaternion(*rotation))
    return TransformStamped(Header(stamp=time, frame_id=parent), child, transform)
