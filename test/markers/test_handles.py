"""Which handles, with which controls, follow from what is tracked of a marker."""

import math as plain_math
from types import SimpleNamespace

import numpy
import pytest
from geometry_msgs.msg import Point, Quaternion
from visualization_msgs.msg import InteractiveMarkerControl as Control
from visualization_msgs.msg import Marker

from rosslt import math, node, values
from rosslt.markers.geometry import (
    are_same_rotation,
    inverse,
    normalized,
    product,
    rotate_vector,
    turn_without_noise,
    without_noise,
)
from rosslt.markers.rviz.controls import handle_marker
from rosslt.markers.scene.follower import Follower
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.marker import KINDS, marker_handles
from rosslt.markers.scene.rotations import rings_of
from rosslt.markers.scene.scene import Scene

LEAST_SIZE = 0.5
TURN = 0.6
TURNED = (0.0, 0.0, plain_math.sin(TURN / 2), plain_math.cos(TURN / 2))
POINT_KINDS = [
    Marker.LINE_STRIP,
    Marker.LINE_LIST,
    Marker.POINTS,
    Marker.SPHERE_LIST,
    Marker.CUBE_LIST,
    Marker.TRIANGLE_LIST,
    Marker.ARROW,
]


def is_free(_value):
    """All sources take changes."""
    return True


def tracked(value, number=1):
    return values.track(float(value), values.Source('/owner', number))


def marker(kind=Marker.CUBE, name='thing', number=0, size=1.0):
    result = Marker(ns=name, id=number, type=kind)
    result.header.frame_id = 'world'
    result.pose.orientation.w = 1.0
    result.scale.x = result.scale.y = result.scale.z = size
    return result


def handles(message, topic='/topic', is_shown=True, **settings):
    return {handle.name: handle for handle in marker_handles(topic, message, is_shown, Settings(**settings))}


def draw(handle, can_change=is_free, moves_freely=False):
    return handle_marker(handle, handle.motions(can_change), moves_freely, LEAST_SIZE, bool(handle.tracked))


def drawn(message, name='/topic:thing:0', **options):
    return draw(handles(message, **options)[name])


def controls(interactive):
    return {control.name: control for control in interactive.controls}


def quaternion(message):
    return message.x, message.y, message.z, message.w


def direction(interactive, control):
    """The direction in the frame that a control acts along."""
    rotation = quaternion(control.orientation)
    if control.orientation_mode == Control.INHERIT:
        rotation = product(quaternion(interactive.pose.orientation), rotation)
    return rotate_vector(normalized(*rotation), (1.0, 0.0, 0.0))


@pytest.mark.parametrize('is_rotated', [False, True])
@pytest.mark.parametrize(
    ('axes', 'mode', 'acts_along'),
    [
        ('x', Control.MOVE_AXIS, (1, 0, 0)),
        ('y', Control.MOVE_AXIS, (0, 1, 0)),
        ('z', Control.MOVE_AXIS, (0, 0, 1)),
        ('xy', Control.MOVE_PLANE, (0, 0, 1)),
        ('xz', Control.MOVE_PLANE, (0, 1, 0)),
        ('yz', Control.MOVE_PLANE, (1, 0, 0)),
        ('xyz', Control.MOVE_PLANE, (0, 0, 1)),
    ],
)
def test_tracked_coordinates_give_axes_plane_and_body_along_the_frame(axes, mode, acts_along, is_rotated):
    message = marker()
    if is_rotated:
        message.pose.orientation = Quaternion(*TURNED)
    for axis in axes:
        setattr(message.pose.position, axis, tracked(2.0))
    interactive = drawn(message)
    found = controls(interactive)
    assert set(found) == {'body'} | {'move_' + axis for axis in axes}
    for axis in axes:
        assert found['move_' + axis].interaction_mode == Control.MOVE_AXIS
        expected = tuple(float(axis == one) for one in 'xyz')
        assert direction(interactive, found['move_' + axis]) == pytest.approx(expected, abs=1e-9)
    assert found['body'].interaction_mode == mode
    assert direction(interactive, found['body']) == pytest.approx(acts_along, abs=1e-9)


