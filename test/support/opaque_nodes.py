"""Nodes that nobody tracks, as C++ nodes are."""

import contextlib
import subprocess
from pathlib import Path

import rosgraph

from support.processes import forget_plain_node, wait_until

CODE = Path(__file__).parent.with_name('models') / 'nodes.cpp'
STATE_PUBLISHER = '/usr/lib/robot_state_publisher/robot_state_publisher'
ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint></robot>"""


def built(folder):
    """The path of the program of `nodes.cpp`, built in a folder."""
    made = folder / 'opaque'
    packages = ('roscpp', 'std_msgs', 'geometry_msgs')
    flags = subprocess.run(
        ['pkg-config', '--cflags', '--libs', *packages], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.split()
    subprocess.run(['g++', '-o', str(made), str(CODE), *flags], check=True)
    return str(made)


@contextlib.contextmanager
def running(name, *command):
    """Run a command as a node, until the end of the block."""
    process = subprocess.Popen(command)
    master = rosgraph.Master('/test')

    def is_there():
        return any(f'{name}/get_loggers' == service for service, _ in master.getSystemState()[2])

    try:
        wait_until(is_there, f'{name} runs')
        address = master.lookupNode(name)
        yield
    finally:
        process.kill()
        process.wait()
    forget_plain_node(name, address)
