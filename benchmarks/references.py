"""What references to earlier messages save, and for how long a listener behind a filter has no provenance.

Messages of one publisher with `~rosslt/provenance: changes`, at times that are counted and not waited for. A throttle
is that of topic_tools: a message passes when its period is over since the last one that did.
"""

import argparse
import io
import random
import statistics
from typing import Any, Callable, List

from geometry_msgs.msg import Point, Pose
from visualization_msgs.msg import Marker

from rosslt import Source, track
from rosslt.messages import Announcer, append_provenance

MAGIC = b'rSLT'
RATE = 30.0
JITTER = 0.02


class Publisher:
    """Gives what is sent, at the times of a clock that the caller sets."""

    def __init__(self, message_class: Any) -> None:
        self.now = 0.0
        self._announcer = Announcer(message_class, lambda: self, lambda: self.now)

    def sent(self, message: Any) -> bytes:
        """A serialized message with what is behind it."""
        buff = io.BytesIO()
        message.serialize(buff)
        append_provenance(message, buff, announcer=self._announcer)
        return buff.getvalue()


def ends(step: int) -> List[Any]:
    """Three locations, of which the first has another value with each message."""
    return [
        track(
            0.25 + 0.01 * step * (place == 0),
            Source('/interactive_script', 0x21D6A37D9B01 + place),
        )
        for place in range(3)
    ]


def on_curve(t: float, points: List[Any]) -> Point:
    return Point(*(t * t * end + 2 * t * (1 - t) * end + (1 - t) * (1 - t) * 0.5 for end in points))


def strip(step: int) -> Marker:
    marker = Marker(type=Marker.LINE_STRIP, points=[on_curve(at / 10, ends(step)) for at in range(11)])
    marker.header.frame_id = 'world'
    return marker


MESSAGES: List[Any] = [
    ('Pose, three fields that stand still', Pose, lambda step: Pose(position=Point(*ends(0)))),
    ('Pose on a Bezier curve, moving', Pose, lambda step: Pose(position=on_curve(0.001 * step + 0.1, ends(0)))),
    ('strip of 11 points, moving', Marker, strip),
]


def sizes(message_class: Any, make: Callable[[int], Any], count: int) -> List[int]:
    """The bytes of messages at RATE."""
    publisher = Publisher(message_class)
    found = []
    for step in range(count):
        publisher.now = step / RATE
        found.append(len(publisher.sent(make(step))))
    return found


def seconds_until_full(rate: float, period: float) -> float:
    """How long a listener behind a throttle waits until the first message in full comes through."""
    publisher, message = Publisher(Pose), Pose(position=Point(*ends(0)))
    begin = passed = random.uniform(2.0, 4.0)  # it comes to a publisher that has been sending for a while
    while True:
        is_full = publisher.sent(message).endswith(MAGIC)
        if publisher.now >= begin and publisher.now - passed >= period:
            passed = publisher.now
            if is_full:
                return publisher.now - begin
        publisher.now += random.uniform(1 - JITTER, 1 + JITTER) / rate


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=200, help='how many listeners for each throttle')
    options = parser.parse_args()
    print('%-40s %8s %8s %12s %10s' % ('message at 30 Hz', 'plain', 'in full', 'in between', 'mean'))
    for name, message_class, make in MESSAGES:
        found = sizes(message_class, make, 3000)
        buff = io.BytesIO()
        make(0).serialize(buff)
        between = sorted(found)[: len(found) * 9 // 10]
        print(
            '%-40s %6d B %6d B %3d to %3d B %8.1f B'
            % (name, buff.tell(), max(found), min(found), max(between), statistics.mean(found))
        )
    print('\nuntracked behind a throttle%13s %8s %12s' % ('mean', 'median', '19 of 20'))
    for rate, period in ((30.0, 0.1), (30.0, 0.5), (30.0, 1.0), (10.0, 1.0)):
        waits = sorted(seconds_until_full(rate, period) for _ in range(options.count))
        print(
            '%3.0f Hz to %4.1f Hz %24.1f s %6.1f s %10.1f s'
            % (rate, 1 / period, statistics.mean(waits), statistics.median(waits), waits[len(waits) * 19 // 20])
        )


if __name__ == '__main__':
    main()
