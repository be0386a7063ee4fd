"""Clients that change and read the registers of owners while processes are killed, stopped and started again.

Every client writes down each operation when it begins and when it ends, so that one that is killed has begun it. What
is changed is a location, a parameter set by `rosparam set`, or one of a dynamic_reconfigure server.
"""

import json
import math
import os
import random
import signal
import tempfile
import time
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional

import rosgraph

from support import fork_server
from support.history_checker import Fault, Operation, check
from support.processes import Master, Node, wait_until

OWNER_KILLED, OWNER_STOPPED = 'owner killed', 'owner stopped'
CLIENT_KILLED, MASTER_KILLED = 'client killed', 'master killed'

ASKER = str(Path(__file__).with_name('ask_node.py'))

#: How many kinds of failures there are: a run lasts until each has happened.
FAILURES = 4

REGISTERS = ('r0', 'r1', 'r2')

#: How long something that was started may take on a busy machine, in seconds.
STARTING = 60.0

#: How long one operation may take, in seconds.
TIMEOUT = 1.0

#: Owners, all of which have a service `~read` that says the values in force.
OWNERS = {
    'rosslt': """
        from std_srvs.srv import Trigger, TriggerResponse
        names = ['r0', 'r1', 'r2', 'twin']
        read = {name: (lambda name=name: rosslt.location(0.0, name=name)) for name in names}
        for name in names:
            read[name]()
        rospy.Service('~read', Trigger, lambda _: TriggerResponse(True, json.dumps({n: read[n]() for n in names})))
        rospy.spin()
        """,
    'rosparam set': """
        from std_srvs.srv import Trigger, TriggerResponse
        rospy.init_node({name!r})
        names = ['r0', 'r1', 'r2', 'twin']
        values = {{name: rospy.get_param('~' + name, 0.0) for name in names}}
        rospy.Service('~read', Trigger, lambda _: TriggerResponse(True, json.dumps(values)))
        while not rospy.is_shutdown():
            try:
                values = {{name: rospy.get_param('~' + name, 0.0) for name in names}}
            except Exception:
                pass  # the master is away
            time.sleep(0.02)
        """,
    'dynamic_reconfigure': """
        rospy.init_node({name!r})
        sys.argv = [sys.argv[0], '', '', '', '']  # the generator takes itself for a script of the build
        from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator, double_t
        from dynamic_reconfigure.server import Server
        from std_srvs.srv import Trigger, TriggerResponse
        names = ['r0', 'r1', 'r2', 'twin']
        generator = ParameterGenerator()
        for name in names:
            generator.add(name, double_t, 0, '', 0.0, -1e12, 1e12)
        class Type:
            defaults = dict.fromkeys(names, 0.0)
            min = dict.fromkeys(names, -1e12)
            max = dict.fromkeys(names, 1e12)
            level = dict.fromkeys(names, 0)
            type = dict.fromkeys(names, 'double')
            all_level = 0
            config_description = generator.group.to_dict()
        values = dict(Type.defaults)
        def take(config, level):
            values.update({{name: config[name] for name in names}})
            return config
        server = Server(Type, take)
        rospy.Service('~read', Trigger, lambda _: TriggerResponse(True, json.dumps(values)))
        rospy.spin()
        """,
}

