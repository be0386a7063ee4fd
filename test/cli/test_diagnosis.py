"""What the command says when something is wrong: no message, a node that has ended, a name that is misspelt; and what
`rosslt doctor` finds."""

import re
import signal
import subprocess

import pytest
import rosgraph

from support.masters import reached_master
from support.processes import Node, is_published, wait_until
from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest


#: Long enough for what sends twenty messages a second.
BRIEFLY = '--time', '1.5'


@pytest.fixture
def master_of_its_own(tmp_path):
    """A master without a node, for a test that leaves some behind or needs to be alone."""
    with reached_master(tmp_path):
        yield rosgraph.Master('/test')


def findings(*arguments):
    """{(kind, text)} of what the doctor finds on a topic, and its exit code."""
    result = rosslt('doctor', *arguments, *BRIEFLY)
    assert result.stderr == ''
    return {tuple(line.split('\t')[2:]) for line in result.stdout.splitlines()}, result.returncode


class TestNames:
    @pytest.mark.parametrize(
        ('arguments', 'meant'),
        [
            (('get', '/talker/raduis'), '(did you mean radius?)'),
            (('get', '/talker/RADIUS'), '(did you mean radius?)'),
            (('get', '/talkr/radius'), '(did you mean /talker?)'),
            (('get', '/talkr/~parking/0'), '(did you mean /talker?)'),
            (('list', '/talkre'), '(did you mean /talker?)'),
            (('echo', '/gaet'), '(did you mean /gate?)'),
            (('echo', '/gaet/pose/position'), '(did you mean /gate?)'),
            (('echo', '/gate/pose/positon'), '(did you mean position?)'),
            (('force', '/gate/pose/position', '{xx: 1}'), '(did you mean x?)'),
            (('force', '/gate/pose/position/x', '1', '--node', '/tlaker'), '(did you mean /talker?)'),
            (('doctor', '/gaet'), '(did you mean /gate?)'),
        ],
    )
    def test_a_misspelt_name_is_guessed(self, nodes, arguments, meant):
        assert meant in failure(*arguments)

    @pytest.mark.parametrize('verb', ['get', 'echo'])
    def test_nothing_is_guessed_where_nothing_is_like_it(self, nodes, verb):
        assert 'did you mean' not in failure(verb, '/robot2/nothing/x')


class TestNodesThatAreGone:
    def test_one_that_was_killed_is_named_with_what_cleans_up(self, master_of_its_own):
        with Node('victim', "rosslt.location(1.0, name='x')\nrospy.spin()") as victim:
            victim.stop(signal.SIGKILL)
            result = rosslt('list')
            assert result.returncode == 1
            assert re.fullmatch(
                r'rosslt list: cannot reach /victim: nothing listens at its address localhost:\d+ any more: it has '
                'been killed. `rosnode cleanup` has the master forget it\n',
                result.stderr,
            )
            assert '`rosnode cleanup`' in failure('get', '/victim/x')

    def test_an_address_that_cannot_be_reached_is_told_apart_from_one_that_hangs(self, master_of_its_own):
        address = 'no-such-host.invalid:1234'
        rosgraph.Master('/remote').registerService(
            '/remote/rosslt/list_locations', f'rosrpc://{address}', f'http://{address}/'
        )
        line = rosslt('list').stderr
        assert f'cannot reach /remote: it advertises the address {address}, which cannot be reached from here (' in line
        assert line.endswith('where it runs, set ROS_IP to an address that this machine reaches\n')

    def test_without_a_tracked_node_list_says_so(self, master_of_its_own):
        assert failure('list').startswith('rosslt list: no node has locations: none is tracked. Start one with ')


