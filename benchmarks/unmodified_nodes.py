#!/usr/bin/env python3
"""Runs rospy nodes as they are and with `rosslt run`, and prints what that gives and what it costs.

    ./run exec benchmarks/unmodified_nodes.py DIRECTORY [--nodes NODE...] [--seconds 10] [--arguments NODE ARGUMENTS]

Of each node: the rates of its topics and the CPU time that it takes, plain and tracked, with one subscriber; how many
numeric leaves its messages have (without stamps, sequence numbers and untracked zeros), and how many are tracked; and
how many of those that stand still could be forced to another value.

It starts a ROS master of its own, an action server of `move_base` that succeeds after a second, and publishes
`/turtle1/pose` as an Odometry does `/odom`, and goals. Nodes in folders below DIRECTORY are found as well. They are run
in a copy of it, in which messages are made of packages that are not installed (`MESSAGES` declares them).
"""

import argparse
import atexit
import math
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import actionlib
import genpy.generate_initpy
import genpy.generator
import rosgraph
import roslib.message
import rospkg
import rospy

import rosslt
from rosslt import node, values

TICKS = os.sysconf('SC_CLK_TCK')
WARM_UP = 2.0
MOST_FORCED = 12
OURS = ('/rosout', '/rosout_agg', '/clock')
GOAL_PERIOD = 5.0

#: The actions of packages of nodes that are given without them.
MESSAGES = {'diff_drive': {'GoToPose': 'geometry_msgs/PoseStamped pose\n---\nbool success\n---\n'}}