def test_a_body_moves_freely_only_where_that_was_chosen():
    message = marker()
    for axis in 'xyz':
        setattr(message.pose.position, axis, tracked(2.0))
    (handle,) = handles(message).values()
    assert controls(draw(handle, moves_freely=True))['body'].interaction_mode == Control.MOVE_3D


def test_in_2d_things_move_in_x_and_y_and_turn_around_z():
    message = marker()
    for number, axis in enumerate('xyz'):
        setattr(message.pose.position, axis, tracked(2.0, number))
    message.pose.orientation = roll_pitch_yaw(tracked(0.0, 4), tracked(0.0, 5), tracked(0.0, 6))
    (handle,) = handles(message, is_planar=True).values()
    assert set(controls(draw(handle))) == {'body', 'move_x', 'move_y', 'rotate_z'}
    wanted, _ = handle.wanted((3.0, 4.0, 5.0, 0.0, 0.0, 0.0, 1.0), moved=True, turned=False)
    assert len(wanted) == 2, 'z is not asked for'


def test_in_2d_heights_have_no_handles():
    message = marker()
    for number, axis in enumerate('xyz'):
        setattr(message.scale, axis, tracked(2.0, number))
    assert set(handles(message, is_planar=True)) == {'/topic:thing:0:scale.x', '/topic:thing:0:scale.y'}
    message.pose.orientation = roll_pitch_yaw(plain_math.pi / 2, 0.0, 0.0)
    assert set(handles(message, is_planar=True)) == {'/topic:thing:0:scale.x', '/topic:thing:0:scale.z'}


def test_what_is_not_tracked_has_no_handle():
    assert not handles(marker())
    assert not handles(marker(Marker.LINE_STRIP))


def test_what_rviz_does_not_show_by_itself_is_drawn_even_if_it_cannot_be_moved():
    message = marker()
    message.color.r = message.color.a = 1.0
    (body,) = drawn(message, is_shown=False).controls
    assert body.interaction_mode == Control.NONE
    assert body.always_visible
    (shape,) = body.markers
    assert (shape.type, shape.scale, shape.color) == (message.type, message.scale, message.color)
    assert not shape.header.frame_id, 'it stands relative to the interactive marker'


