"""Two nodes of the same parts beside each other, in rounds of simulated time: in the plain one a hand sets the names
that a change is to reach in the other."""

import textwrap

import rospy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

import rosslt
from rosslt import node, srv
from support.processes import wait_until
from support.unmodified import Unmodified

#: The round in which a number is changed, and the last round.
CHANGED, LAST = 4, 12

NODE = """\
import importlib, time
import rospy{imports}
from std_msgs.msg import String
{early}
{node}.init_node('{name}')
pub = rospy.Publisher('{name}/said', String, queue_size=100)
{late}
while not (pub.get_num_connections() and rospy.Time.now()):
    time.sleep(0.01)

def main():
    kept = {number}
    computed = {number} / 2 + 1
    count = -1
    due = rospy.Time.now()
    while not rospy.is_shutdown():
        count += 1
        if {by_hand} and count == {changed}:
            kept = {other}
            computed = {other} / 2 + 1
            for part in parts:
                part.by_hand()
        said = ['%r %r' % (kept * 1.0, computed * 1.0)] + [part.say(count) for part in parts]
        pub.publish('%d|%s' % (count, '|'.join(said)))
        due += rospy.Duration(0, 10**8)
        while rospy.Time.now() < due:
            time.sleep(0.002)  # rospy's own sleep misses a time that comes as it begins

main()
"""

PARTS = "parts = [importlib.import_module('part%d' % number) for number in range({})]"

PART = """\
import argparse, collections, dataclasses, functools, threading, types
import {numpy} as np
import rospy{imports}
from geometry_msgs.msg import Point, Pose
wake, done = threading.Event(), threading.Event()
{before}
def say(count):
    {names}
    said = ''
{use}
    return said
def by_hand():
{hand}
"""

