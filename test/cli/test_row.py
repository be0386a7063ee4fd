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
        assert done.stderr.startswith('rosslt row: /patrol has the rows as they are now at its next start')
        twice = before.replace('    (1.25, 3.0),\n', '    (1.25, 3.0),\n' * 2)
        assert node.file.read_text() == twice
        assert lines('list', '/patrol') == listed
        assert rosslt('set', '/patrol/WAYPOINTS_2_0', '2.5').returncode == 0
        assert failure('row', 'up', '/patrol/WAYPOINTS_2_1') == (
            f'rosslt row: nothing is written: {node.file}:7:12: WAYPOINTS_2_0 is changed, and not saved: '
            '`rosslt save /patrol` first'
        )
        assert rosslt('save', '/patrol').returncode == 0
        assert rosslt('save', '/patrol').stderr == (
            'rosslt save: nothing to save, but patrol.py: lines 6, 7 changed in other ways, which needs a restart of '
            'the node\n'
        )
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


def test_rows_of_numbers_are_taken_at_once_and_rows_with_texts_at_the_next_start(master, tmp_path):
    with patrol(tmp_path, 'taking') as node:
        text = node.file.read_text()
        node.file.write_text(text + ')')
        told = 'rosslt save: nothing to save, but taking.py: the node goes on with what was read before: '
        for _ in range(2):
            assert rosslt('save', '/taking').stderr.startswith(told)
        node.file.unlink()
        assert rosslt('save', '/taking').stderr.startswith(told)
        node.file.write_text(text)
        assert rosslt('save', '/taking').stderr == 'rosslt save: nothing to save: all is as the files say\n'
        assert rosslt('set', '/taking/WAYPOINTS_1_0', '9.5').returncode == 0
        assert 'WAYPOINTS_1_0 is changed, and not saved' in failure('row', 'down', '/taking/WAYPOINTS_0')
        assert rosslt('undo', '/taking').returncode == 0
        moved = rosslt('row', 'down', '/taking/WAYPOINTS_0')
        assert moved.stderr == 'rosslt row: /taking has the rows as they are now\n'
        assert rosslt('get', '/taking/WAYPOINTS_0_0').stdout == '1.25\n'
        text = node.file.read_text()
        node.file.write_text(text.replace('    rospy.sleep(0.03)', 'rospy.sleep(0.03)'))
        assert rosslt('save', '/taking').stderr == (
            'rosslt save: nothing to save, but taking.py: blocks of statements, or the blanks in a text, changed, '
            'which needs a restart of the node\n'
        )
    named = (
        PATROL.replace("'patrol'", "'named'").replace('for x, _ in', 'for _, x, _ in').replace('y for _', 'y for _, _')
    )
    for name, row in ('dock', '(0.25'), ('hall', '(1.25'), ('door', '(2.25'):
        named = named.replace(row, f"('{name}', {row[1:]}")
    with Unmodified(tmp_path, 'named', named) as node:
        wait_until(lambda: 'WAYPOINTS_2_2' in rosslt('list', '/named').stdout, 'its numbers are known')
        stale = 'named.py: lines 5, 6 stand in another order'
        moved = rosslt('row', 'down', '/named/WAYPOINTS_0')
        assert moved.stderr == 'rosslt row: /named has the rows as they are now at its next start\n'
        waits = f'rosslt save: nothing to save, but {stale}, which needs a restart of the node\n'
        assert rosslt('save', '/named').stderr == waits
        assert rosslt('set', '/named/WAYPOINTS_0_1', '0.5').returncode == 0
        assert rosslt('save', '/named').returncode == 0
        assert "('hall', 1.25, 3.0),\n    ('dock', 0.50, 1.0),  # the dock\n" in node.file.read_text()
        assert rosslt('save', '/named').stderr == waits


def undone(name, operation, place, when='has the rows as they are now'):
    """Undo the last change of a node, which is what was done with a row."""
    result = rosslt('undo', '/' + name.split('/')[1])
    assert (result.returncode, result.stdout) == (0, f'{name}\t{operation}\tundone\t{place}\n'), result.stderr
    assert result.stderr == (f'rosslt undo: /{name.split("/")[1]} {when}\n')


