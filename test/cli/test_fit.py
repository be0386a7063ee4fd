"""`rosslt fit`: a robot's wheel radius and wheelbase from the odometry in a bag and the truth beside it."""

import re

import numpy
import pytest
import rosbag
from scipy.optimize import least_squares

from support.processes import Node
from support.shell import failure, lines, on_terminal, record_bag, rosslt

pytestmark = pytest.mark.rostest

COUNT = 50
RADIUS, BASE = 0.1, 0.5
TRUE_RADIUS, TRUE_BASE = 0.1037, 0.462
NOISE = 0.004

#: The turns of the left and of the right wheel in each step, in radians.
WHEELS = '[(1.0 + 0.5 * math.sin(0.3 * step), 1.2 + 0.6 * math.cos(0.2 * step)) for step in range({})]'.format(COUNT)

#: It computes odometry as such nodes do; nothing in it is about fitting.
ODOMETRY = f"""
    import math
    from geometry_msgs.msg import PoseStamped, Vector3Stamped
    from rosslt import math as tracked

    class Wheels:
        turns = {WHEELS}

    odometry = rosslt.Publisher('odometry', Vector3Stamped, queue_size=100)
    truth = rospy.Publisher('truth', Vector3Stamped, queue_size=100)
    while not (odometry.get_num_connections() and truth.get_num_connections()):
        time.sleep(0.01)
    radius = rosslt.location({RADIUS}, name='radius', minimum=0.01)
    base = rosslt.location({BASE}, name='base')
    x = y = heading = true_x = true_y = true_heading = 0.0
    noise = __import__('random').Random(3)
    rate = rospy.Rate(25)
    for step, (left, right) in enumerate(Wheels.turns):
        way = radius * (left + right) / 2
        x, y = x + way * tracked.cos(heading), y + way * tracked.sin(heading)
        heading = heading + radius * (right - left) / base
        way = {TRUE_RADIUS} * (left + right) / 2
        true_x, true_y = true_x + way * math.cos(true_heading), true_y + way * math.sin(true_heading)
        true_heading = true_heading + {TRUE_RADIUS} * (right - left) / {TRUE_BASE}
        for publisher, values in ((odometry, (x, y, heading)), (truth, (true_x, true_y, true_heading))):
            message = Vector3Stamped()
            message.header.stamp = rospy.Time(100 + step)
            message.vector.x, message.vector.y, message.vector.z = values
            if publisher is truth:
                message.vector.x += noise.gauss(0.0, {NOISE})
                message.vector.y += noise.gauss(0.0, {NOISE})
            publisher.publish(message)
        rate.sleep()
    rospy.spin()
    """

FIELDS = '/odometry/vector/x', '/odometry/vector/y', '/odometry/vector/z'
TRUTH = '/truth/vector/x', '/truth/vector/y', '/truth/vector/z'


@pytest.fixture(scope='module')
def run(master, tmp_path_factory):
    """The node, and the bag of its run."""
    path = tmp_path_factory.mktemp('fit') / 'run.bag'
    with Node('robot', ODOMETRY, '_rosslt/rate:=1000') as node:
        record_bag(path, COUNT, '/odometry', '/truth')
        yield node, str(path)


def by_hand(path):
    """What SciPy finds with a residual that is written by hand."""
    with rosbag.Bag(path) as bag:
        truth = [(m.vector.x, m.vector.y, m.vector.z) for _, m, _ in bag.read_messages(['/truth'])]
    turns = eval(WHEELS, {'math': __import__('math')})

    def residual(point):
        radius, base = point
        pose, found = numpy.zeros(3), []
        for left, right in turns:
            way = radius * (left + right) / 2
            pose = pose + [
                way * numpy.cos(pose[2]),
                way * numpy.sin(pose[2]),
                radius * (right - left) / base,
            ]
            found.append(pose)
        return (numpy.array(found) - truth).ravel()

    return least_squares(residual, (RADIUS, BASE), x_scale='jac', xtol=1e-14, ftol=1e-14, gtol=1e-14)


