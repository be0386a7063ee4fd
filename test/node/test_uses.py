"""Which sources of a thing move other things as well."""

import pytest
from geometry_msgs.msg import Point, Point32, PoseStamped, TransformStamped, Twist
from nav_msgs.msg import Path
from sensor_msgs.msg import PointCloud
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import math, node, values

DOCK, BESIDE, ANGLE = (values.Source('/owner', number) for number in range(3))


def number(*sources):
    return sum(values.track(1.0, source) for source in sources)


def test_what_another_thing_comes_from_is_shared_and_the_same_thing_shown_twice_is_none():
    uses = node.Uses()
    gate = [number(DOCK, BESIDE), number(ANGLE)]
    uses.put('gate', gate)
    assert uses.shared('gate', gate) == [set(), set()]
    uses.put('target', gate)
    uses.put('label', [number(DOCK, BESIDE, ANGLE)])
    assert uses.shared('gate', gate) == [set(), set()]
    uses.put('dock', [number(DOCK)])
    assert uses.shared('gate', gate) == [{DOCK}, set()]
    assert uses.shared('dock', [number(DOCK)]) == [set()]
    uses.drop('dock')
    uses.drop('dock')
    assert uses.shared('gate', gate) == [set(), set()]


def test_a_thing_that_comes_from_something_else_now_has_left_its_sources():
    uses = node.Uses()
    uses.put('dock', [number(DOCK)])
    uses.put('dock', [number(ANGLE)])
    assert uses.shared('gate', [number(DOCK, BESIDE)]) == [set()]
    assert uses.shared('gate', [number(ANGLE, BESIDE)]) == [{ANGLE}]


def row_of(start, step, count):
    """The x of things in a row."""
    return [values.track(start, DOCK) + index * values.track(step, BESIDE) for index in range(count)]


def test_of_numbers_from_the_same_sources_those_with_other_values_move():
    uses = node.Uses()
    places = row_of(1.0, 0.5, 3)
    for index, place in enumerate(places):
        uses.put(str(index), [place])
    assert uses.shared('0', places[:1]) == [set()]
    assert uses.shared('0', places[:1]).alike == {DOCK, BESIDE}
    for index in range(3):
        uses.drop(str(index))
    uses.put('again', [values.track(0.3, DOCK)])
    uses.put('label', [values.track(0.3, DOCK) + values.track(0.0, ANGLE)])
    for same in (0.3, 0.1 + 0.2, 0.30000001192092896):
        assert uses.shared('thing', [values.track(same, DOCK)]).alike == set(), 'rounding, and that to 32 bits'
    assert uses.shared('thing', [values.track(0.31, DOCK)]).alike == {DOCK}
    uses.put('again', [values.track(0.31, DOCK)])
    assert uses.shared('thing', [values.track(0.31, DOCK)]).alike == set(), 'the values are those of the last message'


def test_the_numbers_of_a_double_are_compared_with_all_of_a_thing():
    uses = node.Uses()
    yaw = values.track(0.8, ANGLE)
    turn = [math.sin(yaw / 2), math.cos(yaw / 2)]
    uses.put('arrow', turn)
    assert uses.shared('pose', turn).alike == set()
    assert uses.shared('pose', [values.track(1.0, DOCK), math.cos(yaw)]).alike == {ANGLE}


@pytest.mark.parametrize('beside', [0.5, 0.6])
def test_what_a_thing_is_moved_by_does_not_depend_on_how_late_its_double_is(beside):
    uses = node.Uses()
    dock, gate = values.track(2.0, DOCK), values.track(2.0, DOCK) + values.track(0.5, BESIDE)
    uses.put('dock', [dock])
    uses.put('gate', [gate])
    uses.put('label', [dock + values.track(beside, BESIDE)])
    shared = uses.shared('gate', [gate])
    assert node.Directory().held([gate], shared) == [DOCK]
    noted = node.Directory().shared([gate], shared, [BESIDE])
    assert noted == ([] if beside == 0.5 else [BESIDE])


def marker(x, width=1.0, turn=0.0, points=()):
    found = Marker(points=[Point(one, 0.0, 0.0) for one in points])
    found.pose.position.x, found.pose.orientation.z, found.scale.x = x, turn, width
    return found


def pose(x, y=0.0, turn=0.0):
    found = PoseStamped()
    found.pose.position.x, found.pose.position.y, found.pose.orientation.z = x, y, turn
    return found


def frame(x, turn=0.0):
    found = TransformStamped()
    found.transform.translation.x, found.transform.rotation.z = x, turn
    return found


def twist(x, z):
    found = Twist()
    found.linear.x, found.angular.z = x, z
    return found


GATE = number(DOCK, BESIDE)


@pytest.mark.parametrize(
    ('message', 'path', 'shared'),
    [
        (marker(GATE, points=[number(DOCK)]), 'pose/position/x', [{DOCK}]),
        (marker(number(DOCK), points=[GATE, 1.0]), 'points[0]/x', [{DOCK}]),
        (marker(GATE, width=number(DOCK)), 'pose/position/x', [{DOCK}]),
        (marker(number(DOCK), width=GATE), 'scale/x', [{DOCK}]),
        (MarkerArray([marker(GATE), marker(1.0, turn=number(DOCK))]), 'markers[0].pose.position.x', [{DOCK}]),
        (MarkerArray([marker(GATE), marker(1.0, points=[number(DOCK)])]), 'markers[0]/pose', [{DOCK}]),
        (Path(poses=[pose(GATE), pose(number(DOCK))]), 'poses[0]/pose/position/x', [{DOCK}]),
        (PointCloud(points=[Point32(GATE, 0, 0), Point32(0, number(DOCK), 0)]), 'points[0]/x', [{DOCK}]),
        (TFMessage([frame(GATE), frame(1.0, number(DOCK))]), 'transforms[0]/transform/translation/x', [{DOCK}]),
        (pose(GATE, number(DOCK), number(BESIDE)), 'pose/position/x', [set(), set()]),
        (twist(GATE, number(DOCK)), 'linear/x', [set()]),
        (Point(GATE, 0.0, 0.0), 'x', [set()]),
    ],
)
def test_what_else_a_message_shows_is_a_thing_of_its_own(message, path, shared):
    assert node.shared_in(message, path) == shared
