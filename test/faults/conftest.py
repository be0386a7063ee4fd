"""A ROS master for each test that asks for one: tests that a rostest suite, with its one master, cannot hold."""

import pytest

from support.processes import Master


@pytest.fixture
def master(monkeypatch, tmp_path):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    monkeypatch.setenv('ROS_HOSTNAME', 'localhost')
    started = Master()
    monkeypatch.setenv('ROS_MASTER_URI', started.uri)
    yield started
    started.kill()