class TestSimulatedTime:
    @pytest.fixture
    def clock(self, nodes, master):
        with Node(
            'clock',
            """
            from rosgraph_msgs.msg import Clock
            publisher = rospy.Publisher('/clock', Clock, queue_size=1)
            now = 0.0
            while not rospy.is_shutdown():
                now += 0.05
                publisher.publish(rospy.Time.from_sec(now))
                time.sleep(0.05)
            """,
        ) as node:
            wait_until(lambda: is_published('/clock'), 'the clock runs')
            master.setParam('/use_sim_time', True)
            yield node
            master.deleteParam('/use_sim_time')

    def test_the_clock_is_a_topic_like_others(self, clock):
        printed = lines('echo', '--once', '/clock')
        assert [line[0] for line in printed] == ['clock.secs', 'clock.nsecs', '---']

    def test_everything_works_beside_it(self, clock):
        flow = lines('graph')
        assert ['/talker/radius', '/gate', 'pose.position.x,pose.position.y', '/talker'] in flow
        assert lines('echo', '--once', '/gate/pose/position/z')[1] == ['---']
        assert rosslt('set', '/talker/count', '3').stderr == ''


class TestTypes:
    SENT = '/typed sends it as geometry_msgs/Point, but the master knows it as geometry_msgs/PoseStamped, as '
    ALIVE = '/changer says: who goes by the master, as RViz does, gets nothing of it. Have all nodes use one type'

    @pytest.fixture
    def typed(self, nodes):
        code = """
            publisher = rosslt.Publisher('typed', Point, queue_size=1)
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(1.0, name='x'), 0, 0)
                rate.sleep()
            """
        with Node('typed', code) as node:
            wait_until(lambda: is_published('/typed'), 'it publishes')
            yield node

    @pytest.fixture
    def changer(self, typed, master):
        """Advertises the topic as another type."""
        with Node('changer', "rosslt.Publisher('typed', PoseStamped, queue_size=1)\nrospy.spin()") as node:
            wait_until(lambda: dict(master.getTopicTypes())['/typed'] == 'geometry_msgs/PoseStamped', 'it says so')
            yield node

    def test_a_topic_is_read_as_its_publisher_sends_it(self, changer):
        changer.stop()
        assert lines('echo', '--once', '/typed')[0][:2] == ['x', '1.0']
        assert lines('explain', '/typed/x')[0][3] == '/typed/x'
        assert lines('force', '/typed/x', '2')[0][:3] == ['/typed/x', '1.0', '2.0']
        assert lines('graph', '/typed') == [['/typed/x', '/typed', 'x', '/typed']]
        found, code = findings('/typed')
        ended = 'a node has said that publishes it no more: who goes by the master, as RViz does, gets nothing of it'
        assert any(kind == 'fault' and text.startswith(self.SENT + ended) for kind, text in found)
        assert ('ok', 'it comes from /typed/x') in found
        assert code == 1

    def test_who_has_said_another_type_is_named(self, changer):
        assert any(kind == 'fault' and text.startswith(self.SENT + self.ALIVE) for kind, text in findings('/typed')[0])
        for words in (['explain', '/typed/x'], ['force', '/typed/x', '2']):
            assert f'no message on /typed within 1 s; {self.SENT}{self.ALIVE}' in failure(*words, '--timeout', '1')

    def test_echo_says_why_no_message_comes_and_goes_on(self, changer):
        echo = subprocess.Popen(['rosslt', 'echo', '--once', '/typed'], stderr=subprocess.PIPE, text=True)
        try:
            told = echo.stderr.readline()
            assert told.startswith(f'rosslt echo: no message on /typed within 3 s; {self.SENT}{self.ALIVE}')
            assert echo.poll() is None
        finally:
            echo.kill()
            echo.communicate()


