"""`rosslt rank`: which numbers move a field most."""

import math
import re

import pytest

from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, record_bag, rosslt

pytestmark = pytest.mark.rostest

CRANE = """
from geometry_msgs.msg import PointStamped
from std_msgs.msg import String
publisher = rosslt.Publisher('/hook', PointStamped, queue_size=1)
named = rosslt.Publisher('/name', String, queue_size=1)
while not rospy.is_shutdown():
    length = rosslt.location(4.0, name='length', minimum=2.0, maximum=12.0)
    angle = rosslt.location(0.5, name='angle')
    lift = rosslt.location(0.0, name='lift')
    base = rosslt.location(100.0, name='base', read_only=True)
    message = PointStamped()
    message.point.x = base + length * rosslt.math.cos(angle)
    message.point.y = length * rosslt.math.sin(angle) + lift + 0.0 * angle
    message.point.z = lift * lift
    publisher.publish(message)
    named.publish(rosslt.location('crane', name='title'))
    time.sleep(0.05)
"""
MOVED = {'base': 1.0, 'length': 0.1 * math.cos(0.5), 'angle': 0.005 * 4.0 * math.sin(0.5)}


@pytest.fixture(scope='module')
def crane(master):
    with Node('crane', CRANE) as started:
        wait_until(lambda: len(lines('list', '/crane')) == 5, 'the crane stands')
        yield started


def names(rows):
    return [row[1].replace('/crane/', '') for row in rows]


def test_those_come_first_that_move_the_field_most(crane):
    rows = lines('rank', '/hook/point/x')
    assert names(rows) == ['base', 'length', 'angle']
    assert [float(row[4]) for row in rows] == pytest.approx(list(MOVED.values()))
    assert [float(row[3]) for row in rows] == pytest.approx([1.0, 0.1, 0.005])
    assert [float(row[5]) for row in rows] == pytest.approx([1.0, math.cos(0.5), -4.0 * math.sin(0.5)])
    assert [row[2] for row in rows] == ['100.0', '4.0', '0.5']
    assert all(row[6].startswith(crane.file + ':') for row in rows)


def test_a_number_that_is_0_moves_by_a_hundredth(crane):
    rows = lines('rank', '/hook/point/y')
    assert names(rows) == ['length', 'angle', 'lift']
    assert float(rows[2][4]) == pytest.approx(0.01)


def test_several_fields_are_ranked_one_by_one(crane):
    assert [row[0] for row in lines('rank', '/hook/point')] == ['point.x'] * 3 + ['point.y'] * 3


def test_a_person_reads_it_as_sentences(crane):
    told = on_terminal('rank', '/hook/point')
    assert re.match(r'/hook point\.x = 103\.5\d+, published by /crane\n', told)
    assert 'if  /crane/length  moves from 4.0 by 0.1' in told
    assert re.search(r'moves from 100\.0 by 1 +takes no change\n', told)
    assert 'Not moved now by /crane/lift, from which it comes as well.' in told


def test_a_recorded_message_is_ranked_as_well(crane, tmp_path):
    record_bag(tmp_path / 'run.bag', 10, '/hook')
    assert names(lines('rank', '--bag', str(tmp_path / 'run.bag'), '/hook/point/x')) == ['base', 'length', 'angle']


def test_what_has_no_slope_is_said(crane):
    said = rosslt('rank', '/name/data')
    assert (said.returncode, said.stdout, said.stderr) == (0, '', 'rosslt rank: data is a text: it has no slope\n')
    assert 'nothing in it has a source' in failure('rank', '/hook/header')
    assert rosslt('rank').returncode == 2
