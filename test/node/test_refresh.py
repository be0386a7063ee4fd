"""Messages that are about to be sent are evaluated anew, whichever thread sends them."""

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker

from rosslt import math, values
from rosslt.node import refresh

SOURCES = values.Source('/node', 1), values.Source('/node', 2)


@pytest.fixture
def readings(monkeypatch):
    made = refresh.ReplacedReadings()
    monkeypatch.setattr(refresh, 'READINGS', made)
    return made


@pytest.fixture
def many_switches():
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_no_caller_gets_an_old_or_a_half_old_answer(readings, many_switches):
    x, y = (values.track(0.0, source) for source in SOURCES)
    answer = Point(x + 1, math.sin(x) + y, x * x + y)
    refresher = refresh.Refresher()
    refresher.fresh(answer)
    with ThreadPoolExecutor(4) as callers:
        for turn in range(1, 300):
            before = x, y
            x, y = (values.track(float(turn), source) for source in SOURCES)
            with readings.lock:
                for earlier, later in zip(before, (x, y)):
                    readings.replace(earlier, later)
            for sent in callers.map(refresher.fresh, [answer] * 8, [True] * 8):
                assert sent == Point(turn + 1, math.sin(turn) + turn, turn * turn + turn)


def test_a_value_in_fields_of_two_kinds_fits_each_of_them(readings):
    before, after = values.track(1, SOURCES[0]), values.track(2.5, SOURCES[0])
    readings.replace(before, after)
    marker = Marker(id=before)
    marker.scale.x = before
    sent = refresh.Refresher().fresh(marker)
    assert (sent.id, sent.scale.x) == (1, 2.5)


def test_what_has_grown_stays_as_it_is_also_while_it_rests(readings):
    before, after = (values.track(number, SOURCES[0]) for number in (1.0, 2.0))
    refresher = refresh.Refresher()
    readings.replace(before, after)
    total = math.sin(before)
    for _ in range(3):
        total = total + math.sin(before)
        refresher.fresh(Point(total, 0.0, 0.0))
    for _ in range(3):
        assert refresher.fresh(Point(total, 0.0, 0.0)).x == total