class Trial:
    """One node running, and what it sends.

    Args:
        command: that starts it.
        seconds: how long it is measured.
    """

    def __init__(self, command, seconds):
        self.before = set(_topics())
        self.subscribers, self.kinds = {}, {}
        self.last, self.previous, self.counts = {}, {}, {}
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        atexit.register(self.process.kill)  # if it was not stopped before
        _wait_until(lambda: self._subscribe() or self.process.poll() is not None, 15)
        time.sleep(WARM_UP)
        self._subscribe()
        start, cpu = time.monotonic(), _cpu(self.process.pid)
        self.counts = dict.fromkeys(self.counts, 0)
        end = start + seconds
        while time.monotonic() < end:
            time.sleep(0.2)
            self._subscribe()
        took = time.monotonic() - start
        self.cpu = (_cpu(self.process.pid) - cpu) * seconds / took
        self.rates = [count / took for _, count in sorted(self.counts.items())]
        self.ended = self.process.poll()

    def _subscribe(self):
        for topic, kind in _topics().items():
            if topic not in self.before and topic not in self.subscribers and '/rosslt/' not in topic:
                self.counts[topic] = 0
                self.kinds[topic] = kind
                # Who reads the messages would hold up a node that publishes without a queue.
                self.subscribers[topic] = rospy.Subscriber(topic, rospy.AnyMsg, self._count, topic)
        return self.subscribers

    def _count(self, _, topic):
        self.counts[topic] += 1

    def read(self):
        """Read the messages from now on, two of each topic at least, if they come."""
        for topic, kind in self.kinds.items():
            self.subscribers[topic].unregister()
            message_class = roslib.message.get_message_class(kind)
            if message_class:
                self.subscribers[topic] = rosslt.Subscriber(
                    topic, message_class, self._take, topic, keep_provenance=True
                )
        _wait_until(lambda: all(self.previous.get(topic) for topic in self.kinds), 5)

    def _take(self, message, topic):
        self.previous[topic], self.last[topic] = self.last.get(topic), message

    def leaves(self):
        """The numeric leaves of the last messages: [(topic, path, value, stands still), ...]."""
        found = []
        for topic, message in sorted(self.last.items()):
            before = dict(values.leaves(self.previous.get(topic) or message))
            for path, value in values.leaves(message):
                is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
                is_data = is_number and not path.endswith(('.secs', '.nsecs', '.seq'))
                if is_data and (value != 0 or values.is_tracked(value)):
                    found.append((topic, path, value, before.get(path) == value))
        return found

    def force(self, leaves):
        """Force leaves that stand still; returns (how many came, how many were tried)."""
        still = [leaf for leaf in leaves if values.is_tracked(leaf[2]) and leaf[3]]
        step = max(1, len(still) // MOST_FORCED)
        came = tried = 0
        for topic, path, value, _ in still[::step][:MOST_FORCED]:
            tried += 1
            plain = values.untracked(value)
            # Towards 0, as parts of quaternions and colors go no further than 1.
            target = plain + 1 if isinstance(value, int) else plain - math.copysign(0.25, plain) if plain else 0.25
            try:
                changed = node.force_value(value, target)
            except rosslt.Error as error:
                print(f'    {topic} {path}: {error}', file=sys.stderr)
                continue
            if _wait_until(lambda: abs(self._now(topic, path) - target) < 1e-5 * max(1, abs(target)), 3):  # noqa: B023
                came += 1
            else:
                print(f'    {topic} {path}: {target} did not come, but {self._now(topic, path)}', file=sys.stderr)
            for source, change in changed.items():
                _put_back(source, change)
        return came, tried

    def _now(self, topic, path):
        return dict(values.leaves(self.last[topic])).get(path, float('nan'))

    def stop(self):
        for subscriber in self.subscribers.values():
            subscriber.unregister()
        self.process.send_signal(signal.SIGINT)
        try:
            _, errors = self.process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            _, errors = self.process.communicate()
        return errors.decode('utf-8', 'replace')


def _put_back(source, change):
    present = values.track(change.new, source)
    try:
        node.force_value(present, change.old)
    except rosslt.Error as error:
        print(f'    {error}', file=sys.stderr)


def _topics():
    try:
        return {name: kind for name, kind in rosgraph.Master('/trial').getPublishedTopics('') if name not in OURS}
    except OSError:
        return {}


def _cpu(pid):
    try:
        fields = Path(f'/proc/{pid}/stat').read_text(encoding='ascii').rsplit(')', 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICKS


def _wait_until(holds, timeout):
    end = time.monotonic() + timeout
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def _serve_move_base():
    from move_base_msgs.msg import MoveBaseAction, MoveBaseResult

    def execute(_):
        time.sleep(1.0)
        server.set_succeeded(MoveBaseResult())

    server = actionlib.SimpleActionServer('move_base', MoveBaseAction, execute, auto_start=False)
    server.start()
    return server


def _publish_odometry():
    """A robot that drives, for nodes that wait for where they are: `/odom`, and `/turtle1/pose` where its type is."""
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Odometry

    publishers = [(rospy.Publisher('/odom', Odometry, queue_size=1), Odometry())]
    publishers[0][1].pose.pose.orientation.w = 1.0
    pose_class = roslib.message.get_message_class('turtlesim/Pose')
    if pose_class:
        publishers.append((rospy.Publisher('/turtle1/pose', pose_class, queue_size=1), pose_class(x=5.5, y=5.5)))

    def publish(_):
        for publisher, message in publishers:
            publisher.publish(message)

    goals = rospy.Publisher('/move_base_simple/goal', PoseStamped, queue_size=1)
    goal = PoseStamped()
    goal.header.frame_id = 'odom'
    goal.pose.position.x, goal.pose.position.y, goal.pose.orientation.w = 3.0, 2.0, 1.0
    return [
        rospy.Timer(rospy.Duration(0.1), publish),
        rospy.Timer(rospy.Duration(GOAL_PERIOD), lambda _: goals.publish(goal)),
    ]


def _nodes_in(directory):
    """The files of nodes: those in Python that call `init_node`."""
    for path in sorted(directory.rglob('*')):
        content = path.read_bytes() if path.is_file() else b''
        is_python = path.suffix == '.py' or content.split(b'\n')[0].endswith(b'python')
        if is_python and b'init_node(' in content:
            yield path.relative_to(directory)


def _with_messages(directory, folder):
    """A copy of nodes and their modules, with the packages of messages in it that `MESSAGES` declares."""
    copied = Path(shutil.copytree(directory, Path(folder) / 'nodes'))
    for package, actions in MESSAGES.items():
        for module in copied.rglob(package + '/__init__.py'):
            _make_messages(package, actions, module.parent / 'msg', Path(folder) / package)
    return copied


def _make_messages(package, actions, module, folder):
    paths = rospkg.RosPack()
    for name, definition in actions.items():
        folder.mkdir(exist_ok=True)
        file = folder / f'{name}.action'
        file.write_text(definition, encoding='utf-8')
        tool = Path(paths.get_path('actionlib_msgs')).parents[1] / 'lib/actionlib_msgs/genaction.py'
        subprocess.run([sys.executable, tool, '-o', folder, file], check=True, stdout=subprocess.DEVNULL)
    search = {package: [str(folder)]}
    search.update((name, [paths.get_path(name) + '/msg']) for name in ('actionlib_msgs', 'geometry_msgs', 'std_msgs'))
    genpy.generator.MsgGenerator().generate_messages(
        package, [str(one) for one in folder.glob('*.msg')], module, search
    )
    genpy.generate_initpy.write_modules(str(module))


def _figure(numbers):
    return ', '.join(f'{number:.1f}' for number in numbers) or '-'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('directory', type=Path)
    parser.add_argument('--nodes', nargs='+', default=[], help='files in it; by default all that end in .py')
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--arguments', nargs=2, action='append', default=[], metavar=('NODE', 'ARGUMENTS'))
    options = parser.parse_args()
    copies = tempfile.TemporaryDirectory()
    arguments = dict(options.arguments)
    with socket.socket() as free:
        free.bind(('localhost', 0))
        port = free.getsockname()[1]
    os.environ['ROS_MASTER_URI'] = f'http://localhost:{port}'
    os.environ['ROS_HOSTNAME'] = 'localhost'
    master = subprocess.Popen(
        ['rosmaster', '--core', '-p', str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_until(lambda: rosgraph.is_master_online(os.environ['ROS_MASTER_URI']), 15)
        rosslt.init_node('trial', argv=[], disable_signals=True)
        rospy.on_shutdown(master.kill)
        server = _serve_move_base()
        odometry = _publish_odometry()
        options.directory = _with_messages(options.directory, copies.name)
        names = options.nodes or sorted(map(str, _nodes_in(options.directory)))
        print('| node | rate plain | rate tracked | CPU plain | CPU tracked | leaves | tracked | forced |')
        print('|---|---|---|---|---|---|---|---|', flush=True)
        for name in names:
            given = shlex.split(arguments.get(name, ''))
            file = str(options.directory / name)
            plain = Trial([sys.executable, file, *given], options.seconds)
            plain.stop()
            tracked = Trial(['rosslt', 'run', file, *given], options.seconds)
            tracked.read()
            leaves = tracked.leaves()
            came, tried = tracked.force(leaves)
            count = sum(values.is_tracked(value) for _, _, value, _ in leaves)
            errors = tracked.stop()
            print(
                f'| {name} | {_figure(plain.rates)} | {_figure(tracked.rates)} | {plain.cpu:.2f} | {tracked.cpu:.2f} '
                f'| {len(leaves)} | {count} | {came} of {tried} |',
                flush=True,
            )
            if 'Traceback' in errors or 'rosslt:' in errors:
                print(errors, file=sys.stderr)
        del server, odometry
    finally:
        # The action server's thread runs until then, and the program does not end before.
        rospy.signal_shutdown('all nodes are measured')
        master.kill()
        copies.cleanup()


if __name__ == '__main__':
    main()
