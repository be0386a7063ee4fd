"""What a drag asks for, what it holds back, and what it says."""

import itertools
import math as plain_math
import threading
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rosslt import math, msg, node, values
from rosslt.markers.drags import changes, drop_check, wording
from rosslt.markers.drags import scene_drags as drags_module
from rosslt.markers.drags.drag import Drag
from rosslt.markers.drags.drop_check import Drop
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.geometry import IDENTITY
from rosslt.markers.scene.follower import Follower
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.node.change import change_request, closed_loop
from support import scenery
from support.processes import wait_until

HEIGHT, TIME = values.Source('/owner', 1), values.Source('/owner', 2)


def at(*position):
    return (*position, *([0.0] * (3 - len(position))), *IDENTITY)


def test_a_refusal_says_each_reason_once_without_who_passed_it_on():
    reason = 'the setter of script_waypoints_8_6_675e85a7 refuses 0.25: ValueError: 0.25 is below its minimum 0.5'
    error = node.ChangeRejected('long', {HEIGHT: reason, TIME: reason})
    assert wording.refusal(error) == '0.25 is below its minimum 0.5'


def test_long_numbers_are_cut():
    assert wording.short_numbers('at 2.0999999046325684 of 0.5') == 'at 2.1 of 0.5'


def box_at(x, frame='world', number=0):
    marker = Marker(type=Marker.CUBE, id=number)
    marker.header.frame_id = frame
    marker.pose.position.x = x
    return marker


def turned_by(angle, x=0.0):
    marker = box_at(x)
    marker.pose.orientation.z, marker.pose.orientation.w = math.sin(angle / 2), math.cos(angle / 2)
    return marker


def take(scene, message):
    scenery.take(scene, '/boxes', message)


def box_scene():
    scene = Scene(Settings())
    take(scene, box_at(values.track(1.0, HEIGHT)))
    return scene


def test_the_first_hand_on_a_thing_holds_it():
    scene = box_scene()
    drags = Drags(scene, Rules(is_live=False), str)
    (name,) = scene.names()
    pose = scene.handle(name).pose
    assert drags.hold(name, 'first')
    assert not drags.hold(name, 'second')
    assert not drags.move(name, 'world', pose, 'second')
    drags.release(name, 'world', pose, 'second')
    assert not drags.hold(name, 'second'), 'only the hand that holds a thing can let it go'
    assert drags.move(name, 'world', pose, 'first')
    drags.release(name, 'world', pose, 'first')
    assert drags.hold(name, 'second')
    assert not drags.hold('nothing', 'first')


class SlowView(Follower):
    """A view whose drawing goes on until hands have been reported."""

    def __init__(self, scene, report):
        super().__init__(
            scene, SimpleNamespace(version=0, can_change=lambda _value: True, look_up=lambda _sources: None)
        )
        self._report, self.heard = report, None

    def _hear(self):
        self.heard = self._report()

    def draw(self, _handle, _motions):
        hands = threading.Thread(target=self._hear, daemon=True)
        hands.start()
        hands.join(20.0)


def test_hands_are_heard_while_things_are_drawn():
    """Where nothing is heard of a hand for long, its drag ends."""
    scene = box_scene()
    (name,) = scene.names()
    drags = Drags(scene, Rules(is_live=False), str)

    def report():
        held = drags.hold(name)
        moved = drags.move(name, 'world', at(0.5))
        drags.keep(name)
        return held, moved, drags.release(name, 'world', at(0.5))

    view = SlowView(scene, report)
    view.follow()
    assert view.heard == (True, True, True)


class Notes:
    """All that is said at the handles of a scene."""

    def __init__(self, scene):
        self._scene, self._said = scene, []

    @property
    def said(self):
        self._said += [text for _, text in self._scene.news().said]
        return self._said


def moving_scene():
    """A box that has moved on to x = 1 and has turned on."""
    scene = Scene(Settings())
    take(scene, turned_by(values.track(0.3, TIME), values.track(1.0, HEIGHT)))
    return scene


def turned_at(x, yaw):
    return (x, 0.0, 0.0, 0.0, 0.0, plain_math.sin(yaw / 2), plain_math.cos(yaw / 2))


def drag_of(scene, frame, pose):
    (name,) = scene.names()
    drag = Drag(scene.handle(name), 1.0)
    drag.begin(frame, pose)
    return drag