#: How a node may keep a number: {name: (statements, what reads it, by hand)}. `READ` is the number, `HAND` the other
#: one.
KINDS = {
    'global': ('kept = READ', 'kept', 'globals()["kept"] = HAND'),
    'computed global': ('half = READ / 2', 'half', 'globals()["half"] = HAND / 2'),
    'attribute': ('class A: pass\na = A()\na.x = READ', 'a.x', 'a.x = HAND'),
    'computed attribute': ('class A: pass\na = A()\na.x = READ * 2 + 1', 'a.x', 'a.x = HAND * 2 + 1'),
    'attribute of a class': ('class A:\n    x = READ', 'A.x', 'A.x = HAND'),
    'inherited attribute': ('class B:\n    x = READ\nclass A(B): pass\na = A()', 'a.x', 'B.x = HAND'),
    'slot': ('class A:\n    __slots__ = ("x",)\na = A()\na.x = READ', 'a.x', 'a.x = HAND'),
    'property': (
        'class A:\n    def __init__(self): self._x = READ\n    x = property(lambda self: self._x)\na = A()',
        'a.x',
        'a._x = HAND',
    ),
    'dataclass': ('@dataclasses.dataclass\nclass A:\n    x: float\na = A(READ)', 'a.x', 'a.x = HAND'),
    'default of a dataclass': (
        '@dataclasses.dataclass\nclass A:\n    x: float = READ\na = A()',
        'a.x',
        'a.x = A.x = HAND',
    ),
    'frozen dataclass': (
        '@dataclasses.dataclass(frozen=True)\nclass A:\n    x: float\na = A(READ)',
        'a.x',
        'vars(a)["x"] = HAND',
    ),
    'namedtuple': (
        'A = collections.namedtuple("A", "x y")\nclass B: pass\nb = B()\nb.a = A(READ, 1.0)',
        'b.a.x',
        'b.a = A(HAND, 1.0)',
    ),
    'tuple': ('kept = (1.0, READ)', 'kept[1]', 'globals()["kept"] = (1.0, HAND)'),
    'tuple in a tuple': ('kept = (1.0, (READ, 2.0))', 'kept[1][0]', 'globals()["kept"] = (1.0, (HAND, 2.0))'),
    'list': ('kept = [1.0, READ]', 'kept[1]', 'kept[1] = HAND'),
    'list of lists': ('kept = [[1.0], [READ]]', 'kept[1][0]', 'kept[1][0] = HAND'),
    'list of tuples': ('kept = [(1.0, READ)]', 'kept[0][1]', 'kept[0] = (1.0, HAND)'),
    'own list': ('class L(list): pass\nkept = L([READ])', 'kept[0]', 'kept[0] = HAND'),
    'dict': ('kept = {"x": READ}', 'kept["x"]', 'kept["x"] = HAND'),
    'dict of dicts': ('kept = {"a": {"x": READ}}', 'kept["a"]["x"]', 'kept["a"]["x"] = HAND'),
    'own dict': ('class D(dict): pass\nkept = D(x=READ)', 'kept["x"]', 'kept["x"] = HAND'),
    'defaultdict': (
        'kept = collections.defaultdict(float)\nkept["x"] = READ',
        'kept["x"]',
        'kept["x"] = HAND',
    ),
    'ordered dict': ('kept = collections.OrderedDict(x=READ)', 'kept["x"]', 'kept["x"] = HAND'),
    'element that moves': (
        'kept = [1.0, READ, 2.0]',
        '(kept.append(kept.pop(0)) or max(kept))',
        'kept[kept.index(max(kept))] = HAND',
    ),
    'element of a deque that rotates': (
        'kept = collections.deque([1.0, READ])',
        '(kept.rotate() or max(kept))',
        'kept[kept.index(max(kept))] = HAND',
    ),
    'own user dict': ('class D(collections.UserDict): pass\nkept = D(x=READ)', 'kept["x"]', 'kept["x"] = HAND'),
    'user dict': ('kept = collections.UserDict(x=READ)', 'kept["x"]', 'kept["x"] = HAND'),
    'user list': ('kept = collections.UserList([READ])', 'kept[0]', 'kept[0] = HAND'),
    'chain of dicts': ('kept = collections.ChainMap({}, {"x": READ})', 'kept["x"]', 'kept.maps[1]["x"] = HAND'),
    'deque': ('kept = collections.deque([READ, 1.0])', 'kept[0]', 'kept[0] = HAND'),
    'closure': (
        'def make():\n    x = READ\n    def read(): return x\n    def put(y):\n        nonlocal x\n        x = y\n'
        '    return read, put\nread, put = make()',
        'read()',
        'put(HAND)',
    ),
    'lambda': (
        'def make(x): return lambda: x\nread = make(READ)',
        'read()',
        'read.__closure__[0].cell_contents = HAND',
    ),
    'default argument': ('def read(x=READ): return x', 'read()', 'read.__defaults__ = (HAND,)'),
    'keyword argument': ('def read(*, x=READ): return x', 'read()', 'read.__kwdefaults__["x"] = HAND'),
    'attribute of a function': ('def read(): pass\nread.x = READ', 'read.x', 'read.x = HAND'),
    'partial': (
        'def f(x): return x\nread = functools.partial(f, x=READ)',
        'read()',
        'read.keywords["x"] = HAND',
    ),
    'variable of a thread': (
        'box = [0.0]\nset_to = []\ndef work():\n    kept = READ\n    done.set()\n'
        '    while True:\n        wake.wait()\n        wake.clear()\n'
        '        if set_to: kept = set_to.pop()\n        box[0] = kept * 1\n        done.set()\n'
        'threading.Thread(target=work, daemon=True).start()\ndone.wait()\ndone.clear()\n'
        'def read():\n    wake.set()\n    done.wait()\n    done.clear()\n    return box[0]',
        'read()',
        'set_to.append(HAND)',
    ),
    'message': ('kept = Point(READ, 0.0, 0.0)', 'kept.x', 'kept.x = HAND'),
    'list of messages': (
        'kept = [Pose(), Pose()]\nkept[1].position.y = READ + 1',
        'kept[1].position.y',
        'kept[1].position.y = HAND + 1',
    ),
    'generator': (
        'def numbers():\n    x = READ\n    while True: yield x\nkept = numbers()\nnext(kept)\nset_to = []',
        '(set_to or [next(kept)])[0]',
        'set_to[:] = [HAND]',
    ),
    'coroutine': (
        'class Once:\n    def __await__(self): yield box[:]\n'
        'box = []\nasync def numbers():\n    x = READ\n    while True:\n        box[:] = [x]\n        await Once()\n'
        'kept = numbers()\nkept.send(None)\nset_to = []',
        '(set_to or kept.send(None))[0]',
        'set_to[:] = [HAND]',
    ),
    'asynchronous generator': (
        'async def numbers():\n    x = READ\n    while True: yield x\n'
        'def sent(awaited):\n    try: awaited.send(None)\n    except StopIteration as stop: return stop.value\n'
        'kept = numbers()\nsent(kept.__anext__())\nset_to = []',
        '(set_to[0] if set_to else sent(kept.__anext__()))',
        'set_to[:] = [HAND]',
    ),
    'namespace': ('kept = types.SimpleNamespace(x=READ)', 'kept.x', 'kept.x = HAND'),
    'arguments': ('kept = argparse.Namespace()\nkept.x = READ', 'kept.x', 'kept.x = HAND'),
    'array': ('kept = np.array([1.0, READ])', 'float(kept[1])', 'kept[1] = HAND'),
    'array that was computed': ('kept = np.ones(3) * READ', 'float(kept.sum())', 'kept[:] = HAND'),
    'array in two dimensions': ('kept = np.zeros((2, 2))\nkept[1, 0] = READ', 'float(kept[1, 0])', 'kept[1, 0] = HAND'),
    'number of an array': ('kept = (np.ones(2) * READ)[0]', 'float(kept)', 'globals()["kept"] = np.float64(HAND)'),
    'array of objects': ('kept = np.array([READ, None], object)', 'kept[0]', 'kept[0] = HAND'),
    'object in a list': ('class A: pass\nkept = [A()]\nkept[0].x = READ', 'kept[0].x', 'kept[0].x = HAND'),
}

