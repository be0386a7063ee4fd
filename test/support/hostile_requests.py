"""Requests that no client sends: an owner answers all of them, and keeps its locations as they may be."""

import json
import math
import random
from types import SimpleNamespace
from typing import Any, Dict, List, Set, Tuple

import rospy

from rosslt import srv
from rosslt.node.change.locks import WHOLE
from rosslt.node.location_server import Owner
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import HeldLocation

TEXTS = [
    '',
    '{}',
    '[1]',
    '[' * 5000,
    '"' * 3,
    'nan',
    'NaN',
    'Infinity',
    '1e999',
    '9' * 5000,
    '\x00',
    '\ud800',
    'null',
    '-0.0',
]
NAMES = ['/owner', '', '/other', 'owner', '/a b', '/' + 'x' * 300, '\n', 'rosslt set']


def owner() -> Owner:
    """An owner of four locations that is no node: its services are called as functions."""
    made = Owner()
    made.name = '/owner'
    made._changes = SimpleNamespace(publish=lambda *_: None)  # type: ignore[assignment]
    made.parameters.write = lambda *_: 0  # type: ignore[assignment]  # nobody keeps them, and nobody waits for that
    for name, value, limits in (
        ('gain', 1.0, {'minimum': 0.0, 'maximum': 10.0}),
        ('count', 3, {'maximum': 100}),
        ('frame', 'map', {}),
        ('fixed', 5.0, {'read_only': True}),
    ):
        made.locations.add(HeldLocation(name, name, CallSite('hostile.py', 1, 1, '', 0, 1), value, **limits))
    made.locations.name_node('/owner')
    return made


def play(seed: int, count: int) -> Tuple[int, int]:
    """Send an owner requests, and check it after each.

    Returns:
        (how many requests were answered, how many were refused as a whole).

    Raises:
        AssertionError: a location has a value that it may not have, or an answer does not fit.
        Exception: whatever is not the documented rospy.ServiceException.
    """
    is_initialized = rospy.rostime.is_rostime_initialized()
    rospy.rostime.set_rostime_initialized(True)  # there is no node that would do so
    try:
        return _play(random.Random(seed), owner(), count)
    finally:
        rospy.rostime.set_rostime_initialized(is_initialized)


def _play(chance: random.Random, target: Owner, count: int) -> Tuple[int, int]:
    answered = refused = 0
    for _ in range(count):
        locked, before = _locked(target), _values(target)
        try:
            _send(chance, target)
            answered += 1
        except rospy.ServiceException:
            refused += 1
        changed = [name for name, value in _values(target).items() if value != before[name]]
        assert not locked.intersection(changed), changed
        for location in target.locations.by_id.values():
            assert location.checked(location.value) == location.value, location.name
        assert _values(target)['fixed'] == 5.0
    return answered, refused


def _values(target: Owner) -> Dict[str, Any]:
    return {location.name: location.value for location in target.locations.by_id.values()}


def _locked(target: Owner) -> Set[str]:
    """The names of the locations that nobody may change."""
    names = set(_values(target))
    return names if WHOLE in target.access.locks else names & set(target.access.locks)


def _send(chance: random.Random, target: Owner) -> None:
    ids, texts = _pairs(chance, target)
    name, request_id = chance.choice(NAMES), chance.choice(['', 'one', 'two', 'x' * 500])
    transaction = chance.choice(['', 'a', 'b', str(chance.random())])
    which = chance.randrange(9)
    if which < 6:
        lease = chance.choice([0.0, -1.0, math.nan, math.inf, 1e-9, 0.001, 0.01]) if chance.random() < 0.99 else 1e300
        nodes = chance.choice([[], ['/owner'], ['owner'], [name] * 3, ['/owner'] * 200])
        nodes = nodes if set(nodes) <= {'/owner'} or not name.startswith('/o') else ['/owner']
        undo = not ids if chance.random() < 0.9 else chance.choice([True, False])
        phase = chance.choice(['', '', 'prepare', 'prepare', 'commit', 'abort', 'state', 'both', '\x00'])
        answer = target.change_sources(
            srv.ChangeSourcesRequest(undo, request_id, name, ids, texts, phase, transaction, nodes, lease)
        )
        if phase == '':
            assert len(answer.reasons) == max(1, len(ids)) or answer.state == 'applied', answer
            assert (answer.state == 'applied') != any(answer.reasons), answer
    elif which == 6:
        answer = target.get_values(srv.GetValuesRequest(ids))
        assert len(answer.values) == len(answer.reasons) == len(ids), answer
    elif which == 7:
        target._list_locations(srv.ListLocationsRequest(location_ids=ids))
    else:
        _lock(chance, target, ids, name)


def _lock(chance: random.Random, target: Owner, ids: List[int], who: str) -> None:
    """Lock or unlock; more is unlocked than locked, as most requests should find something that they may change."""
    action = chance.choice(['lock', 'unlock', 'unlock', '', '', 'LOCK', 'lock ', 'x' * 300, '\x00'])
    if action == 'unlock' and chance.random() < 0.5:
        ids = []
    request = srv.LockLocationsRequest(action, ids, who, chance.choice(TEXTS))
    request._connection_header = {}
    before = dict(target.access.locks)
    try:
        answer = target.locking.lock_locations(request)
    except rospy.ServiceException:
        assert target.access.locks == before, 'refused, and done in part'
        raise
    assert len(answer.locked_ids) == len(answer.locked_by) == len(answer.reasons) == len(target.access.locks), answer


def _pairs(chance: random.Random, target: Owner) -> Tuple[List[int], List[str]]:
    known = list(target.locations.by_id)
    strange = [0, -1, 2**62, chance.getrandbits(48)]
    ids = chance.choices([*known, *known, *strange], k=chance.choice([0, 1, 1, 2, 5]))
    texts = [_a_text(chance) for _ in ids]
    if chance.random() < 0.1:
        texts.append('1')
    if chance.random() < 0.02:
        ids, texts = ids * 1000, texts * 1000
    return ids, texts


def _a_text(chance: random.Random) -> str:
    value: Any = chance.choice([1.5, -3, 10.0, 7, True, 'base', 1e308, 2**70, 11.0])
    return chance.choice([chance.choice(TEXTS), json.dumps(value), json.dumps(value), json.dumps(value)])
