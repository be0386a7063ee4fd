"""How sources move what is seen: which ways it can go at all, and how near it can get to where it is wanted.

`values.solve` answers exactly or not at all. A hand on a mouse asks for more: a target just beyond reach, a
quaternion that was rounded to 32 bits on its way. Where there is no exact answer, the nearest is found here,
by damped least squares (Levenberg-Marquardt) over the sources.
"""

import numpy

from rosslt import values
from rosslt.markers.geometry import AXES, inverse, normalized, product, rotated

#: The step of a numeric derivative, against the size of the source's value.
STEP = 1e-6

#: Rates below this count as none.
SMALL = 1e-6

#: How far the descent to the nearest goes: iterations, and the relative change that counts as none.
ITERATIONS = 80
TOLERANCE = 1e-9

#: How much shorter than Newton's the steps of the descent begin, and when they have become too short.
FIRST_DAMPING, LAST_DAMPING = 1e-2, 1e9


def current_values(tracked):
    """{Source: its value} as tracked values know them."""
    instructions, _ = values.disassemble(tracked)
    return {instruction[1]: instruction[2] for instruction in instructions if instruction[0] == values.SOURCE}


def turnable_directions(orientation):
    """The directions around which the sources of a quaternion can turn it.

    Args:
        orientation: x, y, z and w, tracked or not.

    Returns:
        [(name, unit vector in the frame)]: the frame's own axes that can be turned around; where there is
        none, those of the thing; else just the directions that the sources turn it around.
    """
    tracked = [part for part in orientation if values.is_tracked(part)]
    if not tracked:
        return []
    back = inverse(normalized(*map(float, orientation)))
    rates = []
    for rate in _rates(tracked, current_values(tracked)).values():
        known = iter(rate)
        change = tuple(next(known) if values.is_tracked(part) else 0.0 for part in orientation)
        spin = numpy.array(product(change, back)[:3])
        if numpy.linalg.norm(spin) > SMALL:
            rates.append(spin / numpy.linalg.norm(spin))
    if not rates:
        return []
    span = numpy.array(rates).T
    rotation = normalized(*map(float, orientation))
    for names, axes in (('xyz', AXES), ('uvw', [rotated(rotation, axis) for axis in AXES])):
        found = [(name, axis) for name, axis in zip(names, axes) if _is_in(span, numpy.array(axis))]
        if found:
            return found
    return [('source_%d' % index, tuple(map(float, spin))) for index, spin in enumerate(rates)]


def able(tracked):
    """The sources that can move at least one of several values, in order of appearance."""
    rates = _rates(tracked, current_values(tracked))
    return [source for source in values.sources(tracked) if source in rates and numpy.abs(rates[source]).max() > SMALL]


def _is_in(span, axis):
    weights = numpy.linalg.lstsq(span, axis, rcond=SMALL)[0]
    return numpy.linalg.norm(span @ weights - axis) < 1e-3


def _rates(tracked, sources):
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


def _at(tracked, changes):
    found = numpy.array([float(values.evaluate(value, changes)) for value in tracked])
    if not numpy.isfinite(found).all():
        raise ArithmeticError('not a finite number')
    return found


def nearest(tracked, targets, sources):
    """The source values that bring tracked values as near to their targets as they can get.

    Args:
        tracked: values of several coordinates.
        targets: as many numbers.
        sources: {Source: its present value}, those that may change; texts and booleans stay.

    Returns:
        ({Source: new value}, the distance that remains). Whole numbers stay whole.
    """
    numbers = {source: value for source, value in sources.items() if not isinstance(value, (str, bool))}
    targets = numpy.array(targets, dtype=float)
    found, damping = numbers, FIRST_DAMPING
    for _ in range(ITERATIONS):
        rates = _rates(tracked, found)
        if not rates:
            break
        slopes = numpy.array(list(rates.values())).T
        gap = targets - _at(tracked, found)
        downhill = slopes.T @ gap
        if numpy.linalg.norm(downhill) <= TOLERANCE * numpy.linalg.norm(slopes) * numpy.linalg.norm(gap):
            break
        found, damping, step = _descend(tracked, targets, found, rates, slopes, gap, damping)
        if step <= TOLERANCE * max(1.0, *map(abs, found.values())):
            break
    found = {
        source: round(value) if isinstance(sources[source], int) else float(value) for source, value in found.items()
    }
    changes = {source: value for source, value in found.items() if value != sources[source]}
    return changes, float(numpy.linalg.norm(targets - _at(tracked, found)))


def _descend(tracked, targets, found, rates, slopes, gap, damping):
    """One step of the descent: ({Source: value}, the damping for the next one, the length of the step)."""
    curvature = slopes.T @ slopes
    downhill = slopes.T @ gap
    size = max(numpy.trace(curvature) / len(rates), 1e-12)
    while damping < LAST_DAMPING:
        step = numpy.linalg.solve(curvature + damping * size * numpy.eye(len(rates)), downhill)
        trial = {**found, **{source: found[source] + delta for source, delta in zip(rates, map(float, step))}}
        try:
            gain = gap @ gap - numpy.sum((targets - _at(tracked, trial)) ** 2)
        except (ArithmeticError, ValueError):
            gain = -1.0
        # What the slopes promise; a step that keeps little of it went too far.
        promised = step @ (downhill + damping * size * step)
        if gain > 0.1 * promised:
            return trial, damping / 4.0 if gain > 0.7 * promised else damping, float(numpy.linalg.norm(step))
        damping *= 4.0
    return found, damping, 0.0
