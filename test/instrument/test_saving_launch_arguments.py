"""Values that stand in the <arg> tags of launch files are written there."""

import pytest
from geometry_msgs.msg import PointStamped
from roslaunch.config import ROSLaunchConfig

from rosslt.instrument.parameter_origins import NotingLoader
from support.packages import launched, package_of_node
from support.saving import change, places, save
from support.shell import rosslt as command

NODE = """
import rospy
from geometry_msgs.msg import PointStamped

rospy.init_node('launched')
pub = rospy.Publisher('launched', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x, p.point.y = rospy.get_param('~gain'), rospy.get_param('~width')
    p.point.z = rospy.get_param('~height')
    p.header.frame_id = rospy.get_param('~frame')
    pub.publish(p)
    rospy.sleep(0.03)
"""

INNER = """<launch>
  <arg name="gain"/>
  <arg name="width" default="0.50"/>
  <arg name="height" default="1"/>
  <arg name="frame" value="map"/>
  <node pkg="arguments_package" type="driven.py" name="driven" output="screen">
    <param name="gain" value="$(arg gain)"/>
    <param name="width" type="double" value="$(arg width)"/>
    <param name="height" type="double" value="$(arg height)"/>
    <param name="frame" value="$(arg frame)"/>
  </node>
</launch>
"""

OUTER = """<launch>
  <!-- <arg name="gain" default="1.50"/> ä -->
  <arg name="gain" default="1.50"/>
  <arg name="given" default="4.0"/>
  <include file="{inner}" ns="left">
    <arg name="gain" value="$(arg gain)"/><arg name='width'  value='2.50' />
  </include>
  <include file="{inner}" ns="right">
    <arg name="gain" value="$(arg gain)"/>
    <arg name="height" value="$(arg given)"/>
  </include>
</launch>
"""


def test_arguments_are_written_where_files_give_them(master, hearing, tmp_path):
    environment = package_of_node(tmp_path, 'arguments_package', 'driven.py', NODE)
    inner, outer = tmp_path / 'inner.launch', tmp_path / 'outer.launch'
    inner.write_text(INNER)
    outer.write_text(OUTER.format(inner=inner), encoding='utf-8')
    before = inner.read_text(), outer.read_text(encoding='utf-8')
    heard = {name: hearing(f'{name}/launched', PointStamped) for name in ('left', 'right')}
    start = [environment, 'rosslt', 'launch', '--no-markers', str(outer)]
    with launched(*start, 'given:=4.0'):
        ids = {}
        for name, one in heard.items():
            one.next()
            ids[name] = {place.local_name: place.location.id for place in places(f'/{name}/driven')}
        left, right = ids['left'], ids['right']
        change('/left/driven', {left['~gain']: 3.25, left['~width']: 3.75, left['~height']: 2.0})
        change('/right/driven', {right['~height']: 9.5, right['~width']: 0.75})
        result = command('save', '/left/driven')
        assert result.returncode == 1
        # The other one has another number of the same <arg>.
        assert f'~gain ({outer} says it for /right/driven/gain as well, which is 1.5)' in result.stderr
        assert 'width' in result.stdout
        assert 'height' in result.stdout
        change('/right/driven', {right['~gain']: 3.25})
        result = command('save', '/right/driven')
        assert f'~width\t0.50\t0.75\t{inner}\n' in result.stdout
        assert f'~gain\t1.50\t3.25\t{outer}\n' in result.stdout
        why = 'through a substitution: the argument given is given on the command line'
        assert f'not saved: ~height (it stands in {outer} {why})\n' in result.stderr
        assert save('/left/driven') == ''
        # What was saved is changed and saved again, and then changed back, as a text is.
        change('/left/driven', {left['~width']: 2.5, left['~frame']: 'odom'})
        result = command('save', '/left/driven')
        assert f'~frame ({inner} says it for /right/driven/frame as well, which is' in result.stderr
        change('/right/driven', {right['~frame']: 'odom'})
        assert 'odom' in save('/left/driven')
        # Somebody has the parameter not given by its <arg> any more.
        saved = inner.read_text()
        inner.write_text(saved.replace('$(arg gain)', '7'))
        change('/left/driven', {left['~gain']: 5.5})
        change('/right/driven', {right['~gain']: 5.5})
        result = command('save', '/left/driven')
        edited = f'it was edited since it was loaded: {inner} says 7 instead of $(arg gain)'
        assert (result.returncode, result.stdout) == (1, '')
        assert f'~gain ({edited})' in result.stderr
        inner.write_text(saved)
        change('/left/driven', {left['~gain']: 3.25})
        change('/right/driven', {right['~gain']: 3.25})
    inner_after = before[0].replace('0.50', '0.75').replace('"1"', '"2"').replace('"map"', '"odom"')
    outer_after = before[1].replace('\n  <arg name="gain" default="1.50"', '\n  <arg name="gain" default="3.25"')
    assert (inner.read_text(), outer.read_text(encoding='utf-8')) == (inner_after, outer_after)
    with launched(*start):
        message = heard['left'].next(lambda message: message.header.frame_id == 'odom')
        assert (message.point.x, message.point.y, message.point.z) == (3.25, 2.5, 2.0)
        message = heard['right'].next(lambda message: message.header.frame_id == 'odom')
        assert (message.point.x, message.point.y, message.point.z) == (3.25, 0.75, 4.0)
        assert save('/left/driven') == ''


