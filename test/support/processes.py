"""Nodes in processes of their own, for the suites beside this file: written as text, started, stopped."""

import atexit
import contextlib
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import time
import xmlrpc.client
from pathlib import Path

import rosgraph
import rosnode
import rospy

from support.fork_server import Program


class Node:
    """A node that runs in its own process, which is a fork of one that has loaded rospy.

    Args:
        name: its name.
        code: what it does, after the imports; it may be indented. `SPIN` stands for waiting until shutdown.
        options: further arguments, for example remappings or private parameters.
        wait_for: the service below its name that says that it has started; None to wait for none.
        calls_init_node: whether the code calls `rosslt.init_node` itself, not as its first line.
        environment: further environment variables.
    """

    IMPORTS = """\
        import json, os, sys, time
        import rospy, rosslt
        from geometry_msgs.msg import Point, Pose, PoseStamped
        from rosslt.msg import Float64Tracked, PoseTracked
        from std_msgs.msg import Float64, String
        """

    def __init__(self, name, code, *options, wait_for='rosslt/change_sources', calls_init_node=False, **environment):
        self.name = '/' + name
        self.directory = tempfile.TemporaryDirectory(prefix='rosslt_test_')
        self.file = os.path.join(self.directory.name, name + '.py')
        self.options = options
        self.environment = environment
        self.calls_init_node = calls_init_node
        self.write(code)
        self.errors = os.path.join(self.directory.name, name + '.log')
        self.process, self.log = None, []
        atexit.register(self.stop, signal.SIGKILL)
        self.start(wait_for)

    def write(self, code):
        """Write the node's code, in place of what it has."""
        with open(self.file, 'w', encoding='utf-8') as file:
            file.write(
                textwrap.dedent(self.IMPORTS)
                + ('' if self.calls_init_node else 'rosslt.init_node({!r})\n'.format(self.name[1:]))
                + textwrap.dedent(code).strip()
                + '\n'
            )

    def start(self, wait_for='rosslt/change_sources'):
        """Start it, and wait until it offers a service below its name, if one is named."""
        with open(self.errors, 'a', encoding='utf-8') as errors:
            if not self.environment:
                self.process = Program(self.file, self.options, subprocess.PIPE, errors)
            else:  # which Python and rospy may read when they are loaded
                self.process = subprocess.Popen(
                    [sys.executable, self.file, *self.options],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    text=True,
                    env={**os.environ, **self.environment},
                )
        if wait_for:
            wait_until(lambda: self.offers(wait_for), 'offers ' + wait_for)

    def offers(self, service):
        """Whether this process offers the service."""
        master = rosgraph.Master('/test')
        try:
            uri = master.lookupService('{}/{}'.format(self.name, service))
            node = master.lookupNode(self.name)
        except rosgraph.MasterError:
            return False
        return bool(uri) and node_pid(node) == self.process.pid

    def read_line(self):
        """The next line that it prints, but for what rospy logs; that collects in `log`."""
        while True:
            line = self.process.stdout.readline()
            if not line.startswith('[INFO]'):
                return line.strip()
            self.log.append(line)

    def line_of(self, text):
        """The number of the first line of its code that has a text."""
        with open(self.file, encoding='utf-8') as file:
            return next(number for number, line in enumerate(file, 1) if text in line)

    def logged(self):
        """What it has written on its standard error so far: warnings and errors of rospy among it."""
        with open(self.errors, encoding='utf-8') as errors:
            return errors.read()

    def warnings(self):
        """How many warnings rospy logged on its standard error, after it has ended."""
        return self.logged().count('[WARN]')

    def stop(self, number=signal.SIGINT):
        """End it, and wait until it has ended; returns its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(number)
        self.process.stdin.close()  # which a node may wait for, whatever it was told
        try:
            return self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()
        finally:
            self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.stop() != 0:
            forget_node(self.name)


def is_published(topic):
    """Whether the master knows a node that publishes the topic, by its full name."""
    return topic in dict(rosgraph.Master('/test').getPublishedTopics(''))


class PortTaken(Exception):
    """Another master has come to the port of one that was to start."""


def unassigned_port():
    """A free port that the system gives to nobody who asks for any, as nodes do: they would answer for a master."""
    lowest_assigned = int(Path('/proc/sys/net/ipv4/ip_local_port_range').read_text().split()[0])
    while True:
        with socket.socket() as free, contextlib.suppress(OSError):
            free.bind(('localhost', random.randrange(lowest_assigned // 2, lowest_assigned)))
            return free.getsockname()[1]


class Master:
    """A ROS master in a process of its own, a fork as a node is, on a port of its own."""

    def __init__(self):
        started = False
        while not started:
            self.port = unassigned_port()
            self.uri = 'http://localhost:{}'.format(self.port)
            with contextlib.suppress(PortTaken):
                self.start()
                started = True

    def start(self):
        arguments = ['--core', '-p', str(self.port)]
        with open(os.devnull, 'w', encoding='utf-8') as nowhere:
            self.process = Program(shutil.which('rosmaster'), arguments, nowhere, nowhere)
        wait_until(self._answers, 'the master answers', 60.0)

    def _answers(self):
        answering = node_pid(self.uri)
        if answering not in (None, self.process.pid):
            self.kill()
            raise PortTaken(self.uri)
        return answering is not None

    def kill(self):
        self.process.kill()
        self.process.wait()


def node_pid(uri):
    """The process id of a node, from the node itself."""
    try:
        return xmlrpc.client.ServerProxy(uri).getPid('/test')[2]
    except OSError:
        return None


NOBODY = 'http://localhost:9/'
"""The address of a node at which nothing listens."""


def forget_node(name):
    """Take what a killed node registered out of the master.

    The master would go on calling the dead node's ports. The system gives such a port to other processes: a node whose
    topics come through it waits for ever for the header of a connection that is the master's.
    """
    # it had registered nothing, or the master is gone
    with contextlib.suppress(rosgraph.MasterException, rosnode.ROSNodeException, OSError):
        rosnode.cleanup_master_blacklist(rosgraph.Master('/test'), [name])
        # by this name it hears of parameters, from a server of its own: the master forgets an older one of the name
        listening = rosgraph.Master(name + '/rosslt')
        listening.subscribeParam(NOBODY, name)
        listening.unsubscribeParam(NOBODY, name)


def forget_plain_node(name, address):
    """Take out of the master what a node of rospy alone leaves there as it ends by itself: a parameter of its log.

    At the next node of its name, the master would shut down whoever has got its port by then.
    """
    with contextlib.suppress(OSError):  # the master is gone
        rosgraph.Master(name).unsubscribeParam(address, '/rosout_disable_topics_generation')


def wait_until_hears(subscriber, publisher):
    """Wait until a node publishes to a subscriber of this process, which knows itself connected a moment earlier."""
    api = rosgraph.Master('/test').lookupNode(publisher)

    def is_connected():
        _, _, connections = xmlrpc.client.ServerProxy(api).getBusInfo('/test')
        return any(one[1:3] + [one[4]] == [rospy.get_name(), 'o', subscriber.resolved_name] for one in connections)

    wait_until(is_connected, publisher + ' to publish to this process')


def wait_until(holds, what, timeout=60.0):
    """Wait until `holds()` gives something true, and return it.

    What is asked mostly asks other processes, which takes their processor time and that of what is waited for: the
    longer it lasts, the less often it is asked.

    Args:
        what: a text, or a function that makes it once the wait was in vain.

    Raises:
        AssertionError: it did not within the timeout, in seconds.
    """
    begin = time.monotonic()
    while True:
        result = holds()
        if result:
            return result
        lasted = time.monotonic() - begin
        if lasted > timeout:
            raise AssertionError('not within {:g} s: {}'.format(timeout, what() if callable(what) else what))
        time.sleep(min(max(0.1 * lasted, 0.01), 0.05))
