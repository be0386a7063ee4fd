"""`rosslt teach`, as a person starts it, and what it prints in a pipe."""

import os
import signal
import tempfile
import unittest

import rospy

from support.fork_server import Program
from support.processes import wait_until


class Teach:
    """`rosslt teach` in a process of its own, and what it prints."""

    def __init__(self, script, *arguments):
        self.directory = tempfile.TemporaryDirectory(prefix='rosslt_test_')
        self.output = os.path.join(self.directory.name, 'output')
        with open(self.output, 'wb') as output, open(self.output + '.errors', 'wb') as errors:
            self.process = Program(script, arguments, output, errors)

    def rows(self, kind):
        with open(self.output, encoding='utf-8') as file:
            return [row for row in (line.rstrip('\n').split('\t') for line in file) if row[0] == kind]

    def wait_for(self, kind, count=1):
        return wait_until(lambda: len(self.rows(kind)) >= count and self.rows(kind), f'{count} times {kind}')

    def stop(self, number=signal.SIGINT):
        self.process.send_signal(number)
        return self.process.wait(60)


class WithDevices(unittest.TestCase):
    """Tests that play devices."""

    def device(self, kind, name='device'):
        """The publisher of a device, on a topic that no test has but this one."""
        publisher = rospy.Publisher('/{}/{}'.format(self._testMethodName, name), kind, queue_size=1000)
        self.addCleanup(publisher.unregister)
        return publisher

    def play(self, publisher, *messages):
        for message in messages:
            publisher.publish(message)

    def start(self, publisher, *command):
        """Start what is to follow a device; returns it once it hears the device."""
        started = Teach(*command, '--by', publisher.name, '--wait', '60')
        self.addCleanup(started.process.kill)
        wait_until(publisher.get_num_connections, lambda: 'it hears the device: ' + str(started.process.poll()))
        return started

    def hold(self, teaching, publisher, make, times=1):
        """Have a device send the same place until the hand holds."""

        def holds():
            publisher.publish(make())
            return len(teaching.rows('holds')) >= times

        wait_until(holds, lambda: f'the hand to hold: {teaching.rows("says")}')

    def said(self, teaching):
        """What a process has said: of messages that move nothing, why."""
        return [row[2].partition('moves nothing: ')[2] or row[2] for row in teaching.rows('says')]
