#!/usr/bin/env python3
"""`rosslt teach` moves locations, which no message carries, and single joints: by a knob, by an axis of a joystick."""

import shutil
import signal

import rospy
from geometry_msgs.msg import Point, Twist
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt
from support.teaching import Teach, WithDevices

#: A controller: its goal decides, and feeds a state, so that no field comes from it.
STAGE = """
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Bool, Float64

    above = rospy.Publisher('~above', Bool, queue_size=1)
    both = rosslt.Publisher('~both', Float64, queue_size=1)
    command = rosslt.Publisher('/command', JointState, queue_size=1)
    rospy.set_param('~speed', 0.25)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        rosslt.get_param('~speed')
        above.publish(Bool(bool(rosslt.location(1.0, name='goal_x', minimum=-2.0, maximum=4.0) > 2.0)))
        rosslt.location(2.0, name='goal_y')
        rosslt.location(3, name='count')
        rosslt.location(True, name='is_on')
        rosslt.location('world', name='frame')
        rosslt.location(0.5, name='both/data')
        both.publish(Float64(2.0 * rosslt.location(1.0, name='other')))
        rosslt.location(7.0, name='gate/width')
        shoulder, elbow = rosslt.location(0.1, name='shoulder'), rosslt.location(-0.2, name='elbow')
        command.publish(JointState(name=['shoulder', 'elbow', 'wrist'], position=[shoulder, elbow, 0.0]))
        rate.sleep()
    """

#: The same locations, for a node that the test ends.
MORTAL = """
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        rosslt.location(1.0, name='goal')
        rate.sleep()
    """

PERIOD = 0.02  # s between two stamps
NEAR = 1e-3  # what a hand tells apart
MATCH = '/slt_teach/match'


def value(name):
    return float(rosslt('get', name).stdout)


