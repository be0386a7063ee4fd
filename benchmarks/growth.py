"""How each cost grows: with operations, sources, leaves, subscribers, nodes and locations, from 10 to 10,000.

Each number is the quickest of several runs, in microseconds for one of what is counted: a cost that grows in proportion
stays the same along its row, one that does not grow at all falls by ten from column to column. `copying` is the limit
of memory traffic: as many bytes as that many values take are copied. `plain` is the same without tracking.

Subscribers are connections that take what is written and do nothing with it. Nodes are processes of their own, at most
MOST_NODES.
"""

import gc
import io
import subprocess
import sys
import time
import warnings
from typing import Any, Callable, Dict, List, Optional, Tuple

import rospy
from geometry_msgs.msg import Point, Pose, PoseArray
from std_msgs.msg import Float64

import rosslt
from rosslt import Source, evaluate, srv, track
from rosslt.messages import decoder, encode

COUNTS = [10, 100, 1000, 10000]
MOST_NODES = 10
RUNS, SECONDS = 15, 0.3

#: A value and its record (see docs/performance.md).
BYTES_OF_A_VALUE = 88

NODE = """
import sys
import rospy, rosslt
from std_msgs.msg import Float64
rosslt.init_node(sys.argv[1])
publisher = rosslt.Publisher('~value', Float64, queue_size=1, latch=True)
publisher.publish(rosslt.location(1.0, name='value'))
rospy.spin()
"""

#: {(what is counted, what is done): {how many: seconds}}
Costs = Dict[Tuple[str, str], Dict[int, float]]


def quickest(do: Callable[[], Any], prepare: Optional[Callable[[], None]] = None) -> float:
    """Seconds that something takes, in the quickest of up to RUNS runs within SECONDS, two at least."""
    found: List[float] = []
    end = time.perf_counter() + SECONDS
    gc.collect()
    gc.disable()
    try:
        while len(found) < 2 or (len(found) < RUNS and time.perf_counter() < end):
            if prepare is not None:
                prepare()
            start = time.perf_counter()
            do()
            found.append(time.perf_counter() - start)
    finally:
        gc.enable()
    return min(found)


def values_of(count: int) -> List[Any]:
    return [track(0.5 + place, Source('/growth', place)) for place in range(count)]


