#!/usr/bin/env python3
"""`rosslt teach --record`, `--append`: where a device that the test plays leads a thing becomes rows in the file."""

import ast
import difflib
import math
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import rospy
from geometry_msgs.msg import PoseStamped
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from support.fork_server import Program
from support.packages import launched, package_of_node
from support.processes import wait_until
from support.shell import failure, rosslt
from support.unmodified import Unmodified

#: A node of a patrol as a user would write it.
PATROL = """import math
import rospy
from geometry_msgs.msg import PoseStamped

HOME = 0.25
WAYPOINTS = [
    (0.50, -1.0, 0.3, 'dock', 1.5),  # the dock
    (4.0, 2.00, 0.0, 'door', 2.5),
]
SPLIT = [
    [0.0, 1.0],
    [2.0, 3.0],
]
ODD = [
    [0.0, 1.0],
    [2.0, 3.0, 4.0],
]

rospy.init_node('patrol')
goal = rospy.Publisher('goal', PoseStamped, queue_size=1)
spread = rospy.Publisher('spread', PoseStamped, queue_size=1)
home = rospy.Publisher('home', PoseStamped, queue_size=1)
odd = rospy.Publisher('odd', PoseStamped, queue_size=1)

def send(publisher, x, y, yaw=None):
    sent = PoseStamped()
    sent.header.frame_id = 'world'
    sent.pose.position.x, sent.pose.position.y = x, y
    sent.pose.orientation.w = 1.0
    if yaw is not None:
        sent.pose.orientation.z, sent.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    publisher.publish(sent)

while not rospy.is_shutdown():
    x, y, yaw, name, wait = WAYPOINTS[0]
    send(goal, x, y, yaw)
    send(spread, SPLIT[0][0], SPLIT[1][1])
    send(home, HOME, rospy.get_param('/height'))
    send(odd, ODD[0][0], ODD[0][1])
    rospy.sleep(0.02)
"""

#: A node whose goal is the first of the rows of a parameter.
ROUTE = """import rospy
from geometry_msgs.msg import PoseStamped

rospy.init_node('route')
stop = rospy.Publisher('stop', PoseStamped, queue_size=1)
stops = rospy.get_param('~stops')
while not rospy.is_shutdown():
    sent = PoseStamped()
    sent.header.frame_id = 'world'
    sent.pose.position.x, sent.pose.position.y = stops[0]['x'], stops[0]['y']
    sent.pose.orientation.w = 1.0
    stop.publish(sent)
    rospy.sleep(0.02)
"""

ROUTE_LAUNCH = """<launch>
  <node pkg="route_package" type="route.py" name="route">
    <rosparam file="{}"/>
  </node>
</launch>
"""

TOLERANCE, LEVER = 0.005, 0.1
PERIOD = 0.02  # s between two stamps


def eased(part):
    """How far a movement with pauses has come, from 0 to 1, at a part of its time."""
    return sum(min(max((part - begin) / 0.2, 0.0), 1.0) for begin in (0.1, 0.4, 0.7)) / 3


def curve(count=3000):
    """The poses x, y, yaw of a hand for a minute, with pauses."""
    for n in range(count):
        s = eased(n / (count - 1))
        yield 0.6 * s, 0.15 * math.sin(2 * math.pi * s), 0.4 * math.sin(math.pi * s)


def off(pose, rows):
    """How far a pose x, y, yaw is from the way along rows."""
    best = math.inf
    for first, last in zip(rows, rows[1:]):
        for part in (n / 200 for n in range(201)):
            x, y, yaw = (a + part * (b - a) for a, b in zip(first, last))
            best = min(best, math.hypot(pose[0] - x, pose[1] - y, LEVER * (pose[2] - yaw)))
    return best


