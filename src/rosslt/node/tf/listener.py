"""tf2_ros' listener, which hears where transforms come from."""

from typing import Any, List, Optional

import tf2_ros
from tf2_msgs.msg import TFMessage

from rosslt import messages
from rosslt.node.topics.serialization import is_sampled
from rosslt.node.topics.topics import Subscriber


class TransformListener(tf2_ros.TransformListener):
    """`tf2_ros.TransformListener`, which gives a `rosslt.tf.Buffer` transforms that keep provenance.

    Args:
        buffer: where transforms go; tf2_ros' own Buffer will do, and forgets where they come from.
        queue_size, buff_size, tcp_nodelay: as in `tf2_ros.TransformListener`.
    """

    def __init__(
        self, buffer: Any, queue_size: Optional[int] = None, buff_size: int = 65536, tcp_nodelay: bool = False
    ) -> None:
        # rospy has one reader for all subscribers of a topic in a process. These are there first, and read provenance.
        self._readers: List[Subscriber] = [
            Subscriber(topic, TFMessage, queue_size=queue_size, buff_size=buff_size, tcp_nodelay=tcp_nodelay)
            for topic in ('/tf', '/tf_static')
        ]
        self._last = messages.LastProvenance()
        super().__init__(buffer, queue_size, buff_size, tcp_nodelay)

    def callback(self, data: TFMessage) -> None:
        """Take transforms: those between whole messages with the provenance that they had last."""
        header = data._connection_header
        completed = self._last.completed(data, is_sampled(data), header['callerid'])
        completed._connection_header = header
        super().callback(completed)

    def unregister(self) -> None:
        """Stop listening."""
        super().unregister()
        while self._readers:
            self._readers.pop().unregister()
