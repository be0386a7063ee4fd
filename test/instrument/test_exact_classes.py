"""What Python asks an object for as a number of an exact class is one of that class, as without provenance."""

import math
import operator
import warnings

import pytest

from rosslt import values
from support.programs import run_rewritten

LEVEL = """
gain = 2.5

class Level:
    def __init__(self, level=1.5):
        self.level, self.place = level, 2

    def __float__(self):
        def twice(x):
            return x * 2

        return twice(self.level) if self.level else 0.0

    def __index__(self):
        return self.place

    def __int__(self):
        if self.place:
            return 7
        return -1

    def __complex__(self):
        return self.level + 1j

    def height(self):
        return self.level * gain

level = Level()
"""


@pytest.mark.parametrize(
    ('ask', 'expected'),
    [
        (float, 3.0),
        (math.sin, math.sin(3.0)),
        (int, 7),
        (operator.index, 2),
        ([1, 2, 3].__getitem__, 3),
        (hex, '0x2'),
        (complex, 1.5 + 1j),
    ],
)
def test_an_object_that_is_a_number_gives_one_of_the_class_that_is_asked_for(ask, expected):
    level = run_rewritten(LEVEL)['level']
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert ask(level) == expected


def test_other_methods_give_numbers_with_their_provenance():
    level = run_rewritten(LEVEL)['level']
    assert values.is_tracked(level.height())
    assert values.is_tracked(level.level)
