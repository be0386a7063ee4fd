"""Nodes that send only what is new: whoever listens, from whenever on and through whatever is in between, gets the
provenance within a second, and never a wrong one."""

import json
import subprocess

import pytest
import rosbag
import rosgraph

from support.processes import Node, wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

CHANGES = '_rosslt/provenance:=changes'
RATE = 30

#: Sends at 30 Hz a pose whose y moves, and how often it has.
TALKER = """
    from geometry_msgs.msg import Pose, Point
    publisher = rosslt.Publisher('pose', Pose, queue_size=100)
    x = rosslt.location(0.5, name='x')
    rate = rospy.Rate(30)
    step = 0
    while not rospy.is_shutdown():
        step += 1
        publisher.publish(Pose(position=Point(x, x * (0.001 * step), step)))
        rate.sleep()
    """

#: Prints of each message, after those with `skipped`, [node of the source of x, whether y is right, bytes behind it].
LISTENER = """
    from geometry_msgs.msg import Pose
    sizes = []
    def tell(pose):
        found = [source.node for source in rosslt.sources(pose.position.x)]
        at = {source: 2.0 for source in rosslt.sources(pose.position.x)}
        is_right = not found or abs(rosslt.evaluate(pose.position.y, at) - 0.002 * pose.position.z) < 1e-9
        os.write(1, (json.dumps([found, is_right]) + os.linesep).encode())  # of two threads, line by line
    rosslt.Subscriber('pose', Pose, tell, queue_size=1000)
    rospy.spin()
    """


@pytest.fixture(autouse=True)
def _running(master):
    """Every test has its own master."""


def heard(listener, count):
    """What a listener prints of so many messages; all of it is right."""
    found = [json.loads(listener.read_line()) for _ in range(count)]
    assert all(is_right for _, is_right in found)
    return [nodes for nodes, _ in found]


def plain_at_first(found):
    """How many messages come without provenance before the first that has one, which all others have."""
    first = next(place for place, nodes in enumerate(found) if nodes)
    assert all(found[first:])
    return first


def sizes_of(topic, count):
    """The bytes of the next messages of a topic."""
    code = """
        def tell(message):
            print(len(message._buff), flush=True)
        rospy.Subscriber(%r, rospy.AnyMsg, tell, queue_size=1000)
        rospy.spin()
        """
    with Node('sizes', code % topic) as node:
        return [int(node.read_line()) for _ in range(count)]


def test_late_joiners_have_the_provenance_of_each_message():
    with Node('talker', TALKER, CHANGES):
        for name in ('early', 'late', 'later'):
            with Node(name, LISTENER) as listener:
                assert plain_at_first(heard(listener, 2 * RATE)) == 0


