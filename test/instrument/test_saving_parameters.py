"""Changed parameters are written back into the launch and YAML files that they were read from."""

import math

from geometry_msgs.msg import PointStamped
from roslaunch.config import ROSLaunchConfig

from rosslt.instrument.parameter_origins import NotingLoader
from support.packages import launched, package_of_node
from support.saving import change, places, point, save
from support.shell import rosslt as command

LAUNCHED = """
import rospy
from geometry_msgs.msg import PointStamped

rospy.init_node('launched')
pub = rospy.Publisher('launched', PointStamped, queue_size=1)
x = rospy.get_param('~x')
y = rospy.get_param('/tall/heights')[1]
z = rospy.get_param('~turn')
w = rospy.get_param('~given')
long = rospy.get_param('~tool/length')
tip = rospy.get_param('~tool/tip')[0]
shift = rospy.get_param('~shift')
frame = rospy.get_param('~frame')
shown = rospy.get_param('~shown')
name = rospy.get_param('~tool/name')
side = rospy.get_param('/tall/side')
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x, p.point.y, p.point.z = x, y, z + w + long * tip + shift
    p.header.frame_id = frame + name + side if shown else ''
    pub.publish(p)
    rospy.sleep(0.03)
"""

LAUNCH_FILE = """<launch>
  <!-- <param name="x" value="0"/> ä -->
  <arg name="given" default="1.5"/>
  <rosparam file="{folder}/tall.yaml" ns="tall"/>
  <node pkg="rosslt" type="none" name="other" if="false"><param name="x" value="2.50"/></node>
  <node pkg="{package}" type="launched.py" name="launched" output="screen">
    <param  type = "double" value='2.50' name="x" />
    <param name="given" value="$(arg given)"/>
    <param name="frame" value="map"/><param name="shown" value="True"/>
    <rosparam file="{folder}/turn.yaml" command="load"/>
    <rosparam>
      # 2.50
      tool: {{length: 2.50, "tip": [.5, 1e-3], name: drill}}  # ä
    </rosparam>
    <rosparam subst_value="true">shift: $(arg given)</rosparam>
  </node>
</launch>
"""