def origins_of(text):
    """Where the parameters of a launch file stand."""
    loader = NotingLoader()
    loader.load_string(f'<launch>{text}</launch>', ROSLaunchConfig(), verbose=False)
    return loader.origins


ONE = '<arg name="one" default="1"/>'
P = '<param name="p" value="$(arg one)"/>'
TWO = '<arg name="two" value="$(arg one)"/><param name="p" value="$(arg two)"/>'


@pytest.mark.parametrize(
    ('text', 'tag', 'attribute'),
    [
        (ONE + P, 0, 'default'),
        ('<arg name="one" value="1"/>' + P, 0, 'value'),
        (f'{ONE}<group if="true">{TWO}</group>', 0, 'default'),
        ('<arg name="one" default="0" if="false"/>' + ONE + P, 1, 'default'),
        (ONE + '<group ns="a"><arg name="two" value="2"/></group>' + P, 0, 'default'),
        (ONE + P + P.replace('"p"', '"q"'), 0, 'default'),
        (ONE + '<arg name="o" default="2"/><param name="o" value="$(eval o + 1)"/>' + P, 0, 'default'),
    ],
)
def test_an_argument_alone_is_followed(text, tag, attribute):
    origin = origins_of(text)['/p']
    assert not origin['is_substituted']
    assert (origin['tag'][0], origin['arg']) == (tag, attribute)


ELSEWHERE = 'its <arg name="one"> is used elsewhere as well, in '


@pytest.mark.parametrize(
    ('text', 'why'),
    [
        (ONE + P.replace('$(arg one)', '$(arg one)0'), '$(arg one)0 is more than $(arg NAME)'),
        (ONE + P.replace('$(arg one)', '$(eval one + 1)'), '$(eval one + 1) is more than $(arg NAME)'),
        (P.replace('$(arg one)', '$(env SHLVL)'), '$(env SHLVL) is more than $(arg NAME)'),
        (P.replace('$(arg one)', '$(find rosslt)'), '$(find rosslt) is more than $(arg NAME)'),
        (ONE.replace('"1"', '"$(eval 1 + 1)"') + P, '$(eval 1 + 1) is more than $(arg NAME)'),
        (ONE + P + P.replace('$(arg one)', '$(arg one)0').replace('"p"', '"q"'), ELSEWHERE + '$(arg one)0'),
        (ONE + P + '<param name="q" value="$(eval one + 1)"/>', ELSEWHERE + '$(eval one + 1)'),
        (ONE + P + '<group if="$(arg one)"/>', ELSEWHERE + '$(arg one)'),
        (ONE + P + '<node pkg="p" type="t" name="n" args="-x $(arg one)"/>', ELSEWHERE + '-x $(arg one)'),
        (ONE + P + '<rosparam subst_value="true">q: $(arg one)</rosparam>', ELSEWHERE + 'q: $(arg one)'),
    ],
)
def test_others_are_not_followed_and_it_is_said_why(text, why, monkeypatch):
    monkeypatch.setenv('SHLVL', '1')
    origin = origins_of(text)['/p']
    assert (origin['is_substituted'], origin['why']) == (True, why)


def test_arguments_that_are_all_passed_on_are_followed(tmp_path):
    inner = tmp_path / 'inner.launch'
    inner.write_text(
        '<launch><arg name="one"/><arg name="two" default="2"/><arg name="three" default="0"/>'
        '<param name="one" value="$(arg one)"/><param name="two" value="$(arg two)"/>'
        '<param name="three" value="$(arg three)"/></launch>'
    )
    outer = f'{ONE}<include file="{inner}" pass_all_args="true"><arg name="three" value="3"/></include>'
    outer_file = tmp_path / 'outer.launch'
    outer_file.write_text(f'<launch>{outer}</launch>')
    loader = NotingLoader()
    loader.load(str(outer_file), ROSLaunchConfig(), argv=[], verbose=False)
    found = {name: (one['file'], one['arg'], one['said']) for name, one in loader.origins.items()}
    assert found == {
        '/one': (str(outer_file), 'default', 1),
        '/two': (str(inner), 'default', 2),
        '/three': (str(outer_file), 'value', 3),
    }
