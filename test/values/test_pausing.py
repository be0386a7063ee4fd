"""While recording is paused, tracked values compute as plain ones do; what was tracked before stays so."""

import math

import pytest

import rosslt
from rosslt import values

SOURCE = rosslt.Source('/node', 1)


@pytest.fixture
def paused():
    values.pause_recording()
    yield
    values.resume_recording()


def _results(x, n):
    return [
        x + 1.5,
        1.5 + x,
        x - n,
        n - x,
        x * x,
        2 * x,
        x / n,
        n / x,
        x // 2,
        7 // n,
        x % 2,
        7 % n,
        x**2,
        2**n,
        -x,
        abs(-x),
        round(x, 1),
        round(n),
        int(x),
        float(n),
        divmod(x, n),
        rosslt.math.sin(x),
        rosslt.math.hypot(x, n),
        math.floor(x),
        pow(n, 2, 5),
        +x,
        n & 2,
        math.trunc(x),
    ]


def test_what_is_computed_is_plain_and_the_same(paused):
    x, n = values.track(2.75, SOURCE), values.track(3, SOURCE)
    ours, plain = _results(x, n), _results(2.75, 3)
    assert ours == plain
    assert [type(one) for one in ours] == [type(one) for one in plain]
    assert values.is_tracked(x)


def test_what_was_tracked_stays_so_and_records_again_afterwards():
    x = values.track(2.75, SOURCE)
    before = x * 2
    values.pause_recording()
    try:
        assert not values.is_tracked(before + 1)
    finally:
        values.resume_recording()
    assert values.explain(before + 1) == '2.75 [/node#1] * 2 + 1'
    assert values.explain(x * values.track(3, SOURCE)) == '2.75 [/node#1] * 3 [/node#1]'


def test_pausing_twice_is_pausing_once(paused):
    values.pause_recording()
    values.resume_recording()
    assert values.is_tracked(values.track(1, SOURCE) + 1)
    values.resume_recording()
    assert values.is_tracked(1.5 - values.track(1.0, SOURCE))


def test_what_was_recorded_elsewhere_is_made_again_with_its_provenance(paused):
    values.resume_recording()
    x = values.track(2.75, SOURCE)
    instructions, (index,) = values.disassemble([values.MATH['sin'](x * 3.0) + 1.0])
    values.pause_recording()
    made = values.assemble(instructions)[index]
    assert values.explain(made) == 'sin(2.75 [/node#1] * 3.0) + 1.0'
