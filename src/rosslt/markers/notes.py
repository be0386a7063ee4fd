"""Notes: what a hand ought to be told, as text beside the marker for a few seconds."""

import re
import textwrap
import time

from visualization_msgs.msg import Marker

from rosslt.markers import controls
from rosslt.markers.geometry import IDENTITY

#: For how long a note stays, in seconds.
DURATION = 4.0

#: How many characters a line of a note takes.
WIDTH = 48

#: What is cut to a few digits: nobody reads sixteen of them beside a marker.
LONG_NUMBER = re.compile(r'-?\d+\.\d{4,}(e[-+]?\d+)?')

COLOR = (1.0, 0.85, 0.3)


class Notes:
    """The notes on a board.

    Args:
        board: where they are put.
        text_height: of a capital letter, in metres.
    """

    def __init__(self, board, text_height):
        self._board, self._text_height = board, text_height
        self._ends = {}

    def say(self, handle, text):
        """Put a note beside a handle, in place of an earlier one there."""
        text = LONG_NUMBER.sub(lambda number: '%.4g' % float(number.group()), text)
        note = _Note(handle, '\n'.join(textwrap.wrap(text, WIDTH)), self._text_height)
        with self._board.lock:
            self._board.put(note)
            self._ends[note.name] = time.monotonic() + DURATION

    def expire(self):
        """Drop the notes that have been there long enough."""
        with self._board.lock:
            now = time.monotonic()
            for name in [name for name, end in self._ends.items() if end <= now]:
                del self._ends[name]
                self._board.drop(name)


class _Note:
    """A text, as the board takes it."""

    tracked = ()

    def __init__(self, handle, text, height):
        self.name, self.frame = handle.name + ':note', handle.frame
        x, y, z = handle.pose[:3]
        # Up, and to the far side too: seen from above, up alone would leave it on top of the marker.
        out = 0.6 * handle.size + height * (1 + text.count('\n'))
        self.pose = (x, y + out, z + out, *IDENTITY)
        self.look = (text, height, self.frame)

    def draw(self, _can_move):
        """The interactive marker."""
        text, height, frame = self.look
        letters = Marker(type=Marker.TEXT_VIEW_FACING, text=text)
        letters.scale.z = height
        controls.paint(letters, COLOR)
        return controls.interactive_marker(
            self.name, frame, self.pose, 1.0, [controls.body((False,) * 3, [letters], has_menu=False)]
        )
