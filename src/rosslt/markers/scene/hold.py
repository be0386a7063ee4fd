"""Holds: a handle is not moved while it is dragged, nor until a message shows it where it was dropped."""

import time
from typing import Any, Dict, Optional

from rosslt import messages, values
from rosslt.markers.scene.handle import Handle

#: The time after a change in which messages may still be older than it, in seconds.
OLDER_MESSAGES = 2.0

#: The time without a message after which a change is reported as not shown yet, in seconds.
SILENCE = 1.0


class Hold:
    """A user's hold on a handle, and the wait for a message that shows the change after the release."""

    def __init__(self) -> None:
        self._changed: Optional[Dict[values.Source, Any]] = None
        self._dropped_at = self._seen_at = 0.0
        self._is_over = self._is_told = False

    def drop(self, changed: Dict[values.Source, Any]) -> None:
        """The hand has let go after sources have changed, {Source: new value}, which a message will show soon."""
        self._changed = changed
        self._dropped_at = self._seen_at = time.monotonic()

    def see(self, handle: Handle) -> None:
        """A message says where the handle is.

        It is believed if the values in it have been computed from the changed sources. What comes from the old ones was
        under way; where nothing else comes for long, the change has not moved this thing, or was changed again.
        """
        if self._changed is None:
            return
        self._seen_at = time.monotonic()
        if self._shows_the_change(handle) or self._seen_at - self._dropped_at > OLDER_MESSAGES:
            self._is_over = True

    def is_in_hand(self) -> bool:
        """True until the handle is released."""
        return self._changed is None

    def is_over(self) -> bool:
        """True when the handle is to be shown at the pose in its messages again."""
        return self._is_over

    def is_left_alone(self) -> bool:
        """Return True, only once, if no message has come for `SILENCE` seconds since the drop."""
        if self._changed is None or self._is_told or self._is_over:
            return False
        self._is_told = time.monotonic() - self._seen_at > SILENCE
        return self._is_told

    def _shows_the_change(self, handle: Handle) -> bool:
        present = values.source_values(handle.tracked)
        known = [(new, present[source]) for source, new in (self._changed or {}).items() if source in present]
        return bool(known) and all(values.is_same(now, new) or messages.is_sent_as(new, now) for new, now in known)
