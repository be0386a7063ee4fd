"""Going through the steps of a script in time, and publishing the waypoint in force."""

import threading

import rospy
import tf2_ros
from geometry_msgs.msg import Point, PoseStamped

from rosslt import node
from rosslt.script.running import Goto


class Player:
    """Publishes the waypoints of a script, one after the other.

    A waypoint is stamped with the time at which it came into force. One that comes again with the same stamp is the
    same one, which has been moved meanwhile.

    Args:
        publisher: takes PoseStamped messages.
        frame: the frame of the waypoints.
        is_there: called with a Goto; whether the robot has reached it.
        repeats: whether to begin again after the last step; one waypoint alone is not begun again.
    """

    def __init__(self, publisher, frame, is_there, repeats):
        self._publisher, self._frame, self._is_there, self._repeats = publisher, frame, is_there, repeats
        self._lock = threading.Lock()
        self._steps = []
        self._index = self._began = self._stamp = None

    def play(self, steps, goes_on):
        """Go through steps.

        Args:
            steps: a list of Goto and Wait.
            goes_on: go on where it is, with these in place of the steps before; else begin with the first.
        """
        with self._lock:
            self._steps = steps
            if not steps:
                self._index = None
            elif goes_on and self._index is not None:
                self._index = min(self._index, len(steps) - 1)
                self._publish()
            else:
                self._start(0)

    def tick(self):
        """Go on to the next step if the one in force is done; to be called several times a second."""
        with self._lock:
            if self._index is None or not self._is_done(self._steps[self._index]):
                return
            following = self._index + 1
            if following < len(self._steps):
                self._start(following)
            elif self._repeats and sum(isinstance(step, Goto) for step in self._steps) > 1:
                self._start(0)

    def _start(self, index):
        self._index, self._began = index, rospy.Time.now()
        if isinstance(self._steps[index], Goto):
            self._stamp = self._began
            self._publish()

    def _is_done(self, step):
        if isinstance(step, Goto):
            return self._is_there(step)
        return (rospy.Time.now() - self._began).to_sec() >= step.seconds

    def _publish(self):
        """Publish the waypoint in force: while waiting, the one before."""
        for step in reversed(self._steps[: self._index + 1]):
            if isinstance(step, Goto):
                waypoint = PoseStamped()
                waypoint.header.frame_id, waypoint.header.stamp = self._frame, self._stamp or self._began
                waypoint.pose.position = Point(*step)
                waypoint.pose.orientation.w = 1.0
                self._publisher.publish(waypoint)
                return


class Arrival:
    """Tells whether a robot has reached a place, by tf.

    Args:
        frame: the frame of places.
        robot: the frame of the robot.
        tolerance: how far from the place the robot may be, in metres.
    """

    def __init__(self, frame, robot, tolerance):
        self._frame, self._robot, self._tolerance = frame, robot, tolerance
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def __call__(self, place):
        try:
            at = self._buffer.lookup_transform(self._frame, self._robot, rospy.Time()).transform.translation
        except tf2_ros.TransformException:
            return False
        return (at.x - place.x) ** 2 + (at.y - place.y) ** 2 + (at.z - place.z) ** 2 <= self._tolerance**2


def make_player(message_class):
    """The player that the private parameters of this node describe.

    Args:
        message_class: as what waypoints are published: a tracked type, or PoseStamped.
    """
    frame = rospy.get_param('~frame', 'world')
    is_there = Arrival(frame, rospy.get_param('~robot_frame', 'quadcopter'), rospy.get_param('~tolerance', 0.02))
    publisher = node.Publisher('waypoint', message_class, queue_size=10, latch=True)
    return Player(publisher, frame, is_there, rospy.get_param('~repeat', True))
