"""`rosslt run` says where a node runs that has the name already, before ROS ends that one."""

import os
import signal

import pytest

from rosslt import node
from support.processes import Node
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

WAITING = """import rospy
rospy.init_node('waiting')
rospy.spin()
"""


def test_where_a_node_of_that_name_runs_is_said(master, tmp_path):
    with Unmodified(tmp_path, 'waiting', WAITING, tracked=False) as first:
        pid, file = first.process.pid, first.file
        with Unmodified(tmp_path, 'other', WAITING, '__name:=other') as other:
            assert other.stop(signal.SIGKILL)[2] == ''
        with Unmodified(tmp_path, 'waiting', WAITING) as second:
            assert 'new node registered with same name' in ''.join(first.end()[1:])
            _, _, errors = second.stop(signal.SIGKILL)
    assert errors.startswith(f'rosslt run: /waiting runs already, in process {pid} (`')
    assert f'{file}` in {os.path.realpath(tmp_path)}): ROS ends that one,' in errors
    assert errors.count('runs already') == 1


def test_a_node_that_was_killed_runs_no_more(master, tmp_path):
    with Unmodified(tmp_path, 'waiting', WAITING) as first:
        first.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'waiting', WAITING) as second:
            assert second.stop(signal.SIGKILL)[2] == ''


def test_a_process_that_does_not_listen_there_is_not_taken_for_the_node(master, monkeypatch):
    """As of a container, which has the addresses of this machine and process numbers of its own."""
    monkeypatch.setattr('rosslt.node.namesake._listens', lambda pid, port: False)
    with Node('contained', 'rospy.spin()') as contained:
        assert node.where_it_runs('/contained') == f'process {contained.process.pid} on localhost'
    assert node.where_it_runs('/contained') is None
