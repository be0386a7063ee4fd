"""A node that is started again goes on with its changed values, and saves them where they belong, as often as it is."""

import json
import os
import signal

import pytest
import rosgraph
import rospy
from geometry_msgs.msg import PointStamped

from rosslt import node, values
from support import packages
from support.processes import node_pid, wait_until
from support.saving import point
from support.shell import lines
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

RETURNING = """
import rospy
from geometry_msgs.msg import PointStamped

rospy.init_node('returning')
pub = rospy.Publisher('returning', PointStamped, queue_size=1)
radius = 2.50
far = rospy.get_param('~far', 7.5)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = radius
    p.point.y = far
    p.point.z = max(0.5, radius * 0.125)
    pub.publish(p)
    rospy.sleep(0.03)
"""

LAUNCHED = RETURNING.replace("'returning'", "'launched'").replace(
    """radius = 2.50
far = rospy.get_param('~far', 7.5)
""",
    """radius = rospy.get_param('~radius')
far = rospy.get_param('~tool/far')[1]
""",
)

LAUNCH_FILE = """<launch>
  <node pkg="returning_package" type="launched.py" name="launched" respawn="true" respawn_delay="0.1">
    <param name="radius" value="2.50"/>
    <rosparam file="{folder}/tool.yaml"/>
  </node>
</launch>
"""


def change(name, **wanted):
    for location, value in wanted.items():
        result = command('set', f'{name}/{location.replace("far", "~far")}', str(value))
        assert result.returncode == 0, result.stderr


def save(name):
    result = command('save', name)
    assert result.returncode == 0, result.stderr
    return [line.split('\t')[:3] for line in result.stdout.splitlines()]


def test_a_literal_and_a_default_are_saved_again_after_the_node_was_killed(master, tmp_path):
    with Unmodified(tmp_path, 'returning', RETURNING.lstrip()) as started, Listener('returning', PointStamped) as heard:
        change('/returning', radius=3.0, far=8.0)
        assert save('/returning') == [['/returning/radius', '2.50', '3.00'], ['/returning/~far', '7.5', '8.0']]
        heard.comes(lambda message: (message.point.x, message.point.y) == (3.0, 8.0))
        started.stop(signal.SIGKILL)
        text = started.file.read_text()
        with Unmodified(tmp_path, 'returning', text) as again:
            heard.next()
            assert save('/returning') == []
            change('/returning', radius=4.0, far=9.0)
            again.stop(signal.SIGKILL)
            # It is changed, killed, and saved only then.
            with Unmodified(tmp_path, 'returning', text) as third:
                heard.next()  # of this run
                heard.comes(lambda message: (message.point.x, message.point.y) == (4.0, 9.0))
                assert {line[7] for line in lines('list', '/returning')} >= {'3.0'}, 'an earlier run has left another'
                assert save('/returning') == [['/returning/radius', '3.00', '4.00'], ['/returning/~far', '8.0', '9.0']]
                assert {line[7] for line in lines('list', '/returning')} == {''}, 'and now the code says that'
                change('/returning', radius=3.0, far=8.0)
                third.stop(signal.SIGKILL)
                with Unmodified(tmp_path, 'returning', third.file.read_text()) as fourth:
                    heard.next()
                    heard.comes(lambda message: (message.point.x, message.point.y) == (3.0, 8.0))
                    assert save('/returning') == [
                        ['/returning/radius', '4.00', '3.00'],
                        ['/returning/~far', '9.0', '8.0'],
                    ]
                    assert fourth.file.read_text() == text


TABLE = """import rospy
from geometry_msgs.msg import PointStamped
WAYPOINTS = [
    (0.25, 0.0),
    (1.25, 1.0),
    (2.25, 2.0),
]
rospy.init_node('table')
pub = rospy.Publisher('table', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x, p.point.y, p.point.z = [x for x, _ in WAYPOINTS]
    pub.publish(p)
    rospy.sleep(0.03)
"""


def test_numbers_of_a_table_keep_their_changes_after_another_was_saved(master, tmp_path):
    with Unmodified(tmp_path, 'table', TABLE) as started, Listener('table', PointStamped) as heard:
        heard.next()
        change('/table', WAYPOINTS_0_0=0.5, WAYPOINTS_1_0=1.5)
        assert [line[0] for line in save('/table')] == ['/table/WAYPOINTS_0_0', '/table/WAYPOINTS_1_0']
        change('/table', WAYPOINTS_1_0=1.75, WAYPOINTS_2_0=2.5)
        heard.comes(lambda message: (message.point.y, message.point.z) == (1.75, 2.5))
        started.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'table', started.file.read_text()) as again:
            assert point(heard.next()) == [0.5, 1.75, 2.5]
            again.stop()


