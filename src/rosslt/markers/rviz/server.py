"""The interactive marker server, with two differences that drags need, and one for a clean end."""

import time
from typing import Any

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer

#: For how long after its last feedback a hand keeps other hands off a marker, in seconds.
OTHER_HAND_TIMEOUT = 1.0


class Server(InteractiveMarkerServer):
    """The server, but for three things.

    A pose that RViz reports is not sent back to it: it would arrive late, and RViz would jump to it at the
    end of the drag. And two hands are kept apart only where there are two: the original refuses any feedback
    in the first second of a marker. And the timer that says that the server is alive may find its topic closed when the
    node ends, which is no error.
    """

    def processFeedback(self, feedback: Any) -> None:  # noqa: N802  (the name is the base class's)
        """Hand on what RViz reports."""
        with self.mutex:
            context = self.marker_contexts.get(feedback.marker_name)
            if context is None:
                return
            now = time.monotonic()
            if (
                context.last_client_id not in ('', feedback.client_id)
                and now - context.last_feedback < OTHER_HAND_TIMEOUT
            ):
                return
            context.last_feedback, context.last_client_id = now, feedback.client_id
        callback = context.feedback_cbs.get(feedback.event_type, context.default_feedback_cb)
        callback(feedback)

    def keepAlive(self, event: Any) -> None:  # noqa: N802  (the name is the base class's)
        """Tell RViz that the server is alive, as long as the node is."""
        try:
            super().keepAlive(event)
        except Exception:  # rospy closes topics, and what is in them, while others publish
            if not rospy.is_shutdown():
                raise
