"""Static transform publishers of launch files keep the provenance of their numbers."""

import itertools
import os

import pytest
import roslaunch.core
import rospy
from roslaunch.config import ROSLaunchConfig
from tf2_msgs.msg import TFMessage

from rosslt.instrument import static_transforms
from rosslt.instrument.parameter_origins import NotingLoader
from support.packages import launched
from support.processes import wait_until
from support.shell import lines, rosslt

NODE = '<node pkg="{}" type="static_transform_publisher" name="{}" args="{} {}"/>'


class Frames:
    """The latest message of each frame, as (topic, message, transform)."""

    def __init__(self):
        self.seen = {}
        for topic in ('/tf', '/tf_static'):
            rospy.Subscriber(topic, TFMessage, self._take, topic)

    def _take(self, message, topic):
        for one in message.transforms:
            self.seen[one.child_frame_id] = topic, message, one

    def numbers(self, frame):
        transform = wait_until(lambda: self.seen.get(frame), f'the frame {frame}')[2].transform
        return [getattr(part, name) for part in (transform.translation, transform.rotation) for name in part.__slots__]


@pytest.fixture(scope='module')
def frames(master):
    return Frames()


def test_transforms_are_those_that_the_nodes_of_tf_send(frames, tmp_path):
    cases = [
        ('tf2_ros', '1 -0.25 3.5 0.1 0.2 -0.3', '/base', ''),
        ('tf2_ros', '.1 0 1e-1 0 0 0.6 0.8', 'base', ''),
        ('tf', '1 2 3 3 -1.5 0.25', '/base', ' 50'),
        ('tf', '1 2 3 0.5 0.5 -0.5 0.5', 'base', ' 50'),
    ]
    names = [f'{kind}_{number}' for number, kind in itertools.product(range(len(cases)), ('theirs', 'ours'))]
    nodes = [
        NODE.format(package, name, numbers, f'{base} {base.replace("base", name)}{period}')
        for (package, numbers, base, period), pair in zip(cases, zip(names[::2], names[1::2]))
        for name in pair
    ]
    file = tmp_path / 'pairs.launch'
    file.write_text('<launch>{}</launch>'.format(''.join(nodes)))
    others = [word for name in names[::2] for word in ('--except', name)]
    with launched(dict(os.environ), 'rosslt', 'launch', '--no-markers', *others, str(file)):
        for theirs, ours in zip(names[::2], names[1::2]):
            for name in (theirs, ours):
                wait_until(lambda name=name: {name, '/' + name} & set(frames.seen), name)
            one, other = (frames.seen.get(name) or frames.seen['/' + name] for name in (theirs, ours))
            assert one[0] == other[0]
            assert one[2].header.frame_id == other[2].header.frame_id
            assert one[2].child_frame_id == other[2].child_frame_id.replace('ours', 'theirs')
            assert frames.numbers(one[2].child_frame_id) == pytest.approx(
                frames.numbers(other[2].child_frame_id), abs=1e-12
            )


LAUNCHED = """<launch>
  <arg name="height" default="0.5"/>  <!-- args="0.1 0 0.5 0 0 0 base camera" -->
  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_tf"
        args='0.1  0 $(arg height) 0 0&#32;0 base camera' respawn="true"/>
  <node pkg="tf" type="static_transform_publisher" name="laser_tf" args="1 2.50 3 0 0 0 1 base laser 50"/>
</launch>
"""


def test_numbers_are_changed_dragged_and_written_into_the_launch_file(frames, hand, tmp_path):
    file = tmp_path / 'mount.launch'
    file.write_text(LAUNCHED)
    start = dict(os.environ), 'rosslt', 'launch', '--no-markers', str(file)
    with launched(*start):
        wait_until(lambda: '~roll' in rosslt('list', '/camera_tf').stdout, 'its numbers')
        assert lines('set', '/camera_tf/~x', '0.25')[0][:3] == ['/camera_tf/~x', '0.1', '0.25']
        wait_until(lambda: frames.numbers('camera')[0] == 0.25, 'the frame follows')
        assert frames.numbers('laser')[:3] == [1.0, 2.5, 3.0]
        field = '/tf/transforms[0]/transform/translation/x'
        assert lines('force', field, '4.5')[0][:3] == ['/laser_tf/~x', '1.0', '4.5']
        name = wait_until(lambda: [one for one in hand.names() if 'camera' in one], 'its handle')[0]
        held = hand.press(name)
        hand.move(held, dy=0.75)
        hand.release(held)
        wait_until(lambda: frames.numbers('camera')[:3] == [0.25, 0.75, 0.5], 'the frame is where it was dropped')
        assert rosslt('set', '/camera_tf/~z', '1.5').returncode == 0
        saved = rosslt('save', '/camera_tf')
        assert saved.returncode == 0, saved.stderr
        assert f'/camera_tf/~z\t0.5\t1.5\t{file}\n' in saved.stdout
        assert rosslt('save', '/laser_tf').returncode == 0
    written = LAUNCHED.replace("'0.1  0 $", "'0.25  0.75 $").replace('"1 2.50', '"4.5 2.50')
    written = written.replace('default="0.5"', 'default="1.5"')
    assert file.read_text() == written
    frames.seen.clear()
    with launched(*start):
        wait_until(lambda: frames.numbers('camera')[:3] == [0.25, 0.75, 1.5], 'the frame is there again')
        assert frames.numbers('laser')[:3] == [4.5, 2.5, 3.0]