def test_a_change_beside_a_saved_one_is_taken_back_after_a_restart(master, tmp_path):
    text = TABLE.replace("'table'", "'beside'")
    with Unmodified(tmp_path, 'beside', text) as started, Listener('beside', PointStamped) as heard:
        heard.next()
        change('/beside', WAYPOINTS_1_0=1.5)
        assert [line[0] for line in save('/beside')] == ['/beside/WAYPOINTS_1_0']
        change('/beside', WAYPOINTS_2_0=2.5)
        heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.5))
        started.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'beside', started.file.read_text()):
            heard.next()  # of this run
            heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.5))
            undone = command('undo', '/beside')
            assert undone.returncode == 0, undone.stderr
            heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.25))


def test_changes_below_a_row_that_was_added_are_kept_and_taken_back(master, tmp_path):
    text = TABLE.replace("'table'", "'added'").replace(
        '= [x for x, _ in WAYPOINTS]', '= [x for x, _ in WAYPOINTS[-3:]]'
    )
    with Unmodified(tmp_path, 'added', text) as started, Listener('added', PointStamped) as heard:
        heard.next()
        change('/added', WAYPOINTS_0_0=0.5)
        assert len(save('/added')) == 1
        done = command('row', 'duplicate', '/added/WAYPOINTS_0_0')
        assert done.returncode == 0, done.stderr
        assert save('/added') == [], 'all is saved, although it is not certain where'
        change('/added', WAYPOINTS_1_0=1.5, WAYPOINTS_2_0=2.5)
        heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.5))
        started.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'added', started.file.read_text()) as again:
            assert point(heard.next()) == [0.5, 1.5, 2.5]
            undone = command('undo', '/added')
            assert undone.stdout.split('\t')[:3] == ['/added/WAYPOINTS_3_0', '2.5', '2.25'], undone
            heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.25))
            again.stop(signal.SIGKILL)
            with Unmodified(tmp_path, 'added', again.file.read_text()) as third:
                assert point(heard.next()) == [0.5, 1.5, 2.25]
                assert [line[:3] for line in save('/added')] == [['/added/WAYPOINTS_2_0', '1.25', '1.50']]
                _, output, _ = third.stop()
                assert 'is another number' not in output


EDITED = TABLE.replace("'table'", "'edited'")


def test_numbers_of_a_table_keep_their_changes_after_another_was_edited(master, tmp_path):
    with Unmodified(tmp_path, 'edited', EDITED) as started, Listener('edited', PointStamped) as heard:
        change('/edited', WAYPOINTS_1_0=1.5, WAYPOINTS_2_0=2.5)
        heard.comes(lambda message: (message.point.y, message.point.z) == (1.5, 2.5))
        started.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'edited', EDITED) as again:
            assert point(heard.next()) == [0.25, 1.5, 2.5]
            again.file.write_text(EDITED.replace('0.25', '0.75'))
            heard.comes(lambda message: message.point.x == 0.75)
            change('/edited', WAYPOINTS_0_0=0.875)
            again.stop(signal.SIGKILL)
        with Unmodified(tmp_path, 'edited', again.file.read_text()) as third:
            assert point(heard.next()) == [0.875, 1.5, 2.5]
            third.stop(signal.SIGKILL)
        # It is edited while the node does not run: what was meant for the former numbers reaches none.
        with Unmodified(tmp_path, 'edited', third.file.read_text().replace('1.25', '3.25')) as fourth:
            assert point(heard.next()) == [0.75, 3.25, 2.25]
            _, output, _ = fourth.stop()
            assert 'edited.py:5:6 now says 3.25 where it said 1.25: the parameter' in output
            assert 'edited.py:6:6 is another number than in an earlier run: the parameter' in output


def test_a_moved_program_drops_changes_and_says_so_of_these_alone(master, tmp_path):
    text, moved = TABLE.replace("'table'", "'moved'"), tmp_path / 'elsewhere'
    moved.mkdir()
    with Unmodified(tmp_path, 'moved', text) as started, Listener('moved', PointStamped) as heard:
        change('/moved', WAYPOINTS_1_0=1.5)
        heard.comes(lambda message: message.point.y == 1.5)
        started.stop(signal.SIGKILL)
        with Unmodified(moved, 'moved', text) as again:
            assert point(heard.next()) == [0.25, 1.25, 2.25]
            _, output, _ = again.stop()
    assert output.count('is another number than in an earlier run') == 1
    assert 'the parameter /moved/rosslt/WAYPOINTS_1_0 = 1.5 of it is dropped' in output