#: A client: what it is told stands in its arguments, what it does in its log.
CLIENT = """
    import random, threading
    from std_srvs.srv import Trigger
    kind, sources, path, enough = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3], sys.argv[6]
    seed, count = int(sys.argv[4]), int(sys.argv[5])
    twins = [name for name in sources if name.endswith('/twin')]
    registers = [name for name in sources if not name.endswith('/twin')]
    chance = random.Random(seed)
    log = open(path, 'a', buffering=1)

    def tracked(register):
        node = register.rpartition('/')[0]
        return rosslt.track(0.0, rosslt.Source(node, sources[register]))

    def read(register):
        if kind == 'rosslt':
            return rosslt.untracked(rosslt.reevaluate(tracked(register), timeout={timeout}))
        node, _, name = register.rpartition('/')
        return json.loads(rospy.ServiceProxy(node + '/read', Trigger)().message)[name]

    def write(register, value):
        if kind == 'rosslt':
            (change,) = rosslt.force_value(tracked(register), value, timeout={timeout}).values()
            return change.old
        if kind == 'rosparam set':
            rospy.set_param(register, value)
            return None
        from dynamic_reconfigure.client import Client
        node, _, name = register.rpartition('/')
        Client(node, timeout={timeout}).update_configuration({{name: value}})
        return None

    def write_twins(pair, value):
        rosslt.force_value([tracked(one) for one in pair], [value, value], timeout={timeout})

    print('ready', flush=True)
    turn = 0
    while turn < count or not os.path.exists(enough):
        turn += 1
        number = seed * 1000000.0 + turn
        draw = chance.random()
        register = chance.choice(registers)
        entry = {{'id': number, 'register': register, 'begin': time.monotonic()}}
        if kind == 'rosslt' and draw < 0.1 and len(twins) > 1:
            entry.update(register='twins', pair=chance.sample(twins, 2), written=number)
        elif draw < 0.6:
            entry['written'] = number
        log.write(json.dumps(entry) + '\\n')
        answer = {{'id': number, 'outcome': 'ok'}}
        try:
            if 'pair' in entry:
                write_twins(entry['pair'], number)
            elif 'written' in entry:
                answer['seen'] = write(register, number)
            else:
                answer['seen'] = read(register)
        except (rosslt.ChangeRejected, rosslt.NotInvertible) as error:
            answer.update(outcome='unknown' if getattr(error, 'changed', None) else 'refused', text=str(error))
        except Exception as error:  # whatever the network makes of it: nobody knows what has happened
            answer.update(outcome='unknown', text=type(error).__name__ + ': ' + str(error))
        answer['end'] = time.monotonic()
        log.write(json.dumps(answer) + '\\n')
    print('done', flush=True)
    """


class Result(NamedTuple):
    """What a run has shown.

    Attributes:
        operations: how many operations had which outcome, `{'write ok': 123, ...}`.
        faults: what is wrong with the history.
        twins: what is wrong with changes of two owners.
        injected: how many faults of which kind were made.
        odd: texts of operations without an answer, each once.
    """

    operations: Dict[str, int]
    faults: List[Fault]
    twins: List[str]
    injected: Dict[str, int]
    odd: List[str]


def run(
    kind: str = 'rosslt', clients: int = 4, owners: int = 2, count: int = 400, pause: float = 1.0, seed: int = 1
) -> Result:
    """Have clients work on owners while something fails, and check what they say of it.

    Args:
        kind: of OWNERS.
        clients, owners: how many processes.
        count: of all operations together.
        pause: between two failures, in seconds.
        seed: of all that is drawn.
    """
    with tempfile.TemporaryDirectory(prefix='rosslt_history_') as directory:
        return _Run(kind, clients, owners, count, pause, seed, Path(directory)).run()


