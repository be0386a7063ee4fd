"""Clients that change and read the registers of owners while processes are killed, stopped and started again.

Every client writes down each operation when it begins and when it ends, so that one that is killed has begun it. What
is changed is a location, or a parameter set by `rosparam set`.
"""

import contextlib
import hashlib
import json
import math
import os
import random
import signal
import tempfile
import time
from pathlib import Path
from typing import Any, Dict, List, NamedTuple

import rosgraph
import rospy
from std_srvs.srv import Trigger

from support.history_checker import Fault, Operation, check
from support.processes import Master, Node, wait_until

OWNER_KILLED, OWNER_STOPPED = 'owner killed', 'owner stopped'
CLIENT_KILLED, MASTER_KILLED = 'client killed', 'master killed'

#: What fails in one round; a run lasts until each has happened.
FAILURES = (OWNER_KILLED, OWNER_KILLED, OWNER_STOPPED, CLIENT_KILLED, MASTER_KILLED)

#: The locations of an owner; the last one is changed together with that of another owner.
NAMES = ('r0', 'r1', 'r2', 'twin')

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
        rospy.init_node('owner')
        names = ['r0', 'r1', 'r2', 'twin']
        values = {name: rospy.get_param('~' + name, 0.0) for name in names}
        rospy.Service('~read', Trigger, lambda _: TriggerResponse(True, json.dumps(values)))
        while not rospy.is_shutdown():
            try:
                values = {name: rospy.get_param('~' + name, 0.0) for name in names}
            except Exception:
                pass  # the master is away
            time.sleep(0.02)
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
        rospy.set_param(register, value)

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
            answer['outcome'] = 'unknown' if getattr(error, 'changed', None) else 'refused'
        except Exception:  # whatever the network makes of it: nobody knows what has happened
            answer['outcome'] = 'unknown'
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
    """

    operations: Dict[str, int]
    faults: List[Fault]
    twins: List[str]
    injected: Dict[str, int]


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
        return _Run(kind, count // clients, pause, random.Random(seed), Path(directory)).run(clients, owners)


def client_of(
    sources: Dict[str, int], log: Path, seed: int, count: int, enough: Path, kind: str = 'rosslt'
) -> List[str]:
    """The arguments of CLIENT.

    Args:
        sources: `{name of a register: the id of its location}`.
        count: of operations, at the least.
        enough: the file that says that it may end.
    """
    return [kind, json.dumps(sources), str(log), str(seed), str(count), str(enough)]


def logged(path: Path) -> List[Dict[str, Any]]:
    """What is known of each operation of a client."""
    found: Dict[float, Dict[str, Any]] = {}
    for line in path.read_text(encoding='utf-8').splitlines() if path.exists() else ():
        with contextlib.suppress(ValueError):  # the client was killed while it wrote
            entry = json.loads(line)
            found.setdefault(entry['id'], {'outcome': 'unknown'}).update(entry)
    return list(found.values())


def operation(entry: Dict[str, Any]) -> Operation:
    """An operation as it was logged."""
    end = math.inf if entry['outcome'] == 'unknown' else entry['end']
    return Operation(entry['register'], entry['begin'], end, entry['outcome'], entry.get('written'), entry.get('seen'))


def location_id(name: str) -> int:
    """The id of a location that has a name: it follows from the name."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=6).digest(), 'big')


