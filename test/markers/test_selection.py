"""Which handles RViz is shown: all of the thing that was clicked, and of others what they can be grabbed by."""

import threading

import pytest
from geometry_msgs.msg import Point, Quaternion
from visualization_msgs.msg import InteractiveMarkerControl, InteractiveMarkerFeedback, Marker

from rosslt import math, values
from rosslt.markers.drags.scene_drags import Drags
from rosslt.markers.offers import Offers
from rosslt.markers.rviz.display import Display
from rosslt.markers.rviz.notes import Notes
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.selection import FEW, Selection

HANDLE_SIZE = 0.5


class Drawn:
    """A server that keeps what RViz would show.

    Attributes:
        markers: {name: interactive marker}.
        inserted: the names of those that were inserted.
        menus: {name: the function that is told what was chosen in its menu}.
    """

    mutex = threading.RLock()

    def __init__(self):
        self.markers, self.inserted, self.menus = {}, [], {}

    def insert(self, marker, function, event=None):
        self.markers[marker.name] = marker
        if event == InteractiveMarkerFeedback.MENU_SELECT:
            self.menus[marker.name] = function
        else:
            self.inserted.append(marker.name)

    def get(self, name):
        return self.markers[name]

    def erase(self, name):
        del self.markers[name]

    def setPose(self, _name, _pose):  # noqa: N802
        pass

    def applyChanges(self):  # noqa: N802
        pass


class Known:
    """All sources, as taking changes but for those of /fixed; those of an odd number were named by nobody."""

    version = 0

    def can_change(self, value):
        return any(source.node != '/fixed' for source in values.sources(value))

    def fixed(self, _sources):
        return ()

    def name(self, _source):
        return 'a name'

    def one(self, _source):
        return 'a source'

    def look_up(self, _sources):
        pass

    def rank(self, source):
        return source.location_id % 2

    def held(self, _thing, _shared):
        return []

    def own_first(self, sources):
        return list(sources)

    def rows(self, _sources):
        return []


class Hands(Drags):
    """Hands that change no source: a thing that is let go is where it was."""

    def __init__(self, scene):
        self._scene, self.chosen, self.in_place = scene, {}, set()

    def hold(self, name, *_):
        self._scene.hold(name)
        return True

    def release(self, name, *_):
        self._scene.let_go(name)
        return True


class Joined:
    """Frames of which all are joined."""

    def has(self, _frame):
        return True

    def update(self):
        return False


class View:
    """A scene in RViz.

    Attributes:
        server: what RViz shows.
    """

    def __init__(self, shows_all=False):
        self.server, scene = Drawn(), Scene(Settings())
        self.selection = Selection(shows_all)
        self._scene, self.hands = scene, Hands(scene)
        self._offers = Offers(scene, self.hands, Known())
        self.display = Display(self.server, self._offers, Notes(0.2), self.selection, HANDLE_SIZE, Joined())

    def take(self, *markers, is_shown=True):
        for marker in markers:
            marker._connection_header = {}
            self._scene.take('/topic', marker, is_shown)
        self.display.apply()

    def report(self, name, event):
        feedback = InteractiveMarkerFeedback(marker_name='/topic:' + name, event_type=event, client_id='rviz')
        self.display._feedback(feedback)
        self.display.apply()

    def click(self, name):
        self.report(name, InteractiveMarkerFeedback.MOUSE_DOWN)
        self.report(name, InteractiveMarkerFeedback.MOUSE_UP)

    def choose(self, name, title):
        """Choose the entry of a menu whose title has this; returns the titles of all entries then."""
        drawn = self.server.markers['/topic:' + name]
        (entry,) = [entry for entry in drawn.menu_entries if title in entry.title]
        self.server.menus[drawn.name](InteractiveMarkerFeedback(marker_name=drawn.name, menu_entry_id=entry.id))
        self.display.apply()
        return [entry.title for entry in self.server.markers[drawn.name].menu_entries]

    def controls(self, name):
        return {control.name: control for control in self.server.markers['/topic:' + name].controls}

    def names(self):
        return {name[len('/topic:') :] for name in self.server.markers}

    def with_arrows(self):
        """The names of the markers that are drawn with more than their bodies."""
        return {name for name in self.names() if set(self.controls(name)) != {'body'}}


