"""`rosslt teach`, as a person starts it, and what it prints in a pipe."""

import os
import signal
import tempfile

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