def test_a_last_row_without_a_comma_stays_itself_when_it_gets_one(master, tmp_path):
    with patrol(tmp_path, 'herald') as node:
        ids = [line.split('\t')[:4] for line in rosslt('list', '/herald').stdout.splitlines()]
        door, added = '(2.25, 1.0),  # the door\n', '    (9.5, 8.5)\n'
        node.file.write_text(node.file.read_text().replace('(2.25, 1.0)  # the door\n', door + added))
        told = 'nothing to save, but herald.py: line 8 changed in other ways, which needs a restart of the node\n'
        assert rosslt('save', '/herald').stderr == f'rosslt save: {told}'
        assert [line.split('\t')[:4] for line in rosslt('list', '/herald').stdout.splitlines()] == ids
        assert rosslt('set', '/herald/WAYPOINTS_2_0', '7.5').returncode == 0
        assert rosslt('save', '/herald').returncode == 0
        assert f'    (7.50, 1.0),  # the door\n{added}]' in node.file.read_text()
        assert rosslt('set', '/herald/WAYPOINTS_2_1', '6.5').returncode == 0
        text = node.file.read_text()
    with Unmodified(tmp_path, 'herald', text):
        wait_until(lambda: 'WAYPOINTS_3_1' in rosslt('list', '/herald').stdout, 'its numbers are known')
        names = ['2_0', '2_1', '3_0', '3_1']
        values = [rosslt('get', f'/herald/WAYPOINTS_{name}').stdout for name in names]
        assert values == ['7.5\n', '6.5\n', '9.5\n', '8.5\n']


def test_each_row_edit_is_undone_the_latest_first(master, tmp_path):
    with patrol(tmp_path, 'sentry') as node:
        texts, done = [node.file.read_text()], []
        for operation, row in (('duplicate', 1), ('up', 2), ('down', 0), ('delete', 2)):
            # of rows with the same numbers, which is which is not certain
            if texts[1:]:
                undone(*done.pop())
                texts.pop()
                assert node.file.read_text() == texts[-1]
            assert rosslt('row', operation, f'/sentry/WAYPOINTS_{row}').returncode == 0
            done.append((f'/sentry/WAYPOINTS_{row}_0', operation, f'{node.file}:{row + 5}'))
            texts.append(node.file.read_text())
        undone(*done.pop())
        assert rosslt('row', 'up', '/sentry/WAYPOINTS_2').returncode == 0
        moved = node.file.read_text()
        assert rosslt('row', 'delete', '/sentry/WAYPOINTS_0').returncode == 0
        undone('/sentry/WAYPOINTS_0_0', 'delete', f'{node.file}:5')
        assert node.file.read_text() == moved
        undone('/sentry/WAYPOINTS_2_0', 'up', f'{node.file}:7')
        assert node.file.read_text() == texts[0]
        assert 'there is no change to take back' in failure('undo', '/sentry')


def test_row_edits_and_values_are_undone_in_their_order(master, tmp_path):
    with patrol(tmp_path, 'warden') as node:
        before = node.file.read_text()
        assert rosslt('set', '/warden/HEIGHT', '0.5').returncode == 0
        assert rosslt('set', '/warden/HEIGHT', '0.25').returncode == 0
        assert rosslt('undo', '/warden').returncode == 0
        assert rosslt('row', 'duplicate', '/warden/WAYPOINTS_0').returncode == 0
        assert rosslt('set', '/warden/HEIGHT', '1.5').returncode == 0
        assert rosslt('undo', '/warden').stdout.startswith('/warden/HEIGHT\t1.5\t0.5\t')
        undone('/warden/WAYPOINTS_0_0', 'duplicate', f'{node.file}:5')
        assert node.file.read_text() == before
        assert rosslt('undo', '/warden').stdout.startswith('/warden/HEIGHT\t0.5\t0.75\t')
        assert rosslt('set', '/warden/WAYPOINTS_0_0', '0.75').returncode == 0
        assert rosslt('save', '/warden').returncode == 0
        saved = node.file.read_text()
        assert rosslt('row', 'down', '/warden/WAYPOINTS_0').returncode == 0
        wait_until(lambda: rosslt('get', '/warden/WAYPOINTS_1_0').stdout == '0.75\n', 'it is read again')
        undone('/warden/WAYPOINTS_0_0', 'down', f'{node.file}:5')
        assert node.file.read_text() == saved
        assert rosslt('undo', '/warden').stdout.startswith('/warden/WAYPOINTS_0_0\t0.75\t0.25\t')