def roll_pitch_yaw(roll, pitch, yaw):
    cr, sr, cp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2)
    sp, cy, sy = math.sin(pitch / 2), math.cos(yaw / 2), math.sin(yaw / 2)
    return Quaternion(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


@pytest.mark.parametrize(
    ('angles', 'rings'),
    [
        ((0.2, 0.3, tracked(0.4)), {'z': (0, 0, 1)}),
        ((tracked(0.2), 0.0, 0.0), {'x': (1, 0, 0)}),
        ((0.0, tracked(0.3), 0.4), {'v': (-plain_math.sin(0.4), plain_math.cos(0.4), 0)}),
        ((tracked(0.2, 1), tracked(0.3, 2), tracked(0.4, 3)), {'x': (1, 0, 0), 'y': (0, 1, 0), 'z': (0, 0, 1)}),
        # A pan-tilt unit: it pans around an axis of the frame, and tilts around one of its own.
        (
            (0.0, tracked(0.3, 1), tracked(0.4, 2)),
            {'z': (0, 0, 1), 'v': (-plain_math.sin(0.4), plain_math.cos(0.4), 0)},
        ),
        ((0.0, tracked(0.0, 1), tracked(0.0, 2)), {'y': (0, 1, 0), 'z': (0, 0, 1)}),
    ],
)
def test_tracked_orientation_gives_rings_for_the_ways_it_can_turn(angles, rings):
    message = marker()
    message.pose.orientation = roll_pitch_yaw(*angles)
    interactive = drawn(message)
    found = {
        name[len('rotate_') :]: direction(interactive, control)
        for name, control in controls(interactive).items()
        if name.startswith('rotate_')
    }
    assert set(found) == set(rings)
    for name, expected in rings.items():
        assert found[name] == pytest.approx(expected, abs=1e-6)


class View(Follower):
    """A view that notes what is drawn anew, and in which way it can be turned then."""

    def __init__(self, scene):
        super().__init__(scene, SimpleNamespace(version=0, can_change=is_free, look_up=lambda _sources: None))
        self.drawn = []

    def draw(self, _handle, motions):
        self.drawn.append([ring.name for ring in motions.rings])

    def move(self, _handle):
        pass

    def after(self, orientation):
        """All that is drawn anew for a message that turns a thing."""
        message = marker()
        message.pose.orientation = orientation
        message._connection_header = {}
        self._scene.take('/topic', message, True)
        self.drawn = []
        self.follow()
        return self.drawn


def pan_tilt(pan, tilt):
    return roll_pitch_yaw(0.0, tracked(tilt, 1), tracked(pan, 2))


def test_a_number_that_gives_a_formula_its_shape_has_no_ring():
    """The node makes a quaternion of an angle that it has summed up."""
    yaw, two = 0.8, tracked(2.0)
    orientation = (0.0, 0.0, math.sin(yaw / two), math.cos(yaw / two))
    assert rings_of(orientation, lambda _: node.SHAPE_RANK) == ()
    assert len(rings_of(orientation, lambda _: node.SHAPE_RANK - 1)) == len(rings_of(orientation)) == 1


def test_rings_turn_with_their_thing_without_being_drawn_anew():
    """RViz lets go of what is drawn anew."""
    view = View(Scene(Settings()))
    assert view.after(pan_tilt(0.2, 0.0)) == [['z', 'v']]
    for pan, tilt in ((0.3, 0.0), (0.3, 0.5), (1.5, -0.4)):
        assert view.after(pan_tilt(pan, tilt)) == []


def on_a_slant(pan, tilt):
    """A thing that is mounted aslant on a pan-tilt unit."""
    parts = pan_tilt(pan, tilt), roll_pitch_yaw(0.0, 0.0, 0.6)
    return Quaternion(*product(*[(one.x, one.y, one.z, one.w) for one in parts]))


def test_a_ring_around_no_axis_of_the_frame_or_the_thing_is_drawn_anew_as_it_turns():
    view = View(Scene(Settings()))
    assert view.after(on_a_slant(0.1, 0.2)) == [['z', 'source_0']]
    assert view.after(on_a_slant(0.1, 0.5)) == []
    assert view.after(on_a_slant(0.3, 0.5)) == [['z', 'source_0']]
    handle = view._scene.handle('/topic:thing:0')
    around = handle.motions(is_free).rings[1].direction
    assert around == pytest.approx((-plain_math.sin(0.3), plain_math.cos(0.3), 0.0), abs=1e-3)


def test_a_turned_ring_asks_for_the_quaternion_that_is_nearer():
    message = marker()
    message.pose.orientation = Quaternion(0.0, 0.0, tracked(0.0, 1), tracked(-2.0, 2))
    (handle,) = handles(message).values()
    _, targets = handle.wanted((0, 0, 0, *TURNED), moved=False, turned=True)
    assert targets == pytest.approx([-2.0 * TURNED[2], -2.0 * TURNED[3]]), 'its length is kept'


def test_a_drag_asks_only_for_what_is_tracked_and_was_changed():
    message = marker()
    message.pose.position.y, message.pose.orientation.w = tracked(2.0, 1), tracked(1.0, 2)
    (handle,) = handles(message).values()
    pose = (5.0, 6.0, 7.0, 0.0, 0.0, 0.0, 1.0)
    assert handle.wanted(pose, moved=True, turned=False) == ([2.0], [6.0])
    assert handle.wanted(pose, moved=False, turned=True) == ([1.0], [1.0])


@pytest.mark.parametrize('kind', POINT_KINDS)
def test_each_tracked_point_has_a_handle_of_its_own(kind):
    message = marker(kind, size=1.0)
    message.points = [Point(0.0, 0.0, 0.0), Point(tracked(1.0), tracked(2.0), 0.0), Point(3.0, 0.0, 0.0)]
    found = handles(message)
    assert set(found) == {'/topic:thing:0:points[1]'}
    (body,) = draw(found['/topic:thing:0:points[1]']).controls
    assert body.interaction_mode == Control.MOVE_PLANE


def test_the_balls_on_the_ends_of_a_short_arrow_do_not_overlap():
    message = marker(Marker.ARROW, size=0.2)
    message.points = [Point(tracked(0.0), 0.0, 0.0), Point(tracked(0.1), 0.0, 0.0)]
    found = handles(message)
    assert [handle.size for handle in found.values()] == pytest.approx([0.1, 0.1])
    message.points[1].x = tracked(1.0)
    assert [handle.size for handle in handles(message).values()] == pytest.approx([0.24, 0.24])


def test_a_point_moves_in_the_coordinates_of_its_rotated_marker():
    message = marker(Marker.LINE_STRIP, size=0.1)
    message.pose.position.x, message.pose.orientation = 1.0, Quaternion(*TURNED)
    message.points = [Point(tracked(2.0), 0.0, 0.0)]
    (handle,) = handles(message).values()
    assert handle.pose[:3] == pytest.approx((1 + 2 * plain_math.cos(TURN), 2 * plain_math.sin(TURN), 0.0))
    interactive = draw(handle)
    along = direction(interactive, controls(interactive)['body'])
    assert along == pytest.approx((plain_math.cos(TURN), plain_math.sin(TURN), 0.0))
    there = (*(a + 0.5 * b for a, b in zip(handle.pose, along)), *handle.pose[3:])
    values_, targets = handle.wanted(there, moved=True, turned=False)
    assert values_ == [2.0]
    assert targets == pytest.approx([2.5])


@pytest.mark.parametrize('angle', [-2.5, -0.6, 0.6, 2.0, 3.0, 4.0])
@pytest.mark.parametrize('w', [1.0, 0.5, -1.0])
def test_a_quaternion_of_which_some_parts_are_plain_turns_to_the_angle_of_the_hand(w, angle):
    message = marker()
    message.pose.orientation.z, message.pose.orientation.w = tracked(0.2), w
    (handle,) = handles(message).values()
    goal = (0.0, 0.0, plain_math.sin(angle / 2), plain_math.cos(angle / 2))
    (value,), (z,) = handle.wanted((0.0, 0.0, 0.0, *goal), moved=False, turned=True)
    assert value == 0.2
    assert are_same_rotation(normalized(0.0, 0.0, z, w), goal, 1e-12)


def test_a_turn_that_plain_parts_rule_out_keeps_the_length_of_the_quaternion():
    """With a plain w of 1, half a turn is out of reach."""
    message = marker()
    message.pose.orientation.z = tracked(0.0)
    (handle,) = handles(message).values()
    _, targets = handle.wanted((0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0), moved=False, turned=True)
    assert targets == [1.0]


def test_a_small_plain_tilt_does_not_change_the_length_of_the_quaternion():
    message = marker()
    message.pose.orientation = Quaternion(1e-4, 0.0, tracked(0.0, 1), tracked(1.0, 2))
    (handle,) = handles(message).values()
    goal = (0.0, 0.0, plain_math.sin(1.5), plain_math.cos(1.5))
    _, targets = handle.wanted((0.0, 0.0, 0.0, *goal), moved=False, turned=True)
    assert targets == pytest.approx(goal[2:])


@pytest.mark.parametrize(
    ('kind', 'names'),
    [
        (Marker.CUBE, 'xyz'),
        (Marker.SPHERE, 'xyz'),
        (Marker.CYLINDER, 'xyz'),
        (Marker.ARROW, 'xyz'),
        (Marker.MESH_RESOURCE, 'xyz'),
        (Marker.CUBE_LIST, 'xyz'),
        (Marker.SPHERE_LIST, 'xyz'),
        (Marker.TRIANGLE_LIST, 'xyz'),
        (Marker.POINTS, 'xy'),
        (Marker.LINE_STRIP, 'x'),
        (Marker.LINE_LIST, 'x'),
        (Marker.TEXT_VIEW_FACING, 'z'),
    ],
)
def test_tracked_sizes_have_handles_where_rviz_heeds_them(kind, names):
    message = marker(kind)
    message.scale.x, message.scale.y, message.scale.z = (tracked(0.5, number) for number in range(3))
    found = handles(message)
    assert set(found) == {'/topic:thing:0:scale.' + name for name in names}
    for handle in found.values():
        (body,) = draw(handle).controls
        assert body.interaction_mode == Control.MOVE_AXIS


def test_a_size_grows_on_both_sides_and_stays_above_zero():
    message = marker()
    message.pose.orientation = Quaternion(*TURNED)
    message.scale.x = tracked(2.0)
    (handle,) = handles(message).values()
    outwards = (plain_math.cos(TURN), plain_math.sin(TURN), 0.0)
    assert handle.pose[:3] == pytest.approx(outwards)
    there = (*(1.5 * part for part in outwards), *handle.pose[3:])
    assert handle.wanted(there, moved=True, turned=False)[1] == pytest.approx([3.0])
    beyond = (*(-part for part in outwards), *handle.pose[3:])
    assert handle.wanted(beyond, moved=True, turned=False)[1][0] > 0.0


@pytest.mark.parametrize('seed', range(20))
def test_a_handle_comes_to_the_hand_if_its_thing_moves_with_it(seed):
    random = numpy.random.RandomState(seed)
    height, aside = tracked(random.uniform(1.0, 3.0)), tracked(random.uniform(-1.0, 1.0), 2)
    slope, turn = random.uniform(-0.3, 1.0), random.uniform(-3.0, 3.0)

    def shown(height, aside):
        message = marker(Marker.SPHERE_LIST if seed % 2 else Marker.CUBE)
        message.pose.orientation.z, message.pose.orientation.w = math.sin(turn / 2), math.cos(turn / 2)
        message.pose.position.x = slope * height * plain_math.cos(turn) + aside
        message.pose.position.y = slope * height * plain_math.sin(turn)
        if seed % 2:
            message.points = [Point(height, 0.0, 0.0)]
            return handles(message)['/topic:thing:0:points[0]']
        message.scale.x = height
        return handles(message)['/topic:thing:0:scale.x']

    handle = shown(height, aside)
    out = random.uniform(0.1, 0.8)
    there = (handle.pose[0] + out * plain_math.cos(turn), handle.pose[1] + out * plain_math.sin(turn), *handle.pose[2:])
    wanted, targets = handle.wanted(there, moved=True, turned=False)
    assert values.sources(wanted) == values.sources([height]), 'nothing else that moves the thing'
    changed = values.solve(wanted, targets)
    moved = shown(
        *(tracked(value, number) for number, value in enumerate(values.evaluate([height, aside], changed), 1))
    )
    assert moved.pose[:3] == pytest.approx(there[:3])
    again, stays = moved.wanted(there, moved=True, turned=False)
    assert list(map(float, again)) == pytest.approx(stays), 'the check after a drop has it there'


@pytest.mark.parametrize('kind', [Marker.LINE_STRIP, Marker.LINE_LIST, Marker.ARROW])
def test_the_size_of_what_has_two_ends_is_dragged_between_them(kind):
    message = marker(kind, size=0.1)
    message.points = [Point(tracked(2.0), 0.0, 0.0), Point(tracked(2.0, 2), 3.0, 0.0)]
    message.scale.x = tracked(0.1, 3)
    found = handles(message)
    scale = found.pop('/topic:thing:0:scale.x')
    assert scale.pose[:3] == pytest.approx((2.05, 1.5, 0.0))
    there = (2.2, *scale.pose[1:])
    assert scale.wanted(there, moved=True, turned=False)[1] == pytest.approx([0.4])
    assert scale.size <= min(point.size for point in found.values())


def test_controls_stand_outside_large_things_and_have_one_size_on_all_others():
    def size(side):
        message = marker(size=side)
        message.pose.position.x = tracked(1.0)
        return drawn(message).scale

    assert size(4.0) == pytest.approx(10 * size(0.4))
    assert size(0.1) == size(0.02) == LEAST_SIZE


@pytest.mark.parametrize('kind', sorted(KINDS))
@pytest.mark.parametrize('scale', [0.0, -1.0])
def test_every_handle_has_a_size_above_0_whatever_the_scale_of_its_marker_is(kind, scale):
    message = marker(kind, size=scale)
    message.pose.position.x = tracked(1.0)
    message.points = [Point(tracked(1.0), 0.0, 0.0), Point(tracked(1.0), 0.0, 0.0)]
    found = handles(message)
    assert found
    assert all(handle.size > 0.0 for handle in found.values())


@pytest.mark.parametrize('given', [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 3.0, 4.0), (0.0, 0.0, 0.0, 1.0)])
def test_quaternions_are_of_length_one(given):
    message = marker()
    message.pose.position.x, message.pose.orientation = tracked(1.0), Quaternion(*given)
    found = quaternion(drawn(message).pose.orientation)
    assert sum(part * part for part in found) == pytest.approx(1.0)
    assert not any(given) or are_same_rotation(found, normalized(*given))


