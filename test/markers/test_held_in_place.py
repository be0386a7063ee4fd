"""Things that a person has told to stay in place while others are dragged."""

import itertools
import math

import pytest
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState

from rosslt import values
from rosslt.markers.drags import changes
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.scene import joints
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.node import Change
from rosslt.node.change import change_request
from support.processes import wait_until
from support.scenery import take

JOINT = """
  <joint name="joint {0}" type="revolute">
    <parent link="l{1}"/><child link="l{0}"/><origin xyz="{2} 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3"/>
  </joint>
  <link name="l{0}"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
"""

#: A flat arm of four links of 1 m.
ARM = f"""
<robot name="arm">
  <link name="l0"/>
  {''.join(JOINT.format(number, number - 1, min(number - 1, 1)) for number in range(1, 5))}
  <joint name="flange" type="fixed"><parent link="l4"/><child link="hand"/><origin xyz="1 0 0"/></joint>
  <link name="hand"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
</robot>
"""

ANGLES = [0.3, 0.4, 0.5, 0.6]
SOURCES = [values.Source('/arm', number) for number in range(4)]


class Shown:
    """A scene of what a node shows of some numbers, which does at once what a drag asks for."""

    def __init__(self, monkeypatch, numbers):
        monkeypatch.setattr(changes.node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})
        monkeypatch.setattr(change_request, 'request_values', self._change)
        self.scene, self.numbers = Scene(Settings()), list(numbers)
        self.drags, self._said = Drags(self.scene, Rules(rate=1000.0), str), []
        self.show()

    def show(self):
        """Show it as it is now."""
        raise NotImplementedError

    def _tracked(self):
        return [values.track(number, source) for number, source in zip(self.numbers, SOURCES)]

    def _change(self, wanted, _timeout, _request_id, _asker):
        changed = {source: Change(self.numbers[source.location_id], value) for source, value in wanted.items()}
        for source, value in wanted.items():
            self.numbers[source.location_id] = value
        return changed

    def said(self):
        self._said += [text for _, text in self.scene.news().said]
        return self._said


class Points(Shown):
    """Points with an x alone, which a function gives from the numbers: {topic: x}, or {topic: (x, frame)}."""

    def __init__(self, monkeypatch, numbers, given):
        self.given = given
        super().__init__(monkeypatch, numbers)

    def show(self):
        for topic, x in self.given(*self._tracked()).items():
            point = PointStamped()
            point.point.x, point.header.frame_id = x if isinstance(x, tuple) else (x, 'world')
            take(self.scene, topic, point)

    def x(self, topic):
        return self.scene.handle(topic).pose[0]

    def pull(self, topic, *xs):
        """Pull a point along, each time until it is there, while messages show it; the button stays down."""
        assert self.drags.hold(topic)
        for x in xs:
            assert self.drags.move(topic, 'world', (x, *self.scene.handle(topic).pose[1:]))

            def is_there(x=x):
                self.show()
                return self.x(topic) == pytest.approx(x, abs=1e-3)

            wait_until(is_there, f'{topic} is at {x}')


class Arm(Shown):
    """The arm in a scene."""

    def __init__(self, monkeypatch):
        joints._description_for.cache_clear()
        monkeypatch.setattr(joints.rospy, 'has_param', {'/robot_description': ARM}.__contains__)
        monkeypatch.setattr(joints.rospy, 'get_param_cached', {'/robot_description': ARM}.get)
        super().__init__(monkeypatch, ANGLES)

    @property
    def angles(self):
        return self.numbers

    def show(self):
        names = [f'joint {number}' for number in range(1, 5)]
        take(self.scene, '/joints', JointState(name=names, position=self._tracked()))

    def handle(self, link):
        return self.scene.handle(f'/joints:link {link}')

    def pull(self, link, x, y):
        """Pull a link to a place, and wait until it is there, or as near as it comes."""
        handle, before = self.handle(link), list(self.angles)
        assert self.drags.hold(handle.name)
        assert self.drags.move(handle.name, handle.frame, (x, y, *handle.pose[2:]))
        wait_until(lambda: self.angles != before, 'the arm has moved')
        assert self.drags.release(handle.name, handle.frame, (x, y, *handle.pose[2:]))
        self.show()
        return self.handle(link).pose


@pytest.fixture
def arm(monkeypatch):
    return Arm(monkeypatch)


def test_joints_before_a_link_that_is_held_in_place_stay(arm):
    x, y, *_ = arm.handle('hand').pose
    arm.drags.in_place.add('/joints:link l2')
    there = arm.pull('hand', x - 0.2, y - 0.1)
    assert there[:2] == pytest.approx((x - 0.2, y - 0.1), abs=2e-3)
    assert arm.angles[:2] == pytest.approx(ANGLES[:2], abs=1e-5)
    assert arm.angles[2:] != ANGLES[2:]


