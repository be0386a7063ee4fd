"""Which locations reach the line that an exception comes from."""

from typing import Any, NamedTuple
from unittest.mock import Mock

import pytest

from rosslt import values
from rosslt.node.change.fault_localization import described_error, locations_read

SOURCES = [values.Source('/node', number) for number in range(9)]


class At(NamedTuple):
    """A location, which is also its site."""

    source: Any
    file: str
    line: int

    @property
    def site(self):
        return self


class Slotted:
    __slots__ = ('x', 'unset')


class Thing:
    shared = values.track(0.0, SOURCES[1])

    def __init__(self):
        self.own = values.track(0.0, SOURCES[0])
        self.gains = [1.0, values.track(0.0, SOURCES[2])]
        self.named = {'slow': values.track(0.0, SOURCES[3])}
        self.point = Slotted()
        self.point.x = values.track(0.0, SOURCES[4])

    @property
    def asked(self):
        raise AssertionError('code of the node is called')


def of_two_lines(thing):
    return sum(
        [
            1.0 / thing.own,
            thing.shared,
        ]
    )


def computed(thing):
    slow = 2.0 * thing.own + thing.shared
    return thing.gains[1] if 1.0 / slow else None


@pytest.mark.parametrize(
    ('function', 'read'),
    [
        (lambda thing: 1.0 / thing.own, [0]),
        (lambda thing: 1.0 / (thing.shared * 2.0), [1]),
        (lambda thing: 1.0 / thing.gains[-1] + thing.gains[0], [2]),
        (lambda thing: 1.0 / thing.named['slow'], [3]),
        (lambda thing: 1.0 / thing.gains[len(thing.gains) - 1], [2]),
        (lambda thing: 1.0 / thing.point.x or thing.point.unset or thing.asked or thing.none, [4]),
        (lambda thing: [1.0 / thing.own for own in thing.gains], [0]),
        (of_two_lines, [0]),
        (computed, [0, 1, 2]),
    ],
)
def test_what_a_line_reads_is_looked_up(function, read):
    locations = [At(source, '', 0) for source in SOURCES]
    with pytest.raises(ZeroDivisionError) as caught:
        function(Thing())
    found = locations_read(caught.value, locations)
    assert sorted(one.source.location_id for one in found) == read


def test_what_stands_in_a_line_is_found_whatever_the_line_reads():
    here = values.track(0.0, SOURCES[0])
    with pytest.raises(ZeroDivisionError) as caught:
        1.0 / values.untracked(here)
    line = caught.tb.tb_lineno
    at = [At(SOURCES[5], __file__, line), At(SOURCES[6], __file__, line + 1), At(SOURCES[7], '', line)]
    assert [one.source for one in locations_read(caught.value, at)] == [SOURCES[5]]


def remainder(speed, ramp, count):
    return speed % (ramp['slow'] * count)


@pytest.mark.parametrize('zero', [1, 2])
def test_a_change_of_a_divisor_to_0_is_named_first(zero):
    speed, slow, count = (values.track(0.0 if number == zero else 1.0, SOURCES[number]) for number in range(3))
    with pytest.raises(ZeroDivisionError) as caught:
        remainder(speed, {'slow': slow}, count)
    changed = [Mock(source=source, remembered=False) for source in SOURCES[:3]]
    told = described_error(
        caught.value, dict.fromkeys(changed, (1.0, 0.0)), set(changed), 'n{0.location_id}'.format, True, False
    )
    named = [int(one[0]) for one in told.split('set n')[1:]]
    assert named == [zero, *(one for one in range(3) if one != zero)]
