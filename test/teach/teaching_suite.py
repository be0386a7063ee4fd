#!/usr/bin/env python3
"""`rosslt teach`: a device that the test plays moves a thing of a node, by the rules of a mouse."""

import math
import os
import shutil
import signal
import subprocess
import tempfile

import rosbag
import rospkg
import rospy
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt
from support.teaching import Teach, WithDevices

STAGE = """
    from rosslt import math
    from visualization_msgs.msg import Marker, MarkerArray

    def marker(name, x, y=0.0, yaw=0.0):
        made = Marker(ns=name, type=Marker.CUBE, action=Marker.ADD)
        made.header.frame_id = 'world'
        made.pose.position.x, made.pose.position.y = x, y
        made.pose.orientation.z, made.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        made.scale.x = made.scale.y = made.scale.z = made.color.a = 1.0
        return made

    things = rosslt.Publisher('things', MarkerArray, queue_size=1)
    place = rosslt.Publisher('place', PoseStamped, queue_size=1)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        x, y = rosslt.location(1.0, name='x', maximum=4.0), 2.0 * rosslt.location(0.5, name='half_y')
        things.publish([marker('box', x, y), marker('dial', 5.0, yaw=rosslt.location(0.3, name='yaw'))])
        sent = PoseStamped()
        sent.header.frame_id = 'world'
        sent.pose.position.x = rosslt.location(-3.0, name='a')
        sent.pose.orientation.w = 1.0
        place.publish(sent)
        rate.sleep()
    """

SLT_TEACH = os.path.join(rospkg.RosPack().get_path('rosslt'), 'scripts', 'slt_teach')

PERIOD = 0.02  # s between two stamps
SPEED = 0.5  # m/s, the default
STEP = SPEED * PERIOD
HALFWAY = -0.55  # the deflection of a stick that counts -0.5: its dead zone is 0.1
NEAR = 1e-3  # what a hand tells apart


def value(name):
    return float(rosslt('get', '/stage/' + name).stdout)