class Recording(unittest.TestCase):
    now = 100.0

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix='rosslt_test_')
        self.addCleanup(self.folder.cleanup)
        self.device = rospy.Publisher(f'/{self._testMethodName}/hand', PoseStamped, queue_size=10000)
        self.addCleanup(self.device.unregister)

    def patrol(self):
        rospy.set_param('/height', 0.5)
        node = Unmodified(Path(self.folder.name), 'patrol', PATROL)
        self.addCleanup(node.__exit__)
        node.__enter__()
        wait_until(lambda: '/patrol/WAYPOINTS_0_1' in rosslt('list', '/patrol').stdout, 'its numbers are known')
        return node

    def record(self, target, *arguments, option='--record'):
        """Start to record, with the device of this test."""
        output = os.path.join(self.folder.name, 'output')
        with open(output, 'wb') as out, open(output + '.errors', 'wb') as errors:
            command = [target, '--by', self.device.name, option, '--smooth', '0', '--wait', '60', *arguments]
            process = Program(shutil.which('rosslt'), ['teach', *command], out, errors)
        self.addCleanup(process.kill)
        self.said = lambda: Path(output).read_text() + Path(output + '.errors').read_text()
        return process, lambda kind: [
            row for row in (line.split('\t') for line in self.said().splitlines()) if row[0] == kind
        ]

    def wait_for(self, condition):
        return wait_until(condition, lambda: 'something else is said: ' + self.said())

    def lead(self, rows, poses):
        """Have the hand take hold, and lead it along poses x, y, yaw, each one period after the last."""
        held = len(rows('holds'))
        self.wait_for(lambda: self.send([(0.0, 0.0, 0.0)]) or len(rows('holds')) > held)
        self.send(poses)

    def send(self, poses):
        for x, y, yaw in poses:
            message = PoseStamped()
            type(self).now += PERIOD
            message.header.stamp = rospy.Time.from_sec(self.now)
            message.pose.position.x, message.pose.position.y = x, y
            message.pose.orientation.z, message.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            self.device.publish(message)

    def test_a_minute_becomes_at_most_twenty_rows(self):
        node = self.patrol()
        before = node.file.read_text()
        process, rows = self.record('/goal')
        self.lead(rows, curve())
        ((_, name, poses, count, where),) = wait_until(
            lambda: rows('records') or rows('says')[1:], lambda: 'it is written: ' + self.said()
        )
        self.assertEqual((name, where), ('/goal', f'{node.file}:7'), self.said())
        self.assertGreaterEqual(int(poses), 3000, 'and those from before it began')
        after = node.file.read_text()
        marks = {line[0] for line in difflib.ndiff(before.splitlines(), after.splitlines())}
        self.assertEqual(marks, {' ', '+'}, after)
        waypoints = ast.literal_eval(after.partition('WAYPOINTS = ')[2].partition(']')[0] + ']')
        self.assertEqual(len(waypoints), 2 + int(count))
        self.assertLessEqual(int(count), 20)
        print(f'{poses} poses became {count} rows')
        self.assertEqual({row[3:] for row in waypoints[:-1]}, {('dock', 1.5)})
        way = [row[:3] for row in waypoints[:-1]]
        led = [(0.5 + x, -1.0 + y, 0.3 + yaw) for x, y, yaw in curve()]
        self.assertLessEqual(max(off(pose, way) for pose in led[::10]), TOLERANCE)
        self.assertLessEqual(math.dist(led[-1], way[-1]), TOLERANCE)
        values = [float(rosslt('get', f'/patrol/WAYPOINTS_0_{index}').stdout) for index in range(3)]
        self.assertEqual(values, [0.5, -1.0, 0.3], 'it is back where it was')
        self.assertRegex(rosslt('save', '/patrol').stderr, '^rosslt save: nothing to save, but patrol.py: lines 8, ')

        self.lead(rows, [(0.0, 0.0, 0.0)] * 50)
        told = wait_until(
            lambda: [row for row in rows('says') if 'silent' not in row[2]], lambda: 'it is told: ' + self.said()
        )
        self.assertEqual([row[2] for row in told], ['nothing is written: it stayed where it was, within 0.005 m'])
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)
        self.assertEqual(node.file.read_text(), after)
        undone = rosslt('undo', '/patrol')
        self.assertEqual(undone.stdout.split('\t')[:3], ['/patrol/WAYPOINTS_0_0', 'add', 'undone'], undone)
        self.assertEqual(node.file.read_text(), before)

    def started_script(self, name):
        """The file of a live script whose node runs until the end of the test, and its text."""
        file = Path(self.folder.name, f'{name}.script')
        text = f'# {name}\ngoto(2.0, 1.00, 1.5)  # in\n\ngoto(-1, 2, 0.5)'
        file.write_text(text)
        node = subprocess.Popen(['rosrun', 'rosslt', 'interactive_script', f'_file:={file}', f'__name:={name}'])
        self.addCleanup(node.wait, 60)
        self.addCleanup(node.terminate)
        return file, text

    def test_a_live_script_runs_again_with_the_rows(self):
        file, before = self.started_script('tour')
        process, rows = self.record('/waypoint')
        self.lead(rows, [(0.01 * min(n, 30), 0.01 * max(n - 30, 0), 0.0) for n in range(61)])
        self.wait_for(lambda: rows('records'))
        self.assertEqual(
            file.read_text(),
            before.replace('# in\n', '# in\ngoto(2.3, 1.00, 1.5)\ngoto(2.3, 1.30, 1.5)\n'),
        )
        self.wait_for(lambda: rosslt('list', '/tour').stdout.count('tour.script:') == 12)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)

    def test_what_is_in_no_row_or_in_two_or_locked_is_refused(self):
        node = self.patrol()
        for target, why in (
            ('/home', 'no row can be added: .*no list of alike rows stands here'),
            ('/odd', 'no row can be added: .*it is no row of a list of alike ones'),
        ):
            self.assertRegex(failure('teach', target, '--by', self.device.name, '--record', '--wait', '20'), why)
        self.assertEqual(rosslt('lock', '/patrol/WAYPOINTS_1_0', '--reason', 'it is measured').returncode, 0)
        self.assertRegex(
            failure('teach', '/goal', '--by', self.device.name, '--record', '--wait', '20'),
            '^rosslt teach: /patrol refuses: /patrol/WAYPOINTS_1_0 is locked by .*: it is measured$',
        )
        self.assertEqual(rosslt('unlock', '/patrol').returncode, 0)
        process, rows = self.record('/spread')
        self.lead(rows, ((0.01 * n, 0.02 * n, 0.0) for n in range(30)))
        told = wait_until(
            lambda: [row[2] for row in rows('says') if 'silent' not in row[2]], lambda: 'it is refused: ' + self.said()
        )
        self.assertRegex(told[0], 'nothing is written: .*no number of the row in line 11 stands here')
        self.assertEqual(node.file.read_text(), PATROL)
        self.assertEqual(rosslt('get', '/patrol/SPLIT_0_0').stdout, '0.0\n')
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)

    def append(self, target):
        """Start to append; its process, its rows of a kind, and what presses."""
        process, rows = self.record(target, option='--append')
        self.ghost = ()
        rospy.Subscriber('/slt_teach/ghost', MarkerArray, self.see)
        self.wait_for(lambda: self.is_served('/slt_teach/append') or rows('rosslt teach:'))
        return process, rows, rospy.ServiceProxy('/slt_teach/append', Trigger)

    def see(self, message):
        self.ghost = [(one.pose.position.x, one.pose.position.y) for one in message.markers if one.action == one.ADD]

    def is_served(self, name):
        try:
            return rospy.wait_for_service(name, 0.2) is None
        except rospy.ROSException:
            return False

    def lead_and_press(self, rows, press, x, y, yaw=0.0):
        """Have the hand take hold, lead the thing by so much, press, and let go; the answer."""
        steps, is_there = 20, False
        while not is_there:  # again if a busy machine has let the hand be silent
            self.wait_for(lambda: not self.ghost and len(rows('lets go')) == len(rows('holds')))
            let_go = len(rows('lets go'))
            self.lead(rows, [(0.0, 0.0, 0.0)])
            ((from_x, from_y),) = self.wait_for(lambda: self.send([(0.0, 0.0, 0.0)]) or self.ghost)
            self.send((x * n / steps, y * n / steps, yaw * n / steps) for n in range(steps + 1))
            there = from_x + x, from_y + y
            self.wait_for(
                lambda: self.send([(x, y, yaw)])
                or len(rows('lets go')) > let_go  # noqa: B023
                or any(math.dist(one, there) < 1e-6 for one in self.ghost)  # noqa: B023
            )
            is_there = len(rows('lets go')) == let_go
        answers = []
        pressing = threading.Thread(target=lambda: answers.append(press()))
        pressing.start()
        while pressing.is_alive():
            self.send([(x, y, yaw)])
            rospy.sleep(PERIOD)
        self.wait_for(lambda: len(rows('lets go')) > let_go)
        return answers[0]

    def test_each_press_appends_one_row_behind_the_last(self):
        node = self.patrol()
        ids = rosslt('list', '/patrol').stdout
        process, rows, press = self.append('/goal')
        self.assertEqual(press().message, 'nothing is written: no hand holds the thing; hold it, and press then')
        above, below = PATROL.split("    (4.0, 2.00, 0.0, 'door', 2.5),\n")
        below = "    (4.0, 2.00, 0.0, 'door', 2.5),\n" + below
        first = "    (0.75, -0.5, 0.3, 'dock', 1.5),\n"
        second = "    (0.25, -1.0, 0.5, 'dock', 1.5),\n"
        third = "    (0.50, -2.0, 0.3, 'dock', 1.5),\n"
        answer = self.lead_and_press(rows, press, 0.25, 0.5)
        self.assertTrue(answer.success, answer.message)
        self.assertIn(f'a row with this is below {node.file}:7', answer.message)
        self.assertEqual(node.file.read_text(), above + first + below)
        self.assertTrue(self.lead_and_press(rows, press, -0.25, 0.0, 0.2).success, self.said())
        self.assertEqual(node.file.read_text(), above + first + second + below)
        self.assertEqual(rosslt('list', '/patrol').stdout, ids, 'the numbers that were there are as they were')
        self.assertEqual(rosslt('undo', '/patrol').stdout.split('\t')[1:3], ['add', 'undone'])
        self.assertEqual(node.file.read_text(), above + first + below)
        self.assertTrue(self.lead_and_press(rows, press, 0.0, -1.0).success, self.said())
        self.assertEqual(node.file.read_text(), above + first + third + below)
        self.assertTrue(self.lead_and_press(rows, press, -0.25, 0.0, 0.2).success, self.said())
        self.assertEqual(node.file.read_text(), above + first + third + second + below)
        (_, by, *cells), *_ = rows('appends')
        self.assertEqual(
            (by, cells),
            ('/slt_teach/append', ['/patrol/WAYPOINTS_0_0', '0.5', '0.75', '/patrol/WAYPOINTS_0_1', '-1.0', '-0.5']),
        )
        rosslt('set', '/patrol/WAYPOINTS_0_4', '3.5')
        rosslt('set', '/patrol/WAYPOINTS_0_0', '0.625')
        text = node.file.read_text()
        self.assertIn(
            'is changed, and not saved: `rosslt save /patrol`', self.lead_and_press(rows, press, 1, 1).message
        )
        rosslt('reset', '/patrol')
        rosslt('lock', '/patrol/WAYPOINTS_1_0', '--reason', 'it is measured')
        self.assertIn('/patrol/WAYPOINTS_1_0 is locked by', self.lead_and_press(rows, press, 1, 1).message)
        self.assertEqual(node.file.read_text(), text)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)
        self.assertRegex(
            failure('teach', '/goal', '--by', self.device.name, '--append', '--wait', '20'),
            '^rosslt teach: /patrol refuses: /patrol/WAYPOINTS_1_0 is locked by .*: it is measured$',
        )
        self.assertRegex(
            failure('teach', '/odd', '--by', self.device.name, '--append', '--wait', '20'),
            'no row can be added: .*it is no row of a list of alike ones',
        )

    def test_a_live_script_gets_each_row_and_runs_on(self):
        file, before = self.started_script('walk')
        process, rows, press = self.append('/waypoint')
        added = ['goto(2.3, 1.00, 1.5)\n', 'goto(2.3, 1.50, 1.5)\n']
        for count, (x, y) in enumerate([(0.3, 0.0), (0.3, 0.5)], 1):
            answer = self.lead_and_press(rows, press, x, y)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(file.read_text(), before.replace('# in\n', '# in\n' + ''.join(added[:count])))
            self.wait_for(lambda: rosslt('list', '/walk').stdout.count('walk.script:') == 6 + 3 * count)  # noqa: B023
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)

    def test_a_yaml_file_gets_rows_and_the_numbers_stay(self):
        folder = Path(self.folder.name)
        environment = package_of_node(folder, 'route_package', 'route.py', ROUTE)
        launch, file = folder / 'route.launch', folder / 'stops.yaml'
        first, last = '- {x: 2.0, y: 1.00, name: in}  # in\n', '- {x: -1.0, y: 2.5, name: out}\n'
        text = f'# all\nstops:\n{first}{last}'
        file.write_text(text)
        launch.write_text(ROUTE_LAUNCH.format(file))
        added = ['- {x: 2.3, y: 1.00, name: in}\n', '- {x: 2.3, y: 1.50, name: in}\n']
        with launched(environment, 'rosslt', 'launch', '--no-markers', str(launch)):
            wait_until(lambda: '/route/~stops/1/y' in rosslt('list', '/route').stdout, 'its numbers are known')
            listed = rosslt('list', '/route').stdout
            process, rows, press = self.append('/stop')
            for count, (x, y) in enumerate([(0.3, 0.0), (0.3, 0.5)], 1):
                answer = self.lead_and_press(rows, press, x, y)
                self.assertTrue(answer.success, answer.message)
                self.assertIn(f'a row with this is below {file}:{2 + count}', answer.message)
                self.assertEqual(file.read_text(), text.replace(first, first + ''.join(added[:count])))
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(60), 0)
            self.assertEqual(rosslt('set', '/route/~stops/1/x', '-1.5').returncode, 0)
            self.assertEqual(rosslt('save', '/route').returncode, 0)
            saved = last.replace('-1.0', '-1.5')
            self.assertEqual(file.read_text(), f'# all\nstops:\n{first}{"".join(added)}{saved}')
            self.assertEqual(rosslt('undo', '/route').returncode, 0)
            undone = rosslt('undo', '/route')
            self.assertEqual(undone.stdout.split('\t')[1:3], ['add', 'undone'], undone)
            self.assertEqual(file.read_text(), f'# all\nstops:\n{first}{added[0]}{saved}')
            self.assertEqual(rosslt('undo', '/route').stdout.split('\t')[1:3], ['add', 'undone'])
            self.assertEqual(rosslt('save', '/route').returncode, 0)
            self.assertEqual(file.read_text(), text, 'the number is saved where it stands')
            self.assertEqual(rosslt('list', '/route').stdout, listed)

            process, rows = self.record('/stop')
            self.lead(rows, [(0.01 * min(n, 30), 0.01 * max(n - 30, 0), 0.0) for n in range(61)])
            self.wait_for(lambda: rows('records'))
            led = added[0] + added[1].replace('1.50', '1.30')
            self.assertEqual(file.read_text(), text.replace(first, first + led))
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(60), 0)


if __name__ == '__main__':
    import rostest

    rospy.init_node('recording')
    rostest.rosrun('rosslt', 'recording', '__main__')
