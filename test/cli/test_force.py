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

# rospy sends the last message of a publisher that is no latched one to nobody who comes later
ONCE = """
    x = rosslt.location(1.0, name='x')

    class Greeting(rospy.SubscribeListener):
        def peer_subscribe(self, topic_name, topic_publish, peer_publish):
            peer_publish(Point(2 * x, 0.0, 0.0))

    publisher = rosslt.Publisher('only_once', Point, Greeting(), queue_size=1)
    rospy.spin()
    """

NARROW = """
    from std_msgs.msg import Float32

    publisher = rosslt.Publisher('narrowed', Float32, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(2 * rosslt.location(1.0, name='x'))
        rate.sleep()
    """


SHIFTED = """
    publisher = rosslt.Publisher('shifted', Point, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(-2.0, name='offset') + 1.2 * 1.833, 0.0, 0.0)
        rate.sleep()
    """


LEVELS = """
    from std_msgs.msg import Float32, UInt8MultiArray

    levels = rosslt.Publisher('levels', UInt8MultiArray, queue_size=1)
    narrow = rosslt.Publisher('narrow', Float32, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        levels.publish(data=[rosslt.location(3, name='level'), 2])
        narrow.publish(rosslt.location(1.0, name='x'))
        rate.sleep()
    """


SEVERAL = """
    from sensor_msgs.msg import JointState
    from visualization_msgs.msg import Marker, MarkerArray

    single = rosslt.Publisher('in_turn', Marker, queue_size=10)
    together = rosslt.Publisher('in_one', MarkerArray, queue_size=1)
    joints = rosslt.Publisher('joints', JointState, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        markers = []
        for number in range(4):
            marker = Marker(ns='base' if number < 3 else 'tool', id=number)
            marker.pose.position.x = rosslt.location(1.0 * number, name='x', key=number)
            markers.append(marker)
            single.publish(marker)
        together.publish(markers=markers)
        angles = [rosslt.location(0.1, name='a'), rosslt.location(0.2, name='b')]
        joints.publish(name=['shoulder', 'elbow'], position=angles)
        rate.sleep()
    """


GATED = """
    from visualization_msgs.msg import Marker

    publisher = rosslt.Publisher('gated', Marker, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        dock = rosslt.location(10.0, name='dock')
        marker = Marker(type=Marker.SPHERE_LIST, points=[Point(dock, 0.0, 0.0)])
        marker.pose.position = Point(dock + rosslt.location(1.0, name='beside'), 0.0, 0.0)
        publisher.publish(marker)
        rate.sleep()
    """


def test_what_the_points_of_a_marker_come_from_stays_as_in_a_drag(master):
    with Node('gated', GATED):
        wait_until(lambda: rosslt('explain', '/gated/pose').stdout, 'it publishes')
        (planned,) = lines('force', '/gated/pose/position/x', '12', '--dry-run')
        assert planned[:3] == ['/gated/beside', '1.0', '2.0']
        assert lines('force', '/gated/pose/position/x', '12')[0][:3] == ['/gated/beside', '1.0', '2.0']


SUMMED = """
    import rospy, rosslt
    from geometry_msgs.msg import Point
    rospy.init_node('summed')
    publisher = rosslt.Publisher('summed', Point, queue_size=1)
    rate = rospy.Rate(20)
    x = None
    while not rospy.is_shutdown():
        start = rosslt.location(1.0, name='start')
        x = start if x is None else x + 0.25
        publisher.publish(Point(x, start, 0.0))
        rate.sleep()
    """


def test_a_dry_run_says_the_value_that_a_source_has_now(master):
    with Node('summed', SUMMED):
        wait_until(lambda: rosslt('explain', '/summed/x').stdout, 'it publishes')
        assert rosslt('set', '/summed/start', '5').returncode == 0
        (planned,) = lines('force', '/summed/x', '1e6', '--dry-run')
        assert planned[:2] == ['/summed/start', '5.0']


@pytest.fixture
def several(master):
    """A node that tells of four things on one topic, in turn and in one message, and of two joints."""
    with Node('several', SEVERAL):
        wait_until(lambda: rosslt('explain', '/joints/position').stdout, 'it publishes')
        yield


