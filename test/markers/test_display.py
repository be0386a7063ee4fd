"""What the display sends to RViz, and what it leaves alone."""

import threading
import time
from types import SimpleNamespace

import pytest
import rospy
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerFeedback

from rosslt import node, values
from rosslt.markers.geometry import IDENTITY
from rosslt.markers.offers import HEADING, Offers
from rosslt.markers.rviz import display as displays
from rosslt.markers.rviz.menus import Menu, Menus
from rosslt.markers.rviz.notes import Notes
from rosslt.markers.scene import hold as holds
from rosslt.markers.scene.handle import Motions, Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.selection import Selection

SOURCE = values.Source('/owner', 1)


def made_two():
    """What has made the source 2."""
    request = node.ChangeRequest(1.0)
    request.note({SOURCE: node.Change(0.0, 2.0)})
    return request


class Thing:
    """A handle on nothing, at a tracked x."""

    frame, size, rank, position, level = 'world', 1.0, 0, None, 0

    def __init__(self, x=0.0, draw_key='red', name='thing', at=None):
        self.name = self.thing = self.whole = name
        self.draw_key = draw_key
        self.pose = (x, 0.0, 0.0, *IDENTITY)
        self.tracked = [values.track(x if at is None else at, SOURCE)]

    def motions(self, can_change, rank_of=None):
        return Motions((can_change(self.tracked[0]), False, False))

    def shapes(self):
        return []


class Broken(Thing):
    def shapes(self):
        raise ArithmeticError('of all things')


class Known:
    """All sources, as taking changes."""

    version = 0

    def can_change(self, _value):
        return True

    def rank(self, _source):
        return 0

    def held(self, _thing, _shared):
        return []

    def look_up(self, sources):
        pass


class Sent:
    """A server that notes what is asked of it."""

    mutex = threading.RLock()

    def __init__(self):
        self.calls = []

    def insert(self, marker, _feedback):
        self.calls.append(('insert', marker.name))

    def setPose(self, name, pose):  # noqa: N802
        self.calls.append(('pose', name, pose.position.x))

    def erase(self, name):
        self.calls.append(('erase', name))

    def applyChanges(self):  # noqa: N802
        self.calls.append('apply')


class Shown:
    """A scene with a display, and what a message does to it."""

    def __init__(self):
        self.sent = Sent()
        self.scene = Scene(Settings())
        self.apart, self.has_other_frames = set(), False
        self.display = displays.Display(
            self.sent, Offers(self.scene, None, Known()), Notes(0.2), Selection(shows_all=True), 0.5, self
        )
        self.display._menus = SimpleNamespace(of=lambda _handle: None)
        self.things = {}

    def has(self, frame):
        return frame not in self.apart

    def update(self):
        return self.has_other_frames

    def put(self, thing):
        self.scene._put('/topic', self.things, thing.name, [thing], '/publisher')
        return self.sends()

    def drop(self, name):
        self.scene._delete('/topic', self.things, name)
        return self.sends()

    def sends(self):
        """What is sent now."""
        del self.sent.calls[:]
        self.display.apply()
        return [call for call in self.sent.calls if call != 'apply']


@pytest.fixture
def shown():
    result = Shown()
    assert result.put(Thing()) == [('insert', 'thing')]
    return result


def test_nothing_is_sent_where_nothing_changes(shown):
    assert shown.put(Thing()) == []
    assert shown.sent.calls == []


def test_a_new_pose_is_sent_as_a_pose(shown):
    assert shown.put(Thing(1.0)) == [('pose', 'thing', 1.0)]


def test_a_new_drawing_is_inserted(shown):
    assert shown.put(Thing(draw_key='blue')) == [('insert', 'thing')]


def test_what_goes_and_comes_back_between_two_frames_is_not_sent(shown):
    shown.scene._delete('/topic', shown.things, 'thing')
    assert shown.put(Thing()) == []


def test_what_a_hand_holds_is_left_alone(shown):
    shown.scene.hold('thing')
    assert shown.put(Thing(1.0, draw_key='blue')) == []
    assert shown.drop('thing') == []
    shown.scene.let_go('thing')
    assert shown.sends() == [('erase', 'thing')]


def test_a_handle_waits_where_it_was_dropped_until_a_message_has_the_new_value(shown):
    shown.scene.hold('thing')
    shown.scene.let_go('thing', made_two())
    assert shown.put(Thing(1.0)) == [], 'that message was older than the drag'
    assert shown.put(Thing(1.9, at=2.0)) == [('pose', 'thing', 1.9)], 'computed from the new value'
    assert shown.put(Thing(3.0)) == [('pose', 'thing', 3.0)]


def test_where_the_last_message_before_the_drop_has_the_new_value_none_is_waited_for(shown):
    """A latched topic may say nothing more."""
    shown.scene.hold('thing')
    assert shown.put(Thing(1.0, at=2.0)) == [], 'the hand still has it'
    shown.scene.let_go('thing', made_two())
    assert shown.sends() == [('pose', 'thing', 1.0)]


