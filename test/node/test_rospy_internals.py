"""Private parts of rospy are used in one module, still exist, and are imported only where they are needed."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
import rospy.impl.tcpros_base
import rospy.impl.tcpros_pubsub
import rospy.topics
from std_msgs.msg import String

from rosslt.node import rospy_internals

ROOM = Path(__file__).resolve().parents[2] / 'src' / 'rosslt'
INTERNALS = ROOM / 'node' / 'rospy_internals.py'

#: Modules of rospy that are no public interface.
HIDDEN = ('rospy.impl', 'rospy.core', 'rospy.msg', 'rospy.tcpros', 'rospy.client', 'rospy.topics')


def dotted(node):
    """`a.b.c` for the syntax tree of it, '' for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    return f'{dotted(node.value)}.{node.attr}' if isinstance(node, ast.Attribute) else ''


def used():
    """The full name of each thing that the module takes from rospy's inside."""
    for statement in ast.parse(INTERNALS.read_text(encoding='utf-8')).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Attribute):
            name = dotted(statement.value)
            if name.startswith('rospy.'):
                yield name


@pytest.mark.parametrize('name', used())
def test_what_is_used_of_rospys_inside_is_there(name):
    found = rospy
    for part in name.split('.')[1:]:
        assert hasattr(found, part), f'there is no {name} any more; rosslt/node/rospy_internals.py says what for'
        found = getattr(found, part)


@pytest.mark.parametrize('kind', ['publisher', 'subscriber'])
def test_what_is_used_of_a_publisher_and_a_subscriber_is_there(kind):
    made = {'publisher': rospy.topics._PublisherImpl, 'subscriber': rospy.topics._SubscriberImpl}[kind](
        '/topic', String
    )
    gone = [name for name in rospy_internals.USED_OF_IMPLEMENTATIONS[kind] if not hasattr(made, name)]
    assert not gone, f'the implementation of a {kind} has no {gone} any more; rosslt/node/topics/topics.py needs it'


def test_what_is_used_of_a_timer_is_there():
    text = inspect.getsource(rospy_internals.run_timer)
    assert all(f'self.{name}(' in text for name in rospy_internals.USED_OF_TIMERS)


def test_what_is_used_of_a_connection_is_there():
    protocol = rospy.impl.tcpros_pubsub.TCPROSSub('/topic', String)
    made = rospy.impl.tcpros_base.TCPROSTransport(protocol, '/topic')
    gone = [name for name in rospy_internals.USED_OF_CONNECTIONS if not hasattr(made, name)]
    gone += [name for name in rospy_internals.USED_OF_PROTOCOLS if not hasattr(protocol, name)]
    assert not gone, f'a connection of rospy has no {gone} any more; rosslt/node/rospy_internals.py needs it'


def test_nothing_else_reaches_into_rospy():
    assert len(list(used())) >= 7
    faults = []
    for path in ROOM.rglob('*.py'):
        if path == INTERNALS:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            names = [node.module or ''] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.Attribute):
                names.append(dotted(node))
                if node.attr == 'impl' and path.name != 'topics.py':
                    names.append('rospy.impl')
            faults += [f'{path}:{node.lineno}: {name}' for name in names if name.startswith(HIDDEN)]
    assert not faults, '\n'.join(faults)


def test_a_node_loads_nothing_of_the_command_line():
    program = 'import sys, rosslt.node; print({"argparse", "rosslt.cli"} & set(sys.modules))'
    result = subprocess.run([sys.executable, '-c', program], stdout=subprocess.PIPE, encoding='utf-8', check=True)
    assert result.stdout.strip() == 'set()'