def tracked(value, number=2):
    return values.track(float(value), values.Source('/owner', number))


def fixed(value):
    return values.track(float(value), values.Source('/fixed', 2))


def marker(name, kind=Marker.CUBE, size=0.2):
    result = Marker(ns=name, type=kind)
    result.header.frame_id = 'world'
    result.pose.orientation.w = 1.0
    result.scale.x = result.scale.y = result.scale.z = size
    return result


def cubes(count):
    """Cubes that move in x and y, and turn."""
    made = []
    for index in range(count):
        cube = marker(f'cube{index}')
        cube.pose.position.x, cube.pose.position.y = tracked(index, 10 * index), tracked(0, 10 * index + 2)
        angle = tracked(0.3, 10 * index + 4)
        cube.pose.orientation.z, cube.pose.orientation.w = math.sin(angle / 2), math.cos(angle / 2)
        made.append(cube)
    return made


@pytest.fixture
def crowd():
    view = View()
    view.take(*cubes(FEW + 1))
    return view


def test_few_things_have_all_their_handles():
    view = View()
    view.take(*cubes(FEW))
    assert view.with_arrows() == view.names()


def test_many_things_have_bodies_alone_which_can_be_grabbed(crowd):
    assert len(crowd.names()) == FEW + 1
    assert not crowd.with_arrows()
    assert crowd.controls('cube0:0')['body'].interaction_mode == InteractiveMarkerControl.MOVE_PLANE
    assert sorted(crowd.server.inserted) == sorted(crowd.server.markers), 'each was drawn once'


def test_the_thing_that_was_clicked_has_its_arrows_and_rings_alone(crowd):
    crowd.click('cube1:0')
    assert crowd.with_arrows() == {'cube1:0'}
    assert set(crowd.controls('cube1:0')) == {'move_x', 'move_y', 'rotate_z', 'body'}
    crowd.click('cube3:0')
    assert crowd.with_arrows() == {'cube3:0'}


def test_what_a_hand_holds_is_drawn_anew_after_it_is_released(crowd):
    crowd.click('cube1:0')
    crowd.report('cube2:0', InteractiveMarkerFeedback.MOUSE_DOWN)
    assert crowd.with_arrows() == set(), 'the one before has lost them, and the one that is held is left alone'
    assert crowd.server.inserted.count('/topic:cube2:0') == 1
    crowd.report('cube2:0', InteractiveMarkerFeedback.MOUSE_UP)
    assert crowd.with_arrows() == {'cube2:0'}


def test_a_body_that_can_only_be_turned_is_clicked_without_opening_its_menu():
    view = View()
    turning = marker('turning')
    turning.pose.orientation.z = tracked(0.3)
    view.take(turning, *cubes(FEW))
    assert view.controls('turning:0')['body'].interaction_mode == InteractiveMarkerControl.BUTTON
    view.click('turning:0')
    assert set(view.controls('turning:0')) == {'rotate_z', 'body'}
    assert view.controls('turning:0')['body'].interaction_mode == InteractiveMarkerControl.MENU


def test_things_that_come_and_go_are_counted(crowd):
    gone = marker('cube0')
    gone.action = Marker.DELETE
    crowd.take(gone)
    assert crowd.with_arrows() == crowd.names() == {'cube1:0', 'cube2:0', 'cube3:0'}
    crowd.take(*cubes(1))
    assert not crowd.with_arrows()


def test_sizes_are_drawn_if_the_thing_was_clicked_or_has_nothing_else():
    scaled, only_scaled = marker('scaled'), marker('only_scaled')
    scaled.pose.position.x, scaled.scale.x, only_scaled.scale.x = tracked(1.0), tracked(0.2), tracked(0.2)
    view = View()
    view.take(scaled, only_scaled, *cubes(FEW))
    assert {name for name in view.names() if 'cube' not in name} == {'scaled:0', 'only_scaled:0:scale.x'}
    view.click('scaled:0')
    assert 'scaled:0:scale.x' in view.names()
    view.click('cube0:0')
    assert 'scaled:0:scale.x' not in view.names()


