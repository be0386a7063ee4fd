"""The closed loop with a node that is a function: solve, change, look at what comes, and what is said of it."""

import math
import time

import pytest
from move_base_msgs.msg import MoveBaseActionGoal
from std_msgs.msg import Float64

from rosslt import node, values
from rosslt.node.change import change_request
from rosslt.node.topics.listening import Heard

GAIN, BIAS = values.Source('/owner', 1), values.Source('/owner', 2)
NAMES = {GAIN: '/owner/gain', BIAS: '/owner/bias'}


class NoErrors:
    raised = ''

    def raised_since(self, nodes, since):
        return self.raised


class Simulated:
    """A node that publishes a function of two sources and the number of the message; it is its own directory."""

    def __init__(self, function, monkeypatch, **present):
        self.present = {GAIN: present.get('gain', 1.0), BIAS: present.get('bias', 0.0)}
        self.function, self.tick, self.requests = function, 0, []
        self.message, self.path = Float64, 'data'
        self.publisher, self.is_latched = '/node', False
        self.name, self.directory = '/hand', self
        self.errors, self.late = NoErrors(), {}
        monkeypatch.setattr(change_request, 'request_values', self.request_values)
        monkeypatch.setattr(change_request, 'undo_request', self.undo_request)
        monkeypatch.setattr(change_request, 'reevaluate', lambda x, timeout, asker: values.reapply(x, self.present))
        self.began = dict(self.present)

    def limits(self, sources, timeout):
        return {'bounds': {}, 'read_only': []}

    def name_of(self, source):
        return NAMES[source]

    def request_values(self, wanted, timeout, request_id, asker):
        if asker is None:  # a hand that another test has left
            return {}
        self.requests.append(wanted)
        changed = {source: node.Change(self.present[source], new) for source, new in wanted.items()}
        self.present.update(wanted)
        return changed

    def undo_request(self, request_id, nodes, requester, timeout):
        self.present.update(self.began)
        return node.Undone({}, {})

    def next_before(self, end):
        self.tick += 1
        sources = [values.track(self.present[source], source) for source in (GAIN, BIAS)]
        value = self.function(*sources, self.tick)
        if value is None:
            time.sleep(0.01)
            return None
        message = self.message(value)
        return Heard('/topic', self.publisher, message._type, message, self.is_latched)

    def clear(self):
        pass

    def force(self, wanted, **options):
        asker = type('Asker', (), {'name': '/hand', 'directory': self})()
        asker.directory = type(
            'Names',
            (),
            {
                'limits': self.limits,
                'learn': lambda _, sources, timeout: None,
                'held': lambda _, thing, shared: [],
                'own_first': lambda _, sources: list(sources),
                'name': staticmethod(self.name_of),
                'at_next_start': staticmethod(lambda source: self.late.get(source, '')),
            },
        )()
        return node.Forcing(asker, self, self.errors, self.path, wanted, **options).run(self.next_before(0.0))


@pytest.fixture
def simulated(monkeypatch):
    return lambda function, **present: Simulated(function, monkeypatch, **present)


def test_another_branch_is_solved_in_turn(simulated):
    made = simulated(lambda gain, bias, tick: 2 * gain if gain < 5 else 3 * gain)
    outcome = made.force(18.0)
    assert (outcome.seen, outcome.rounds) == (18.0, 2)
    assert made.present[GAIN] == 6.0


def test_what_settles_stands_still_and_what_moves_is_refused(simulated):
    """What a command that is almost 0 moves by is measured by its way to the target, not by its size."""
    settles = simulated(lambda gain, bias, tick: bias + 5e-11 * tick)
    assert settles.force(0.5).is_reached
    assert settles.present[BIAS] == pytest.approx(0.5)
    moves = simulated(lambda gain, bias, tick: bias + 1e-5 * tick)
    with pytest.raises(values.NotInvertible, match='it changes by itself'):
        moves.force(0.5)


def test_what_takes_effect_at_the_next_start_is_not_waited_for(simulated):
    made = simulated(lambda gain, bias, tick: gain + 0.0)
    made.late[GAIN] = 'takes effect at the next start'
    with pytest.raises(
        values.NotInvertible, match='a change of /owner/gain takes effect at the next start; no message'
    ):
        made.force(3.0, timeout=0.2)
    assert made.requests == []
    assert made.force(3.0, keep_anyway=True).is_reached


