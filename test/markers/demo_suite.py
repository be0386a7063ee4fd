#!/usr/bin/env python3
"""The demo without a display: one drag that changes its source, described in words, and nothing left behind."""

import contextlib
import signal
import subprocess
import unittest

import rosgraph
import rostest

from support.hand import wait_until

NODES = {'/visualization_talker', '/visualization_listener', '/slt_visualization'}
COMMAND = ['rosrun', 'rosslt', 'demo']
TIMEOUT = 60.0


def nodes():
    """The nodes that the master knows."""
    return {node for names in rosgraph.Master('/check_demo').getSystemState() for _, users in names for node in users}


class Demo(unittest.TestCase):
    def setUp(self):
        # What an earlier demo has dragged would be there again.
        with contextlib.suppress(rosgraph.MasterError):
            rosgraph.Master('/check_demo').deleteParam('/visualization_talker')

    def test_it_shows_a_drag_at_the_source_and_in_the_next_messages(self):
        result = subprocess.run(COMMAND, stdout=subprocess.PIPE, timeout=TIMEOUT, encoding='utf-8', check=False)
        self.assertEqual(result.returncode, 0)
        before, _, after = result.stdout.partition('\nafter\n')
        for text, x in ((before, -1), (after, 0)):
            self.assertRegex(text, r'/visualization_talker +x = {} +visualization_talker:\d+:\d+'.format(x))
            self.assertRegex(text, r'linked/0 +at \({}, 0.5, 0.3\)'.format(x))
            self.assertRegex(text, r'linked/1 +at \({}, 0.5, 0.3\)'.format(x + 2))
        self.assertFalse(NODES & nodes())

    def interrupt(self, number):
        """The exit status of a demo that goes on after the drag, and is sent a signal."""
        with subprocess.Popen(COMMAND + ['--keep'], stdout=subprocess.PIPE, encoding='utf-8') as process:
            self.addCleanup(process.kill)
            wait_until(lambda: 'Drag a marker yourself' in process.stdout.readline(), 'the end of the drag', TIMEOUT)
            self.assertLess(NODES, nodes())
            process.send_signal(number)
            return process.wait(TIMEOUT)

    def test_an_interrupt_leaves_no_node_behind(self):
        self.assertEqual(self.interrupt(signal.SIGINT), 130)
        self.assertFalse(NODES & nodes())

    def test_neither_does_a_termination(self):
        self.assertEqual(self.interrupt(signal.SIGTERM), 143)
        self.assertFalse(NODES & nodes())


if __name__ == '__main__':
    rostest.rosrun('rosslt', 'demo', Demo)