DIVIDED = """import rospy
from geometry_msgs.msg import PointStamped
def divided():
    return [
        speed / 0.25,
        speed / 1.25,
        speed / 2.5,
    ]
rospy.init_node('divided')
pub = rospy.Publisher('divided', PointStamped, queue_size=1)
speed = 1.0
while not pub.get_num_connections():
    rospy.sleep(0.01)
while not rospy.is_shutdown():
    p = PointStamped()
    if rospy.has_param('/divided/is_far'):
        p.point.x, p.point.y, p.point.z = divided()
    pub.publish(p)
    rospy.sleep(0.03)
"""


def test_numbers_not_read_yet_keep_their_changes_after_an_edit(hearing, tmp_path):
    """The numbers of a formula's shape are known by name once they are read, or if an earlier run has changed them."""

    def names():
        return {one.value: one.local_name for one in node.Directory().ask(['/divided'])[0].get('/divided', ())}

    def kept():
        records = rospy.get_param('/divided/rosslt_records', {})
        return [json.loads(record)[-1] for name, record in records.items() if name != '_last_request']

    def edit(program, before, after):
        assert not names().keys() & {0.25, 0.5, 1.25, 2.5}
        program.file.write_text(program.file.read_text().replace(f'/ {before}', f'/ {after}'))
        wait_until(lambda: after in names(), 'the edit is taken in')

    with Unmodified(tmp_path, 'divided', DIVIDED) as started, Listener('divided', PointStamped) as heard:
        edit(started, 0.25, 0.5)
        rospy.set_param('/divided/is_far', True)
        heard.comes(lambda message: (message.point.x, message.point.y) == (2.0, 0.8))
        change('/divided', **{names()[1.25]: 2.0})
        wait_until(lambda: 2.0 in kept(), 'the master to keep it')
        started.stop(signal.SIGKILL)
        rospy.delete_param('/divided/is_far')
        with Unmodified(tmp_path, 'divided', started.file.read_text()) as again:
            heard.next()
            edit(again, 0.5, 0.125)
            change('/divided', **{names()[0.125]: 4.0})
            wait_until(lambda: 4.0 in kept(), 'the master to keep it')
            again.stop(signal.SIGKILL)
        rospy.set_param('/divided/is_far', True)
        first = hearing('divided', PointStamped).messages
        with Unmodified(tmp_path, 'divided', again.file.read_text()):
            wait_until(lambda: first, 'a message')
            assert (first[0].point.x, first[0].point.y, first[0].point.z) == (0.25, 0.5, 0.4)
            heard.comes(lambda message: len(values.sources(message)) == 1)  # the speed's, which suffices


def test_numbers_of_a_module_loaded_in_a_round_keep_their_changes(hearing, tmp_path):
    (tmp_path / 'late_tool.py').write_text('def reach():\n    return 1.5\n')
    with Unmodified(tmp_path, 'late', LATE) as started, Listener('late', PointStamped) as heard:
        change('/late', reach=2.5)
        heard.comes(lambda message: message.point.x == 2.5)
        started.stop(signal.SIGKILL)
    first = hearing('late', PointStamped).messages
    with Unmodified(tmp_path, 'late', LATE):
        wait_until(lambda: first, 'a message')
        assert first[0].point.x == 2.5


def test_a_changed_value_stays_with_its_literal_where_lines_were_moved(master, tmp_path):
    with Unmodified(tmp_path, 'moving', MOVING) as started, Listener('moving', PointStamped) as heard:
        heard.next()
        (name,) = (one.local_name for one in node.Directory().ask(['/moving'])[0]['/moving'] if one.value == 0.25)
        assert command('set', f'/moving/{name}', '0.75').returncode == 0
        heard.comes(lambda message: message.point.x == 0.75)
        started.stop(signal.SIGKILL)
    # Another literal of the same value stands in that place now.
    moved = MOVING.replace('    p.point.x', '    p.point.y = max(0.25, p.point.z)\n    p.point.x')
    with Unmodified(tmp_path, 'moving', moved), Listener('moving', PointStamped) as heard:
        message = heard.comes(lambda message: message.point.y)
        assert (message.point.x, message.point.y) == (0.75, 0.25)
        assert '+    p.point.x = max(0.75, p.point.z)\n' in command('save', '/moving', '--diff').stdout


MOVING = """import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('moving')
pub = rospy.Publisher('moving', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = max(0.25, p.point.z)
    pub.publish(p)
    rospy.sleep(0.03)
"""


