"""Every tracked node is a dynamic_reconfigure server: shown with dynamic_reconfigure's own client and `dynparam`."""

import json
import signal
import subprocess
import sys

import pytest
import rosgraph

from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import HeldLocation
from rosslt.node.reconfigure import configuration
from support.processes import Node, wait_until

OWNER = """
    rosslt.location(2.0, name='gain', minimum=0.5, maximum=10.0)
    rosslt.location(3, name='count', minimum=0)
    rosslt.location('world', name='frame')
    rosslt.location(True, name='is_on')
    rosslt.location(1.0, name='fixed', read_only=True)
    rosslt.location(7.0, name='state')
    rosslt.get_param('~speed', 0.5)
    for line in sys.stdin:
        exec(line)
    rospy.spin()
    """

#: A program with dynamic_reconfigure's own client: does what each line of its input says, and prints the result.
CLIENT = """
import json, sys
import rospy
from dynamic_reconfigure.client import Client

rospy.init_node('client')
client = Client('/owner/rosslt', timeout=20)
described = client.get_parameter_descriptions(timeout=20)
client.get_configuration(timeout=20)
for line in sys.stdin:
    try:
        print(json.dumps(eval(line)), flush=True)
    except Exception as error:
        print(json.dumps(f'{type(error).__name__}: {error}, {error.__context__}'), flush=True)
"""


class Client:
    """dynamic_reconfigure's client in a process of its own."""

    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, '-W', 'ignore', '-c', CLIENT],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def does(self, expression):
        self.process.stdin.write(expression + '\n')
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def value(self, name):
        return self.does(f'client.config[{name!r}]')

    def close(self):
        self.process.send_signal(signal.SIGINT)
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait(60)


@pytest.fixture
def owner(master):
    with Node('owner', OWNER) as node:
        wait_until(lambda: '/owner/~speed' in rosslt('list', '/owner'), 'all locations are there')
        yield node


@pytest.fixture
def client(owner):
    started = Client()
    wait_until(lambda: 'frame' in started.does('client.config'), 'the client has heard of the node')
    yield started
    started.close()


def rosslt(*words):
    return subprocess.run(['rosslt', *words], stdout=subprocess.PIPE, text=True, check=False, timeout=60).stdout


def dynparam(*words):
    done = subprocess.run(
        ['rosrun', 'dynamic_reconfigure', 'dynparam', *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=60,
    )
    return done.stdout


@pytest.mark.rostest
def test_a_client_reads_types_bounds_defaults_and_places(client):
    described = {one['name']: one for one in client.does('client.get_parameter_descriptions()')}
    assert {name: one['type'] for name, one in described.items()} == {
        'gain': 'double',
        'count': 'int',
        'frame': 'str',
        'is_on': 'bool',
        'fixed': 'double',
        'state_': 'double',
        '/owner/speed': 'double',
    }
    assert (described['gain']['min'], described['gain']['max'], described['gain']['default']) == (0.5, 10.0, 2.0)
    assert (described['count']['min'], described['count']['max']) == (0, 2**31 - 1)
    assert (described['state_']['min'], described['state_']['max']) == (float('-inf'), float('inf'))
    assert described['gain']['description'].startswith('owner.py:')
    assert described['fixed']['description'].endswith(', read-only')
    groups = client.does('client.get_group_descriptions()')['groups']
    assert [(name, len(group['parameters'])) for name, group in groups.items()] == [('owner.py', 7)]
    assert client.value('frame') == 'world'


@pytest.mark.rostest
def test_a_client_changes_values_that_the_node_knows_who_changed_and_takes_back(client):
    answer = client.does("client.update_configuration({'gain': 4.0, 'count': 5, 'frame': 'map', 'is_on': False})")
    assert (answer['gain'], answer['count'], answer['frame'], answer['is_on']) == (4.0, 5, 'map', False)
    assert rosgraph.Master('/test').getParam('/owner/rosslt/gain') == 4.0
    assert rosslt('log', '/owner').count('/client') == 4
    rosslt('undo', '/owner')
    wait_until(lambda: client.value('gain') == 2.0, 'the client sees what was taken back')
    assert (client.value('count'), client.value('frame'), client.value('is_on')) == (3, 'world', True)


@pytest.mark.rostest
def test_a_slider_that_is_dragged_is_one_change(client):
    client.does("[client.update_configuration({'gain': 2.0 + step / 10}) for step in range(1, 6)][-1]['gain']")
    rosslt('undo', '/owner')
    wait_until(lambda: client.value('gain') == 2.0, 'all steps are taken back together')


@pytest.mark.rostest
@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'gain': 12.0, 'count': 4}, '12.0 is above its maximum 10.0'),
        ({'count': 4, 'fixed': 2.0}, 'fixed is read-only'),
        ({'gain': 'nan', 'count': 4}, 'not a finite number'),
    ],
)
def test_a_refusal_says_why_and_changes_nothing(client, changes, reason):
    refused = client.does(f'client.update_configuration({changes!r})')
    assert refused.startswith('DynamicReconfigureCallbackException')
    assert reason in refused
    assert client.does("client.update_configuration({'is_on': False})")['count'] == 3
    assert rosgraph.Master('/test').getParam('/owner/rosslt/gain') == 2.0