@pytest.mark.parametrize(
    ('package', 'arguments'),
    [
        ('tf2_ros', '0 0 0 0 0 base odd'),
        ('tf2_ros', '0 0 0 0 0 0 base odd 100'),
        ('tf2_ros', '0 0 0 0 0 nan base odd'),
        ('tf2_ros', 'a b c d e f base odd'),
        ('tf2_ros', '1_0 0 0 0 0 0 base odd'),
        ('tf2_ros', '0 0 0 0 0 0 odd odd'),
        ('tf2_ros', '~frames'),
        ('tf', '0 0 0 0 0 0 base odd'),
        ('tf', '0 0 0 0 0 0 base odd 0'),
        ('tf', ''),
        ('nodelet', '0 0 0 0 0 0 base odd'),
    ],
)
def test_what_is_no_transform_is_left_to_the_node_of_tf(package, arguments):
    config, loader = ROSLaunchConfig(), NotingLoader()
    node = NODE.format(package, 'odd', arguments, '').replace(' "/>', '"/>')
    loader.load_string(f'<launch>{node}</launch>', config, verbose=False)
    (one,) = config.nodes
    before = one.package, one.type, one.args
    static_transforms.keep_provenance(one, config, loader)
    assert (one.package, one.type, one.args) == before
    assert not [key for key in config.params if key.startswith('/odd')]


def test_names_that_are_given_to_the_node_stay():
    config, loader = ROSLaunchConfig(), NotingLoader()
    node = NODE.format('tf2_ros', 'one', '__log:=a 1 2 3 0 0 0', 'base odd tf_static:=other')
    loader.load_string(f'<launch><group ns="left">{node}</group></launch>', config, verbose=False)
    (one,) = config.nodes
    static_transforms.keep_provenance(one, config, loader)
    assert (one.type, one.args) == ('slt_static_transform', 'angles base odd __log:=a tf_static:=other')
    assert config.params['/left/one/y'].value == 2.0
    assert loader.origins['/left/one/y']['word'] == 2


def test_only_nodes_on_this_machine_are_replaced():
    config, loader = ROSLaunchConfig(), NotingLoader()
    nodes = ''.join(NODE.format('tf2_ros', name, '0 0 0 0 0 0', f'base {name}') for name in ('one', 'other'))
    loader.load_string(f'<launch>{nodes}</launch>', config, verbose=False)
    for one, address in zip(config.nodes, ('localhost', '192.0.2.1')):
        one.machine = roslaunch.core.Machine(one.name, address)
        static_transforms.keep_provenance(one, config, loader)
    assert [one.package for one in config.nodes] == ['rosslt', 'tf2_ros']


@pytest.mark.parametrize(
    ('arguments', 'written'),
    [
        ('1 2 $(arg three) 0 0 0 $(arg base) odd', ['x', 'y', 'z', 'yaw', 'pitch', 'roll']),
        ('1$(arg none) 2 0 0 0 0 $(arg base) odd', ['y', 'z', 'yaw', 'pitch', 'roll']),
        ('$(arg three) $(arg three)$(arg none) 0 0 0 0 base odd', ['z', 'yaw', 'pitch', 'roll']),
        ('$(arg two) 3 0 $(arg none) 0 0 base odd', []),
        ("$(eval '1 2 3 0 0 0 base odd')", []),
    ],
)
def test_words_beside_substitutions_of_one_word_are_known(arguments, written):
    config, loader = ROSLaunchConfig(), NotingLoader()
    given = {'two': '1 2', 'three': '3', 'none': '', 'base': 'base'}
    tags = ''.join(f'<arg name="{name}" default="{value}"/>' for name, value in given.items())
    node = NODE.format('tf2_ros', 'odd', arguments, '').replace(' "/>', '"/>')
    loader.load_string(f'<launch>{tags}{node}</launch>', config, verbose=False)
    static_transforms.keep_provenance(config.nodes[0], config, loader)
    assert [key[5:] for key, origin in loader.origins.items() if not origin['is_substituted']] == written


def test_numbers_of_an_earlier_run_are_not_taken(frames, tmp_path):
    file = tmp_path / 'turned.launch'
    file.write_text('<launch>{}</launch>'.format(NODE.format('tf2_ros', 'turned_tf', '1 2 3 0 0 0', 'base turned')))
    for name, value in zip(('qx', 'qy', 'qz', 'qw'), (0.5, 0.5, 0.5, 0.5)):
        rospy.set_param(f'/turned_tf/{name}', value)
    with launched(dict(os.environ), 'rosslt', 'launch', '--no-markers', str(file)):
        assert frames.numbers('turned') == [1, 2, 3, 0, 0, 0, 1]