def test_what_moves_on_while_a_hand_takes_hold_of_it_is_asked_for_what_the_hand_does_alone():
    drag = drag_of(moving_scene(), 'world', turned_at(0.9, 0.25))
    drag.move('world', turned_at(2.9, 0.25))
    assert (drag.is_moved, drag.is_turned) == (True, False)
    assert drag.handle.wanted(drag.pose, drag.is_moved, drag.is_turned)[1] == [2.9]
    drag = drag_of(moving_scene(), 'world', turned_at(0.9, 0.25))
    drag.move('world', turned_at(0.9, 0.75))
    assert (drag.is_moved, drag.is_turned) == (False, True)


def test_a_hand_that_takes_hold_and_lets_go_asks_for_nothing():
    drag = drag_of(moving_scene(), 'world', turned_at(0.9, 0.25))
    assert drag.asked == drag.pose == drag.start
    drag.move('world', turned_at(0.9, 0.25))
    assert drag.handle.wanted(drag.pose, drag.is_moved, drag.is_turned) == ([], [])


def test_what_stands_still_begins_exactly_where_it_is_though_rviz_says_it_in_32_bits():
    scene = moving_scene()
    (name,) = scene.names()
    pose = tuple(part * (1.0 + 3e-8) for part in scene.handle(name).pose)
    assert drag_of(scene, 'world', pose).start == scene.handle(name).pose


@pytest.mark.parametrize(
    ('frame', 'pose'), [('moon', turned_at(0.9, 0.25)), ('world', turned_at(plain_math.nan, 0.25))]
)
def test_a_place_that_makes_no_sense_is_a_fault_of_the_drag_and_no_beginning(frame, pose):
    drag = drag_of(moving_scene(), frame, pose)
    assert drag.fault
    assert drag.start == drag.handle.pose


def test_a_hold_begins_where_the_view_had_the_thing_and_a_second_one_changes_nothing():
    scene = moving_scene()
    drags = Drags(scene, Rules(is_live=False), str)
    (name,) = scene.names()
    assert drags.hold(name, 'first', 'world', turned_at(0.9, 0.25))
    drag = drags._held[name]
    assert drags.hold(name, 'first', 'world', turned_at(5.0, 0.25))
    assert drag.start[0] == 0.9, 'it is held already'


def test_the_first_pose_that_a_hand_reports_is_where_it_takes_hold():
    """RViz reports it before the press of the button."""
    scene = moving_scene()
    drags = Drags(scene, Rules(is_live=False), str)
    (name,) = scene.names()
    assert drags.move(name, 'world', turned_at(0.9, 0.25))
    assert drags.hold(name, '', 'world', turned_at(0.9, 0.25))
    assert drags.move(name, 'world', turned_at(1.9, 0.25))
    drag = drags._held[name]
    assert (drag.start[0], drag.is_moved, drag.is_turned) == (0.9, True, False)


def shown(*messages, is_live=True):
    """A scene that has taken messages, the drags in it, and all that it says."""
    scene = Scene(Settings())
    notes = Notes(scene)
    for message in messages:
        take(scene, message)
    return scene, Drags(scene, Rules(is_live=is_live), str), notes


def line_through(*points):
    """A line through points on the x axis."""
    marker = Marker(type=Marker.LINE_STRIP, points=[Point(x, 0.0, 0.0) for x in points])
    marker.header.frame_id = 'world'
    marker.scale.x = 0.1
    return marker


def drag_while(name, before, during, end):
    """Drag a handle from x = 1 while a message comes; gives what is said."""
    scene, drags, notes = shown(before, is_live=False)
    assert drags.hold(name, frame='world', pose=at(1.0))
    take(scene, during)
    assert drags.release(name, 'world', at(end))
    return notes


A, B, C = (values.Source('/owner', number) for number in (11, 12, 13))


def test_a_thing_that_the_next_message_shows_in_the_same_frame_follows_the_hand(asked):
    drag_while('/boxes::0', box_at(values.track(1.0, A)), box_at(values.track(1.1, A), '/world'), 2.0)
    wait_until(lambda: asked == [{A: 2.0}], 'the source to be asked for')


def test_a_thing_that_is_in_another_frame_now_does_not_follow_the_hand(asked):
    """Its x in the new frame is 100 less."""
    x = values.track(1.0, A)
    notes = drag_while('/boxes::0', box_at(x), box_at(x - 100.0, 'odom'), 2.0)
    wait_until(lambda: notes.said == ['it is in the frame odom now instead of world'], 'the hand to be told')
    assert asked == []


