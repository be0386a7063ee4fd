"""Notices at the edge of the page, for a few seconds."""

import threading
import time
from typing import Any, Dict, Tuple

#: The duration of a notice, in seconds.
DURATION = 6.0

LONGEST = 300


class Notices:
    """The notices that people see: one at most of each title, as a drag says the same many times."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shown: Dict[Tuple[int, str], Tuple[float, str, Any]] = {}  # (client, title) -> (when, text, viser's)

    def tell(self, client: Any, title: str, text: str) -> None:
        """Show a notice to somebody; it replaces one with the same title.

        Args:
            client: viser's; None for nobody.
        """
        if client is None:
            return
        now, text = time.monotonic(), text[:LONGEST]
        with self._lock:
            self._shown = {key: shown for key, shown in self._shown.items() if now - shown[0] < DURATION}
            key = (client.client_id, title)
            before = self._shown.get(key)
            if before is not None and before[1] == text and now - before[0] < DURATION / 2:
                return
            if before is not None:
                before[2].remove()
            self._shown[key] = now, text, client.add_notification(title, text, auto_close_seconds=DURATION)
