"""Unmodified nodes, run by `rosslt run` or by themselves."""

import os
import signal
import subprocess
import sys
import threading

import rosgraph

import rosslt
from support.processes import forget_node, forget_plain_node, node_pid, wait_until


class Unmodified:
    """A program that runs in its own process.

    Args:
        folder: where it is written to.
        name: of its file, and of its node.
        code: all of it; what is not in UTF-8 as of `surrogateescape`.
        arguments: of its command line.
        tracked: run it with `rosslt run`.
        options: of `rosslt run`.
    """

    def __init__(self, folder, name, code, *arguments, tracked=True, options=(), **environment):
        self.name = '/' + name
        self.address = None  # of its node, once it is up
        self.file = folder / (name + '.py')
        self.file.write_text(code, encoding='utf-8', errors='surrogateescape')
        start = ['rosslt', 'run', *options] if tracked else [sys.executable]
        self.process = subprocess.Popen(
            [*start, str(self.file), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=str(folder),
            env=dict(os.environ, XDG_CACHE_HOME=str(folder / 'cache'), **environment),
        )

    def end(self, timeout=60):
        """Wait until it ends by itself: (exit code, standard output, standard error)."""
        try:
            output, errors = self.process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.process.returncode, output, errors

    def is_up(self):
        """Whether its node is known to the master."""
        try:
            address = rosgraph.Master('/test').lookupNode(self.name)
            if node_pid(address) != self.process.pid:
                return False
            self.address = address
            return True
        except rosgraph.MasterError:
            return False

    def stop(self, number=signal.SIGINT):
        """End it; returns what `end` does."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.end()

    def __enter__(self):
        wait_until(lambda: self.is_up() or self.process.poll() is not None, f'{self.name} starts', 60)
        return self

    def __exit__(self, *_):
        lives = self.process.poll() is None
        if lives:
            self.process.kill()
        output, errors = self.process.communicate()
        if self.process.returncode:
            forget_node(self.name)
        elif self.address:
            forget_plain_node(self.name, self.address)
        # shown where the test fails
        print(f'{self.name} {"lived" if lives else "had ended"}, and said:', output, errors, sep='\n')


class Listener:
    """The last message of a topic."""

    def __init__(self, topic, kind):
        self.last = None
        self.arrived = threading.Event()
        self._subscriber = rosslt.Subscriber(topic, kind, self._take, keep_provenance=True)

    def _take(self, message):
        self.last = message
        self.arrived.set()

    def next(self):
        self.arrived.clear()
        assert self.arrived.wait(60)
        return self.last

    def comes(self, holds):
        """Wait for a message for which that holds."""
        wait_until(lambda: self.last is not None and holds(self.last), 'such a message comes')
        return self.last

    def __enter__(self):
        self.comes(lambda _: True)
        return self

    def __exit__(self, *_):
        self._subscriber.unregister()