class TestWhere:
    @pytest.mark.parametrize(
        ('field', 'wanted'), [('/in_turn/pose/position/x', '7.5'), ('/in_one/markers/pose/position/x', '8.5')]
    )
    def test_the_thing_that_is_meant_is_changed(self, several, field, wanted):
        for number in (3, 1):
            where = f'ns={"base" if number < 3 else "tool"},id={number}'
            (changed,) = lines('force', field, wanted, '--where', where)
            assert (changed[0], changed[2]) == (f'/several/x/{number}', wanted)

    def test_an_element_is_found_by_its_name(self, several):
        (changed,) = lines('force', '/joints/position', '0.5', '--where', 'name=elbow')
        assert (changed[0], changed[2]) == ('/several/b', '0.5')

    def test_where_there_is_none_it_is_said(self, several):
        short = ('--timeout', '0.5')
        field = '/in_turn/pose/position/x'
        assert 'no such message on /in_turn within' in failure('force', field, '1', '--where', 'id=9', *short)
        for topic, where, meant in (
            ('/in_turn/pose/position/x', 'ns=bass,id=1', 'base'),
            ('/in_one/markers/pose/position/x', 'ns=bass', 'base'),
            ('/joints/position', 'name=elbo', 'elbow'),
        ):
            assert failure('force', topic, '1', '--where', where, *short).endswith(f' others (did you mean {meant}?)')
        assert failure('force', field, '1', '--where', 'ns=tool,id=1', *short).endswith(' others')
        assert "has no field 'nss'" in failure('force', field, '1', '--where', 'nss=base')
        assert '--where takes FIELD=VALUE' in failure('force', '/in_turn/pose/position/x', '1', '--where', 'base')

    def test_an_element_that_is_not_named_is_asked_for(self, several):
        asked = 'markers has 4 elements: give one of markers[INDEX], found pose'
        field = '/in_one/markers/pose/position/x'
        assert failure('explain', field) == 'rosslt explain: ' + asked
        assert failure('force', field, '1') == f'rosslt force: {asked}; or say which with --where FIELD=VALUE'


@pytest.fixture
def limited(master, several):
    """The same joints, with a description of their robot."""
    limit = '<parent link="upper"/><limit lower="-2.4" upper="2.4" effort="1" velocity="1"/>'
    master.setParam('/robot_description', f'<robot><joint name="elbow" type="revolute">{limit}</joint></robot>')
    yield
    master.deleteParam('/robot_description')


class TestLimitsOfJoints:
    refusal = 'rosslt force: 9.0 is above the limits of the joint elbow, which are -2.4 .. 2.4 in /robot_description'

    def test_a_joint_is_not_forced_beyond_its_limits(self, limited):
        before = rosslt('get', '/several/b').stdout
        for field, wanted in (('position[1]', '9'), ('position', '[0.1, 9]'), ('', '{position: [0.1, 9]}')):
            assert failure('force', '/joints/' + field, wanted) == self.refusal
        assert failure('force', '/joints/position[1]', '9', '--dry-run') == self.refusal
        assert failure('force', '/joints/position', '9', '--where', 'name=elbow') == self.refusal
        assert rosslt('get', '/several/b').stdout == before

    def test_a_joint_is_forced_up_to_its_limit_and_others_are_free(self, limited):
        assert lines('force', '/joints/position[1]', '2.4')[0][2] == '2.4'
        assert lines('force', '/joints/position[0]', '9')[0][2] == '9.0'


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

    def test_another_branch_is_solved_in_turn(self, step):
        (changed,) = lines('force', '/stepped/x', '18')
        assert changed[:3] == ['/step/x', '1.0', '6.0']
        assert int(changed[4]) >= 2
        assert float(changed[5]) > 0
        assert lines('echo', '--once', '/stepped/x')[0][1] == '18.0'

    def test_what_cannot_be_reached_is_no_success_and_is_taken_back(self, step):
        assert failure('force', '/stepped/x', '12') == (
            'rosslt force: /step now sends 18.0 instead of 12.0; '
            'it is not computed as its provenance said before the change; taken back'
        )
        assert rosslt('get', '/step/x').stdout == '1.0\n'

    def test_it_is_left_on_request(self, step):
        result = rosslt('force', '/stepped/x', '12', '--keep-anyway', '--rounds', '1')
        assert result.returncode == 1
        assert result.stdout.startswith('/step/x\t1.0\t6.0\t')
        assert result.stderr == (
            'rosslt force: /step now sends 18.0 instead of 12.0; '
            'it is not computed as its provenance said before the change; the change was left\n'
        )
        assert rosslt('get', '/step/x').stdout == '6.0\n'

    def test_a_person_is_told_when_it_was_seen(self, step):
        assert re.fullmatch(
            r'/step/x: 1\.0 -> 2\.0  \[step\.py:\d+:\d+\]\nseen after \d+ messages?, \d+ ms\n',
            on_terminal('force', '/stepped/x', '4'),
        )

    def test_where_no_message_follows_it_is_said_and_taken_back(self, master):
        with Node('once', ONCE):
            wait_until(lambda: lines('list', '/once'), 'it has its location')
            told = failure('force', '/only_once/x', '4', '--timeout', '0.5')
            assert told == 'rosslt force: no message of /once came within 0.5 s; taken back'
            assert rosslt('get', '/once/x').stdout == '1.0\n'

    @pytest.mark.parametrize('value', ['x: 4', '{x: 4}', '{x: 4.0}'])
    def test_where_it_is_so_already_nothing_is_changed_however_it_is_written(self, step, value):
        rosslt('force', '/stepped/x', '4')
        said = 'nothing to change: it is so already\n'
        for options in ((), ('--dry-run',)):
            assert on_terminal('force', '/stepped', value, *options) == said
            result = rosslt('force', '/stepped', value, *options)
            assert (result.returncode, result.stdout, result.stderr) == (0, '', 'rosslt force: ' + said)

    def test_a_number_is_left_as_short_as_people_would_write_it(self, master):
        with Node('shifter', SHIFTED):
            wait_until(lambda: rosslt('explain', '/shifted/x').returncode == 0, 'it publishes')
            for more in (['--dry-run'], []):  # -2.0 + (2.36 - 0.1996) is 0.1604000000000001
                assert lines('force', '/shifted/x', '2.36', *more)[0][:3] == ['/shifter/offset', '-2.0', '0.1604']

    def test_a_field_of_32_bits_is_seen_as_it_rounds(self, master):
        with Node('narrow', NARROW):
            wait_until(lambda: rosslt('explain', '/narrowed/data').stdout, 'it publishes')
            result = rosslt('force', '/narrowed/data', '0.1')
            assert (result.returncode, result.stderr) == (0, '')
            assert result.stdout.startswith('/narrow/x\t')

    def test_what_the_field_cannot_hold_is_refused_before_its_node_would_fail(self, master):
        with Node('levels', LEVELS):
            wait_until(lambda: rosslt('explain', '/levels/data').stdout, 'it publishes')
            byte = 'rosslt force: the field is a uint8, which holds 0 to 255, found '
            assert failure('force', '/levels/data[0]', '400') == byte + '400'
            assert failure('force', '/levels', '{data: [-1, 2]}') == byte + '-1'
            assert failure('force', '/levels/data[0]', '256', '--dry-run') == byte + '256'
            assert 'the field is a float32, which holds ' in failure('force', '/narrow/data', '1e39')
            assert [line[:3] for line in lines('force', '/levels/data[0]', '255')] == [['/levels/level', '3', '255']]

    def test_what_a_stamp_does_not_have_is_named(self, nodes):
        said = failure('force', '/gate/header/stamp/sec', '1')
        assert said == "rosslt force: Time has no field 'sec' (did you mean secs?), its fields are secs, nsecs"

    def test_no_round_at_all_is_misuse(self, nodes):
        result = rosslt('force', '/gate/pose/position/x', '1', '--rounds', '0')
        assert result.returncode == 2
        assert result.stderr.endswith('--rounds must be at least 1, found 0\n')


