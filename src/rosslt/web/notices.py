"""Notices at the edge of the page, for a few seconds."""

import time
from typing import ContextManager, Dict, Optional, Tuple

import viser

#: The duration of a notice, in seconds.
DURATION = 6.0

#: viser cuts long words and long texts off: here they have all lines that they need, and stay in the window.
STYLE = """<style>
.mantine-Notification-title, .mantine-Notification-description { overflow-wrap: anywhere; }
.mantine-Notifications-notification { max-height: none !important; }
.mantine-Notifications-root { max-width: min(20em, 100vw - 2em); max-height: calc(100vh - 2em); overflow-y: auto; }
</style>"""


class Notices:
    """The notices that people see: one at most of each title, as a drag says the same many times.

    Args:
        server: viser's.
        lock: of the page.
    """

    def __init__(self, server: viser.ViserServer, lock: ContextManager[bool]) -> None:
        self._lock = lock
        server.gui.add_html(STYLE)
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
