"""The directory of sources: when owners are asked, and what is told of them."""

import importlib
import itertools
import threading

import pytest

from rosslt import math, msg, srv, values
from rosslt.node.locations.directory import Directory, Place, listed
from support.processes import wait_until

directories = importlib.import_module('rosslt.node.locations.directory')

GAIN = values.Source('/owner', 7)


def location(**fields):
    return msg.Location(id=7, name='gain', is_named=True, file='/src/owner.py', line=3, column=5, **fields)


@pytest.fixture
def owner(monkeypatch):
    """An owner that answers once `owner.set()` is called."""
    may_answer = threading.Event()

    def ask_all(_service, _type, requests, _timeout):
        assert may_answer.wait(60.0)
        return {node: srv.ListLocationsResponse(locations=[location(value='1.0')]) for node in requests}, {}

    monkeypatch.setattr(directories, 'ask_all', ask_all)
    return may_answer


def test_a_source_is_described_without_waiting_for_its_owner(owner):
    """Texts are made anywhere, also where locks are held that the owner's answer may need."""
    directory = Directory()
    assert directory.describe(GAIN) is None
    owner.set()
    wait_until(lambda: directory.describe(GAIN) == 'gain, owner.py:3:5', 'the answer')


def test_who_needs_the_answer_waits_for_it(owner):
    directory = Directory()
    owner.set()
    directory.learn([GAIN])
    assert directory.describe(GAIN) == 'gain, owner.py:3:5'


def test_people_see_places_in_the_order_of_the_code():
    named = [('b.py', 1, '~at'), ('a.py', 9, 'x'), ('a.py', 2, '~way/10/y'), ('a.py', 2, '~way/2/y'), ('a.py', 2, 'w')]
    made = [Place('/owner', msg.Location(file=file, line=line, name=name)) for file, line, name in named]
    shown = [place.local_name for place in listed({'/owner': made}, True)['/owner']]
    assert shown == ['w', '~way/2/y', '~way/10/y', 'x', '~at']
    assert listed({'/owner': made[::-1]}, True) == listed({'/owner': made}, True)


def test_the_version_grows_with_what_becomes_known_but_not_with_values():
    directory = Directory()
    versions = [directory.version]
    for told in (location(value='1.0'), location(value='2.0'), location(value='2.0', read_only=True)):
        directory.take('/owner', [told])
        versions.append(directory.version)
    assert versions == [0, 1, 1, 2]


def told(*rows, **fields):
    """A directory that knows one location for each row; and the sources."""
    directory = Directory()
    locations = [msg.Location(id=number, name=f'l{number}', row=row, **fields) for number, row in enumerate(rows)]
    directory.take('/owner', locations)
    return directory, [values.Source('/owner', number) for number in range(len(rows))]


def test_a_single_row_of_a_table_is_what_a_thing_has_for_itself():
    directory, (x, scale, line) = told('f.py:3:1[1]', '', '')
    one, other = values.track(2.0, x) * values.track(3.0, scale), values.track(1.0, line)
    assert directory.held([one, other]) == [scale]
    assert directory.held([values.track(2.0, scale), other]) == []
    assert directory.shared([one, other], [], [x, scale]) == [scale]
    assert directory.shared([other], [], [line]) == []
    assert directory.own_first([scale, line, x]) == [x, scale, line]


def test_a_row_that_holds_none_is_known_and_leaves_all_numbers_free():
    directory, (x, scale) = told('f.py:3:1[1]', 'f.py:3:1[1]', row_holds_none=True)
    _, outside = told('', '', '')
    thing = [values.track(2.0, x) * values.track(3.0, outside[2])]
    assert directory.held(thing) == []
    assert directory.shared(thing, [], [outside[2]]) == []
    assert directory.own_first([outside[2], x]) == [outside[2], x]
    assert [place.source for place in directory.rows_of([scale, x])] == [scale]


def test_what_other_things_come_from_stays_if_the_rest_is_enough():
    """A gate beside a dock; the tip of an arm of three joints whose elbows are shown."""
    directory, (dock, beside, angle, *joints) = told(*[''] * 6)
    gate = [values.track(2.0, dock) + values.track(0.5, beside), 3.0 * values.track(0.4, angle)]
    assert directory.held(gate, [{dock}, set()]) == [dock]
    assert directory.shared(gate, [{dock}, set()], [dock]) == []
    assert directory.held(gate, [{dock, beside}, set()]) == []
    assert directory.shared(gate, [{dock, beside}, set()], [dock]) == [dock]
    angles = list(itertools.accumulate(values.track(0.3, joint) for joint in joints))
    tip = [sum(map(way, angles)) for way in (math.cos, math.sin)]
    assert directory.held(tip, [set(joints[:2])] * 2) == [], 'the last joint alone cannot go everywhere'
    assert directory.held(tip, [set(joints[:1])] * 2) == joints[:1]


def test_numbers_of_the_same_rank_count_alike():
    directory, (dock, beside) = told('', '', rank=1)
    assert directory.held([values.track(2.0, dock) + values.track(0.5, beside)], [{dock}]) == [dock]


def test_a_locked_number_or_a_factor_is_not_enough():
    for fields in ({'read_only': True}, {'rank': 2}):
        directory, (dock, beside) = told('', '')
        directory.take('/owner', [msg.Location(id=1, name='beside', **fields)])
        gate = [values.track(2.0, dock) + values.track(0.5, beside)]
        assert directory.held(gate, [{dock}]) == []
        assert directory.shared(gate, [{dock}], [dock]) == [dock]


@pytest.mark.parametrize(
    ('rows', 'fields'), [(('f.py:3:1[1]', 'f.py:3:1[0]'), {}), (('f.py:3:1[1]', ''), {'read_only': True})]
)
def test_what_comes_from_two_rows_or_from_locked_ones_holds_nothing(rows, fields):
    directory, sources = told(*rows, **fields)
    assert directory.held([sum(values.track(2.0, source) for source in sources)]) == []


def test_of_several_rows_none_is_told_first():
    directory, sources = told('', 'f.py:3:1[1]', 'f.py:3:1[0]')
    assert directory.own_first(sources) == sources


def test_an_outstretched_arm_needs_the_joint_that_its_elbow_shares():
    """It can only turn there, for which the elbow would do, and comes back from there with both joints alone."""
    shoulder, elbow = (values.Source('/arm', number) for number in (1, 2))
    first, second = values.track(0.5, shoulder), values.track(0.0, elbow)
    tip = [math.cos(first) + math.cos(first + second), math.sin(first) + math.sin(first + second)]
    assert Directory().held(tip, [{shoulder}, {shoulder}]) == []
    assert Directory().held([first + second], [{shoulder}]) == [shoulder]
