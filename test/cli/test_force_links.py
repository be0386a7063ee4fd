"""`rosslt force --frame` and `explain --frame`: where a link of a robot is, comes from the joints before it."""

import math

import pytest

from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest

ROBOT = """<robot name="arm">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="tip"/><link name="camera"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="2.4" effort="1" velocity="1"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="1 0 0"/></joint>
  <joint name="mount" type="fixed"><parent link="base"/><child link="camera"/><origin xyz="0 1 0"/></joint>
</robot>"""

ARM = f"""
import math
from sensor_msgs.msg import JointState
rospy.set_param('robot_description', '''{ROBOT}''')
publisher = rosslt.Publisher('/joint_states', JointState, queue_size=1)
shoulder, elbow = rosslt.location(20.0, name='shoulder'), rosslt.location(60.0, name='elbow')
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    shoulder, elbow = rosslt.location(20.0, name='shoulder'), rosslt.location(60.0, name='elbow')
    position = [rosslt.math.radians(shoulder), rosslt.math.radians(elbow)]
    publisher.publish(JointState(name=['shoulder', 'elbow'], position=position))
    rate.sleep()
"""


@pytest.fixture
def arm(master):
    with Node('arm', ARM) as started:
        wait_until(lambda: len(lines('list', '/arm')) == 2, 'the arm moves')
        yield started


def angles():
    return [math.radians(float(rosslt('get', f'/arm/{name}').stdout)) for name in ('shoulder', 'elbow')]


def tip():
    a, b = angles()
    return math.cos(a) + math.cos(a + b), math.sin(a) + math.sin(a + b), a + b


def test_a_link_goes_to_a_place_and_turns(arm):
    done = rosslt('force', '--frame', 'tip', 'position', '{x: 0.5, y: 1.2}')
    assert done.returncode == 0, done.stderr
    assert [row[0] for row in lines('list', '/arm')] == ['/arm/shoulder', '/arm/elbow']
    assert tip()[:2] == pytest.approx((0.5, 1.2), abs=1e-6)
    assert rosslt('force', '--frame', 'tip', 'orientation/yaw', '1.0').returncode == 0
    assert tip()[2] == pytest.approx(1.0, abs=1e-6)
    shoulder, _ = angles()
    assert rosslt('force', '--frame', 'tip', '--in', 'upper', 'position/y', '0.5').returncode == 0
    assert angles() == pytest.approx([shoulder, math.asin(0.5)], abs=1e-6)


def test_no_joint_goes_beyond_its_limits(arm):
    before = angles()
    assert 'cannot' in failure('force', '--frame', 'tip', '--in', 'upper', 'orientation/yaw', '2.6')
    assert 'cannot' in failure('force', '--frame', 'tip', 'position/x', '2.5')
    assert angles() == before


def test_a_dry_run_changes_nothing(arm):
    before = angles()
    planned = rosslt('force', '--frame', 'tip', 'position/x', '0.75', '--dry-run')
    assert (planned.returncode, bool(planned.stdout)) == (0, True)
    assert angles() == before


def test_what_is_no_link_is_named(arm):
    assert 'tipp is not a link that hangs on another one (did you mean tip?)' in failure(
        'force', '--frame', 'tipp', 'position/x', '1'
    )
    assert 'tip does not hang on camera; it hangs on lower, upper, base' in failure(
        'force', '--frame', 'tip', '--in', 'camera', 'position/x', '1'
    )
    assert '--in is for --frame' in rosslt('force', '--in', 'tip', '/joint_states/position', '1').stderr
    assert 'nothing in it has a source' in failure('force', '--frame', 'camera', 'position/x', '1')
    assert 'has no' in failure('force', '--frame', 'tip', 'position/w', '1')


def test_where_a_link_is_is_explained(arm):
    rows = lines('explain', '--frame', 'tip', 'position/x')
    assert [(row[0], row[3]) for row in rows] == [('position.x', '/arm/shoulder'), ('position.x', '/arm/elbow')]
    assert float(rows[0][1]) == pytest.approx(tip()[0], abs=1e-9)
    fields = [row[0] for row in lines('explain', '--frame', 'tip', '--in', 'upper')]
    turned = ['orientation.roll', 'orientation.pitch', 'orientation.yaw']
    assert fields == ['position.x', 'position.y', *turned]
    assert {row[3] for row in lines('explain', '--frame', 'tip', '--in', 'upper')} == {'/arm/elbow'}
    assert 'tip in base position.x = ' in on_terminal('explain', '--frame', 'tip', 'position/x')
    assert '`rosslt doctor /joint_states` says why' in failure('explain', '--frame', 'camera')
    assert 'name a field, TOPIC/FIELD, or a link' in rosslt('explain').stderr
    assert '--frame is for what is sent now' in rosslt('explain', '--frame', 'tip', '--bag', 'a.bag').stderr
