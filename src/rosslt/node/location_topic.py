"""Publishes names, files and lines of this node's locations on a latched topic: a recorded bag is explained without the
node."""

import threading
from typing import Callable, List

import rospy

from rosslt import msg

#: Many locations are created together, at the start and with each new part of a node: they are published when none
#: was created for so long, in seconds.
SETTLING = 0.2


class LocationTopic:
    """`<node>/rosslt/locations`.

    Args:
        node: the full name of this node.
        described: gives the locations that there are.
    """

    def __init__(self, node: str, described: Callable[[], List[msg.Location]]) -> None:
        self._node = node
        self._described = described
        self._publisher = rospy.Publisher('~rosslt/locations', msg.LocationList, queue_size=1, latch=True)
        self._news = threading.Event()
        threading.Thread(target=self._work, name='rosslt locations topic', daemon=True).start()

    def update(self) -> None:
        """Locations were created or dropped."""
        self._news.set()

    def _work(self) -> None:
        while not rospy.is_shutdown():
            self._news.wait()
            while self._news.is_set():
                self._news.clear()
                rospy.rostime.wallsleep(SETTLING)
            if not rospy.is_shutdown():
                self._publisher.publish(self._node, self._described())
