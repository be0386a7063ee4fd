#!/usr/bin/env python3
"""How soon the messages of a node show what a device does: a tracker at 50 Hz leads a marker of a node at 47 Hz.

It counts from when the device sends a pose to when the first message comes that has the marker there. A node that
reads the device by itself needs up to its own period for that, which is taken off. With the same rate, all poses of a
run would come at one moment of that period, those of the next run at another: with two rates, they come at all of them.
"""

import argparse
import bisect
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from typing import List, Tuple

import rospy
from geometry_msgs.msg import PoseStamped
from visualization_msgs.msg import Marker

RATE = 50  # Hz, of the device
NODE_RATE = 47  # Hz
STEP = 0.005  # m from one message to the next: 0.25 m/s
NEAR = 1e-3  # m: what a hand tells apart, and numbers are rounded to

NODE = f"""
import rospy
from visualization_msgs.msg import Marker

x = 0.5
rospy.init_node('led')
publisher = rospy.Publisher('led', Marker, queue_size=1)
rate = rospy.Rate({NODE_RATE})
while not rospy.is_shutdown():
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'world'
    marker.pose.position.x = x
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = marker.color.a = 1.0
    publisher.publish(marker)
    rate.sleep()
"""


class Shown:
    """Where messages have shown the marker, and when."""

    def __init__(self) -> None:
        self.came = threading.Event()
        self.messages: List[Tuple[float, float]] = []  # (x, time)
        rospy.Subscriber('led', Marker, self._take, tcp_nodelay=True)

    def _take(self, marker: Marker) -> None:
        self.messages.append((marker.pose.position.x, time.monotonic()))
        self.came.set()


def lead(seconds: float, shown: Shown) -> List[Tuple[float, float]]:
    """Send poses once the device is heard; returns where the marker is to be, and since when."""
    publisher = rospy.Publisher('tracker', PoseStamped, queue_size=1, tcp_nodelay=True)
    while not publisher.get_num_connections():
        rospy.rostime.wallsleep(0.05)
    start, sent, rate = shown.messages[-1][0], [], rospy.Rate(RATE)
    for count in range(-RATE, int(seconds * RATE)):  # the hand takes hold while the device stands still, for 1 s
        x = STEP * max(0, count)
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = rospy.Time.now(), 'world'
        pose.pose.position.x, pose.pose.orientation.w = x, 1.0
        if x:
            sent.append((start + x, time.monotonic()))
        publisher.publish(pose)
        rate.sleep()
    return sent


def delays(sent: List[Tuple[float, float]], messages: List[Tuple[float, float]]) -> List[float]:
    """Seconds from each pose to the first message that shows it, for those poses that one has shown."""
    places = [x for x, _ in messages]
    found = [(moment, bisect.bisect_left(places, x - NEAR)) for x, moment in sent]
    return [messages[index][1] - moment for moment, index in found if index < len(messages)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=20.0, help='how long the device leads (default: 20)')
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix='rosslt_teach_') as folder:
        file = os.path.join(folder, 'led.py')
        with open(file, 'w', encoding='utf-8') as written:
            written.write(NODE)
        rospy.init_node('measuring')
        node = subprocess.Popen(['rosslt', 'run', file])
        shown = Shown()
        teaching = subprocess.Popen(
            ['rosslt', 'teach', '/led', '--by', '/tracker', '--smooth', '0', '--wait', '60'],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        try:
            if not shown.came.wait(60):
                sys.exit('no message of the node came')
            sent = lead(options.seconds, shown)
            rospy.rostime.wallsleep(1.0)  # the last of them come
        finally:
            for process in (teaching, node):
                process.terminate()
                process.wait()
    taken, period = [1e3 * delay for delay in delays(sent, shown.messages)], 1e3 / NODE_RATE
    print(f'{len(taken)} of {len(sent)} poses are shown, by a node with a period of {period:.1f} ms')
    middle, late = statistics.median(taken), statistics.quantiles(taken, n=20)[-1]
    print(f'from a pose to the message that shows it: median {middle:.1f} ms, 95 % within {late:.1f} ms')
    print(f'beyond that period: median {middle - period:.1f} ms, 95 % within {late - period:.1f} ms')


if __name__ == '__main__':
    main()
