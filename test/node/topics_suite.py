#!/usr/bin/env python3
"""Messages and services that carry provenance, also with plain publishers, subscribers and services."""

import os
import queue
import re
import signal
import subprocess
import tempfile
import time
import unittest

import message_filters
import rosbag
import rospy
from geometry_msgs.msg import Point, PointStamped, Pose
from rosslt.msg import Float64Tracked, PoseTracked
from std_msgs.msg import Float64, Header, MultiArrayDimension, MultiArrayLayout, String, UInt8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse

import rosslt
from support.filling import serialized
from support.processes import Node, wait_until

TALKER = """
    publisher = rosslt.{publisher}('pose', {kind}, queue_size=10, latch=True)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        x = rosslt.location(0.3, name='x')
        pose = Pose(position=Point(2 * x, x + 1, 5.0))
        publisher.publish(pose)
        rate.sleep()
    """


UPSTREAM = """
    publisher = rosslt.Publisher('up', Float64, queue_size=10)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(1.0, name='x'))
        rate.sleep()
    """


RELAY = """
    publisher = rosslt.Publisher('down', Float64, queue_size=10)
    rosslt.Subscriber('up', Float64, lambda up: publisher.publish(up.data * rosslt.location(2.0, name='gain')))
    rospy.spin()
    """


ASKER = """
    rosslt.Subscriber('/asked', Float64)
    rospy.spin()
    """


TWO_PUBLISHERS = """
    tracked, plain = (rosslt.Publisher('both', Float64, queue_size=10) for _ in range(2))
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        tracked.publish(rosslt.location(1.0, name='x'))
        plain.publish(1.0)
        plain.publish(2.0)
        rate.sleep()
    """


FAST = """
    publisher = rosslt.Publisher('{name}/fast', Float64, queue_size=10)
    rate = rospy.Rate({rate})
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(1.0, name='x', maximum=9.0))
        rate.sleep()
    """


SUM = """
    publisher = rosslt.Publisher('sum', Float64, queue_size=10)
    last = [0.0]
    rosslt.Subscriber('/second/fast', Float64, lambda second: last.append(second.data))

    def add(first):
        publisher.publish(first.data + last[-1] + rosslt.location(1.0, name='b', maximum=9.0))

    rosslt.Subscriber('/first/fast', Float64, add)
    rospy.spin()
    """


#: A controller and a robot that read each other, at 50 Hz.
CONTROLLER = """
    goal, gain, last = rosslt.location(3.0, name='goal'), rosslt.location(0.5, name='gain'), [0.0]
    rosslt.Subscriber('where', Float64, lambda message: last.__setitem__(0, message.data))
    publisher, rate = rosslt.Publisher('speed', Float64, queue_size=1), rospy.Rate(50)
    while not rospy.is_shutdown():
        publisher.publish(gain * (goal - last[0]))
        rate.sleep()
    """
ROBOT = """
    x, last, lag = 0.0, [0.0], rosslt.location(0.1, name='lag')
    rosslt.Subscriber('speed', Float64, lambda message: last.__setitem__(0, message.data))
    publisher, rate = rosslt.Publisher('where', Float64, queue_size=1), rospy.Rate(50)
    while not rospy.is_shutdown():
        x += 0.02 * rosslt.untracked(last[0])
        publisher.publish(x + lag * last[0])
        rate.sleep()
    """


class Inbox(queue.Queue):
    """A subscriber's messages."""

    def __init__(self, subscriber_class, topic, kind, **options):
        super().__init__()
        self.subscriber = subscriber_class(topic, kind, self.put, **options)

    def next(self, timeout=60.0):
        return self.get(timeout=timeout)

    def close(self):
        self.subscriber.unregister()


