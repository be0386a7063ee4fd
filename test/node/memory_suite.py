#!/usr/bin/env python3
"""What a node that was written with rosslt keeps, and sends again or answers with, after a change."""

import unittest

import rospy
from geometry_msgs.msg import Point, PoseStamped
from rosslt.srv import ListLocations
from std_msgs.msg import Float64
from std_srvs.srv import SetBool
from topics_suite import Inbox

import rosslt
from support.processes import Node, wait_until


def source(node, name):
    def found():
        listed = rospy.ServiceProxy(node + '/rosslt/list_locations', ListLocations)().locations
        return [rosslt.Source(node, one.id) for one in listed if one.name == name]

    return wait_until(found, name + ' to be listed')[0]


def change(node, **values):
    rosslt.node.request_values({source(node, name): value for name, value in values.items()}, timeout=30.0)


class Latched(unittest.TestCase):
    TALKER = """
        publisher = rosslt.Publisher('latched', PoseStamped, queue_size=1, latch=True)
        pose = PoseStamped()
        pose.header.frame_id = 'map'
        x = rosslt.location(1.0, name='x')
        y = rosslt.location(2.0, name='y')
        pose.pose.position.x = 2 * x
        pose.pose.position.y = x + y
        pose.pose.position.z = x * x
        publisher.publish(pose)
        {then}
        rospy.spin()
        """

    def test_a_latched_message_is_published_again_when_a_source_of_it_changes(self):
        with Node('latcher', self.TALKER.format(then='')):
            inbox = Inbox(rosslt.Subscriber, '/latched', PoseStamped)
            pose = inbox.next().pose
            self.assertEqual(pose.position, Point(2.0, 3.0, 1.0))
            rosslt.force_value(pose.position.x, 8.0)
            again = inbox.next()
            self.assertEqual(again.pose.position, Point(8.0, 6.0, 16.0))
            self.assertEqual((again.header.frame_id, again.header.seq), ('map', 2))
            rosslt.force_value(again.pose.position.x, 2.0)
            self.assertEqual(inbox.next().pose.position, Point(2.0, 3.0, 1.0))
            late = Inbox(rosslt.Subscriber, '/latched', PoseStamped)
            self.assertEqual(late.next().pose.position, Point(2.0, 3.0, 1.0))
            late.close()
            inbox.close()

    def test_several_sources_that_change_together_are_shown_together(self):
        with Node('latcher', self.TALKER.format(then='')):
            inbox = Inbox(rosslt.Subscriber, '/latched', PoseStamped)
            position = inbox.next().pose.position
            for turn in range(3, 9):
                rosslt.force_value([position.x, position.y], [2.0 * turn, 2.0 * turn])
                position = inbox.next().pose.position
                self.assertEqual((position.x, position.y), (2.0 * turn, 2.0 * turn))
            inbox.close()

    def test_only_a_message_that_follows_is_sent_again(self):
        then = """
        other = rosslt.location(1.0, name='other')
        replaced = rosslt.Publisher('replaced', Float64, queue_size=10, latch=True)
        replaced.publish(x)
        replaced.publish(7.0)
        """
        with Node('latcher', self.TALKER.format(then=then)):
            inboxes = [
                Inbox(rosslt.Subscriber, '/latched', PoseStamped),
                Inbox(rosslt.Subscriber, '/replaced', Float64),
            ]
            self.assertEqual(inboxes[0].next().pose.position.x, 2.0)
            self.assertEqual(inboxes[1].next().data, 7.0)
            change('/latcher', other=2.0)
            change('/latcher', x=2.0)
            self.assertEqual(inboxes[0].next().pose.position.x, 4.0)
            self.assertTrue(inboxes[0].empty() and inboxes[1].empty())
            for inbox in inboxes:
                inbox.close()


class Kept(unittest.TestCase):
    def test_a_response_that_is_kept_follows(self):
        code = """
        from std_srvs.srv import SetBool, SetBoolResponse
        response = SetBoolResponse(rosslt.location(True, name='on'), 'stored')
        service = rosslt.Service('~ask', SetBool, lambda request: response)
        rospy.spin()
        """
        with Node('responder', code):
            ask = rospy.ServiceProxy('/responder/ask', SetBool)
            ask.wait_for_service(60.0)
            self.assertTrue(ask(True).success)
            change('/responder', on=False)
            self.assertFalse(ask(True).success)

    def test_what_would_have_no_value_is_refused(self):
        code = """
        x = rosslt.location(4.0, name='x')
        share, root = 1 / x, rosslt.math.sqrt(x)
        publisher = rosslt.Publisher('shared', Point, queue_size=1)
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            publisher.publish(share, root, x)
            rate.sleep()
        """
        with Node('sharer', code):
            with self.assertRaisesRegex(rosslt.ChangeRejected, r'1 / .* would have no value: .*division by zero'):
                change('/sharer', x=0.0)
            change('/sharer', x=16.0)
            inbox = Inbox(rosslt.Subscriber, '/shared', Point)
            wait_until(lambda: inbox.next() == Point(0.0625, 4.0, 16.0), 'the change')
            inbox.close()

    def test_a_parameter_that_is_read_again_and_again_is_left_to_the_node(self):
        code = """
        kept, is_polling = rosslt.get_param('~gain', 1.0), False
        publisher = rosslt.Publisher('applied', Float64, queue_size=1, latch=True)
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            gain = rosslt.get_param('~gain', 1.0)
            if not is_polling:
                is_polling = publisher.publish(0.0) or True
            if gain != kept:
                kept = gain
                publisher.publish(10 * gain)
            rate.sleep()
        """
        with Node('poller', code):
            inbox = Inbox(rosslt.Subscriber, '/applied', Float64)
            self.assertEqual(inbox.next().data, 0.0)
            rospy.set_param('/poller/gain', 2.5)
            self.assertEqual(inbox.next().data, 25.0)
            inbox.close()

    def test_a_field_of_whole_numbers_keeps_its_number(self):
        code = """
        from visualization_msgs.msg import Marker
        marker = Marker(id=rosslt.get_param('~count', 3))
        marker.scale.x = rosslt.get_param('~count', 3)
        publisher = rosslt.Publisher('counted', Marker, queue_size=1)
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            publisher.publish(marker)
            rate.sleep()
        """
        from visualization_msgs.msg import Marker

        with Node('counter', code):
            inbox = Inbox(rosslt.Subscriber, '/counted', Marker)
            for count, shown in ((5, 5), (5.5, 5)):
                rospy.set_param('/counter/count', count)
                wait_until(lambda count=count: inbox.next().scale.x == count, 'the change')
                self.assertEqual(inbox.next().id, shown)
            inbox.close()

    def test_a_change_in_the_set_up_reaches_what_is_there(self):
        code = """
        speed = rosslt.location(1.0, name='speed')
        half = speed / 2
        sys.stdin.readline()
        publisher = rosslt.Publisher('half', Float64, queue_size=1, latch=True)
        publisher.publish(half)
        rospy.spin()
        """
        with Node('starter', code) as node:
            change('/starter', speed=3.0)
            node.process.stdin.write('go\n')
            node.process.stdin.flush()
            inbox = Inbox(rosslt.Subscriber, '/half', Float64)
            self.assertEqual(inbox.next().data, 1.5)
            inbox.close()


if __name__ == '__main__':
    import rostest

    rosslt.init_node('memory')
    rostest.rosrun('rosslt', 'memory', '__main__')