class Teaching(WithDevices):
    @classmethod
    def setUpClass(cls):
        cls.stage = Node('stage', STAGE)
        cls.now = 100.0

    @classmethod
    def tearDownClass(cls):
        cls.stage.stop()

    def setUp(self):
        wait_until(lambda: rosslt('get', '/stage/yaw').returncode == 0, 'all locations are there')
        rosslt('unlock', '/stage/x')
        rosslt('reset', '/stage')

    def teach(self, publisher, *arguments):
        """Have a device, the publisher of a topic, move a thing; the process that does."""
        return self.start(publisher, shutil.which('rosslt'), 'teach', *arguments)

    def joystick(self):
        return self.device(Joy)

    def joy(self, x=0.0, y=0.0, held=True, after=PERIOD):
        """The next message of a joystick; its stamp is so many seconds after the last one."""
        type(self).now += after
        message = Joy(axes=[x, y, 0.0], buttons=[int(held)])
        message.header.stamp = rospy.Time.from_sec(self.now)
        return message

    def expect(self, name, expected):
        wait_until(
            lambda: abs(value(name) - expected) <= NEAR, lambda: f'{name} to become {expected}; it is {value(name)}'
        )

    def test_speed_times_time_is_one_change_and_undo_takes_it_back(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        before = len(lines('log', '/stage'))
        self.play(joy, self.joy(1.0, 1.0, held=False), self.joy(), *[self.joy(1.0, HALFWAY) for _ in range(50)])
        self.play(joy, self.joy(0.05, 0.09), self.joy(held=False), self.joy(1.0, held=False))
        ((_, name, by, *_),) = teaching.wait_for('holds')
        self.assertEqual((name, by), ('/things:box:0', joy.name))
        self.expect('x', 1.0 + 50 * STEP)
        self.expect('half_y', 0.5 - 0.5 * 0.5 * 50 * STEP)
        ((*_, x, y, _),) = teaching.wait_for('lets go')
        self.assertAlmostEqual(float(x), 1.0 + 50 * STEP)
        self.assertAlmostEqual(float(y), 1.0 - 0.5 * 50 * STEP)
        news = lines('log', '/stage')[before:]
        self.assertEqual({row[2] for row in news}, {'/stage/x', '/stage/half_y'}, news)
        self.assertEqual(len(news), 2, 'one line for each number')
        rosslt('undo', '/stage')
        self.assertEqual((value('x'), value('half_y')), (1.0, 0.5))
        self.assertEqual(teaching.stop(), 0)

    def test_a_dry_run_moves_a_ghost_and_says_what_would_change(self):
        ghosts = []
        ghost = rospy.Subscriber('/slt_teach/ghost', MarkerArray, ghosts.append)
        self.addCleanup(ghost.unregister)
        joy = self.joystick()
        before = len(lines('log', '/stage'))
        teaching = self.teach(joy, '/things:box:0', '--dry-run')
        wait_until(ghost.get_num_connections, 'the ghost is heard')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(50)], self.joy(held=False))
        ((*_, told),) = teaching.wait_for('says')
        self.assertEqual(told, f'would change x 1.0 -> {1.0 + 50 * STEP}')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(500)], self.joy(held=False))
        told = teaching.wait_for('says', 2)[1][-1]
        self.assertEqual(told, 'would change x 1.0 -> 4.0; x is at its maximum 4.0')
        self.assertEqual(value('x'), 1.0)
        self.assertEqual(len(lines('log', '/stage')), before)
        wait_until(lambda: ghosts[-1].markers[0].action == Marker.DELETEALL, 'the ghost goes')
        self.assertEqual(ghosts[-1].markers[0].header.frame_id, 'world', 'RViz takes it after the ghost')
        shown = [array.markers[0] for array in ghosts if array.markers[0].action == Marker.ADD]
        self.assertEqual({(one.type, one.header.frame_id, one.color.a) for one in shown}, {(Marker.CUBE, 'world', 0.5)})
        self.assertAlmostEqual(max(one.pose.position.x for one in shown), 1.0 + 500 * STEP, delta=10 * STEP)

    def test_a_recorded_bag_of_a_joystick_leads_a_thing(self):
        topic, folder = f'/{self._testMethodName}/joy', tempfile.TemporaryDirectory(prefix='rosslt_test_')
        self.addCleanup(folder.cleanup)
        path = os.path.join(folder.name, 'joy.bag')
        recorded = [self.joy(held=False), self.joy(), *[self.joy(1.0) for _ in range(50)], self.joy(held=False)]
        with rosbag.Bag(path, 'w') as bag:
            for message in recorded:
                bag.write(topic, message, message.header.stamp)
        play = subprocess.Popen(['rosbag', 'play', '-q', '--wait-for-subscribers', path], stdin=subprocess.DEVNULL)
        self.addCleanup(play.wait)
        self.addCleanup(play.kill)
        teaching = Teach(shutil.which('rosslt'), 'teach', '/things:box:0', '--by', topic, '--wait', '60')
        self.addCleanup(teaching.process.kill)
        teaching.wait_for('lets go')
        self.expect('x', 1.0 + 50 * STEP)

    def test_a_second_hold_goes_on_from_where_the_thing_was_dropped(self):
        joy = self.joystick()
        self.teach(joy, '/things:box:0')
        for _ in range(3):
            self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(10)], self.joy(held=False))
        self.expect('x', 1.0 + 30 * STEP)

    def test_a_silent_device_has_let_go(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(10)])
        teaching.wait_for('lets go')
        self.assertEqual([row[2] for row in teaching.rows('says')], [joy.name + ' is silent'])
        self.expect('x', 1.0 + 10 * STEP)
        self.play(joy, self.joy(1.0, after=100.0), self.joy(held=False))
        teaching.wait_for('lets go', 2)
        self.expect('x', 1.0 + 10 * STEP)

    def test_nan_leaps_and_old_messages_move_nothing_and_are_told_once(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        again = self.joy(1.0)
        bad = [self.joy(math.nan), self.joy(math.inf), self.joy(1.0, after=10.0), self.joy(1.0, after=20.0)]
        old = self.joy(1.0, after=-5.0)
        type(self).now += 5.0
        self.play(joy, again, again, again, *bad, old, old, self.joy(1.0, after=PERIOD), self.joy(held=False))
        teaching.wait_for('lets go')
        said = [row[2].partition(': ')[2] for row in teaching.rows('says')]
        self.assertEqual(
            said,
            [
                'it has been sent before',
                'a number is not finite',
                'it leaps by more than 0.1 m',
                'its stamp goes back',
            ],
        )
        self.expect('x', 1.0 + STEP)

    def test_a_locked_number_is_refused_with_the_reason_of_the_owner(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(10)], self.joy(held=False))
        self.expect('x', 1.0 + 10 * STEP)
        rosslt('lock', '/stage/x', '--reason', 'the robot is running')
        self.play(joy, self.joy(), *[self.joy(-1.0) for _ in range(10)], self.joy(held=False))
        self.assertRegex(teaching.wait_for('says')[0][2], 'is locked by .*: the robot is running')
        self.assertAlmostEqual(value('x'), 1.0 + 10 * STEP)

    def test_what_is_known_to_take_no_change_is_said(self):
        rosslt('lock', '/stage/x')
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(10)], self.joy(held=False))
        ((*_, said),) = teaching.wait_for('says')
        self.assertIn('the thing does not go that way, or its numbers take no change', said)
        self.assertEqual(value('x'), 1.0)

    def test_a_number_stops_at_its_bound_and_it_is_said(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:box:0')
        self.play(joy, self.joy(), *[self.joy(1.0, after=0.19) for _ in range(40)], self.joy(held=False))
        self.expect('x', 4.0)
        self.assertEqual(teaching.wait_for('says')[0][2], 'x is at its maximum 4.0')

    def test_the_end_of_the_process_lets_go(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            joy = self.device(Joy, f'device_{number}')
            teaching = self.teach(joy, '/things:box:0')
            self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(10)])
            teaching.wait_for('holds')
            self.assertEqual(teaching.stop(number), 0)
            ((*_, x, _, _),) = teaching.rows('lets go')
            self.expect('x', float(x))

    def test_a_joystick_turns_by_its_axes_that_turn(self):
        joy = self.joystick()
        teaching = self.teach(joy, '/things:dial:0', '--turn', '2,2,0', '--turn-speed', '0.25', '--speed', '0.1')
        self.play(joy, self.joy(), *[self.joy(1.0) for _ in range(20)], self.joy(math.nan), self.joy(1.0, after=0.5))
        self.play(joy, self.joy(held=False))
        teaching.wait_for('lets go')
        self.expect('yaw', 0.3 + 20 * 0.25 * PERIOD)
        said = [row[2].partition(': ')[2] for row in teaching.rows('says')]
        self.assertEqual(said, ['a number is not finite', 'it leaps by more than 0.1 rad'])

    def test_a_twist_that_is_not_zero_moves_and_turns(self):
        twist = self.device(Twist)
        teaching = self.teach(twist, '/things:dial:0')
        message = Twist()
        message.linear.x, message.angular.z, message.angular.x = 1.0, -0.5, 0.2
        before = value('yaw')
        self.play(twist, Twist(), *[message] * 200, Twist())
        teaching.wait_for('lets go')
        wait_until(lambda: value('yaw') < before, 'it turns by the time that the messages took')

    def test_a_tracker_moves_a_thing_by_its_way_since_the_hand_took_hold(self):
        tracker = self.device(PoseStamped)
        clutch = self.device(Joy, 'clutch')
        teaching = self.teach(tracker, '/things:dial:0', '--smooth', '0', '--clutch', clutch.name)
        wait_until(clutch.get_num_connections, 'it hears the clutch')
        self.play(tracker, *[self.pose(10.0, 1.0)] * 3)

        def is_held():
            clutch.publish(Joy(buttons=[1]))
            tracker.publish(self.pose(10.0, 1.0))
            return teaching.rows('holds')

        wait_until(is_held, 'the clutch to have it hold')
        self.play(tracker, *[self.pose(10.0 + 0.05 * n, 1.0 + 0.05 * n) for n in range(9)])
        self.expect('yaw', 0.7)
        self.play(clutch, Joy(buttons=[0]))
        teaching.wait_for('lets go')

    def test_a_frame_of_tf_moves_a_thing_by_its_way_since_the_hand_took_hold(self):
        tf = rospy.Publisher('/tf', TFMessage, queue_size=1000)
        static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        self.addCleanup(tf.unregister)
        self.addCleanup(static.unregister)
        static.publish([self.transform('world', 'base', yaw=math.pi / 2)])
        for reference, distance in (([], -0.4), (['--in', 'base'], 0.2)):
            arguments = ['/things:box:0', '--by', 'tf:hand', *reference, '--smooth', '0', '--wait', '60']
            teaching = Teach(shutil.which('rosslt'), 'teach', *arguments)
            self.addCleanup(teaching.process.kill)

            def is_held(at=teaching):
                tf.publish([self.transform('base', 'hand', 1.0, 2.0)])
                return at.rows('holds')

            wait_until(is_held, 'it takes hold as transforms come')
            self.assertEqual(teaching.rows('holds')[0][2], 'tf:hand')
            x = value('x')
            for step in range(9):
                moved = self.transform('base', 'hand', 1.0 + 0.025 * step, 2.0 + 0.05 * step)
                tf.publish([moved])
                tf.publish([moved])  # which is no newer one
                tf.publish([self.transform('base', 'other')])
            self.expect('x', x + distance)
            wait_until(
                lambda at=teaching: len(at.rows('lets go')) == len(at.rows('holds')), 'it lets go as none is newer'
            )
            self.assertEqual({row[2] for row in teaching.rows('says')}, {'tf:hand is silent'})
            self.assertEqual(teaching.stop(), 0)

    def transform(self, parent, child, x=0.0, y=0.0, yaw=0.0):
        message = TransformStamped(child_frame_id=child)
        type(self).now += PERIOD
        message.header.frame_id, message.header.stamp = parent, rospy.Time.from_sec(self.now)
        message.transform.translation.x, message.transform.translation.y = x, y
        message.transform.rotation.z, message.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        return message

    def pose(self, x, yaw):
        message = PoseStamped()
        type(self).now += PERIOD
        message.header.stamp = rospy.Time.from_sec(self.now)
        message.pose.position.x = x
        message.pose.orientation.z, message.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        return message

    def test_the_node_takes_a_topic_for_its_only_thing(self):
        joy = self.joystick()
        self.start(joy, SLT_TEACH, 'place', '--axes', '1,0,2', '--speed', '0.25', '__name:=led')
        self.play(joy, self.joy(), *[self.joy(0.0, 1.0) for _ in range(20)], self.joy(held=False))
        self.expect('a', -3.0 + 20 * 0.25 * PERIOD)
        self.assertEqual(lines('log', '/stage')[-1][1:3], ['/led', '/stage/a'])

    def test_errors_say_what_there_is(self):
        joy, text = self.joystick(), self.device(String, 'text')
        for arguments, expected in (
            (
                ['/nothing', '--by', joy.name],
                'nothing that can be dragged is called /nothing; there are: /place, /things:',
            ),
            (['/things', '--by', joy.name], '/things shows several things: /things:box:0, /things:dial:0'),
            (['/things:dial:0', '--by', joy.name], 'can only be turned, and a Joystick turns nothing without --turn'),
            (['/place', '--by', '/nobody'], 'nobody publishes /nobody; of types that a device has, there are: /'),
            (['/place', '--by', 'tf:nowhere'], 'tf has no pose of nowhere in world'),
            (['/place', '--by', text.name], ' is a std_msgs/String, and no device; devices are: geometry_msgs/Pose'),
        ):
            self.assertIn(expected, failure('teach', *arguments, '--wait', '2'))
        for wrong in (['--axes', '0,1'], ['--speed', '0'], ['--max-step', 'nan'], ['--deadman', '-1']):
            self.assertEqual(rosslt('teach', '/place', '--by', joy.name, *wrong).returncode, 2)


if __name__ == '__main__':
    import rostest

    rospy.init_node('teaching')
    rostest.rosrun('rosslt', 'teaching', '__main__')
