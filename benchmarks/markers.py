"""What slt_visualization takes of a core: 500 tracked markers in one array, at 10 Hz.

The measure beside it is a node that does nothing but receive the same messages with plain rospy. Needs a
master.
"""

import os
import subprocess
import sys
import threading
import time

import rospy
from visualization_msgs.msg import InteractiveMarkerUpdate, Marker, MarkerArray

import rosslt

COUNT, RATE = 500, 10.0
WARM_UP, SECONDS = 6.0, 10.0
LIMIT = 0.5


def publish(moving):
    """Publish the array; `moving` of the markers are elsewhere in each message."""
    rosslt.init_node('many_markers')
    publisher = rosslt.Publisher('many_markers', MarkerArray, queue_size=1)
    markers = []
    for number in range(COUNT):
        marker = Marker(ns='many', id=number, type=Marker.CUBE, action=Marker.ADD)
        marker.header.frame_id = 'world'
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = marker.scale.z = 0.2
        marker.color.r = marker.color.a = 1.0
        marker.pose.position.x = rosslt.location(0.3 * (number % 25), name='x', key=number)
        marker.pose.position.y = rosslt.location(0.3 * (number // 25), name='y', key=number)
        markers.append(marker)
    heights = [0.0] * COUNT
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        for number in range(moving):
            heights[number] = (heights[number] + 0.01) % 1.0
            markers[number].pose.position.z = heights[number]
        publisher.publish(markers)
        rate.sleep()


def receive():
    """Receive the array with plain rospy, and do nothing with it."""
    rospy.init_node('receiver')
    rospy.Subscriber('many_markers', MarkerArray, lambda message: None)
    rospy.spin()


class Process:
    """A node in a process of its own."""

    def __init__(self, *command):
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL)

    def cpu_seconds(self):
        with open('/proc/{}/stat'.format(self._process.pid)) as stat:
            fields = stat.read().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def stop(self):
        self._process.terminate()
        self._process.wait()


def measure(moving):
    """(shares of a core of slt_visualization and of the receiver, poses and inserts sent a second)."""
    counts, lock = [0, 0], threading.Lock()

    def count(update):
        with lock:
            counts[0] += len(update.poses)
            counts[1] += len(update.markers)

    subscriber = rospy.Subscriber('/slt_visualization/update', InteractiveMarkerUpdate, count)
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'scripts', 'slt_visualization')
    publisher = Process(sys.executable, __file__, 'publish', str(moving))
    subject = Process(sys.executable, script, '__name:=slt_visualization')
    receiver = Process(sys.executable, __file__, 'receive')
    try:
        time.sleep(WARM_UP)
        before, received = subject.cpu_seconds(), receiver.cpu_seconds()
        with lock:
            counts[:] = 0, 0
        start = time.monotonic()
        time.sleep(SECONDS)
        duration = time.monotonic() - start
        return (
            (subject.cpu_seconds() - before) / duration,
            (receiver.cpu_seconds() - received) / duration,
            counts[0] / duration,
            counts[1] / duration,
        )
    finally:
        for process in (receiver, subject, publisher):
            process.stop()
        subscriber.unregister()


def main():
    rospy.init_node('markers_benchmark')
    print('{} tracked markers in one array at {:g} Hz; shares of a core'.format(COUNT, RATE))
    print(
        '{:<16} {:>18} {:>14} {:>7} {:>12} {:>12}'.format(
            '', 'slt_visualization', 'plain receiver', 'ratio', 'poses/s', 'inserts/s'
        )
    )
    for moving in (0, COUNT // 10, COUNT):
        subject, receiver, poses, inserts = measure(moving)
        print(
            '{:<16} {:>17.0%} {:>14.0%} {:>7.1f} {:>12.0f} {:>12.0f}{}'.format(
                '{} of them move'.format(moving),
                subject,
                receiver,
                subject / receiver,
                poses,
                inserts,
                '' if subject <= LIMIT else '   over the limit of {:.0%}'.format(LIMIT),
            ),
            flush=True,
        )


if __name__ == '__main__':
    if sys.argv[1:2] == ['publish']:
        publish(int(sys.argv[2]))
    elif sys.argv[1:2] == ['receive']:
        receive()
    else:
        main()