def test_names_are_unique_over_topic_namespace_and_id():
    names = set()
    places = [
        ('/a', 'b', 1),
        ('/a', 'b:1', 1),
        ('/a/b', '', 1),
        ('/a', '', 1),
        ('/a', 'b', 11),
        ('/a', ':b', 1),
        ('/a', 'b:1:points[0]', 1),
    ]
    for topic, name, number in places:
        message = marker(Marker.LINE_STRIP, name, number)
        message.pose.position.x, message.points = tracked(1.0), [Point(tracked(1.0), 0.0, 0.0)]
        names.update(handles(message, topic))
    assert len(names) == 2 * len(places)


def test_the_same_thing_in_the_next_message_looks_alike_wherever_it_is():
    def handle(x, color=0.5):
        message = marker()
        message.pose.position.x, message.color.g = tracked(x), color
        (found,) = handles(message).values()
        return found

    assert handle(1.0).draw_key == handle(2.0).draw_key
    assert handle(1.0).pose != handle(2.0).pose
    assert handle(1.0).draw_key != handle(1.0, color=0.6).draw_key


def test_a_body_that_turns_about_z_is_not_drawn_anew():
    def handle(orientation, axes='xyz'):
        message = marker()
        message.pose.orientation = Quaternion(*orientation)
        for axis in axes:
            setattr(message.pose.position, axis, tracked(1.0))
        (found,) = handles(message).values()
        return found

    tilted = (plain_math.sin(0.3), 0.0, 0.0, plain_math.cos(0.3))
    assert handle(TURNED).draw_key == handle((0.0, 0.0, 0.0, 1.0)).draw_key
    assert handle(tilted).draw_key != handle(TURNED).draw_key
    assert handle(TURNED, 'x').draw_key != handle((0.0, 0.0, 0.0, 1.0), 'x').draw_key


