"""`rosslt force` and `rosslt explain` where more than one node publishes, and where a message says otherwise."""

import re

import pytest

from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest

TWIN = """
    publisher = rosslt.Publisher('{}', Point, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(2 * rosslt.location(1.0, name='half'), 0.0, 0.0)
        rate.sleep()
    """

STEP = """
    publisher = rosslt.Publisher('stepped', Point, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        x = rosslt.location(1.0, name='x')
        publisher.publish(2 * x if x < 5 else 3 * x, 0.0, 0.0)
        rate.sleep()
    """

NARROW = """
    from std_msgs.msg import Float32

    publisher = rosslt.Publisher('narrowed', Float32, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(2 * rosslt.location(1.0, name='x'))
        rate.sleep()
    """


@pytest.fixture(scope='module')
def twins(master):
    """Two nodes that publish one topic, of one code."""
    with Node('left', TWIN.format('shared')), Node('right', TWIN.format('shared')):
        wait_until(lambda: len(lines('list', '/left') + lines('list', '/right')) == 2, 'both have their location')
        yield


class TestTwoPublishers:
    @pytest.mark.parametrize('value', ['6', '8', '10'])
    def test_the_first_one_by_name_is_changed_every_time(self, twins, value):
        result = rosslt('force', '/shared/x', value)
        assert result.returncode == 0
        assert result.stdout.split('\t')[0] == '/left/half'
        assert result.stderr == (
            'rosslt force: /left and /right publish /shared; this is about the messages of /left, '
            '--node takes another\n'
        )

    def test_the_one_that_is_named_is_changed(self, twins):
        for wanted in ('12', '14'):
            assert rosslt('force', '/shared/x', wanted, '--node', 'right').stdout.split('\t')[0] == '/right/half'
        assert rosslt('force', '/shared/x', '16', '--source', '/right/half').stdout.split('\t')[0] == '/right/half'
        assert rosslt('get', '/right/half').stdout == '8.0\n'

    def test_each_one_is_explained(self, twins):
        explained = lines('explain', '/shared/x')
        assert [line[3] for line in explained] == ['/left/half', '/right/half']
        assert [line[3] for line in lines('explain', '/shared/x', '--node', '/right')] == ['/right/half']


class TestWhatIsSeenAfterwards:
    @pytest.fixture
    def step(self, master):
        with Node('step', STEP) as node:
            # a value of the node before is remembered
            wait_until(lambda: rosslt('set', '/step/x', '1').returncode == 0, 'it has its location')
            wait_until(lambda: rosslt('explain', '/stepped/x').stdout.startswith('x\t2.0\t'), 'it publishes')
            yield node

    def test_a_result_that_came_otherwise_is_no_success(self, step):
        result = rosslt('force', '/stepped/x', '12')
        assert result.returncode == 1
        assert result.stdout.startswith('/step/x\t1.0\t6.0\t')
        assert result.stderr == 'rosslt force: this has changed, but /step now sends 18.0 instead of 12\n'

    def test_it_returns_when_the_change_is_seen(self, step):
        assert rosslt('force', '/stepped/x', '4').returncode == 0
        assert lines('echo', '--once', '/stepped/x')[0][1] == '4.0'

    @pytest.mark.parametrize('value', ['x: 4', '{x: 4}', '{x: 4.0}'])
    def test_where_it_is_so_already_nothing_is_changed_however_it_is_written(self, step, value):
        rosslt('force', '/stepped/x', '4')
        assert lines('force', '/stepped', value) == []
        assert on_terminal('force', '/stepped', value) == 'nothing to change: it is so already\n'

    @pytest.mark.parametrize('value', ['x: 6', '{x: 6}'])
    def test_with_and_without_braces_it_is_the_same(self, step, value):
        assert [line[:3] for line in lines('force', '/stepped', value)] == [['/step/x', '1.0', '3.0']]

    def test_a_field_of_32_bits_is_seen_as_it_rounds(self, master):
        with Node('narrow', NARROW):
            wait_until(lambda: rosslt('explain', '/narrowed/data').stdout, 'it publishes')
            result = rosslt('force', '/narrowed/data', '0.1')
            assert (result.returncode, result.stderr) == (0, '')
            assert result.stdout.startswith('/narrow/x\t')


class TestExplain:
    def test_prints_expression_and_locations(self, nodes):
        printed = on_terminal('explain', '/goal/pose/position/y')
        assert re.fullmatch(
            r'/goal pose\.position\.y = 2\.0, published by /talker\n'
            r'  = 2\.0 \[radius, talker\.py:\d+:\d+\] \+ 0\.0 \[~parking/0, talker\.py:\d+:\d+\]\n'
            r'  /talker/radius      2\.0  0\.5 \.\. 10\.0  /\S+/talker\.py:\d+:\d+\n'
            r'  /talker/~parking/0  0\.0               /\S+/talker\.py:\d+:\d+\n',
            printed,
        )

    def test_explains_each_field_of_a_part(self, nodes):
        assert [line[0] for line in lines('explain', '/pose/position')] == [
            'position.x',
            'position.y',
            'position.y',
            'position.z',
        ]

    def test_says_whose_message_has_no_source(self, nodes):
        assert failure('explain', '/goal/pose/orientation/x') == (
            'rosslt explain: nothing in it has a source, as /talker sends it; `rosslt doctor /goal` says why'
        )