DRIVEN = """
    publisher = rosslt.Publisher('driven', Point, queue_size=1)
    ticks, rate = 0, rospy.Rate(20)
    while not rospy.is_shutdown():
        ticks += 1
        gain, bias = rosslt.location(2.0, name='gain'), rosslt.location(0.25, name='bias')
        publisher.publish(5 * gain + bias + 0.1 * ticks if ticks % 2 else 4 * gain * gain + bias - ticks, 0.0, 0.0)
        rate.sleep()
    """


class TestWhatIsInTheWay:
    def test_of_a_field_that_changes_by_itself_the_numbers_to_try_are_named(self, master):
        with Node('driver', DRIVEN):
            wait_until(lambda: rosslt('explain', '/driven/x').stdout, 'it publishes')
            told = failure('force', '/driven/x', '40')
            assert re.match(r'rosslt force: it changes by itself: \S+ became \S+ in the next message, ', told), told
            assert told.endswith('; nothing was changed; it is moved most by /driver/gain, /driver/bias')
            assert lines('log', '/driver') == []

    def test_a_change_that_makes_the_node_raise_is_taken_back_at_once_and_named(self, master):
        raising = """
            from std_msgs.msg import Int32
            publisher = rosslt.Publisher('indexed', Float64, queue_size=1)

            def heard(message):
                index = rosslt.location(1.0, name='index')
                publisher.publish([0.5, 1.5, 2.5][int(index)] + index)

            rosslt.Subscriber('ticks', Int32, heard)
            ticks, rate = rosslt.Publisher('ticks', Int32, queue_size=1), rospy.Rate(20)
            while not rospy.is_shutdown():
                ticks.publish(1)
                rate.sleep()
            """
        with Node('raising', raising) as node:
            wait_until(lambda: rosslt('explain', '/indexed/data').stdout, 'it publishes')
            told = failure('force', '/indexed/data', '60', '--timeout', '600')  # longer than a command has here
            where = f'raising.py:{node.line_of("[int(index)]")}'
            assert told == f'rosslt force: /raising raises IndexError: list index out of range ({where}); taken back'
            assert rosslt('get', '/raising/index').stdout == '1.0\n'


class TestExplain:
    def test_prints_expression_and_locations(self, nodes):
        printed = on_terminal('explain', '/gate/pose/position/y')
        assert re.fullmatch(
            r'/gate pose\.position\.y = 2\.0, published by /talker\n'
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
        assert failure('explain', '/gate/pose/orientation/x') == (
            'rosslt explain: nothing in it has a source, as /talker sends it; '
            '`rosslt doctor /gate/pose/orientation/x` says why'
        )
