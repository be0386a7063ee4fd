"""What a person chooses for the drags of a thing, and what its drags change then."""

import itertools

import pytest
from geometry_msgs.msg import Point, Quaternion
from rosslt.msg import Location
from visualization_msgs.msg import Marker

from rosslt import math, node, values
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.offers import Offers
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from support.processes import wait_until
from support.scenery import take

X, SHIFT, Y, Z, ROLL, PITCH, YAW, W = [values.Source('/cart', number) for number in range(8)]
POST, NEXT_POST, OFFSET = ([values.Source('/guard', 10 * row + axis) for axis in range(2)] for row in range(3))
NAME = '/posts::0'


def at(x, y):
    return (x, y, 0.0, 0.0, 0.0, 0.0, 1.0)


def name_of(source):
    rows = {'post': POST, 'next': NEXT_POST, 'offset': OFFSET}
    return next(f'{row} {"xy"[sources.index(source)]}' for row, sources in rows.items() if source in sources)


class Patrol:
    """A thing at (1, 2) that is at a post, shifted by what all posts share; and hands on it.

    Attributes:
        said: the texts at the thing.
    """

    def __init__(self):
        self.scene, self.said = Scene(Settings()), []
        self.drags = Drags(self.scene, Rules(is_live=False), name_of)
        self.offers = Offers(self.scene, self.drags, Descriptions())
        self.go_to(POST)

    def go_to(self, post):
        marker = Marker(type=Marker.CUBE)
        marker.header.frame_id = 'world'
        marker.pose.position.x = values.track(1.0, post[0]) + values.track(0.0, OFFSET[0])
        marker.pose.position.y = values.track(2.0, post[1]) + values.track(0.0, OFFSET[1])
        take(self.scene, '/posts', marker, '/guard')

    def choose(self, *sources):
        for source in sources:
            self.offers.choose(self.scene.handle(NAME), source)

    @property
    def chosen(self):
        handle = self.scene.handle(NAME)
        return [choice.source for choice in self.offers.choices(handle) if self.offers.is_chosen(handle, choice)]

    def drag(self, x, y):
        """Drag the thing; what is said once the hand has let go."""
        assert self.drags.hold(NAME, frame='world', pose=at(1.0, 2.0))
        assert self.drags.release(NAME, 'world', at(x, y))
        wait_until(self._hear, 'the hand to be told')
        return self.said[-1]

    def _hear(self):
        heard = [text for _, text in self.scene.news().said]
        self.said += heard
        return heard


@pytest.fixture
def patrol():
    return Patrol()


