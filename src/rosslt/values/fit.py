"""Fitting: the source values that bring many results as near as possible to measured ones.

Calibration, without a line of model: the expressions of the results are the model, and their slopes are exact. SciPy's
`least_squares` does the search.
"""

import math
from typing import Collection, Dict, List, Mapping, NamedTuple, Optional, Tuple

from .annotations import Value
from .errors import NotTracked
from .graph import UNDEFINED, Graph
from .operations import AFFINE
from .sources import UNKNOWN, Source, describe_source
from .tracked import TRACKED
from .tree import paired

LOSSES = ('linear', 'soft_l1', 'huber', 'cauchy', 'arctan')
"""The names of the losses in SciPy."""

TOLERANCE = 1e-14
"""The search ends when the relative change of the cost, of the sources or of the cost's slope is below this."""

SINGULAR = 1e-10
"""Directions in which the results move less than this, against the one in which they move most, are not determined."""

Bounds = Mapping[Source, Tuple[Value, Value]]


LEAST_SHARE = 1e-8
"""A source with a smaller share than this in a direction that is not determined has none: it comes from rounding."""


class Fit(NamedTuple):
    """The outcome of a fit.

    Attributes:
        values: `{Source: value}`, those that bring the results nearest.
        errors: `{Source: its standard error}`, in the unit of the source; infinite if the targets do not determine
            it. Of a robust loss it is an approximation.
        old: `{Source: value before}`.
        before, after: the root of the mean square of the differences from the targets, before and after.
        cost: the minimized cost: half the sum of the squares or, for a robust loss, half the sum of its values.
        compared: the number of compared results.
        is_converged: True if the search ended by itself.
        is_linearized: True if a result's expression was cut to a linearization, which holds near the old values only.
        undetermined: the directions in which sources can move together with no result moving, to first order:
            `[{Source: by how much, in its unit}, ...]`, 1 for the first one of each. Along these, the values are those
            nearest to the old ones, and say nothing.
    """

    values: Dict[Source, float]
    errors: Dict[Source, float]
    old: Dict[Source, float]
    before: float
    after: float
    cost: float
    compared: int
    is_converged: bool
    is_linearized: bool
    undetermined: List[Dict[Source, float]]


def fit(
    values: Value,
    targets: Value,
    sources: Optional[Collection[Source]] = None,
    loss: str = 'linear',
    *,
    scale: float = 1.0,
    bounds: Optional[Bounds] = None,
    read_only: Collection[Source] = (),
) -> Fit:
    """Find the source values that bring many results as near as possible to measured ones (least squares).

    Args:
        values: a sequence of tracked numbers, or of messages holding such; or anything that `solve` takes.
        targets: plain, of the same shape, in the units of `values`; None leaves a part out.
        sources: fit these alone; by default all that hold a float, are not read-only and move a result.
        loss: `'linear'` for least squares; `'soft_l1'`, `'huber'`, `'cauchy'` or `'arctan'` if some targets are
            far off and should count less. The names are SciPy's.
        scale: from which difference on a robust loss takes a target for far off, in the unit of the results.
        bounds: `{Source: (minimum or None, maximum or None)}`. A source whose bounds are one value stays as it is.
        read_only: sources that stay as they are.

    Returns:
        The Fit; nothing has been changed. If a source has different values in different results, all get one.

    Raises:
        NotTracked: no result depends on a source that can be fitted, or not on one of `sources`.
        ValueError: the shapes differ, a target is not finite, a minimum is above its maximum, or there is no such
            loss.
        ArithmeticError: a result has no value at the present values of the sources.
        ImportError: SciPy is not installed.
    """
    import numpy
    from scipy.optimize import least_squares

    if loss not in LOSSES:
        raise ValueError('the loss must be one of %s, found %r' % (', '.join(LOSSES), loss))
    problem = _Problem(values, targets, sources, {UNKNOWN, *read_only, *_without_room(bounds or {})})
    start = numpy.array([problem.old[source] for source in problem.unknowns])
    low, high = _limits(problem.unknowns, bounds or {})
    before = problem.differences(start)
    start = numpy.clip(start, low, high)
    if not numpy.all(numpy.isfinite(problem.differences(start))):
        raise ArithmeticError('a result has no value at the present values of its sources')
    found = least_squares(
        problem.differences,
        start,
        problem.slopes,
        bounds=(low, high),
        x_scale='jac',
        loss=loss,
        f_scale=scale,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=1000,
    )
    return Fit(
        dict(zip(problem.unknowns, map(float, found.x))),
        dict(zip(problem.unknowns, _standard_errors(found.jac, float(found.cost)))),
        problem.old,
        float(numpy.sqrt(numpy.mean(before**2))),
        float(numpy.sqrt(numpy.mean(found.fun**2))),
        float(found.cost),
        len(before),
        bool(found.success),
        problem.is_linearized,
        [
            {problem.unknowns[index]: share for index, share in direction.items()}
            for direction in _undetermined(found.jac)
        ],
    )