@pytest.mark.parametrize('shift', [0.0, values.track(0.0, C)], ids=['alone', 'shared'])
def test_a_point_in_whose_place_there_is_another_one_now_does_not_follow_the_hand(asked, shift):
    a, b = values.track(0.0, A), values.track(1.0, B)
    notes = drag_while('/boxes::0:points[1]', line_through(a, shift + b), line_through(-1.0, shift + a, b), 2.0)
    wait_until(lambda: notes.said == ['another thing has taken its place'], 'the hand to be told')
    assert asked == []


@pytest.mark.parametrize('shift', [0.0, values.track(0.0, C)], ids=['alone', 'shared'])
def test_a_hand_changes_nothing_but_what_it_took_hold_of(asked, shift):
    """The node has gone on to the next of its targets."""
    before = box_at(values.track(1.0, A))
    during = box_at(values.track(1.5, B))
    before.pose.position.y = during.pose.position.y = shift
    notes = drag_while('/boxes::0', before, during, 2.0)
    wait_until(lambda: notes.said, 'the hand to be told')
    assert asked == []
    assert notes.said[0].startswith(f'it comes from {B}')


def test_a_hand_changes_no_number_that_the_next_target_shares(asked):
    """As the distance that all targets of a patrol keep from their shelves."""
    distance = values.track(0.4, C)
    scene, drags, notes = shown(box_at(values.track(1.0, A) - distance), is_live=False)
    assert drags.hold('/boxes::0', frame='world', pose=at(0.6))
    take(scene, box_at(values.track(7.0, B) - distance))
    assert drags.release('/boxes::0', 'world', at(2.0))
    wait_until(lambda: notes.said, 'the hand to be told')
    assert (asked, notes.said) == ([], [f'it comes from {B}, {C} now'])


def test_a_person_is_told_of_what_follows_no_change(asked, monkeypatch):
    directory = node.Directory()
    stays = 'stops (itertools.cycle) holds values of it that follow no change'
    directory.take(A.node, [msg.Location(id=A.location_id, name='a', plain_copies=stays)])
    monkeypatch.setattr(node, 'directory', lambda: directory)
    _, drags, notes = shown(box_at(values.track(1.0, A)))
    assert drags.move('/boxes::0', 'world', at(1.0))
    assert drags.move('/boxes::0', 'world', at(2.0))
    wait_until(lambda: notes.said == [f'{A}: {stays}'], 'the hand to be told')
    assert asked == [{A: 2.0}]


def test_a_person_is_told_of_what_others_share(asked, monkeypatch):
    directory = node.Directory()
    row = msg.Location(id=A.location_id, name='a', row='f.py:3:1[0]')
    directory.take(A.node, [row, msg.Location(id=C.location_id, name='c')])
    monkeypatch.setattr(node, 'directory', lambda: directory)
    _, drags, notes = shown(box_at(values.track(1.0, A) + values.track(0.0, C)))
    assert drags.move('/boxes::0', 'world', at(1.0))
    drags.chosen['/boxes::0'] = (C,)
    assert drags.move('/boxes::0', 'world', at(2.0))
    wait_until(lambda: asked == [{C: 1.0}], 'the shift to be asked for')
    wait_until(lambda: notes.said == [f'{C} moves others, too'], 'the hand to be told')


def test_a_hand_has_the_target_that_was_shown_when_it_took_hold(asked):
    """A patrol goes on while the press is on its way: the next target is not what the hand has."""
    _, drags, notes = shown(box_at(values.track(1.0, A)), box_at(values.track(7.0, B)))
    assert drags.move('/boxes::0', 'world', at(1.0))
    assert drags.hold('/boxes::0', frame='world', pose=at(1.0))
    assert drags.move('/boxes::0', 'world', at(1.5))
    assert drags.release('/boxes::0', 'world', at(2.0))
    wait_until(lambda: notes.said, 'the hand to be told')
    assert (asked, notes.said) == ([], [f'it comes from {B} now'])
    assert drags.move('/boxes::0', 'world', at(7.0))
    assert drags.move('/boxes::0', 'world', at(8.0))
    wait_until(lambda: asked == [{B: 8.0}], 'the next drag to move the next target')


def spaced(number, first=1.0, step=3.0):
    """One of several targets that come from the same numbers."""
    return box_at(values.track(first, A) + number * values.track(step, B))


