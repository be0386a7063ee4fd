#!/usr/bin/env python3
"""`rosslt teach --match`: at each press, what nodes command becomes what the test measures, as a robot would."""

import math
import os
import pty
import shutil
import signal
import subprocess
import tempfile
import textwrap
import threading
import unittest

import rospkg
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

from support.fork_server import Program
from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt

#: A plain node of an arm of two joints, as a user would write it.
ARM = """
    import rospy
    from sensor_msgs.msg import JointState

    WAYPOINTS = [
        [0.25, -0.5],
        [1.25, 0.75],
    ]

    rospy.init_node('arm')
    command = rospy.Publisher('command', JointState, queue_size=1)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        shoulder, elbow = WAYPOINTS[1]
        command.publish(JointState(name=['shoulder', 'elbow'], position=[shoulder, elbow]))
        rate.sleep()
    """

STAGE = """
    from rosslt import math
    from std_msgs.msg import Float64MultiArray

    goal = rosslt.Publisher('goal', PoseStamped, queue_size=1)
    grip = rosslt.Publisher('grip', Float64, queue_size=1)
    three = rosslt.Publisher('three', Float64MultiArray, queue_size=1)
    plain = rosslt.Publisher('plain', Float64, queue_size=1)
    moving = rosslt.Publisher('moving', Float64, queue_size=1)
    stubborn = rosslt.Publisher('stubborn', Float64, queue_size=1)
    latched = rosslt.Publisher('latched', Float64, queue_size=1, latch=True)
    rate = rospy.Rate(50)
    rounds = 0
    while not rospy.is_shutdown():
        sent = PoseStamped()
        sent.header.frame_id = 'world'
        sent.pose.position.x = rosslt.location(1.0, name='x', maximum=4.0)
        sent.pose.position.y = 2.0 * rosslt.location(0.5, name='half_y')
        yaw = rosslt.location(0.25, name='yaw')
        sent.pose.orientation.z, sent.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        goal.publish(sent)
        grip.publish(Float64(rosslt.location(0.125, name='width')))
        a, b = rosslt.location(1.0, name='a'), rosslt.location(2.0, name='b')
        three.publish(Float64MultiArray(data=[a, b, a + b]))
        plain.publish(Float64(7.0))
        rounds += 1
        if rounds == 3:
            latched.publish(Float64(rosslt.location(4.0, name='once')))
        moving.publish(Float64(rosslt.location(1.0, name='still') + rounds))
        held = rosslt.location(0.0, name='held')
        stubborn.publish(Float64(held if held < 1.0 else held - held + 1.0))
        rate.sleep()
    """

SLT_TEACH = os.path.join(rospkg.RosPack().get_path('rosslt'), 'scripts', 'slt_teach')
MATCH = '/slt_teach/match'


def value(name):
    return float(rosslt('get', name).stdout)


