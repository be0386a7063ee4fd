"""What tests of learned nodes share."""

import pytest

from support import opaque_nodes


@pytest.fixture(scope='module', autouse=True)
def kept_apart(tmp_path_factory):
    """What is learned is kept in a folder of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_HOME', str(tmp_path_factory.mktemp('ros_home')))
        yield


@pytest.fixture(scope='session')
def program(tmp_path_factory):
    """The program of `nodes.cpp`."""
    return opaque_nodes.built(tmp_path_factory.mktemp('opaque'))