class Node:
    """A node that shows a thing as it computes it, whenever a test looks whether something holds.

    Args:
        compute: gives the x of the thing for the values of its sources.
        present: {Source: value}; A begins with 1.
    """

    def __init__(self, scene, present, compute):
        self.compute, self._scene, self._present = compute, scene, present
        present.setdefault(A, 1.0)
        self.show()

    def show(self):
        take(self._scene, box_at(self.compute(self._present[A])))

    def shows_until(self, holds, what):
        wait_until(lambda: self.show() or holds(), what)


def target(number):
    """One of several targets that come from the same numbers."""
    return lambda first: values.track(first, A) + number * values.track(3.0, B)


def drag_of_the_first(scene, present, asked):
    """A hand has moved the first target from 4 to 5, and its node goes on to the second; gives that, and the drags."""
    node_of_it = Node(scene, present, target(1))
    drags = Drags(scene, Rules(), str)
    assert drags.move('/boxes::0', 'world', at(4.0))
    assert drags.move('/boxes::0', 'world', at(5.0))
    wait_until(lambda: asked == [{A: 2.0}], 'the source to be asked for')
    node_of_it.compute = target(2)
    return node_of_it, drags


def test_a_hand_keeps_what_it_has_of_targets_of_the_same_numbers(asked, present):
    scene = Scene(Settings())
    notes = Notes(scene)
    node_of_it, drags = drag_of_the_first(scene, present, asked)
    assert drags.move('/boxes::0', 'world', at(5.5))
    node_of_it.shows_until(lambda: asked[-1] == {A: 2.5}, 'the hand to go on with what it has')
    assert {one[A] for one in asked} <= {1.0, 2.0, 2.5}
    assert drags.release('/boxes::0', 'world', at(6.0))
    node_of_it.shows_until(lambda: not drags._over, 'the drag to end')
    wait_until(lambda: asked[-1] == {A: 3.0}, 'the source to be asked for at the end')
    wait_until(lambda: drags_module.WENT_ON in notes.said, 'the hand to be told')


def test_what_its_node_computes_in_another_way_is_followed(asked, present):
    """It comes back with its source, so it is the same thing."""
    scene = Scene(Settings())
    node_of_it = Node(scene, present, lambda a: (2.0 if a < 5.0 else 3.0) * values.track(a, A))
    drags = Drags(scene, Rules(), str)
    assert drags.move('/boxes::0', 'world', at(2.0))
    assert drags.move('/boxes::0', 'world', at(12.0))
    wait_until(lambda: present[A] == 6.0, 'a step past 5')
    assert drags.move('/boxes::0', 'world', at(18.0))
    node_of_it.shows_until(lambda: len(asked) > 2, 'its source to be given back, and the hand to be followed again')
    assert drags.move('/boxes::0', 'world', at(18.3))
    node_of_it.shows_until(lambda: present[A] == 6.1, 'the hand to be followed in the other way')
    assert drags.release('/boxes::0', 'world', at(18.6))
    node_of_it.shows_until(lambda: present[A] == 6.2, 'the end to be exact')


def test_a_hand_takes_the_target_it_saw_of_the_same_numbers(asked):
    _, drags, _ = shown(spaced(1), spaced(2), spaced(2), is_live=False)
    assert drags.move('/boxes::0', 'world', at(4.0))
    assert drags.release('/boxes::0', 'world', at(5.0))
    wait_until(lambda: asked == [{A: 2.0}], 'the first target to follow')


def test_a_drop_is_not_solved_again_for_the_next_target(asked, present, monkeypatch):
    monkeypatch.setattr(closed_loop, 'LOOK', 0.05)
    node_of_it, drags = drag_of_the_first(Scene(Settings()), present, asked)
    node_of_it.shows_until(lambda: len(asked) > 2, 'the hand to go on with what it has')
    assert drags.release('/boxes::0', 'world', at(5.0))
    node_of_it.shows_until(lambda: not drags._drops and not drags._over, 'the drop to be judged')
    assert asked == [{A: 2.0}, {A: 1.0}, {A: 2.0}]


def test_what_another_person_changes_counts_in_a_drag(asked):
    """The hand has the first of two targets; what both share is set while the second is shown."""
    scene, drags, _ = shown(spaced(1), is_live=False)
    assert drags.hold('/boxes::0', frame='world', pose=at(4.0))
    take(scene, spaced(2, step=4.0))
    assert drags.release('/boxes::0', 'world', at(6.0))
    wait_until(lambda: asked == [{A: 2.0}], 'the source to be asked for')


