"""Gaussian elimination with pivots, of plain and of tracked numbers.

Pivots are chosen by their present values, so an expression follows the same elimination when its sources change.
"""

from typing import List, Sequence

from .annotations import Value


def is_plain_zero(x: Value) -> bool:
    """Return True for a plain 0, False for a tracked 0, which may change."""
    return type(x) in (float, int) and x == 0


def eliminate(rows: List[List[Value]]) -> Value:
    """Bring the square matrix at the left of some rows to a triangle of which the lower left is not used any more.

    Args:
        rows: as many as the matrix is wide, each with the right sides behind it; they are changed.

    Returns:
        The determinant of the matrix. Where it is 0, the rows are left as they were met.
    """
    determinant: Value = None
    for column in range(len(rows)):
        pivot = max(range(column, len(rows)), key=lambda at: abs(float(rows[at][column])))
        head = rows[pivot]
        rows[column], rows[pivot] = head, rows[column]
        factor = head[column] if pivot == column else -head[column]
        determinant = factor if determinant is None else determinant * factor
        if head[column] == 0:
            break
        filled = [at for at in range(column + 1, len(head)) if not is_plain_zero(head[at])]
        for row in rows[column + 1 :]:
            if not is_plain_zero(row[column]):
                factor = row[column] / head[column]
                for at in filled:
                    row[at] = row[at] - factor * head[at]
    return 1.0 if determinant is None else determinant


def solved(matrix: Sequence[Sequence[Value]], right: Sequence[Sequence[Value]]) -> List[List[Value]]:
    """The rows of `matrix^-1 right`.

    Args:
        matrix: square.
        right: as many rows.

    Raises:
        ZeroDivisionError: there is no single solution.
    """
    size = len(matrix)
    rows = [[*row, *others] for row, others in zip(matrix, right)]
    eliminate(rows)
    if any(row[at] == 0 for at, row in enumerate(rows)):
        raise ZeroDivisionError('Singular matrix')
    results: List[List[Value]] = [[]] * size
    for at in range(size - 1, -1, -1):
        row = rows[at]
        result = row[size:]
        for factor, known in zip(row[at + 1 : size], results[at + 1 :]):
            if not is_plain_zero(factor):
                result = [part - factor * other for part, other in zip(result, known)]
        results[at] = [part if is_plain_zero(part) else part / row[at] for part in result]
    return results