def test_what_takes_no_changes_has_no_control():
    message = marker()
    message.pose.position.x, message.pose.position.y = tracked(1.0, 1), tracked(2.0, 2)
    (handle,) = handles(message).values()
    found = controls(draw(handle, lambda value: value == 2.0))
    assert set(found) == {'move_y', 'body'}
    assert found['body'].interaction_mode == Control.MOVE_AXIS


def in_32_bits(numbers):
    return tuple(map(float, numpy.float32(numbers)))


def test_what_rviz_rounds_is_told_from_what_a_hand_moves():
    start, end = (0.1, 1000.1, -0.3), (0.1, 1000.1, 0.7)
    assert without_noise(start, in_32_bits(end), 1e-6) == pytest.approx(end)
    assert without_noise(start, in_32_bits(end), 1e-6)[:2] == start[:2]


@pytest.mark.parametrize('is_in_frame', [True, False])
def test_a_turn_around_one_axis_stays_around_it(is_in_frame):
    start = normalized(0.1, 0.2, 0.3, 0.9)
    turn = (0.0, plain_math.sin(0.35), 0.0, plain_math.cos(0.35))
    end = product(turn, start) if is_in_frame else product(start, turn)
    found = turn_without_noise(start, in_32_bits(end), 1e-6)
    back = product(found, inverse(start)) if is_in_frame else product(inverse(start), found)
    assert back[0] == pytest.approx(0.0, abs=1e-15)
    assert back[2] == pytest.approx(0.0, abs=1e-15)
    assert back[1] == pytest.approx(turn[1], abs=1e-6)
