"""How fast the messages of a bag are computed with another value: `./run bench what_if`.

Each bag holds a minute of messages at 50 Hz. The time is the processor's; the last column is what copying takes.
"""

import io
import os
import tempfile
import time

import rosbag
import rospy
from geometry_msgs.msg import Point, Pose, PoseStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from rosslt import Source, math, messages, track
from rosslt.cli import what_if

SECONDS, RATE = 60, 50
SPEED, TURN, FRAME = (track(value, Source('/planner', place)) for place, value in enumerate((0.5, 0.25, 'map'), 1))


def goal(at):
    """Three sums of sources."""
    return PoseStamped(pose=Pose(position=Point(2 * SPEED + 0.01 * at, SPEED + TURN, 3 * TURN)))


def odometry(at):
    """Four products with sines and cosines, and a source as it is."""
    message = Odometry()
    pose = message.pose.pose
    pose.position.x, pose.position.y = SPEED * at * math.cos(TURN * at), SPEED * at * math.sin(TURN * at)
    pose.orientation.z, pose.orientation.w = math.sin(TURN * at / 2), math.cos(TURN * at / 2)
    message.twist.twist.linear.x = SPEED
    return message


def way(at):
    """Forty sums, half of them of 32 bits."""
    points = [Point(SPEED * each + at, TURN * each + 0.1, 0.0) for each in range(20)]
    colors = [ColorRGBA(SPEED * each / 20, 0.5, 0.5, 1.0) for each in range(20)]
    message = Marker(type=Marker.LINE_STRIP, points=points, colors=colors)
    message.header.frame_id = FRAME + '/way'
    return message


def steps(at):
    """Products with whole numbers, others in each message, so that no two are alike but for their floats."""
    step = int(at * RATE)
    return PoseStamped(pose=Pose(position=Point(SPEED * step + TURN, SPEED * TURN * step, math.sin(TURN * step))))


def record(path, make):
    """Write a bag of messages with provenance."""
    with rosbag.Bag(path, 'w') as bag:
        for number in range(SECONDS * RATE):
            message = make(number / RATE)
            message.header.stamp = stamp = rospy.Time.from_sec(1000 + number / RATE)
            buff = io.BytesIO()
            message.serialize(buff)
            messages.append_provenance(message, buff)
            kind = type(message)
            bag.write('/topic', (kind._type, buff.getvalue(), kind._md5sum, kind), stamp, raw=True)


def seconds(path, changes):
    """The processor's time for a bag with other values, at best of three; `{}` copies it."""
    found = []
    for _ in range(3):
        began = time.process_time()
        with rosbag.Bag(path) as bag, rosbag.Bag(path + '.out', 'w') as output:
            what_if.rewrite(bag, output, changes)
        found.append(time.process_time() - began)
    return min(found)


def main():
    print('{:<12}{:>22}{:>12}'.format('messages', 'times real time', 'copying'))
    with tempfile.TemporaryDirectory() as folder:
        for make in (goal, odometry, way, steps):
            path = os.path.join(folder, make.__name__ + '.bag')
            record(path, make)
            times = [SECONDS / seconds(path, changes) for changes in ({Source('/planner', 1): 0.8}, {})]
            print('{:<12}{:>22.0f}{:>12.0f}'.format(make.__name__, *times))


if __name__ == '__main__':
    main()
