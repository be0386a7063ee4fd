#!/usr/bin/env python3
"""What a node read once stays alive: what it sends is evaluated anew where sources of it have changed since."""

import math
import threading
import unittest

import rospy
from geometry_msgs.msg import Point, PointStamped, Pose, PoseStamped
from rosslt.msg import PoseTracked
from std_msgs.msg import Float64, Float64MultiArray, Int32
from std_srvs.srv import SetBool, SetBoolResponse
from topics_suite import Inbox
from visualization_msgs.msg import Marker

import rosslt
from rosslt import values
from rosslt.node.serialization import Sending
from support.processes import Node, wait_until


class Alive(unittest.TestCase):
    def setUp(self):
        self.places = 0

    def location(self, value, **options):
        """A location of this test's own."""
        self.places += 1
        name = '{}/place{}'.format(self.id().rsplit('.', 1)[-1], self.places)
        return rosslt.location(value, name=name, key=name, **options)

    def channel(self, kind, **options):
        """A publisher of this process, and the messages that arrive from it."""
        topic = '/' + self.id().rsplit('.', 1)[-1]
        publisher = rosslt.Publisher(topic, kind, queue_size=20, **options)
        inbox = Inbox(rosslt.Subscriber, topic, kind)
        self.addCleanup(publisher.unregister)
        self.addCleanup(inbox.close)
        wait_until(publisher.get_num_connections, 'they are connected')
        return publisher, inbox

    def sent(self, publisher, inbox, message):
        publisher.publish(message)
        return inbox.next()

    def test_a_message_that_was_filled_once_shows_changes(self):
        x = self.location(1.0)
        pose = Pose(position=Point(2 * x + 1, x, 7.0))
        for kind in (Pose, PoseTracked):
            publisher, inbox = self.channel(kind)
            rosslt.force_value(x, 1.0)
            self.assertEqual(self.sent(publisher, inbox, pose).position, Point(3.0, 1.0, 7.0))
            rosslt.force_value(x, 5.0)
            shown = self.sent(publisher, inbox, pose)
            self.assertEqual(shown.position, Point(11.0, 5.0, 7.0))
            (source,) = rosslt.sources(x)
            self.assertEqual(rosslt.solve(shown.position.x, 21.0), {source: 10.0})
            inbox.close()
            publisher.unregister()

    def test_a_wrong_field_is_the_error_that_it_is_in_rospy(self):
        x = self.location(1.0)
        publisher, inbox = self.channel(Float64MultiArray)
        rosslt.force_value(x, 2.0)
        with self.assertRaisesRegex(rospy.ROSSerializationException, 'data must be a list'):
            publisher.publish(Float64MultiArray(data=5))
        self.assertEqual(self.sent(publisher, inbox, Float64MultiArray(data=[x])).data[0], 2.0)

    def test_the_message_of_the_node_stays_as_it_is(self):
        x = self.location(1.0)
        marker = Marker(points=[Point(x, 2.0, 3.0), Point(4.0, x + 1, 6.0)], scale=Point(x, 1.0, 1.0))
        publisher, inbox = self.channel(Marker)
        points, first, value = marker.points, marker.points[0], marker.points[0].x
        rosslt.force_value(x, 8.0)
        shown = self.sent(publisher, inbox, marker)
        self.assertEqual([shown.points[0].x, shown.points[1].y, shown.scale.x], [8.0, 9.0, 8.0])
        self.assertIs(marker.points, points)
        self.assertIs(marker.points[0], first)
        self.assertIs(marker.points[0].x, value)
        self.assertEqual((value, marker.points[1].y, marker.scale.x), (1.0, 2.0, 1.0))

    def test_a_message_that_is_changed_and_published_again_is_right(self):
        x = self.location(1.0)
        message = PointStamped(point=Point(x, 0.0, 0.0))
        publisher, inbox = self.channel(PointStamped)
        rosslt.force_value(x, 2.0)
        self.assertEqual(self.sent(publisher, inbox, message).point.x, 2.0)
        message.point.x += 10  # from the reading that the node has
        self.assertEqual(self.sent(publisher, inbox, message).point.x, 12.0)
        message.point.x = 3.0
        shown = self.sent(publisher, inbox, message)
        self.assertEqual((shown.point.x, rosslt.is_tracked(shown.point.x)), (3.0, False))
        self.assertEqual(shown.header.seq, message.header.seq)

    def test_lists_and_numbers_of_every_kind_show_changes(self):
        gain, count = self.location(0.5), self.location(3)
        publisher, inbox = self.channel(Float64MultiArray)
        for kind in (list, tuple):
            rosslt.force_value(gain, 0.5)
            array = Float64MultiArray(data=kind([gain, 2.0, gain * 4]))
            rosslt.force_value(gain, 1.5)
            self.assertEqual(list(self.sent(publisher, inbox, array).data), [1.5, 2.0, 6.0])
            self.assertEqual(list(array.data), [0.5, 2.0, 2.0])
        publisher.unregister()
        inbox.close()
        publisher, inbox = self.channel(Int32)
        rosslt.force_value(count, 4)
        self.assertEqual(self.sent(publisher, inbox, Int32(count * 2)).data, 8)

    def test_what_is_computed_anew_from_a_value_that_was_read_once_shows_changes(self):
        gain = self.location(2.0)
        publisher, inbox = self.channel(Float64)
        for turn in range(1, 4):
            self.assertEqual(self.sent(publisher, inbox, gain * turn + 1).data, 2.0 * turn + 1)
        rosslt.force_value(gain, 10.0)
        for turn in range(4, 7):
            self.assertEqual(self.sent(publisher, inbox, gain * turn + 1).data, 10.0 * turn + 1)

    def test_a_formula_in_which_a_source_comes_up_several_times_shows_changes_from_the_second_message_on(self):
        side = self.location(3.0)
        publisher, inbox = self.channel(Float64)
        self.sent(publisher, inbox, side * side + side)
        rosslt.force_value(side, 4.0)
        self.sent(publisher, inbox, side * side + side)
        for _ in range(3):
            self.assertEqual(self.sent(publisher, inbox, side * side + side).data, 20.0)

    def test_what_several_fields_come_from_is_evaluated_once(self):
        self.addCleanup(setattr, Sending, 'rate', Sending.rate)
        Sending.rate = 1e6  # each message is whole
        x = self.location(1.0)
        far = rosslt.math.sin(x * x + x)
        publisher, inbox = self.channel(Point)
        before = self.sent(publisher, inbox, Point(far + 3, far + 1, far * 2))
        rosslt.force_value(x, 3.0)
        for _ in range(2):
            after = self.sent(publisher, inbox, Point(far + 3, far + 1, far * 2))
        far = math.sin(12.0)
        self.assertEqual(after, Point(far + 3, far + 1, far * 2))
        sizes = [len(values.disassemble([point.x, point.y, point.z])[0]) for point in (before, after)]
        self.assertEqual(sizes[0], sizes[1])

    def test_several_messages_that_take_turns_on_a_topic_show_changes(self):
        x = self.location(1.0)
        messages = [
            Marker(id=0, pose=Pose(position=Point(x * x, 0, 0))),
            Marker(id=1, pose=Pose(position=Point(x, 0, 0))),
        ]
        publisher, inbox = self.channel(Marker)
        rosslt.force_value(x, 3.0)
        for _ in range(2):
            shown = [self.sent(publisher, inbox, message).pose.position.x for message in messages]
        self.assertEqual(shown, [9.0, 3.0])

    def test_a_parameter_that_was_read_once_shows_what_it_is_set_to(self):
        rospy.set_param('~radius', 2.0)
        radius = rosslt.get_param('~radius')
        publisher, inbox = self.channel(Float64)
        message = Float64(rosslt.math.sin(radius))
        self.assertEqual(self.sent(publisher, inbox, message).data, math.sin(2.0))
        rospy.set_param('~radius', 1.0)
        wait_until(lambda: self.sent(publisher, inbox, message).data == math.sin(1.0), 'it shows')

    def test_an_external_location_that_was_read_once_shows_changes_but_not_what_moved_by_itself(self):
        box = {'x': 1.0}
        x = rosslt.location(getter=lambda: box['x'], setter=lambda value: box.update(x=value), name='boxed')
        publisher, inbox = self.channel(Float64)
        rosslt.force_value(x, 2.0)
        self.assertEqual(self.sent(publisher, inbox, x).data, 2.0)
        box['x'] = 9.0
        self.assertEqual(self.sent(publisher, inbox, x).data, 2.0)

    def test_a_setter_may_wait_for_who_publishes(self):
        box, mine, is_setting = {'x': 1.0}, threading.Lock(), threading.Event()

        def set_x(value):
            is_setting.set()
            with mine:
                box['x'] = value

        x = rosslt.location(getter=lambda: box['x'], setter=set_x, name='guarded')
        other = self.location(1.0)
        rosslt.force_value(other, 2.0)  # a reading of `other` that is in use and replaced
        publisher, inbox = self.channel(Float64)
        with mine:
            forcing = threading.Thread(target=rosslt.force_value, args=(x, 5.0))
            forcing.start()
            self.assertTrue(is_setting.wait(10.0))
            self.assertEqual(self.sent(publisher, inbox, other + 1).data, 3.0)
        forcing.join(10.0)
        self.assertEqual(self.sent(publisher, inbox, x).data, 5.0)

    def test_a_value_that_has_none_any_more_is_sent_as_it_was(self):
        x = self.location(4.0)
        publisher, inbox = self.channel(Point)
        message = Point(1 / x, rosslt.math.sqrt(x), x)
        rosslt.force_value(x, 0.0)
        self.assertEqual(self.sent(publisher, inbox, message), Point(0.25, 0.0, 0.0))
        rosslt.force_value(x, -1.0)
        self.assertEqual(self.sent(publisher, inbox, message), Point(-1.0, 2.0, -1.0))

    def test_a_field_keeps_its_type(self):
        rospy.set_param('~count', 3)
        count = rosslt.get_param('~count')
        publisher, inbox = self.channel(Int32)
        rospy.set_param('~count', 4)
        wait_until(lambda: self.sent(publisher, inbox, count).data == 4, 'it shows')
        rospy.set_param('~count', 4.5)
        wait_until(lambda: rosslt.get_param('~count') == 4.5, 'it has changed')
        self.assertEqual(self.sent(publisher, inbox, count).data, 3)

    def test_a_value_is_back_when_its_change_is_undone(self):
        x = self.location(1.0)
        publisher, inbox = self.channel(Float64)
        rosslt.force_value(x, 2.0)
        rosslt.undo()
        self.assertEqual(self.sent(publisher, inbox, x).data, 1.0)

    def test_services_answer_and_are_asked_with_present_values(self):
        on = self.location(True)
        response = SetBoolResponse(on, 'stored')
        asked = []

        def handle(request):
            asked.append(bool(request.data))
            return response

        service = rosslt.Service('~alive', SetBool, handle)
        self.addCleanup(service.shutdown)
        proxy = rosslt.ServiceProxy('~alive', SetBool)
        self.assertTrue(proxy(on).success)
        rosslt.force_value(on, False)
        self.assertFalse(proxy(on).success)
        self.assertEqual(asked, [True, False])

    def test_a_sum_over_time_is_sent_as_the_node_has_it(self):
        speed = self.location(1.0)
        publisher, inbox = self.channel(Float64)
        travelled = 0.0
        for _ in range(5):
            travelled = travelled + speed * 0.5
            self.sent(publisher, inbox, travelled)
        rosslt.force_value(speed, 3.0)
        self.assertEqual(self.sent(publisher, inbox, travelled + 0.0).data, 2.5)
        for turn in range(1, 5):  # with the speed that was read before
            travelled = travelled + speed * 0.5
            self.assertEqual(self.sent(publisher, inbox, travelled).data, 2.5 + 0.5 * turn)
        faster = rosslt.reevaluate(speed)
        for turn in range(1, 5):
            travelled = travelled + faster * 0.5
            self.assertEqual(self.sent(publisher, inbox, travelled).data, 4.5 + 1.5 * turn)


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

    def test_what_concerns_other_sources_and_what_was_published_since_is_not_sent_again(self):
        x = rosslt.location(1.0, name='latched_x')
        other = rosslt.location(1.0, name='latched_other')
        publisher = rosslt.Publisher('latched_here', Float64, queue_size=10, latch=True)
        inbox = Inbox(rosslt.Subscriber, '/latched_here', Float64)
        wait_until(publisher.get_num_connections, 'they are connected')
        publisher.publish(x)
        self.assertEqual(inbox.next().data, 1.0)
        rosslt.force_value(other, 2.0)
        rosslt.force_value(x, 2.0)
        self.assertEqual(inbox.next().data, 2.0)
        message = Float64(x + 1)
        publisher.publish(message)
        self.assertEqual(inbox.next().data, 3.0)
        message.data = 100.0  # which the node has not published
        rosslt.force_value(x, 3.0)
        self.assertEqual(inbox.next().data, 4.0)
        publisher.publish(7.0)
        self.assertEqual(inbox.next().data, 7.0)
        rosslt.force_value(x, 4.0)
        publisher.publish(8.0)
        self.assertEqual(inbox.next().data, 8.0)
        inbox.close()
        publisher.unregister()


if __name__ == '__main__':
    import rostest

    rosslt.init_node('refresh')
    rostest.rosrun('rosslt', 'refresh', '__main__')
