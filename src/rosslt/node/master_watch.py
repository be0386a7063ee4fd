"""Surviving a restart of the ROS master, which forgets every node, and which rospy does not notice.

A new master knows neither this node's topics nor its services nor its parameters, and a running rospy node
tells it nothing of them. A tracked node does, as changes could not reach it otherwise; and so does one that was started
with rospy and has a tracked publisher or subscriber, as it stands between an owner and the dragged thing.
"""

import contextlib
import threading
from typing import Callable, List, Optional

import rosgraph
import rospy

from rosslt.node.no_master import NO_MASTER
from rosslt.node.rospy_internals import (
    Registration,
    get_registration_listeners,
    get_service_manager,
    get_topic_manager,
    is_initialized,
)

#: The period of checking whether the master was restarted, in seconds.
PERIOD = 1.0


class MasterWatch:
    """Registers at a new master what this node publishes, subscribes to and serves.

    Attributes:
        renewals: functions that are called when that has been told to a new master.
    """

    def __init__(self) -> None:
        self.renewals: List[Callable[[], None]] = []
        self._is_started = False
        self._master: Optional[rosgraph.Master] = None
        self._known: Optional[int] = None

    def start(self) -> None:
        """Start watching, if not started: the present master knows this node."""
        if self._is_started:
            return
        self._is_started = True
        with contextlib.suppress(*NO_MASTER):
            self._known = self._identity()
        threading.Thread(target=self._watch, name='rosslt master', daemon=True).start()

    def _watch(self) -> None:
        while not rospy.is_shutdown():
            rospy.rostime.wallsleep(PERIOD)
            try:
                current = self._identity()
                if self._known is not None and current != self._known:
                    self._register()
                    for renew in self.renewals:
                        renew()
                    rospy.logwarn('the ROS master has been restarted: %s is registered again', rospy.get_name())
                self._known = current
            except NO_MASTER:
                continue  # no master now: the next turn asks again

    def _identity(self) -> Optional[int]:
        """Return the process id of the master, which a restart changes; None before this process is a node."""
        if self._master is None:
            if not is_initialized():
                return None
            self._master = rosgraph.Master(rospy.get_name())
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


#: The watch of this process, which is one node.
MASTER_WATCH = MasterWatch()
