"""The interactive marker server, with two differences that drags need."""

import time
from typing import Any

from interactive_markers.interactive_marker_server import InteractiveMarkerServer

#: For how long after its last feedback a hand keeps other hands off a marker, in seconds.
OTHER_HAND_TIMEOUT = 1.0


class Server(InteractiveMarkerServer):
    """The server, but for two things.

    A pose that RViz reports is not sent back to it: it would arrive late, and RViz would jump to it at the
    end of the drag. And two hands are kept apart only where there are two: the original refuses any feedback
    in the first second of a marker.
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