def test_what_is_removed_after_the_drop_is_erased(shown):
    shown.scene.hold('thing')
    shown.scene.let_go('thing', made_two())
    assert shown.drop('thing') == [('erase', 'thing')]
    assert not shown.scene.is_held('thing')
    assert shown.put(Thing(1.0)) == [('insert', 'thing')]


def test_what_is_removed_during_the_drag_is_erased_after_the_drop(shown):
    shown.scene.hold('thing')
    assert shown.drop('thing') == [], 'the hand still has it'
    shown.scene.let_go('thing', made_two())
    assert shown.sends() == [('erase', 'thing')]


def test_what_one_message_removes_and_adds_again_waits_where_it_was_dropped(shown):
    """Many nodes begin each message with DELETEALL."""
    shown.scene.hold('thing')
    shown.scene.let_go('thing', made_two())
    shown.scene._delete('/topic', shown.things, 'thing')
    assert shown.put(Thing(1.0)) == [], 'that message was older than the drag'
    assert shown.put(Thing(1.9, at=2.0)) == [('pose', 'thing', 1.9)]


def test_a_message_long_after_the_drop_is_believed_whatever_it_says(shown, monkeypatch):
    monkeypatch.setattr(holds, 'OLDER_MESSAGES', 0.0)
    shown.scene.hold('thing')
    shown.scene.let_go('thing', made_two())
    time.sleep(0.01)
    assert shown.put(Thing(1.0)) == [('pose', 'thing', 1.0)]


def test_a_last_message_that_does_not_show_the_change_is_believed_after_a_while(shown, monkeypatch):
    """A latched topic says nothing more, if the change was taken back soon after the drop or its sources are gone."""
    shown.scene.hold('thing')
    shown.scene.let_go('thing', made_two())
    assert shown.put(Thing(1.0)) == [], 'it may have been under way'
    monkeypatch.setattr(holds, 'OLDER_MESSAGES', 0.0)
    assert shown.sends() == [('pose', 'thing', 1.0)]
    assert not shown.scene.is_held('thing')


def test_where_sources_do_not_follow_it_goes_back_at_once(shown):
    shown.scene.hold('thing')
    shown.scene.let_go('thing')
    assert shown.sends() == [('pose', 'thing', 0.0)]


def test_what_cannot_be_drawn_does_not_keep_others_from_being_shown(shown):
    assert shown.put(Broken(name='broken')) == []
    assert shown.put(Thing(name='sound')) == [('insert', 'sound')]
    assert shown.sends() == [], 'it is not tried over and over'


@pytest.fixture
def logged(monkeypatch):
    """The errors that are logged."""
    result = []
    monkeypatch.setattr(rospy, 'logerr', lambda text, *arguments: result.append(text % arguments))
    return result


class Meddling(Thing):
    """A thing whose drawing does something else meanwhile."""

    def __init__(self, does, **options):
        super().__init__(**options)
        self._does = does

    def shapes(self):
        self._does()
        return []


def test_what_is_to_be_redrawn_while_things_are_drawn_is_drawn_next(shown):
    """A menu that is made may learn what another menu lacks."""
    shown.put(Thing(name='other'))
    shown.scene._put('/topic', shown.things, 'more', [Thing(name='more')], '/publisher')
    assert ('insert', 'first') in shown.put(Meddling(lambda: shown.display.redraw('other'), name='first'))
    assert shown.sends() == [('insert', 'other')]


def test_messages_are_taken_while_things_are_drawn(shown):
    """The scene is not locked: drawing may take long, or wait for another thread that needs the scene."""
    taken = []

    def take():
        shown.scene._put_handle(Thing(1.0))
        taken.append(shown.scene.handle('thing').pose[0])

    def take_in_another_thread():
        thread = threading.Thread(target=take, daemon=True)
        thread.start()
        thread.join(20.0)

    shown.put(Meddling(take_in_another_thread, name='slow'))
    assert taken == [1.0]
    assert shown.sends() == [('pose', 'thing', 1.0)]


@pytest.mark.parametrize('method', ['insert', 'setPose', 'erase'])
def test_a_fault_in_one_thing_ends_neither_the_view_nor_other_things_and_is_logged_once(
    shown, monkeypatch, logged, method
):
    shown.put(Thing(name='other'))
    for _ in range(3):
        monkeypatch.setattr(shown.sent, method, lambda *_: 1 / 0)
        shown.put(Thing(1.0))
        shown.put(Thing(name='new'))
        shown.drop('other')
        monkeypatch.undo()
        monkeypatch.setattr(rospy, 'logerr', lambda text, *arguments: logged.append(text % arguments))
        shown.put(Thing(name='other'))
        shown.put(Thing())
        shown.drop('new')
    assert shown.put(Thing(name='last')) == [('insert', 'last')]
    (error,) = logged
    assert error.split(' ')[0] == {'insert': 'new', 'setPose': 'thing', 'erase': 'other'}[method]
    assert 'ZeroDivisionError' in error


