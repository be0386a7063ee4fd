"""Changes of a node's locations: at once, or as its part of a two-phase commit."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from rosslt.srv import ChangeSourcesRequest

from rosslt.node.change import commit_participant
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.external import ExternalLocation
from support.hostile_requests import owner as owner_of_four

SITE = CallSite('participant.py', 1, 1, '', 0, 1)


@pytest.fixture
def owner(monkeypatch):
    monkeypatch.setattr(rospy.rostime, '_rostime_initialized', True)
    return owner_of_four()


def added(owner, location):
    owner.locations.add(location)
    return location


def ids(owner, *names):
    return [next(one.id for one in owner.locations.by_id.values() if one.name == name) for name in names]


def change(owner, values, **request):
    return owner.change_sources(
        ChangeSourcesRequest(location_ids=ids(owner, *values), values=list(values.values()), **request)
    )


def value(owner, name):
    return owner.locations.by_id[ids(owner, name)[0]].value


def test_a_change_is_applied_at_once_and_taken_back_without_locations(owner):
    answer = change(owner, {'gain': '2.5', 'count': '4'}, requester='/hand')
    assert (answer.state, answer.reasons) == ('applied', ['', ''])
    assert [(one.old_value, one.new_value, one.requester) for one in answer.changes] == [
        ('1.0', '2.5', '/hand'),
        ('3', '4', '/hand'),
    ]
    assert owner.change_sources(ChangeSourcesRequest(undo=True)).state == 'applied'
    assert (value(owner, 'gain'), value(owner, 'count')) == (1.0, 3)
    assert owner.change_sources(ChangeSourcesRequest(undo=True)).reasons == ['there is no change to take back']


def test_a_request_without_locations_changes_nothing_and_takes_nothing_back(owner):
    change(owner, {'gain': '2.5'})
    with pytest.raises(rospy.ServiceException, match='no location to change'):
        owner.change_sources(ChangeSourcesRequest())
    assert value(owner, 'gain') == 2.5


def test_a_location_that_is_given_twice_is_not_changed(owner):
    twice = ChangeSourcesRequest(location_ids=ids(owner, 'gain', 'gain'), values=['2.5', '3.5'])
    with pytest.raises(rospy.ServiceException, match='one location is given several values'):
        owner.change_sources(twice)
    assert value(owner, 'gain') == 1.0


def test_where_one_location_refuses_none_changes(owner):
    answer = change(owner, {'gain': '2.5', 'count': '101', 'fixed': '6.0'})
    assert (answer.state, answer.changes) == ('refused', [])
    assert answer.reasons == ['', '101 is above its maximum 100', 'fixed is read-only']
    assert value(owner, 'gain') == 1.0


def test_where_a_setter_refuses_what_was_put_is_put_back(owner):
    def refuse(_value):
        raise ValueError('hot')

    pump = [3.0]
    added(owner, ExternalLocation('pump', 'pump', SITE, 3.0, lambda: pump[-1], pump.append)).name_node('/owner')
    added(owner, ExternalLocation('motor', 'motor', SITE, 1.0, lambda: 1.0, refuse)).name_node('/owner')
    answer = change(owner, {'gain': '2.5', 'pump': '4.0', 'motor': '2.0'})
    assert (answer.state, answer.reasons) == ('refused', ['', '', 'ValueError: hot'])
    assert value(owner, 'gain') == 1.0
    assert pump == [3.0, 4.0, 3.0]


def test_a_refusal_says_what_a_setter_does_not_take_back(owner):
    def refuse(_value):
        raise ValueError('hot')

    def fill(level):
        if level < tank[-1]:
            raise ValueError('it has no drain')
        tank.append(level)

    tank = [3.0]
    added(owner, ExternalLocation('tank', 'tank', SITE, 3.0, lambda: tank[-1], fill)).name_node('/owner')
    added(owner, ExternalLocation('motor', 'motor', SITE, 1.0, lambda: 1.0, refuse)).name_node('/owner')
    answer = change(owner, {'tank': '4.0', 'motor': '2.0'})
    left = 'not taken back: tank = 4.0 (ValueError: it has no drain)'
    assert (answer.state, answer.reasons) == ('refused', ['', 'ValueError: hot; ' + left])
    assert tank == [3.0, 4.0]


def test_a_refusal_does_not_say_that_what_is_gone_stays_changed(owner):
    """A script that is saved anew between two of its numbers has neither any more."""
    locations = []

    def set_one(_value):
        if first.id not in owner.locations.by_id:
            raise ValueError('it is no longer in it')

    def save_anew(value):
        for location in locations:
            owner.locations.remove(location)
        set_one(value)

    for name, setter in (('first', set_one), ('second', save_anew)):
        locations.append(added(owner, ExternalLocation(name, name, SITE, 1.0, lambda: 1.0, setter)))
        locations[-1].name_node('/owner')
    first, _ = locations
    answer = change(owner, {'first': '2.0', 'second': '2.0'})
    assert (answer.state, answer.reasons) == ('refused', ['', 'ValueError: it is no longer in it'])


def test_what_is_prepared_is_committed_or_aborted_and_a_second_decision_is_ignored(owner):
    prepared = {'phase': 'prepare', 'nodes': ['/owner'], 'lease': 1.0}
    assert change(owner, {'gain': '2.5'}, transaction_id='a', **prepared).state == 'prepared'
    assert value(owner, 'gain') == 1.0
    for _ in range(2):
        committed = owner.change_sources(ChangeSourcesRequest(phase='commit', transaction_id='a'))
        assert (committed.state, committed.changes[0].new_value) == ('applied', '2.5')
    for _ in range(2):
        aborted = owner.change_sources(ChangeSourcesRequest(phase='abort', transaction_id='a'))
        assert (aborted.state, aborted.changes[0].new_value) == ('aborted', '1.0')
    assert value(owner, 'gain') == 1.0
    assert change(owner, {'gain': '3.5'}, transaction_id='b', **prepared).state == 'prepared'
    assert owner.change_sources(ChangeSourcesRequest(phase='abort', transaction_id='b')).changes == []
    assert owner.change_sources(ChangeSourcesRequest(phase='commit', transaction_id='b')).state == 'aborted'
    assert owner.change_sources(ChangeSourcesRequest(phase='state', transaction_id='c')).state == ''
    with pytest.raises(rospy.ServiceException):
        change(owner, {'gain': '4.5'}, transaction_id='b', **prepared)


def test_what_is_being_changed_is_waited_for_or_refused(owner):
    gain = owner.locations.by_id[ids(owner, 'gain')[0]]
    with owner.lock, owner._participant.hold([gain], '/hand'):
        assert change(owner, {'gain': '2.5'}).reasons == ['gain is just being changed by /hand: try again']
    assert change(owner, {'gain': '2.5'}).state == 'applied'


def test_what_was_prepared_is_refused_where_the_location_has_another_type_since(owner):
    change(owner, {'gain': '2.5'}, transaction_id='a', phase='prepare', nodes=['/owner'], lease=1.0)
    location = owner.locations.by_id[ids(owner, 'gain')[0]]
    location.type = str
    committed = owner.change_sources(ChangeSourcesRequest(phase='commit', transaction_id='a'))
    assert committed.state == 'refused'
    assert 'gain is a str, and 2.5 is not' in committed.reasons
    assert location.value == 1.0


def test_nothing_is_taken_back_from_a_location_that_somebody_is_changing(owner):
    change(owner, {'gain': '2.5'}, transaction_id='a', phase='prepare', nodes=['/owner'], lease=1.0)
    abort = ChangeSourcesRequest(phase='abort', transaction_id='a')
    assert owner.change_sources(ChangeSourcesRequest(phase='commit', transaction_id='a')).state == 'applied'
    location = owner.locations.by_id[ids(owner, 'gain')[0]]
    with owner.lock, owner._participant.hold([location], '/other'):
        answer = owner.change_sources(abort)
        assert (answer.state, answer.reasons) == ('applied', ['gain is just being changed by /other: try again'])
        assert location.value == 2.5
    assert owner.change_sources(abort).state == 'aborted'
    assert location.value == 1.0


def test_values_that_this_node_holds_are_read_once_all_setters_have_been_called(owner):
    """Others may set them while the lock is given up for a setter."""
    gain = owner.locations.by_id[ids(owner, 'gain')[0]]
    readings = [1.0]

    def set_it(value):
        readings[0] = value
        gain.put(4.0)

    added(owner, ExternalLocation('motor', 'motor', SITE, 1.0, lambda: readings[0], set_it)).name_node('/owner')
    answer = change(owner, {'gain': '2.5', 'motor': '2.0'})
    assert [(one.old_value, one.new_value) for one in answer.changes] == [('4.0', '2.5'), ('1.0', '2.0')]


def test_a_node_whose_setter_is_running_says_so_and_decides_once_it_has_returned(owner):
    held, entered, may_return = [1.0], threading.Event(), threading.Event()

    def set_slowly(value):
        entered.set()
        may_return.wait(10)
        held.append(value)

    added(owner, ExternalLocation('motor', 'motor', SITE, 1.0, lambda: held[-1], set_slowly)).name_node('/owner')
    change(owner, {'motor': '2.0'}, transaction_id='a', phase='prepare', nodes=['/owner'], lease=5.0)
    states = {}

    def ask(phase):
        states[phase] = owner.change_sources(ChangeSourcesRequest(phase=phase, transaction_id='a')).state

    commit, state, abort = (threading.Thread(target=ask, args=(one,)) for one in ('commit', 'state', 'abort'))
    commit.start()
    assert entered.wait(10)
    state.start()
    state.join(10)
    assert states == {'state': 'applying'}
    abort.start()
    may_return.set()
    commit.join(10)
    abort.join(10)
    assert (states, held) == ({'state': 'applying', 'commit': 'applied', 'abort': 'aborted'}, [1.0, 2.0, 1.0])


@pytest.mark.parametrize(('end', 'value_then'), [('applied', 2.5), ('refused', 1.0)])
def test_a_node_that_is_left_alone_waits_while_another_one_is_applying_its_part(owner, monkeypatch, end, value_then):
    answers = ['applying', 'applying', end]
    settled = threading.Event()

    def ask_all(_service, _class, requests, _timeout):
        assert list(requests) == ['/slow']
        return {'/slow': SimpleNamespace(state=answers.pop(0))}, {}

    monkeypatch.setattr(commit_participant, 'ask_all', ask_all)
    monkeypatch.setattr(commit_participant, 'GRACE', 0.0)
    monkeypatch.setattr(commit_participant, 'ASK_TIMEOUT', 0.0)
    end_of = owner._participant._end
    monkeypatch.setattr(owner._participant, '_end', lambda one: (end_of(one), settled.set()))
    change(owner, {'gain': '2.5'}, transaction_id='a', phase='prepare', nodes=['/owner', '/slow'], lease=0.001)
    assert settled.wait(10)
    with owner.lock:
        assert (answers, value(owner, 'gain')) == ([], value_then)