def test_most_messages_are_short_and_in_full_mode_none():
    with Node('talker', TALKER, CHANGES):
        changes = sizes_of('pose', 3 * RATE)
        assert sorted(changes)[len(changes) // 2] <= 80
        assert max(changes) > 100
        set_mode('full')
        wait_until(lambda: min(sizes_of('pose', RATE)) > 100, 'all are full')
        set_mode('nonsense')
        wait_until(lambda: min(sizes_of('pose', RATE)) > 100, 'all are full')
        set_mode('changes')
        wait_until(lambda: min(sizes_of('pose', RATE)) <= 80, 'most are short again')
    rosgraph.Master('/test').deleteParam('/talker/rosslt/provenance')
    with Node('talker', TALKER):
        assert min(sizes_of('pose', 2 * RATE)) > 100, 'without the parameter all are full'


def set_mode(word):
    rosgraph.Master('/test').setParam('/talker/rosslt/provenance', word)


def test_a_wrong_word_for_it_is_reported():
    with Node('talker', TALKER, '_rosslt/provenance:=nonsense') as talker:
        wait_until(
            lambda: "rosslt/provenance is 'nonsense' instead of 'changes' or 'full'" in talker.logged(), 'it says so'
        )


@pytest.mark.parametrize(
    'command', [['relay', '/pose', '/passed'], ['mux', '/passed', '/pose', '/other']], ids=['relay', 'mux']
)
def test_behind_a_relay_the_provenance_is_there_within_a_second(command):
    with Node('talker', TALKER, CHANGES), Started('rosrun', 'topic_tools', *command):
        for name in ('early', 'late'):
            with Node(name, LISTENER, 'pose:=/passed') as listener:
                assert plain_at_first(heard(listener, 3 * RATE)) <= RATE + 5


class Started:
    """A command that runs for a while."""

    def __init__(self, *command):
        self.command = command

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


def test_behind_a_throttle_it_is_there_once_a_full_one_has_passed():
    with Node('talker', TALKER, CHANGES), Started(
        'rosrun', 'topic_tools', 'throttle', 'messages', '/pose', '10', '/few'
    ), Node('listener', LISTENER, 'pose:=/few') as listener:
        found = heard(listener, 1)
        while not found[-1]:
            found += heard(listener, 1)
        assert all(heard(listener, 30)), 'from then on each has it'


def test_two_publishers_of_a_topic_are_never_mixed_up():
    with Node('one', TALKER, CHANGES), Node('two', TALKER, CHANGES), Node('listener', LISTENER) as listener:
        found = heard(listener, 4 * RATE)
        assert {tuple(nodes) for nodes in found[2 * RATE :]} == {('/one',), ('/two',)}


def test_a_latched_message_a_slow_one_and_one_to_a_single_peer_are_full():
    code = """
        class Greeter(rospy.SubscribeListener):
            def peer_subscribe(self, name, publish, peer_publish):
                peer_publish(Float64(x))
        x = 2.5 * rosslt.location(0.5, name='x')
        latched = rosslt.Publisher('latched', Float64, queue_size=10, latch=True)
        greeting = rosslt.Publisher('greeting', Float64, queue_size=10, subscriber_listener=Greeter())
        while not rospy.is_shutdown():
            latched.publish(x)
            time.sleep(0.02)
        """
    with Node('talker', code, CHANGES):
        assert len(set(sizes_of('latched', 20))) == 1
        greetings = {sizes_of('greeting', 1)[0] for _ in range(3)}
        assert len(greetings) == 1
        assert min(greetings) > 40


@pytest.fixture
def bag(tmp_path):
    """A recording of three seconds of a talker that sends only what is new."""
    path = tmp_path / 'run.bag'
    with Node('talker', TALKER, CHANGES):
        subprocess.run(
            ['rosbag', 'record', '-O', str(path), '--limit', str(3 * RATE), '/pose'],
            check=True,
            stdout=subprocess.DEVNULL,
            timeout=60,
        )
        wait_until(path.exists, 'the bag is there')
    return path


def test_a_recorded_bag_that_is_cut_in_two_keeps_all_for_the_command_and_loses_a_second_where_it_is_played(
    bag, tmp_path
):
    with rosbag.Bag(str(bag)) as whole, rosbag.Bag(str(tmp_path / 'second.bag'), 'w') as second:
        recorded = list(whole.read_messages(raw=True, return_connection_header=True))
        from_ = next(place for place in range(RATE, 2 * RATE) if recorded[place][1][1].endswith(b'rSLR'))
        for name, raw, stamp, header in recorded[from_:]:
            second.write(name, raw, stamp, raw=True, connection_header=header)
    count = len(recorded) - from_
    printed = rosslt('bag', str(tmp_path / 'second.bag')).stdout.split('\t')
    assert printed[2:4] == [str(count), str(count)]
    player = Started('rosbag', 'play', '--wait-for-subscribers', str(tmp_path / 'second.bag'))
    with Node('listener', LISTENER) as listener, player:
        assert plain_at_first(heard(listener, count)) <= RATE + 5


def test_the_whole_bag_plays_as_it_was(bag):
    with Node('listener', LISTENER) as listener, Started('rosbag', 'play', '--wait-for-subscribers', str(bag)):
        assert plain_at_first(heard(listener, 3 * RATE)) == 0
