"""Actions that carry provenance: actionlib's own simple client and server, with the same arguments.

Goals, feedback and results travel as ordinary ones with their provenance in-band, to and from plain peers too.
"""

import actionlib
import rospy
from actionlib.action_client import ClientGoalHandle

from rosslt.node import Publisher, Subscriber


class SimpleActionClient(actionlib.SimpleActionClient):
    """`actionlib.SimpleActionClient`, whose goals keep provenance, and whose feedback and result hold tracked values.

    Args:
        ns, ActionSpec: as of `actionlib.SimpleActionClient`.
    """

    def __init__(self, ns, ActionSpec):  # noqa: N803 (actionlib's name)
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

    def _publish_goal(self, action_goal):
        """Publish a goal whose handle is known by then. actionlib's client knows it only when it has published the
        goal, and drops what a quick server has said until then: it may wait for a result for ever (issue 206 of
        ros/actionlib)."""
        client = self.action_client
        for status in [reference() for reference in client.manager.statuses]:
            if getattr(status, 'action_goal', None) is action_goal and status.transition_cb == self._handle_transition:
                self.gh = ClientGoalHandle(status)
        client.pub_goal.publish(action_goal)


class SimpleActionServer(actionlib.SimpleActionServer):
    """`actionlib.SimpleActionServer`, whose goals hold tracked values, and whose feedback and results keep provenance.

    Args:
        name, ActionSpec, execute_cb, auto_start: as of `actionlib.SimpleActionServer`.
    """

    def __init__(self, name, ActionSpec, execute_cb=None, auto_start=True):  # noqa: N803 (actionlib's name)
        # The server that it makes is not started, and so has no connections: it goes as it came.
        super().__init__(name, ActionSpec, execute_cb, auto_start=False)
        self.action_server = _ActionServer(
            name, ActionSpec, self.internal_goal_callback, self.internal_preempt_callback, auto_start
        )


class _ActionServer(actionlib.ActionServer):
    def initialize(self):
        name = rospy.remap_name(self.ns)
        # Before the plain one, so that no goal is read without its provenance.
        goals = Subscriber(name + '/goal', self.ActionGoal, self.internal_goal_callback)
        super().initialize()
        self.goal_sub = _instead(self.goal_sub, goals)
        self.result_pub = _instead(
            self.result_pub, Publisher(name + '/result', self.ActionResult, queue_size=self.pub_queue_size)
        )
        self.feedback_pub = _instead(
            self.feedback_pub, Publisher(name + '/feedback', self.ActionFeedback, queue_size=self.pub_queue_size)
        )


def _instead(plain, carrying):
    """Give a plain publisher or subscriber up for one that carries provenance; they share their connections."""
    plain.unregister()
    return carrying
