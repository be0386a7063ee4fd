"""Small linear systems: the steps of `solving`. With NumPy for the larger ones, where there is NumPy."""

import math
from typing import List

LARGE = 12
"""Systems from this size on are worth the way to NumPy."""


def solved(matrix: List[List[float]], right: List[float]) -> List[float]:
    """The solution of a symmetric, positive definite system.

    Raises:
        ArithmeticError: there is none that is safe to use.
    """
    size = len(right)
    if size >= LARGE:
        try:
            import numpy

            return numpy.linalg.solve(numpy.array(matrix, float), numpy.array(right, float)).tolist()
        except ImportError:
            pass
        except numpy.linalg.LinAlgError as error:
            raise ArithmeticError(str(error)) from None
    rows = [row + [value] for row, value in zip(matrix, right)]
    for pivot in range(size):
        best = max(range(pivot, size), key=lambda place: abs(rows[place][pivot]))
        rows[pivot], rows[best] = rows[best], rows[pivot]
        head = rows[pivot]
        for row in rows[pivot + 1 :]:
            factor = row[pivot] / head[pivot]
            for place in range(pivot, size + 1):
                row[place] -= factor * head[place]
    result = [0.0] * size
    for pivot in range(size - 1, -1, -1):
        row = rows[pivot]
        known = sum(row[place] * result[place] for place in range(pivot + 1, size))
        result[pivot] = (row[size] - known) / row[pivot]
    return result


def least_norm(jacobian: List[List[float]], missing: List[float], damping: float) -> List[float]:
    """The shortest step that adds what is missing, `jacobian @ step = missing`, damped (Levenberg-Marquardt).

    Args:
        jacobian: a row for each result, a column for each unknown.
        missing: by how much each result should rise.
        damping: at least 0, in relation to rows of length 1.

    Raises:
        ArithmeticError: singular; more damping helps.
    """
    lengths = [math.hypot(*row) or 1.0 for row in jacobian]
    rows = [[part / length for part in row] for row, length in zip(jacobian, lengths)]
    right = [value / length for value, length in zip(missing, lengths)]
    columns = list(zip(*rows))
    if len(rows) <= len(columns):
        weights = solved(_products(rows, damping), right)
        return [sum(part * weight for part, weight in zip(column, weights)) for column in columns]
    return solved(
        _products(columns, damping), [sum(part * value for part, value in zip(column, right)) for column in columns]
    )


def _products(vectors: List, damping: float) -> List[List[float]]:
    """The inner products of the vectors with each other, with the damping added to their squares."""
    result = [[sum(x * y for x, y in zip(one, other)) for other in vectors] for one in vectors]
    for place, row in enumerate(result):
        row[place] += damping
    return result