def test_sizes_of_a_thing_that_nothing_else_moves_are_drawn_after_a_click_on_its_body():
    """The points of a line may give way to markers that stand on them."""
    line = marker('line', Marker.LINE_STRIP, size=0.1)
    line.pose.position.x, line.scale.x = fixed(1.0), tracked(0.1)
    view = View()
    view.take(line, *cubes(FEW))
    assert {name for name in view.names() if 'line' in name} == {'line:0'}
    view.click('line:0')
    assert {name for name in view.names() if 'line' in name} == {'line:0', 'line:0:scale.x'}


@pytest.mark.parametrize('count', [1, FEW])
@pytest.mark.parametrize('filling', [fixed(1.0), tracked(1.0)], ids=['fixed', 'filling'])
def test_a_body_that_no_change_moves_leaves_the_mouse_to_what_is_behind(count, filling):
    """Such a w only fills its field, as in the pose that a simulator sums up."""
    box = marker('box')
    box.pose.position.x, box.scale.x = fixed(1.0), fixed(0.2)
    box.pose.orientation.w = filling
    view = View()
    view.take(box, *cubes(count))
    assert 'box:0' not in view.names()
    view.take(box, is_shown=False)
    assert view.controls('box:0')['body'].interaction_mode == InteractiveMarkerControl.NONE, 'drawn, but not grabbed'
    assert not view.server.markers['/topic:box:0'].menu_entries
    box.pose.position.y = tracked(0.0)
    view.take(box)
    assert view.controls('box:0')['body'].interaction_mode == InteractiveMarkerControl.MOVE_AXIS
    assert view.server.markers['/topic:box:0'].menu_entries


def robot(x):
    """A robot where its node says, with a height and a size that take changes."""
    result = marker('robot')
    result.pose.position.x, result.pose.position.z = x, tracked(0.1, 100)
    result.scale.x = tracked(0.2, 102)
    return result


@pytest.mark.parametrize('count', [1, FEW])
@pytest.mark.parametrize('place', [float, fixed], ids=['plain', 'fixed'])
def test_what_its_node_moves_leaves_the_mouse_to_the_goal_it_has_come_to(count, place):
    """Its height and its sizes can be changed, but what people press on it for is what lies under it."""
    view = View()
    view.take(robot(place(1.0)), *cubes(count))
    assert 'robot:0' in view.names(), 'a thing that stands where it stood, as a lamp'
    view.take(robot(place(1.5)))
    assert not [name for name in view.names() if 'robot' in name]
    view.take(robot(place(1.5)))
    assert not [name for name in view.names() if 'robot' in name], 'also after it has arrived'


def test_what_its_node_moves_is_drawn_but_not_grabbed_where_rviz_does_not_show_it():
    view = View()
    for x in (1.0, 1.5):
        view.take(robot(x), is_shown=False)
    assert set(view.controls('robot:0')) == {'body'}
    assert view.controls('robot:0')['body'].interaction_mode == InteractiveMarkerControl.NONE
    assert view.names() == {'robot:0'}


def test_what_its_node_moves_has_its_handles_if_all_are_shown():
    view = View(shows_all=True)
    for x in (1.0, 1.5):
        view.take(robot(x), *cubes(FEW))
    assert {'robot:0', 'robot:0:scale.x'} <= view.names()
    assert set(view.controls('robot:0')) == {'body', 'move_z'}
    view.selection.shows_all = False
    view.display.apply()
    assert not [name for name in view.names() if 'robot' in name]


def test_what_its_node_moves_keeps_a_way_sideways_and_a_ring():
    view = View()
    sensor, drawer = marker('sensor'), marker('drawer')
    for x in (1.0, 1.5):
        sensor.pose.position.x = drawer.pose.position.x = x
        sensor.pose.orientation.z, drawer.pose.position.y = tracked(0.3, 102), tracked(0.2, 104)
        view.take(sensor, drawer, *cubes(FEW))
    assert view.controls('sensor:0')['body'].interaction_mode == InteractiveMarkerControl.BUTTON
    assert view.controls('drawer:0')['body'].interaction_mode == InteractiveMarkerControl.MOVE_AXIS


