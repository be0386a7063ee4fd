"""One change of many steps: what it has changed, what a message shows of it, whether it holds, and taking it back."""

import pytest

from rosslt import node, values
from rosslt.node.change import change_request
from rosslt.node.change.change_request import ChangeRequest, Shown

GAIN, BIAS = values.Source('/left', 1), values.Source('/right', 2)


class Owners:
    """Both owners, whose values are at hand."""

    def __init__(self, monkeypatch):
        self.present, self.refused, self.requested = {GAIN: 1.0, BIAS: 0}, [], []
        monkeypatch.setattr(change_request, 'request_values', self.request_values)
        monkeypatch.setattr(change_request, 'undo_request', self.undo_request)
        monkeypatch.setattr(change_request, 'reevaluate', lambda x, *_: values.reapply(x, self.present))

    def request_values(self, wanted, _timeout, request_id, _asker):
        self.requested.append(request_id)
        changed = {
            source: node.Change(self.present[source], new)
            for source, new in wanted.items()
            if source not in self.refused
        }
        self.present.update({source: change.new for source, change in changed.items()})
        if len(changed) < len(wanted):
            raise node.ChangeRejected('it is locked', dict.fromkeys(self.refused, 'it is locked'), changed)
        return changed

    def undo_request(self, request_id, nodes, requester, _timeout):
        self.undone = request_id, nodes, requester
        return node.Undone({}, {'/left': 'it is locked'} if self.refused else {})


@pytest.fixture
def owners(monkeypatch):
    return Owners(monkeypatch)


@pytest.fixture
def request_of(owners):
    """A change that has given sources these values, one step after the other."""

    def make(*steps):
        request = ChangeRequest(1.0, node.Requester('/hand', node.Directory()))
        for wanted in steps:
            request.step(wanted)
        return request

    return make


def test_all_steps_have_one_id_and_are_one_change(owners, request_of):
    request = request_of({GAIN: 2.0}, {GAIN: 3.0, BIAS: 4})
    assert owners.requested == [request.id] * 2
    assert request.changes == {GAIN: node.Change(1.0, 3.0), BIAS: node.Change(0, 4)}
    assert request.nodes == {'/left', '/right'}


def test_what_is_as_before_again_has_not_changed(request_of):
    assert request_of({GAIN: 2.0}, {GAIN: 1.0}).changes == {}


@pytest.mark.parametrize(
    ('readings', 'shown'),
    [
        ({}, Shown.NOTHING),
        ({GAIN: [3.3]}, Shown.NOTHING),
        ({GAIN: [1.0], BIAS: [4]}, Shown.OLD),
        ({GAIN: [2.0], BIAS: [4]}, Shown.OLD),
        ({GAIN: [3.299999952316284], BIAS: [4]}, Shown.NEW),  # in 32 bits
        ({GAIN: [7.0], BIAS: [4]}, Shown.OTHER),
        ({GAIN: [1.0, 2.0, 3.3], BIAS: [4]}, Shown.NEW),
        ({GAIN: [1.0, 2.0], BIAS: [4]}, Shown.OLD),
        ({GAIN: [3.3], BIAS: [0]}, Shown.OLD),
        ({GAIN: [3.3], BIAS: [9]}, Shown.OTHER),
        ({GAIN: [3.3], BIAS: [4]}, Shown.NEW),
    ],
)
def test_what_a_message_shows_of_a_change(request_of, readings, shown):
    assert request_of({GAIN: 2.0}, {GAIN: 3.3, BIAS: 4}).shown_by(readings) is shown


def test_a_value_that_a_hand_has_come_back_to_is_the_new_one(request_of):
    assert request_of({GAIN: 2.0}, {GAIN: 1.0}).shown_by({GAIN: [1.0]}) is Shown.NEW


def test_what_somebody_else_has_changed_since_is_lost(owners, request_of):
    request = request_of({GAIN: 2.0, BIAS: 4})
    assert request.lost() == {}
    owners.present[BIAS] = 5
    assert request.lost() == {BIAS: 5}


def test_what_a_node_has_kept_of_a_refused_step_belongs_to_the_change(owners, request_of):
    request = request_of({GAIN: 2.0})
    owners.refused = [BIAS]
    with pytest.raises(node.ChangeRejected):
        request.step({GAIN: 3.0, BIAS: 4})
    assert request.changes == {GAIN: node.Change(1.0, 3.0)}


def test_a_change_that_is_taken_back_has_changed_nothing(owners, request_of):
    request = request_of({GAIN: 2.0, BIAS: 4})
    assert request.take_back() == ''
    assert owners.undone == (request.id, {'/left', '/right'}, '/hand')
    assert (request.changes, request.shown_by({GAIN: [2.0]})) == ({}, Shown.NOTHING)


def test_a_node_that_has_changed_nothing_is_not_asked_to_take_it_back(owners, request_of):
    """As a setter that rounds the new value to the present one."""
    request = request_of({GAIN: 2.0, BIAS: 0})
    assert request.take_back() == ''
    assert owners.undone[1] == {'/left'}


def test_a_change_that_cannot_be_taken_back_stays_and_says_why(owners, request_of):
    request = request_of({GAIN: 2.0})
    owners.refused = [GAIN]
    assert request.take_back() == '/left: it is locked'
    assert request.changes == {GAIN: node.Change(1.0, 2.0)}
