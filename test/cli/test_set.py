"""`rosslt set` says what became of a change once the callbacks of the node were called with it, and the main program
has gone round its loop."""

from concurrent.futures import ThreadPoolExecutor
from textwrap import dedent

import pytest
import rospy
from rosslt.srv import ChangeSources, ListLocations

from support.processes import Node, wait_until
from support.shell import failure, rosslt

pytestmark = pytest.mark.rostest

SCALING = """
    import message_filters

    def scale(message):
        publisher.publish(message.data / rosslt.location(2.0, name='width') + rosslt.location(1.0, name='offset'))

    publisher = rosslt.Publisher('scaled', Float64, queue_size=1)
    reader = rosslt.Subscriber('unscaled', Float64)
    filtered = message_filters.Subscriber('unscaled', Float64)
    filtered.registerCallback(scale)
    unscaled = rosslt.Publisher('unscaled', Float64, queue_size=1)
    while not rospy.is_shutdown():
        unscaled.publish(6.0)
        rospy.sleep(0.02)
    """


def test_a_number_that_makes_a_callback_raise_is_refused(master):
    with Node('scaling', SCALING):
        wait_until(lambda: '/scaling/offset' in rosslt('list', '/scaling').stdout, 'it scales')
        told = failure('set', '/scaling/width', '0')
        assert told.startswith('rosslt set: /scaling raises ZeroDivisionError: float division by zero (scaling.py:')
        assert told.endswith('; taken back')
        assert rosslt('get', '/scaling/width').stdout == '2.0\n'
        assert rosslt('set', '/scaling/width', '3').returncode == 0
        assert rosslt('set', '/scaling/offset', '0').returncode == 0
        assert rosslt('get', '/scaling/width').stdout == '3.0\n'


DRIVING = """
    def drive(place):
        distance = goal - place.data
        if distance > 0.1:
            publisher.publish(min(top, distance / ramp['slow']))
        else:
            publisher.publish(distance)

    goal = rosslt.location(0.0, name='goal')
    top = rosslt.location(1.0, name='top')
    ramp = {'slow': rosslt.location(0.5, name='slow')}
    publisher = rosslt.Publisher('driven', Float64, queue_size=1)
    goals = rosslt.Publisher('goals', Float64, queue_size=1)
    reader = rosslt.Subscriber('places', Float64, drive)
    places = rosslt.Publisher('places', Float64, queue_size=1)
    while not rospy.is_shutdown():
        places.publish(rospy.get_param('/driving_place', 0.0))
        goals.publish(goal)
        rospy.sleep(0.02)
    """


def test_what_raises_later_names_the_change_before(master):
    with Node('driving', DRIVING) as node:
        wait_until(lambda: rosslt('echo', '-n', '1', '/driven').returncode == 0, 'it stands')
        assert rosslt('set', '/driving/slow', '0.4').returncode == 0
        assert rosslt('set', '/driving/slow', '0').returncode == 0, 'the line does not run'
        assert rosslt('set', '/driving/top', '0.8').returncode == 0
        changed = 'slow 0.4 -> 0.0 (`rosslt set /driving/slow 0.4` takes it back), '
        changed += 'top 1.0 -> 0.8 (`rosslt set /driving/top 1.0` takes it back)'
        line = node.line_of('publish(min(')
        raised = f'/driving raises ZeroDivisionError: float division by zero (driving.py:{line}, which also reads '
        raised += f'what was changed before: {changed})'
        assert failure('set', '/driving/goal', '3') == f'rosslt set: {raised}; taken back'
        assert failure('force', '/goals/data', '3') == f'rosslt force: {raised}; taken back'
        assert rosslt('get', '/driving/goal').stdout == '0.0\n'
        assert rosslt('set', '/driving/slow', '0.4').returncode == 0
        assert rosslt('set', '/driving/goal', '3').returncode == 0, 'it drives'


def test_what_raises_long_after_a_change_names_it_in_the_log(master):
    code = 'import rosslt.node.location_server as owner\nowner.SUSPECT = 0.0\n' + dedent(DRIVING)
    for word, other in (('driving', 'rolling'), ('driven', 'rolled'), ('goals', 'marks'), ('places', 'spots')):
        code = code.replace(word, other)
    with Node('rolling', code) as node:
        wait_until(lambda: rosslt('echo', '-n', '1', '/rolled').returncode == 0, 'it stands')
        assert rosslt('set', '/rolling/slow', '0').returncode == 0
        master.setParam('/rolling_place', -5.0)
        told = 'a callback of a Subscriber raises from what was changed before\nZeroDivisionError: float division by '
        told += f'zero (rolling.py:{node.line_of("publish(min(")}, which reads what was changed before: slow 0.5 '
        wait_until(lambda: told in node.logged(), node.logged)
        assert rosslt('set', '/rolling/top', '0.8').returncode == 0, 'that is not to blame'
        assert node.logged().count(told) == 1
        master.deleteParam('/rolling_place')


def test_what_a_node_takes_and_does_not_outlive_is_not_said_to_be_set(master):
    code = """
        import rosslt.node.location_server as server

        server.Owner.outcome_of = lambda owner, request_id: os._exit(3)
        rosslt.location(2.0, name='scale')
        rospy.spin()
        """
    with Node('dying', code) as node:
        wait_until(lambda: '/dying/scale' in rosslt('list', '/dying').stdout, 'it has the location')
        told = failure('set', '/dying/scale', '3')
        assert told.startswith('rosslt set: /dying has taken the change, and does not answer since: ')
        assert node.process.wait(30) == 3