def test_what_was_dragged_sideways_keeps_its_handles_as_long_as_it_can_be():
    """A new thing of its name has not moved yet."""
    view = View()
    for x in (1.0, 1.5):
        view.take(robot(tracked(x, 104)), *cubes(FEW))
    assert 'robot:0' in view.names()
    view.take(robot(1.5))
    assert 'robot:0' not in view.names()
    gone = marker('robot')
    gone.action = Marker.DELETE
    view.take(gone)
    view.take(robot(1.5))
    assert 'robot:0' in view.names()


def test_a_body_is_a_button_as_long_as_something_of_its_thing_can_move():
    box = marker('box')
    box.pose.position.x, box.scale.x = fixed(1.0), fixed(0.2)
    view = View()
    view.take(box, *cubes(FEW))
    assert 'box:0' not in view.names()
    box.scale.y = tracked(0.2)
    view.take(box)
    assert view.controls('box:0')['body'].interaction_mode == InteractiveMarkerControl.BUTTON
    box.scale.y = 0.2
    view.take(box)
    assert 'box:0' not in view.names()


def test_a_body_without_tracked_numbers_is_clicked_for_the_sizes():
    """RViz does not draw it, so the body is drawn here."""
    box = marker('box')
    box.scale.x = tracked(0.2)
    view = View()
    view.take(box, is_shown=False)
    view.take(*cubes(FEW))
    assert {name for name in view.names() if 'box' in name} == {'box:0'}
    assert view.controls('box:0')['body'].interaction_mode == InteractiveMarkerControl.BUTTON
    view.click('box:0')
    assert {name for name in view.names() if 'box' in name} == {'box:0', 'box:0:scale.x'}


def strip(name, position=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0)):
    """A line through two tracked points, with a tracked pose."""
    result = marker(name, Marker.LINE_STRIP, size=0.1)
    result.points = [Point(tracked(3, 100), 1.0, 0.0), Point(tracked(4, 102), 1.0, 0.0)]
    result.pose.position = Point(*[tracked(part, 110 + 2 * index) for index, part in enumerate(position)])
    result.pose.orientation = Quaternion(*[tracked(part, 120 + 2 * index) for index, part in enumerate(orientation)])
    return result


def test_points_are_drawn_if_they_are_what_the_thing_can_be_grabbed_by():
    view = View()
    view.take(strip('line'), strip('moved', position=(1.0, 0.0, 0.0)), *cubes(FEW))
    assert {name for name in view.names() if 'points' in name} == {'line:0:points[0]', 'line:0:points[1]'}
    assert view.controls('line:0')['body'].interaction_mode == InteractiveMarkerControl.BUTTON
    view.click('moved:0')
    assert {'moved:0', 'moved:0:points[0]', 'moved:0:points[1]', 'line:0:points[0]'} <= view.names()
    assert 'move_x' in view.controls('moved:0')


def test_a_point_that_is_clicked_selects_its_marker():
    view = View()
    line = strip('line')
    line.scale.x = tracked(0.1, 104)
    view.take(line, *cubes(FEW))
    assert 'line:0:scale.x' not in view.names()
    view.report('line:0:points[1]', InteractiveMarkerFeedback.MOUSE_DOWN)
    assert 'line:0:scale.x' in view.names(), 'at once, as it is no part that a hand holds'


@pytest.mark.parametrize(
    ('moved', 'expected'),
    [
        ({}, {'body'}),
        ({'position': (1.0, 0.0, 0.0)}, {'body', 'move_x', 'move_y', 'move_z'}),
        ({'orientation': (0.0, 0.0, 1.0, 0.0)}, {'body', 'rotate_x', 'rotate_y', 'rotate_z'}),
    ],
)
def test_a_pose_that_only_fills_its_fields_moves_no_line_that_has_tracked_points(moved, expected):
    view = View()
    view.take(strip('line', **moved))
    assert set(view.controls('line:0')) == expected