def test_without_it_one_of_them_moves(arm):
    x, y, *_ = arm.handle('hand').pose
    arm.pull('hand', x - 0.2, y - 0.1)
    assert arm.angles[:2] != ANGLES[:2]


def test_a_link_in_place_stays_if_the_pull_goes_too_far(arm):
    arm.drags.in_place.add('/joints:link l2')
    held, (x, y, *_) = arm.handle('l2').pose, arm.handle('l3').pose
    there = arm.pull('hand', 10.0, 0.0)
    assert arm.handle('l2').pose == pytest.approx(held, abs=1e-4)
    assert math.dist(there[:2], (x, y)) == pytest.approx(2.0, abs=0.02), 'stretched out towards the hand'
    wait_until(lambda: any('/joints:link l2 is held in place' in text for text in arm.said()), 'it is said')


def test_a_thing_that_is_held_in_place_can_be_dragged_itself(arm):
    arm.drags.in_place.add('/joints:link l3')
    x, y, *_ = arm.handle('l3').pose
    assert arm.pull('l3', x - 0.1, y)[:2] == pytest.approx((x - 0.1, y), abs=2e-3)


def test_what_is_held_in_place_and_gone_holds_nothing(arm):
    arm.drags.in_place.add('/nothing')
    there = math.cos(0.5), math.sin(0.5)
    assert arm.pull('l2', *there)[:2] == pytest.approx(there, abs=2e-3)


def test_what_stays_only_along_a_curve_stays_as_the_hand_moves(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0], lambda a, b: {'/sum': a + b, '/product': a * b})
    points.drags.in_place.add('/product')
    points.pull('/sum', 5.1, 5.3, 5.7)
    assert points.x('/product') == pytest.approx(6.0, abs=1e-3)


def test_its_numbers_stay_round(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0], lambda a, b: {'/a': a + b, '/b': a})
    points.drags.in_place.add('/b')
    points.pull('/a', 5.2999)
    assert points.numbers == [2.0, 3.3]


def test_a_number_does_not_move_a_bit_if_it_is_pulled_in_vain(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0], lambda a, b: {'/a': a, '/b': a, '/c': b})
    points.drags.in_place.add('/b')
    assert points.drags.hold('/a')
    assert points.drags.move('/a', 'world', (3.0, *points.scene.handle('/a').pose[1:]))
    wait_until(lambda: any('/b is held in place' in text for text in points.said()), 'it is said')
    assert points.numbers == [2.0, 3.0]


def test_numbers_of_the_thing_in_place_alone_do_not_change(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0, 4.0], lambda a, b, c: {'/a': a + b, '/b': a + c})
    points.drags.in_place.add('/b')
    points.pull('/a', 5.5)
    assert points.numbers == [2.0, 3.5, 4.0]


def test_what_its_node_moves_holds_no_hand_back(monkeypatch):
    moved = itertools.count()
    points = Points(monkeypatch, [2.0, 3.0], lambda a, b: {'/a': a + b, '/b': a + float(next(moved))})
    points.drags.in_place.add('/b')
    points.pull('/a', 5.1, 5.2, 5.3)
    assert points.numbers == [2.0, 3.3]


def test_what_has_gone_to_another_frame_holds_no_hand_back(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0], lambda a, b: {'/a': a + b, '/b': a})
    points.drags.in_place.add('/b')
    points.pull('/a', 5.1)
    points.given = lambda a, b: {'/a': a + b, '/b': (a + 7.0, 'map')}
    points.pull('/a', 5.2, 5.3)
    assert points.numbers == [2.0, 3.3]


def test_what_has_left_for_other_numbers_holds_no_hand_back(monkeypatch):
    points = Points(monkeypatch, [2.0, 3.0, 9.0], lambda a, b, c: {'/a': a + b, '/b': a})
    points.drags.in_place.add('/b')
    points.pull('/a', 5.1)
    points.given = lambda a, b, c: {'/a': a + b, '/b': b + c}
    points.pull('/a', 5.2, 5.3)
    assert points.numbers == [2.0, 3.3, 9.0]


def test_what_is_computed_in_another_way_by_then_stays(monkeypatch):
    def given(a, b):
        return {'/a': a + b, '/b': a * b if b < 3.05 else 2.0 * a * b - 6.0}

    points = Points(monkeypatch, [2.0, 3.0], given)
    points.drags.in_place.add('/b')
    points.pull('/a', 5.1, 5.3, 5.5)
    assert points.x('/b') == pytest.approx(6.0, abs=2e-3)
