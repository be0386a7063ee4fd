"""Parameters of any kind in the place of those of a node: it lives on, and its locations stay within their limits."""

import json
import random
import xmlrpc.client

import pytest

from rosslt.node.change.locks import ACCEPT_FROM, Access
from rosslt.node.json_scalars import Refused
from support.processes import Node, wait_until
from support.shell import rosslt

OWNER = """
    rosslt.location(1.0, name='gain', minimum=0.0, maximum=10.0)
    rosslt.location(3, name='count', maximum=100)
    rosslt.location('map', name='frame')
    rosslt.location(True, name='on')
    rosslt.location({'a': 1.0, 'b': [1, 2.0]}, name='tree')
    rosslt.get_param('~own', {'p': 1.0, 'q': [1, 2]})
    rospy.spin()
    """


def nested(depth, leaf, wrap):
    for _ in range(depth):
        leaf = wrap(leaf)
    return leaf


VALUES = [
    *(
        2.0,
        2,
        'text',
        '',
        True,
        -1.0,
        1e308,
        float('nan'),
        float('inf'),
        2**31 - 1,
        -(2**31),
        'nan',
        'gr\u00fcn',
        'a\tb',
    ),
    *(
        [],
        {},
        [1, 2],
        [[[]]],
        {'a': 1},
        {'': 1},
        {'a/b': 1},
        {'gain': 5.0},
        {'gain': {'x': 1}},
        {'change_locks': [1, 2]},
    ),
    *(xmlrpc.client.Binary(b'\xff\0'), xmlrpc.client.DateTime(0), 'x' * 200000, [1] * 20000),
    {str(number): number for number in range(2000)},
    nested(50, 1.0, lambda leaf: {'k': leaf}),
    nested(50, 1.0, lambda leaf: [leaf]),
]

KEYS = [
    *('rosslt/gain', 'rosslt/count', 'rosslt/frame', 'rosslt/on', 'rosslt/tree', 'rosslt/tree/a', 'rosslt/tree/b'),
    *('rosslt', 'rosslt/history', 'rosslt/accept_changes_from', 'rosslt/change_locks'),
    *('rosslt/gain/x', 'rosslt/unknown', 'rosslt_records', 'rosslt_records/gain', 'own', 'own/p', 'own/q'),
]


@pytest.mark.rostest
@pytest.mark.slow
@pytest.mark.parametrize('seed', [1, 2])
def test_a_node_lives_on_whatever_stands_in_the_place_of_its_parameters(master, seed):
    chance = random.Random(seed)
    server = xmlrpc.client.ServerProxy(master.uri)
    with Node('owner', OWNER) as owner:
        for _ in range(300):
            key = '/owner/' + chance.choice(KEYS)
            if chance.random() < 0.1:
                server.deleteParam('/hunter', key)
            else:
                server.setParam('/hunter', key, chance.choice(VALUES))
        listed = rosslt('list', '/owner')
        assert listed.returncode == 0, listed.stderr
        assert '/owner/gain\tfloat\t' in listed.stdout
        owner.stop(9)
        owner.start()  # with what was left there
        for key in ('rosslt', 'rosslt_records', 'own'):
            server.deleteParam('/hunter', '/owner/' + key)
        wait_until(lambda: rosslt('set', '/owner/gain', '7').returncode == 0, 'its locations can be changed again')
        # a parameter is still followed
        server.setParam('/hunter', '/owner/rosslt/gain', 4.0)
        wait_until(lambda: rosslt('get', '/owner/gain').stdout == '4.0\n', 'rosparam set takes effect')
        assert 'Traceback' not in owner.logged()


@pytest.mark.rostest
def test_settings_that_are_deleted_with_all_parameters_of_a_node_hold_no_longer(master):
    server = xmlrpc.client.ServerProxy(master.uri)
    with Node('owner', OWNER):
        server.setParam('/hunter', '/owner/rosslt/accept_changes_from', ['/nobody'])
        wait_until(lambda: rosslt('set', '/owner/gain', '7').returncode == 1, 'it refuses')
        server.deleteParam('/hunter', '/owner/rosslt')
        wait_until(lambda: rosslt('set', '/owner/gain', '7').returncode == 0, 'it accepts')


@pytest.mark.rostest
@pytest.mark.parametrize('text', ['a\x01b', '\ufffe'], ids=['control', 'none'])
def test_a_text_that_no_parameter_can_hold_is_shown_as_json_and_outlives_a_restart(master, text):
    with Node('owner', OWNER) as owner:
        wait_until(lambda: rosslt('set', '/owner/frame', text).returncode == 0, 'it is there')
        assert rosslt('get', '/owner/frame').stdout == text + '\n'
        assert rosslt('set', '/owner/gain', '7').returncode == 0
        server = xmlrpc.client.ServerProxy(master.uri)
        wait_until(lambda: server.getParam('/test', '/owner/rosslt/gain')[2] == 7.0, 'the other is shown')
        assert server.getParam('/test', '/owner/rosslt/frame')[2] == json.dumps(text)
        owner.stop(9)
        owner.start()
        wait_until(lambda: rosslt('get', '/owner/frame').stdout == text + '\n', 'it is remembered')


def test_who_asks_while_a_setting_is_refused_is_refused_as_well(monkeypatch):
    access, refused = Access(), []

    def ask(*_):
        with pytest.raises(Refused):
            access.check('gain', '/somebody')
        refused.append('/somebody')

    monkeypatch.setattr('rosslt.node.change.locks.rospy.logerr', ask)
    access.set(ACCEPT_FROM, 1.0)
    assert refused
