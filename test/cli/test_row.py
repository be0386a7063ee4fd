"""`rosslt row`: waypoints of running nodes and live scripts are added, deleted and moved in their files."""

import contextlib
import subprocess

import pytest

from support.processes import wait_until
from support.shell import failure, lines, rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

PATROL = """import rospy
from geometry_msgs.msg import PointStamped

WAYPOINTS = [
    (0.25, 1.0),  # the dock
    (1.25, 3.0),
    (2.25, 1.0)  # the door
]
HEIGHT = 0.75
rospy.init_node('patrol')
pub = rospy.Publisher('patrol', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = sum([x for x, _ in WAYPOINTS])
    p.point.y = sum([y for _, y in WAYPOINTS])
    p.point.z = HEIGHT
    pub.publish(p)
    rospy.sleep(0.03)
"""


@contextlib.contextmanager
def patrol(folder, name):
    """An unmodified node with a list of waypoints."""
    with Unmodified(folder, name, PATROL.replace("'patrol'", f"'{name}'")) as node:
        wait_until(lambda: 'WAYPOINTS_2_1' in rosslt('list', node.name).stdout, 'its numbers are known')
        yield node


def test_a_waypoint_is_duplicated_and_those_below_are_saved_where_they_stand(master, tmp_path):
    with patrol(tmp_path, 'patrol') as node:
        before, listed = node.file.read_text(), lines('list', '/patrol')
        diff = rosslt('row', 'duplicate', '/patrol/WAYPOINTS_1', '--diff')
        assert (diff.returncode, diff.stderr) == (0, '')
        assert '\n+    (1.25, 3.0),\n' in diff.stdout
        assert node.file.read_text() == before
        done = rosslt('row', 'duplicate', '/patrol/WAYPOINTS_1')
        assert done.returncode == 0, done.stderr
        assert done.stdout == f'/patrol/WAYPOINTS_1_0\tduplicate\t{node.file}:6\n'
        assert done.stderr.startswith('rosslt row: /patrol takes the rows as they are now at its next start')
        twice = before.replace('    (1.25, 3.0),\n', '    (1.25, 3.0),\n' * 2)
        assert node.file.read_text() == twice
        assert lines('list', '/patrol') == listed
        assert rosslt('set', '/patrol/WAYPOINTS_2_0', '2.5').returncode == 0
        assert failure('row', 'up', '/patrol/WAYPOINTS_2_1') == (
            f'rosslt row: nothing is written: {node.file}:7:12: WAYPOINTS_2_0 is changed, and not saved: '
            '`rosslt save /patrol` first'
        )
        assert rosslt('save', '/patrol').returncode == 0
        assert rosslt('save', '/patrol').stderr == 'rosslt save: nothing to save: all is as the files say\n'
        assert rosslt('set', '/patrol/WAYPOINTS_2_0', '2.75').returncode == 0
        assert rosslt('save', '/patrol').returncode == 0
        assert node.file.read_text() == twice.replace('2.25', '2.75')
        assert rosslt('row', 'delete', '/patrol/WAYPOINTS_0_1').returncode == 0
        assert node.file.read_text() == twice.replace('2.25', '2.75').replace('    (0.25, 1.0),  # the dock\n', '')


def test_what_may_be_another_row_now_and_what_is_none_is_refused(master, tmp_path):
    with patrol(tmp_path, 'guard') as node:
        assert rosslt('row', 'delete', '/guard/WAYPOINTS_2').returncode == 0
        after = PATROL.replace('(1.25, 3.0),\n    (2.25, 1.0)  # the door', '(1.25, 3.0)').replace(
            "'patrol'", "'guard'"
        )
        assert node.file.read_text() == after
        told = failure('row', 'delete', '/guard/WAYPOINTS_1')
        assert told == (
            f'rosslt row: nothing is written: {node.file}:6:6: its line was edited since the node read it, and may be '
            'one of several; start the node again'
        )
        assert 'has no location WAYPOINTS' in failure('row', 'delete', '/guard/WAYPOINTS')
        assert 'no list of alike rows stands here' in failure('row', 'delete', '/guard/HEIGHT')
        assert rosslt('row', 'left', '/guard/WAYPOINTS_1').returncode == 2
        assert node.file.read_text() == after


def test_a_moved_waypoint_takes_effect_at_once(master, tmp_path):
    with patrol(tmp_path, 'watch') as node:
        assert rosslt('row', 'down', '/watch/WAYPOINTS_0').returncode == 0
        dock, other = '(0.25, 1.0)', '(1.25, 3.0)'
        assert f'    {other},\n    {dock},  # the dock\n' in node.file.read_text()
        wait_until(lambda: rosslt('get', '/watch/WAYPOINTS_0_0').stdout == '1.25\n', 'it is read again')


@pytest.fixture
def script(master, tmp_path):
    """The node of a live script, and the file of that."""
    file = tmp_path / 'tour.script'
    file.write_text('# tour\ngoto(2.0, 1.0, 1.5)  # in\n\ngoto(-1, 2, 0.5)')
    process = subprocess.Popen(['rosrun', 'rosslt', 'interactive_script', f'_file:={file}', '__name:=tour'])
    try:
        wait_until(lambda: len(in_list()) == 6, 'the script runs', 60)
        yield file
    finally:
        process.terminate()
        process.wait(60)


def in_list():
    """The values of the numbers of the script."""
    listed = rosslt('list', '/tour').stdout.splitlines()
    return [line.split('\t') for line in listed if 'tour.script:' in line]


def test_a_live_script_runs_again_with_its_new_waypoint(script):
    def name_at(line):
        return next(row[0] for row in in_list() if any(f'tour.script:{line}:' in cell for cell in row))

    done = rosslt('row', 'duplicate', name_at(2))
    assert (done.returncode, done.stderr) == (0, 'rosslt row: /tour runs the script again\n')
    twice = '# tour\n' + 'goto(2.0, 1.0, 1.5)  # in\n' * 2 + '\ngoto(-1, 2, 0.5)'
    assert script.read_text() == twice
    wait_until(lambda: len(in_list()) == 9, 'it runs with the waypoint')
    assert rosslt('row', 'up', name_at(5)).returncode == 0
    assert script.read_text() == '# tour\ngoto(2.0, 1.0, 1.5)  # in\ngoto(-1, 2, 0.5)\n\ngoto(2.0, 1.0, 1.5)  # in'


def test_a_parameter_and_what_a_function_reads_are_refused(nodes):
    for name, why in (
        ('~parking/0', 'no file is known that it was read from'),
        ('pin', 'its node reads it by a function'),
    ):
        assert f': {why}' in failure('row', 'delete', f'/talker/{name}')