def test_it_is_the_optimum_of_scipy_without_a_line_of_model(run):
    _, path = run
    found = {line[0]: list(map(float, line[1:])) for line in lines('fit', path, *FIELDS, '--to', *TRUTH)}
    best = by_hand(path)
    assert found.keys() == {'/robot/radius', '/robot/base'}
    assert found['/robot/radius'][:2] == [RADIUS, pytest.approx(best.x[0], rel=1e-6)]
    assert found['/robot/base'][:2] == [BASE, pytest.approx(best.x[1], rel=1e-6)]
    errors = numpy.sqrt(numpy.diag(numpy.linalg.inv(best.jac.T @ best.jac)) * 2 * best.cost / (3 * COUNT - 2))
    assert [found['/robot/radius'][2], found['/robot/base'][2]] == pytest.approx(errors.tolist(), rel=1e-3)
    assert abs(found['/robot/radius'][1] - TRUE_RADIUS) < 5 * errors[0] < 1e-3
    assert abs(found['/robot/base'][1] - TRUE_BASE) < 5 * errors[1] < 1e-2


def test_one_location_alone_and_a_robust_loss(run):
    _, path = run
    (line,) = lines('fit', path, FIELDS[0], '--to', TRUTH[0], '--source', '/robot/radius')
    assert line[0] == '/robot/radius'
    robust = lines('fit', path, *FIELDS, '--to', *TRUTH, '--loss', 'soft_l1', '--scale', '0.01')
    assert abs(float(robust[0][2]) - TRUE_RADIUS) < 1e-3


def test_a_person_sees_what_it_brings(run):
    _, path = run
    printed = on_terminal('fit', path, *FIELDS, '--to', *TRUTH)
    assert re.fullmatch(
        r'/robot/radius  0\.1  ->  0\.103\d+  \+-  [\d.e-]+\n/robot/base    0\.5  ->  0\.46\d+   ?\+-  [\d.e-]+\n'
        r'150 pairs; their differences have been [\d.]+, and would be [\d.]+\n',
        printed,
    )


def test_it_is_applied_to_the_node_and_its_file_stays(run):
    node, path = run
    with open(node.file, encoding='utf-8') as file:
        before = file.read()
    found = {line[0]: line[2] for line in lines('fit', path, *FIELDS, '--to', *TRUTH, '--apply')}
    assert {name: rosslt('get', name).stdout.strip() for name in found} == found
    assert float(found['/robot/radius']) != RADIUS
    with open(node.file, encoding='utf-8') as file:
        assert file.read() == before
    assert lines('undo')
    assert [rosslt('get', name).stdout.strip() for name in found] == [str(RADIUS), str(BASE)]


def test_a_locked_node_is_not_changed(run):
    _, path = run
    rosslt('lock', '/robot')
    try:
        refused = rosslt('fit', path, *FIELDS, '--to', *TRUTH, '--apply')
        assert (refused.returncode, 'is locked' in refused.stderr) == (1, True), refused
    finally:
        rosslt('unlock', '/robot')
    assert rosslt('get', '/robot/radius').stdout.strip() == str(RADIUS)