def goal(z):
    made = MoveBaseActionGoal()
    made.goal.target_pose.pose.position.z = z
    return made


@pytest.fixture
def patrol(simulated):
    """A node that sends two goals in turn."""
    made = simulated(lambda gain, bias, tick: 1.0 * gain if tick % 2 else 1.0 * bias)
    made.message, made.path = goal, 'goal/target_pose/pose/position/z'
    return made


def test_of_several_goals_that_are_sent_in_turn_one_is_changed(patrol):
    outcome = patrol.force(3.0)
    assert (outcome.seen, outcome.rounds) == (3.0, 1)
    assert patrol.present == {GAIN: 3.0, BIAS: 0.0}


def test_goals_of_other_sources_are_named_where_the_changed_one_is_not_sent_again(patrol):
    patrol.function = lambda gain, bias, tick: 1.0 * gain if tick == 1 else time.sleep(0.01) or 1.0 * bias
    with pytest.raises(
        node.NotReached,
        match=r'^no message of /node that was computed from /owner/gain came within 0\.2 s; '
        r'/node now sends 0\.0 instead of 3\.0; it comes from /owner/bias now; taken back$',
    ):
        patrol.force(3.0, timeout=0.2)
    assert patrol.present == patrol.began


def test_it_is_solved_five_times_at_most(simulated):
    made = simulated(lambda gain, bias, tick: gain + 10.0 * math.sin(float(gain)))
    with pytest.raises(node.NotReached, match='taken back'):
        made.force(100.0)
    assert len(made.requests) == 5
    assert made.present == made.began


def test_what_came_instead_is_said_with_the_branches(simulated):
    made = simulated(lambda gain, bias, tick: 2 * gain if gain < 5 else 3 * gain)
    with pytest.raises(node.NotReached) as caught:
        made.force(12.0)
    assert str(caught.value) == (
        '/node now sends 18.0 instead of 12.0; it is not computed as its provenance said before the change; taken back'
    )


def test_what_is_clamped_after_a_message_or_two_is_not_reached(simulated):
    """The owner takes the value, and its server of parameters clamps it a little later."""
    made, since = None, []

    def clamping(gain, bias, tick):
        if gain > 5.0:
            since.append(tick)
            if len(since) == 2:
                made.present[GAIN] = 5.0
        return 1.0 * gain

    made = simulated(clamping, gain=5.0)
    with pytest.raises(node.NotReached, match=r'^/owner/gain is 5\.0 by now, it was made 9\.0; taken back$'):
        made.force(9.0)
    assert made.present == made.began


@pytest.mark.parametrize(
    ('function', 'named'),
    [
        (
            lambda gain, bias, tick: 5 * gain + bias + 0.1 * tick if tick % 2 else 4 * gain * gain + bias - tick,
            '/owner/gain, /owner/bias',
        ),
        (lambda gain, bias, tick: gain + float(tick), '/owner/gain'),
    ],
)
def test_a_field_that_changes_by_itself_is_refused(simulated, function, named):
    made = simulated(function)
    with pytest.raises(values.NotInvertible, match=rf'^it changes by itself: .* it is moved most by {named}$'):
        made.force(40.0, timeout=0.1)
    assert made.requests == []


def test_of_two_sources_the_one_that_moves_it_more_is_changed(simulated):
    """As the error and the gain of a controller at rest."""
    made = simulated(lambda gain, bias, tick: gain * bias, gain=1.2, bias=0.005)
    assert made.force(1.2).seen == 1.2
    assert made.present == {GAIN: 1.2, BIAS: 1.0}


def test_what_moves_since_the_change_is_not_run_after(simulated):
    """A robot that goes on as long as its command is not 0."""
    made = simulated(lambda gain, bias, tick: gain - made.place)
    made.place = 1.0

    def next_before(end, heard=made.next_before):
        made.place += 0.05 * (made.present[GAIN] - made.place)
        return heard(end)

    made.next_before = next_before
    with pytest.raises(node.NotReached, match=r'; it stood still before the change, and moves since; taken back$'):
        made.force(0.5)
    assert len(made.requests) == 1
    assert made.present == made.began


