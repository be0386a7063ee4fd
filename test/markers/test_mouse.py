"""Where a mouse wants a thing."""

import math

import pytest

from rosslt.markers.drags import mouse
from rosslt.markers.geometry import IDENTITY, are_same_rotation

ABOVE = (0.0, 0.0, 10.0)
QUARTER = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))


def near(found, expected):
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_body_in_the_plane_goes_where_the_line_of_sight_meets_it():
    near(mouse.dragged((0.0, 0.0, 1.0), ABOVE, (3.0, 0.0, 9.0), (0, 1), IDENTITY), (27.0, 0.0, 0.0))
    near(mouse.dragged((0.0, 0.0, 0.0), ABOVE, (1.0, 2.0, 0.0), (0, 1), IDENTITY), (1.0, 2.0, 0.0))


def test_a_body_on_an_axis_goes_to_the_point_nearest_the_line_of_sight():
    near(mouse.dragged((0.0, 0.0, 0.0), ABOVE, (1.0, 0.0, 0.0), (0,), IDENTITY), (1.0, 0.0, 0.0))
    near(mouse.dragged((0.0, 0.0, 0.0), (0.0, 3.0, 10.0), (5.0, 2.0, 0.0), (0,), QUARTER), (0.0, 2.2, 0.0))


def test_a_free_body_goes_where_the_pointer_is():
    near(mouse.dragged((1.0, 1.0, 1.0), ABOVE, (1.0, 2.0, 3.0), (0, 1, 2), IDENTITY), (0.0, 1.0, 2.0))


@pytest.mark.parametrize(
    ('eye', 'pointer', 'axes'),
    [
        (ABOVE, (0.0, 0.0, 5.0), (2,)),  # the axis points at the eye
        ((5.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0, 1)),  # the plane is seen edge on
        (ABOVE, (0.0, 3.0, 20.0), (0, 1)),  # the plane is behind the eye
        (ABOVE, ABOVE, (0,)),
        (ABOVE, (0.0, 0.0, 0.0), ()),
    ],
)
def test_a_mouse_that_does_not_say_where_moves_nothing(eye, pointer, axes):
    assert mouse.dragged((0.0, 0.0, 0.0), eye, pointer, axes, IDENTITY) is None


def test_a_thing_turns_as_far_as_the_ring_beside_it():
    found = mouse.turned_by(QUARTER, (0.0, 0.0, 1.0, 0.0), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    assert are_same_rotation(found, (0.5, 0.5, 0.5, 0.5))


def test_a_point_of_the_world_is_seen_from_a_frame():
    near(mouse.into((1.0, 0.0, 0.0, *QUARTER), (1.0, 2.0, 0.0)), (2.0, 0.0, 0.0))
