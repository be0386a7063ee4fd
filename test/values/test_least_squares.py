"""The linear steps of solving, against what NumPy makes of the same systems."""

import math
import random
import sys

import numpy
import pytest

from rosslt.values.elimination import solved
from rosslt.values.solve.least_squares import LARGE, shortest_step


def as_rows(matrix):
    return [{place: float(part) for place, part in enumerate(row) if part} for row in matrix]


def random_matrix(rows, columns, seed, part=1.0):
    chance = random.Random(seed)
    return numpy.array(
        [[chance.uniform(-1, 1) if chance.random() < part else 0.0 for _ in range(columns)] for _ in range(rows)]
    )


@pytest.mark.parametrize('size', [1, 2, 3, LARGE, 20])
def test_a_linear_system_is_solved(size):
    matrix = random_matrix(size, size, size) + 2 * numpy.eye(size)
    right = numpy.arange(1.0, size + 1)[:, None]
    assert numpy.array(solved(matrix.tolist(), right.tolist())) == pytest.approx(numpy.linalg.solve(matrix, right))


def test_a_system_whose_first_pivot_is_0_is_solved():
    assert solved([[0.0, 2.0], [3.0, 0.0]], [[4.0], [9.0]]) == [[3.0], [2.0]]


def test_a_singular_system_is_refused():
    with pytest.raises(ArithmeticError):
        solved([[1.0, 2.0], [2.0, 4.0]], [[1.0], [1.0]])
    with pytest.raises(ArithmeticError):
        shortest_step([{0: 1.0}, {0: 2.0}] * LARGE, [1.0] * 2 * LARGE, [1.0] * 2, 0.0) and solved([[0.0]], [[1.0]])


@pytest.mark.parametrize(('rows', 'columns'), [(1, 3), (2, 2), (3, 6), (LARGE, 2 * LARGE), (30, 40)])
def test_the_step_is_the_shortest_that_adds_what_is_missing(rows, columns):
    matrix = random_matrix(rows, columns, rows)
    missing = [math.sin(place) for place in range(rows)]
    expected = numpy.linalg.lstsq(matrix, numpy.array(missing), rcond=None)[0]
    assert shortest_step(as_rows(matrix), missing, [1.0] * columns) == pytest.approx(expected.tolist(), rel=1e-6)


@pytest.mark.parametrize(('rows', 'columns'), [(6, 2), (30, 3), (40, 2 * LARGE)])
def test_with_more_results_than_unknowns_the_squares_are_least(rows, columns):
    matrix = random_matrix(rows, columns, rows)
    missing = [math.sin(place) for place in range(rows)]
    expected = numpy.linalg.lstsq(matrix, numpy.array(missing), rcond=None)[0]
    step = shortest_step(as_rows(matrix), missing, [1.0] * columns, by_row=False)
    assert step == pytest.approx(expected.tolist(), rel=1e-6)


def test_what_moves_easily_moves_more():
    assert shortest_step([{0: 1.0, 1: 1.0}], [3.0], [1.0, 1.0]) == pytest.approx([1.5, 1.5])
    assert shortest_step([{0: 1.0, 1: 1.0}], [5.0], [1.0, 2.0]) == pytest.approx([1.0, 4.0])


def test_damping_makes_the_step_shorter_and_a_singular_system_solvable():
    rows = [{0: 1.0, 1: 1.0}, {0: 2.0, 1: 2.0}]
    lengths = [math.hypot(*shortest_step(rows, [1.0, 2.0], [1.0, 1.0], damping)) for damping in (1e-9, 0.1, 10.0)]
    assert lengths[0] == pytest.approx(math.sqrt(0.5), rel=1e-6)
    assert lengths[0] > lengths[1] > lengths[2] > 0


def test_an_unknown_without_a_slope_stays():
    assert shortest_step([{1: 2.0}], [4.0], [1.0, 1.0, 1.0]) == [0.0, 2.0, 0.0]
    assert shortest_step([{}], [4.0], [1.0, 1.0]) == [0.0, 0.0]


@pytest.mark.parametrize('size', [1e-300, 1e-160, 1e160, 1e300])
def test_steps_are_right_at_any_size(size):
    assert shortest_step([{0: 2.0 * size}], [4.0 * size], [1.0]) == pytest.approx([2.0])


def test_without_numpy_steps_are_made_in_plain_python(monkeypatch):
    monkeypatch.setitem(sys.modules, 'numpy', None)
    size = 2 * LARGE
    matrix = [[4.0 if row == column else 0.1 for column in range(size)] for row in range(size)]
    step = shortest_step(as_rows(matrix), [1.0] * size, [1.0] * size)
    assert step == pytest.approx([1.0 / (4.0 + 0.1 * (size - 1))] * size)