def test_a_field_that_stood_still_and_moves_since_the_change_is_not_reached(simulated):
    """As one that a node runs after: the change has made it move, and it goes on."""
    made = simulated(lambda gain, bias, tick: 1.0 * gain if gain == 1.0 else gain + float(tick))
    with pytest.raises(node.NotReached, match=r'; it stood still before the change, and moves since; taken back$'):
        made.force(-100.0)
    assert made.present == made.began


def test_what_has_not_followed_is_said_to_have_not(simulated):
    made = simulated(lambda gain, bias, tick: gain if gain < 2 else 0.0 * gain + 1.0)
    with pytest.raises(node.NotReached, match=r'sends 1\.0 instead of 7\.0; it has not followed the change; '):
        made.force(7.0)


def test_a_field_that_comes_from_other_numbers_is_not_forced_by_these(simulated):
    """A patrol that has gone on to its next waypoint."""
    made = simulated(lambda gain, bias, tick: gain if gain < 2 else bias + 1.0)
    with pytest.raises(
        node.NotReached, match=r'sends 1\.0 instead of 7\.0; it comes from /owner/bias now; taken back$'
    ):
        made.force(7.0, timeout=0.2)
    assert [list(request) for request in made.requests] == [[GAIN]]
    assert made.present == made.began


def test_a_number_that_the_next_target_shares_is_changed_once(simulated):
    made = simulated(lambda gain, bias, tick: bias + gain if gain < 2 else 1.0 + gain)
    with pytest.raises(node.NotReached, match=r'; it comes from /owner/gain now; taken back$'):
        made.force(7.0, sources=[GAIN], timeout=0.2)
    assert [list(request) for request in made.requests] == [[GAIN]]
    assert made.present == made.began


def test_what_an_iteration_comes_to_is_reached_but_for_its_last_digits(simulated):
    made = simulated(lambda gain, bias, tick: gain * gain * (1.0 + 6e-9 * math.sin(1e9 * float(gain))))
    outcome = made.force(7.0)
    assert outcome.is_reached
    assert outcome.is_near
    assert outcome.seen == pytest.approx(7.0, rel=1e-8)


def test_a_change_that_makes_the_node_raise_is_taken_back_at_once(simulated):
    made = simulated(lambda gain, bias, tick: gain if gain < 5 else None)
    made.errors.raised = '/node raises IndexError: list index out of range'
    with pytest.raises(node.NotReached, match=r'^/node raises IndexError: list index out of range; taken back$'):
        made.force(9.0, timeout=3600.0)  # longer than a test has
    assert made.present == made.began


@pytest.mark.parametrize(('publisher', 'is_latched'), [('/owner', True), ('/owner', False), ('/node', True)])
def test_a_change_stays_if_its_node_has_latched_a_message(simulated, publisher, is_latched):
    made = simulated(lambda gain, bias, tick: gain if gain < 5 else None)
    made.publisher, made.is_latched = publisher, is_latched
    if publisher == '/owner' and is_latched:
        outcome = made.force(9.0, timeout=0.1)
        assert not outcome.is_reached
        assert (outcome.seen, outcome.is_taken_back, outcome.changes) == (None, False, {GAIN: (1.0, 9.0)})
        assert outcome.reason.endswith(
            'the change is in force, and shows in the next message that is made of /owner/gain'
        )
        assert made.present[GAIN] == 9.0
    else:
        with pytest.raises(node.NotReached, match=rf'^no message of {publisher} came within 0\.1 s; taken back$'):
            made.force(9.0, timeout=0.1)
        assert made.present == made.began


def test_a_latched_message_does_not_excuse_an_exception(simulated):
    made = simulated(lambda gain, bias, tick: gain if gain < 5 else None)
    made.publisher, made.is_latched, made.errors.raised = '/owner', True, '/owner raises IndexError: no such leg'
    with pytest.raises(node.NotReached, match=r'^/owner raises IndexError: no such leg; taken back$'):
        made.force(9.0, timeout=3600.0)
    assert made.present == made.began


def test_where_no_message_follows_it_is_said(simulated):
    made = simulated(lambda gain, bias, tick: gain if gain < 5 else None)
    with pytest.raises(node.NotReached, match=r'^no message of /node came within 0\.1 s; taken back$'):
        made.force(9.0, timeout=0.1)
