"""Fitting finds what SciPy finds with a residual written by hand, and says how well it is determined."""

import math as plain

import numpy
import pytest
from scipy.optimize import curve_fit, least_squares

import rosslt
from rosslt import Source, math, track

A, B, C, N, D = (Source('/model', place) for place in range(5))
TIMES = numpy.linspace(0.0, 4.0, 60)


def curve(t, a, b, c):
    return a * math.exp(-b * t) + c


def measured(outliers=0):
    random = numpy.random.default_rng(7)
    found = 2.5 * numpy.exp(-1.3 * TIMES) + 0.5 + random.normal(0.0, 0.05, len(TIMES))
    found[3 : 3 + outliers] += 20.0
    return found


def results(start=(1.0, 0.3, 0.0)):
    a, b, c = (track(value, source) for value, source in zip(start, (A, B, C)))
    return [curve(float(t), a, b, c) for t in TIMES]


def residual(point, targets):
    a, b, c = point
    return a * numpy.exp(-b * TIMES) + c - targets


def test_it_is_the_optimum_of_scipy_with_its_standard_errors():
    targets = measured()
    found = rosslt.fit(results(), targets.tolist())
    best, covariance = curve_fit(
        lambda t, a, b, c: a * numpy.exp(-b * t) + c, TIMES, targets, p0=(1.0, 0.3, 0.0), ftol=1e-14, xtol=1e-14
    )
    assert list(found.values.values()) == pytest.approx(best.tolist(), rel=1e-6)
    assert list(found.errors.values()) == pytest.approx(numpy.sqrt(numpy.diag(covariance)).tolist(), rel=1e-4)
    assert found.old == {A: 1.0, B: 0.3, C: 0.0}
    assert found.compared == len(TIMES)
    assert found.is_converged
    assert not found.is_linearized
    assert found.after < found.before
    assert found.after == pytest.approx(plain.sqrt(numpy.mean(residual(best, targets) ** 2)), rel=1e-6)


@pytest.mark.parametrize('loss', ['soft_l1', 'huber', 'cauchy', 'arctan'])
def test_robust_losses_are_those_of_scipy(loss):
    targets = measured(outliers=4)
    found = rosslt.fit(results((2.0, 1.0, 0.4)), targets.tolist(), loss=loss, scale=0.1)
    best = least_squares(
        residual, (2.0, 1.0, 0.4), loss=loss, f_scale=0.1, args=(targets,), ftol=1e-14, xtol=1e-14, gtol=1e-14
    )
    assert list(found.values.values()) == pytest.approx(best.x.tolist(), rel=1e-5)
    assert found.values[A] == pytest.approx(2.5, abs=0.2)


def test_outliers_spoil_least_squares_only():
    targets = measured(outliers=4).tolist()
    assert abs(rosslt.fit(results(), targets).values[A] - 2.5) > 5
    assert abs(rosslt.fit(results(), targets, loss='cauchy', scale=0.1).values[A] - 2.5) < 0.2


def test_sources_that_are_not_named_or_read_only_stay():
    targets = measured().tolist()
    assert rosslt.fit(results(), targets, sources=[B, C]).values.keys() == {B, C}
    assert rosslt.fit(results(), targets, read_only=[A]).values.keys() == {B, C}
    assert rosslt.fit(results(), targets, bounds={A: (None, 2.0)}).values[A] == pytest.approx(2.0, abs=1e-9)


def test_a_source_whose_bounds_are_one_value_stays():
    targets = measured().tolist()
    found = rosslt.fit(results(), targets, bounds={A: (2.0, 2.0)})
    assert found.values == pytest.approx(rosslt.fit(results(), targets, read_only=[A]).values)


def test_what_the_targets_do_not_determine_has_an_infinite_error():
    a, b, c = track(1.0, A), track(2.0, B), track(3.0, C)
    found = rosslt.fit([(a + b) * t + c for t in range(5)], [2.0 * t + 1 for t in range(5)])
    assert found.errors[A] == found.errors[B] == plain.inf
    assert found.values[A] + found.values[B] == pytest.approx(2.0)
    assert found.values[C] == pytest.approx(1.0)
    assert found.errors[C] < 1e-6
    assert found.undetermined == [{A: 1.0, B: pytest.approx(-1.0)}]
    assert rosslt.fit([a], [5.0]).errors == {A: plain.inf}