@pytest.mark.rostest
def test_a_client_is_told_what_is_in_force_when_it_is_refused(client):
    client.does("setattr(client, 'config', None) or client.update_configuration({'gain': 12.0})")
    assert wait_until(lambda: client.does('client.config'), 'the values are published again')['gain'] == 2.0


@pytest.mark.rostest
def test_a_client_follows_changes_of_others_and_locations_that_appear(client, owner):
    rosslt('set', '/owner/gain', '3.0')
    wait_until(lambda: client.value('gain') == 3.0, 'a change by another one is seen')
    owner.process.stdin.write("rosslt.location(9.0, name='late', maximum=20.0)\n")
    owner.process.stdin.flush()
    wait_until(lambda: client.does("client.config.get('late')") == 9.0, 'the new location is seen')

    def described():
        return {one['name']: one for one in client.does('client.get_parameter_descriptions()')}

    wait_until(lambda: 'late' in described(), 'its description follows')
    assert described()['late']['max'] == 20.0
    assert client.does("client.update_configuration({'late': 8.0})['late']") == 8.0


@pytest.mark.rostest
def test_what_cannot_be_shown_is_left_out_and_everything_else_is_shown(client, owner):
    owner.process.stdin.write("rosslt.location(2**40, name='large')\n")
    owner.process.stdin.write("rosslt.location(5, name='small'); broken = []\n")
    owner.process.stdin.write("rosslt.location(getter=lambda: '\\ud800' if broken else 'even', name='odd')\n")
    owner.process.stdin.write("rosslt.location(getter=lambda: 1 / 0 if broken else 1.0, name='read')\n")
    owner.process.stdin.write('broken.append(True)\n')
    owner.process.stdin.write("rosslt.location(6, name='last')\n")
    owner.process.stdin.flush()
    wait_until(lambda: client.does("client.config.get('last')") == 6, 'new locations are seen')
    assert client.value('small') == 5
    assert not {'large', 'odd', 'read'} & set(client.does('list(client.config)'))


@pytest.mark.slow
@pytest.mark.rostest
def test_dynparam_lists_gets_sets_dumps_and_loads(owner, tmp_path):
    assert dynparam('list').split() == ['/owner/rosslt']
    assert "'gain': 2.0" in dynparam('get', '/owner/rosslt')
    kept = str(tmp_path / 'kept.yaml')
    dynparam('dump', '/owner/rosslt', kept)
    assert dynparam('set', '/owner/rosslt', 'gain', '4.5') == ''
    assert dynparam('set', '/owner/rosslt', '{/owner/speed: 1.5, is_on: false}') == ''
    parameters = rosgraph.Master('/test')
    assert parameters.getParam('/owner/rosslt/gain') == 4.5
    assert parameters.getParam('/owner/speed') == 1.5
    assert '20.0 is above its maximum 10.0' in dynparam('set', '/owner/rosslt', 'gain', '20')
    assert "don't know parameter: nothing" in dynparam('set', '/owner/rosslt', 'nothing', '20')
    assert dynparam('load', '/owner/rosslt', kept) == ''
    assert [parameters.getParam('/owner/rosslt/gain'), parameters.getParam('/owner/speed')] == [2.0, 0.5]
    assert parameters.getParam('/owner/rosslt/is_on') is True


@pytest.mark.rostest
def test_a_node_without_dynamic_reconfigure_works_as_before(master):
    hidden = """
        import importlib.abc

        class Hidden(importlib.abc.MetaPathFinder):
            def find_spec(self, name, path=None, target=None):
                if name.split('.')[0] == 'dynamic_reconfigure':
                    raise ModuleNotFoundError('No module named ' + name, name=name)

        sys.meta_path.insert(0, Hidden())
        rosslt.init_node('owner')
        """
    with Node('owner', hidden + OWNER.replace('\n    ', '\n        '), calls_init_node=True):
        assert 'gain' in wait_until(lambda: rosslt('list', '/owner'), 'its locations are there')
        assert dynparam('list').strip() == ''
        rosslt('set', '/owner/gain', '3.0')
        assert rosgraph.Master('/test').getParam('/owner/rosslt/gain') == 3.0


def held(name, value, file='/a/node.py', line=1, **limits):
    return HeldLocation(name, name, CallSite(file, line, 1, 'text'), value, **limits)


def test_files_of_one_name_are_one_group_and_reserved_names_are_left_to_dynamic_reconfigure():
    made = configuration.Configuration(
        [
            held('a', 1.0, '/x/one/node.py'),
            held('b', 1.0, '/x/two/node.py'),
            held('groups', 1.0, '/x/other.py'),
        ]
    )
    described = made.descriptions()
    assert [group.name for group in described.groups] == ['Default', 'node.py', 'other.py']
    assert {one.name for one in made.values().doubles} == {'a', 'b', 'groups_'}


def test_bounds_of_an_int_are_ints_that_its_message_can_hold():
    wide = held('wide', 3, minimum=-(2**50), maximum=2**50)
    made = configuration.Configuration([held('n', 3, minimum=0.5, maximum=10.5), wide])
    described = made.descriptions()
    assert [(one.name, one.value) for one in described.min.ints] == [('n', 1), ('wide', -(2**31))]
    assert [(one.name, one.value) for one in described.max.ints] == [('n', 10), ('wide', 2**31 - 1)]
