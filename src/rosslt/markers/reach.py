"""How sources move what is seen: which ways it can go at all, and how near it can get to where it is wanted.

`values.solve` answers exactly or not at all. A hand on a mouse asks for more: a target just beyond reach, a
quaternion that was rounded to 32 bits on its way. Where there is no exact answer, the nearest is found here,
by damped least squares (Levenberg-Marquardt) over the sources.
"""

import math
from typing import Any, Collection, Dict, List, Sequence, Tuple

import numpy

from rosslt import values

#: The step of a numeric derivative, against the size of the source's value.
STEP = 1e-6

#: Rates below this count as none.
SMALL = 1e-6

#: How far the descent to the nearest goes: iterations, and the relative change that counts as none.
ITERATIONS = 80
TOLERANCE = 1e-9

#: How much shorter than Newton's the steps of the descent begin, and when they have become too short.
FIRST_DAMPING, LAST_DAMPING = 1e-2, 1e9


def source_values(tracked: Sequence[Any]) -> Dict[Any, Any]:
    """{Source: its value} as tracked values know them."""
    instructions, _ = values.disassemble(tracked)
    return {instruction[1]: instruction[2] for instruction in instructions if instruction[0] == values.SOURCE}


def slopes(tracked: Sequence[Any]) -> Dict[Any, Any]:
    """{Source: the slope of each of several tracked values} for every source that is a number."""
    return _rates(tracked, source_values(tracked))


def able(tracked: Sequence[Any]) -> List[Any]:
    """The sources that can move at least one of several values, in order of appearance."""
    rates = _rates(tracked, source_values(tracked))
    return [source for source in values.sources(tracked) if source in rates and numpy.abs(rates[source]).max() > SMALL]


def _rates(tracked: Sequence[Any], sources: Dict[Any, Any]) -> Dict[Any, Any]:
    """{Source: the rate of change of each tracked value} where the sources are; of those that are numbers."""
    rates = {}
    for source, value in sources.items():
        if isinstance(value, (str, bool)):
            continue
        step = STEP * max(1.0, abs(value))
        try:
            above, below = (_at(tracked, {**sources, source: value + sign * step}) for sign in (1.0, -1.0))
        except (ArithmeticError, ValueError):
            continue
        rates[source] = (above - below) / (2.0 * step)
    return rates


def _at(tracked: Sequence[Any], changes: Dict[Any, Any]) -> Any:
    found = numpy.array([float(values.evaluate(value, changes)) for value in tracked])
    if not numpy.isfinite(found).all():
        raise ArithmeticError('not a finite number')
    return found


def nearest(
    tracked: Sequence[Any], targets: Any, bounds: Any = None, read_only: Collection[Any] = ()
) -> Tuple[Dict[Any, Any], float]:
    """The source values that bring tracked values as near to their targets as they can get.

    Args:
        tracked: values of several coordinates.
        targets: as many numbers.
        bounds: {Source: (minimum or None, maximum or None)}.
        read_only: sources that stay; so do texts and booleans.

    Returns:
        ({Source: new value}, the distance that remains). Whole numbers stay whole.
    """
    sources = {source: value for source, value in source_values(tracked).items() if source not in read_only}
    numbers = {source: value for source, value in sources.items() if not isinstance(value, (str, bool))}
    limits = {
        source: tuple(
            math.inf * sign if end is None else end
            for sign, end in zip((-1, 1), (bounds or {}).get(source, (None, None)))
        )
        for source in numbers
    }
    targets = numpy.array(targets, dtype=float)
    found, damping = numbers, FIRST_DAMPING
    for _ in range(ITERATIONS):
        rates = _rates(tracked, found)
        if not rates:
            break
        slopes = numpy.array(list(rates.values())).T
        gap = targets - _at(tracked, found)
        downhill = slopes.T @ gap
        # A source at a bound that it would leave stays there.
        held = [
            (found[source] >= limits[source][1]) if part > 0 else (found[source] <= limits[source][0])
            for source, part in zip(rates, downhill)
        ]
        rates = {source: rate for (source, rate), is_held in zip(rates.items(), held) if not is_held}
        if not rates:
            break
        slopes = numpy.array(list(rates.values())).T
        downhill = slopes.T @ gap
        if numpy.linalg.norm(downhill) <= TOLERANCE * numpy.linalg.norm(slopes) * numpy.linalg.norm(gap):
            break
        found, damping, step = _descend(tracked, targets, found, rates, gap, damping, limits)
        if step <= TOLERANCE * max(1.0, *map(abs, found.values())):
            break
    found = {
        source: round(value) if isinstance(sources[source], int) else float(value) for source, value in found.items()
    }
    changes = {source: value for source, value in found.items() if value != sources[source]}
    return changes, float(numpy.linalg.norm(targets - _at(tracked, found)))


def _descend(
    tracked: Any, targets: Any, found: Any, rates: Any, gap: Any, damping: float, limits: Any
) -> Tuple[Any, float, float]:
    """One step of the descent: ({Source: value}, the damping for the next one, the length of the step)."""
    slopes = numpy.array(list(rates.values())).T
    curvature = slopes.T @ slopes
    downhill = slopes.T @ gap
    size = max(numpy.trace(curvature) / len(rates), 1e-12)
    while damping < LAST_DAMPING:
        step = numpy.linalg.solve(curvature + damping * size * numpy.eye(len(rates)), downhill)
        moved = {
            source: min(max(found[source] + delta, limits[source][0]), limits[source][1])
            for source, delta in zip(rates, map(float, step))
        }
        step = numpy.array([moved[source] - found[source] for source in rates])
        trial = {**found, **moved}
        try:
            gain = gap @ gap - numpy.sum((targets - _at(tracked, trial)) ** 2)
        except (ArithmeticError, ValueError):
            gain = -1.0
        # What the slopes promise; a step that keeps little of it went too far.
        promised = step @ (2.0 * downhill - curvature @ step)
        if gain > 0.1 * promised and gain > 0.0:
            return trial, damping / 4.0 if gain > 0.7 * promised else damping, float(numpy.linalg.norm(step))
        damping *= 4.0
    return found, damping, 0.0