def test_it_is_applied_and_saved_where_it_stands(run):
    node, path = run
    found = {line[0]: line[2] for line in lines('fit', path, *FIELDS, '--to', *TRUTH, '--save')}
    assert rosslt('get', '/robot/radius').stdout.strip() == found['/robot/radius']
    with open(node.file, encoding='utf-8') as file:
        text = file.read()
    assert f"rosslt.location({found['/robot/radius']}, name='radius'" in text
    assert f"rosslt.location({found['/robot/base']}, name='base'" in text


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        ((FIELDS[0], '--to', *TRUTH), 'found 1 fields and 3 after --to'),
        ((FIELDS[0], '--to', '/truth/vector'), '/truth/vector is of type geometry_msgs/Vector3, and not a number'),
        ((FIELDS[0], '--to', '/truht/vector/x'), 'has no topic /truht/vector/x'),
        ((TRUTH[0], '--to', FIELDS[0]), 'no result comes from a source'),
        ((FIELDS[0], '--to', TRUTH[0], '--source', 'nobody'), 'nobody is not among the sources'),
        ((FIELDS[0], '--to', TRUTH[0], '--slack', '-1'), 'no stamp of /odometry/vector/x is within -1 s'),
    ],
)
def test_what_cannot_be_fitted_is_said(run, arguments, reason):
    assert reason in failure('fit', run[1], *arguments)


#: A camera that sees a board from above: as the camera only slides, no picture tells its height from that of the board.
CAMERA = """
    from geometry_msgs.msg import Vector3Stamped

    seen = rosslt.Publisher('seen', Vector3Stamped, queue_size=100)
    measured = rosslt.Publisher('measured', Vector3Stamped, queue_size=100)
    while not (seen.get_num_connections() and measured.get_num_connections()):
        time.sleep(0.01)
    height = rosslt.location(1.0, name='height')
    board = rosslt.location(0.2, name='board')
    offset = rosslt.location(0.0, name='offset')
    rate = rospy.Rate(25)
    for step in range(20):
        here = offset + 0.1 * step, 2 * height - 2 * board
        for publisher, values in ((seen, here), (measured, (0.1 * step + 0.3, 1.8))):
            message = Vector3Stamped()
            message.header.stamp = rospy.Time(100 + step)
            message.vector.x, message.vector.y = values
            publisher.publish(message)
        rate.sleep()
    rospy.spin()
    """
SEEN = '/seen/vector/x', '/seen/vector/y', '--to', '/measured/vector/x', '/measured/vector/y'


@pytest.fixture(scope='module')
def slide(master, tmp_path_factory):
    """The bag of a camera that slides over a board, and its node."""
    path = tmp_path_factory.mktemp('slide') / 'slide.bag'
    with Node('camera', CAMERA, '_rosslt/rate:=1000'):
        record_bag(path, 20, '/seen', '/measured')
        yield str(path)


def test_what_a_bag_does_not_determine_stays_and_is_said(slide):
    found = rosslt('fit', slide, *SEEN, '--apply')
    ((name, old, new, _),) = (line.split('\t') for line in found.stdout.splitlines())
    assert (name, old, float(new)) == ('/camera/offset', '0.0', pytest.approx(0.3))
    assert re.fullmatch(
        r'rosslt fit: /camera/(height|board) and /camera/(height|board) are not determined, and stay: they can move '
        r'together, /camera/\w+ by \+1, /camera/\w+ by \+1, and the fields stay as they are\. '
        r'Record another movement, .*\n',
        found.stderr,
    )
    assert [rosslt('get', f'/camera/{one}').stdout.strip() for one in ('height', 'board')] == ['1.0', '0.2']
    assert 'are not determined' in on_terminal('fit', slide, *SEEN)


def test_one_of_those_is_fitted_if_it_is_named(slide):
    (line,) = lines('fit', slide, *SEEN, '--source', '/camera/height')
    assert (line[0], float(line[2])) == ('/camera/height', pytest.approx(1.1))
    none = failure('fit', slide, *SEEN, '--source', '/camera/height', '--source', '/camera/board')
    assert 'slide.bag determines none of these locations. /camera/' in none


@pytest.mark.parametrize('scale', ['0', '-1', 'nan', 'inf'])
def test_a_scale_that_is_none_is_misuse(scale):
    result = rosslt('fit', 'run.bag', '/odom/x', '--to', '/truth/x', '--loss', 'huber', f'--scale={scale}')
    assert result.returncode == 2
    assert result.stderr.endswith(f'--scale must be finite and above 0, found {scale}\n')
