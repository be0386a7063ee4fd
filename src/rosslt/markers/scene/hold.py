"""Holds: a handle is not moved while it is dragged, nor until a message shows it where it was dropped."""

import time
from typing import Optional

from rosslt import node
from rosslt.markers.scene.handle import Handle

#: The time after a change in which messages may still be older than it, in seconds.
OLDER_MESSAGES = 2.0


class Hold:
    """A user's hold on a handle, and the wait for a message that shows the change after the release."""

    def __init__(self) -> None:
        self._request: Optional[node.ChangeRequest] = None
        self._dropped_at = 0.0
        self._is_shown = self._is_elsewhere = False  # by messages since the drop

    def drop(self, request: node.ChangeRequest, handle: Optional[Handle]) -> None:
        """The hand has let go after sources have changed, which a message will show soon.

        Args:
            request: what has changed.
            handle: as the last message has it, which may show the change already, and be the last one.
        """
        self._request = request
        self._dropped_at = time.monotonic()
        self._is_shown = handle is not None and _shows(handle, request)

    def see(self, handle: Handle) -> None:
        """A message says where the handle is.

        It is believed if the values in it have been computed from the changed sources. A message from the old values
        was under way; if no other comes for long, the change has not moved this thing, or was changed again.
        """
        if self._request is not None:
            self._is_shown = self._is_shown or _shows(handle, self._request)
            self._is_elsewhere = True

    def is_in_hand(self) -> bool:
        """True until the handle is released."""
        return self._request is None

    def is_over(self) -> bool:
        """True when the handle is to be shown at the pose in its messages again."""
        is_late = time.monotonic() - self._dropped_at > OLDER_MESSAGES
        return self._is_shown or (self._is_elsewhere and is_late)


def _shows(handle: Handle, request: node.ChangeRequest) -> bool:
    return request.shown_by(node.Expression(list(handle.tracked)).readings) is node.Shown.NEW