class _Problem:
    """Results as functions of sources, for SciPy.

    Attributes:
        unknowns: the sources to fit.
        old: `{Source: its present value}`.
        is_linearized: as in the Fit.
    """

    def __init__(
        self, values: Value, targets: Value, sources: Optional[Collection[Source]], read_only: Collection[Source]
    ) -> None:
        import numpy

        self._numpy = numpy
        pairs = paired(values, targets)
        self._results: List[Value] = []
        wanted: List[float] = []
        for path, value, target in pairs:
            if type(value) not in TRACKED:
                continue
            if isinstance(target, (str, bool)) or not math.isfinite(target):
                raise ValueError('the target of %s is %r, which is not a finite number' % (path or 'the value', target))
            self._results.append(value)
            wanted.append(float(target))
        self._wanted = numpy.array(wanted)
        self._graph = graph = Graph(self._results)
        present = {source: graph.nodes[places[0]]._plain for source, places in graph.occurrences.items()}
        self.unknowns = self._chosen(present, sources, read_only)
        self.old = {source: present[source] for source in self.unknowns}
        self.is_linearized = any(form is AFFINE and not is_exact for form, _, is_exact in graph.records)
        self._steps = graph.steps(graph.depending(self.unknowns))
        self._places = [graph.index[id(value)] for value in self._results]
        if sources is None:  # those that move nothing cannot be fitted
            slopes = self.slopes(numpy.array(list(self.old.values())))
            self.unknowns = [
                source for source, column in zip(self.unknowns, slopes.T) if numpy.any(column != 0.0)
            ] or self.unknowns
            self.old = {source: present[source] for source in self.unknowns}
            self._steps = graph.steps(graph.depending(self.unknowns))

    def _chosen(
        self, present: Dict[Source, Value], sources: Optional[Collection[Source]], read_only: Collection[Source]
    ) -> List[Source]:
        if sources is None:
            found = [source for source, value in present.items() if type(value) is float and source not in read_only]
            if not found:
                raise NotTracked('no result comes from a source that holds a float and takes changes')
            return found
        for source in sources:
            if source not in present:
                raise NotTracked('no result comes from %s' % describe_source(source))
            if type(present[source]) is not float:
                raise ValueError('%s holds %r, which is not a float' % (describe_source(source), present[source]))
            if source in read_only:
                raise ValueError('%s is read-only' % describe_source(source))
        return list(dict.fromkeys(sources))

    def _at(self, point: Value) -> List[Value]:
        nodes = self._graph.plain()
        self._graph.run(self._steps, nodes, dict(zip(self.unknowns, map(float, point))))
        return nodes

    def differences(self, point: Value) -> Value:
        """Return each result minus its target; infinities if a result has no value."""
        numpy = self._numpy
        try:
            nodes = self._at(point)
            found = numpy.array([float(nodes[place]) for place in self._places])
        except (*UNDEFINED, TypeError):
            return numpy.full(len(self._places), numpy.inf)
        return found - self._wanted

    def slopes(self, point: Value) -> Value:
        """The derivative of each result for each unknown, exact."""
        partials = self._graph.partials(self._steps, self._at(point))
        found = self._numpy.zeros((len(self._places), len(self.unknowns)))
        for column, source in enumerate(self.unknowns):
            rise = self._graph.tangent(source, partials)
            found[:, column] = [rise.get(place, 0) for place in self._places]
        return found


def _without_room(bounds: Bounds) -> List[Source]:
    """The sources whose bounds are one value.

    Raises:
        ValueError: a minimum is above its maximum.
    """
    found = []
    for source, (low, high) in bounds.items():
        if low is None or high is None or low < high:
            continue
        if not low == high:
            raise ValueError('the minimum of %s is %r, above its maximum %r' % (describe_source(source), low, high))
        found.append(source)
    return found


def _limits(unknowns: List[Source], bounds: Bounds) -> Tuple[List[float], List[float]]:
    pairs = [bounds.get(source, (None, None)) for source in unknowns]
    return (
        [-math.inf if low is None else float(low) for low, _ in pairs],
        [math.inf if high is None else float(high) for _, high in pairs],
    )


def _standard_errors(slopes: Value, cost: float) -> List[float]:
    """The standard error of each unknown, from the curvature of the cost at its minimum."""
    import numpy

    rows, columns = slopes.shape
    if rows <= columns:
        return [math.inf] * columns
    scales = numpy.linalg.norm(slopes, axis=0)
    scales[scales == 0.0] = 1.0
    _, singular, directions = numpy.linalg.svd(slopes / scales, full_matrices=False)
    is_known = singular > SINGULAR * max(singular[0], 1e-300)
    inverse = numpy.where(is_known, 1.0 / numpy.where(is_known, singular, 1.0), 0.0)
    variances = ((directions * inverse[:, None]) ** 2).sum(axis=0) / scales**2 * (2.0 * cost / (rows - columns))
    is_open = numpy.abs(directions[~is_known]).max(axis=0, initial=0.0) > SINGULAR
    return [math.inf if is_free else float(math.sqrt(variance)) for variance, is_free in zip(variances, is_open)]


def _undetermined(slopes: Value) -> List[Dict[int, float]]:
    """The directions in which no result moves: {index of an unknown: by how much it moves}.

    A QR decomposition with column pivoting of the scaled slopes reveals their rank (Golub and Van Loan, Matrix
    Computations, 5.4): each column behind it is a sum of those before it.
    """
    import numpy
    from scipy.linalg import qr

    scales = numpy.linalg.norm(slopes, axis=0)
    scales[scales == 0.0] = 1.0
    (triangle, order) = qr(slopes / scales, mode='r', pivoting=True)
    sizes = numpy.abs(numpy.diag(triangle))
    rank = int(numpy.count_nonzero(sizes > SINGULAR * max(sizes[0], 1e-300)))
    shares = numpy.linalg.lstsq(triangle[:rank, :rank], triangle[:rank, rank:], rcond=None)[0]
    found = []
    for number, dependent in enumerate(order[rank:]):
        others = {int(order[row]): -float(share) for row, share in enumerate(shares[:, number])}
        kept = {index: share for index, share in others.items() if abs(share) > LEAST_SHARE}
        direction = {int(dependent): 1.0, **kept}
        found.append({index: share * scales[dependent] / scales[index] for index, share in direction.items()})
    return found