def test_a_linearization_gives_way_to_the_next_message(asked, present):
    """A node's own function is sent as a line through its present value."""
    scene = Scene(Settings())
    node_of_it = Node(scene, present, lambda a: lined(a, a * a, 2.0 * a))
    drags = Drags(scene, Rules(), str)
    assert drags.move('/boxes::0', 'world', at(1.0))
    assert drags.move('/boxes::0', 'world', at(4.0))
    node_of_it.shows_until(lambda: len(asked) > 2, 'the line to be solved, and its source to be given back')
    for step in range(1, 4):
        count = len(asked)
        assert drags.move('/boxes::0', 'world', at(4.0 + 0.1 * step))
        node_of_it.shows_until(lambda count=count: len(asked) > count, 'the line of the last message to be solved')
    assert drags.release('/boxes::0', 'world', at(4.0))
    node_of_it.shows_until(lambda: not drags._drops and not drags._over and not drags._held, 'the drop to be judged')
    assert present[A] == pytest.approx(2.0, abs=1e-2)


def lined(source, value, slope):
    """A number near its present value."""
    instructions = [(values.SOURCE, A, source), (values.AFFINE, value, ((0, slope),), False)]
    return values.assemble(instructions, lambda *_: None)[1]


def test_an_angle_that_its_node_wraps_stays_in_the_hand():
    """The quaternion of a whole turn more is the negative one, and the same rotation."""
    scene = Scene(Settings())
    angle = values.track(3.0, A)
    take(scene, turned_by(angle))
    drag = Drag(scene.handle('/boxes::0'), 1.0)
    take(scene, turned_by(angle - 2 * plain_math.pi))
    drag.take(scene.handle('/boxes::0'))
    assert (drag.thing, drag.went_on) == (scene.handle('/boxes::0'), 0.0)
    take(scene, turned_by(angle + 1.0))
    drag.take(scene.handle('/boxes::0'))
    assert drag.went_on > 0.1


def test_a_person_is_told_that_a_drag_moves_all_of_a_row(asked, monkeypatch):
    """As five poses at `X0 + i * STEP`."""
    monkeypatch.setattr(node, 'directory', node.Directory)
    scene = Scene(Settings())
    notes = Notes(scene)
    start, step = values.track(1.0, A), values.track(0.5, B)
    poses = [Pose(position=Point(start + step * index, 0.0, 0.0)) for index in range(5)]
    message = PoseArray(header=Header(frame_id='world'), poses=poses)
    scenery.take(scene, '/poses', message)
    drags = Drags(scene, Rules(is_live=False), str)
    assert drags.hold('/poses:poses[2]', frame='world', pose=at(2.0))
    assert drags.release('/poses:poses[2]', 'world', at(2.5))
    wait_until(lambda: notes.said, 'the hand to be told')
    ((changed, _),) = asked[0].items()
    assert notes.said == [f'{changed} moves others, too']


def test_a_hand_leaves_what_others_on_the_screen_come_from(asked, monkeypatch):
    """As the dock that a gate is beside."""
    monkeypatch.setattr(node, 'directory', node.Directory)
    dock = values.track(5.0, A)
    scene, drags, notes = shown(box_at(dock + values.track(0.5, B)), box_at(dock, number=1), is_live=False)

    def dragged(handle):
        start = float(scene.handle(handle).pose[0])
        before = len(asked)
        assert drags.hold(handle, frame='world', pose=at(start))
        assert drags.release(handle, 'world', at(start + 1.0))
        wait_until(lambda: len(asked) > before, 'the change to be asked for')
        return asked[-1]

    assert dragged('/boxes::0') == {B: 1.5}
    assert dragged('/boxes::1') == {A: 6.0}
    assert not notes.said


def test_a_drag_of_shared_numbers_alone_ends_with_its_target(asked):
    """As the scale and the offset of all targets: the next one comes from them as well."""
    shift = values.track(0.0, C)
    scene, drags, notes = shown(box_at(shift + 0.5 * values.track(2.0, A)))
    assert drags.move('/boxes::0', 'world', at(1.0))
    drags.chosen['/boxes::0'] = (C,)
    assert drags.move('/boxes::0', 'world', at(2.0))
    wait_until(lambda: asked == [{C: 1.0}], 'the shift to be asked for')
    take(scene, box_at(values.track(1.0, C) + 0.5 * values.track(8.0, B)))
    assert drags.release('/boxes::0', 'world', at(3.0))
    wait_until(lambda: notes.said and not scene.is_held('/boxes::0'), 'it goes where its messages have it')
    assert (asked, set(notes.said)) == ([{C: 1.0}], {f'it comes from {C}, {B} now'})


