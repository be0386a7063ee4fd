"""An exception names the numbers that an earlier run of the node has left, and the command has them dropped."""

import json
import signal
import subprocess

import pytest
import rospy
from geometry_msgs.msg import PointStamped

from support.processes import wait_until
from support.shell import failure
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

pytestmark = pytest.mark.rostest


LEAVING = """import rospy
from geometry_msgs.msg import PointStamped
GOAL = 0.0
SLOW = 0.5
TOP = 1.0
rospy.init_node('leaving')
pub = rospy.Publisher('leaving', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.y = GOAL
    p.point.x = TOP if GOAL == 0.0 else 0.0
    if GOAL > 0.0:
        way = GOAL - 0.0
        p.point.x = min(TOP, way / SLOW)
    pub.publish(p)
    rospy.sleep(0.03)
"""


def test_an_error_names_what_an_earlier_run_left_and_how_to_drop_it(master, tmp_path):
    with Unmodified(tmp_path, 'leaving', LEAVING) as started, Listener('leaving', PointStamped) as heard:
        heard.next()
        assert command('set', '/leaving/TOP', '2').returncode == 0
        assert command('set', '/leaving/SLOW', '0').returncode == 0
        assert command('set', '/leaving/TOP', '1').returncode == 0
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'leaving', LEAVING) as again:
        wait_until(lambda: '/leaving/GOAL' in command('list', '/leaving').stdout, 'its locations')
        left = 'which also reads what was changed before: SLOW 0.5 -> 0.0 before the node was started (`rosslt reset '
        left += '/leaving/SLOW` says how to take it back)'
        assert f'(leaving.py:14, {left}), which ends the node; taken back' in failure('set', '/leaving/GOAL', '3')
        assert again.end()[0] == 1
    told = failure('reset', '/leaving/SLOW')
    assert told.endswith(
        '; /leaving has ended, and begins with SLOW = 0.0 where its code says 0.5: '
        '`rosparam delete /leaving/rosslt/SLOW` has it begin with 0.5'
    )
    assert '; see rosslt list' in failure('reset', '/leaving/TOP'), 'it is as the code says'
    subprocess.run(told.split('`')[1].split(), check=True)
    with Unmodified(tmp_path, 'leaving', LEAVING), Listener('leaving', PointStamped) as heard:
        assert command('set', '/leaving/GOAL', '3').returncode == 0
        heard.comes(lambda message: message.point.x == 1.0)


def test_a_parameter_that_the_last_request_has_changed_is_named(master, tmp_path):
    text = LEAVING.replace('leaving', 'parting').replace('SLOW = 0.5\n', '')
    text = text.replace('pub =', "SLOW = rospy.get_param('~slow', 0.5)\npub =")
    with Unmodified(tmp_path, 'parting', text) as started, Listener('parting', PointStamped) as heard:
        heard.next()
        assert command('set', '/parting/~slow', '0').returncode == 0
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'parting', text) as again:
        wait_until(lambda: '/parting/GOAL' in command('list', '/parting').stdout, 'its locations')
        left = 'which also reads what was changed before: '
        left += '/parting/slow 0.5 -> 0.0 (`rosslt set /parting/~slow 0.5` says how to take it back)'
        assert left in failure('set', '/parting/GOAL', '3')
        assert again.end()[0] == 1
    told = failure('set', '/parting/~slow', '0.5')
    assert told.endswith('; /parting/slow is a ROS parameter, now 0.0: `rosparam set /parting/slow VALUE` changes it')
    assert told.split('; ')[1] in failure('set', '/parting/slow', '0.5')
    assert failure('set', '/parting/~fast', '0.5').endswith('; see rosslt list')
    subprocess.run(told.split('`')[1].replace('VALUE', '0.5').split(), check=True)
    with Unmodified(tmp_path, 'parting', text), Listener('parting', PointStamped) as heard:
        assert command('set', '/parting/GOAL', '3').returncode == 0
        heard.comes(lambda message: message.point.x == 1.0)


def test_a_change_that_a_launch_file_has_overwritten_is_named(master, tmp_path):
    text = LEAVING.replace('leaving', 'launched_anew').replace('SLOW = 0.5\n', '')
    text = text.replace('pub =', "SLOW, FAST = rospy.get_param('~slow'), rospy.get_param('~fast')\npub =")
    rospy.set_param('/launched_anew', {'slow': 0.5, 'fast': 2.5, 'kept': 3.5})
    with Unmodified(tmp_path, 'launched_anew', text) as started, Listener('launched_anew', PointStamped) as heard:
        heard.next()
        assert command('set', '/launched_anew/~slow', '0.25').returncode == 0
        started.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'launched_anew', text) as respawned:  # it goes on with what was changed
        wait_until(lambda: '~fast' in command('list', '/launched_anew').stdout, 'its locations')
        assert command('set', '/launched_anew/~fast', '4').returncode == 0
        respawned.stop(signal.SIGKILL)
    rospy.set_param('/launched_anew/slow', 0.5)
    rospy.set_param('/launched_anew/fast', 2.5)
    with Unmodified(tmp_path, 'launched_anew', text) as again:
        wait_until(lambda: '~slow' in command('list', '/launched_anew').stdout, 'its locations')
        kept = {'/launched_anew/slow': 0.5, '/launched_anew/fast': 2.5}
        records = '/launched_anew/rosslt_records/_set_parameters'
        wait_until(lambda: json.loads(rospy.get_param(records)) == kept, 'what it has said is kept')
        _, _, errors = again.stop()
    for name, now, then in (('slow', 0.5, 0.25), ('fast', 2.5, 4.0)):
        told = f'/launched_anew/{name} is {now}: it was changed to {then} in an earlier run, and set to another value'
        assert told in errors
    with Unmodified(tmp_path, 'launched_anew', text) as third:
        wait_until(lambda: '~slow' in command('list', '/launched_anew').stdout, 'its locations')
        _, _, errors = third.stop()
    assert 'in an earlier run' not in errors, 'it is said once'


RATED = """import rospy
from std_msgs.msg import Float64
rospy.init_node('rated')
pub = rospy.Publisher('rated', Float64, queue_size=1)
rate = rospy.Rate(rospy.get_param('~rate', 10))
while not rospy.is_shutdown():
    pub.publish(1.5)
    rate.sleep()
"""


def test_a_rate_that_ends_the_next_start_is_named_and_can_be_set(master, tmp_path):
    with Unmodified(tmp_path, 'rated', RATED) as started:
        wait_until(lambda: 'takes effect at the next start' in command('list', '/rated').stdout, 'it goes round')
        assert command('set', '/rated/~rate', '0').returncode == 0
        started.stop(signal.SIGTERM)
    with Unmodified(tmp_path, 'rated', RATED) as again:
        code, _, errors = again.end()
    assert code == 1
    assert '/rosslt/node/' not in errors, 'the traceback has the lines that it has without rosslt'
    assert 'ZeroDivisionError: float division by zero (rated.py:5, which reads what was changed before: ' in errors
    advice = errors.rpartition('(`')[2].partition('`')[0]
    assert advice == 'rosslt set /rated/~rate 10'
    told = failure(*advice.split()[1:])
    subprocess.run(told.split('`')[1].replace('VALUE', '10').split(), check=True)
    with Unmodified(tmp_path, 'rated', RATED):
        wait_until(lambda: 'takes effect at the next start' in command('list', '/rated').stdout, 'it goes round')
