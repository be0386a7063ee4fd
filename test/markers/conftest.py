"""Owners of sources that take every change."""

import pytest

from rosslt import node
from rosslt.node.change import change_request


@pytest.fixture
def present():
    """What the owners of sources have, as far as a test says so: {Source: value}."""
    return {}


@pytest.fixture
def asked(monkeypatch, present):
    """The requests to owners, who make every change: [{Source: new value}]."""
    result, ids = [], []

    def note_id():
        ids.append(node.new_request_id())
        return ids[-1]

    def request_values(wanted, _timeout, request_id, _asker):
        if request_id in ids:  # and not of a drag that another test has left
            result.append(wanted)
        changes = {source: node.Change(present.get(source), new) for source, new in wanted.items()}
        present.update(wanted)
        return changes

    monkeypatch.setattr(change_request, 'new_request_id', note_id)
    monkeypatch.setattr(change_request, 'request_values', request_values)
    monkeypatch.setattr(change_request, 'outdated_after', lambda request_id, nodes, timeout: '')
    monkeypatch.setattr(node, 'limits', lambda sources, timeout: {'bounds': {}, 'read_only': []})
    monkeypatch.setattr(node, 'reevaluate', lambda x, timeout: x)
    monkeypatch.setattr(change_request, 'reevaluate', lambda x, timeout, asker: x)
    return result
