"""`rosslt lock` and `unlock`, `~rosslt/accept_changes_from`, and what `rosslt list` says of them."""

import getpass
import signal
import socket

import pytest
import rospy
from rosslt.srv import ChangeSources

from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest

OWNER = """
    rate = rospy.Rate(20)
    publisher = rosslt.Publisher('~place', Point, queue_size=1)
    while not rospy.is_shutdown():
        x, y = rosslt.location(1.0, name='x', maximum=9.0), rosslt.location(2.0, name='y')
        publisher.publish(x, x + y, rosslt.get_param('~z', 3.0))
        rate.sleep()
    """

ME = f'{getpass.getuser()}@{socket.gethostname()}'


@pytest.fixture
def owner(master):
    with Node('safe', OWNER) as node:
        wait_until(lambda: len(rosslt('list', '/safe').stdout.splitlines()) == 3, 'all locations are there')
        rosslt('unlock', '/safe')
        rosslt('reset', '/safe')
        yield node
        rosslt('unlock', '/safe')


def who(name):
    """The last column of `rosslt list` for a location."""
    return {line[0]: line[8] for line in lines('list', '/safe')}[name]


def request(requester, name='x', value='4.0'):
    ids = {one.name: one.id for one in rospy.ServiceProxy('/safe/rosslt/list_locations', _listing())().locations}
    change = rospy.ServiceProxy('/safe/rosslt/change_sources', ChangeSources)
    return change(requester=requester, location_ids=[ids[name]], values=[value])


def is_applied(*request_arguments):
    return request(*request_arguments).state == 'applied'


def _listing():
    from rosslt.srv import ListLocations

    return ListLocations


class TestLock:
    def test_a_locked_location_refuses_with_who_and_why_until_it_is_unlocked(self, owner):
        assert lines('lock', '/safe/x', '--reason', 'the robot is running') == [['/safe/x', 'locked']]
        assert failure('set', '/safe/x', '4') == (
            f'rosslt set: /safe refuses: /safe/x is locked by {ME}: the robot is running'
        )
        assert rosslt('set', '/safe/y', '5').returncode == 0
        assert who('/safe/x') == f'locked by {ME}: the robot is running'
        assert who('/safe/y') == ''
        assert lines('unlock', '/safe/x') == [['/safe/x', 'unlocked']]
        assert rosslt('set', '/safe/x', '4').returncode == 0
        assert who('/safe/x') == ''

    def test_a_locked_node_refuses_everything_with_who_and_why(self, owner, master):
        rosslt('set', '/safe/y', '5')
        rosslt('lock', '/safe')
        for change in (('set', '/safe/y', '6'), ('reset', '/safe'), ('undo', '/safe')):
            result = rosslt(*change)
            assert result.returncode == 1, change
            assert f'/safe is locked by {ME}' in result.stderr
        assert f'/safe  (locked by {ME})' in on_terminal('list', '/safe')
        for key, value in (('/safe/rosslt/y', 7.0), ('/safe/z', 8.0)):
            before = lines('list', '/safe')
            master.setParam(key, value)
            wait_until(lambda key=key, value=value: master.getParam(key) != value, 'it is set back')
            assert lines('list', '/safe') == before
        assert 'the whole node is locked by' in failure('unlock', '/safe/x')
        rosslt('unlock', '/safe')
        assert rosslt('set', '/safe/y', '6').returncode == 0

    def test_what_is_locked_stays_and_another_source_is_changed(self, owner):
        rosslt('lock', '/safe/x')
        assert [line[:3] for line in lines('force', '/safe/place/y', '7')] == [['/safe/y', '2.0', '6.0']]
        assert f'/safe: /safe/x is locked by {ME}' in failure('force', '/safe/place/x', '3')
        assert f', locked by {ME}]' in lines('explain', '/safe/place/x')[0][2]
        rosslt('unlock', '/safe/x')
        assert [line[:3] for line in lines('force', '/safe/place/x', '3')] == [['/safe/x', '1.0', '3.0']]

    def test_a_locked_parameter_is_named_in_full_and_by_the_doctor(self, owner):
        rosslt('lock', '/safe/~z', '--reason', 'measured')
        why = f'is locked by {ME}: measured'
        assert failure('set', '/safe/~z', '4') == f'rosslt set: /safe refuses: /safe/z {why}'
        assert ['note', f'/safe/~z {why}'] in [line[2:] for line in lines('doctor', '/safe/place', '--time', '1')]

    def test_it_holds_over_a_restart(self, owner):
        rosslt('lock', '/safe/x', '--reason', 'calibrated')
        owner.stop(signal.SIGKILL)
        owner.start()
        wait_until(lambda: len(rosslt('list', '/safe').stdout.splitlines()) == 3, 'all locations are there')
        assert '/safe/x is locked by' in failure('set', '/safe/x', '4')
        assert who('/safe/x') == f'locked by {ME}: calibrated'

    def test_names_what_is_not_there(self, owner):
        assert 'has no location w' in failure('lock', '/safe/w')
        assert 'begins with no node that has locations' in failure('lock', '/nobody')


