"""The time of ROS stands still, as in a simulation that is paused: the last change is the last one all the same."""

import contextlib

import pytest
import rosgraph

from support.processes import Node, wait_until
from support.shell import lines

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

OWNER = """
    kept = rosslt.location(1.0, name='x'), rosslt.location(1.0, name='y')
    rospy.spin()
    """


@pytest.fixture
def owners(master):
    """Two nodes in a time that never begins."""
    rosgraph.Master('/test').setParam('/use_sim_time', True)
    with contextlib.ExitStack() as stack:
        for name in ('first', 'second'):
            stack.enter_context(Node(name, OWNER))
        wait_until(lambda: len(lines('list', '/first') + lines('list', '/second')) == 4, 'all locations are there')
        yield


def test_undo_takes_back_the_last_change_first(owners):
    changes = [('/first/x', '2'), ('/second/x', '3'), ('/first/y', '4'), ('/second/y', '5'), ('/first/x', '6')]
    for name, value in changes:
        lines('set', name, value)
    assert [line[0] for line in lines('undo', '/second')] == ['/second/y']
    undone = [line[0] for _ in changes[1:] for line in lines('undo')]
    assert undone == ['/first/x', '/first/y', '/second/x', '/first/x']
