"""The linear steps of solving several results: least squares with sparse rows, damped, shortest in the unknowns.

Small systems are solved in plain Python, larger ones with NumPy if there is NumPy, and the largest with SciPy's LSMR
if there is SciPy: its work grows with the entries that are not 0, not with the cube of the size.
"""

import contextlib
import itertools
import math
from typing import Dict, List, Sequence

from ..accelerator import CORE
from ..elimination import solved

Rows = List[Dict[int, float]]

LARGE = 16
"""Systems from this size on are worth the way to NumPy."""

HUGE = 300
"""Systems from this size on are worth the way to SciPy."""


def shortest_step(
    rows: Rows, missing: Sequence[float], scales: Sequence[float], damping: float = 0.0, by_row: bool = True
) -> List[float]:
    """The step that removes the residuals, shortest in relation to the scales, damped (Levenberg-Marquardt).

    Args:
        rows: the Jacobian, a row for each result: `{index of the unknown: slope}`, without zeros.
        missing: by how much each result should rise.
        scales: the scale of each unknown; steps are measured in these units.
        damping: at least 0, in relation to rows of length 1.
        by_row: gives all results the same weight, whatever their slopes; this changes nothing if all can be met.
            Otherwise each residual counts in its own unit.

    Returns:
        The step of each unknown.

    Raises:
        ArithmeticError: singular; more damping helps.
    """
    if CORE is not None and min(len(rows), len(scales)) < LARGE:
        found = CORE.shortest_step(rows, missing, scales, damping, by_row)
        if found is not NotImplemented:
            return list(found)
    scaled = [{place: slope * scales[place] for place, slope in row.items()} for row in rows]
    lengths = [math.sqrt(sum([part * part for part in row.values()])) for row in scaled]
    is_ordinary = all(1e-150 < length < 1e150 for length in lengths)
    if not is_ordinary:
        lengths = [math.hypot(*row.values()) or 1.0 for row in scaled]
    if not by_row:
        square = sum([length * length for length in lengths]) if is_ordinary else 0.0
        lengths = [math.sqrt(square) if is_ordinary else math.hypot(*lengths) or 1.0] * len(rows)
    scaled = [
        {place: part / length for place, part in row.items() if part / length} for row, length in zip(scaled, lengths)
    ]
    right = [value / length for value, length in zip(missing, lengths)]
    used = sorted({place for row in scaled for place in row})
    columns = {place: column for column, place in enumerate(used)}
    step = [0.0] * len(scales)
    if not used:
        return step
    for place, part in zip(used, _dense(scaled, right, columns, damping)):
        step[place] = part * scales[place]
    return step


def work_of_step(rows: Rows, unknowns: int) -> float:
    """Return the cost of a step, in the units of `budget`."""
    width = min(len(rows), unknowns)
    if width < LARGE:
        return 0.3 * width**3 + 10 * unknowns
    return 5e-4 * min(width, HUGE) ** 3 + 2 * sum([len(row) for row in rows]) + 10 * unknowns


def _dense(rows: Rows, right: List[float], columns: Dict[int, int], damping: float) -> List[float]:
    wide = len(rows) <= len(columns)
    size = min(len(rows), len(columns))
    with contextlib.suppress(ImportError):
        if size >= HUGE:
            return _with_scipy(rows, right, columns, damping)
    with contextlib.suppress(ImportError):
        if size >= LARGE:
            return _with_numpy(rows, right, columns, damping)
    if wide:
        weights = solved(_products(rows, damping), [[value] for value in right])
        step = [0.0] * len(columns)
        for row, (weight,) in zip(rows, weights):
            for place, part in row.items():
                step[columns[place]] += part * weight
        return step
    turned: Rows = [{} for _ in columns]
    for number, row in enumerate(rows):
        for place, part in row.items():
            turned[columns[place]][number] = part
    sums = [[sum([part * right[number] for number, part in row.items()])] for row in turned]
    return [part for (part,) in solved(_products(turned, damping), sums)]


def _with_numpy(rows: Rows, right: List[float], columns: Dict[int, int], damping: float) -> List[float]:
    import numpy

    matrix = numpy.zeros((len(rows), len(columns)))
    for line, row in zip(matrix, rows):
        line[[columns[place] for place in row]] = list(row.values())
    target = numpy.array(right)
    try:
        if len(rows) <= len(columns):
            square = matrix @ matrix.T
            square.flat[:: len(rows) + 1] += damping
            return (matrix.T @ numpy.linalg.solve(square, target)).tolist()
        square = matrix.T @ matrix
        square.flat[:: len(columns) + 1] += damping
        return numpy.linalg.solve(square, matrix.T @ target).tolist()
    except numpy.linalg.LinAlgError as error:
        raise ArithmeticError(str(error)) from None


def _with_scipy(rows: Rows, right: List[float], columns: Dict[int, int], damping: float) -> List[float]:
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import lsmr

    ends = [0, *itertools.accumulate([len(row) for row in rows])]
    parts = [part for row in rows for part in row.values()]
    places = [columns[place] for row in rows for place in row]
    matrix = csr_matrix((parts, places, ends), (len(rows), len(columns)))
    limit = 2 * len(rows) + 100
    return lsmr(matrix, right, math.sqrt(damping), atol=1e-15, btol=1e-15, conlim=0, maxiter=limit)[0].tolist()


def _products(vectors: Rows, damping: float) -> List[List[float]]:
    """The inner products of the vectors with each other, with the damping added to their squares."""
    result = []
    for one in vectors:
        items = one.items()
        result.append([sum([x * other[place] for place, x in items if place in other]) for other in vectors])
    for place, row in enumerate(result):
        row[place] += damping
    return result
