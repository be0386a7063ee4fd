"""Tracked leaves are found by their indices, and replaced in a copy that shares nothing with the message."""

import pytest
from geometry_msgs.msg import Point, Pose
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker

from rosslt import Source, is_tracked, track, untracked
from rosslt.messages import tracked_fields, with_leaves
from support.filling import Filling

X = track(0.25, Source('/node', 1))


def test_leaves_have_the_indices_of_the_flattened_fields():
    assert tracked_fields(Pose(position=Point(1.0, X, 0.0))) == [(1, 0.25, 'd')]
    assert tracked_fields(Pose()) == []


@pytest.mark.parametrize('cls', [Pose, Marker, JointState, JointTrajectory], ids=lambda cls: cls._type)
def test_leaves_are_replaced_in_a_copy(cls):
    message = Filling(3).message(cls)
    before = untracked(message)
    found = tracked_fields(message)
    plain = with_leaves(message, {index: untracked(value) for index, value, _ in found})
    assert plain == before
    assert not is_tracked(plain)
    assert [index for index, *_ in tracked_fields(message)] == [index for index, *_ in found]
    copy = with_leaves(message, {})
    assert tracked_fields(copy) == found
    for path in ('points', 'position', 'name', 'pose', 'header'):
        if isinstance(getattr(message, path, None), (list, Point, Pose)):
            assert getattr(copy, path) is not getattr(message, path)
