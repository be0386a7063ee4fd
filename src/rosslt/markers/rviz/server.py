"""The interactive marker server, with differences that drags and hundreds of moving markers need, and a clean end."""

import threading
from typing import Dict, Optional

import rospy
from geometry_msgs.msg import Pose
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
)


class Server(InteractiveMarkerServer):
    """interactive_markers' server, changed in five ways.

    A pose that RViz reports is not sent back to it: it would arrive late, and RViz would jump to it at the
    end of the drag. Two hands are kept apart by the drags: the original refuses any feedback in the first second of a
    marker. A pose that is set costs a pose: the original makes a whole marker for it, and logs it. Updates and the
    keep-alive messages between them are sent in the order of their numbers: the original counts and sends them in two
    threads at once, and RViz drops all markers for more than a second if it gets a number out of order. And the node
    may end at any moment: its last changes are made even if the signal has come in the middle of earlier ones, and
    topics that are closed already are not errors.

    Args:
        name: of its topics.
    """

    def __init__(self, name: str) -> None:
        self._poses: Dict[str, Pose] = {}
        super().__init__(name)
        self.mutex = threading.RLock()

    def setPose(self, name: str, pose: Pose) -> None:  # noqa: N802  (the name is the base class's)
        """Have a marker stand there, from the next `applyChanges` on."""
        self._poses[name] = pose

    def applyChanges(self) -> None:  # noqa: N802  (the name is the base class's)
        """Send what has changed."""
        with self.mutex:
            poses = {name: pose for name, pose in self._poses.items() if name not in self.pending_updates}
            self._poses = {}
            super().applyChanges()
            moved = []
            for name, pose in poses.items():
                context = self.marker_contexts.get(name)
                if context is not None:
                    context.int_marker.pose = pose
                    update = InteractiveMarkerPose()
                    update.header, update.pose, update.name = context.int_marker.header, pose, name
                    moved.append(update)
            if moved:
                self.seq_num += 1
                self.publish(InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.UPDATE, poses=moved))
                self.publishInit()

    def keepAlive(self, event: Optional[rospy.timer.TimerEvent]) -> None:  # noqa: N802  (the name is the base class's)
        """Say that the server is there, with the number of the last update."""
        with self.mutex:
            super().keepAlive(event)

    def publish(self, update: InteractiveMarkerUpdate) -> None:
        """Send an update, as long as the node runs."""
        try:
            super().publish(update)
        except Exception:  # rospy closes topics, and what is in them, while others publish
            if not rospy.is_shutdown():
                raise

    def publishInit(self) -> None:  # noqa: N802  (the name is the base class's)
        """Keep the present markers for viewers that connect later."""
        with self.mutex:
            markers = [context.int_marker for context in self.marker_contexts.values()]
        try:
            self.init_pub.publish(InteractiveMarkerInit(self.server_id, self.seq_num, markers))
        except Exception:
            if not rospy.is_shutdown():
                raise

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:  # noqa: N802  (the name is the base class's)
        """Hand on what RViz reports."""
        context = self.marker_contexts.get(feedback.marker_name)
        if context is not None:
            context.feedback_cbs.get(feedback.event_type, context.default_feedback_cb)(feedback)
