"""Surviving a restart of the ROS master, which forgets every node, and which rospy does not notice.

A new master knows neither this node's topics nor its services nor its parameters, and a running rospy node
tells it nothing of them. A tracked node does, as changes could not reach it otherwise.
"""

import threading
from typing import Callable

import rosgraph
import rospy

from rosslt.node.no_master import NO_MASTER
from rosslt.node.rospy_internals import (
    Registration,
    get_registration_listeners,
    get_service_manager,
    get_topic_manager,
)

#: How often to ask whether the master is still the same, in seconds.
PERIOD = 1.0


class MasterWatch:
    """Registers at a new master what this node publishes, subscribes to and serves.

    Args:
        node: the full name of this node.
        renewed: called when that has been told to a new master.
    """

    def __init__(self, node: str, renewed: Callable[[], None]) -> None:
        self._node = node
        self._renewed = renewed
        self._master = rosgraph.Master(node)
        self._known = self._identity()
        threading.Thread(target=self._watch, name='rosslt master', daemon=True).start()

    def _watch(self) -> None:
        while not rospy.is_shutdown():
            rospy.rostime.wallsleep(PERIOD)
            try:
                current = self._identity()
                if current != self._known:
                    self._register()
                    self._renewed()
                    self._known = current
                    rospy.logwarn('the ROS master has been restarted: %s is registered again', self._node)
            except NO_MASTER:
                continue  # no master now: the next turn asks again

    def _identity(self) -> int:
        return self._master.getPid()

    def _register(self) -> None:
        topics, services = get_topic_manager(), get_service_manager()
        for kind, entries in (
            (Registration.PUB, topics.get_publications()),
            (Registration.SUB, topics.get_subscriptions()),
            (Registration.SRV, services.get_services()),
        ):
            for name, data_type_or_uri in entries:
                get_registration_listeners().notify_added(name, data_type_or_uri, kind)