def test_a_saved_value_that_is_taken_back_is_said_to_be_in_the_file(master, tmp_path):
    with patrol(tmp_path, 'clerk') as node:

        def taken_back():
            undo = rosslt('undo')
            assert undo.stdout.startswith('/clerk/HEIGHT\t'), undo
            return undo.stderr

        still = f'rosslt undo: the saved value of HEIGHT still stands in {node.file}; '
        still += '`rosslt save /clerk` writes the present one\n'
        assert rosslt('set', '/clerk/HEIGHT', '0.5').returncode == 0
        assert taken_back() == ''
        assert rosslt('set', '/clerk/HEIGHT', '0.5').returncode == 0
        assert rosslt('save', '/clerk').returncode == 0
        assert rosslt('set', '/clerk/HEIGHT', '0.25').returncode == 0
        assert taken_back() == ''
        assert taken_back() == still
        assert 'HEIGHT = 0.50' in node.file.read_text()
        assert rosslt('save', '/clerk').returncode == 0
        assert 'HEIGHT = 0.75' in node.file.read_text()


def test_what_an_edit_brought_is_taken_back_in_the_file(master, tmp_path):
    with patrol(tmp_path, 'usher') as node:
        assert rosslt('set', '/usher/HEIGHT', '0.5').returncode == 0
        assert rosslt('save', '/usher').returncode == 0
        saved = node.file.read_text()
        assert 'HEIGHT = 0.50' in saved

        def edit(text, value):
            node.file.write_text(text)
            wait_until(lambda: rosslt('get', '/usher/HEIGHT').stdout == f'{value}\n', 'it is read again')

        edit(saved.replace('0.50', '1.25'), 1.25)
        assert 'HEIGHT has been changed since by editor: take that back in the file first' in failure('undo', '/usher')
        edit(saved, 0.5)
        assert rosslt('undo', '/usher').stdout.startswith('/usher/HEIGHT\t0.5\t0.75\t')


def test_a_row_edit_is_undone_after_the_node_was_started_again(master, tmp_path):
    with patrol(tmp_path, 'keeper') as node:
        before = node.file.read_text()
        assert rosslt('set', '/keeper/HEIGHT', '0.5').returncode == 0
        assert rosslt('row', 'delete', '/keeper/WAYPOINTS_0').returncode == 0
        after = node.file.read_text()
    with Unmodified(tmp_path, 'keeper', after) as node:
        wait_until(lambda: 'WAYPOINTS_1_1' in rosslt('list', '/keeper').stdout, 'its numbers are known')
        waits = 'has the rows as they are now at its next start'
        undone('/keeper/WAYPOINTS_0_0', 'delete', f'{node.file}:5', waits)
        assert node.file.read_text() == before
        assert rosslt('undo', '/keeper').stdout.startswith('/keeper/HEIGHT\t0.5\t0.75\t')


