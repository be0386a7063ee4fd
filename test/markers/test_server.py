"""The interactive marker server ends quietly with its node."""

import pytest

from support.processes import Node

ENDING = """
    from rosslt.markers.rviz.server import Server

    server = Server('handles')
    server.keepAlive(None)
    rospy.signal_shutdown('the test ends it')
    server.keepAlive(None)
    print('quiet', flush=True)
    """


@pytest.mark.rostest
def test_a_timer_that_finds_the_topic_closed_raises_nothing(master):
    with Node('ending', ENDING, wait_for=None) as node:
        assert node.read_line() == 'quiet', node.logged()