def test_parameters_are_written_into_the_launch_and_yaml_files_that_they_come_from(master, hearing, tmp_path):
    environment = package_of_node(tmp_path, 'launched_package', 'launched.py', LAUNCHED)
    script = tmp_path / 'launched_package' / 'launched.py'
    launch, tall, turn = tmp_path / 'all.launch', tmp_path / 'tall.yaml', tmp_path / 'turn.yaml'
    launch.write_text(LAUNCH_FILE.format(folder=tmp_path, package='launched_package'), encoding='utf-8')
    tall.write_text('# ä\nheights: [1.0, 2.50,  3]  # 2.50\nother: .5\nside: "left"  # left\n', encoding='utf-8')
    turn.write_text('turn: rad(pi/4)\n')
    before = [file.read_bytes() for file in (launch, tall, turn)]
    heard = hearing('launched', PointStamped)
    start = ['rosslt', 'launch', '--no-markers', str(launch)]
    with launched(environment, *start):
        heard.next()
        ids = {place.local_name: place.location.id for place in places('/launched')}
        change('/launched', {ids['~tool/length']: 4.25, ids['~tool/tip/0']: 0.75})
        change('/launched', {ids['~x']: 3.25, ids['/tall/heights/1']: 4.0, ids['~turn']: math.pi / 8})
        texts = {'~frame': 'odom & <"ä">', '~tool/name': 'saw, no', '/tall/side': "right's"}
        change('/launched', {ids[name]: value for name, value in texts.items()})
        message = heard.next(lambda message: message.point.x == 3.25 and "right's" in message.header.frame_id)
        wanted, frame = point(message), str(message.header.frame_id)
        assert frame == ''.join(texts.values())
        change('/launched', {ids['~shown']: False})
        change('/launched', {ids['~given']: 9.5, ids['~shift']: 2.5})
        result = command('save', '--diff', '/launched')
        assert result.returncode == 1
        assert '~shift (it stands in' in result.stderr
        assert 'not saved: ~given (it stands in' in result.stderr
        assert 'through a substitution)' in result.stderr
        assert [file.read_bytes() for file in (launch, tall, turn)] == before
        change('/launched', {ids['~given']: 1.5, ids['~shift']: 1.5})
        # What was saved may be changed, and changed back, and saved again.
        in_between = {'~x': 2.75, '~tool/length': 1.5, '~tool/tip/0': 0.25, '/tall/heights/1': 2.5}
        assert len(save('/launched').splitlines()) == 9
        in_between.update({'~frame': 'map', '~tool/name': 'drill', '/tall/side': 'left', '~shown': True})
        change('/launched', {ids[name]: value for name, value in in_between.items()})
        assert len(save('/launched').splitlines()) == 8
        assert before[1] == tall.read_bytes()
        assert b'length: 1.50, "tip": [.25,' in launch.read_bytes()
        change('/launched', {ids['~tool/length']: 4.25, ids['~tool/tip/0']: 0.75})
        change('/launched', {ids['~x']: 3.25, ids['/tall/heights/1']: 4.0})
        change('/launched', {ids[name]: value for name, value in texts.items()})
        assert len(save('/launched').splitlines()) == 7
        assert save('/launched') == ''
    assert [file.read_bytes() for file in (launch, tall, turn)] == [
        before[0]
        .replace(b"value='2.50'", b"value='3.25'")
        .replace(b'length: 2.50, "tip": [.5,', b'length: 4.25, "tip": [.75,')
        .replace(b'name: drill', b"name: 'saw, no'")
        .replace(b'value="map"', 'value="odom &amp; &lt;&quot;ä&quot;&gt;"'.encode()),
        before[1].replace(b'[1.0, 2.50,', b'[1.0, 4.00,').replace(b'"left"', b'"right\'s"'),
        b'turn: 0.39269908169872414\n',
    ]
    with launched(environment, *start):
        assert heard.next(lambda message: point(message) == wanted).header.frame_id == frame
        assert save('/launched') == ''
        change('/launched', {ids['/tall/heights/1']: 6.75})
        heard.next(lambda message: message.point.y == 6.75)
    # What was changed while the node ran before, it reads as it is now.
    with launched(environment, 'rosslt', 'run', str(script), '__name:=launched'):
        heard.next(lambda message: message.point.y == 6.75)
        assert save('/launched').splitlines() == [f'/launched//tall/heights/1\t4.00\t6.75\t{tall}']
        expected = before[1].replace(b'[1.0, 2.50,', b'[1.0, 6.75,').replace(b'"left"', b'"right\'s"')
        assert tall.read_bytes() == expected


INCLUDED = """<launch>
  <node pkg="included_package" type="included.py" name="included" output="screen">
    <param name="x" value="1.5"/>
    <rosparam file="{folder}/heights.yaml"/>
  </node>
</launch>
"""


def test_what_a_file_says_for_several_nodes_is_written_where_they_agree(master, hearing, tmp_path):
    code = LAUNCHED[: LAUNCHED.index('x = ')] + (
        "while not rospy.is_shutdown():\n    p = PointStamped()\n    p.point.x = rospy.get_param('~x')\n"
        "    p.point.y = rospy.get_param('~heights')[1]\n    pub.publish(p)\n    rospy.sleep(0.03)\n"
    )
    environment = package_of_node(tmp_path, 'included_package', 'included.py', code)
    included, both, heights = tmp_path / 'included.launch', tmp_path / 'both.launch', tmp_path / 'heights.yaml'
    included.write_text(INCLUDED.format(folder=tmp_path))
    heights.write_text('heights: [1.0, 2.5]\n')
    both.write_text(f'<launch><include file="{included}" ns="left"/><include file="{included}" ns="right"/></launch>')
    before = included.read_text(), heights.read_text()
    heard = {name: hearing(f'{name}/launched', PointStamped) for name in ('left', 'right')}
    start = ['rosslt', 'launch', '--no-markers', str(both)]
    with launched(environment, *start):
        for name, one in heard.items():
            one.next()
            ids = {place.local_name: place.location.id for place in places(f'/{name}/included')}
            change(f'/{name}/included', {ids['~x']: 3.25, ids['~heights/1']: 4.25})
            if name == 'left':
                result = command('save', '/left/included')
                assert (result.returncode, result.stdout) == (1, '')
                assert f'~x ({included} says it for /right/included/x as well, which is 1.5)' in result.stderr
                assert f'({heights} says it for /right/included/heights/1 as well, which is 2.5)' in result.stderr
                assert (included.read_text(), heights.read_text()) == before
        assert len(save('/left/included').splitlines()) == 2
        assert save('/right/included') == ''
        assert command('undo', '/left/included').returncode == 0
        result = command('save', '/left/included')
        assert (result.returncode, result.stdout) == (1, '')
        assert f'~x ({included} says it for /right/included/x as well, which is 3.25)' in result.stderr
    assert included.read_text() == before[0].replace('1.5', '3.25')
    assert heights.read_text() == before[1].replace('2.5', '4.25')


