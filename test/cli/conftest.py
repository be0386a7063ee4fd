"""A master and nodes for the tests beside this file, which end with the last of them."""

from pathlib import Path

import pytest
import rosgraph

from support.masters import reached_master
from support.processes import Node, wait_until
from support.shell import rosslt

TALKER = """
    held = []
    publisher = rosslt.Publisher('gate', PoseStamped, queue_size=10)
    rospy.set_param('~parking', [0.0, -1.0])
    rospy.set_param('/height', 0.75)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        gate = PoseStamped()
        gate.header.frame_id = rosslt.location('world', name='frame')
        radius = rosslt.location(2.0, name='radius', minimum=0.5, maximum=10.0)
        gate.pose.position.x = 3 * radius + 1
        gate.pose.position.y = radius + rosslt.get_param('~parking')[0]
        gate.pose.position.z = rosslt.get_param('/height')
        gate.pose.orientation.w = rosslt.location(1.0, name='fixed', read_only=True)
        rosslt.location(3, name='count')
        rosslt.location(True, name='is/on')
        rosslt.location(getter=lambda: float(len(held)), setter=lambda value: held.append(value), name='pin')
        publisher.publish(gate)
        rate.sleep()
    """

RELAY = """
    publisher = rosslt.Publisher('pose', PoseTracked, queue_size=10)
    rosslt.Subscriber('gate', PoseStamped, lambda gate: publisher.publish(position=gate.pose.position))
    rospy.spin()
    """


@pytest.fixture(scope='package')
def master(tmp_path_factory):
    """A master for all tests of the command."""
    with reached_master(tmp_path_factory.mktemp('log'), Path(__file__).parent):
        yield rosgraph.Master('/test')


@pytest.fixture(scope='package')
def nodes(master):
    """The node /talker, which owns locations of all kinds, and /relay, which sends on what it hears."""
    with Node('talker', TALKER) as talker, Node('relay', RELAY):
        wait_until(lambda: len(rosslt('list', '/talker').stdout.splitlines()) == 9, 'all locations are there')
        yield talker