def chain(x: Any, count: int) -> Any:
    """That many operations on one value."""
    for _ in range(count // 2):
        x = x * 1.0001 + 0.5
    return x


def operations(costs: Costs, count: int) -> None:
    """Costs of operations on one value of one source."""
    source = Source('/growth', 0)
    x = track(0.5, source)
    block = bytearray(BYTES_OF_A_VALUE * count)
    costs['operations', 'copying'][count] = quickest(lambda: bytes(block))
    costs['operations', 'plain'][count] = quickest(lambda: chain(0.5, count))
    costs['operations', 'record'][count] = quickest(lambda: chain(x, count))
    made = chain(x, count)
    costs['operations', 'evaluate anew'][count] = quickest(lambda: evaluate(made, {source: 0.75}))
    costs['operations', 'solve back'][count] = quickest(lambda: rosslt.solve(made, 7.5))


def sources(costs: Costs, count: int) -> None:
    """Costs of a sum of as many sources, and of a message that holds it."""
    parts = values_of(count)
    plain = [float(part) for part in parts]
    block = bytearray(BYTES_OF_A_VALUE * count)
    costs['sources', 'copying'][count] = quickest(lambda: bytes(block))
    costs['sources', 'plain'][count] = quickest(lambda: sum(plain))
    costs['sources', 'record'][count] = quickest(lambda: sum(parts))
    made = sum(parts)
    costs['sources', 'solve back'][count] = quickest(lambda: rosslt.solve(made, 7.5))
    costs['sources', 'send'][count], costs['sources', 'receive'][count] = sent_and_received(lambda: Float64(sum(parts)))


def sent_and_received(make: Callable[[], Any]) -> Tuple[float, float]:
    """Seconds that provenance which was not sent before takes, and reading it with its message."""
    box: List[Any] = []
    sending = quickest(lambda: encode(box[0]), lambda: box.__setitem__(slice(None), [make()]))
    message, data, buff = box[0], encode(box[0]), io.BytesIO()
    message.serialize(buff)
    whole = buff.getvalue() + data + len(data).to_bytes(4, 'little') + b'rSLT'
    read = decoder(type(message))
    return sending, quickest(lambda: read(type(message)(), whole))


def leaves(costs: Costs, count: int) -> None:
    """Costs of the poses of an array that has as many tracked leaves, each twice its source."""
    parts = values_of(count)

    def made() -> PoseArray:
        numbers = [2.5 * part for part in parts] + [0.0] * 3
        return PoseArray(poses=[Pose(position=Point(*numbers[at : at + 3])) for at in range(0, count, 3)])

    buff = io.BytesIO()
    plain = rosslt.untracked(made())
    costs['leaves', 'plain'][count] = quickest(lambda: plain.serialize(buff), lambda: buff.__init__())  # type: ignore[misc]
    costs['leaves', 'send'][count], costs['leaves', 'receive'][count] = sent_and_received(made)
    still = made()
    encode(still)
    costs['leaves', 'send the same again'][count] = quickest(lambda: encode(still))


class Listener:
    """A connection that takes what is written, and does nothing with it."""

    done = False
    endpoint_id = 'growth'

    def write_data(self, data: bytes) -> None:
        """Take it."""


def subscribers(costs: Costs, count: int) -> None:
    """Costs of publishing a tracked Pose to as many connections."""
    x, y, z = values_of(3)
    message = Pose(position=Point(x, y, z))
    for what, module, sent in (('plain', rospy, rosslt.untracked(message)), ('publish', rosslt, message)):
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            publisher = module.Publisher('~growth_%s_%d' % (what, count), Pose)
        publisher.impl.connections = [Listener() for _ in range(count)]
        costs['subscribers', what][count] = quickest(lambda publisher=publisher, sent=sent: publisher.publish(sent))
        publisher.impl.connections = []
        publisher.unregister()


def locations(costs: Costs, count: int) -> None:
    """Costs of as many locations in this node."""

    rosslt.location(1.5, name='first_of_%d' % count)  # which looks this file up

    def read_all() -> List[Any]:
        return [rosslt.location(1.5, name='all_of_%d' % count, key=key) for key in range(count)]

    start = time.perf_counter()
    held = read_all()
    costs['locations', 'create'][count] = time.perf_counter() - start
    costs['locations', 'read'][count] = quickest(read_all)
    targets = iter(range(2, 1000))
    costs['locations', 'force one'][count] = quickest(lambda: rosslt.force_value(held[0], float(next(targets))))
    ids = [rosslt.sources(each)[0].location_id for each in held]
    listing = rospy.ServiceProxy('~rosslt/list_locations', srv.ListLocations)
    costs['locations', 'list'][count] = quickest(lambda: listing(location_ids=ids))


def nodes(costs: Costs, count: int) -> None:
    """Costs of a change that moves a location in each of as many nodes."""
    started = [subprocess.Popen([sys.executable, '-c', NODE, 'growth_%d' % place]) for place in range(count)]
    try:
        parts = [
            rosslt.wait_for_message('growth_%d/value' % place, Float64, timeout=60.0).data for place in range(count)
        ]
        targets = iter(range(2, 1000))
        costs['nodes', 'force'][count] = quickest(
            lambda: rosslt.force_value(parts, [float(next(targets))] * count, timeout=20.0)
        )
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait()


def measured() -> Costs:
    """All costs."""
    names = {
        'operations': ('copying', 'plain', 'record', 'evaluate anew', 'solve back'),
        'sources': ('copying', 'plain', 'record', 'solve back', 'send', 'receive'),
        'leaves': ('plain', 'send', 'receive', 'send the same again'),
        'subscribers': ('plain', 'publish'),
        'locations': ('create', 'read', 'force one', 'list'),
        'nodes': ('force',),
    }
    costs: Costs = {(counted, what): {} for counted, kinds in names.items() for what in kinds}
    for measure in (operations, sources, leaves, subscribers, locations):
        for count in COUNTS:
            measure(costs, count)
    for count in (1, 3, MOST_NODES):
        nodes(costs, count)
    return costs


def show(costs: Costs) -> None:
    """Print a table: microseconds for one of what is counted."""
    print('us for each %33s' % '' + ''.join('%10d' % count for count in COUNTS))
    for (counted, what), found in costs.items():
        if counted != 'nodes':
            print('%-14s %-29s' % (counted, what) + ''.join('%10.3f' % (found[each] / each * 1e6) for each in COUNTS))
    for (counted, what), found in costs.items():
        if counted == 'nodes':
            print(
                '%-14s %-29s' % (counted, what)
                + ', '.join('%.0f us for each of %d' % (seconds / each * 1e6, each) for each, seconds in found.items())
            )


def main() -> None:
    rosslt.init_node('growth', anonymous=True, log_level=rospy.WARN)
    show(measured())


if __name__ == '__main__':
    main()
