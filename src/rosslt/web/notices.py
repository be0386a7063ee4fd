"""Notices at the edge of the page, for a few seconds."""

import time
from typing import ContextManager, Dict, Optional, Tuple

import viser

#: The duration of a notice, in seconds.
DURATION = 6.0


class Notices:
    """The notices that people see: one at most of each title, as a drag says the same many times.

    Args:
        lock: of the page.
    """

    def __init__(self, lock: ContextManager[bool]) -> None:
        self._lock = lock
        # (client, title) -> (when, text, viser's)
        self._shown: Dict[Tuple[int, str], Tuple[float, str, viser.NotificationHandle]] = {}

    def tell(self, client: Optional[viser.ClientHandle], title: str, text: str) -> None:
        """Show a notice to somebody; it replaces one with the same title.

        Args:
            client: viser's; None for nobody.
        """
        if client is None:
            return
        now = time.monotonic()
        with self._lock:
            self._shown = {key: shown for key, shown in self._shown.items() if now - shown[0] < DURATION}
            key = (client.client_id, title)
            before = self._shown.get(key)
            if before is not None and before[1] == text and now - before[0] < DURATION / 2:
                return
            if before is not None:
                before[2].remove()
            self._shown[key] = now, text, client.add_notification(title, text, auto_close_seconds=DURATION)
