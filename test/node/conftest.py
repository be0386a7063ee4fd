"""A ROS master for each test that asks for one: tests that a rostest suite, with its one master, cannot hold."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from processes import Master


@pytest.fixture
def master(monkeypatch, tmp_path):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    monkeypatch.setenv('ROS_HOSTNAME', 'localhost')
    started = Master()
    monkeypatch.setenv('ROS_MASTER_URI', started.uri)
    yield started
    started.kill()
