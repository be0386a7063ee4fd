"""Two machines: what holds while a cable is pulled, a machine is gone, and addresses lead nowhere."""

import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from support.history_checker import check
from support.history_harness import CLIENT, client_of, location_id, logged, operation
from support.network import Network
from support.processes import Node, wait_until

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

STARTING = 60.0  # seconds, on a busy machine
TIME_LIMIT = 90.0
PORT = 11811  # of the master, on a machine of its own

TALKER = """
    from visualization_msgs.msg import Marker
    publisher = rosslt.Publisher('place', Marker, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        marker = Marker(ns='cube', type=Marker.CUBE)
        marker.header.frame_id = 'world'
        marker.pose.position.x = 2 * rosslt.location(1.0, name='x')
        marker.pose.position.y = 5.0 * rosslt.location(1.0, name='r0')
        marker.pose.orientation.w = marker.color.a = marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        publisher.publish(marker)
        rate.sleep()
    """

LISTENER = """
    from visualization_msgs.msg import Marker
    publisher = rosslt.Publisher('seen', Float64, queue_size=1)
    def hear(marker):
        publisher.publish(marker.pose.position.x + rosslt.location(0.5, name='shift'))
    rosslt.Subscriber('place', Marker, hear)
    rospy.spin()
    """

#: Drags the marker along x, and prints what x is then.
HAND = """
    sys.path.insert(0, {tests!r})
    from support.hand import Hand, wait_until
    hand = Hand()
    name = '/place:cube:0'
    before = hand.position(name)[0]
    feedback = hand.press(name)
    hand.move(feedback, dx=1.0)
    hand.release(feedback)
    wait_until(lambda: abs(hand.position(name)[0] - before - 1.0) < 1e-6, 'it follows')
    print('dragged', flush=True)
    """

#: Changes both machines' locations together, says `begin`, and how it went.
TOGETHER = """
    pair = [rosslt.track(1.0, rosslt.Source('/talker', {x})), rosslt.track(0.5, rosslt.Source('/listener', {shift}))]
    try:
        rosslt.force_value(pair, [{first}, {second}])
        print('done', flush=True)
    except rosslt.Error as error:
        print(error, flush=True)
    """


class Machines:
    def __init__(self, network, folder):
        self.network, self.folder = network, folder
        self.here, self.there = network.here, network.there
        for machine in (self.here, self.there):
            machine.environment = {
                'ROS_MASTER_URI': f'http://{self.here.address}:{PORT}',
                'ROS_LOG_DIR': str(folder),
                'PYTHONUNBUFFERED': '1',
            }

    def node(self, machine, name, code, *options, **environment):
        """Start a node on a machine."""
        file = self.folder / (name + '.py')
        head = textwrap.dedent(Node.IMPORTS) + f'rosslt.init_node({name!r})\n'
        file.write_text(head + textwrap.dedent(code).strip() + '\n', encoding='utf-8')
        with open(self.folder / (name + '.log'), 'a', encoding='utf-8') as log:
            return machine.start(sys.executable, str(file), *options, stderr=log, environment=environment)

    def log(self, name):
        """What a node has written on its standard error."""
        return (self.folder / (name + '.log')).read_text(encoding='utf-8')

    def rosslt(self, machine, *arguments):
        return machine.run('rosslt', *arguments)

    def listed(self, machine, node):
        """{location: (value, id)} as a command on a machine says."""
        result = self.rosslt(machine, 'list', node)
        rows = [line.split('\t') for line in result.stdout.splitlines()]
        return {row[0]: row[2] for row in rows} if result.returncode == 0 else {}

    def wait_for(self, machine, node, count):
        wait_until(lambda: len(self.listed(machine, node)) == count, f'{node} is there', STARTING)


