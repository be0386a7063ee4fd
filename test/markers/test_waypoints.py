"""Solving for a thing at several waypoints, without a change of any."""

from types import SimpleNamespace

import pytest

from rosslt import node, values
from rosslt.markers.drags.waypoints import solve_waypoints

X, Y = (values.Source('/patrol', number) for number in (1, 2))


def solved(monkeypatch, *places, maximum=None):
    """The values of X and Y that bring a thing at (1, 2) to places, half of X being its x."""
    limits = {'bounds': {X: (None, maximum)}, 'read_only': []}
    directory = SimpleNamespace(held=lambda thing, shared: [])
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {**limits, 'bounds': dict(limits['bounds'])})
    monkeypatch.setattr(node, 'directory', lambda: directory)
    tracked = [0.5 * values.track(2.0, X), values.track(2.0, Y)]
    handle = SimpleNamespace(
        basis=None,
        tracked=tracked,
        limits=(),
        turn=lambda pose, near=None: 0.0,
        wanted=lambda pose, moved, turned: (tracked, list(pose[:2])),
        limited=lambda targets, turn: (targets, ''),
    )
    poses = [(x, y, 0.0, 0.0, 0.0, 0.0, 1.0) for x, y in ((1.0, 2.0), *places)]
    return solve_waypoints(handle, poses, [], 0.001, 1.0, str)


def test_each_waypoint_has_round_values_of_all_that_change(monkeypatch):
    assert solved(monkeypatch, (1.50012, 2.0), (1.0, 2.0), (0.25, 3.0)) == [
        {X: 3.0, Y: 2.0},
        {X: 2.0, Y: 2.0},
        {X: 0.5, Y: 3.0},
    ]
    assert solved(monkeypatch, (1.5, 2.0)) == [{X: 3.0}]


def test_a_waypoint_beyond_a_bound_is_refused(monkeypatch):
    with pytest.raises(values.NotInvertible, match=r'waypoint 2 cannot be reached: .* is at its maximum 4'):
        solved(monkeypatch, (1.5, 2.0), (2.5, 2.0), maximum=4.0)
