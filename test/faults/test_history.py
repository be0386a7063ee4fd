"""Owners, clients and the master are killed, stopped and started again: no change that was acknowledged is lost."""

import pytest

from support import history_harness

pytestmark = [pytest.mark.rostest, pytest.mark.slow]


@pytest.fixture(autouse=True)
def environment(monkeypatch, tmp_path):
    """What the harness sets for its nodes is set back."""
    for name in ('ROS_MASTER_URI', 'ROS_HOSTNAME', 'ROS_LOG_DIR'):
        monkeypatch.setenv(name, str(tmp_path))


def test_no_acknowledged_change_is_lost_or_applied_twice_or_elsewhere_whatever_dies():
    result = history_harness.run(clients=4, owners=2, count=1200, pause=0.3, seed=3)
    assert result.faults == []
    assert result.twins == []
    assert result.operations['write ok'] > 20, result
    assert result.operations['read ok'] > 20, result
    assert result.injected.keys() == set(history_harness.FAILURES), result


def test_the_same_harness_finds_that_plain_parameters_lose_changes():
    result = history_harness.run('rosparam set', clients=4, owners=2, count=300, pause=0.3, seed=3)
    assert result.faults, result