class Topics(unittest.TestCase):
    def test_what_has_a_source_and_what_has_none_are_told_apart_in_one_node(self):
        with Node('talker', TWO_PUBLISHERS, '_rosslt/rate:=10'):
            exact = Inbox(rosslt.Subscriber, '/both', Float64, keep_provenance=True)
            self.addCleanup(exact.close)
            found = {(message.data, rosslt.is_tracked(message)) for message in (exact.next() for _ in range(60))}
        self.assertEqual(found, {(1.0, True), (1.0, False), (2.0, False)})

    def test_a_relay_tells_all_sources_and_shows_a_change_upstream_at_once(self):
        with Node('upstream', UPSTREAM, '_rosslt/rate:=2'), Node('relay', RELAY, '_rosslt/rate:=2'):
            exact = Inbox(rosslt.Subscriber, '/down', Float64, keep_provenance=True)
            every = Inbox(rosslt.Subscriber, '/down', Float64)
            self.addCleanup(every.close)
            self.addCleanup(exact.close)
            nodes = {source.node: source for _ in range(4) for source in rosslt.sources(exact.next())}
            self.assertEqual(set(nodes), {'/upstream', '/relay'})
            for turn in range(2, 6):
                x = rosslt.track(0.0, nodes['/upstream'])
                rosslt.force_value(x, float(turn))
                seen = next(message for message in iter(every.next, None) if message.data == 2.0 * turn)
                self.assertEqual({source.node for source in rosslt.sources(seen)}, {'/upstream', '/relay'})
            while not exact.empty():
                exact.next()
            for _ in range(5):
                self.assertEqual({source.node for source in rosslt.sources(exact.next())}, {'/upstream', '/relay'})

    def test_nodes_that_read_each_other_are_whole_again_after_sampled_messages(self):
        def sources_of_next(inbox):
            return {source.node for source in rosslt.sources(inbox.next())}

        both = {'/controller', '/robot'}
        with Node('controller', CONTROLLER), Node('robot', ROBOT):
            inboxes = [Inbox(rosslt.Subscriber, topic, Float64, keep_provenance=True) for topic in ('/speed', '/where')]
            every = Inbox(rosslt.Subscriber, '/speed', Float64)
            for inbox in (*inboxes, every):
                self.addCleanup(inbox.close)
            for _ in range(2):
                for inbox in inboxes:
                    wait_until(lambda inbox=inbox: sources_of_next(inbox) == both, 'it is whole')
                rospy.set_param('/controller/rosslt/rate', 5)
                wait_until(lambda: rosslt.UNKNOWN in rosslt.sources(every.next()), 'some are sampled')
                rospy.set_param('/controller/rosslt/rate', 100)
                for inbox in inboxes:
                    while not inbox.empty():
                        inbox.next()

    def test_a_sum_of_fast_topics_that_is_whole_names_all_sources(self):
        rates = {'first': 200, 'second': 90}
        first, second = (Node(name, FAST.format(name=name, rate=rate)) for name, rate in rates.items())
        with first, second, Node('sum', SUM):
            exact = Inbox(rosslt.Subscriber, '/sum', Float64, keep_provenance=True)
            self.addCleanup(exact.close)
            every = Inbox(rosslt.Subscriber, '/sum', Float64)
            self.addCleanup(every.close)
            self.assertIn(3.0, (message.data for message in iter(every.next, None)))
            while not exact.empty():
                exact.next()
            for _ in range(60):
                sources = rosslt.sources(exact.next())
                self.assertEqual({source.node for source in sources}, {'/first', '/second', '/sum'})
            rosslt.force_field('/sum', 'data', 21.0, timeout=20.0)
            self.assertIn(21.0, (message.data for message in iter(every.next, None)))

    def test_messages_are_whole_at_a_rate_and_plain_between(self):
        with Node(
            'talker', TALKER.format(publisher='Publisher', kind='Pose').replace(', latch=True', ''), '_rosslt/rate:=10'
        ):
            begin = time.monotonic()
            inbox = Inbox(rosslt.Subscriber, '/pose', Pose)
            self.addCleanup(inbox.close)
            found = [rosslt.UNKNOWN not in rosslt.sources(inbox.next())]
            self.assertTrue(found[0])
            while sum(found) < 20 or all(found):
                found.append(rosslt.UNKNOWN not in rosslt.sources(inbox.next()))
                # The subscription asks for the first ones, one may come half a period early, and there are up to four
                # when a second begins, as all publishers are whole then.
                elapsed = time.monotonic() - begin
                self.assertLessEqual(sum(found), 3 + 10 * elapsed + 4 * (elapsed + 1))

    def test_all_of_a_sampled_message_is_unknown_until_a_whole_one_of_its_form_has_come(self):
        def sources(*numbers, data):
            layout = MultiArrayLayout(dim=[MultiArrayDimension(size=number) for number in numbers])
            publisher.publish(UInt8MultiArray(layout, data))
            message = inbox.next()
            self.assertEqual(message.data, data)
            return [rosslt.sources(dim.size) for dim in message.layout.dim]

        publisher = rosslt.Publisher('/form', UInt8MultiArray, queue_size=10)
        inbox = Inbox(rosslt.Subscriber, '/form', UInt8MultiArray)
        self.addCleanup(inbox.close)
        wait_until(publisher.get_num_connections, 'the subscriber is there')
        x = rosslt.Source('/elsewhere', 1)
        known, unknown = rosslt.track(2, x), rosslt.track(2, rosslt.UNKNOWN)
        self.assertEqual(sources(unknown, 3, data=b'ab'), [[rosslt.UNKNOWN]] * 2)
        self.assertEqual(sources(known, 3, data=b'ab'), [[x], []])
        self.assertEqual(sources(unknown, 3, data=b'ab'), [[rosslt.UNKNOWN], []])
        self.assertEqual(sources(unknown, 3, 4, data=b'ab'), [[rosslt.UNKNOWN]] * 3)
        self.assertEqual(sources(unknown, 3, data=b'abc'), [[rosslt.UNKNOWN]] * 2)

    def test_each_of_several_who_have_subscribed_at_once_gets_a_whole_message(self):
        publisher = rosslt.Publisher('/asked', Float64, queue_size=10)
        inbox = Inbox(rosslt.Subscriber, '/asked', Float64)
        self.addCleanup(inbox.close)
        self.addCleanup(rospy.set_param, '~rosslt/rate', 20.0)
        rospy.set_param('~rosslt/rate', 0.001)
        wait_until(publisher.get_num_connections, 'the inbox is there')
        wait_until(lambda: self.is_sampled(publisher, inbox), 'messages come at the rate')
        for turn in range(2):
            with Node(f'asker{turn}', ASKER), Node(f'other_asker{turn}', ASKER):
                wait_until(lambda: publisher.get_num_connections() == 3, 'both have subscribed')
                self.assertFalse(self.is_sampled(publisher, inbox))
            wait_until(lambda: publisher.get_num_connections() == 1, 'both are gone')
            self.is_sampled(publisher, inbox)

    def is_sampled(self, publisher, inbox):
        publisher.publish(rosslt.track(1.0, rosslt.Source('/elsewhere', 1)))
        return rosslt.UNKNOWN in rosslt.sources(inbox.next())

    def received(self, publisher, kind, subscriber_class, subscribed):
        with Node('talker', TALKER.format(publisher=publisher, kind=kind)):
            inbox = Inbox(subscriber_class, '/pose', subscribed)
            try:
                return inbox.next()
            finally:
                inbox.close()

    def check_tracked(self, pose):
        self.assertIs(type(pose), Pose)
        x = rosslt.Source('/talker', rosslt.sources(pose.position.x)[0].location_id)
        self.assertEqual(rosslt.sources(pose), [x])
        self.assertEqual((pose.position.x, pose.position.y, pose.position.z), (0.6, 1.3, 5.0))
        self.assertEqual(rosslt.evaluate(pose.position, {x: 1.0}), Point(2.0, 2.0, 5.0))
        self.assertFalse(rosslt.is_tracked(pose.position.z))
        self.assertEqual(pose._connection_header['callerid'], '/talker')

    def test_provenance_arrives_in_band(self):
        self.check_tracked(self.received('Publisher', 'Pose', rosslt.Subscriber, Pose))

    def test_provenance_arrives_in_a_tracked_type(self):
        self.check_tracked(self.received('Publisher', 'PoseTracked', rosslt.Subscriber, PoseTracked))

    def test_a_plain_subscriber_gets_a_plain_message(self):
        pose = self.received('Publisher', 'Pose', rospy.Subscriber, Pose)
        self.assertEqual((type(pose), rosslt.is_tracked(pose), pose.position.x), (Pose, False, 0.6))

    def test_a_plain_subscriber_of_a_tracked_type_gets_the_header_and_the_data(self):
        tracked = self.received('Publisher', 'PoseTracked', rospy.Subscriber, PoseTracked)
        self.assertEqual((tracked.data.position.x, bool(tracked.provenance.data)), (0.6, True))

    def test_a_plain_publisher_is_heard(self):
        code = TALKER.format(publisher='Publisher', kind='Pose')
        code = code.replace('rosslt.Publisher', 'rospy.Publisher')
        with Node('talker', code.replace("rosslt.location(0.3, name='x')", '0.3')):
            inbox = Inbox(rosslt.Subscriber, '/pose', Pose)
            pose = inbox.next()
            inbox.close()
        self.assertEqual((pose.position.x, rosslt.is_tracked(pose)), (0.6, False))

    def test_plain_and_tracked_subscribers_mix_in_one_process_in_either_order(self):
        for kinds in ((rospy.Subscriber, rosslt.Subscriber), (rosslt.Subscriber, rospy.Subscriber)):
            with Node('talker', TALKER.format(publisher='Publisher', kind='Pose')):
                first = Inbox(kinds[0], '/pose', Pose)
                first.next()
                second = Inbox(kinds[1], '/pose', Pose)
                second.next()
                pose = (first if kinds[0] is rosslt.Subscriber else second).next()
                while not rosslt.is_tracked(pose):
                    pose = (first if kinds[0] is rosslt.Subscriber else second).next()
                self.check_tracked(pose)
                self.assertEqual((first if kinds[0] is rospy.Subscriber else second).next().position.x, 0.6)
                first.close()
                second.close()

    def test_a_node_sends_complete_histories_when_it_is_told_to(self):
        code = """
            publisher = rosslt.Publisher('history', Float64, queue_size=1)
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                publisher.publish((rosslt.location(0.5, name='x') + 1) * 2 - 3)
                rate.sleep()
            """
        with Node('historian', code):
            inbox = Inbox(rosslt.Subscriber, '/history', Float64, keep_provenance=True)

            def explained():
                value = inbox.next().data
                self.assertEqual(rosslt.solve(value, 2.0), {rosslt.sources(value)[0]: 1.5})
                return rosslt.explain(value)

            self.assertNotIn('+ 1', explained())
            rospy.set_param('/historian/rosslt/history', 'full')
            wait_until(lambda: re.search(r'\(0.5 \[.*\] \+ 1\) \* 2 - 3', explained()), 'the history is full')
            rospy.set_param('/historian/rosslt/history', 'folded')
            wait_until(lambda: '+ 1' not in explained(), 'the history is folded again')
            inbox.close()

    def test_a_latched_message_reaches_late_joiners_with_its_provenance(self):
        code = """
            publisher = rosslt.Publisher('latched', Float64, queue_size=1, latch=True)
            publisher.publish(rosslt.location(1.5))
            time.sleep(0.1)
            rospy.spin()
            """
        with Node('latcher', code):
            for _ in range(2):
                value = rosslt.wait_for_message('latched', Float64, timeout=60.0).data
                self.assertEqual((value, rosslt.is_tracked(value)), (1.5, True))

    def test_options_work_as_in_rospy(self):
        publisher = rosslt.Publisher('options', PointStamped, queue_size=5, tcp_nodelay=True, latch=True)
        got = []
        subscriber = rosslt.Subscriber(
            'options',
            PointStamped,
            lambda *arguments: got.append(arguments),
            callback_args='more',
            queue_size=3,
            buff_size=10000,
            tcp_nodelay=True,
        )
        publisher.publish(point=Point(rosslt.location(1.0), 2.0, 3.0))
        message, more = wait_until(lambda: got, 'it arrives')[0]
        self.assertEqual((more, message.point.y, rosslt.is_tracked(message.point.x)), ('more', 2.0, True))
        self.assertEqual((subscriber.get_num_connections(), publisher.get_num_connections()), (1, 1))
        subscriber.unregister()
        subscriber.unregister()
        wait_until(lambda: publisher.get_num_connections() == 0, 'the subscriber is gone')
        publisher.unregister()
        with self.assertRaises(rospy.ROSException):
            publisher.publish(PointStamped())

    def test_a_message_of_another_type_is_refused(self):
        pose, point, tracked = Pose(), Point(), PoseTracked()
        for kind, wrong in ((Pose, (point, tracked)), (PoseTracked, (point, Float64Tracked())), (Point, (pose,))):
            publisher = rosslt.Publisher('other_type', kind, queue_size=1)
            for message in wrong:
                with self.assertRaises(TypeError):
                    publisher.publish(message)
            with self.assertRaises(TypeError):
                publisher.publish(pose, x=1.0)
            publisher.unregister()

    def test_what_a_subscribe_listener_publishes_carries_provenance(self):
        x = rosslt.location(1.0, name='listened')
        gone = []

        class Greeting(rospy.SubscribeListener):
            def peer_subscribe(self, topic_name, topic_publish, peer_publish):
                peer_publish(Float64(x + 1))
                topic_publish(Float64(x + 2))

            def peer_unsubscribe(self, topic_name, num_peers):
                gone.append((topic_name, num_peers))

        for kind in (Float64, Float64Tracked):
            publisher = rosslt.Publisher('greeting', kind, Greeting(), queue_size=5)
            inbox = Inbox(rosslt.Subscriber, '/greeting', kind)
            got = inbox.next(), inbox.next()
            self.assertEqual([message.data for message in got], [2.0, 3.0])
            self.assertEqual(
                [rosslt.solve(message.data, 5.0) for message in got],
                [{rosslt.sources(x)[0]: 4.0}, {rosslt.sources(x)[0]: 3.0}],
            )
            inbox.close()
            wait_until(lambda: gone, 'the listener is told that the subscriber is gone')
            self.assertEqual(gone.pop(), ('/greeting', 0))
            publisher.unregister()

    def test_bytes_that_are_passed_on_keep_their_provenance(self):
        source, relay = (rosslt.Publisher(name, Float64, queue_size=5) for name in ('relay_in', 'relay_out'))
        inbox = Inbox(rosslt.Subscriber, '/relay_out', Float64)
        relaying = rosslt.Subscriber('relay_in', rospy.AnyMsg, relay.publish)
        wait_until(lambda: source.get_num_connections() and relay.get_num_connections(), 'all are connected')
        x = rosslt.location(1.0, name='relayed')
        source.publish(Float64(x + 1))
        self.assertEqual(rosslt.solve(inbox.next().data, 5.0), {rosslt.sources(x)[0]: 4.0})
        relaying.unregister()
        inbox.close()

    def test_publishing_ends_with_the_node_as_in_rospy(self):
        code = """
            publisher = {}.Publisher('ending', Float64, queue_size=1)
            sys.stdin.readline()
            rospy.signal_shutdown('it is over')
            publisher.publish(1.0)
            publisher.unregister()
            try:
                publisher.publish(1.0)
            except rospy.ROSException as error:
                print(error, flush=True)
            """
        for package in ('rospy', 'rosslt'):
            ending = Node('ending', code.format(package))
            ending.process.stdin.write('end\n')
            ending.process.stdin.flush()
            self.assertEqual(ending.read_line(), 'publish() to an unregistered() handle', package)
            self.assertEqual(ending.process.wait(60), 0)

    def test_a_wrong_field_is_an_error_of_that_field_and_the_next_message_arrives(self):
        for kind in (Pose, PoseTracked):
            publisher = rosslt.Publisher('wrong', kind, queue_size=5)
            inbox = Inbox(rosslt.Subscriber, '/wrong', kind)
            wait_until(publisher.get_num_connections, 'it is connected')
            for y in (2.0, 3.0):
                with self.assertRaisesRegex(rospy.ROSSerializationException, 'position.y'):
                    publisher.publish(Pose(position=Point(rosslt.location(1.0), 'text', 3.0)))
                publisher.publish(Pose(position=Point(rosslt.location(1.0), y, 3.0)))
                self.assertEqual(inbox.next().position.y, y)
            with self.assertRaises(AttributeError):
                publisher.publish(Pose(position='nowhere'))
            publisher.publish(Pose(position=Point(1.0, 4.0, 3.0)))
            self.assertEqual(inbox.next().position.y, 4.0)
            inbox.close()
            publisher.unregister()

    def test_a_message_without_a_tracked_field_is_byte_for_byte_what_rospy_sends(self):
        raw = Inbox(rospy.Subscriber, '/bytes', rospy.AnyMsg)
        publisher = rosslt.Publisher('bytes', Pose, queue_size=1)
        wait_until(publisher.get_num_connections, 'it is connected')
        pose = Pose(position=Point(1.0, 2.0, 3.0))
        publisher.publish(pose)
        plain = serialized(pose)
        self.assertEqual(raw.next()._buff, plain)
        pose.position.x = rosslt.location(1.0)
        publisher.publish(pose)
        self.assertTrue(raw.next()._buff.startswith(plain))
        raw.close()

    def test_a_header_that_cannot_be_read_is_reported_once_and_the_message_arrives_untracked(self):
        plain = serialized(Float64(5.0))
        message = Float64(rosslt.location(5.0))
        publisher = rosslt.Publisher('good', Float64, queue_size=1)
        raw = Inbox(rospy.Subscriber, '/good', rospy.AnyMsg)
        wait_until(publisher.get_num_connections, 'it is connected')
        publisher.publish(message)
        good = bytearray(raw.next()._buff)
        raw.close()
        middle = len(plain) + (len(good) - len(plain)) // 4
        good[middle] ^= 0xFF
        spoiler = rospy.Publisher('spoiled', rospy.AnyMsg, queue_size=10)
        spoiler.impl.data_class = Float64  # what AnyMsg sends is told to be a Float64
        spoiled = rospy.AnyMsg()
        spoiled._buff = bytes(good)
        code = """
            rosslt.Subscriber('spoiled', Float64, lambda message: print(
                message.data, rosslt.is_tracked(message), flush=True))
            rospy.spin()
            """
        with Node('listener', code) as listener:
            wait_until(spoiler.get_num_connections, 'the listener is connected')
            for _ in range(3):
                spoiler.publish(spoiled)
            self.assertEqual([listener.read_line() for _ in range(3)], ['5.0 False'] * 3)
            listener.stop()
            self.assertEqual(listener.warnings(), 1)

    def test_a_recorded_bag_brings_provenance_back(self):
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, 'pose.bag')
            with Node('talker', TALKER.format(publisher='Publisher', kind='Pose')):
                record = subprocess.Popen(
                    ['rosbag', 'record', '-O', path, '/pose'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
                wait_until(lambda: os.path.exists(path + '.active'), 'the bag is open')
                time.sleep(1.0)  # some messages: rosbag tells nobody how many it has
                record.send_signal(signal.SIGINT)
                record.wait(60)
            with rosbag.Bag(path) as bag:
                self.assertEqual(next(bag.read_messages())[1].position.x, 0.6)
            inbox = Inbox(rosslt.Subscriber, '/pose', Pose)
            play = subprocess.Popen(['rosbag', 'play', '-q', path], stdin=subprocess.DEVNULL)
            try:
                pose = inbox.next(15.0)
            finally:
                play.send_signal(signal.SIGINT)
                play.wait(60)
                inbox.close()
            self.assertEqual([source.node for source in rosslt.sources(pose)], ['/talker'])
            self.assertEqual(rosslt.solve(pose.position.x, 2.0), {rosslt.sources(pose)[0]: 1.0})

    def test_message_filters_match_messages_that_keep_provenance(self):
        x = rosslt.location(1.0, name='filtered')
        names = ['filtered_a', 'filtered_b']
        publishers = [rosslt.Publisher(name, PointStamped, queue_size=5) for name in names]
        readers = [rosslt.Subscriber(name, PointStamped) for name in names]
        filters = [message_filters.Subscriber(name, PointStamped) for name in names]
        together = message_filters.TimeSynchronizer(filters, 10)
        got = queue.Queue()
        together.registerCallback(lambda *both: got.put(both))
        wait_until(lambda: all(publisher.get_num_connections() for publisher in publishers), 'they are connected')
        for factor, publisher in enumerate(publishers, 2):
            publisher.publish(PointStamped(Header(stamp=rospy.Time(5)), Point(factor * x, 0.0, 0.0)))
        both = got.get(timeout=60.0)
        self.assertEqual(
            [rosslt.solve(each.point.x, 12.0) for each in both], [{rosslt.sources(x)[0]: 12.0 / f} for f in (2, 3)]
        )
        for each in (*publishers, *readers, *(filter_.sub for filter_ in filters)):
            each.unregister()


class Services(unittest.TestCase):
    SERVER = """
        from std_srvs.srv import SetBool, SetBoolResponse
        def handle(request):
            print(rosslt.is_tracked(request.data), flush=True)
            return SetBoolResponse(request.data, 'from ' + rosslt.location('here', name='place'))
        {module}.Service('serve', SetBool, handle)
        rospy.spin()
        """

    def test_requests_and_responses_keep_provenance(self):
        on = rosslt.location(True, name='on')
        with Node('server', self.SERVER.format(module='rosslt')) as server:
            rospy.wait_for_service('/serve', 5.0)
            response = rosslt.ServiceProxy('/serve', SetBool)(on)
            self.assertEqual(server.read_line(), 'True')
            self.assertIs(type(response), SetBoolResponse)
            self.assertEqual(rosslt.sources(response.success), rosslt.sources(on))
            self.assertEqual([source.node for source in rosslt.sources(response.message)], ['/server'])
            rosslt.force_value(response.message, 'from there')
            self.assertEqual(rosslt.ServiceProxy('/serve', SetBool)(data=on).message, 'from there')

    def test_a_plain_caller_is_served(self):
        with Node('server', self.SERVER.format(module='rosslt')) as server:
            rospy.wait_for_service('/serve', 5.0)
            response = rospy.ServiceProxy('/serve', SetBool)(True)
            self.assertEqual(server.read_line(), 'False')
            self.assertEqual((response.success, response.message), (True, 'from here'))

    def test_a_plain_server_is_called(self):
        with Node('server', self.SERVER.format(module='rospy')) as server:
            rospy.wait_for_service('/serve', 5.0)
            response = rosslt.ServiceProxy('/serve', SetBool)(rosslt.location(True, name='called'))
            self.assertEqual(server.read_line(), 'False')
            self.assertEqual((response.success, response.message), (True, 'from here'))
            self.assertFalse(rosslt.is_tracked(response))

    def test_a_persistent_proxy_and_errors_work_as_in_rospy(self):
        def fail(_request):
            raise rospy.ServiceException('not today')

        service = rosslt.Service('~fail', SetBool, fail)
        proxy = rosslt.ServiceProxy('~fail', SetBool, persistent=True)
        for _ in range(2):
            with self.assertRaisesRegex(rospy.ServiceException, 'not today'):
                proxy(True)
        with self.assertRaises(TypeError):
            proxy(String('no bool'), 1)
        proxy.close()
        service.shutdown()


if __name__ == '__main__':
    import rostest

    rosslt.init_node('topics')
    rostest.rosrun('rosslt', 'topics', '__main__')
