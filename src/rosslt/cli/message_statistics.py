"""Cost of provenance on a topic: rates and sizes, like the paper's node slt_message_statistics (section VI).

Messages are taken as they come from the wire, of any type and without reading their fields: what follows an ordinary
message, or stands in the header of a tracked one, is its provenance.
"""

import shutil
import sys
import threading
import time
from typing import Any, Optional, Sequence, Tuple

import rospy

from rosslt import messages
from rosslt.cli.output import table
from rosslt.cli.reading import class_of

_COLUMNS = ('topic', 'type', 'rate', 'plain', 'provenance', 'ratio')

#: A topic's name and type, its rate, the sizes of a message and of its provenance, and their ratio; None: not known.
Row = Tuple[str, str, float, Optional[float], Optional[float], Optional[float]]


class Topic:
    """Counts the messages of one topic and their bytes.

    Args:
        name: the topic.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.type = '?'
        self._class: Any = None
        self._count = self._plain = self._provenance = 0
        self._lock = threading.Lock()
        self._since = time.monotonic()
        self._subscriber = rospy.Subscriber(name, rospy.AnyMsg, self._take)

    def _take(self, message: rospy.AnyMsg) -> None:
        data, header = message._buff, message._connection_header
        if header['type'] != self.type:
            self.type, self._class = header['type'], class_of(header)
        size = messages.provenance_size(data, self._class)
        with self._lock:
            self._count += 1
            self._plain += len(data) - size
            self._provenance += size

    def report(self) -> Row:
        """The row of the time since the last report: None for what is not known."""
        with self._lock:
            now = time.monotonic()
            count, plain, provenance = self._count, self._plain, self._provenance
            seconds, self._since = now - self._since, now
            self._count = self._plain = self._provenance = 0
        if not count:
            return (self.name, self.type, 0.0, None, None, None)
        return (
            self.name,
            self.type,
            count / seconds,
            plain / count,
            provenance / count,
            (plain + provenance) / plain if plain else None,
        )


def formatted(row: Row) -> Tuple[str, ...]:
    """A row as texts."""
    name, type_, rate, plain, provenance, ratio = row
    return (
        name,
        type_,
        '%.1f Hz' % rate,
        *('-' if size is None else '%.0f B' % size for size in (plain, provenance)),
        '-' if ratio is None else '%.2f' % ratio,
    )


class Screen:
    """Prints tables, each over the previous one."""

    def __init__(self) -> None:
        self._height = 0

    def show(self, rows: Sequence[Row]) -> None:
        # A line that wraps would take two, and the next table begin too low.
        width = shutil.get_terminal_size().columns
        lines = [line[:width] for line in table([_COLUMNS, *map(formatted, rows)], left=2)]
        sys.stdout.write('\x1b[%dF' % self._height * bool(self._height) + ''.join(line + '\x1b[K\n' for line in lines))
        sys.stdout.flush()
        self._height = len(lines)


class Pipe:
    """Prints lines that other programs can read."""

    def show(self, rows: Sequence[Row]) -> None:
        for row in rows:
            print('  '.join('%s %s' % (column, text) for column, text in zip(_COLUMNS, formatted(row))), flush=True)