def test_a_drag_ends_when_its_node_goes_on_to_another_target(asked):
    shift = values.track(0.0, C)
    scene, drags, notes = shown(box_at(values.track(1.0, A) + shift))
    assert drags.move('/boxes::0', 'world', at(1.0))
    assert drags.move('/boxes::0', 'world', at(2.0))
    wait_until(lambda: asked == [{A: 2.0}], 'the source to be asked for')
    take(scene, box_at(values.track(7.0, B) + shift))
    assert drags.move('/boxes::0', 'world', at(3.0))
    wait_until(lambda: notes.said, 'the hand to be told')
    assert drags.release('/boxes::0', 'world', at(4.0))
    wait_until(lambda: not scene.is_held('/boxes::0'), 'it goes where its messages have it')
    assert asked == [{A: 2.0}]
    assert set(notes.said) == {f'it comes from {B}, {C} now'}


def test_a_drop_whose_node_goes_on_to_another_target_stays(asked, monkeypatch):
    monkeypatch.setattr(drop_check, 'TIMEOUT', 0.5)
    notes = drag_while('/boxes::0', box_at(values.track(1.0, A)), box_at(values.track(1.0, A)), 2.0)
    wait_until(lambda: asked == [{A: 2.0}], 'the source to be asked for')
    take(notes._scene, box_at(values.track(7.0, B)))
    wait_until(lambda: notes.said, 'the hand to be told')
    assert (asked, notes.said) == ([{A: 2.0}], [f'changed; it comes from {B} now'])


def test_a_thing_whose_numbers_are_gone_does_not_follow_the_hand(asked, monkeypatch):
    """As where somebody has saved a live script anew."""

    def unknown(x, timeout):
        raise node.SourceUnreachable('the location is unknown', {A.node: 'it does not know the location'})

    monkeypatch.setattr(node, 'reevaluate', unknown)
    notes = drag_while('/boxes::0', box_at(values.track(1.0, A)), box_at(values.track(1.5, B)), 2.0)
    wait_until(lambda: notes.said and 'its numbers are others by now' in notes.said[0], 'the hand to be told')
    assert asked == []


class Failing:
    """A box whose drags cannot be followed, as an error in the program has it."""

    def __init__(self, monkeypatch):
        self.scene, self.let_go, self.tried = box_scene(), [], []
        self.notes = Notes(self.scene)
        (self.name,) = self.scene.names()
        monkeypatch.setattr(changes, 'plan', self.plan)
        monkeypatch.setattr(self.scene, 'let_go', lambda name, request=None: self.let_go.append((name, request)))
        self.drags = Drags(self.scene, Rules(rate=1000.0), str)

    def plan(self, *_arguments, **_options):
        self.tried.append(True)
        raise ArithmeticError('of all things')


def test_a_drag_that_fails_is_told_and_tried_once_and_let_go_once(monkeypatch):
    box = Failing(monkeypatch)
    assert box.drags.hold(box.name, frame='world', pose=at(1.0))
    for step in range(1, 20):
        assert box.drags.move(box.name, 'world', at(1.0 + step))
        wait_until(lambda: box.notes.said, 'the hand to be told')
    assert box.drags.release(box.name, 'world', at(30.0))
    wait_until(lambda: box.let_go, 'it to be let go')
    assert box.drags.hold(box.name, 'another'), 'the next drag works'
    assert (box.tried, box.let_go) == ([True], [(box.name, None)])
    assert set(box.notes.said) == {'ArithmeticError: of all things'}


def test_a_drop_that_cannot_be_looked_at_keeps_no_other_handle_held(asked, monkeypatch):
    """One thread follows all drags, and ends them."""

    failed = threading.Event()

    def fail(*_arguments):
        failed.set()
        raise ArithmeticError('of all things')

    scene = box_scene()
    (name,) = scene.names()
    drags = Drags(scene, Rules(is_live=False), str)
    with monkeypatch.context() as patch:
        patch.setattr(drags_module, 'Drop', fail)
        assert drags.hold(name, frame='world', pose=at(1.0))
        assert drags.release(name, 'world', at(2.0))
        wait_until(failed.is_set, 'the first drag to have ended')
    assert drags.hold(name, frame='world', pose=at(1.0))
    assert drags.release(name, 'world', at(3.0))
    wait_until(lambda: asked[-1] == {HEIGHT: 3.0}, 'the last drag to be followed')


