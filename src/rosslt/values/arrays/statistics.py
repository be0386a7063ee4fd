"""Covariances of arrays that hold tracked values."""

from typing import Any, List

import numpy as np

from .tracked_array import array, each, holds_tracked, plain_array, replaces, unwrapped


@replaces(np.cov)
def cov(m: Any, y: Any = None, rowvar: bool = True, bias: bool = False, ddof: Any = None, **weights: Any) -> Any:
    """numpy.cov, keeping provenance; with weights, the result is plain."""
    given = {name: weight for name, weight in weights.items() if weight is not None}
    if given or not holds_tracked((m, y)):
        plain: List[Any] = [part if part is None else each(plain_array, part) for part in (m, y)]
        return np.cov(plain[0], plain[1], rowvar, bias, ddof, **weights)
    rows = _rows(m, rowvar) if y is None else np.concatenate((_rows(m, rowvar), _rows(y, rowvar)))
    freedom = rows.shape[1] - ((0 if bias else 1) if ddof is None else ddof)
    if freedom <= 0:
        raise ValueError('%d observations have no covariance' % rows.shape[1])
    centred = rows - np.sum(rows, axis=1, keepdims=True) / rows.shape[1]
    return (np.dot(centred, centred.T) / freedom).squeeze()[()]


@replaces(np.corrcoef)
def corrcoef(x: Any, y: Any = None, rowvar: bool = True, **options: Any) -> Any:
    """numpy.corrcoef, keeping provenance."""
    if not holds_tracked((x, y)):
        plain: List[Any] = [part if part is None else each(plain_array, part) for part in (x, y)]
        return np.corrcoef(plain[0], plain[1], rowvar, **options)
    covariance = cov(x, y, rowvar)
    if not isinstance(covariance, np.ndarray):
        return covariance / covariance
    covariance = unwrapped(covariance)
    spread = np.array([variance**0.5 for variance in np.diagonal(covariance)], dtype=object)
    return covariance / spread[:, None] / spread[None, :]


def _rows(x: Any, rowvar: bool) -> Any:
    """Variables as rows of objects."""
    rows = unwrapped(array(x)).astype(object)
    rows = rows.reshape(1, -1) if rows.ndim < 2 else rows
    return rows if rowvar or rows.shape[0] == 1 else rows.T
