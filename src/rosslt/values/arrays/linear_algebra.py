"""Linear algebra on arrays that hold tracked values, by elimination: every step is an operation of the table.

Of arrays with more than two dimensions, the last two are the matrices, as in `numpy.linalg`. Pivots are chosen by
their present values, so an expression follows the same elimination when its sources change.
"""

from typing import Any, List, Tuple

import numpy as np

from .tracked_array import plain_array, replaces, unwrapped


def objects(x: Any) -> Any:
    """An array or nested list as an ordinary object array."""
    from_list = x if isinstance(x, np.ndarray) else np.array(x, dtype=object)
    return unwrapped(from_list).astype(object)


def eliminated(matrix: Any, right: Any) -> Tuple[List[List[Any]], List[List[Any]], Any]:
    """A square matrix brought to the identity, with a right side beside it.

    Returns:
        The rows of the matrix and of the right side, and the determinant.

    Raises:
        numpy.linalg.LinAlgError: the matrix is singular or not square.
    """
    rows, others = [list(row) for row in matrix], [list(row) for row in right]
    size, sign = len(rows), 1
    if any(len(row) != size for row in rows):
        raise np.linalg.LinAlgError('Last 2 dimensions of the array must be square')
    determinant: Any = None
    for column in range(size):
        pivot = max(range(column, size), key=lambda row: abs(float(rows[row][column])))
        if pivot != column:
            rows[pivot], rows[column] = rows[column], rows[pivot]
            others[pivot], others[column] = others[column], others[pivot]
            sign = -sign
        head = rows[column][column]
        determinant = head if determinant is None else determinant * head
        if head == 0:
            return rows, others, determinant
        rows[column] = divided(rows[column], head)
        others[column] = divided(others[column], head)
        for row in range(size):
            factor = rows[row][column]
            if row != column and not is_plain_zero(factor):
                rows[row] = reduced(rows[row], factor, rows[column])
                others[row] = reduced(others[row], factor, others[column])
    determinant = 1.0 if determinant is None else determinant
    return rows, others, determinant if sign > 0 else -determinant


def divided(row: List[Any], head: Any) -> List[Any]:
    """A row divided by a number; plain zeros are left out of the expressions."""
    return [part if is_plain_zero(part) else part / head for part in row]


def reduced(row: List[Any], factor: Any, other: List[Any]) -> List[Any]:
    """A row without a multiple of another one."""
    return [a if is_plain_zero(b) else a - factor * b for a, b in zip(row, other)]


def is_plain_zero(x: Any) -> bool:
    """Whether a number is a plain 0: a tracked 0 may change."""
    return type(x) in (float, int) and x == 0


def solved(matrix: Any, right: Any) -> Any:
    """The rows of `matrix^-1 right`."""
    _, others, determinant = eliminated(matrix, right)
    if determinant == 0:
        raise np.linalg.LinAlgError('Singular matrix')
    result = np.empty((len(others), len(others[0]) if others else 0), object)
    for place, row in enumerate(others):
        result[place] = row
    return result


@replaces(np.linalg.inv)
def inv(a: Any) -> Any:
    """numpy.linalg.inv, keeping provenance."""
    a = objects(a)
    if a.ndim > 2:
        return np.stack([inv(part) for part in a])
    return solved(a, np.identity(len(a)).astype(object))


@replaces(np.linalg.det)
def det(a: Any) -> Any:
    """numpy.linalg.det, keeping provenance."""
    a = objects(a)
    if a.ndim > 2:
        return np.array([det(part) for part in a], dtype=object)
    return eliminated(a, [[] for _ in a])[2]


@replaces(np.linalg.solve)
def solve(a: Any, b: Any) -> Any:
    """numpy.linalg.solve, keeping provenance."""
    a, b = objects(a), objects(b)
    if a.ndim > 2:
        return np.stack([solve(part, other) for part, other in zip(a, b)])
    return solved(a, b[:, None])[:, 0] if b.ndim == 1 else solved(a, b)


@replaces(np.linalg.matrix_power)
def matrix_power(a: Any, n: int) -> Any:
    """numpy.linalg.matrix_power, keeping provenance."""
    a = inv(a) if n < 0 else objects(a)
    result = np.identity(a.shape[-1]).astype(object)
    for _ in range(abs(n)):
        result = result @ a
    return result


@replaces(np.linalg.pinv)
def pinv(a: Any, rcond: float = 1e-15, hermitian: bool = False) -> Any:
    """numpy.linalg.pinv of a matrix of full rank, keeping provenance.

    Raises:
        numpy.linalg.LinAlgError: the matrix has not full rank.
    """
    a = objects(a)
    transposed = a.T
    return inv(transposed @ a) @ transposed if a.shape[0] >= a.shape[1] else transposed @ inv(a @ transposed)


@replaces(np.linalg.norm)
def norm(x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Any:  # noqa: A002, NumPy's name
    """numpy.linalg.norm, keeping provenance; of matrices the norms that are sums, while those of singular values are
    plain."""
    x = objects(x)
    is_of_vectors = x.ndim == 1 if axis is None else np.size(axis) == 1
    if not is_of_vectors and ord in (2, -2, 'nuc'):
        return np.linalg.norm(plain_array(x), ord, axis, keepdims)
    if is_of_vectors and isinstance(ord, (float, int)) and ord not in (0, 1, 2, np.inf, -np.inf):
        try:
            return np.sum(abs(x) ** ord, axis=axis, keepdims=keepdims) ** (1 / ord)
        except ArithmeticError:  # of a 0, for instance, to a negative power
            return np.linalg.norm(plain_array(x), ord, axis, keepdims)
    return np.linalg.norm(x, ord, axis, keepdims)