#: What a node may do with a number: statements that append to `said`.
USES = {
    'number': "said += repr(READ * 1.0) + ' '",
    'product': "said += repr(READ * 3.5 - 1.0) + ' '",
    'if': "said += 'high ' if READ > LIMIT else 'low '",
    'while': "n = 0\nwhile n < READ: n += 1\nsaid += '%d ' % n",
    'index': "said += 'abcdefghijklmnopqrstuvwxyz'[int(READ) % 26] + ' '",
    'text': "said += '%.3f ' % READ",
}


class Pair:
    """A plain node and an unmodified one under `rosslt run`, in rounds of simulated time."""

    def __init__(self):
        self.said = {'plain': [], 'tracked': []}
        self._moments = 1
        rospy.set_param('/use_sim_time', True)
        self._clock = rospy.Publisher('/clock', Clock, latch=True, queue_size=1)
        self._heard = [
            rospy.Subscriber(f'/{name}/said', String, lambda message, said=said: said.append(message.data))
            for name, said in self.said.items()
        ]
        self._publish()

    def _publish(self):
        self._clock.publish(Clock(clock=rospy.Time(*divmod(1000 * 10**9 + self._moments * 10**8, 10**9))))

    def rounds(self, last):
        """Have both nodes go on until the round of that number."""

        def is_there():
            return all(said and int(said[-1].split('|')[0]) >= last for said in self.said.values())

        def tick():
            # Both do a round at each moment, the first one included; while one has yet to do it, time stands still.
            if all(len(said) == self._moments for said in self.said.values()) and not is_there():
                self._moments += 1
                self._publish()
            return is_there()

        wait_until(tick, lambda: f'round {last}: {[said[-1:] for said in self.said.values()]}')

    def close(self):
        for name in ('/use_sim_time', '/plain', '/tracked'):
            if rospy.has_param(name):
                rospy.delete_param(name)
        for one in (self._clock, *self._heard):
            one.unregister()


#: The number that the main function keeps in its variables, and the other one.
LOCAL, OTHER_LOCAL = 1.75, 0.375


def indented(text):
    return textwrap.indent(text, '    ')


def write_node(folder, name, parts, source):
    """Write the modules of a node, and return its own text."""
    is_written = source == 'location' and name == 'tracked'  # a node that was written with rosslt
    imports = ', rosslt' if is_written else ''
    for number, (before, names, use, hand) in enumerate(parts):
        text = PART.format(
            before=before,
            names=names,
            use=indented(use),
            hand=indented(hand),
            imports=imports,
            numpy='rosslt.numpy' if is_written else 'numpy',
        )
        (folder / f'part{number}.py').write_text(text)
    # A module may be imported before there is a node; one that reads a private parameter may not.
    load = PARTS.format(number + 1)
    return NODE.format(
        name=name,
        imports=imports,
        node='rosslt' if is_written else 'rospy',
        early='' if source == 'parameter' else load,
        late=load if source == 'parameter' else '',
        number=read_once(name, source, LOCAL),
        other=OTHER_LOCAL,
        by_hand=name == 'plain',
        changed=CHANGED,
    )


def read_once(name, source, number):
    """An expression for a number that a node reads once."""
    if source == 'parameter':
        return f"rospy.get_param('~n{str(number).replace('.', '_')}', {number})"
    if source == 'location' and name == 'tracked':
        return f"rosslt.location({number}, name='n{str(number).replace('.', '_')}')"
    return repr(number)


def sources_of(changes):
    """{Source: other value} of {value of a location: other value}."""
    listed = rospy.ServiceProxy('/tracked/rosslt/list_locations', srv.ListLocations)(all=True).locations
    by_value = {}
    for one in listed:
        by_value.setdefault(one.value, []).append(rosslt.Source('/tracked', one.id))
    return {source: other for value, other in changes.items() for source in by_value[repr(value)]}


def said_by(pair, tmp_path, parts, source, changes):
    """What both nodes say in each round, [[text of each part, ...], ...]; the numbers are changed before CHANGED."""
    folders = {name: tmp_path / name for name in ('plain', 'tracked')}
    for folder in folders.values():
        folder.mkdir()
    codes = {name: write_node(folder, name, parts(name), source) for name, folder in folders.items()}
    is_run = source != 'location'
    with Unmodified(folders['plain'], 'plain', codes['plain'], tracked=False) as plain, Unmodified(
        folders['tracked'], 'tracked', codes['tracked'], tracked=is_run
    ) as tracked:
        pair.rounds(CHANGED - 1)
        node.request_values(sources_of(changes))
        pair.rounds(LAST)
        assert plain.process.poll() is tracked.process.poll() is None
    found = [dict(said.split('|', 1) for said in pair.said[name]) for name in ('plain', 'tracked')]
    return [[one[str(count)].split('|') for count in range(LAST + 1)] for one in found]


def differences(plain, tracked, names):
    """What the nodes say differently: (name of the part, round, what the tracked one says, what the plain one says)."""
    return [
        (names[at], count, ours, theirs)
        for count, (said, other) in enumerate(zip(tracked, plain))
        for at, (ours, theirs) in enumerate(zip(said, other))
        if ours != theirs
    ]
