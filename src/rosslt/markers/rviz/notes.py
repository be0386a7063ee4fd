"""Notes: messages about a drag, as text in front of the handle for a few seconds."""

import textwrap
import time
from typing import Dict

from visualization_msgs.msg import InteractiveMarker, Marker

from rosslt.markers.drags.wording import short_numbers
from rosslt.markers.geometry import IDENTITY
from rosslt.markers.rviz import controls
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.shapes import paint

#: The duration of a note, in seconds.
DURATION = 5.0

#: How long a note stays that is not kept any more, in seconds.
LINGERING = 0.5

#: The maximal length of a line of a note, in characters, and the maximal number of lines.
WIDTH, LINES = 36, 4

#: The height of letters relative to the thing, and their minimal height in metres.
LETTERS_TO_SIZE, SMALLEST_LETTERS = 0.5, 0.05

COLOR = (1.0, 0.85, 0.3)
SUFFIX = ':note'


class Notes:
    """The notes in RViz.

    Args:
        text_height: of a capital letter at most, in metres.
    """

    def __init__(self, text_height: float) -> None:
        self._text_height = text_height
        self._ends: Dict[str, float] = {}  # name -> when it ends
        self._news: Dict[str, InteractiveMarker] = {}
        self._kept: Dict[str, str] = {}  # name -> its text

    def put(self, handle: Handle, text: str) -> None:
        """Put a note in front of a handle; it replaces an earlier one there."""
        name = handle.name + SUFFIX
        self._news[name] = self._drawn(name, handle, text)
        self._ends[name] = time.monotonic() + DURATION
        self._kept.pop(name, None)

    def keep(self, server: Server, handle: Handle, text: str) -> None:
        """Have a note stand in front of a handle until it is not kept any more; it moves with the handle."""
        name = handle.name + SUFFIX
        if self._kept.get(name) != text:
            self.put(handle, text)
            self._kept[name] = text
        else:
            server.setPose(name, controls.pose_message((*handle.pose[:3], *IDENTITY)))
        self._ends[name] = time.monotonic() + LINGERING

    def update(self, server: Server) -> bool:
        """Insert new notes, and take away those that have been there long enough; True if there are any."""
        now = time.monotonic()
        ended = [name for name, end in self._ends.items() if end <= now]
        for name in ended:
            del self._ends[name]
            self._news.pop(name, None)
            self._kept.pop(name, None)
            server.erase(name)
        for marker in self._news.values():
            server.insert(marker, None)
        has_changed = bool(ended or self._news)
        self._news = {}
        return has_changed

    def _drawn(self, name: str, handle: Handle, text: str) -> InteractiveMarker:
        lines = textwrap.wrap(short_numbers(text), WIDTH)
        if len(lines) > LINES:
            lines = lines[:LINES]
            lines[-1] += ' ...'
        height = min(self._text_height, max(LETTERS_TO_SIZE * handle.size, SMALLEST_LETTERS))
        letters = Marker(type=Marker.TEXT_VIEW_FACING, text='\n'.join(lines))
        letters.scale.z = height
        letters.pose.orientation.w = 1.0
        # Towards the eye, so that nothing of the thing stands before it, and just above it on the screen.
        letters.pose.position.x = -handle.size
        letters.pose.position.z = 0.6 * handle.size + 0.6 * height * len(lines)
        paint(letters, COLOR)
        pose = (*handle.pose[:3], *IDENTITY)
        return controls.interactive_marker(name, handle.frame, pose, 1.0, [controls.facing([letters])])