HALTING = """
    scale = rosslt.location(2.0, name='scale')
    print('ready', flush=True)
    while not rospy.is_shutdown():
        rospy.sleep(0.05)
        1.0 / scale
    """


def test_a_number_that_ends_the_main_program_is_refused(master):
    with Node('halting', HALTING) as node:
        line = node.line_of('1.0 / scale')
        raised = f'/halting raises ZeroDivisionError: float division by zero (halting.py:{line}), which ends the node'
        assert node.read_line() == 'ready'
        for _ in range(2):
            assert failure('set', '/halting/scale', '0') == f'rosslt set: {raised}; taken back'
            assert node.process.wait(30) == 1
            node.start()
            assert node.read_line() == 'ready'
            assert rosslt('get', '/halting/scale').stdout == '2.0\n'


def test_two_who_change_what_ends_the_main_program_are_both_told(master):
    code = HALTING.replace('1.0 / scale', "1.0 / scale / rosslt.location(3.0, name='other')")
    with Node('stopping', code) as node, ThreadPoolExecutor(2) as pool:
        assert node.read_line() == 'ready'
        wait_until(lambda: '/stopping/other' in rosslt('list', '/stopping').stdout, 'it goes round')
        told = list(pool.map(lambda name: failure('set', '/stopping/' + name, '0'), ('scale', 'other')))
        raised = 'rosslt set: /stopping raises ZeroDivisionError: float division by zero (stopping.py:'
        assert any(one.startswith(raised) and one.endswith('; taken back') for one in told), told
        assert node.process.wait(30) == 1
        node.start()
        assert node.read_line() == 'ready'
        wait_until(lambda: rosslt('get', '/stopping/other').stdout == '3.0\n', 'it goes round with it')
        assert rosslt('get', '/stopping/scale').stdout == '2.0\n'


def test_what_is_taken_back_at_the_end_is_so_at_a_slow_master(master):
    code = """
        from rosslt.node.parameters.server import ParameterServer

        def set_slowly(server, pairs, set_now=ParameterServer.set):
            time.sleep(2.5)
            set_now(server, pairs)

        ParameterServer.set = set_slowly
        """
    with Node('waning', dedent(code) + dedent(HALTING)) as node:
        assert node.read_line() == 'ready'
        told = failure('set', '/waning/scale', '0')
        assert told.endswith('(waning.py:{}), which ends the node; taken back'.format(node.line_of('1.0 / scale'))), (
            told
        )
        assert node.process.wait(30) == 1
        assert master.getParam('/waning/rosslt/scale') == 2.0


def test_a_node_that_ends_does_not_commit_what_it_has_prepared(master):
    code = 'import rosslt.node.location_server as owner\nowner.AWAITED = 60.0\n' + dedent(HALTING)
    with Node('fading', code.replace('1.0 / scale', "1.0 / scale / rosslt.location(3.0, name='other')")) as node:
        assert node.read_line() == 'ready'
        listed = rospy.ServiceProxy('/fading/rosslt/list_locations', ListLocations)
        change = rospy.ServiceProxy('/fading/rosslt/change_sources', ChangeSources)
        wait_until(lambda: len(listed().locations) == 2, 'it goes round')
        ids = {one.name: one.id for one in listed().locations}
        prepared = {'transaction_id': 'two', 'nodes': ['/fading', '/else'], 'requester': '/else'}
        answer = change(phase='prepare', lease=5.0, location_ids=[ids['other']], values=['0.0'], **prepared)
        assert answer.state == 'prepared', answer
        change(request_id='its end', requester='/hand', location_ids=[ids['scale']], values=['0.0'])
        wait_until(lambda: 'ZeroDivisionError' in node.logged(), node.logged)
        answer = change(phase='commit', **prepared)
        why = 'the node ends: its main program has raised an exception'
        assert (answer.state, answer.reasons) == ('refused', [why]), answer
        assert change(phase='state', request_id='its end').state == 'aborted'
        assert node.process.wait(30) == 1
        assert {name: master.getParam('/fading/rosslt/' + name) for name in ids} == {'scale': 2.0, 'other': 3.0}


def test_what_else_is_taken_back_with_a_change_is_named(master):
    code = 'import rosslt.node.location_server as owner\nowner.SUSPECT = 600.0\n' + dedent(HALTING)
    with Node('ceasing', code.replace('1.0 / scale', "1.0 / scale / rosslt.location(3.0, name='other')")) as node:
        assert node.read_line() == 'ready'
        wait_until(lambda: '/ceasing/other' in rosslt('list', '/ceasing').stdout, 'it goes round')
        assert rosslt('set', '/ceasing/other', '4').returncode == 0
        told = failure('set', '/ceasing/scale', '0')
        assert told.endswith(', which ends the node and takes back other 3.0 -> 4.0, too; taken back'), told
        assert node.process.wait(30) == 1
        node.start()
        assert node.read_line() == 'ready'
        wait_until(lambda: rosslt('get', '/ceasing/other').stdout == '3.0\n', 'it goes round with it')


def test_two_changes_of_a_main_program_that_waits_for_long(master):
    code = HALTING.replace('0.05', '1000')
    with Node('pausing', code) as node, ThreadPoolExecutor(2) as pool:
        assert node.read_line() == 'ready'
        results = list(pool.map(lambda value: rosslt('set', '/pausing/scale', value), ('4', '5')))
        assert [one.returncode for one in results] == [0, 0], results
        node.process.kill()  # a signal would be handled once it has slept