WHOLE = (
    LAUNCHED[: LAUNCHED.index('x = ')]
    + """
ki, kd, n = rospy.get_param('~ki'), rospy.get_param('~kd'), rospy.get_param('~n', 3)
while not rospy.is_shutdown():
    pub.publish(point=Point(ki * 0.5 + kd * 0.5, kd * 0.5 + n * 0.5, 0.0))
    rospy.sleep(0.03)
""".replace('\nki', '\nfrom geometry_msgs.msg import Point\nki')
)


def test_where_a_whole_number_takes_no_fraction_its_line_is_named(master, hearing, tmp_path):
    environment = package_of_node(tmp_path, 'whole_package', 'whole.py', WHOLE)
    launch, gains = tmp_path / 'whole.launch', tmp_path / 'gains.yaml'
    gains.write_text('# gains\n\nki: 0\n')
    launch.write_text(
        '<launch>\n<node pkg="whole_package" type="whole.py" name="counting">\n'
        f'<rosparam file="{gains}"/>\n<param name="kd" value="2"/>\n</node>\n</launch>\n'
    )
    heard = hearing('launched', PointStamped)
    start = ['rosslt', 'launch', '--no-markers', str(launch)]
    with launched(environment, *start):
        heard.next()
        read = next(place.file for place in places('/counting') if place.local_name == '~n')
        for name, given in (
            ('ki', f'0 in {gains}:3; if the node takes fractions, write 0.0 there'),
            ('kd', f'2 in {launch}:4; if the node takes fractions, write 2.0 there'),
            ('n', f'3 where {read} reads it from; if the node takes fractions, write 3.0 there'),
        ):
            told = command('set', f'/counting/~{name}', '0.05').stderr
            assert told == f"rosslt set: /counting/~{name}: '0.05' is not an int; it is given as {given}\n"
        assert 'it is given' not in command('set', '/counting/~ki', 'far').stderr


def test_a_long_text_that_a_file_says_is_not_kept_beside_the_origins(tmp_path):
    description = tmp_path / 'robot.urdf'
    description.write_text('<robot/>')
    loader, config = NotingLoader(), ROSLaunchConfig()
    text = f'<launch><param name="robot" textfile="{description}"/><param name="frame" value="map"/></launch>'
    loader.load_string(text, config, verbose=False)
    assert config.params['/robot'].value == '<robot/>'
    assert (loader.origins['/robot']['said'], loader.origins['/robot']['is_substituted']) == (None, True)
    assert (loader.origins['/frame']['said'], loader.origins['/frame']['text']) == ('map', 'map')


def test_parameters_that_a_launch_file_gives_to_nodes_have_their_places():
    loader, config = NotingLoader(), ROSLaunchConfig()
    node = '<node pkg="p" type="t" name="{}">{}</node>'
    own = '<param name="~x" value="1"/><param name="y" value="2"/><rosparam>y: 3</rosparam>'
    nodes = node.format('own', own), node.format('given', '<rosparam>z: 5</rosparam>')
    outer = '<param name="~z" value="4"/><param name="own/w" value="6"/>'
    text = f'<launch><group ns="ns">{outer}{"".join(nodes)}</group>{node.format("outside", "")}</launch>'
    loader.load_string(text, config, verbose=False)
    said = {name: (one['said'], one.get('tag', ())[:1]) for name, one in loader.origins.items()}
    assert {name: given for name, (given, _) in said.items()} == {
        name: one.value for name, one in config.params.items()
    }
    assert said == {
        '/ns/own/w': (6, (1,)),
        '/ns/own/x': (1, (2,)),
        '/ns/own/y': (2, (3,)),
        '/ns/own/z': (4, (0,)),
        '/ns/given/z': (4, (0,)),
    }
