"""Going through the steps of a script in time, and publishing the waypoint in force."""

import threading
from typing import Callable, List, Optional, Sequence

import rospy
import tf2_ros
from geometry_msgs.msg import Point, PoseStamped

from rosslt import node
from rosslt.script.execution import Goto, Step

#: The time after which a missing frame of the robot is warned of, in seconds.
TF_PATIENCE = 5.0


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

    def __init__(self, publisher: node.Publisher, frame: str, is_there: Callable[[Goto], bool], repeats: bool) -> None:
        self._publisher, self._frame, self._is_there, self._repeats = publisher, frame, is_there, repeats
        self._lock = threading.Lock()
        self._steps: List[Step] = []
        self._index: Optional[int] = None
        self._began: Optional[rospy.Time] = None
        self._stamp: Optional[rospy.Time] = None

    def play(self, steps: Sequence[Step], goes_on: bool) -> None:
        """Go through steps.

        Args:
            steps: a list of Goto and Wait.
            goes_on: go on where it is, with these steps instead of the earlier ones; else begin with the first.
        """
        with self._lock:
            self._steps = list(steps)
            if not steps:
                self._index = None
            elif goes_on and self._index is not None:
                self._index = min(self._index, len(steps) - 1)
                self._publish()
            else:
                self._start(0)

    def tick(self) -> None:
        """Go on to the next step if the one in force is done; to be called several times a second."""
        with self._lock:
            if self._index is None:
                return
            if rospy.Time.now() < self._began:  # simulated time has begun anew, and the step does so with it
                self._start(self._index)
            if not self._is_done(self._steps[self._index]):
                return
            following = self._index + 1
            if following < len(self._steps):
                self._start(following)
            elif self._repeats and sum(isinstance(step, Goto) for step in self._steps) > 1:
                self._start(0)

    def _start(self, index: int) -> None:
        self._index, self._began = index, rospy.Time.now()
        if isinstance(self._steps[index], Goto):
            self._stamp = self._began
            self._publish()

    def _is_done(self, step: Step) -> bool:
        if isinstance(step, Goto):
            return self._is_there(step)
        return bool((rospy.Time.now() - self._began).to_sec() >= step.seconds)

    def _publish(self) -> None:
        """Publish the waypoint in force: while waiting, the one before."""
        for step in reversed(self._steps[: (self._index or 0) + 1]):
            if isinstance(step, Goto):
                waypoint = PoseStamped()
                waypoint.header.frame_id, waypoint.header.stamp = self._frame, self._stamp or self._began
                waypoint.pose.position = Point(*step)
                waypoint.pose.orientation.w = 1.0
                self._publisher.publish(waypoint)
                return


class Arrival:
    """Tells whether a robot has reached a point, by tf.

    Args:
        frame: the frame of the points.
        robot: the frame of the robot.
        tolerance: how far from the point the robot may be, in metres.
    """

    def __init__(self, frame: str, robot: str, tolerance: float) -> None:
        self._frame, self._robot, self._tolerance = frame, robot, tolerance
        self._began = rospy.Time.now()
        self._is_known = False
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def __call__(self, place: Goto) -> bool:
        try:
            at = self._buffer.lookup_transform(self._frame, self._robot, rospy.Time()).transform.translation
        except tf2_ros.TransformException:
            self._warn_where_it_is_unknown()
            return False
        self._is_known = True
        return bool((at.x - place.x) ** 2 + (at.y - place.y) ** 2 + (at.z - place.z) ** 2 <= self._tolerance**2)

    def _warn_where_it_is_unknown(self) -> None:
        """Warn that the first waypoint is never left if nobody says where the robot is."""
        if not self._is_known and (rospy.Time.now() - self._began).to_sec() > TF_PATIENCE:
            rospy.logwarn_throttle(
                30.0,
                'no tf from %s to %s: it is not known whether the robot has reached a waypoint, and the next one does '
                'not come. ~robot_frame names the frame of the robot',
                self._frame,
                self._robot,
            )


def make_player(message_class: type) -> Player:
    """The player that the private parameters of this node describe.

    Args:
        message_class: as what waypoints are published: a tracked type, or PoseStamped.
    """
    frame = rospy.get_param('~frame', 'world')
    is_there = Arrival(frame, rospy.get_param('~robot_frame', 'quadcopter'), rospy.get_param('~tolerance', 0.02))
    publisher = node.Publisher('waypoint', message_class, queue_size=10, latch=True)
    return Player(publisher, frame, is_there, rospy.get_param('~repeat', True))
