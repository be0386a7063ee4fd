"""Masters that this process, and all that it starts, reach."""

import contextlib

import pytest

from support.processes import Master


@contextlib.contextmanager
def reached_master(log_directory):
    """A master of its own, in force as long as the context lasts.

    Args:
        log_directory: where nodes put their logs.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_LOG_DIR', str(log_directory))
        patch.setenv('ROS_HOSTNAME', 'localhost')
        started = Master()
        patch.setenv('ROS_MASTER_URI', started.uri)
        try:
            yield started
        finally:
            started.kill()
