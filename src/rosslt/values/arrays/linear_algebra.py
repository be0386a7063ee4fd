"""Linear algebra on arrays that hold tracked values, by elimination: every step is an operation of the table.

Of arrays with more than two dimensions, the last two are the matrices, as in `numpy.linalg`.
"""

from typing import Any

import numpy as np

from ..elimination import eliminate, solved
from .tracked_array import plain_array, replaces, unwrapped


def objects(x: Any) -> Any:
    """An array or nested list as an ordinary object array."""
    from_list = x if isinstance(x, np.ndarray) else np.array(x, dtype=object)
    return unwrapped(from_list).astype(object)


def square(a: Any) -> Any:
    """An array or nested list as a square matrix of objects.

    Raises:
        numpy.linalg.LinAlgError: it is not square.
    """
    a = objects(a)
    if a.ndim != 2 or a.shape[0] != a.shape[1]:
        raise np.linalg.LinAlgError('Last 2 dimensions of the array must be square')
    return a


def divided_by(matrix: Any, right: Any) -> Any:
    """`matrix^-1 right`, of object arrays."""
    try:
        rows = solved(square(matrix).tolist(), right.tolist())
    except ZeroDivisionError as error:
        raise np.linalg.LinAlgError(str(error)) from None
    result = np.empty(right.shape, object)
    for at, row in enumerate(rows):
        result[at] = row
    return result


@replaces(np.linalg.inv)
def inv(a: Any) -> Any:
    """numpy.linalg.inv, keeping provenance."""
    a = objects(a)
    if a.ndim > 2:
        return np.stack([inv(part) for part in a])
    return divided_by(a, np.identity(len(a)).astype(object))


@replaces(np.linalg.det)
def det(a: Any) -> Any:
    """numpy.linalg.det, keeping provenance."""
    a = objects(a)
    if a.ndim > 2:
        return np.array([det(part) for part in a], dtype=object)
    return eliminate(square(a).tolist())


@replaces(np.linalg.solve)
def solve(a: Any, b: Any) -> Any:
    """numpy.linalg.solve, keeping provenance."""
    a, b = objects(a), objects(b)
    if a.ndim > 2:
        return np.stack([solve(part, other) for part, other in zip(a, b)])
    return divided_by(a, b[:, None])[:, 0] if b.ndim == 1 else divided_by(a, b)


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
