"""Tracked leaves are found and replaced by their indices."""

import pytest
from geometry_msgs.msg import Point, Pose
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker

from rosslt import Source, is_tracked, track, untracked
from rosslt.messages import set_leaves, tracked_fields
from support.filling import Filling

X = track(0.25, Source('/node', 1))


def test_leaves_have_the_indices_of_the_flattened_fields():
    assert tracked_fields(Pose(position=Point(1.0, X, 0.0))) == [(1, 0.25, 'd')]
    assert tracked_fields(Pose()) == []


@pytest.mark.parametrize('cls', [Pose, Marker, JointState, JointTrajectory], ids=lambda cls: cls._type)
def test_leaves_are_replaced(cls):
    message = Filling(3).message(cls)
    plain = untracked(message)
    found = tracked_fields(message)
    set_leaves(message, {index: untracked(value) for index, value, _ in found})
    assert message == plain
    assert not is_tracked(message)
    set_leaves(message, {index: value for index, value, _ in found})
    assert tracked_fields(message) == found
