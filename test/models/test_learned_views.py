"""Handles on what C++ nodes send that nobody tracks, by what was learned of them, and drags of these."""

import contextlib
import json
import subprocess
from pathlib import Path

import pytest
import rospy

from support.masters import reached_master
from support.opaque_nodes import running
from support.processes import Node, wait_until
from support.shell import rosslt

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

#: A plain node, for `rosslt run`.
TALKER = """
import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('talker')
publisher, rate = rospy.Publisher('target', PointStamped, queue_size=1), rospy.Rate(50)
while not rospy.is_shutdown():
    target = PointStamped()
    target.header.frame_id = 'map'
    target.header.stamp = rospy.Time.now()
    target.point.x = 0.5
    target.point.y = 2.0
    publisher.publish(target)
    rate.sleep()
"""
#: A hand in RViz, as far as the view can tell: it does what a line says, and prints what comes of it.
HAND = """
    sys.path.insert(0, {tests!r})
    from support.hand import Hand
    hand, last = Hand(), {{}}
    from geometry_msgs.msg import PointStamped
    for topic in ('/target', '/point'):
        rospy.Subscriber(topic, PointStamped, lambda message, topic: last.update({{topic: message.point}}), topic)

    def at(topic):
        return (last[topic].x, last[topic].y) if topic in last else None

    def drag(x, y):
        feedback = hand.press('/point')
        place = feedback.pose.position
        hand.move(feedback, dx=x - place.x, dy=y - place.y, steps=20)
        hand.release(feedback)

    def note():
        found = hand._markers.get('/point:note')
        return found.controls[0].markers[0].text.replace('\\n', ' ') if found else ''

    for line in sys.stdin:
        print(json.dumps(eval(line)), flush=True)
    """
HANDLE = '/point'


class Stage:
    """A talker that is tracked, and a view, between them a C++ node that is not."""

    def __init__(self, hand, program, kind):
        self._hand, self._program, self._kind = hand, program, kind

    def ask(self, expression):
        self._hand.process.stdin.write(f'{expression}\n')
        self._hand.process.stdin.flush()
        return json.loads(self._hand.read_line())

    def names(self):
        return self.ask('sorted(hand.names())')

    def has_handle(self):
        return HANDLE in self.names()

    def drag(self, x, y):
        """Drag the handle to a place, from where the node's messages have it."""
        wait_until(lambda: self.is_near(*self.place()), 'the handle is where the node has it')
        self.ask(f'drag({x}, {y})')

    def is_near(self, *place):
        """Whether the C++ node sends a place."""
        return self.at('/point') == pytest.approx(place, abs=1e-3)

    def comes_to(self, *place):
        wait_until(
            lambda: self.is_near(*place), lambda: f'it comes to {place}; it is at {self.at("/point")}, {self.note()}'
        )

    def at(self, topic='/target'):
        """x and y of what comes on a topic."""
        return self.ask(f'at({topic!r})')

    def place(self):
        """Where the handle is."""
        return self.ask('hand.position("/point")[:2]')

    def is_told(self, text):
        """Wait until the view says something at the handle."""
        wait_until(lambda: text in self.note(), lambda: f'{text!r} is said; it is {self.note()!r}')

    def set_gain(self, gain):
        """Give the node that runs another gain, which nobody sees."""
        subprocess.run(['rostopic', 'pub', '-1', '/set_gain', 'std_msgs/Float64', f'data: {gain}'], check=True)
        wait_until(lambda: self.at('/point')[0] == gain * self.at()[0] + 1.0, 'the node has another gain')

    def note(self):
        """What the view says at the handle."""
        return self.ask('note()')

    def node(self, *arguments):
        return running('/opaque', self._program, f'_kind:={self._kind}', *arguments)


@contextlib.contextmanager
def staged(folder, program, kind, seconds=2):
    """A Stage whose node was learned and runs."""
    file = folder / 'talker.py'
    file.write_text(TALKER, encoding='utf-8')
    with reached_master(folder / 'log'), running('/talker', 'rosslt', 'run', str(file)):
        hand = HAND.format(tests=str(Path(__file__).parents[1]))
        view = subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdin=subprocess.DEVNULL)
        try:
            with Node('hand', hand) as process:
                stage = Stage(process, program, kind)
                with stage.node():
                    wait_until(lambda: stage.is_near(2.25, 4.0), 'the node has settled')
                    found = rosslt('learn', '/opaque', f'--seconds={seconds}')
                    assert found.returncode == 0, found.stderr
                yield stage
        finally:
            view.terminate()
            view.wait(20)


@pytest.fixture(scope='module')
def stage(program, tmp_path_factory):
    """One for all tests of a gain."""
    with staged(tmp_path_factory.mktemp('gain'), program, 'point') as made:
        yield made


def test_a_drag_moves_the_source_of_the_input(stage):
    with stage.node():
        wait_until(stage.has_handle, 'there is a handle on what the node sends')
        assert stage.at() == [0.5, 2.0]
        stage.drag(2.35, 4.2)
        stage.comes_to(2.35, 4.2)
        assert stage.at() == pytest.approx([0.54, 4.2**0.5], abs=1e-3)
        stage.drag(2.25, 4.0)
        stage.comes_to(2.25, 4.0)


def test_no_input_leaves_the_range_that_was_learned(stage):
    with stage.node():
        stage.drag(2.75, 4.0)
        stage.is_told('/target/point/x would be 0.7, and was learned from 0.45 to 0.55 only')
        assert 0.45 <= stage.at()[0] <= 0.55
        stage.drag(2.25, 4.0)
        stage.comes_to(2.25, 4.0)


@pytest.mark.parametrize(('gain', 'how'), [(-2.5, 'moved the other way'), (0.0, 'not moved')])
def test_a_node_that_does_something_else_is_left(stage, gain, how):
    with stage.node():
        stage.set_gain(gain)
        before = stage.at()
        stage.drag(gain * before[0] + 1.05, stage.at('/point')[1])
        stage.is_told(f'/opaque: it has {how}, and was to move by')
        assert '; taken back' in stage.note()
        wait_until(lambda: stage.at() == before, lambda: f'it is taken back; it is {stage.at()}')


def test_a_node_that_has_changed_is_corrected(stage):
    with stage.node():
        stage.set_gain(3.25)
        x, y = stage.at('/point')
        stage.drag(x + 0.06, y)
        stage.comes_to(x + 0.06, y)


def test_the_handle_goes_if_its_node_is_another_now(stage):
    with stage.node('_gain:=3.0'):
        wait_until(lambda: not stage.has_handle(), 'the handle is gone')
    rospy.delete_param('/opaque/gain')
    with stage.node():
        wait_until(stage.has_handle, 'there is a handle again')


@pytest.mark.parametrize('kind', ['point_delay', 'point_low_pass'])
def test_what_follows_late_or_slowly_is_waited_for(program, tmp_path, kind):
    with staged(tmp_path, program, kind, seconds=5) as stage, stage.node():
        wait_until(lambda: stage.has_handle() and stage.is_near(2.25, 4.0), 'there is a handle where the node stays')
        stage.drag(2.35, 4.0)
        stage.comes_to(2.35, 4.0)
        assert stage.at() == pytest.approx([0.54, 2.0], abs=1e-3)
        assert stage.has_handle()