def test_what_was_changed_before_a_restart_follows_the_next_change(master, tmp_path):
    """A message that is filled once begins with what an earlier run has left, and is changed from there."""
    with Unmodified(tmp_path, 'filling', FILLING) as started, Listener('filling', PointStamped) as heard:
        heard.next()
        change('/filling', goal_point_x=3.0)
        heard.comes(lambda message: message.point.x == 3.0)
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'filling', FILLING), Listener('filling', PointStamped) as heard:
        heard.comes(lambda message: message.point.x == 3.0)
        change('/filling', goal_point_x=4.0)
        heard.comes(lambda message: message.point.x == 4.0)
        assert command('list', '/filling').stdout.rstrip('\n').split('\t')[9:] in ([], [''])


FILLING = """import rospy
from geometry_msgs.msg import PointStamped
goal = PointStamped()
goal.point.x = 1.5
rospy.init_node('filling')
pub = rospy.Publisher('filling', PointStamped, queue_size=1)
rate = rospy.Rate(30)
while not rospy.is_shutdown():
    pub.publish(goal)
    rate.sleep()
"""


def test_a_changed_value_stays_with_its_literal_where_another_one_of_that_name_is_sent_first(master, tmp_path):
    with Unmodified(tmp_path, 'twins', TWINS) as started, Listener('twins', PointStamped) as heard:
        assert command('set', '/twins/gain', '0.9').returncode == 0
        heard.comes(lambda message: (message.point.x, message.point.y) == (0.9, 0.5))
        started.stop(signal.SIGKILL)
    rospy.set_param('/twins/leg_first', True)
    with Unmodified(tmp_path, 'twins', TWINS), Listener('twins', PointStamped) as heard:
        message = heard.comes(lambda message: values.is_tracked(message.point.y))
        assert (message.point.x, message.point.y) == (0.9, 0.5)
        saved = command('save', '/twins', '--diff').stdout
        assert '-        self.gain = 0.5\n+        self.gain = 0.9\n class Leg:\n' in saved


def test_literals_that_are_called_like_settings_of_a_node_do_not_become_these(master, tmp_path):
    with Unmodified(tmp_path, 'settings', SETTINGS) as started, Listener('settings', PointStamped) as heard:
        x = heard.comes(lambda message: values.is_tracked(message.point.x)).point.x
        y = heard.comes(lambda message: values.is_tracked(message.point.y)).point.y
        node.force_value(x, 0.5)
        node.force_value(y, 0.25)
        heard.comes(lambda message: (message.point.x, message.point.y) == (0.5, 0.25))
        assert not rospy.has_param('/settings/rosslt/change_locks')
        assert not rospy.has_param('/settings/rosslt/history')
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'settings', SETTINGS), Listener('settings', PointStamped) as heard:
        node.force_value(heard.comes(lambda message: message.point.x == 0.5).point.x, 0.75)
        heard.comes(lambda message: (message.point.x, message.point.y) == (0.75, 0.25))


def test_a_changed_value_is_kept_where_an_int_was_edited_before(master, tmp_path):
    with Unmodified(tmp_path, 'counted', COUNTED) as started, Listener('counted', PointStamped) as heard:
        edited = COUNTED.replace('height = 2\n', 'height = 3\n')
        started.file.write_text(edited)
        heard.comes(lambda message: message.point.x == 3.0)
        assert command('set', '/counted/height', '3.75').returncode == 0
        heard.comes(lambda message: message.point.x == 3.75)
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'counted', edited), Listener('counted', PointStamped) as heard:
        assert heard.comes(lambda message: values.is_tracked(message.point.x)).point.x == 3.75


PUBLISHING = """import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('{name}')
pub = rospy.Publisher('{name}', PointStamped, queue_size=1)
{start}
while not rospy.is_shutdown():
    p = PointStamped()
    {fill}
    pub.publish(p)
    rospy.sleep(0.03)
"""

TWINS = PUBLISHING.format(
    name='twins',
    start="""
class Arm:
    def __init__(self):
        self.gain = 0.5
class Leg:
    def __init__(self):
        self.gain = 0.5
arm, leg = Arm(), Leg()
first = PointStamped()
first.point.x = leg.gain if rospy.get_param('~leg_first', False) else arm.gain
pub.publish(first)
""",
    fill='p.point.x, p.point.y = arm.gain, leg.gain',
)

SETTINGS = PUBLISHING.format(
    name='settings',
    start="""
history = 2.5
change_locks = 1.5
""",
    fill='p.point.x, p.point.y = change_locks, history',
)