def test_a_row_edit_is_undone_beside_saved_values_alone(master, tmp_path):
    with patrol(tmp_path, 'porter') as node:
        before = node.file.read_text()
        assert rosslt('row', 'down', '/porter/WAYPOINTS_0').returncode == 0
        assert rosslt('row', 'duplicate', '/porter/WAYPOINTS_2').returncode == 0
        assert rosslt('set', '/porter/HEIGHT', '0.25').returncode == 0
        assert rosslt('save', '/porter').returncode == 0
        assert rosslt('undo', '/porter').stdout.startswith('/porter/HEIGHT\t0.25\t0.75\t')
        undone('/porter/WAYPOINTS_2_0', 'duplicate', f'{node.file}:7')
        assert node.file.read_text().count('2.25') == 1
        edited = node.file.read_text() + '# mine\n'
        node.file.write_text(edited)
        assert failure('undo', '/porter') == (
            f'rosslt undo: nothing is taken back: {node.file}: it was edited since `rosslt row down '
            '/porter/WAYPOINTS_0_0`; take that edit back, and try again'
        )
        assert node.file.read_text() == edited
        node.file.write_text(edited.replace('# mine\n', ''))
        undone('/porter/WAYPOINTS_0_0', 'down', f'{node.file}:5')
        assert node.file.read_text() == before.replace('HEIGHT = 0.75', 'HEIGHT = 0.25')


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

    before, first, last = script.read_text(), name_at(2), name_at(4)
    done = rosslt('row', 'duplicate', first)
    assert (done.returncode, done.stderr) == (0, 'rosslt row: /tour runs the script again\n')
    twice = '# tour\n' + 'goto(2.0, 1.0, 1.5)  # in\n' * 2 + '\ngoto(-1, 2, 0.5)'
    assert script.read_text() == twice
    wait_until(lambda: len(in_list()) == 9, 'it runs with the waypoint')
    assert (name_at(2), name_at(5)) == (first, last)
    assert rosslt('row', 'up', name_at(5)).returncode == 0
    assert script.read_text() == '# tour\ngoto(2.0, 1.0, 1.5)  # in\ngoto(-1, 2, 0.5)\n\ngoto(2.0, 1.0, 1.5)  # in'
    for text, count in ((twice, 9), (before, 6)):
        done = rosslt('undo', '/tour')
        assert (done.returncode, done.stderr) == (0, 'rosslt undo: /tour runs the script again\n')
        assert script.read_text() == text
        wait_until(lambda count=count: len(in_list()) == count, 'it runs as before')
    assert (name_at(2), name_at(4)) == (first, last)


def test_a_parameter_and_what_a_function_reads_are_refused(nodes):
    for name, why in (
        ('~parking/0', 'no file is known that it was read from'),
        ('pin', 'its node reads it by a function'),
    ):
        assert f': {why}' in failure('row', 'delete', f'/talker/{name}')


def test_a_lock_refuses_what_edits_rows_before_it_is_written(master, tmp_path):
    with patrol(tmp_path, 'vault') as node:
        assert rosslt('row', 'down', '/vault/WAYPOINTS_1').returncode == 0
        before = node.file.read_text()
        commands = [('row', operation, '/vault/WAYPOINTS_1_0') for operation in ('duplicate', 'delete', 'up', 'down')]
        commands.append(('undo', '/vault'))
        for locked in ('/vault', '/vault/WAYPOINTS_0_1'):
            assert rosslt('lock', locked, '--reason', 'it runs').returncode == 0
            why = failure('set', '/vault/WAYPOINTS_0_1', '4').partition(': ')[2]
            assert why.startswith(f'/vault refuses: {locked} is locked by')
            for command in commands:
                assert failure(*command) == f'rosslt {command[0]}: {why}'
            assert node.file.read_text() == before
            assert rosslt('unlock', '/vault').returncode == 0
        assert rosslt('lock', '/vault/HEIGHT').returncode == 0
        assert rosslt('row', 'up', '/vault/WAYPOINTS_1').returncode == 0
        assert node.file.read_text() != before


def test_it_is_said_that_a_node_does_not_take_its_rows(master, tmp_path):
    master.setParam('/mule/rosslt/accept_changes_from', ['/planner'])
    with patrol(tmp_path, 'mule') as node:
        before = node.file.read_text()
        moved = rosslt('row', 'down', '/mule/WAYPOINTS_0')
        untaken = (
            f'/mule does not take 1.25 from {node.file}:5:6 (WAYPOINTS_0_0 stays 0.25), '
            f'3.0 from {node.file}:5:12 (WAYPOINTS_0_1 stays 1.0), '
            f'0.25 from {node.file}:6:6 (WAYPOINTS_1_0 stays 1.25), '
            f'1.0 from {node.file}:6:12 (WAYPOINTS_1_1 stays 3.0)'
        )
        assert moved.stdout == f'/mule/WAYPOINTS_0_0\tdown\t{node.file}:5\n'
        assert (moved.returncode, moved.stderr) == (1, f'rosslt row: the file is written, but {untaken}\n')
        for arguments in (('--diff',), ()):
            assert rosslt('save', '/mule', *arguments).stderr == f'rosslt save: nothing to save, but {untaken}\n'
        assert rosslt('undo', '/mule').returncode == 0
        assert node.file.read_text() == before
        assert rosslt('save', '/mule').stderr == 'rosslt save: nothing to save: all is as the files say\n'