class Locations(WithDevices):
    @classmethod
    def setUpClass(cls):
        cls.stage = Node('pid', STAGE, wait_for=None, ROS_NAMESPACE='/lab')
        cls.now = 100.0

    @classmethod
    def tearDownClass(cls):
        cls.stage.stop()

    def setUp(self):
        wait_until(lambda: rosslt('get', '/lab/pid/elbow').returncode == 0, 'all locations are there')
        for name in ('goal_x', 'goal_y'):
            rosslt('unlock', '/lab/pid/' + name)
        rosslt('reset', '/lab/pid')

    def teach(self, target, by, *arguments):
        started = Teach(
            shutil.which('rosslt'), 'teach', target, '--by', by, '--smooth', '0', '--wait', '60', *arguments
        )
        self.addCleanup(started.process.kill)
        return started

    def match(self, *fields):
        matches = [word for field in fields for word in ('--match', field)]
        started = Teach(shutil.which('rosslt'), 'teach', *matches, '--wait', '60')
        self.addCleanup(started.process.kill)
        rospy.wait_for_service(MATCH, 60)
        self.addCleanup(started.stop)
        return rospy.ServiceProxy(MATCH, Trigger)

    def joy(self, *axes, held=True):
        type(self).now += PERIOD
        message = Joy(axes=axes, buttons=[0, held])
        message.header.stamp = rospy.Time.from_sec(self.now)
        return message

    def expect(self, name, expected):
        wait_until(
            lambda: abs(value(name) - expected) <= NEAR, lambda: f'{name} to become {expected}; it is {value(name)}'
        )

    def test_a_stick_turns_a_location_in_one_change_undone_at_once(self):
        joy = self.device(Joy)
        teaching = self.teach('/lab/pid/goal_x', joy.name, '--deadman', '1', '--axes', '2', '--speed', '1')
        before = len(lines('log', '/lab/pid'))
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
        self.play(joy, *[self.joy(0, 0, 1.0) for _ in range(25)], self.joy(0, 0, 0, held=False))
        self.expect('/lab/pid/goal_x', 1.5)
        ((*_, name, by, number),) = teaching.wait_for('lets go')
        self.assertEqual((name, by), ('/lab/pid/goal_x', joy.name))
        self.assertAlmostEqual(float(number), 1.5)
        self.assertEqual([row[2] for row in lines('log', '/lab/pid')[before:]], ['/lab/pid/goal_x'])
        self.assertEqual(self.said(teaching), [])
        rosslt('undo', '/lab/pid')
        self.assertEqual(value('/lab/pid/goal_x'), 1.0)
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0), 2)
        self.play(joy, *[self.joy(0, 0, -1.0) for _ in range(25)], self.joy(0, 0, 0, held=False))
        self.expect('/lab/pid/goal_x', 0.5)
        self.assertEqual(teaching.stop(), 0)

    def test_a_knob_turns_a_location_from_where_others_have_set_it(self):
        knob = self.device(Float64)
        teaching = self.teach('/lab/pid/goal_y', knob.name + '/data', '--scale', '2')
        wait_until(knob.get_num_connections, 'it hears the knob')
        rosslt('set', '/lab/pid/goal_y', '5')
        self.hold(teaching, knob, lambda: Float64(0.0))
        self.play(knob, *[Float64(0.05 * step) for step in range(1, 11)])
        self.expect('/lab/pid/goal_y', 6.0)

    def test_bounds_and_locks_hold_and_are_told_as_of_a_field(self):
        joy = self.device(Joy)
        teaching = self.teach('/lab/pid/goal_x', joy.name, '--deadman', '1', '--scale', '20')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
        self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(25)], self.joy(0, 0, 0, held=False))
        self.expect('/lab/pid/goal_x', 4.0)
        wait_until(lambda: 'goal_x is at its maximum 4.0' in self.said(teaching), 'the bound to be told')
        rosslt('lock', '/lab/pid/goal_x', '--reason', 'the robot is running')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0), 2)
        self.play(joy, *[self.joy(-1.0, 0, 0) for _ in range(5)], self.joy(0, 0, 0, held=False))
        wait_until(lambda: 'the robot is running' in ' '.join(self.said(teaching)), 'the refusal to be told')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0), 3)
        told = [one for one in self.said(teaching) if 'the robot is running' in one]
        self.assertEqual(len(told), 1, 'once for each hold, whatever number the hand is at')
        self.play(joy, self.joy(0, 0, 0, held=False))
        self.assertEqual(value('/lab/pid/goal_x'), 4.0)

    def test_a_whole_number_goes_by_whole_numbers(self):
        joy = self.device(Joy)
        teaching = self.teach('/lab/pid/count', joy.name, '--deadman', '1', '--scale', '10')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
        self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(34)], self.joy(0, 0, 0, held=False))
        self.expect('/lab/pid/count', 6)
        ((*_, held),) = teaching.rows('holds')
        ((*_, left),) = teaching.wait_for('lets go')
        self.assertEqual((held, left), ('3', '6'))

    def test_names_without_their_slash_and_of_parameters_are_taken(self):
        joy = self.device(Joy)
        for target, name, began in (
            ('lab/pid/gate/width', '/lab/pid/gate/width', 7.0),
            ('/lab/pid/~speed', '/lab/pid/~speed', 0.25),
        ):
            teaching = self.teach(target, joy.name, '--deadman', '1')
            self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
            self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(10)], self.joy(0, 0, 0, held=False))
            self.expect(name, began + 0.1)
            ((*_, shown, _, _),) = teaching.wait_for('lets go')
            self.assertEqual(shown, name)
            teaching.stop()

    def test_a_dry_run_says_what_would_change(self):
        joy = self.device(Joy)
        teaching = self.teach('/lab/pid/goal_x', joy.name, '--deadman', '1', '--dry-run')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
        self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(50)], self.joy(0, 0, 0, held=False))
        teaching.wait_for('lets go')
        self.assertEqual(self.said(teaching), ['would change goal_x 1.0 -> 1.5'])
        self.assertEqual(value('/lab/pid/goal_x'), 1.0)

    def test_a_node_that_ends_is_said_and_its_next_run_is_taught(self):
        joy = self.device(Joy)
        mortal = Node('mortal', MORTAL)
        wait_until(lambda: rosslt('get', '/mortal/goal').returncode == 0, 'its location is there')
        teaching = self.teach('/mortal/goal', joy.name, '--deadman', '1')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0))
        mortal.stop()
        self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(10)], self.joy(0, 0, 0, held=False))
        teaching.wait_for('lets go')
        wait_until(lambda: '/mortal' in ' '.join(self.said(teaching)), 'the end to be told')

        def is_refused():
            joy.publish(self.joy(0, 0, 0))
            return any('/mortal does not answer' in text for text in self.said(teaching))

        wait_until(is_refused, lambda: f'the end to be told: {self.said(teaching)}')
        self.play(joy, self.joy(0, 0, 0, held=False))
        self.assertEqual(len(teaching.rows('holds')), 1)
        again = Node('mortal', MORTAL.replace('1.0', '3.0'))
        self.addCleanup(again.stop)
        wait_until(lambda: rosslt('get', '/mortal/goal').returncode == 0, 'its location is there again')
        began = value('/mortal/goal')
        self.hold(teaching, joy, lambda: self.joy(0, 0, 0), 2)
        self.play(joy, *[self.joy(1.0, 0, 0) for _ in range(20)], self.joy(0, 0, 0, held=False))
        self.expect('/mortal/goal', began + 0.2)
        self.assertEqual(teaching.stop(signal.SIGTERM), 0)

    def test_one_joint_turns_by_its_name(self):
        joy, knob = self.device(Joy), self.device(Float64, 'knob')
        teaching = self.teach('/command:elbow', joy.name, '--deadman', '1', '--axes', '1')
        self.hold(teaching, joy, lambda: self.joy(0, 0))
        self.play(joy, *[self.joy(0, -1.0) for _ in range(20)], self.joy(0, 0, held=False))
        self.expect('/lab/pid/elbow', -0.4)
        self.assertEqual(value('/lab/pid/shoulder'), 0.1)
        ((*_, name, _, number),) = teaching.wait_for('lets go')
        self.assertEqual(name, '/command:elbow')
        self.assertAlmostEqual(float(number), -0.4)
        turning = self.teach('/command:shoulder', knob.name + '/data')
        self.hold(turning, knob, lambda: Float64(0.0))
        self.play(knob, *[Float64(0.05 * step) for step in range(1, 5)])
        self.expect('/lab/pid/shoulder', 0.3)

    def test_one_joint_follows_that_of_the_same_name(self):
        leader = self.device(JointState)
        teaching = self.teach('/command:elbow', leader.name)

        def joints(elbow, shoulder):
            type(self).now += PERIOD
            message = JointState(name=['elbow', 'shoulder'], position=[elbow, shoulder])
            message.header.stamp = rospy.Time.from_sec(self.now)
            return message

        self.hold(teaching, leader, lambda: joints(0.0, 0.0))
        self.play(leader, *[joints(0.05 * step, 0.05 * step) for step in range(1, 5)])
        self.expect('/lab/pid/elbow', 0.0)
        self.assertEqual(value('/lab/pid/shoulder'), 0.1)
        teaching.wait_for('lets go')
        self.assertEqual(self.said(teaching), [leader.name + ' is silent'])

    def test_what_is_a_field_too_is_taken_for_that_and_said(self):
        knob = self.device(Float64)
        teaching = self.teach('/lab/pid/both/data', knob.name + '/data')
        ((_, name, said),) = teaching.wait_for('says')
        self.assertEqual(name, '/lab/pid/both/data')
        source = said.rpartition(' ')[2]
        self.assertEqual(said, f'/lab/pid/both/data is a field and a location; for the location, say {source}')
        self.hold(teaching, knob, lambda: Float64(0.0))
        self.play(knob, *[Float64(0.05 * step) for step in range(1, 5)])
        self.expect('/lab/pid/other', 1.1)
        self.assertEqual(value('/lab/pid/both/data'), 0.5)
        teaching.stop()
        other = self.teach(source, knob.name + '/data')
        self.hold(other, knob, lambda: Float64(0.2))
        self.play(knob, *[Float64(0.2 + 0.05 * step) for step in range(1, 5)])
        self.expect('/lab/pid/both/data', 0.7)

    def test_a_location_becomes_what_is_measured_at_a_press(self):
        odom = rospy.Publisher('/measured', Point, queue_size=1, latch=True)
        self.addCleanup(odom.unregister)
        timer = rospy.Timer(rospy.Duration(0.05), lambda _: odom.publish(Point(x=2.5, y=0.5, z=9.0)))
        self.addCleanup(timer.shutdown)
        before = len(lines('log', '/lab/pid'))
        press = self.match('/lab/pid/goal_x=/measured/x', '/lab/pid/both/data=/measured/y')
        done = press()
        self.assertTrue(done.success, done)
        self.assertIn('/lab/pid/goal_x: 1.0 -> 2.5', done.message)
        self.assertEqual((value('/lab/pid/goal_x'), value('/lab/pid/other')), (2.5, 0.25))
        self.assertEqual(len({row[0] for row in lines('log', '/lab/pid')[before:]}), 1, 'one request')
        rosslt('set', '/lab/pid/goal_x', '3.5')
        again = press()
        self.assertIn('/lab/pid/goal_x: 3.5 -> 2.5', again.message)
        self.assertIn('so already', press().message)
        rosslt('undo', '/lab/pid')
        self.assertEqual(value('/lab/pid/goal_x'), 3.5)

    def test_all_locations_of_a_match_change_or_none(self):
        odom = rospy.Publisher('/measured', Point, queue_size=1, latch=True)
        self.addCleanup(odom.unregister)
        timer = rospy.Timer(rospy.Duration(0.05), lambda _: odom.publish(Point(x=2.5, y=0.5, z=9.0)))
        self.addCleanup(timer.shutdown)
        press = self.match('/lab/pid/goal_y=/measured/y', '/lab/pid/goal_x=/measured/z')
        refused = press()
        self.assertFalse(refused.success)
        self.assertIn('4.0', refused.message)
        self.assertEqual((value('/lab/pid/goal_x'), value('/lab/pid/goal_y')), (1.0, 2.0))

    def test_errors_say_what_was_looked_for_and_what_there_is(self):
        joy, twist, knob = self.device(Joy), self.device(Twist, 'twist'), self.device(Float64, 'knob')
        for target, by, expected in (
            ('/lab/pid/goal_z', joy.name, 'nothing that can be dragged is called /lab/pid/goal_z; there are: none'),
            ('/lab/pid/goal_z', joy.name, 'nor is it a location: /lab/pid has no location goal_z (did you mean goal_'),
            ('/lab/pid/goal_z', knob.name + '/data', 'nobody publishes /lab/pid/goal_z'),
            ('/lab/pid/goal_z', knob.name + '/data', 'has no location goal_z (did you mean goal_'),
            ('/lab/pid/is_on', joy.name, '/lab/pid/is_on is a bool, and no number'),
            ('/lab/pid/frame', joy.name, '/lab/pid/frame is a string, and no number'),
            ('/lab/pid/goal_x', twist.name, 'moves no number: name a number of it, as '),
            ('/command:elbo', joy.name, '/command has no joint elbo; it has: shoulder, elbow, wrist'),
            ('/command:wrist', joy.name, '/command:wrist has no source; `rosslt doctor /command` says why'),
        ):
            self.assertIn(expected, failure('teach', target, '--by', by, '--wait', '1'))
        said = failure('teach', '--match', '/command/position[0]=/lab/pid/goal_x', '--wait', '1')
        self.assertIn('/lab/pid/goal_x is a location, and only a field of a topic is measured', said)
        said = failure('teach', '--match', '/lab/pid/is_on=/command/position[0]', '--wait', '1')
        self.assertIn('/lab/pid/is_on is a bool, and has no number', said)
        for wrong in (['--record'], ['--axes', '-1'], ['--axes', '-1,0,2'], ['--axes', 'x']):
            self.assertEqual(rosslt('teach', '/lab/pid/goal_x', '--by', joy.name, *wrong).returncode, 2)


if __name__ == '__main__':
    import rostest

    rospy.init_node('locations')
    rostest.rosrun('rosslt', 'locations', '__main__')