LATE = PUBLISHING.format(
    name='late',
    start='while not pub.get_num_connections(): rospy.sleep(0.01)',
    fill='import late_tool; p.point.x = late_tool.reach()',
)

COUNTED = PUBLISHING.format(name='counted', start='height = 2', fill='p.point.x = height')


@pytest.fixture
def launched(master, tmp_path):
    """The folder of a package whose node is started again whenever it ends."""
    environment = packages.package_of_node(tmp_path, 'returning_package', 'launched.py', LAUNCHED)
    (tmp_path / 'all.launch').write_text(LAUNCH_FILE.format(folder=tmp_path))
    (tmp_path / 'tool.yaml').write_text('tool: {far: [1.0, 7.5]}  # 7.5\n')
    with packages.launched(environment, 'rosslt', 'launch', '--no-markers', str(tmp_path / 'all.launch')):
        yield tmp_path


def pid():
    """The process of the node, None while there is none."""
    try:
        return node_pid(rosgraph.Master('/test').lookupNode('/launched'))
    except rosgraph.MasterError:
        return None


def kill_and_wait():
    """Kill the node, and wait until it has been started again."""
    before = wait_until(pid, 'the node is there')
    os.kill(before, signal.SIGKILL)
    wait_until(lambda: pid() not in (None, before), 'it is started again')
    wait_until(lambda: len(node.Directory().ask(['/launched'])[0].get('/launched', ())) >= 2, 'it has its locations')


def change_parameters(radius, far):
    for name, value in (('~radius', radius), ('~tool/far/1', far)):
        result = command('set', f'/launched/{name}', str(value))
        assert result.returncode == 0, result.stderr


@pytest.mark.slow
def test_parameters_of_launch_and_yaml_files_are_saved_again_after_a_respawn(launched):
    launch, tool = launched / 'all.launch', launched / 'tool.yaml'
    before = launch.read_text(), tool.read_text()

    def texts(radius, far):
        return before[0].replace('2.50', radius), before[1].replace(', 7.5]', f', {far}]')

    with Listener('launched', PointStamped) as heard:
        change_parameters(3.0, 8.0)
        assert len(save('/launched')) == 2
        assert (launch.read_text(), tool.read_text()) == texts('3.00', '8.0')
        kill_and_wait()
        heard.comes(lambda message: (message.point.x, message.point.y) == (3.0, 8.0))
        assert save('/launched') == []
        change_parameters(4.0, 9.0)
        assert len(save('/launched')) == 2
        assert (launch.read_text(), tool.read_text()) == texts('4.00', '9.0')
        # What is in force is what the files said at first: they say something else since.
        change_parameters(2.5, 7.5)
        kill_and_wait()
        assert len(save('/launched')) == 2
        assert (launch.read_text(), tool.read_text()) == before
        change_parameters(5.0, 6.0)
        kill_and_wait()
        kill_and_wait()
        assert len(save('/launched')) == 2
        assert (launch.read_text(), tool.read_text()) == texts('5.00', '6.0')
        # An edit of somebody else is not overwritten.
        launch.write_text(launch.read_text().replace('5.00', '5.25'))
        change_parameters(1.0, 6.0)
        kill_and_wait()
        result = command('save', '/launched')
        assert result.returncode == 1
        assert 'it was edited since it was loaded' in result.stderr
        assert (launch.read_text(), tool.read_text()) == texts('5.25', '6.0')


@pytest.fixture(autouse=True)
def nothing_left_behind(master):
    """No parameter of a node outlives its test."""
    yield
    for name in ('returning', 'edited', 'divided', 'moving', 'twins', 'settings', 'counted', 'launched'):
        for key in ('', '/rosslt', '/rosslt_records'):
            if rospy.has_param(f'/{name}{key}'):
                rospy.delete_param(f'/{name}{key}')


def test_a_change_that_ends_the_main_loop_is_taken_back_and_named(master, tmp_path):
    code = RETURNING.replace("'returning'", "'divider'").replace('y = far', "y = 1.0 / rospy.get_param('~far', 7.5)")
    for turn in range(2):
        with Unmodified(tmp_path, 'divider', code) as started, Listener('divider', PointStamped) as heard:
            assert heard.next().point.y == 1.0 / 7.5
            if turn == 0:
                refused = command('set', '/divider/~far', '0')
                assert refused.returncode == 1
                assert '/divider raises ZeroDivisionError' in refused.stderr
                code_of_exit, _, errors = started.end()
                assert code_of_exit == 1
                assert 'the node ends after a change, which is taken back: /divider/far = 0.0' in errors
                assert rosgraph.Master('/test').getParam('/divider/far') == 7.5
