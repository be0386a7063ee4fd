"""What provenance costs on top of sending and receiving a message: `./run bench messages`.

Every figure stands beside what genpy takes, in the same run, for the same message: machines differ, the ratio
hardly does. The last column is the limit that the project sets itself, where it sets one.
"""

import io
import itertools
import time
import timeit

import numpy
from geometry_msgs.msg import Point, Pose
from sensor_msgs.msg import Image, LaserScan, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import Source, math, track, values
from rosslt.messages import append_provenance, attach, encode, split_provenance
from rosslt.messages.walkers import walkers

NODE = '/interactive_script'


def microseconds(call, repeat=5):
    """The processor's time that a call takes, at best: what else the machine does counts little."""
    timer = timeit.Timer(call, timer=time.process_time)
    count, _ = timer.autorange()
    return min(timer.repeat(repeat, count)) / count * 1e6


def microseconds_each(call, make, count=300, repeat=7):
    """The same for a call that needs a new object each time."""

    def once():
        objects = iter([make() for _ in range(count)])
        return timeit.timeit(lambda: call(next(objects)), number=count, timer=time.process_time)

    return min(once() for _ in range(repeat)) / count * 1e6


def serialize(message):
    buff = io.BytesIO()
    message.serialize(buff)
    return buff


def send(message):
    buff = serialize(message)
    append_provenance(message, buff)
    return buff.getvalue()


def bezier(t, b0, b1, b2):
    return t * t * b2 + 2 * t * (1 - t) * b1 + (1 - t) * (1 - t) * b0


def tracked_pose():
    return Pose(position=Point(*(track(value, Source(NODE, place)) for place, value in enumerate((0.1, 0.2, 0.3)))))


def tracked_strip(steps):
    """A line strip, each coordinate of each point affine in three sources."""
    corners = [
        [track(0.1 * corner + axis, Source(NODE, 3 * corner + axis)) for axis in range(3)] for corner in range(3)
    ]
    strip = Marker(
        points=[Point(*(bezier(step / (steps - 1), *axis) for axis in zip(*corners))) for step in range(steps)]
    )
    strip.header.frame_id = 'world'
    return strip


def plain_strip(steps):
    strip = Marker(points=[Point(step, 2.0, 3.0) for step in range(steps)])
    strip.header.frame_id = 'world'
    return strip


def arm():
    """Twenty points of which no coordinate is affine."""
    first, second = track(0.3, Source(NODE, 1)), track(0.5, Source(NODE, 2))
    return Marker(
        points=[
            Point(
                math.cos(first) + place * math.cos(first + second),
                math.sin(first) + place * math.sin(first + second),
                0.0,
            )
            for place in range(20)
        ]
    )


MESSAGES = [
    ('Pose, 3 tracked', tracked_pose()),
    ('strip of 11, 33 tracked', tracked_strip(11)),
    ('arm of 20, 40 not affine', arm()),
    ('strip of 11, none tracked', plain_strip(11)),
    ('strip of 1000, none tracked', plain_strip(1000)),
    ('100 strips of 11, none tracked', MarkerArray(markers=[plain_strip(11) for _ in range(100)])),
    ('scan of 720, a list', LaserScan(ranges=[1.5] * 720)),
    ('scan of 720, an array', LaserScan(ranges=numpy.full(720, 1.5))),
    ('image of 640x480', Image(data=bytes(3 * 640 * 480))),
    ('cloud of 100,000 points', PointCloud2(data=bytes(16 * 100000))),
]


def sending():
    print('%-32s %12s %12s %12s' % ('sending', 'genpy', 'with in-band', 'ratio'))
    for name, message in MESSAGES:
        alone = microseconds(lambda message=message: serialize(message).getvalue())
        both = microseconds(lambda message=message: send(message))
        print('%-32s %9.1f us %9.1f us %11.2fx' % (name, alone, both, both / alone))


def receive(data, cls):
    plain, provenance = split_provenance(data, cls)
    message = cls().deserialize(plain)
    attach(message, provenance)
    return message


def receiving():
    print('\n%-32s %12s %12s %12s' % ('receiving', 'genpy', 'with in-band', 'ratio'))
    for name, message in MESSAGES:
        data, plain, cls = send(message), serialize(message).getvalue(), type(message)
        alone = microseconds(lambda plain=plain, cls=cls: cls().deserialize(plain))
        both = microseconds(lambda data=data, cls=cls: receive(data, cls))
        print('%-32s %9.1f us %9.1f us %11.2fx' % (name, alone, both, both / alone))


def moving():
    """Changing provenance: it is different in each message. As with genpy, each message is sent once."""
    x, y, z, radius = (track(value, Source(NODE, place)) for place, value in enumerate((0.1, 0.2, 0.3, 0.75)))
    steps = itertools.count(1)

    def moved():
        angle = 0.001 * next(steps)
        return Pose(position=Point(x + radius * math.cos(angle), y + radius * math.sin(angle), z))

    print('\n%-32s %12s %12s %12s' % ('a Pose on its way, 3 tracked', 'genpy', 'with in-band', 'ratio'))
    for name, alone, both in [
        (
            'sending',
            microseconds_each(lambda message: serialize(message).getvalue(), moved),
            microseconds_each(send, moved),
        ),
        (
            'receiving',
            microseconds_each(lambda data: Pose().deserialize(data), lambda: serialize(moved()).getvalue()),
            microseconds_each(lambda data: receive(data, Pose), lambda: send(moved())),
        ),
    ]:
        print('%-32s %9.1f us %9.1f us %11.2fx' % (name, alone, both, both / alone))


def parts():
    """The parts that have limits of their own, on a marker with 11 points of which 33 coordinates are tracked."""
    strip = tracked_strip(11)
    plain = serialize(strip).getvalue()
    provenance = encode(strip)
    collect = walkers(Marker).collect
    genpy = microseconds(lambda: serialize(strip))
    received = receive(send(strip), Marker)

    def collected():
        found = []
        collect(strip, 0, found)

    # Lazily: provenance that is not used is never decoded.
    attached = microseconds_each(lambda message: attach(message, provenance), lambda: Marker().deserialize(plain))
    looked_at = microseconds_each(
        lambda message: [values.affine(point.x) for point in message.points], lambda: receive(send(strip), Marker)
    )
    print('\n%-44s %10s %16s %8s' % ('Marker, 11 points, 33 tracked', 'time', 'to serializing', 'limit'))
    for name, taken, limit in [
        ('serialize (genpy)', genpy, None),
        ('collect the tracked leaves', microseconds(collected), 15),
        ('encode', microseconds(lambda: encode(strip)), None),
        ('encode what was received', microseconds(lambda: encode(received)), None),
        ('attach', attached, 60),
        ('decode 11 of them when looked at', looked_at, None),
    ]:
        print('%-44s %7.1f us %15.2fx %8s' % (name, taken, taken / genpy, '%d us' % limit if limit else ''))


if __name__ == '__main__':
    sending()
    receiving()
    moving()
    parts()