def test_a_hand_of_which_nothing_is_heard_any_more_has_let_go(asked, monkeypatch):
    scene = box_scene()
    notes = Notes(scene)
    (name,) = scene.names()
    drags = Drags(scene, Rules(is_live=False), str)
    assert drags.hold(name, 'first', 'world', at(1.0))
    drags.move(name, 'world', at(2.0), 'first')
    monkeypatch.setattr(drags_module, 'SILENCE', 0.0)
    wait_until(lambda: asked == [{HEIGHT: 2.0}], 'the source to be asked for where it has been let go')
    wait_until(lambda: drags.hold(name, 'second'), 'another hand to get it')
    assert notes.said == []


class Folded:
    """A box at x = fold^3 / 3 - fold. It turns round at fold = -1 and x = 2/3; beyond, only a fold above 2 gives x."""

    def __init__(self, fold, monkeypatch):
        self.fold, self.scene = fold, Scene(Settings())
        self.notes = Notes(self.scene)
        monkeypatch.setattr(change_request, 'request_values', self.request_values)
        monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})
        self.show()
        self.drags = Drags(self.scene, Rules(rate=1000.0, resolution=1e-9), str)
        self.x = self.scene.handle('/boxes::0').pose[0]
        assert self.drags.hold('/boxes::0', frame='world', pose=at(self.x))

    def show(self):
        fold = values.track(self.fold, A)
        take(self.scene, box_at(fold * fold * fold / 3.0 - fold))

    def request_values(self, wanted, *_):
        changed = {A: node.Change(self.fold, wanted[A])}
        self.fold = wanted[A]
        self.show()
        return changed

    def drag(self, x, is_there, steps=10):
        for step in range(1, steps + 1):
            self.drags.move('/boxes::0', 'world', at(self.x + (x - self.x) * step / steps))
        wait_until(is_there, lambda: f'fold is {self.fold}, {self.notes.said}')
        self.x = x


def test_a_drag_that_comes_to_a_leap_stays_before_it_also_when_the_hand_lets_go(monkeypatch):
    box = Folded(0.0, monkeypatch)
    box.drag(0.6, lambda: abs(box.fold**3 / 3 - box.fold - 0.6) < 1e-6)
    box.drag(0.75, lambda: box.notes.said)
    assert box.drags.release('/boxes::0', 'world', at(0.75))
    wait_until(lambda: not box.drags._over, 'it is over')
    assert box.fold == pytest.approx(-1.0, abs=0.01)


@pytest.mark.parametrize('fold', [-1.0, -1.00001, -0.98])
def test_a_drag_that_begins_at_a_leap_makes_it_when_the_hand_lets_go(fold, monkeypatch):
    box = Folded(fold, monkeypatch)
    box.drag(0.72, lambda: box.notes.said, steps=20)
    assert -1.01 <= box.fold <= 0.0
    assert box.drags.release('/boxes::0', 'world', at(0.72))
    wait_until(lambda: box.fold > 2.0, lambda: f'fold is {box.fold}')


ERROR = 'raises ZeroDivisionError: float division by zero'


class Raising:
    """Drags of a box that come to an error in a node once its source was asked for; notes what is taken back."""

    def __init__(self, asked, monkeypatch, bad, is_live):
        self.taken_back = []
        monkeypatch.setattr(change_request, 'undo_request', self._undo)
        self.scene = Scene(Settings())
        self.notes = Notes(self.scene)
        scenery.take(self.scene, '/boxes', box_at(values.track(1.0, A)), '/publisher')
        self.drags = Drags(
            self.scene,
            Rules(is_live=is_live),
            str,
            lambda nodes, since: f'{bad} {ERROR}' if asked and bad in nodes and since < plain_math.inf else '',
        )
        assert self.drags.hold('/boxes::0', frame='world', pose=at(1.0))

    def _undo(self, _request_id, nodes, *_):
        self.taken_back.append(set(nodes))
        return node.Undone({}, {})


