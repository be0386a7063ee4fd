#!/usr/bin/env python3
"""`rosslt teach` by a knob and by joints that the test plays: they move numbers of nodes, by the rules of a mouse."""

import math
import shutil
import tempfile
from pathlib import Path

import rospy
from sensor_msgs.msg import JointState, Joy, Temperature
from std_msgs.msg import Float64, String

from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt
from support.teaching import Teach, WithDevices
from support.unmodified import Unmodified

STAGE = """
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray, Int32

    gains = rosslt.Publisher('gains', Float64MultiArray, queue_size=1)
    command = rosslt.Publisher('command', JointState, queue_size=1)
    count = rosslt.Publisher('count', Int32, queue_size=1)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        gains.publish(Float64MultiArray(data=[0.5, 2.0 * rosslt.location(1.0, name='gain', maximum=4.0)]))
        count.publish(Int32(rosslt.location(3, name='count')))
        shoulder, elbow = rosslt.location(0.1, name='shoulder'), rosslt.location(-0.2, name='elbow')
        command.publish(JointState(name=['shoulder', 'elbow', 'wrist'], position=[shoulder, elbow, 0.0]))
        rate.sleep()
    """

PLAIN = """
import rospy
from std_msgs.msg import Float64

GAIN = 0.5

rospy.init_node('plain')
gain = rospy.Publisher('gain', Float64, queue_size=1)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    gain.publish(2.0 * GAIN)
    rate.sleep()
"""

PERIOD = 0.02  # s between two stamps
NEAR = 1e-3  # what a hand tells apart


def value(name):
    return float(rosslt('get', name).stdout)