def test_a_fault_in_a_menu_leaves_the_handle(shown, logged):
    shown.display._menus.of = lambda _handle: 1 / 0
    assert shown.put(Thing(name='other')) == [('insert', 'other')]
    assert shown.put(Thing(1.0, name='other')) == [('pose', 'other', 1.0)]
    (error,) = logged
    assert error.startswith('other has no menu')
    assert 'ZeroDivisionError' in error


class Inserted:
    """A server that keeps a marker, and the function that is told of its menu."""

    def __init__(self):
        self.marker, self.told = InteractiveMarker(name='thing'), None

    def get(self, _name):
        return self.marker

    def insert(self, _marker, function, _event):
        self.told = function


class Harmless:
    def undo(self, _name):
        pass

    def in_full(self, _source):
        return 'x'


def test_every_entry_of_a_menu_may_be_reported():
    scene = Scene(Settings())
    offers = SimpleNamespace(
        choose=lambda *_: None,
        drags=Harmless(),
        scene=scene,
        descriptions=Harmless(),
        is_in_place=lambda _name: False,
        set_in_place=lambda *_: None,
    )
    server, menu = Inserted(), Menu([('all', None, True), ('x', SOURCE, False)], True, [('x', SOURCE)], False)
    Menus(offers, lambda _name: None, set(), Selection(shows_all=False)).add(server, 'thing', menu)
    entries = server.marker.menu_entries
    assert [entry.title for entry in entries if entry.parent_id] == ['x']
    for entry in entries:
        server.told(InteractiveMarkerFeedback(menu_entry_id=entry.id))


def rows_of(server):
    (row,) = [entry for entry in server.marker.menu_entries if entry.title == 'Row']
    return [entry for entry in server.marker.menu_entries if entry.parent_id == row.id]


def test_the_row_of_a_menu_is_the_one_that_it_was_drawn_with():
    edited = []
    offers = SimpleNamespace(edit_row=lambda *arguments: edited.append(arguments))
    menus = Menus(offers, lambda _name: None, set(), Selection(shows_all=False))
    menu, next_row = Menu([], False, [], False, rows=[('a', SOURCE)]), values.Source('/owner', 2)
    first, then = Inserted(), Inserted()
    menus.add(first, 'thing', menu)
    menus.add(then, 'thing', menu._replace(rows=[('b', next_row)]))
    assert [entry.title for entry in rows_of(first)] == ['Duplicate', 'Delete', 'Move up', 'Move down']
    for entry in rows_of(first):
        then.told(InteractiveMarkerFeedback(menu_entry_id=entry.id))
    assert edited == []
    for entry in rows_of(then):
        then.told(InteractiveMarkerFeedback(menu_entry_id=entry.id))
    assert edited == [('thing', next_row, operation) for operation in ('duplicate', 'delete', 'up', 'down')]


def test_each_of_several_rows_has_a_submenu_of_its_own():
    edited = []
    offers = SimpleNamespace(edit_row=lambda *arguments: edited.append(arguments))
    rows, server = [('a', SOURCE), ('b', values.Source('/owner', 2))], Inserted()
    Menus(offers, lambda _name: None, set(), Selection(shows_all=False)).add(
        server, 'thing', Menu([], False, [], False, rows)
    )
    entries = server.marker.menu_entries
    assert [entry.title for entry in rows_of(server)] == ['a', 'b']
    for row in rows_of(server):
        for entry in (row, *[one for one in entries if one.parent_id == row.id]):
            server.told(InteractiveMarkerFeedback(menu_entry_id=entry.id))
    operations = 'duplicate', 'delete', 'up', 'down'
    assert edited == [('thing', source, operation) for _, source in rows for operation in operations]


def test_a_menu_without_a_row_has_no_submenu_for_it():
    server = Inserted()
    menus = Menus(SimpleNamespace(), lambda _name: None, set(), Selection(shows_all=False))
    menus.add(server, 'thing', Menu([], False, [('z', SOURCE)], False))
    assert [entry.title for entry in server.marker.menu_entries if not entry.parent_id][-1] == 'Sources'


def test_a_menu_without_choices_says_nothing_of_what_a_drag_changes():
    server, menu = Inserted(), Menu([], False, [('z', SOURCE)], False)
    Menus(SimpleNamespace(), lambda _name: None, set(), Selection(shows_all=False)).add(server, 'thing', menu)
    assert not any(entry.title.startswith(HEADING) for entry in server.marker.menu_entries)


def test_a_handle_in_a_frame_apart_is_left_out_with_its_notes(shown):
    shown.apart = {'world'}
    assert shown.sends() == []
    shown.has_other_frames = True
    assert shown.sends() == [('erase', 'thing')]
    shown.scene.say(shown.scene.handle('thing'), 'a text')
    assert shown.sends() == []
    shown.apart = set()
    assert shown.sends() == [('insert', 'thing')]