class _Run:
    def __init__(
        self, kind: str, clients: int, owners: int, count: int, pause: float, seed: int, directory: Path
    ) -> None:
        self.kind, self.count, self.pause = kind, count, pause
        self.chance = random.Random(seed)
        self.directory = directory
        self.enough = directory / 'enough'  # clients go on until it is there
        self.injected: Dict[str, int] = {}
        self.next: List[str] = []
        self.number_of_clients, self.number_of_owners = clients, owners
        self.begun = 0

    def run(self) -> Result:
        self.master = Master()
        os.environ.update(ROS_MASTER_URI=self.master.uri, ROS_HOSTNAME='localhost', ROS_LOG_DIR=str(self.directory))
        self.owners: List[Node] = []
        self.clients: List[Node] = []
        try:
            self.owners = [self._owner(f'owner{number}') for number in range(self.number_of_owners)]
            for owner in self.owners:
                self._wait_for(owner)
            self.sources = {
                f'{owner.name}/{name}': one for owner in self.owners for name, one in self._ids(owner).items()
            }
            each = self.count // self.number_of_clients
            self.clients = [self._client(each) for _ in range(self.number_of_clients)]
            while any(client.process.poll() is None for client in self.clients):
                time.sleep(self.pause * self.chance.uniform(0.5, 1.5))
                self._fail()
            final = [self._read(owner) for owner in self.owners]
            return self._judge(final)
        finally:
            for node in [*self.clients, *self.owners]:
                node.stop(signal.SIGKILL)
            self.master.kill()

    @property
    def _names(self) -> List[str]:
        return [*REGISTERS, 'twin']

    def _owner(self, name: str) -> Node:
        is_plain = self.kind != 'rosslt'
        code = OWNERS[self.kind].format(name=name) if is_plain else OWNERS[self.kind]
        return Node(name, code, wait_for=None, calls_init_node=is_plain)

    def _client(self, count: int) -> Node:
        self.begun += 1
        return Node(
            f'client{self.begun}',
            CLIENT.format(timeout=TIMEOUT),
            self.kind,
            json.dumps(self.sources),
            str(self.directory / f'{self.begun}.jsonl'),
            str(self.begun),
            str(count),
            str(self.enough),
            wait_for=None,
        )

    def _wait_for(self, owner: Node) -> None:
        """Wait until an owner answers, with all that was remembered of it."""
        wait_until(lambda: owner.offers('read') and self._values(owner), f'{owner.name} answers', STARTING)

    def _values(self, owner: Node) -> Optional[Dict[str, float]]:
        """The values in force of an owner."""
        return _asked(owner, 'read')

    def _ids(self, owner: Node) -> Dict[str, int]:
        """{name: id} of what an owner has."""
        if self.kind != 'rosslt':
            return dict.fromkeys(self._names, 0)
        listed = wait_until(lambda: self._listed(owner), f'{owner.name} lists its locations', STARTING)
        return {name: listed[name] for name in self._names}

    def _listed(self, owner: Node) -> Optional[Dict[str, int]]:
        """{name: id} of the locations of an owner, once all are there."""
        listed = _asked(owner, 'rosslt/list_locations')
        return listed if listed is not None and set(self._names) <= listed.keys() else None

    def _read(self, owner: Node) -> List[Operation]:
        begin = time.monotonic()
        values = wait_until(lambda: self._values(owner), 'it answers', STARTING)
        end = time.monotonic()
        return [Operation(f'{owner.name}/{name}', begin, end, 'ok', None, values[name], 'last') for name in self._names]

    def _fail(self) -> None:
        """Have something fail, and mend it."""
        if not self.next:  # in another order each time, and none is left out
            self.next = [OWNER_KILLED, OWNER_KILLED, OWNER_STOPPED, CLIENT_KILLED, MASTER_KILLED]
            self.chance.shuffle(self.next)
        what = self.next.pop()
        self.injected[what] = self.injected.get(what, 0) + 1
        if len(self.injected) == FAILURES:
            self.enough.touch()
        if what == OWNER_KILLED:
            owner = self.chance.choice(self.owners)
            owner.stop(signal.SIGKILL)
            owner.start(wait_for=None)
            self._wait_for(owner)
        elif what == OWNER_STOPPED:
            owner = self.chance.choice(self.owners)
            owner.process.send_signal(signal.SIGSTOP)
            time.sleep(self.chance.uniform(0.2, 2.5))
            owner.process.send_signal(signal.SIGCONT)
        elif what == CLIENT_KILLED:
            alive = [client for client in self.clients if client.process.poll() is None]
            if alive:
                client = self.chance.choice(alive)
                client.stop(signal.SIGKILL)
                begun = self._log(client.options[2])
                left = int(client.options[4]) - len(begun)
                if left > 0:
                    self.clients.append(self._client(left))
        else:
            self.master.kill()
            time.sleep(self.chance.uniform(0.1, 1.0))
            self.master.start()
            for owner in self.owners:
                if self.kind != 'rosslt':  # a plain node does not notice that it is not registered any more
                    owner.stop(signal.SIGKILL)
                    owner.start(wait_for=None)
                self._wait_for(owner)
            if self.kind == 'rosslt':
                # node and master dying together is not promised: what the new master is told is waited for
                master = rosgraph.Master('/harness')
                for owner in self.owners:
                    wait_until(
                        lambda owner=owner: self._is_mirrored(master, owner),
                        f'{owner.name} has set its parameters',
                        STARTING,
                    )

    def _is_mirrored(self, master: rosgraph.Master, owner: Node) -> bool:
        return all(master.hasParam(f'{owner.name}/rosslt/{name}') for name in self._names)

    def _log(self, path: str) -> Dict[float, Dict[str, Any]]:
        """{id: what is known of an operation} of one client."""
        found: Dict[float, Dict[str, Any]] = {}
        if os.path.exists(path):
            for line in Path(path).read_text(encoding='utf-8').splitlines():
                try:
                    entry = json.loads(line)
                except ValueError:  # the client was killed while it wrote
                    continue
                found.setdefault(entry['id'], {}).update(entry)
        return found

    def _judge(self, final: List[List[Operation]]) -> Result:
        counts: Dict[str, int] = {}
        operations: List[Operation] = [
            one for per_owner in final for one in per_owner if not one.register.endswith('twin')
        ]
        twins: List[Dict[str, Any]] = []
        odd: Dict[str, None] = {}
        for path in sorted(self.directory.glob('*.jsonl')):
            for entry in self._log(str(path)).values():
                outcome = entry.get('outcome', 'unknown')
                what = 'twins' if 'pair' in entry else 'write' if 'written' in entry else 'read'
                counts[f'{what} {outcome}'] = counts.get(f'{what} {outcome}', 0) + 1
                if 'text' in entry:
                    odd[entry['text']] = None
                if what == 'twins':
                    twins.append(entry)
                    continue
                operations.append(
                    Operation(
                        entry['register'],
                        entry['begin'],
                        entry['end'] if outcome != 'unknown' else math.inf,
                        outcome,
                        entry.get('written'),
                        entry.get('seen'),
                        path.stem,
                    )
                )
        for owner in self.owners:
            log = Path(owner.errors).read_text(encoding='utf-8', errors='replace').splitlines()
            odd.update((f'{owner.name} logs: {line}', None) for line in log if 'WARN' in line or 'Error' in line)
        ends = {one.register: one.seen for per_owner in final for one in per_owner if one.register.endswith('twin')}
        return Result(counts, check(operations), _check_twins(twins, ends), self.injected, list(odd))