class TestDoctor:
    def test_finds_nothing_wrong_where_all_is_well(self, nodes):
        found, _ = findings('/gate')
        assert ('note', '/talker/fixed is read-only') in found
        assert ('ok', 'it comes from /talker/frame, /talker/radius, /talker/~parking/0, /talker//height') in found
        (sent,) = (text for kind, text in found if kind == 'ok' and text.startswith('/talker sends'))
        assert re.fullmatch(
            r'/talker sends provenance in \d+ of \d+ messages( \(\d+ sampled, 0 plain\))?: '
            r'\d+\.\d a second, 1\d\d B each, \d+ B of them provenance',
            sent,
        )

    def test_leaves_no_warning_in_the_log_of_the_node(self, nodes):
        code = """
            publisher = rosslt.Publisher('beat', Float64, queue_size=10)
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(1.0, name='strength'))
                rate.sleep()
            """
        with Node('quiet', code) as quiet:  # at which no other test looks
            wait_until(lambda: is_published('/beat'), 'it publishes')
            for _ in range(2):  # the warning of the first look has come when the second one ends
                findings('/beat')
            assert 'connection failed' not in quiet.logged()

    def test_counts_whole_sampled_and_plain_messages(self, nodes):
        fast = """
            publisher = rosslt.Publisher('fast', Float64, queue_size=10)
            rate = rospy.Rate(100)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(1.0, name='x'))
                rate.sleep()
            """
        with Node('fast', fast, '_rosslt/rate:=20'):
            wait_until(lambda: rosslt('explain', '/fast').returncode == 0, 'it publishes')
            assert '[x, fast.py:' in rosslt('echo', '-n', '1', '/fast').stdout
            (sent,) = (text for _, text in findings('/fast')[0] if text.startswith('/fast sends'))
            assert re.match(r'/fast sends provenance in \d+ of \d+ messages \(\d+ sampled, \d+ plain\): ', sent)
            whole, count, sampled, plain = map(int, re.findall(r'\d+', sent)[:4])
            assert whole + sampled + plain == count
            assert 0 < whole < sampled
            assert plain == 0

    def test_messages_without_their_provenance_are_not_no_messages(self, nodes):
        never_whole = """
            from rosslt.messages import SAMPLED
            publisher = rosslt.Publisher('never', Float64, queue_size=10)
            publisher._sampled.to_send = lambda *_: SAMPLED
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(1.0, name='x'))
                rate.sleep()
            """
        with Node('never', never_whole):
            wait_until(lambda: rosslt('echo', '-n', '1', '/never').returncode == 0, 'it publishes')
            for words in (['explain', '/never'], ['force', '/never/data', '2']):
                told = rosslt(*words, '--timeout', '1').stderr
                assert 'no message with provenance on /never within 1 s: ' in told
            assert [text for kind, text in findings('/never')[0] if kind == 'fault' and 'in 0 of' in text]

    def test_names_the_fields_that_cannot_be_forced(self, nodes):
        half = """
            publisher = rosslt.Publisher('half', Point, queue_size=1)
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                fixed = rosslt.location(3.0, name='z', read_only=True)
                publisher.publish(rosslt.location(1.0, name='x'), 2.0, fixed)
                rate.sleep()
            """
        with Node('half', half):
            wait_until(lambda: rosslt('explain', '/half/x').returncode == 0, 'it publishes')
            found, code = findings('/half')
            assert ('note', 'y cannot be forced: it has no source, as /half sends it') in found
            assert ('note', 'z cannot be forced: none of its locations can be changed') in found
            assert code == 0

    def test_looks_at_one_field(self, nodes):
        orientation = 'pose.orientation.x cannot be forced: it has no source, as /talker sends it'
        assert ('note', orientation) in findings('/gate/pose/orientation/x')[0]
        assert not [text for _, text in findings('/gate/pose/position/y')[0] if 'cannot be forced' in text]

    def test_shows_a_topic_with_its_findings_on_a_terminal(self, nodes):
        printed = on_terminal('doctor', '/gate', *BRIEFLY)
        assert printed.startswith('/gate  geometry_msgs/PoseStamped\n  ok     /talker sends provenance in ')

    def test_names_a_publisher_that_is_not_tracked(self, nodes):
        plain = subprocess.Popen(['rostopic', 'pub', '-r', '20', '/plain', 'geometry_msgs/Point', '{x: 1}'])
        try:
            wait_until(lambda: 'no topic' not in rosslt('doctor', '/plain', *BRIEFLY).stderr, 'it publishes')
            found, code = findings('/plain')
            ((kind, text),) = found
            assert (kind, code) == ('fault', 1)
            assert re.match('/plain is plain: /rostopic_.* uses rospy as it is: start it with `rosslt run`', text)
            assert '`rosslt doctor /plain/x` says why' in failure('force', '/plain/x', '2')
            assert 'as /rostopic' in failure('explain', '/plain/x')
        finally:
            plain.terminate()
            plain.wait(30)

    def test_does_not_advise_to_run_what_is_no_python_node(self, nodes):
        started = [
            subprocess.Popen(['rostopic', 'pub', '-r', '20', '/counted', 'std_msgs/Float64', '1']),
            subprocess.Popen(['rosrun', 'topic_tools', 'relay', '/counted', '/compiled', '__name:=compiled']),
        ]
        try:
            wait_until(lambda: rosslt('echo', '-n', '1', '/compiled').returncode == 0, 'it publishes')
            assert findings('/compiled') == (
                {('fault', '/compiled is plain: /compiled is not a Python node: only those can be tracked')},
                1,
            )
        finally:
            for one in started:
                one.terminate()
                one.wait(30)

    def test_says_that_types_differ(self, nodes):
        goal = """
            publisher = rosslt.Publisher('goal', PoseStamped, queue_size=1)
            while not rospy.is_shutdown():
                goal = PoseStamped()
                goal.pose.position.x = rosslt.location(1.0, name='x')
                publisher.publish(goal)
                time.sleep(0.05)
            """
        handles = """
            from visualization_msgs.msg import InteractiveMarkerUpdate
            publisher = rospy.Publisher('/other/update', InteractiveMarkerUpdate, queue_size=1)
            rospy.Subscriber('/goal', Pose, lambda goal: None)
            rospy.spin()
            """
        with Node('goal', goal):
            with Node('other', handles):
                wait_until(lambda: 'takes it for' in rosslt('doctor', '/goal', *BRIEFLY).stdout, 'it listens')
                found, code = findings('/goal')
                differ = '/other takes it for geometry_msgs/Pose, but it is sent as geometry_msgs/PoseStamped'
                assert ('fault', differ) in found
                assert code == 1
                assert not [text for _, text in found if 'handles are shown' in text]
            sent = '/goal sends it as geometry_msgs/PoseStamped, but the master knows it as geometry_msgs/Pose, '
            with Node('changer', "rosslt.Publisher('goal', Pose, queue_size=1)\nrospy.spin()"):
                wait_until(lambda: any(text.startswith(sent) for _, text in findings('/goal')[0]), 'its type changes')

    def test_finds_where_provenance_enters_and_does_not_leave(self, nodes):
        loses = """
            publisher = rospy.Publisher('lost', Point, queue_size=1)
            rosslt.Subscriber('gate', PoseStamped, lambda gate: publisher.publish(gate.pose.position))
            rospy.spin()
            """
        with Node('loser', loses):
            wait_until(lambda: 'no topic' not in rosslt('doctor', '/lost', *BRIEFLY).stderr, 'it publishes')
            found, code = findings('/lost')
            ((kind, text),) = found
            assert (kind, code) == ('fault', 1)
            assert text.startswith('provenance enters /loser on /gate and does not leave it: /loser loses it: ')

    def test_finds_a_node_that_takes_no_changes(self, nodes, master):
        rosslt('lock', '/talker')
        try:
            found, code = findings('/pose')
            assert any(kind == 'fault' and text.startswith('/talker: locked by ') for kind, text in found)
            assert code == 1
        finally:
            rosslt('unlock', '/talker')

    def test_finds_an_owner_that_is_gone(self, nodes):
        owner = """
            publisher = rosslt.Publisher('passed', Point, queue_size=1)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(1.0, name='x'), 0, 0)
                time.sleep(0.05)
            """
        keeper = """
            publisher = rosslt.Publisher('kept', Point, queue_size=1)
            point = rosslt.wait_for_message('passed', Point)
            while not rospy.is_shutdown():
                publisher.publish(point)
                time.sleep(0.05)
            """
        with Node('keeper', keeper):
            with Node('owner', owner):
                wait_until(lambda: '/owner' in rosslt('doctor', '/kept', *BRIEFLY).stdout, 'it keeps a message')
            found, code = findings('/kept')
            assert ('fault', '/owner: it has ended, so its locations cannot be changed') in found
            assert code == 1

    def test_finds_a_message_that_is_not_sent_again(self, nodes):
        once = """
            publisher = rosslt.Publisher('once', Point, queue_size=1)
            while not rospy.is_shutdown():
                time.sleep(0.01)
                if publisher.get_num_connections() and not sent:
                    publisher.publish(rosslt.location(1.0, name='x'), 0, 0)
                    sent = True
            """
        with Node('once', 'sent = False\n' + once.replace('\n            ', '\n')):
            wait_until(lambda: 'no topic' not in rosslt('doctor', '/once', '--time', '0.1').stderr, 'it publishes')
            shown = [rosslt('doctor', '/once').stdout for _ in range(2)]
            assert any(
                'does not reach later subscribers' in text or 'sent one message within 3 s' in text for text in shown
            )

    def test_what_is_latched_and_not_sent_yet_is_no_fault(self, nodes):
        code = "rosslt.Publisher('{}', Point, queue_size=1, latch={})\nrospy.spin()"
        with Node('later', code.format('later', True)), Node('never', code.format('unsent', False)):
            wait_until(lambda: is_published('/later') and is_published('/unsent'), 'they are advertised')
            wait = '/later has sent nothing yet; it is latched: each subscriber gets its last one'
            assert findings('/later') == ({('note', wait)}, 0)
            ((kind, text),), code = findings('/unsent')
            assert (kind, code) == ('fault', 1)
            assert text.startswith('/never sends nothing within 1.5 s: ')

    def test_finds_handles_that_nobody_shows(self, nodes):
        handles = """
            from visualization_msgs.msg import InteractiveMarkerUpdate
            publisher = rospy.Publisher('/handles/update', InteractiveMarkerUpdate, queue_size=1)
            rospy.Subscriber('/gate', PoseStamped, lambda gate: None)
            rospy.spin()
            """
        viewer = """
            from visualization_msgs.msg import InteractiveMarkerUpdate
            rospy.Subscriber('/{}/update', InteractiveMarkerUpdate, lambda update: None)
            rospy.spin()
            """
        assert ('note', 'no node makes handles to drag it with: rosrun rosslt slt_visualization does') in findings(
            '/gate'
        )[0]
        with Node('handles', handles):
            wait_until(
                lambda: 'nobody shows its handles' in rosslt('doctor', '/gate', *BRIEFLY).stdout, 'it makes handles'
            )
            found, code = findings('/gate')
            assert code == 0
            advice = (
                ': roslaunch rosslt rviz.launch does; in an RViz of your own, add a display InteractiveMarkers with '
                'the Update Topic /handles/update'
            )
            assert ('note', 'nobody shows its handles' + advice) in found
            assert any(
                kind == 'note' and text.startswith('/handles makes no handles') for kind, text in findings('/pose')[0]
            )
            with Node('viewer', viewer.format('handles')):
                wait_until(
                    lambda: ('ok', 'its handles are shown, through /handles/update') in findings('/gate')[0], 'shown'
                )
            with Node('aside', handles.replace('/handles', '/aside').replace('/gate', '/nothing')), Node(
                'viewer', viewer.format('aside')
            ):
                elsewhere = ('fault', 'nobody shows its handles; RViz shows /aside/update' + advice)
                wait_until(lambda: elsewhere in findings('/gate')[0], 'RViz to show others')

    def test_says_that_a_text_has_no_source(self, nodes):
        writer = """
            from visualization_msgs.msg import Marker
            publisher = rosslt.Publisher('/note', Marker, queue_size=1)
            rate = rospy.Rate(20)
            while not rospy.is_shutdown():
                size = rosslt.location(0.3)
                marker = Marker(text='%.1f m' % size)
                marker.scale.z = size
                publisher.publish(marker)
                rate.sleep()
            """
        with Node('writer', writer):
            wait_until(lambda: is_published('/note'), 'it publishes')
            text = ('note', 'text cannot be forced: it has no source, as /writer sends it')
            wait_until(lambda: text in findings('/note/text')[0], text[1])
            assert text not in findings('/note/scale')[0]

    def test_says_so_where_nobody_publishes(self, nodes):
        with Node('ear', "rospy.Subscriber('unheard', Pose, print)\nrospy.spin()"):
            wait_until(lambda: 'no topic' not in rosslt('doctor', '/unheard', *BRIEFLY).stderr, 'it subscribes')
            assert findings('/unheard') == (
                {('fault', 'nobody publishes it; the master keeps it as geometry_msgs/Pose')},
                1,
            )

    def test_looks_at_all_that_is_drawn_or_tracked(self, nodes):
        looked_at = {line.split('\t')[0] for line in rosslt('doctor').stdout.splitlines()}
        assert looked_at == {'/gate', '/pose'}
