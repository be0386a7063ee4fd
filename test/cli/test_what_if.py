"""`rosslt bag --set`: the messages of a bag as they would have been are those of a real run with that value."""

import pytest
import rosbag

from rosslt import messages, values
from support.processes import Node
from support.shell import failure, lines, record_bag, rosslt

pytestmark = pytest.mark.rostest

COUNT = 40

#: No branches, and a wait for its recorder, so that all runs send the same messages but for what the location makes.
PLANNER = """
    from geometry_msgs.msg import PoseArray
    from nav_msgs.msg import Odometry
    from std_msgs.msg import Float32, Int32
    from rosslt import math

    odometry = rosslt.Publisher('odometry', Odometry, queue_size=100)
    way = rosslt.Publisher('way', PoseArray, queue_size=100)
    narrow = rosslt.Publisher('narrow', Float32, queue_size=100)
    whole = rosslt.Publisher('whole', Int32, queue_size=100)
    tracked = rosslt.Publisher('tracked', PoseTracked, queue_size=100)
    plain = rospy.Publisher('plain', Float64, queue_size=100)
    topics = odometry, way, narrow, whole, tracked, plain
    while any(not topic.get_num_connections() for topic in topics):
        time.sleep(0.01)
    rate = rospy.Rate(50)
    for step in range({count}):
        speed = rosslt.location(0.5, name='speed', minimum=0.0, maximum=2.0)
        turn = rosslt.location(0.25, name='turn')
        number = rosslt.location(3, name='number')
        along = 0.02 * step
        message = Odometry()
        message.header.seq = step
        message.header.frame_id = rosslt.location('map', name='frame') + '/odometry'
        message.pose.pose.position.x = speed * along * math.cos(turn * along) + 1
        message.pose.pose.position.y = speed * along * math.sin(turn * along)
        message.pose.pose.orientation.z = math.sin(turn * along / 2)
        message.pose.pose.orientation.w = math.cos(turn * along / 2)
        message.twist.twist.linear.x = speed
        message.pose.covariance[0] = (speed / (1 + along)) ** 2
        odometry.publish(message)
        way.publish(poses=[Pose(position=Point(speed * each, turn, 0.0)) for each in range(3)])
        narrow.publish(speed / 3)
        whole.publish(2 * number)
        tracked.publish(position=Point(speed + along, 0.0, number * 1.0))
        plain.publish(float(speed))
        rate.sleep()
    rospy.spin()
    """

ROOTS = """
    publisher = rosslt.Publisher('root', Float64, queue_size=10)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.math.sqrt(rosslt.location(4.0, name='a')))
        rate.sleep()
    """

TOPICS = ['odometry', 'way', 'narrow', 'whole', 'tracked', 'plain']


def record(path, *options):
    """Record a run of the node, which is still there afterwards."""
    node = Node('planner', PLANNER.format(count=COUNT), '_rosslt/rate:=1000', *options)
    record_bag(path, COUNT, *TOPICS)
    return node


@pytest.fixture(scope='module')
def runs(master, tmp_path_factory):
    """The bags of a run, and of one with other values; the node runs."""
    folder = tmp_path_factory.mktemp('runs')
    with record(folder / 'other.bag', '_rosslt/speed:=0.8', '_rosslt/number:=5', '_rosslt/frame:=world'):
        pass
    for name in ('speed', 'number', 'frame'):
        master.deleteParam('/planner/rosslt/' + name)
    with record(folder / 'run.bag'):
        yield folder


def held(path):
    """{topic: [message]} of a bag, without provenance."""
    found = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, raw, _ in bag.read_messages(raw=True):
            found.setdefault(topic.lstrip('/'), []).append(values.untracked(messages.decode(raw[1], raw[-1]).message))
    return found


def rounding(topic):
    """How far, relative, a value may be from another one that was computed in another order; `narrow` has 32 bits."""
    return 1.2e-7 if topic == 'narrow' else 1e-12