def _asked(owner: Node, service: str) -> Any:
    """What an owner says, asked in a process of its own: this one is no node. None where it does not answer."""
    result = fork_server.call(ASKER, [owner.name, service], STARTING)
    try:
        return json.loads(result.stdout.strip().splitlines()[-1])
    except (ValueError, IndexError):
        return None


def _check_twins(entries: List[Dict[str, Any]], ends: Dict[str, float]) -> List[str]:
    """What is wrong with changes that two owners make together, by what they have at the end.

    Args:
        entries: all changes of pairs, as the clients have logged them.
        ends: {register: its value at the end}.
    """
    faults = []
    by_value = {entry['written']: entry for entry in entries}
    for register, value in ends.items():
        last = by_value.get(value)
        if value != 0.0 and (last is None or register not in last['pair']):
            faults.append(f'{register} has {value}, which nobody has written there')
            continue
        if last is not None and last.get('outcome') == 'refused':
            faults.append(f'{register} has {value}, which was refused')
        for entry in entries:
            is_later = last is None or entry['begin'] > last.get('end', math.inf)
            if register in entry['pair'] and entry.get('outcome') == 'ok' and is_later:
                faults.append(f'{register} has {value}, though {entry["written"]} was acknowledged later')
        if last is not None and last.get('outcome') == 'ok':
            # the other one has it as well, or something that was begun before this one had ended
            for other in last['pair']:
                held = by_value.get(ends[other])
                if ends[other] != value and (held is None or held.get('end', math.inf) < last['begin']):
                    faults.append(
                        f'{register} has {value} of a change of {last["pair"]}, and {other} has {ends[other]}'
                    )
    return faults