@pytest.mark.parametrize('bad', ['/owner', '/publisher'])
def test_a_drag_that_makes_a_node_raise_is_taken_back_although_the_hand_rests_and_it_is_told(asked, monkeypatch, bad):
    one = Raising(asked, monkeypatch, bad, is_live=True)
    one.drags.move('/boxes::0', 'world', at(2.0))
    wait_until(lambda: f'{bad} {ERROR}; taken back' in one.notes.said, 'the hand to be told')
    assert one.drags.release('/boxes::0', 'world', at(4.0))
    wait_until(lambda: not one.scene.is_held('/boxes::0'), 'it goes back')
    assert (asked, one.taken_back) == ([{A: 2.0}], [{'/owner'}])


@pytest.mark.parametrize('bad', ['/owner', '/publisher'])
def test_a_drop_that_makes_a_node_raise_is_taken_back_and_the_handle_goes_back(asked, monkeypatch, bad):
    one = Raising(asked, monkeypatch, bad, is_live=False)
    assert one.drags.release('/boxes::0', 'world', at(2.0))
    wait_until(lambda: f'{bad} {ERROR}; taken back' in one.notes.said, 'the hand to be told')
    wait_until(lambda: not one.scene.is_held('/boxes::0'), 'it goes back')
    assert (asked, one.taken_back) == ([{A: 2.0}], [{'/owner'}])


def test_a_drop_that_newer_messages_do_not_show_is_taken_back(asked, present, monkeypatch):
    """As of a robot that has begun at a waypoint, and goes on from where it is."""
    monkeypatch.setattr(drop_check, 'TIMEOUT', 0.5)
    present[A] = 1.0
    one, ticks = Raising(asked, monkeypatch, '/nobody', is_live=False), itertools.count(1)
    assert one.drags.release('/boxes::0', 'world', at(2.0))

    def is_told():
        take(one.scene, box_at(values.track(1.0, A) + 0.001 * next(ticks)))
        return f'its messages still come from the old value of {A}; taken back' in one.notes.said

    wait_until(is_told, 'the hand to be told')
    wait_until(lambda: not one.scene.is_held('/boxes::0'), 'it goes back')
    assert (asked, one.taken_back) == ([{A: 2.0}], [{'/owner'}])


def dropped_at_two(scene, change=lambda: False):
    """What was dropped at x = 2, from A = 1, and is expected to have become 2."""
    take(scene, box_at(values.track(1.0, A)))
    drag = drag_of(scene, 'world', at(1.0))
    drag.move('world', at(2.0))
    drag.request.note({A: node.Change(1.0, 2.0)})
    return Drop(drag, change)


def test_what_is_shown_where_it_was_dropped_is_done():
    scene = Scene(Settings())
    drop = dropped_at_two(scene)
    for _ in range(2):
        take(scene, box_at(values.track(2.0, A)))
        drop.see(scene.handle('/boxes::0'))
    assert drop.loop.is_reached


def test_what_stays_elsewhere_is_solved_again_and_then_said_to_be(monkeypatch):
    monkeypatch.setattr(closed_loop, 'LOOK', 0.05)
    scene, asked = Scene(Settings()), []
    drop = dropped_at_two(scene, lambda: bool(asked.append(True)))

    def is_over():
        take(scene, box_at(3.0 * values.track(2.0, A)))
        drop.see(scene.handle('/boxes::0'))
        return drop.loop.is_over

    wait_until(is_over, 'it is known')
    assert (asked, drop.is_elsewhere) == ([True], True)


def test_what_moves_by_itself_is_left_alone(monkeypatch):
    monkeypatch.setattr(closed_loop, 'LOOK', 0.05)
    scene, asked, ticks = Scene(Settings()), [], itertools.count(1)
    drop = dropped_at_two(scene, lambda: bool(asked.append(True)))

    def is_over():
        take(scene, box_at(values.track(2.0, A) + 0.1 * next(ticks)))
        drop.see(scene.handle('/boxes::0'))
        return drop.loop.is_over

    wait_until(is_over, 'it is judged')
    assert (asked, drop.is_elsewhere) == ([], False)


def test_what_no_message_shows_any_more_stays_where_it_was_dropped_and_says_so(asked, monkeypatch):
    monkeypatch.setattr(drop_check, 'TIMEOUT', 0.0)
    scene, drags, notes = shown(box_at(values.track(1.0, A)), is_live=False)
    assert drags.hold('/boxes::0', frame='world', pose=at(1.0))
    assert drags.release('/boxes::0', 'world', at(2.0))
    wait_until(lambda: notes.said == ['changed, but not shown yet'], 'it is said')
    assert scene.is_held('/boxes::0')
