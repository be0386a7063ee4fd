"""`rosslt log`, `undo` over nodes and `reset`, and what `list` says of remembered values."""

import re

import pytest
import rospy
from rosslt.srv import ChangeSources

from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest

OWNER = """
    rate = rospy.Rate(20)
    publisher = rosslt.Publisher('~place', Point, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(1.0, name='x', maximum=9.0), rosslt.location(2.0, name='y'), 0.0)
        rate.sleep()
    """


@pytest.fixture
def owners(master):
    """Two nodes of one code, with the values of the code and no history."""
    with Node('first', OWNER), Node('second', OWNER):
        wait_until(lambda: len(lines('list', '/first') + lines('list', '/second')) == 4, 'all locations are there')
        for name in ('/first', '/second'):
            rosslt('reset', name)
        yield


def request(request_id, **changes):
    """Change x of nodes as one request, as a drag does."""
    ids = {line[0]: line for line in lines('list')}
    assert {f'/{name}/x' for name in changes} <= ids.keys()
    for name, value in changes.items():
        call = rospy.ServiceProxy(f'/{name}/rosslt/change_sources', ChangeSources)
        ids = [location_id(name, 'x')]
        answer = call(request_id=request_id, requester='/hand', location_ids=ids, values=[str(value)])
        assert answer.state == 'applied', answer


def location_id(node, name):
    from rosslt.srv import ListLocations

    locations = rospy.ServiceProxy(f'/{node}/rosslt/list_locations', ListLocations)().locations
    return next(location.id for location in locations if location.name == name)


def values():
    return {line[0]: line[2] for line in lines('list') if line[0].startswith(('/first/', '/second/'))}


class TestUndo:
    def test_takes_a_drag_back_as_one_over_all_nodes(self, owners):
        for step in (3.0, 4.0, 5.0):
            request('drag', first=step, second=step + 1)
        assert values()['/first/x'] == '5.0'
        undone = [line[:3] for line in lines('undo', '/first')]
        assert undone == [['/first/x', '5.0', '1.0'], ['/second/x', '6.0', '1.0']]
        assert values() == {'/first/x': '1.0', '/first/y': '2.0', '/second/x': '1.0', '/second/y': '2.0'}

    def test_without_a_node_it_is_the_last_change_of_all(self, owners):
        rosslt('set', '/first/x', '3')
        rosslt('set', '/second/x', '4')
        assert [line[:3] for line in lines('undo')] == [['/second/x', '4.0', '1.0']]
        assert [line[:3] for line in lines('undo')] == [['/first/x', '3.0', '1.0']]

    def test_says_so_where_there_is_nothing_to_take_back(self, nodes):
        found = failure('undo', '/relay')
        assert found.startswith('rosslt undo: /relay: there is no change to take back (of its earlier runs, ')

    def test_takes_nothing_back_where_one_node_refuses_and_says_which(self, owners, master):
        request('another drag', first=3.0, second=4.0)
        rosslt('lock', '/second')
        try:
            wait_until(lambda: rosslt('set', '/second/y', '2.5').returncode == 1, 'it is locked')
            result = rosslt('undo', '/first')
            assert result.returncode == 1
            assert result.stdout == ''
            assert result.stderr.startswith('rosslt undo: nothing is taken back: /second: /second is locked')
            assert (values()['/first/x'], values()['/second/x']) == ('3.0', '4.0')
        finally:
            rosslt('unlock', '/second')
            wait_until(lambda: rosslt('set', '/second/y', '2.0').returncode == 0, 'it is open again')


class TestLog:
    def test_says_who_changed_what_from_what(self, owners):
        rosslt('set', '/first/x', '3')
        request('drag of two', first=4.0, second=5.0)
        rosslt('undo', '/second')
        told = [line[1:] for line in lines('log', '-n', '3')]
        assert told[0][:4] == ['rosslt set', '/first/x', '1.0', '3.0']
        assert told[0][5] == ''
        assert ['/hand', '/first/x', '3.0', '4.0', 'drag of two', 'undone'] in told
        assert ['/hand', '/second/x', '1.0', '5.0', 'drag of two', 'undone'] in told

    def test_of_one_node_and_the_last_ones(self, owners):
        for value in ('3', '4', '5'):
            rosslt('set', '/first/x', value)
        rosslt('set', '/second/x', '6')
        assert [line[4] for line in lines('log', '/first', '-n', '2')] == ['4.0', '5.0']
        assert [line[2] for line in lines('log', '-n', '1')] == ['/second/x']

    def test_is_a_table_on_a_terminal(self, owners):
        rosslt('set', '/first/x', '3')
        row = on_terminal('log', '/first').splitlines()[-1]
        assert re.fullmatch(r'\d{4}-\d\d-\d\d \d\d:\d\d:\d\d  rosslt set\s+/first/x  1\.0 -> 3\.0', row)

    def test_names_a_node_that_is_not_there(self, nodes):
        assert failure('log', '/nobody') == 'rosslt log: there is no node /nobody with locations'


class TestReset:
    def test_gives_a_location_the_value_of_the_code(self, owners):
        rosslt('set', '/first/x', '3')
        rosslt('set', '/first/y', '4')
        assert [line[:3] for line in lines('reset', '/first/x')] == [['/first/x', '3.0', '1.0']]
        assert values()['/first/y'] == '4.0'
        assert on_terminal('reset', '/first/x') == 'nothing to change: it is as the code says\n'

    def test_gives_a_node_all_of_them(self, owners):
        rosslt('set', '/first/x', '3')
        rosslt('set', '/first/y', '4')
        assert sorted(line[0] for line in lines('reset', 'first')) == ['/first/x', '/first/y']

    def test_what_is_no_literal_stays_and_is_named(self, nodes):
        stays = (
            '/talker/pin, /talker/~parking/0, /talker/~parking/1, /talker//height: what is no literal has no value in '
        )
        told = rosslt('reset', '/talker')
        assert (told.returncode, told.stdout) == (0, '')
        said, kept = told.stderr.splitlines()
        assert said == 'rosslt reset: nothing to change: it is as the code says'
        assert sorted(kept[len('rosslt reset: ') :].partition(': ')[0].split(', ')) == sorted(
            stays.partition(': ')[0].split(', ')
        )

    def test_is_a_change_that_can_be_undone(self, owners):
        rosslt('set', '/first/x', '3')
        rosslt('reset', '/first')
        rosslt('undo', '/first')
        assert values()['/first/x'] == '3.0'

    def test_says_why_it_cannot(self, nodes):
        assert 'is no literal' in failure('reset', '/talker/~parking/0')
        assert 'has no location' in failure('reset', '/talker/nothing')
        assert 'begins with no node' in failure('reset', '/nobody')


def test_list_marks_what_an_earlier_run_left(master):
    with Node('forgetful', OWNER):
        wait_until(lambda: len(lines('list', '/forgetful')) == 2, 'its locations')
        rosslt('set', '/forgetful/x', '3')
        assert [line[7] for line in lines('list', '/forgetful')] == ['', '']
    with Node('forgetful', OWNER):
        wait_until(lambda: len(lines('list', '/forgetful')) == 2, 'its locations again')
        assert {line[0]: line[7] for line in lines('list', '/forgetful')} == {
            '/forgetful/x': '1.0',
            '/forgetful/y': '',
        }
        (row,) = [line for line in on_terminal('list', '/forgetful').splitlines() if line.startswith('  x ')]
        assert row.endswith('  the code says 1.0')
        rosslt('reset', '/forgetful')
        assert [line[7] for line in lines('list', '/forgetful')] == ['', '']