class Matching(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stage = Node('stage', STAGE)
        cls.folder = tempfile.TemporaryDirectory(prefix='rosslt_test_')
        cls.arm_file = os.path.join(cls.folder.name, 'arm.py')
        with open(cls.arm_file, 'w', encoding='utf-8') as file:
            file.write(textwrap.dedent(ARM))
        cls.arm = subprocess.Popen(['rosslt', 'run', cls.arm_file], stdin=subprocess.DEVNULL)
        wait_until(lambda: rosslt('list', '/arm').stdout.count('\n') >= 2, 'the arm has its locations', 60)
        cls.measured = {}
        cls.publishers = {}
        threading.Thread(target=cls.measure, daemon=True).start()

    @classmethod
    def tearDownClass(cls):
        cls.arm.send_signal(signal.SIGINT)
        cls.arm.wait(60)
        cls.stage.stop()
        cls.folder.cleanup()

    @classmethod
    def measure(cls):
        """Send at 50 Hz what is measured."""
        while not rospy.is_shutdown():
            for topic, message in list(cls.measured.items()):
                cls.publishers[topic].publish(message)
            rospy.sleep(0.02)

    def setUp(self):
        rosslt('reset', '/stage')
        self.measured.clear()

    def measures(self, topic, message):
        """Have a topic say something from now on."""
        if topic not in self.publishers:
            self.publishers[topic] = rospy.Publisher(topic, type(message), queue_size=1)
        self.measured[topic] = message

    def teach(self, *matches, more=(), script=None, service='match'):
        """Start it; its process, once it takes presses."""
        arguments = [word for match in matches for word in ('--match', match)]
        verb = [] if script else ['teach']
        output = os.path.join(self.folder.name, self._testMethodName)
        with open(output, 'wb') as file:
            process = Program(script or shutil.which('rosslt'), [*verb, *arguments, *more, '--wait', '10'], file, file)
        self.addCleanup(process.wait, 60)
        self.addCleanup(process.send_signal, signal.SIGINT)
        name = next((word[len('__name:=') :] for word in more if word.startswith('__name:=')), 'slt_teach')
        try:
            rospy.wait_for_service(f'/{name}/{service}', 30)
        except rospy.ROSException:
            self.fail(self.printed())
        self.press = rospy.ServiceProxy(f'/{name}/{service}', Trigger)
        return process

    def printed(self):
        with open(os.path.join(self.folder.name, self._testMethodName), encoding='utf-8') as file:
            return file.read()

    def rows(self, kind):
        return [row for row in (line.split('\t') for line in self.printed().splitlines()) if row[0] == kind]

    def done(self):
        answer = self.press()
        self.assertTrue(answer.success, answer.message)
        return answer.message

    def refused(self):
        answer = self.press()
        self.assertFalse(answer.success, answer.message)
        return answer.message

    def lock(self, name):
        self.addCleanup(rosslt, 'unlock', name)
        rosslt('lock', name, '--reason', 'the robot is running')

    def waypoints(self):
        """The numbers of the list in the code of the arm."""
        return {row[0]: float(row[2]) for row in lines('list', '/arm') if 'waypoints' in row[0].lower()}

    def pose(self, x=1.5, y=2.5, z=0.0, w=1.0, frame='world'):
        message = PoseStamped()
        message.header.frame_id = frame
        message.pose.position.x, message.pose.position.y = x, y
        message.pose.orientation.z, message.pose.orientation.w = z, w
        return message

    def test_an_arm_that_was_led_by_hand_becomes_its_waypoint(self):
        rosslt('reset', '/arm')
        rows = self.waypoints()
        self.measures('/joint_states', JointState(name=['elbow', 'wrist', 'shoulder'], position=[0.5, 9.0, 1.5]))
        process = self.teach('/command=/joint_states')
        text = self.done()
        self.assertRegex(text, r'1\.25 -> 1\.5, .*0\.75 -> 0\.5; seen after \d+ messages?, \d+ ms')
        now = self.waypoints()
        self.assertEqual({rows[name]: now[name] for name in rows if rows[name] != now[name]}, {1.25: 1.5, 0.75: 0.5})
        ((_, by, *cells),) = self.rows('matches')
        self.assertEqual((by, cells[1:3], cells[4:6]), (MATCH, ['1.25', '1.5'], ['0.75', '0.5']))
        self.assertEqual([row[1] for row in self.rows('says')], [MATCH])
        self.assertEqual(len(lines('undo', '/arm')), 2)
        self.assertEqual(self.waypoints(), rows)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)

    def test_each_press_appends_what_is_measured_then_as_a_row(self):
        rosslt('reset', '/arm')
        with open(self.arm_file, encoding='utf-8') as file:
            before = file.read()
        expected = before.split('    [1.25, 0.75],\n')
        added = ['[1.25, 0.75]', '[1.50, 0.50]', '[1.25, -0.333333]']
        self.measures('/joint_states', JointState(name=['elbow', 'shoulder'], position=[0.5, 1.5]))
        joy = rospy.Publisher('/append_joy', Joy, queue_size=10)
        more = ['--append', '--press', '/append_joy', '--button', '1']
        process = self.teach('/command=/joint_states', more=more, service='append')
        wait_until(joy.get_num_connections, 'it hears the joystick')
        for buttons in ([0, 0], [0, 1]):
            joy.publish(Joy(buttons=buttons))
        ((_, by, *cells),) = wait_until(lambda: self.rows('appends') or self.rows('refused'), self.printed)
        self.assertEqual((by, cells[1:3], cells[4:6]), ('/append_joy', ['1.25', '1.5'], ['0.75', '0.5']))
        self.measures('/joint_states', JointState(name=['elbow'], position=[-1 / 3]))
        rospy.sleep(1.1)  # until the shoulder is old
        text = self.done()
        self.assertIn('shoulder of /command stays', text)
        with open(self.arm_file, encoding='utf-8') as file:
            made = file.read()
        self.assertEqual(made, expected[0] + ''.join(f'    {row},\n' for row in added) + expected[1])
        self.assertIn(1.25, self.waypoints().values())
        for _ in range(2):
            rosslt('undo', '/arm')
        with open(self.arm_file, encoding='utf-8') as file:
            self.assertEqual(file.read(), before)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)
        self.measures('/gripper', Float64(0.25))
        self.assertIn('no row can be added: ', failure('teach', '--append', '--match', '/grip/data=/gripper/data'))

    def test_joints_that_are_not_measured_stay_and_are_named(self):
        rosslt('reset', '/arm')
        self.measures('/joint_states', JointState(name=['elbow'], position=[0.625]))
        self.teach('/command=/joint_states')
        text = self.done()
        self.assertIn('0.75 -> 0.625', text)
        self.assertNotIn('1.25', text)
        self.assertIn('shoulder of /command stays: /joint_states does not name it', text)
        self.measures('/joint_states', JointState(name=['finger'], position=[1.0]))
        rospy.sleep(1.1)  # until the elbow is old
        self.assertIn('no joint of /command (shoulder, elbow) is among those of /joint_states', self.refused())

    def test_one_joint_becomes_a_joint_of_another_name_or_a_number(self):
        rosslt('reset', '/arm')
        before = self.waypoints()
        self.measures('/leader', JointState(name=['knee', 'elbow'], position=[0.375, -0.625]))
        self.measures('/gripper', Float64(0.0625))
        self.teach('/command:elbow=/leader:knee', '/grip/data=/leader:elbow', '/command:shoulder=/gripper/data')
        said = self.done()
        changed = {name: now for name, now in self.waypoints().items() if now != before[name]}
        self.assertEqual(changed, {'/arm/WAYPOINTS_1_0': 0.0625, '/arm/WAYPOINTS_1_1': 0.375}, said)
        self.assertEqual(value('/stage/width'), -0.625)
        self.assertIn('so already', self.done())
        self.measures('/leader', JointState(name=['knee'], position=[0.375]))
        rospy.sleep(1.2)  # until the message with the other joint is old
        self.assertIn('/leader has no joint elbow that was heard in the last second; it has: knee', self.refused())

    def test_topics_of_several_nodes_are_one_change_and_one_undo(self):
        rosslt('reset', '/arm')
        self.measures('/tracker', self.pose())
        self.measures('/gripper', Float64(0.0625))
        self.measures('/joint_states', JointState(name=['elbow'], position=[0.625]))
        self.teach('/goal/pose/position=/tracker/pose/position', '/grip/data=/gripper/data', '/command=/joint_states')
        before = len(lines('log', '/stage'))
        self.assertIn('/stage/width: 0.125 -> 0.0625', self.done())
        self.assertEqual([value('/stage/' + name) for name in ('x', 'half_y', 'width')], [1.5, 1.25, 0.0625])
        self.assertEqual(len(lines('log', '/stage')) - before, 3)
        self.assertIn('nothing to change: it is so already', self.done())
        self.assertIn(0.625, self.waypoints().values())
        self.assertEqual(len(lines('undo', '/stage')), 4)
        self.assertNotIn(0.625, self.waypoints().values())
        self.assertEqual([value('/stage/' + name) for name in ('x', 'half_y', 'width')], [1.0, 0.5, 0.125])

    def test_a_bound_or_a_lock_of_one_field_changes_none(self):
        self.measures('/tracker', self.pose(x=5.0))
        self.measures('/gripper', Float64(0.0625))
        self.teach('/goal/pose/position=/tracker/pose/position', '/grip/data=/gripper/data')
        self.assertIn('above its maximum 4.0', self.refused())
        self.measures('/tracker', self.pose(x=2.0))
        self.lock('/stage/x')
        wait_until(lambda: 'the robot is running' in self.refused(), 'the new pose is there')
        self.assertEqual([value('/stage/' + name) for name in ('x', 'half_y', 'width')], [1.0, 0.5, 0.125])
        self.assertEqual({row[1] for row in self.rows('refused')}, {MATCH})
        rosslt('unlock', '/stage/x')
        self.done()
        self.assertEqual([value('/stage/' + name) for name in ('x', 'half_y', 'width')], [2.0, 1.25, 0.0625])

    def test_more_fields_than_numbers_are_as_near_as_possible(self):
        self.measures('/forces', Float64MultiArray(data=[1.0, 2.0, 6.0]))
        self.teach('/three/data=/forces/data')
        text = self.done()
        self.assertIn('as near as possible: /three/data[0] is 2, 1 off, /three/data[1] is 3, 1 off', text)
        self.assertAlmostEqual(value('/stage/a'), 2.0)
        self.assertAlmostEqual(value('/stage/b'), 3.0)
        self.assertIn('nothing comes nearer', self.done())
        self.lock('/stage/b')
        self.measures('/forces', Float64MultiArray(data=[1.5, 2.5, 6.0]))
        wait_until(
            lambda: '/three/data[1] comes from /stage/b alone, which takes no' in self.press().message, 'refused'
        )
        self.assertAlmostEqual(value('/stage/a'), 2.0)
        rosslt('unlock', '/stage/b')
        self.measures('/forces', Float64MultiArray(data=[4.0, 5.0, 9.0]))
        wait_until(lambda: self.press().success and value('/stage/a') == 4.0, 'what can be met exactly is heard')
        self.assertNotIn('as near', self.done())
        self.assertEqual((value('/stage/a'), value('/stage/b')), (4.0, 5.0))

    def test_a_quaternion_and_its_negative_are_the_same_goal(self):
        self.measures('/tracker', self.pose(z=-math.sin(0.3), w=-math.cos(0.3)))
        self.teach('/goal/pose=/tracker/pose')
        self.done()
        self.assertAlmostEqual(value('/stage/yaw'), 0.6)

    def test_what_has_no_source_or_another_frame_is_refused(self):
        tilted = self.pose()
        tilted.pose.position.z = 0.5
        self.measures('/tracker', tilted)
        self.teach('/goal/pose=/tracker/pose')
        self.assertIn('/goal/pose/position/z has no source, as /stage sends it: it is 0.0, and 0.5 was', self.refused())
        self.measures('/tracker', self.pose(frame='camera'))
        wait_until(lambda: "/tracker is in the frame 'camera' and /goal in 'world'" in self.refused(), 'its frame')
        self.assertEqual(value('/stage/x'), 1.0)

    def test_what_is_silent_or_not_finite_is_refused(self):
        self.measures('/gripper', Float64(0.125))
        self.teach('/grip/data=/gripper/data')
        self.measures('/gripper', Float64(float('nan')))
        wait_until(lambda: 'not finite' in self.press().message, 'it is not finite')
        self.assertEqual(value('/stage/width'), 0.125)
        self.measured.clear()
        rospy.sleep(1.1)
        self.assertRegex(self.refused(), r'/gripper is silent: its last message came \d+\.\d s ago')
        self.assertEqual(value('/stage/width'), 0.125)
        self.measures('/gripper', Float64(0.25))
        wait_until(lambda: self.press().success, 'it is heard again')

    def test_a_message_that_does_not_follow_takes_all_back(self):
        self.measures('/gripper', Float64(2.0))
        self.teach('/stubborn/data=/gripper/data', '/grip/data=/gripper/data')
        self.assertRegex(self.refused(), '/stage now sends .*; taken back')
        self.assertEqual((value('/stage/held'), value('/stage/width')), (0.0, 0.125))

    def test_what_moves_by_itself_and_a_second_one_are_refused(self):
        self.measures('/gripper', Float64(2.0))
        self.teach('/moving/data=/gripper/data')
        self.assertIn('/slt_teach runs already, in process', failure('teach', '--match', '/grip/data=/gripper/data'))
        self.assertIn('it changes by itself: /moving/data: ', self.refused())

    def test_what_is_latched_keeps_its_change_and_a_press_waits(self):
        self.measures('/gripper', Float64(2.0))
        self.teach('/latched/data=/gripper/data', '/grip/data=/gripper/data')
        answers = []
        first = threading.Thread(target=lambda: answers.append(self.press()))
        first.start()
        wait_until(lambda: value('/stage/once') == 2.0, 'it waits for the messages')
        self.assertIn('the press before is still being answered', self.refused())
        first.join()
        self.assertTrue(answers[0].success)
        self.assertIn('not seen: /stage has latched', answers[0].message)
        self.assertEqual((value('/stage/once'), value('/stage/width')), (2.0, 2.0))

    def test_a_button_that_goes_down_presses_once(self):
        self.measures('/gripper', Float64(0.0625))
        joy = rospy.Publisher('/joy', Joy, queue_size=10)
        self.teach('/grip/data=/gripper/data', more=['--press', '/joy', '--button', '1'])
        wait_until(joy.get_num_connections, 'it hears the joystick')
        for buttons in ([1, 1], [1], [1, 0], [0, 1], [0, 1], [0, 1]):
            joy.publish(Joy(buttons=buttons))
        wait_until(lambda: self.rows('matches'), 'the press is answered')
        self.assertEqual(value('/stage/width'), 0.0625)
        joy.publish(Joy(buttons=[0, 0]))
        joy.publish(Joy(buttons=[0, 1]))
        wait_until(lambda: len(self.rows('matches')) == 2, 'the second press is answered')
        first, second = self.rows('matches')
        self.assertEqual((first[1:], second[1:]), (['/joy', '/stage/width', '0.125', '0.0625'], ['/joy']))
        told = [row[2] for row in self.rows('says')]
        self.assertIn('button 1 of /joy is down already: it counts when it goes down again', told)
        self.assertIn('/joy has 1 buttons, and no button 1', told)

    def test_enter_presses_in_a_terminal(self):
        self.measures('/gripper', Float64(0.0625))
        pid, terminal = pty.fork()
        if not pid:
            os.execvp('rosslt', ['rosslt', 'teach', '--match', '/grip/data=/gripper/data', '--wait', '10'])
        self.addCleanup(os.close, terminal)
        with open(terminal, 'rb', buffering=0, closefd=False) as shown:
            self.assertIn(b'a press is Enter or rosservice call /slt_teach/match; Ctrl-C ends it', shown.read(999))
            os.write(terminal, b'\n')
            printed = shown.read(999)
            while b'ms' not in printed:
                printed += shown.read(999)
        self.assertRegex(printed.decode(), r'Enter: /stage/width: 0\.125 -> 0\.0625; seen after \d+ messages?, \d+ ms')
        os.write(terminal, b'\x03')
        self.assertEqual(os.waitpid(pid, 0)[1], 0)

    def test_the_node_of_a_launch_file_has_its_service(self):
        self.measures('/gripper', Float64(0.0625))
        self.teach('/grip/data=/gripper/data', more=['__name:=led'], script=SLT_TEACH)
        self.done()
        self.assertEqual(lines('log', '/stage')[-1][1:3], ['/led', '/stage/width'])

    def test_errors_say_what_was_found(self):
        self.measures('/gripper', Float64(0.0625))
        self.measures('/tracker', self.pose())
        self.measures('/forces', Float64MultiArray(data=[1.0, 2.0]))
        self.measures('/joint_states', JointState(name=['elbow'], position=[0.5], velocity=[0.1]))
        rospy.sleep(0.3)
        for match, expected in (
            ('/grip/data=/nothing', 'nobody publishes /nothing'),
            ('/plain/data=/gripper/data', 'nothing in /plain/data has a source, as /stage sends it; `rosslt doctor'),
            ('/grip/date=/gripper/data', '/grip has no field date'),
            ('/grip/data=/tracker/pose', '/grip/data is a float64 and /tracker/pose a geometry_msgs/Pose: '),
            (
                '/command=/joint_states/velocity',
                '/command stands for its positions',
            ),
            ('/goal/header/frame_id=/gripper/data', 'has a source'),
            ('/command:elbo=/joint_states:elbow', '/command has no joint elbo; it has: shoulder, elbow'),
            ('/command:elbow=/joint_states:elbo', '/joint_states has no joint elbo that was heard'),
            ('/command:shoulder=/joint_states', '/joint_states has no joint shoulder that was heard'),
            ('/goal:elbow=/gripper/data', '/goal:elbow would be a joint of a sensor_msgs/JointState, and /goal is a'),
            ('/command:elbow=/nothing:elbow', 'nobody publishes /nothing:elbow'),
            ('/three/data=/forces/data', '/three/data has 3 elements and /forces/data has 2'),
        ):
            self.assertIn(expected, failure('teach', '--match', match, '--wait', '0.5'))


if __name__ == '__main__':
    import rostest

    rospy.init_node('matching')
    rostest.rosrun('rosslt', 'matching', '__main__')
