"""Which numbers of an expression are angles."""

import math as plain_math

import pytest

from rosslt import math, values

ANGLE, OTHER = values.Source('/camera', 1), values.Source('/camera', 2)


def number(source=ANGLE, value=30):
    return values.track(value, source)


@pytest.mark.parametrize(
    'compute',
    [
        math.radians,
        lambda x: x * plain_math.pi / 180.0,
        lambda x: (0 + x) * (plain_math.pi / 180.0),
        lambda x: math.radians(-x) + 0.5,
        lambda x: math.sin(math.radians(x) / 2),
        lambda x: 0.5 * math.cos(x * plain_math.pi / 360) - 0.0 * math.sin(x),
        lambda x: math.radians(x) * number(OTHER, 0.5),
    ],
)
def test_what_is_turned_by_is_an_angle(compute):
    assert values.sources_of_angles([1.0, compute(number())]) == [ANGLE]


@pytest.mark.parametrize(
    'compute',
    [
        lambda x: x * 0.5,
        lambda x: (x - 1) * 0.5,
        lambda x: 2 * plain_math.pi / x,
        lambda x: math.sin(2 * plain_math.pi * 3 / x),
        lambda x: math.cos(x % 4),
        lambda x: math.sin(x * number(OTHER, 0.5)),
        lambda x: math.radians(360 / x),
    ],
)
def test_a_count_is_no_angle(compute):
    assert values.sources_of_angles([compute(number())]) == []