SETTINGS = '--set', '/planner/speed=0.8', '--set', '/planner/number=5', '--set', '/planner/frame=world'


def test_each_field_is_that_of_a_real_run(runs):
    printed = lines('bag', str(runs / 'run.bag'), *SETTINGS, '-o', str(runs / 'what_if.bag'))
    assert sorted(printed) == sorted([topic, str(COUNT), str(0 if topic == 'plain' else COUNT)] for topic in TOPICS)
    real, found, before = held(runs / 'other.bag'), held(runs / 'what_if.bag'), held(runs / 'run.bag')
    assert found['plain'] == before['plain'] != real['plain']
    compared = 0
    for topic in TOPICS[:-1]:
        assert len(found[topic]) == len(real[topic]) == COUNT
        for one, other in zip(found[topic], real[topic]):
            for (path, value), (_, wanted) in zip(values.leaves(one), values.leaves(other)):
                assert value == pytest.approx(wanted, rel=rounding(topic), abs=1e-12), (topic, path)
                compared += 1
    assert compared > 30 * COUNT


def test_times_connections_and_provenance_stay(runs):
    lines('bag', str(runs / 'run.bag'), *SETTINGS, '-o', str(runs / 'again.bag'))
    told = []
    for name in ('run.bag', 'again.bag'):
        with rosbag.Bag(str(runs / name)) as bag:
            told.append(
                [
                    (topic, stamp, header['callerid'], header['md5sum'])
                    for topic, _, stamp, header in bag.read_messages(raw=True, return_connection_header=True)
                ]
            )
    assert told[0] == told[1]
    assert lines('bag', str(runs / 'run.bag')) == lines('bag', str(runs / 'again.bag'))
    # so the way back leads to what was recorded
    back = '--set', '/planner/speed=0.5', '--set', '/planner/number=3', '--set', '/planner/frame=map'
    lines('bag', str(runs / 'again.bag'), *back, '-o', str(runs / 'back.bag'))
    for topic, recorded in held(runs / 'run.bag').items():
        for one, other in zip(recorded, held(runs / 'back.bag')[topic]):
            for (_, value), (_, wanted) in zip(values.leaves(one), values.leaves(other)):
                assert value == pytest.approx(wanted, rel=rounding(topic), abs=1e-12)


@pytest.mark.parametrize(
    ('setting', 'reason'),
    [
        ('/planner/speed=fast', "'fast' is not a float"),
        ('/planner/number=1.5', "'1.5' is not an int"),
        ('/planner/sped=1', '(did you mean /planner/speed?)'),
        ('/planner/speed', 'is not NODE/LOCATION=VALUE'),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_is_written(runs, setting, reason):
    assert reason in failure('bag', str(runs / 'run.bag'), '--set', setting, '-o', str(runs / 'refused.bag'))
    assert not list(runs.glob('refused*'))


def test_nothing_is_overwritten(runs):
    (runs / 'there.bag').write_text('something')
    told = failure('bag', str(runs / 'run.bag'), '--set', '/planner/speed=1', '-o', str(runs / 'there.bag'))
    assert 'there.bag exists already' in told
    assert (runs / 'there.bag').read_text() == 'something'
    assert '-o OUT together' in failure('bag', str(runs / 'run.bag'), '--set', '/planner/speed=1')


def test_messages_that_have_no_value_any_more_are_left_out_and_named(master, tmp_path):
    with Node('rooter', ROOTS, '_rosslt/rate:=1000'):
        record_bag(tmp_path / 'run.bag', 5, 'root')
        result = rosslt('bag', str(tmp_path / 'run.bag'), '--set', '/rooter/a=-1', '-o', str(tmp_path / 'out.bag'))
        assert result.returncode == 0
        assert result.stdout == 'root\t5\t0\n'
        assert result.stderr == 'rosslt bag: 5 messages on root are left out: math domain error\n'
        assert held(tmp_path / 'out.bag') == {}
