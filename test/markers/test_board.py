"""What the board sends, and what it leaves alone."""

import pytest

from rosslt.markers import board as boards
from rosslt.markers.geometry import IDENTITY


class Thing:
    """A handle that draws itself as its own name."""

    def __init__(self, x=0.0, look='red', name='thing'):
        self.name, self.look, self.pose = name, look, (x, 0.0, 0.0, *IDENTITY)

    def draw(self, _can_move):
        return self.name


class Sent:
    """A server that notes what is asked of it."""

    def __init__(self):
        self.calls = []

    def insert(self, marker, _feedback):
        self.calls.append(('insert', marker))

    def setPose(self, name, pose):  # noqa: N802
        self.calls.append(('pose', name, pose.position.x))

    def erase(self, name):
        self.calls.append(('erase', name))

    def applyChanges(self):  # noqa: N802
        self.calls.append('apply')


@pytest.fixture
def sent():
    return Sent()


@pytest.fixture
def board(sent):
    result = boards.Board(sent)
    result.connect(None, lambda _server, _handle: None, None)
    result.put(Thing())
    result.apply()
    assert sent.calls == [('insert', 'thing'), 'apply']
    del sent.calls[:]
    return result


def test_nothing_is_sent_where_nothing_changes(board, sent):
    board.put(Thing())
    board.apply()
    assert sent.calls == []


def test_a_new_pose_is_sent_as_a_pose(board, sent):
    board.put(Thing(1.0))
    board.apply()
    assert sent.calls == [('pose', 'thing', 1.0), 'apply']


def test_a_new_look_is_inserted(board, sent):
    board.put(Thing(look='blue'))
    board.apply()
    assert sent.calls == [('insert', 'thing'), 'apply']


def test_what_goes_and_comes_back_between_two_frames_is_not_sent(board, sent):
    board.drop('thing')
    board.put(Thing())
    board.apply()
    assert ('erase', 'thing') not in sent.calls
    assert ('insert', 'thing') not in sent.calls


def test_what_a_hand_holds_is_left_alone(board, sent):
    board.hold('thing')
    board.put(Thing(1.0, look='blue'))
    board.apply()
    board.drop('thing')
    board.apply()
    assert [call for call in sent.calls if call != 'apply'] == []
    board.let_go('thing', Thing(1.0).pose, is_followed=False)
    board.apply()
    assert ('erase', 'thing') in sent.calls


def test_a_marker_waits_where_it_was_let_go_until_a_message_says_so_too(board, sent):
    board.hold('thing')
    board.let_go('thing', Thing(2.0).pose, is_followed=True)
    board.put(Thing(1.0))
    board.apply()
    assert not any('thing' in call for call in sent.calls), 'that message was older than the drag'
    board.put(Thing(2.0))
    board.apply()
    assert ('pose', 'thing', 2.0) in sent.calls
    board.put(Thing(3.0))
    board.apply()
    assert ('pose', 'thing', 3.0) in sent.calls


def test_a_later_message_is_believed_whatever_it_says(board, sent, monkeypatch):
    monkeypatch.setattr(boards, 'IN_FLIGHT', 0.0)
    board.hold('thing')
    board.let_go('thing', Thing(2.0).pose, is_followed=True)
    board.put(Thing(1.0))
    board.apply()
    assert ('pose', 'thing', 1.0) in sent.calls


def test_without_a_message_it_goes_back_in_the_end(board, sent, monkeypatch):
    monkeypatch.setattr(boards, 'LONGEST_WAIT', 0.0)
    board.hold('thing')
    board.let_go('thing', Thing(2.0).pose, is_followed=True)
    board.apply()
    assert ('pose', 'thing', 0.0) in sent.calls


def test_where_sources_do_not_follow_it_goes_back_at_once(board, sent):
    board.hold('thing')
    board.let_go('thing', Thing(2.0).pose, is_followed=False)
    board.apply()
    assert ('pose', 'thing', 0.0) in sent.calls


def test_what_cannot_be_drawn_does_not_keep_others_from_being_shown(board, sent):
    class Broken(Thing):
        def draw(self, _can_move):
            raise ArithmeticError('of all things')

    board.put(Broken(name='broken'))
    board.put(Thing(name='sound'))
    board.apply()
    assert ('insert', 'sound') in sent.calls
    del sent.calls[:]
    board.apply()
    assert sent.calls == [], 'it is not tried over and over'