@pytest.mark.parametrize(
    ('kind', 'height', 'rings'),
    [
        (Marker.TEXT_VIEW_FACING, 0.2, set()),
        (Marker.SPHERE, 0.2, set()),
        (Marker.SPHERE, 0.3, {'rotate_x', 'rotate_y', 'rotate_z'}),
        (Marker.CUBE, 0.2, {'rotate_x', 'rotate_y', 'rotate_z'}),
    ],
)
def test_an_orientation_of_fillers_has_rings_if_a_turn_is_seen(kind, height, rings):
    view = View()
    thing = marker('thing', kind)
    thing.scale.z, thing.pose = height, strip('thing').pose
    view.take(thing)
    assert set(view.controls('thing:0')) == {'body', 'move_x', 'move_y', 'move_z', *rings}


def test_a_pose_that_is_computed_is_no_filler():
    view = View()
    line = strip('line')
    line.pose.position.x = tracked(1.0) - 1.0
    view.take(line)
    assert {'move_x', 'move_y', 'move_z'} < set(view.controls('line:0'))


def test_a_pose_that_is_all_that_can_be_moved_keeps_its_handles():
    view = View()
    line = strip('line')
    line.points = [Point(), Point(1.0, 0.0, 0.0)]
    view.take(line)
    assert set(view.controls('line:0')) == {'body', *[f'{way}_{axis}' for way in ('move', 'rotate') for axis in 'xyz']}


def pan_tilt(roll):
    """As `quaternion_from_euler(roll, tilt, pan)` computes it: pan and tilt have names, and are 0."""
    tilt, pan = tracked(0.0, 2), tracked(0.0, 4)
    (cr, sr), (cp, sp), (cy, sy) = [(math.cos(angle / 2), math.sin(angle / 2)) for angle in (roll, tilt, pan)]
    result = marker('camera')
    result.pose.orientation = Quaternion(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
    return result


@pytest.mark.parametrize(
    ('roll', 'rings'),
    [
        (tracked(0.0, 1), {'rotate_y', 'rotate_z'}),
        (tracked(0.1, 1), {'rotate_x', 'rotate_y', 'rotate_z'}),
        (tracked(0.0, 6), {'rotate_x', 'rotate_y', 'rotate_z'}),
    ],
)
def test_a_roll_of_0_that_nobody_named_gives_way_to_pan_and_tilt(roll, rings):
    view = View()
    view.take(pan_tilt(roll))
    assert set(view.controls('camera:0')) == {'body', *rings}


def test_the_menu_shows_all_handles_and_hides_them_again():
    view = View()
    line = strip('line')
    line.scale.x = tracked(0.1, 104)
    view.take(line, pan_tilt(tracked(0.0, 1)), *cubes(FEW))

    before = view.names()
    assert '[x] Show all handles' in view.choose('cube0:0', 'Show all handles')
    assert view.names() == before | {'line:0:scale.x'}
    assert {'move_x', 'rotate_x'} < set(view.controls('line:0')), 'those of fillers, too'
    assert set(view.controls('camera:0')) == {'body', 'rotate_x', 'rotate_y', 'rotate_z'}
    assert '[ ] Show all handles' in view.choose('cube0:0', 'Show all handles')
    assert view.names() == before
    assert not view.with_arrows()


def test_the_menu_holds_a_thing_in_place_and_lets_it_go_again():
    view = View()
    view.take(*cubes(2))

    assert '[x] Hold in place while others are dragged' in view.choose('cube0:0', 'Hold in place')
    assert view.hands.in_place == {'/topic:cube0:0'}
    assert '[ ] Hold in place while others are dragged' in view.choose('cube0:0', 'Hold in place')
    assert not view.hands.in_place


def test_all_handles_are_shown_from_the_start_if_that_is_chosen():
    view = View(shows_all=True)
    view.take(*cubes(FEW + 1))
    assert view.with_arrows() == view.names()


def test_a_text_that_rviz_shows_is_grabbed_by_a_ball():
    text = marker('text', Marker.TEXT_VIEW_FACING, size=0.3)
    text.text, text.pose.position.x = 'Depot', tracked(1.0)
    view = View()
    view.take(text)
    (shape,) = view.controls('text:0')['body'].markers
    assert (shape.type, shape.text) == (Marker.SPHERE, '')
    assert shape.scale.z > 0.3, 'in front of the letters for a mouse'
