"""Masters that this process, and all that it starts, reach."""

import contextlib

import pytest

from support.processes import Master

#: {folder: address of the master that its tests share}. A folder reaches its own again after tests of another folder.
shared = {}


@contextlib.contextmanager
def reached_master(log_directory, folder=None):
    """A master of its own, in force as long as the context lasts.

    Args:
        log_directory: where nodes put their logs.
        folder: of the tests that share it, None for a single test.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_LOG_DIR', str(log_directory))
        patch.setenv('ROS_HOSTNAME', 'localhost')
        started = Master()
        patch.setenv('ROS_MASTER_URI', started.uri)
        if folder is not None:
            patch.setitem(shared, folder, started.uri)
        try:
            yield started
        finally:
            started.kill()
