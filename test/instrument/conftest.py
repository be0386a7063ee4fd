"""A master for the tests beside this file."""

import pytest
import rospy

import rosslt
from support.processes import Master


@pytest.fixture(scope='session')
def master(tmp_path_factory):
    """A master for all tests of nodes; this process is a node of it, /test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('log')))
        patch.setenv('ROS_HOSTNAME', 'localhost')
        started = Master()
        patch.setenv('ROS_MASTER_URI', started.uri)
        rosslt.init_node('test', argv=[], disable_signals=True)
        yield started
        rospy.signal_shutdown('the tests are over')
        started.kill()