@pytest.fixture(scope='module')
def machines(tmp_path_factory):
    with Network() as network:
        machines = Machines(network, tmp_path_factory.mktemp('machines'))
        machines.here.start(
            'rosmaster', '--core', '-p', str(PORT), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        wait_until(lambda: machines.here.run('rosnode', 'list').returncode == 0, 'the master answers', STARTING)
        machines.node(machines.here, 'talker', TALKER)
        machines.node(machines.there, 'listener', LISTENER)
        with open(machines.folder / 'markers.log', 'a', encoding='utf-8') as log:
            machines.there.start('rosrun', 'rosslt', 'slt_visualization', stdout=log, stderr=log)
        machines.wait_for(machines.there, '/talker', 2)
        machines.wait_for(machines.here, '/listener', 1)
        yield machines


@pytest.fixture
def cable(machines):
    """The cable, which is plugged in after each test, and then everything works again."""
    yield machines.network
    machines.network.plug()
    wait_until(
        lambda: machines.rosslt(machines.there, 'set', '/talker/x', '1').returncode == 0, 'it works again', STARTING
    )
    wait_until(
        lambda: machines.rosslt(machines.here, 'set', '/listener/shift', '0.5').returncode == 0, 'and back', STARTING
    )


def test_the_command_works_on_the_other_machine(machines, cable):
    assert machines.rosslt(machines.there, 'set', '/talker/x', '3').returncode == 0
    assert machines.rosslt(machines.there, 'get', '/talker/x').stdout == '3.0\n'
    forced = machines.rosslt(machines.there, 'force', '/place/pose/position/x', '8')
    assert (forced.returncode, forced.stdout.split('\t')[:3]) == (0, ['/talker/x', '3.0', '4.0'])
    explained = machines.rosslt(machines.here, 'explain', '/seen/data').stdout
    assert '/talker/x' in explained
    assert '/listener/shift' in explained


def test_a_drag_on_the_other_machine_works_before_and_after_the_cable_was_pulled(machines, cable):
    tests = str(Path(__file__).resolve().parents[1])
    for turn in ('before', 'after'):
        hand = machines.node(machines.there, 'hand_' + turn, HAND.format(tests=tests))
        printed = hand.communicate(timeout=TIME_LIMIT)[0]
        assert printed.splitlines()[-1:] == ['dragged'], machines.log('hand_' + turn) + machines.log('markers')
        if turn == 'before':
            cable.pull()
            assert machines.rosslt(machines.here, 'set', '/listener/shift', '2').returncode == 1
            cable.plug()
            wait_until(
                lambda: machines.rosslt(machines.there, 'get', '/talker/x').returncode == 0, 'it is there', STARTING
            )


def test_a_change_while_the_cable_is_pulled_fails_with_a_clear_word_and_works_afterwards(machines, cable):
    cable.pull()
    failed = machines.rosslt(machines.here, 'set', '/listener/shift', '2')
    assert failed.returncode == 1
    assert 'cannot reach /listener' in failed.stderr
    lost = machines.rosslt(machines.there, 'list')
    assert lost.returncode == 1
    assert f'found no ROS master at http://{machines.here.address}:{PORT}' in lost.stderr
    cable.plug()
    wait_until(
        lambda: machines.rosslt(machines.here, 'set', '/listener/shift', '2').returncode == 0, 'it works', STARTING
    )
    assert machines.rosslt(machines.there, 'get', '/listener/shift').stdout == '2.0\n'


def test_no_change_is_lost_or_applied_twice_while_the_cable_is_pulled_again_and_again(machines, cable):
    log, enough = machines.folder / 'client.jsonl', machines.folder / 'enough'
    arguments = client_of({'/talker/r0': location_id('r0')}, log, seed=1, count=0, enough=enough)
    client = machines.node(machines.there, 'client', CLIENT.format(timeout=5.0), *arguments)

    def count(outcome):
        return sum(entry['outcome'] == outcome and 'end' in entry for entry in logged(log))

    def wait_for_more(outcome):
        before = count(outcome)
        wait_until(lambda: count(outcome) > before + 1, outcome + ' again', STARTING)

    for _ in range(4):
        wait_for_more('ok')
        cable.pull()
        wait_for_more('unknown')
        cable.plug()
    wait_for_more('ok')
    enough.touch()
    client.wait(STARTING)
    operations = [operation(entry) for entry in logged(log)]
    assert check(operations, initial=operations[0].seen) == []


def test_all_or_none_holds_over_machines_and_a_machine_that_is_gone(machines, cable):
    ids = {'x': location_id('x'), 'shift': location_id('shift')}

    def together(turn, first, second):
        node = machines.node(machines.here, f'together{turn}', TOGETHER.format(first=first, second=second, **ids))
        return node.communicate(timeout=TIME_LIMIT)[0].strip()

    assert together(1, 5.0, 6.0) == 'done'
    assert machines.rosslt(machines.here, 'get', '/talker/x').stdout == '5.0\n'
    assert machines.rosslt(machines.here, 'get', '/listener/shift').stdout == '6.0\n'
    cable.pull()
    said = together(2, 7.0, 8.0)
    assert said.startswith('cannot reach /listener')
    assert said.endswith('nothing has changed')
    assert machines.rosslt(machines.here, 'get', '/talker/x').stdout == '5.0\n'
    cable.plug()
    wait_until(
        lambda: machines.rosslt(machines.here, 'get', '/listener/shift').stdout == '6.0\n', 'as before', STARTING
    )
    assert together(3, 7.0, 8.0) == 'done'


@pytest.mark.parametrize(
    ('name', 'environment', 'said'),
    [
        ('unroutable', {'ROS_IP': '10.99.99.99'}, '10.99.99.99'),
        ('nameless', {'ROS_IP': '', 'ROS_HOSTNAME': 'robot.invalid'}, 'robot.invalid'),
    ],
)
def test_an_address_that_leads_nowhere_is_named_and_the_others_are_listed(machines, cable, name, environment, said):
    node = machines.node(machines.here, name, "rosslt.location(1.0, name='x')\nrospy.spin()", **environment)
    try:
        service = f'/{name}/rosslt/list_locations'
        wait_until(lambda: service in machines.here.run('rosservice', 'list').stdout, 'it is registered', STARTING)
        listed = machines.rosslt(machines.there, 'list')
        assert listed.returncode == 1
        assert f'cannot reach /{name}: it advertises the address {said}' in listed.stderr
        assert 'set ROS_IP to an address that this machine reaches' in listed.stderr
        assert '/talker/x' in listed.stdout
    finally:
        node.send_signal(signal.SIGKILL)
        node.wait()
