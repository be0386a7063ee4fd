"""How much provenance costs on a topic: rates and sizes, like the paper's node slt_message_statistics (section VI).

Messages are taken as they come from the wire, of any type and without reading their fields: what follows an ordinary
message, or stands in the header of a tracked one, is its provenance.
"""

import argparse
import os
import shutil
import sys
import threading
import time

import genpy.dynamic
import genpy.message
import rosgraph
import rospy

from rosslt import messages

_EPILOG = """\
plain is what the message takes without its provenance, and the ratio is the whole over that, all as averages since the
report before. On a terminal the table is refreshed in place; in a pipe there is a line for each topic and report.
"""

_COLUMNS = ('topic', 'type', 'rate', 'plain', 'provenance', 'ratio')


class Topic:
    """What arrives on one topic.

    Args:
        name: the topic.
    """

    def __init__(self, name):
        self.name = name
        self.type = '?'
        self._class = None
        self._count = self._plain = self._provenance = 0
        self._lock = threading.Lock()
        self._since = time.monotonic()
        self._subscriber = rospy.Subscriber(name, rospy.AnyMsg, self._take)

    def _take(self, message):
        data, header = message._buff, message._connection_header
        if header['type'] != self.type:
            self.type, self._class = header['type'], class_of(header)
        size = messages.provenance_size(data, self._class)
        with self._lock:
            self._count += 1
            self._plain += len(data) - size
            self._provenance += size

    def report(self):
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


def class_of(header):
    """The class of the messages of a connection, from its definition where the type is not installed."""
    found = genpy.message.get_message_class(header['type'])
    if found is None or found._md5sum != header['md5sum']:
        found = genpy.dynamic.generate_dynamic(header['type'], header['message_definition'])[header['type']]
    return found


def formatted(row):
    """A row as texts."""
    name, type_, rate, plain, provenance, ratio = row
    return (
        name,
        type_,
        '%.1f Hz' % rate,
        *('-' if size is None else '%.0f B' % size for size in (plain, provenance)),
        '-' if ratio is None else '%.2f' % ratio,
    )


def table(rows):
    """The rows below the names of the columns, each as wide as it needs."""
    lines = [_COLUMNS, *map(formatted, rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(_COLUMNS))]
    return [
        ('%-*s  %-*s  %*s  %*s  %*s  %*s' % tuple(part for pair in zip(widths, line) for part in pair)).rstrip()
        for line in lines
    ]


class _Screen:
    """Prints tables, each in the place of the one before."""

    def __init__(self):
        self._height = 0

    def show(self, rows):
        # A line that wraps would take two, and the next table begin too low.
        width = shutil.get_terminal_size().columns
        lines = [line[:width] for line in table(rows)]
        sys.stdout.write('\x1b[%dF' % self._height * bool(self._height) + ''.join(line + '\x1b[K\n' for line in lines))
        sys.stdout.flush()
        self._height = len(lines)


class _Pipe:
    """Prints lines that other programs can read."""

    def show(self, rows):
        for row in rows:
            print('  '.join('%s %s' % (column, text) for column, text in zip(_COLUMNS, formatted(row))), flush=True)


def _positive(text):
    number = float(text)
    if not 0 < number < float('inf'):
        raise argparse.ArgumentTypeError('%s is not above 0' % text)
    return number


def main(arguments=None):
    """Run the command.

    Returns:
        The exit code.
    """
    parser = argparse.ArgumentParser(
        prog='rosslt_message_statistics',
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description='Print rate, plain size, provenance size and ratio of the messages on topics.',
    )
    parser.add_argument('topics', nargs='+', metavar='TOPIC', help='of any message type, tracked or not')
    parser.add_argument(
        '-i', '--interval', type=_positive, default=1.0, metavar='S', help='seconds between two reports (default: 1)'
    )
    parser.add_argument('-n', '--count', type=int, default=0, metavar='N', help='end after N reports (default: never)')
    options = parser.parse_args(rospy.myargv(sys.argv)[1:] if arguments is None else arguments)
    if not rosgraph.is_master_online():
        print('rosslt_message_statistics: found no ROS master at %s' % rosgraph.get_master_uri(), file=sys.stderr)
        return 1
    rospy.init_node('rosslt_message_statistics', anonymous=True)
    topics = [Topic(name) for name in dict.fromkeys(map(rospy.resolve_name, options.topics))]
    output = _Screen() if sys.stdout.isatty() else _Pipe()
    reports = 0
    try:
        while not rospy.is_shutdown() and (not options.count or reports < options.count):
            rospy.rostime.wallsleep(options.interval)
            output.show([topic.report() for topic in topics])
            reports += 1
    except BrokenPipeError:
        # The reader has gone, head say. Python would complain when it flushes what is left.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0