def test_a_choice_moves_a_thing_only_as_far_as_it_reaches(asked, patrol):
    patrol.choose(OFFSET[0])
    assert patrol.drag(1.5, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == [{OFFSET[0]: 0.5}]


def test_a_choice_that_reaches_nothing_that_was_moved_says_so(asked, patrol):
    patrol.choose(OFFSET[0])
    assert patrol.drag(1.0, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == []


def test_a_pair_is_chosen_one_after_the_other(asked, patrol):
    patrol.choose(*OFFSET)
    assert patrol.chosen == OFFSET
    patrol.drags.hold(NAME, frame='world', pose=at(1.0, 2.0))
    patrol.drags.release(NAME, 'world', at(1.5, 3.0))
    wait_until(lambda: asked == [{OFFSET[0]: 0.5, OFFSET[1]: 1.0}], 'both to change')


def test_choices_are_taken_back_one_by_one_or_together(patrol):
    patrol.choose(*OFFSET, OFFSET[0])
    assert patrol.chosen == [OFFSET[1]]
    patrol.choose(OFFSET[0], POST[1])
    assert set(patrol.chosen) == {OFFSET[0], POST[1]}, 'one that does the same takes the place of another'
    patrol.choose(None)
    assert patrol.chosen == [None]


def test_a_choice_is_of_things_that_come_from_it(asked, patrol):
    patrol.choose(POST[0], OFFSET[1])
    patrol.go_to(NEXT_POST)
    assert patrol.chosen == [None]
    assert patrol.drag(1.5, 2.0) == 'it does not come from post x, offset y now: a drag changes next x'
    assert asked == [{NEXT_POST[0]: 1.5}]
    patrol.go_to(POST)
    assert set(patrol.chosen) == {POST[0], OFFSET[1]}


def test_what_the_next_target_comes_from_too_stays_chosen(asked, patrol):
    patrol.choose(OFFSET[0])
    patrol.go_to(NEXT_POST)
    assert patrol.chosen == [OFFSET[0]]
    assert patrol.drag(1.5, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == [{OFFSET[0]: 0.5}]


def test_the_rows_of_a_thing_are_those_of_what_a_drag_changes(patrol):
    def rows():
        return patrol.offers.rows(patrol.offers.choices(patrol.scene.handle(NAME)))

    def know(*told_rows):
        numbers = [one.location_id for one in (*POST, *OFFSET)]
        told = itertools.zip_longest(numbers, told_rows, fillvalue='')
        node.directory().take('/guard', [Location(id=number, row=row) for number, row in told])

    try:
        assert rows() == [], 'nothing is known'
        know('guard.py:3:1[1]', 'guard.py:3:1[1]')
        assert [source for _, source in rows()] == [POST[0]]
        know('', '', 'guard.py:9:1[0]', 'guard.py:9:1[0]')
        assert [source for _, source in rows()] == [OFFSET[0]]
        know('guard.py:3:1[1]')
        assert [source for _, source in rows()] == [POST[0]], 'the other number is in no row'
        know('guard.py:3:1[1]', 'guard.py:3:1[2]')
        assert [source for _, source in rows()] == POST, 'they are in two'
    finally:
        know()


def cart(orientation):
    """A box whose x comes from two numbers, so that there is something to choose."""
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'world'
    marker.pose.position.x = values.track(1.0, X) + values.track(0.0, SHIFT)
    marker.pose.position.y, marker.pose.position.z = values.track(2.0, Y), values.track(0.5, Z)
    marker.pose.orientation = orientation
    return marker


def turned(tilt=0.0):
    """The quaternion of a roll, a pitch and a yaw."""
    roll, pitch, yaw = values.track(0.0, ROLL), values.track(tilt, PITCH), values.track(0.3, YAW)
    (sr, sp, sy), (cr, cp, cy) = ([way(one / 2) for one in (roll, pitch, yaw)] for way in (math.sin, math.cos))
    x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    return Quaternion(x, y, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)


def offered(marker, is_planar, part=''):
    """The sources that the menu offers for the drags of a thing, the default first."""
    scene = Scene(Settings(is_planar=is_planar))
    offers = Offers(scene, Drags(scene, Rules(), str), Descriptions())
    take(scene, '/carts', marker, '/cart')
    return [choice.source or choice.changed for choice in offers.choices(scene.handle('/carts::0' + part))]


def test_in_2d_the_menu_offers_what_moves_x_and_y_and_turns_around_z():
    assert offered(cart(turned()), is_planar=True) == [[X, Y, YAW], X, SHIFT, Y, YAW]
    assert offered(cart(turned()), is_planar=False) == [[X, Y, Z, ROLL, PITCH, YAW], X, SHIFT, Y, Z, ROLL, PITCH, YAW]


def test_the_menu_offers_no_number_of_a_quaternion_that_cannot_turn():
    alone = cart(Quaternion(0.0, 0.0, 0.0, values.track(1.0, W)))
    assert offered(alone, is_planar=True) == [[X, Y], X, SHIFT, Y]
    assert offered(alone, is_planar=False) == [[X, Y, Z], X, SHIFT, Y, Z]
    four = [values.track(float(source is W), source) for source in (ROLL, PITCH, YAW, W)]
    assert offered(cart(Quaternion(*four)), is_planar=True) == [[X, Y, YAW, W], X, SHIFT, Y, YAW, W]


def test_in_2d_the_menu_of_a_tilted_thing_offers_its_yaw():
    assert YAW in offered(cart(turned(tilt=0.4)), is_planar=True)


def test_in_2d_the_menu_of_a_point_offers_no_height():
    x = values.track(1.0, X) + values.track(0.0, SHIFT)
    marker = Marker(type=Marker.SPHERE_LIST, points=[Point(x, values.track(2.0, Y), values.track(0.5, Z))])
    marker.header.frame_id, marker.pose.orientation.w = 'world', 1.0
    assert offered(marker, True, ':points[0]') == [[X, Y], X, SHIFT, Y]
    assert Z in offered(marker, False, ':points[0]')


def test_in_2d_the_menu_of_what_has_a_height_alone_offers_nothing():
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'world'
    marker.pose.position.z = values.track(0.5, Z)
    assert offered(marker, is_planar=True) == []
    assert offered(marker, is_planar=False) == [[Z]]