class _Run:
    def __init__(self, kind: str, each: int, pause: float, chance: random.Random, directory: Path) -> None:
        self.kind, self.each, self.pause, self.chance, self.directory = kind, each, pause, chance, directory
        self.enough = directory / 'enough'  # clients go on until it is there
        self.injected: Dict[str, int] = {}
        self.next: List[str] = []
        self.owners: List[Node] = []
        self.clients: List[Node] = []
        self.logs: List[Path] = []

    def run(self, clients: int, owners: int) -> Result:
        self.master = Master()
        os.environ.update(ROS_MASTER_URI=self.master.uri, ROS_HOSTNAME='localhost', ROS_LOG_DIR=str(self.directory))
        try:
            for number in range(owners):
                name, is_plain = f'owner{number}', self.kind != 'rosslt'
                code = OWNERS[self.kind]
                self.owners.append(Node(name, code, '__name:=' + name, wait_for='read', calls_init_node=is_plain))
            for _ in range(clients):
                self._start_client(self.each)
            while any(client.process.poll() is None for client in self.clients):
                time.sleep(self.pause * self.chance.uniform(0.5, 1.5))
                self._fail()
            return self._judge([operation for owner in self.owners for operation in self._last(owner)])
        finally:
            for node in [*self.clients, *self.owners]:
                node.stop(signal.SIGKILL)
            self.master.kill()

    def _start_client(self, count: int) -> None:
        sources = {f'{owner.name}/{name}': location_id(name) for owner in self.owners for name in NAMES}
        number = len(self.logs) + 1
        self.logs.append(self.directory / f'{number}.jsonl')
        arguments = client_of(sources, self.logs[-1], number, count, self.enough, self.kind)
        self.clients.append(Node(f'client{number}', CLIENT.format(timeout=TIMEOUT), *arguments, wait_for=None))

    def _last(self, owner: Node) -> List[Operation]:
        """What an owner has in the end."""
        begin = time.monotonic()
        values = json.loads(rospy.ServiceProxy(owner.name + '/read', Trigger)().message)
        end = time.monotonic()
        return [Operation(f'{owner.name}/{name}', begin, end, 'ok', None, values[name]) for name in NAMES]

    def _fail(self) -> None:
        """Have something fail, and mend it."""
        if not self.next:  # in another order each time, and none is left out
            self.next = self.chance.sample(FAILURES, len(FAILURES))
        what = self.next.pop()
        self.injected[what] = self.injected.get(what, 0) + 1
        if self.injected.keys() == set(FAILURES):
            self.enough.touch()
        owner = self.chance.choice(self.owners)
        if what == OWNER_KILLED:
            _restart(owner)
        elif what == OWNER_STOPPED:
            owner.process.send_signal(signal.SIGSTOP)
            time.sleep(self.chance.uniform(0.2, 2.5))
            owner.process.send_signal(signal.SIGCONT)
        elif what == CLIENT_KILLED:
            alive = [number for number, client in enumerate(self.clients) if client.process.poll() is None]
            if alive:
                number = self.chance.choice(alive)
                self.clients[number].stop(signal.SIGKILL)
                self._start_client(max(1, self.each - len(logged(self.logs[number]))))
        else:
            self.master.kill()
            time.sleep(self.chance.uniform(0.1, 1.0))
            self.master.start()
            for owner in self.owners:
                if self.kind != 'rosslt':  # a plain node does not notice that it is not registered any more
                    _restart(owner)
                    continue
                # node and master dying together is not promised: what the new master is told is waited for
                wait_until(
                    lambda owner=owner: owner.offers('read') and _is_mirrored(owner), f'{owner.name} is registered'
                )

    def _judge(self, last: List[Operation]) -> Result:
        entries = [entry for log in self.logs for entry in logged(log)]
        counts: Dict[str, int] = {}
        for entry in entries:
            what = 'twins' if 'pair' in entry else 'write' if 'written' in entry else 'read'
            outcome = f'{what} {entry["outcome"]}'
            counts[outcome] = counts.get(outcome, 0) + 1
        faults = check(
            [one for one in last if not one.register.endswith('twin')]
            + [operation(entry) for entry in entries if 'pair' not in entry]
        )
        ends = {one.register: one.seen for one in last if one.register.endswith('twin')}
        twins = _check_twins([entry for entry in entries if 'pair' in entry], ends)
        return Result(counts, faults, twins, self.injected)


def _restart(owner: Node) -> None:
    owner.stop(signal.SIGKILL)
    owner.start(wait_for='read')


def _is_mirrored(owner: Node) -> bool:
    master = rosgraph.Master('/harness')
    return all(master.hasParam(f'{owner.name}/rosslt/{name}') for name in NAMES)


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
