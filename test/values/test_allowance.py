"""Recording in an allowance: what is computed beyond it is plain, and what is decoded or evaluated anew is not."""

import sys

import pytest

from rosslt import Source, evaluate, is_tracked, operation, track
from rosslt import math as tracked_math
from rosslt.values import allow, assemble, disassemble, limit_recording, reapply, spend, widened

A, B = Source('/node', 1), Source('/node', 2)


@pytest.fixture(autouse=True)
def _unlimited():
    yield
    limit_recording(lambda overdrawn: sys.maxsize)


COMPUTATIONS = {
    'sum': lambda x, n: x + 1.5,
    'reflected sum': lambda x, n: 1.5 + x,
    'of two': lambda x, n: x * n,
    'of whole numbers': lambda x, n: n // 2,
    'power': lambda x, n: x**2,
    'negative': lambda x, n: -x,
    'size': lambda x, n: abs(n),
    'rounded': lambda x, n: round(x),
    'comparison': lambda x, n: x.__round__(1),
    'function': lambda x, n: tracked_math.sin(x),
    'function of two': lambda x, n: tracked_math.atan2(x, n),
    'own operation': lambda x, n: operation(lambda a, b: a * b)(x, n),
}


@pytest.mark.parametrize('compute', COMPUTATIONS.values(), ids=COMPUTATIONS)
def test_without_allowance_results_are_plain(compute):
    x, n = track(0.75, A), track(3, B)
    recorded = compute(x, n)
    allow(0)
    plain = compute(x, n)
    assert is_tracked(recorded)
    assert type(plain) in (float, int)
    assert plain == recorded


def test_without_allowance_numbers_of_other_classes_compute_as_without_provenance():
    numpy = pytest.importorskip('numpy')
    x, two = track(1.5, A), numpy.float64(2.0)
    limit_recording(lambda overdrawn: 0)
    for result, expected in ((x + two, 3.5), (x - two, -0.5), (x * two, 3.0), (x / two, 0.75)):
        assert result == expected
        assert type(result) is numpy.float64


def test_an_allowance_is_used_up_and_refilled():
    allowances = [40, 40, 0]
    limit_recording(lambda overdrawn: allowances.pop(0))
    total, recorded = track(0.0, A), 0
    for _ in range(200):
        recorded += is_tracked(total + 1.0)
    assert 70 <= recorded <= 80
    assert allowances == []
    allow(10)
    assert is_tracked(total + 1.0)


def test_what_is_decoded_or_evaluated_anew_does_not_count():
    x = track(2.0, A) * track(3.0, B)
    allow(0)
    instructions, (index,) = disassemble([x])
    assert evaluate(assemble(instructions)[index], {A: 5.0}) == 15.0
    assert evaluate(reapply(x, {A: 4.0}), {B: 1.0}) == 4.0
    assert is_tracked(widened(track(2, A)))
    assert is_tracked(track(2.0, A))


def test_an_error_of_who_refills_reaches_the_program():
    def refill(overdrawn):
        raise RuntimeError('no more')

    with pytest.raises(RuntimeError, match='no more'):
        limit_recording(refill)
    allow(1)
    with pytest.raises(RuntimeError, match='no more'):
        _ = track(1.0, A) + 1.0 + 1.0


def test_what_is_spent_beyond_an_allowance_is_told():
    told = []

    def refill(overdrawn):
        told.append(overdrawn)
        return 100

    limit_recording(refill)
    assert spend(30)
    assert spend(1070)
    assert spend(99)
    assert told == [0, 1000]
