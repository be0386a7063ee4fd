#!/usr/bin/env python3
"""rosslt_message_statistics in a ROS graph: tracked types, in-band provenance and plain messages, to a pipe and to a
terminal."""

import os
import pty
import re
import subprocess
import unittest

import rospy
import rostest
from geometry_msgs.msg import Point, Pose
from std_msgs.msg import String

import rosslt
from rosslt.messages import encode

COMMAND = ['rosrun', 'rosslt', 'rosslt_message_statistics', '-i', '0.5']


class StatisticsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rosslt.init_node('statistics_suite')
        in_band = rosslt.Publisher('pose', Pose, queue_size=1)
        plain = rosslt.Publisher('plain', String, queue_size=1)
        cls.pose = Pose(position=Point(*rosslt.location([1.0, 2.0, 3.0], name='position')))

        def publish(event):
            in_band.publish(cls.pose)
            plain.publish('hello')

        cls.timer = rospy.Timer(rospy.Duration(0.05), publish)

    def test_lines_in_a_pipe_tell_rates_and_sizes(self):
        output = subprocess.check_output(
            [*COMMAND, '-n', '4', '/chatter', 'pose', '/plain', '/nothing'], encoding='utf-8', timeout=30
        )
        lines = output.splitlines()
        self.assertEqual(len(lines), 16)
        last = {line.split()[1]: line for line in lines[-4:]}
        self.assertRegex(last['/chatter'], r'type rosslt/Int32Tracked  rate \d+\.\d Hz  plain 4 B  provenance \d+ B')
        size = len(encode(self.pose)) + 8
        self.assertIn('type geometry_msgs/Pose', last['/pose'])
        self.assertIn('plain 56 B  provenance %d B  ratio %.2f' % (size, (56 + size) / 56), last['/pose'])
        self.assertIn('plain 9 B  provenance 0 B  ratio 1.00', last['/plain'])
        self.assertIn('rate 0.0 Hz  plain -  provenance -  ratio -', last['/nothing'])
        rate = float(re.search(r'rate (\S+) Hz', last['/plain']).group(1))
        self.assertTrue(5 < rate < 40, rate)

    def test_the_table_on_a_terminal_is_refreshed_in_place(self):
        reader, terminal = pty.openpty()
        process = subprocess.Popen([*COMMAND, '-n', '3', '/plain'], stdout=terminal, stdin=subprocess.DEVNULL)
        os.close(terminal)
        shown = b''
        while True:
            try:
                part = os.read(reader, 4096)
            except OSError:
                break
            if not part:
                break
            shown += part
        self.assertEqual(process.wait(30), 0)
        self.assertEqual(shown.count(b'\x1b[2F'), 2)
        self.assertEqual(shown.count(b'topic   type'), 3)

    def test_it_ends_when_nobody_reads_any_more(self):
        process = subprocess.Popen(
            [*COMMAND, '/plain'], stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding='utf-8'
        )
        process.stdout.readline()
        process.stdout.close()
        self.assertEqual(process.wait(30), 0)
        self.assertNotIn('Traceback', process.stderr.read())
        process.stderr.close()

    def test_a_call_that_is_not_understood_ends_with_2(self):
        for arguments in ([], ['-i', '0', '/plain'], ['-n', 'x', '/plain']):
            done = subprocess.run([*COMMAND[:3], *arguments], stderr=subprocess.PIPE, encoding='utf-8', check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn('usage:', done.stderr)

    def test_without_a_master_it_says_so(self):
        done = subprocess.run(
            [*COMMAND, '/plain'],
            env=dict(os.environ, ROS_MASTER_URI='http://localhost:1'),
            stderr=subprocess.PIPE,
            encoding='utf-8',
            check=False,
        )
        self.assertEqual(done.returncode, 1)
        self.assertIn('found no ROS master at http://localhost:1', done.stderr)


if __name__ == '__main__':
    rostest.rosrun('rosslt', 'statistics', StatisticsTest)