def test_directions_are_not_determined_in_the_units_of_the_sources():
    a, b, c, d = (track(value, source) for value, source in zip((1.0, 2.0, 3.0, 4.0), (A, B, C, D)))
    found = rosslt.fit([(2 * a + 5 * b - c) * t + d * t * t for t in range(6)], [float(t * t) for t in range(6)])
    assert found.values[D] == pytest.approx(1.0)
    assert len(found.undetermined) == 2
    for direction in found.undetermined:
        assert D not in direction
        assert next(iter(direction.values())) == 1.0
        steps = [direction.get(source, 0.0) for source in (A, B, C)]
        assert 2 * steps[0] + 5 * steps[1] - steps[2] == pytest.approx(0.0, abs=1e-9)


def test_what_is_known_badly_is_determined_all_the_same():
    a, b = track(1.0, A), track(2.0, B)
    found = rosslt.fit([a * t + b * (t + 1e-6 * t * t) for t in range(6)], [3.0 * t + 1e-3 * t * t for t in range(6)])
    assert found.undetermined == []
    assert rosslt.fit(results(), measured().tolist()).undetermined == []


def test_a_named_source_that_moves_nothing_is_not_determined():
    a, b = track(1.0, A), track(2.0, B)
    found = rosslt.fit([a * t + b * 0.0 for t in range(5)], [2.0 * t for t in range(5)], sources=[A, B])
    assert found.undetermined == [{B: 1.0}]


def test_messages_and_what_may_be_anything():
    a, b = track(1.0, A), track(2.0, B)
    found = rosslt.fit([{'x': a * t, 'y': b + t} for t in range(4)], [{'x': 3.0 * t, 'y': None} for t in range(4)])
    assert found.values == {A: pytest.approx(3.0)}


def test_before_is_that_of_the_old_values_also_out_of_the_bounds():
    a = track(9.0, A)
    found = rosslt.fit([a * t for t in range(5)], [3.0 * t for t in range(5)], bounds={A: (0, 4)})
    assert found.old == {A: 9.0}
    assert found.before == pytest.approx(plain.sqrt(sum((6.0 * t) ** 2 for t in range(5)) / 5))


def test_a_source_with_several_readings_gets_one_value():
    found = rosslt.fit([track(1.0, A) * 2, track(5.0, A) * 3], [4.0, 6.0])
    assert found.values == {A: pytest.approx(2.0)}


def test_a_result_without_a_value_on_the_way_is_no_end():
    a = track(0.01, A)
    assert rosslt.fit([math.log(a)] * 2, [2.0] * 2).values[A] == pytest.approx(plain.exp(2.0))


@pytest.mark.parametrize(
    ('call', 'error', 'reason'),
    [
        (lambda: rosslt.fit([1.0], [2.0]), rosslt.NotTracked, 'no result comes from a source'),
        (lambda: rosslt.fit([track(1.0, A)], [2.0], sources=[B]), rosslt.NotTracked, 'no result comes from'),
        (lambda: rosslt.fit([track(1, N)], [2.0], sources=[N]), ValueError, 'holds 1, which is not a float'),
        (lambda: rosslt.fit([track(1.0, A)], [plain.nan]), ValueError, 'not a finite number'),
        (lambda: rosslt.fit([track(1.0, A)], [1.0, 2.0]), ValueError, 'differ in shape'),
        (lambda: rosslt.fit([track(1.0, A)], [2.0], bounds={A: (3.0, 2.0)}), ValueError, 'above its maximum 2.0'),
        (lambda: rosslt.fit([track(1.0, A)], [1.0], loss='square'), ValueError, "found 'square'"),
        (lambda: rosslt.fit([track(1.0, A)], [1.0], sources=[A], read_only=[A]), ValueError, 'read-only'),
    ],
)
def test_what_makes_no_sense_is_refused(call, error, reason):
    with pytest.raises(error, match=reason):
        call()
