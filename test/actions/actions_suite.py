#!/usr/bin/env python3
"""Actions that carry provenance, also with plain clients and servers."""

import queue
import unittest

import rospy
from actionlib.msg import TwoIntsAction, TwoIntsActionResult, TwoIntsGoal
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult

import rosslt
from support.processes import Node, wait_until

IMPORTS = """
    import actionlib
    from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult
    """

#: Sends the same goal again and again; prints what it is told, with the sources.
CLIENT = (
    IMPORTS
    + """
    def told(feedback):
        x = feedback.base_position.pose.position.x
        print(rosslt.untracked(x), [source.node for source in rosslt.sources(x)], flush=True)

    client = {module}.SimpleActionClient('move', MoveBaseAction)
    client.wait_for_server()
    while not rospy.is_shutdown():
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = 'world'
        goal.target_pose.pose.position.x = rosslt.location(1.0, name='x')
        client.send_goal(goal, feedback_cb=told)
        client.wait_for_result(rospy.Duration(1.0))
    """
)

#: Is always a metre ahead of the goal.
SERVER = (
    IMPORTS
    + """
    def execute(goal):
        feedback = MoveBaseFeedback(base_position=goal.target_pose)
        feedback.base_position.pose.position.x = goal.target_pose.pose.position.x + 1
        server.publish_feedback(feedback)
        rospy.sleep(0.05)
        server.set_succeeded(MoveBaseResult())

    server = {module}.SimpleActionServer('move', MoveBaseAction, execute, auto_start=False)
    server.start()
    rospy.spin()
    """
)

ADDING_SERVER = """
    from actionlib.msg import TwoIntsAction, TwoIntsResult

    def add(goal):
        server.set_succeeded(TwoIntsResult(goal.a + goal.b + rosslt.location(5, name='offset')))

    server = rosslt.SimpleActionServer('add', TwoIntsAction, add, auto_start=False)
    server.start()
    rospy.spin()
    """

#: The same, which tells a subscriber of its results that it is connected, and takes its time to know so itself.
LATE_SERVER = (
    """
    from rospy.impl.tcpros_base import TCPROSTransport

    write_header = TCPROSTransport.write_header

    def write_header_and_linger(transport):
        write_header(transport)
        if transport.name.endswith('/result'):
            time.sleep(1.0)

    TCPROSTransport.write_header = write_header_and_linger
    """
    + ADDING_SERVER
)

ADDING_CLIENT = """
    from actionlib.msg import TwoIntsAction, TwoIntsGoal

    client = rosslt.SimpleActionClient('add', TwoIntsAction)
    client.wait_for_server()
    client.send_goal_and_wait(TwoIntsGoal(rosslt.location(1, name='a'), 2))
    sum = client.get_result().sum
    print(sum, sorted(source.node for source in rosslt.sources(sum)), flush=True)
    rospy.spin()
    """


class Actions(unittest.TestCase):
    def setUp(self):
        self.feedback = queue.Queue()

    def peers(self, client, server):
        """A client and a server, each of `rosslt` or of `actionlib`."""
        started = Node('server', SERVER.format(module=server))
        self.addCleanup(started.stop)
        started = Node('client', CLIENT.format(module=client))
        self.addCleanup(started.stop)
        return started

    def position(self, holds=lambda x: True):
        """The next position of the server's feedback of which something holds."""
        subscriber = rosslt.Subscriber('move/feedback', MoveBaseActionFeedback, self.feedback.put)
        try:
            return wait_until(
                lambda: next(
                    (x for x in [self.feedback.get(timeout=60.0).feedback.base_position.pose.position.x] if holds(x)),
                    None,
                ),
                'feedback comes',
            )
        finally:
            subscriber.unregister()

    def test_a_server_that_answers_before_the_client_goes_on_is_heard(self):
        with Node('quick', ADDING_SERVER):
            client = rosslt.SimpleActionClient('add', TwoIntsAction)
            self.assertTrue(client.wait_for_server(rospy.Duration(10.0)))
            manager = client.action_client.manager
            publish, said = manager.send_goal_fn, []

            def publish_and_linger(action_goal):
                publish(action_goal)
                wait_until(lambda: said, 'the result is there')

            manager.register_send_goal_fn(publish_and_linger)
            for number in (1, 2):
                said.clear()
                client.send_goal(TwoIntsGoal(number, 2), done_cb=lambda _, result: said.append(result.sum))
                self.assertTrue(client.wait_for_result(rospy.Duration(5.0)))
                self.assertEqual((client.get_result().sum, said), (number + 7, [number + 7]))

    def test_a_server_that_is_waited_for_is_heard(self):
        with Node('late', LATE_SERVER):
            client = rosslt.SimpleActionClient('add', TwoIntsAction)
            self.addCleanup(client.action_client.stop)
            self.assertTrue(client.wait_for_server(rospy.Duration(10.0)))
            # the server takes one connection after the other: that for results last, as the threads may have it, too
            actions = client.action_client
            actions.result_sub.unregister()
            actions.result_sub = rosslt.Subscriber('add/result', TwoIntsActionResult, actions._result_cb)
            self.assertTrue(client.wait_for_server(rospy.Duration(10.0)))
            client.send_goal(TwoIntsGoal(1, 2))
            self.assertTrue(client.wait_for_result(rospy.Duration(5.0)))
            self.assertEqual(client.get_result().sum, 8)

    def test_waiting_for_a_server_ends_when_the_time_is_over(self):
        client = rosslt.SimpleActionClient('nobody', TwoIntsAction)
        self.addCleanup(client.action_client.stop)
        self.assertFalse(client.wait_for_server(rospy.Duration(0.2)))

    def test_the_goal_is_forced_from_the_feedback_back_to_the_literal_of_the_client(self):
        self.peers('rosslt', 'rosslt')
        x = self.position()
        self.assertEqual(x, 2.0)
        (source,) = rosslt.sources(x)
        self.assertEqual(source.node, '/client')
        self.assertEqual(rosslt.force_value(x, 8.0), {source: rosslt.Change(1.0, 7.0)})
        self.assertEqual(self.position(lambda x: x != 2.0), 8.0)
        wait_until(lambda: rospy.get_param('/client/rosslt/x') == 7.0, 'the literal has changed')

    def test_the_client_is_told_where_the_feedback_comes_from(self):
        client = self.peers('rosslt', 'rosslt')
        self.assertEqual(client.read_line(), "2.0 ['/client']")

    def test_the_result_keeps_provenance(self):
        with Node('server', ADDING_SERVER), Node('client', ADDING_CLIENT) as client:
            self.assertEqual(client.read_line(), "8 ['/client', '/server']")

    def test_a_plain_server_serves_a_tracked_client(self):
        client = self.peers('rosslt', 'actionlib')
        self.assertEqual(client.read_line(), '2.0 []')

    def test_a_tracked_server_serves_a_plain_client(self):
        client = self.peers('actionlib', 'rosslt')
        self.assertEqual(client.read_line(), '2.0 []')

    def test_plain_subscribers_hear_ordinary_messages(self):
        self.peers('rosslt', 'rosslt')
        result = rospy.wait_for_message('move/result', MoveBaseActionResult, timeout=60.0)
        self.assertEqual(result.status.status, 3)
        feedback = rospy.wait_for_message('move/feedback', MoveBaseActionFeedback, timeout=60.0)
        self.assertFalse(rosslt.is_tracked(feedback))


if __name__ == '__main__':
    import rostest

    rosslt.init_node('actions')
    rostest.rosrun('rosslt', 'actions', '__main__')