class TestAcceptedRequesters:
    @pytest.fixture
    def accepted(self, owner, master):
        yield lambda value: master.setParam('/safe/rosslt/accept_changes_from', value)
        master.deleteParam('/safe/rosslt/accept_changes_from')
        wait_until(lambda: is_applied('/planner'), 'everybody is accepted')

    def test_others_are_refused_with_who_they_are_and_who_is_accepted(self, accepted):
        accepted(['/planner', '/hand_*'])
        wait_until(lambda: not is_applied('/other'), 'it is in force')
        (reason,) = request('/other').reasons
        assert reason == (
            '/safe takes changes from /planner and /hand_* only, and this one is from /other: '
            'see /safe/rosslt/accept_changes_from'
        )
        assert is_applied('/planner')
        assert is_applied('/hand_7')
        assert 'this one is from rosslt set' in failure('set', '/safe/x', '4')
        assert who('/safe/x') == 'takes changes from /planner and /hand_* only'

    def test_the_parameter_server_is_a_requester_too(self, accepted, master):
        accepted(['/planner'])
        wait_until(lambda: not is_applied('/other'), 'it is in force')
        master.setParam('/safe/rosslt/x', 8.0)
        wait_until(lambda: master.getParam('/safe/rosslt/x') != 8.0, 'it is set back')
        accepted(['/planner', 'parameter server'])
        wait_until(
            lambda: master.setParam('/safe/rosslt/x', 8.0) or request('/planner').changes[0].old_value == '8.0', 'taken'
        )

    def test_a_value_that_is_no_list_of_names_accepts_nobody(self, accepted):
        accepted(3)
        wait_until(lambda: not is_applied('/planner'), 'it is in force')
        assert 'takes changes from nobody only' in request('/planner').reasons[0]


READER = """
    publisher = rosslt.Publisher('~place', Point, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.get_param('/shared/gain'), 0.0, 0.0)
        rate.sleep()
    """


class TestSharedParameter:
    @pytest.fixture
    def readers(self, master):
        master.setParam('/shared/gain', 1.0)
        with Node('first_reader', READER) as first, Node('second_reader', READER):
            for node in ('/first_reader', '/second_reader'):
                wait_until(lambda node=node: '/shared/gain' in rosslt('list', node).stdout, 'it is read')
            yield first
            wait_until(lambda: rosslt('unlock', '/first_reader').returncode == 0, 'one that starts again is there')

    @pytest.mark.parametrize('locked', ['/first_reader', '/first_reader//shared/gain'])
    def test_a_lock_in_one_reader_refuses_a_change_by_way_of_another(self, readers, locked, master):
        assert rosslt('lock', locked, '--reason', 'calibrated').stderr == ''
        refusal = failure('force', '/second_reader/place/x', '3')
        assert '/second_reader: /shared/gain is also read by /first_reader: ' in refusal
        assert f'locked by {ME}: calibrated' in refusal
        assert master.getParam('/shared/gain') == 1.0
        rosslt('unlock', '/first_reader')
        assert rosslt('force', '/second_reader/place/x', '3').returncode == 0
        assert master.getParam('/shared/gain') == 3.0

    def test_a_reader_that_has_ended_refuses_nothing(self, readers, master):
        rosslt('lock', '/first_reader')
        readers.stop(signal.SIGKILL)
        assert rosslt('force', '/second_reader/place/x', '4').stderr == ''
        assert master.getParam('/shared/gain') == 4.0
        readers.start()

    def test_undo_takes_back_the_last_change_and_not_what_a_lock_has_set_back(self, readers, master):
        assert rosslt('force', '/second_reader/place/x', '2').returncode == 0
        rosslt('lock', '/first_reader')
        master.setParam('/shared/gain', 5.0)
        wait_until(lambda: master.getParam('/shared/gain') == 2.0, 'it is set back')
        rosslt('unlock', '/first_reader')
        assert [line[:3] for line in lines('undo', '/second_reader')] == [['/second_reader//shared/gain', '2.0', '1.0']]