class Numbers(WithDevices):
    @classmethod
    def setUpClass(cls):
        cls.stage = Node('stage', STAGE)
        cls.now = 100.0

    @classmethod
    def tearDownClass(cls):
        cls.stage.stop()

    def setUp(self):
        wait_until(lambda: rosslt('get', '/stage/elbow').returncode == 0, 'all locations are there')
        rosslt('unlock', '/stage/gain')
        rosslt('reset', '/stage')

    def teach(self, target, by, *arguments):
        started = Teach(
            shutil.which('rosslt'), 'teach', target, '--by', by, '--smooth', '0', '--wait', '60', *arguments
        )
        self.addCleanup(started.process.kill)
        return started

    def stamped(self, message, after=PERIOD):
        type(self).now += after
        message.header.stamp = rospy.Time.from_sec(self.now)
        return message

    def knob(self, number, after=PERIOD):
        return self.stamped(Temperature(temperature=number), after)

    def joints(self, after=PERIOD, **positions):
        return self.stamped(JointState(name=list(positions), position=list(positions.values())), after)

    def expect(self, name, expected):
        wait_until(
            lambda: abs(value(name) - expected) <= NEAR, lambda: f'{name} to become {expected}; it is {value(name)}'
        )

    def test_a_knob_moves_a_number_in_one_change_that_undo_takes_back(self):
        knob = self.device(Temperature)
        teaching = self.teach('/gains/data[1]', knob.name + '/temperature', '--scale', '2')
        before = len(lines('log', '/stage'))
        self.hold(teaching, knob, lambda: self.knob(20.0))
        self.play(knob, *[self.knob(20.0 + 0.05 * step) for step in range(1, 21)])
        self.expect('/stage/gain', 2.0)
        ((*_, name, by, number),) = teaching.wait_for('lets go')
        self.assertEqual((name, by), ('/gains/data[1]', knob.name + '/temperature'))
        self.assertAlmostEqual(float(number), 4.0)
        self.assertEqual(self.said(teaching), [f'{knob.name}/temperature is silent'])
        self.assertEqual([row[2] for row in lines('log', '/stage')[before:]], ['/stage/gain'])
        rosslt('undo', '/stage')
        self.assertEqual(value('/stage/gain'), 1.0)
        self.assertEqual(teaching.stop(), 0)

    def test_nan_leaps_and_old_messages_of_a_knob_move_nothing(self):
        knob = self.device(Temperature)
        teaching = self.teach('/gains/data[1]', knob.name + '/temperature')
        self.hold(teaching, knob, lambda: self.knob(1.0))
        again = self.knob(1.05)
        bad = [again, again, self.knob(math.nan), self.knob(math.inf), self.knob(5.0), self.knob(5.0)]
        old = self.knob(5.05, after=-5.0)
        type(self).now += 5.0
        self.play(knob, *bad, old, self.knob(5.05))
        teaching.wait_for('lets go')
        told = ['it has been sent before', 'a number is not finite', 'it leaps by more than 0.1', 'its stamp goes back']
        self.assertEqual(self.said(teaching)[:4], told)
        self.expect('/stage/gain', 1.05)

    def test_a_knob_obeys_bounds_locks_and_its_clutch(self):
        knob, clutch = self.device(Temperature), self.device(Joy, 'clutch')
        teaching = self.teach('/gains/data[1]', knob.name + '/temperature', '--clutch', clutch.name, '--scale', '5')
        wait_until(lambda: knob.get_num_connections() and clutch.get_num_connections(), 'both are heard')

        def press():
            clutch.publish(Joy(buttons=[1]))
            return self.knob(0.0)

        self.play(knob, *[self.knob(0.09 * step) for step in range(10)])
        self.hold(teaching, knob, press)
        self.play(knob, *[self.knob(0.09 * step) for step in range(1, 30)])
        self.expect('/stage/gain', 4.0)
        self.play(clutch, Joy(buttons=[0]))
        teaching.wait_for('lets go')
        self.assertIn('gain is at its maximum 4.0', self.said(teaching))
        rosslt('lock', '/stage/gain', '--reason', 'the robot is running')
        self.hold(teaching, knob, press, 2)
        self.play(knob, *[self.knob(-0.09 * step) for step in range(1, 10)])
        wait_until(lambda: 'the robot is running' in ' '.join(self.said(teaching)), 'the refusal to be told')
        self.assertEqual(value('/stage/gain'), 4.0)

    def test_a_whole_number_goes_by_whole_numbers(self):
        knob = self.device(Temperature)
        teaching = self.teach('/count/data', knob.name + '/temperature', '--scale', '10')
        self.hold(teaching, knob, lambda: self.knob(0.0))
        self.play(knob, *[self.knob(0.05 * step) for step in range(1, 7)], self.knob(0.34))
        self.expect('/stage/count', 6)
        ((*_, held),) = teaching.rows('holds')
        ((*_, left),) = teaching.wait_for('lets go')
        self.assertEqual((held, left), ('3', '6'))

    def test_a_number_of_an_unmodified_node_follows_a_knob_without_stamps(self):
        knob = self.device(Float64)
        with tempfile.TemporaryDirectory() as folder, Unmodified(Path(folder), 'plain', PLAIN):
            teaching = self.teach('/gain/data', knob.name + '/data')
            self.hold(teaching, knob, lambda: Float64(0.0))
            for step in range(11):
                knob.publish(Float64(0.04 * step))
            self.expect('/plain/GAIN', 0.7)
            teaching.wait_for('lets go')
            self.assertEqual(teaching.stop(), 0)

    def test_joints_move_those_of_the_same_names_in_one_change(self):
        leader = self.device(JointState)
        teaching = self.teach('/command', leader.name)
        before = len(lines('log', '/stage'))
        self.hold(teaching, leader, lambda: self.joints(elbow=1.0, gripper=0.5, shoulder=-1.0))
        other = [self.joints(finger=float(step)) for step in range(3)]
        moved = [
            self.joints(elbow=1.0 - 0.05 * step, gripper=9.0 * step, shoulder=-1.0 + 0.02 * step) for step in range(11)
        ]
        self.play(leader, *other, *moved)
        self.expect('/stage/elbow', -0.7)
        self.expect('/stage/shoulder', 0.3)
        ((*_, shoulder, elbow),) = teaching.wait_for('lets go')
        self.assertAlmostEqual(float(shoulder), 0.3)
        self.assertAlmostEqual(float(elbow), -0.7)
        self.assertEqual(self.said(teaching), ['wrist of /command stays', leader.name + ' is silent'])
        news = lines('log', '/stage')[before:]
        self.assertEqual({row[2] for row in news}, {'/stage/shoulder', '/stage/elbow'}, news)
        self.assertEqual(len(news), 2, 'one line for each number')
        rosslt('undo', '/stage')
        self.assertEqual((value('/stage/shoulder'), value('/stage/elbow')), (0.1, -0.2))

    def test_nan_and_leaps_of_one_joint_move_no_joint(self):
        leader = self.device(JointState)
        teaching = self.teach('/command/position', leader.name + '/position')
        self.hold(teaching, leader, lambda: self.joints(shoulder=0.0, elbow=0.0))
        bad = [self.joints(shoulder=0.05, elbow=math.nan), self.joints(shoulder=0.05, elbow=1.0)]
        cut = self.joints(shoulder=0.05, elbow=1.0)
        cut.position = cut.position[:1]
        self.play(leader, *bad, cut, self.joints(shoulder=0.08, elbow=1.0))
        teaching.wait_for('lets go')
        told = ['a number is not finite', 'it leaps by more than 0.1', 'it has 2 names, and 1 positions']
        self.assertEqual(self.said(teaching)[1:4], told)
        self.expect('/stage/shoulder', 0.13)
        self.assertEqual(value('/stage/elbow'), -0.2)

    def test_only_the_joints_that_are_named_move(self):
        leader = self.device(JointState)
        teaching = self.teach('/command', leader.name, '--joints', 'elbow')
        self.hold(teaching, leader, lambda: self.joints(shoulder=0.0, elbow=0.0))
        self.play(leader, *[self.joints(shoulder=0.05 * step, elbow=0.05 * step) for step in range(5)])
        self.expect('/stage/elbow', 0.0)
        self.assertEqual(value('/stage/shoulder'), 0.1)

    def test_errors_say_what_there_is(self):
        leader, knob, text = self.device(JointState), self.device(Float64, 'knob'), self.device(String, 'text')
        leader.publish(self.joints(a=0.0, b=0.0))
        timer = rospy.Timer(
            rospy.Duration(0.05), lambda _: leader.publish(JointState(name=['a', 'b'], position=[0, 0]))
        )
        self.addCleanup(timer.shutdown)
        of_joints = f'no joint of /command (shoulder, elbow, wrist) is among those of {leader.name} (a, b)'
        for target, by, expected in (
            ('/command', leader.name, of_joints),
            ('/gains/data', leader.name, '/gains/data is a float64[], and has no joints by name'),
            ('/gains/data', knob.name + '/data', '/gains/data is a float64[], and no number'),
            ('/gains/data[0]', knob.name + '/data', '/gains/data[0] has no source'),
            ('/gains/data[7]', knob.name + '/data', '/gains has no field data[7]'),
            ('/gains/data[1]', '/gains/data[1]', '/gains/data[1] is the device itself'),
            ('/nothing/data', knob.name + '/data', 'nobody publishes /nothing/data'),
            ('/command', text.name, ', and any number, as '),
        ):
            self.assertIn(expected, failure('teach', target, '--by', by, '--wait', '3'))
        for wrong in (['--record'], ['--joints', 'elbow']):
            self.assertEqual(rosslt('teach', '/gains/data[1]', '--by', knob.name + '/data', *wrong).returncode, 2)


if __name__ == '__main__':
    import rostest

    rospy.init_node('numbers')
    rostest.rosrun('rosslt', 'numbers', '__main__')
