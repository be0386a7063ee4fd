"""Gaussian elimination with pivots."""

from typing import List, Sequence

from .annotations import Value


def eliminate(rows: List[List[Value]]) -> None:
    """Bring the square matrix at the left of some rows to a triangle of which the lower left is not used any more.

    Args:
        rows: as many as the matrix is wide, each with the right sides behind it; they are changed. If the matrix is
            singular, they are left as they were met.
    """
    for column in range(len(rows)):
        pivot = max(range(column, len(rows)), key=lambda at: abs(float(rows[at][column])))
        head = rows[pivot]
        rows[column], rows[pivot] = head, rows[column]
        if head[column] == 0:
            break
        filled = [at for at in range(column + 1, len(head)) if head[at]]
        for row in rows[column + 1 :]:
            if row[column]:
                factor = row[column] / head[column]
                for at in filled:
                    row[at] = row[at] - factor * head[at]


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
            if factor:
                result = [part - factor * other for part, other in zip(result, known)]
        results[at] = [part / row[at] if part else part for part in result]
    return results
