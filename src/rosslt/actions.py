"""Actions that carry provenance: actionlib's own simple client and server, with the same arguments.

Goals, feedback and results travel as ordinary ones with their provenance in-band, to and from plain peers too.
"""

import http.client
import time
import xmlrpc.client
from typing import Any, Callable, Optional

import actionlib
import rosgraph
import rospy
from actionlib.action_client import ClientGoalHandle

from rosslt.messages import Message
from rosslt.node import Publisher, Subscriber

#: The period and the maximal duration of asking the server for its connections, in seconds.
CONFIRMATION_PERIOD = 0.02
CONFIRMATION_TIMEOUT = 5.0


class SimpleActionClient(actionlib.SimpleActionClient):
    """`actionlib.SimpleActionClient`, whose goals keep provenance, and whose feedback and result hold tracked values.

    Args:
        ns, ActionSpec: as in `actionlib.SimpleActionClient`.
    """

    def __init__(self, ns: str, ActionSpec: type) -> None:  # noqa: N803 (actionlib's name)
        super().__init__(ns, ActionSpec)
        client, name = self.action_client, rospy.remap_name(ns)
        client.pub_goal = _instead(
            client.pub_goal, Publisher(name + '/goal', client.ActionGoal, queue_size=client.pub_queue_size)
        )
        client.manager.register_send_goal_fn(self._publish_goal)
        client.feedback_sub = _instead(
            client.feedback_sub,
            Subscriber(
                name + '/feedback', client.ActionFeedback, client._feedback_cb, queue_size=client.sub_queue_size
            ),
        )
        client.result_sub = _instead(
            client.result_sub,
            Subscriber(name + '/result', client.ActionResult, client._result_cb, queue_size=client.sub_queue_size),
        )

    def wait_for_server(self, timeout: rospy.Duration = rospy.Duration()) -> bool:  # noqa: B008 (actionlib's default)
        """Wait until a server has started and will be heard.

        actionlib's own client only looks at its own state. A publisher answers a new subscriber before it
        counts it among those to send to, so that what a quick server says in between would be lost, and a client wait
        for its result for ever. This one also asks the server.

        Args:
            timeout: at most so long; 0 for as long as it takes.

        Returns:
            Whether there is one.
        """
        end = rospy.get_rostime() + timeout
        if not super().wait_for_server(timeout):
            return False
        give_up = time.monotonic() + CONFIRMATION_TIMEOUT
        while not self._is_known_to_server():
            if rospy.is_shutdown() or (timeout and rospy.get_rostime() >= end):
                return False
            if time.monotonic() > give_up:
                rospy.logwarn('the server of %s does not list its connections to this node', self.action_client.ns)
                break
            time.sleep(CONFIRMATION_PERIOD)
        return True

    def _is_known_to_server(self) -> bool:
        """Return whether the server is connected to this node for both feedback and results."""
        client, own_name = self.action_client, rospy.get_name()
        server = client.last_status_msg._connection_header['callerid']
        try:
            uri = rosgraph.Master(own_name).lookupNode(server)
            with xmlrpc.client.ServerProxy(uri, transport=_PatientTransport()) as proxy:
                answer: Any = proxy.getBusInfo(own_name)
        except (OSError, xmlrpc.client.Error, rosgraph.MasterException, http.client.HTTPException) as error:
            rospy.logdebug('cannot ask %s for its connections: %s', server, error)
            return False
        # [number, peer, direction, transport, topic, whether connected, ...]
        topics = {topic for _, peer, direction, _, topic, *_ in answer[2] if (peer, direction) == (own_name, 'o')}
        return {client.result_sub.resolved_name, client.feedback_sub.resolved_name} <= topics

    def _publish_goal(self, action_goal: Message) -> None:
        """Publish a goal whose handle is known by then. actionlib's client knows it only when it has published the
        goal, and drops what a quick server has said until then: it may wait for a result for ever (issue 206 of
        ros/actionlib)."""
        client = self.action_client
        for status in [reference() for reference in client.manager.statuses]:
            if getattr(status, 'action_goal', None) is action_goal and status.transition_cb == self._handle_transition:
                self.gh = ClientGoalHandle(status)
        client.pub_goal.publish(action_goal)


class _PatientTransport(xmlrpc.client.Transport):
    """XML-RPC that waits for an answer, but not for ever."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        name: str = self.get_host_info(host)[0]
        return http.client.HTTPConnection(name, timeout=CONFIRMATION_TIMEOUT)


class SimpleActionServer(actionlib.SimpleActionServer):
    """`actionlib.SimpleActionServer`, whose goals hold tracked values, and whose feedback and results keep provenance.

    Args:
        name, ActionSpec, execute_cb, auto_start: as in `actionlib.SimpleActionServer`.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: type,  # noqa: N803 (actionlib's name)
        execute_cb: Optional[Callable[[Any], Any]] = None,
        auto_start: bool = True,
    ) -> None:
        # The plain server is not started and has no connections, so it can be dropped.
        super().__init__(name, ActionSpec, execute_cb, auto_start=False)
        self.action_server = _ActionServer(
            name, ActionSpec, self.internal_goal_callback, self.internal_preempt_callback, auto_start
        )


class _ActionServer(actionlib.ActionServer):
    def initialize(self) -> None:
        """Open the topics, those that carry values with their provenance."""
        topics = rospy.remap_name(self.ns)
        # Before the plain one, so that no goal is read without its provenance.
        goals = Subscriber(topics + '/goal', self.ActionGoal, self.internal_goal_callback)
        super().initialize()
        for name, carrying in (
            ('goal_sub', goals),
            ('result_pub', Publisher(topics + '/result', self.ActionResult, queue_size=self.pub_queue_size)),
            ('feedback_pub', Publisher(topics + '/feedback', self.ActionFeedback, queue_size=self.pub_queue_size)),
        ):
            setattr(self, name, _instead(getattr(self, name), carrying))


def _instead(plain: Any, carrying: Any) -> Any:
    """Replace a plain publisher or subscriber with one that carries provenance; they share their connections."""
    plain.unregister()
    return carrying
