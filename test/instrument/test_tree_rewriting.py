"""A rewritten program does what it did before, and its numbers know where they come from."""

import sys
import traceback
import types

import pytest

from rosslt import node, values
from rosslt.instrument.tree_rewriting import rewrite
from support.programs import run_rewritten

PROGRAMS = {
    'arithmetic': """\
x = 1 + 2.5 * 3 - -4 / 2 ** 2
y = (x, -x, +x, x // 2, x % 3, divmod(7, 2), abs(-3.5), round(2.567, 2))
""",
    'types': 'a = [type(v).__mro__[1] is not None for v in (1, 2.0)]\nb = isinstance(1, int), isinstance(2.0, float)\n',
    'text': "a = '%d %5.2f %s' % (3, 2.5, 1e9)\nb = f'{3.5:.1f} {7}'\nc = str(2.5) + repr(1e-7) + '{}'.format(0.1)\n",
    'containers': """\
a = {1: 2.0, "b": 3}
b = [i * 2 for i in range(4)]
c = sorted({3.0, 1.0, 2.0})
d = [1, 2, 3][1]
""",
    'conversions': 'a = float(3)\nb = int(2.7)\nc = float("1.5")\nd = int("12", 8)\ne = complex(1, 2)\nf = bool(0.0)\n',
    'control': """\
x = 0
for i in range(5):
    x += i * 2
    if x > 6: break
else:
    x = -1
while x > 3: x -= 1
""",
    'functions': """\
def f(a, b=2.0, *c, d=3):
    return a + b + d
x = f(1), f(1, 4), f(1, d=0.5)
g = lambda v: v * 2.0
y = g(3)
""",
    'classes': """\
class A:
    gain = 2.0
    def __init__(self):
        self.n = 0
    def step(self):
        self.n += 1
        return self.n * self.gain
a = A()
x = [a.step() for _ in range(3)]
del a, A
""",
    'from math import *': """\
from math import *
x = sin(0.5) + cos(pi / 3) + atan2(1, 2) + sqrt(2.0) + hypot(3, 4)
del pi
""",
    'import math': """\
import math
import math as m
x = math.sin(0.5), m.floor(2.7), math.radians(90), math.pi * 2, math.fsum([0.1, 0.2])
del math, m
""",
    'in place': 'x = [1, 2]\ny = x\nx += [3.5]\nt = 1\nt += 0.5\nt *= 2\n',
    'global': 'n = 0\ndef f():\n    global n\n    n = n + 1\n    return n * 2.0\nx = [f(), f(), f()]\n',
    'unpacking': 'a, (b, *c) = 1.0, (2, 3, 4.5)\nx = [*c, *(1, 2)]\n',
    'exceptions': """\
try:
    x = 1 / 0
except ZeroDivisionError as error:
    y = str(error)
finally:
    z = 2.0
""",
    'numpy': """\
import numpy as np
a = np.array([1.0, 2.0, 3])
x = (a * 2 + np.sin(a)).tolist(), float(np.dot(a, a)), np.zeros((2, 2)).shape, a.dtype.name, repr(a)
y = (np.linspace(0, 1.0, 5)[1:3] / 3).sum(), np.arange(0.0, 1.0, 0.25).tolist()
v = np.cross([1.0, 0, 0], [0, 1.0, 0]).tolist()
z = np.eye(3)
z[0, 1] = 2.5
w = np.linalg.inv(z).tolist(), np.linalg.norm(z), z.max(), z.T.tolist(), (z @ a).tolist()
del np, a, z
""",
    'a sum of objects': """
class Vector:
    sums = 0
    def __init__(self, x): self.x = x
    def __add__(self, other):
        Vector.sums += 1
        return Vector(self.x + getattr(other, 'x', other))
    __radd__ = __add__
x = sum([Vector(1.5), 2.5, Vector(2.0)]).x, Vector.sums
del Vector
""",
    'in place, of what the right side replaces': """
import numpy
class Thing: pass
class Node:
    gain = 2.5
    def __init__(self):
        self.now = self.before = Thing()
        self.now.x = 10.0
    def step(self):
        self.now = Thing()
        self.now.x = 100.0
        return 3.0
first, second = Node(), Node()
def advance(node): node.now.x += node.gain * node.step()
first.now.x += first.gain * first.step()
advance(second)
x = first.before.x, first.now.x, second.before.x, second.now.x
del numpy, Thing, Node, first, second, advance
""",
    'in place, of what is another thing each time': """
import numpy
class Thing: x = 1.0
class Things:
    def __init__(self): self.all, self.last = [Thing(), Thing()], -1
    @property
    def next(self):
        self.last += 1
        return self.all[self.last]
things, gain = Things(), 2.5
things.next.x += gain
x = [thing.x for thing in things.all]
del numpy, Thing, Things, things
""",
    'in place, of a global that the right side replaces': """
import numpy
class Thing: x = 1.0
first = second = Thing()
gain = 2.5
def step():
    global first
    first = Thing()
    return gain
first.x += gain * step()
x = second.x, first.x
del numpy, Thing, first, second, step
""",
    'comparing classes that cannot be hashed': """
class Meta(type):
    def __eq__(self, other): return True
class A(metaclass=Meta): pass
class B: pass
x = A is B, A is not B, A() is B(), A is A is B, type(A()) is A
del Meta, A, B
""",
    'comparing numbers that are computed anew': """
class Seen:
    last, changes = None, 0
    def see(self, value):
        if value is not self.last: self.changes += 1
        self.last = value
seen, gain = Seen(), 1.5
for _ in range(3): seen.see(gain * 2.0)
x = seen.changes
for _ in range(3): seen.see(gain)
y = seen.changes, gain * 2 > 2
n = 3 - 1
m = 4 - 2
z = n is m, n * 1000 is n * 1000
del Seen, seen
""",
}


def plain_run(text):
    names = {'__name__': 'program', '__file__': '/nowhere/program.py'}
    exec(compile(text, '/nowhere/program.py', 'exec'), names)
    return names


def shown(names):
    return {
        name: repr(values.untracked(value))
        for name, value in names.items()
        if not name.startswith('__') and not callable(value) and 'module' not in type(value).__name__.lower()
    }


@pytest.mark.parametrize('text', PROGRAMS.values(), ids=PROGRAMS)
def test_a_rewritten_program_computes_what_it_did(text):
    assert shown(run_rewritten(text)) == shown(plain_run(text))


def test_numbers_keep_their_provenance_through_conversions_and_functions():
    names = run_rewritten('import math\nx = float(2.5)\ny = math.sin(x) + int(3.0)\nz = round(x) + abs(-x)\n')
    assert all(values.is_tracked(names[name]) for name in 'xyz')


def test_a_state_carries_no_provenance_on():
    names = run_rewritten(
        """\
t = 0.0
v = 2.0
while True:
    t = t + v * 0.1
    if t > 1: break
    sleep = len
    sleep("")
x = t * 3.0
"""
    )
    assert not values.is_tracked(names['t'])
    assert values.is_tracked(names['x'])


def test_a_state_that_starts_with_a_tracked_value_does_not_grow():
    names = run_rewritten('start = 2.0\nt = start\nfor i in range(50):\n    t += 1\n')
    assert not values.is_tracked(names['t'])


STATE_MACHINE = """
STOPS = [{{'x': 1.5, 'y': 2.5}}, {{'x': 4.5, 'y': -1.5}}]
LIFT = 0.25


class Patrol:
    def __init__(self):
        self.state = 'wait'
        self.passed = 0.0

    def wait(self, passed, lift):
        return {handed}

    def step(self):
        handlers = {{'wait': self.wait, 'drive': self.wait}}
        {statement}
        return pose


patrol = Patrol()
for _ in range(3):
    pose = patrol.step()
"""


@pytest.mark.parametrize(
    ('handed', 'statement'),
    [
        ("('drive', STOPS[0]['x'])", 'self.state, pose = handlers[self.state](self.passed, LIFT)'),
        ("('drive', (STOPS[0]['x'], 1.0))", 'self.state, (pose, self.y) = handlers[self.state](self.passed, LIFT)'),
        ("(STOPS[0]['x'] + lift, passed + lift)", 'pose, self.passed = self.wait(self.passed, LIFT)'),
        ('(passed + lift, lift)', 'self.passed, pose = self.wait(self.passed, 0.5)'),
        ("(passed + lift, STOPS[1]['y'])", '[self.passed, pose] = self.wait(self.passed, LIFT)'),
    ],
)
def test_what_is_assigned_beside_a_state_keeps_its_provenance(handed, statement):
    names = run_rewritten(STATE_MACHINE.format(handed=handed, statement=statement))
    assert values.is_tracked(names['pose'])
    assert not values.is_tracked(names['patrol'].state)
    assert names['patrol'].passed == 0.0 or not values.is_tracked(names['patrol'].passed)


@pytest.mark.parametrize('statement', ['x, y = y, 0.5 * x', 'x, y = turned(x, y)'])
def test_states_that_are_assigned_together_do_not_grow(statement):
    names = run_rewritten(
        f'turned = lambda x, y: (y + 0.5, 0.5 * x)\nx, y = 1.0, 2.0\nwhile True:\n    {statement}\n'
        '    if y < 0.6: break\n    sleep = len\n    sleep("")\n'
    )
    assert not values.is_tracked(names['x'])
    assert not values.is_tracked(names['y'])


def test_lists_are_extended_in_place_where_they_are_carried_on():
    names = run_rewritten(
        'p = []\nq = p\nwhile True:\n    p += [1.5]\n    if len(p) > 2: break\n    spin = len\n    spin("")\n'
    )
    assert names['q'] is names['p']
    assert all(map(values.is_tracked, names['p']))


def test_a_traceback_shows_the_lines_of_the_file(tmp_path):
    path = tmp_path / 'program.py'
    text = 'def f(x):\n    y = 2.0 * x\n    return y / (x - 3)\n\nf(3)\n'
    path.write_text(text)
    with pytest.raises(ZeroDivisionError) as raised:
        run_rewritten(text, str(path))
    frames = [frame for frame in traceback.extract_tb(raised.value.__traceback__) if frame.filename == str(path)]
    assert [(frame.lineno, frame.line) for frame in frames] == [(5, 'f(3)'), (3, 'return y / (x - 3)')]


@pytest.mark.parametrize('text', ['x = = 1', 'print "hello"', 'def f(:'])
def test_a_syntax_error_is_the_one_of_python(text):
    with pytest.raises(SyntaxError) as ours:
        rewrite(text.encode(), '/nowhere/program.py', '/nowhere/program.py')
    with pytest.raises(SyntaxError) as theirs:
        compile(text, '/nowhere/program.py', 'exec')
    assert (ours.value.msg, ours.value.lineno, ours.value.offset) == (
        theirs.value.msg,
        theirs.value.lineno,
        theirs.value.offset,
    )


def test_a_docstring_and_future_imports_stay_first():
    names = run_rewritten('"""What it does."""\nfrom __future__ import annotations\nx: Nothing = 2.0\n')
    assert names['__doc__'] == 'What it does.'
    assert names['x'] == 2.0


def test_names_of_the_program_go_before_conversions():
    names = run_rewritten('def float(x):\n    return "mine"\ny = float(2.0)\n')
    assert names['y'] == 'mine'


@pytest.mark.parametrize('name', ['float', 'int', 'sum', 'type'])
def test_names_of_a_star_import_go_before_conversions(name, monkeypatch):
    brought = types.ModuleType('brought')
    setattr(brought, name, lambda x: 'mine')
    monkeypatch.setitem(sys.modules, 'brought', brought)
    assert run_rewritten(f'from brought import *\ny = {name}([2.0])\n')['y'] == 'mine'


@pytest.mark.parametrize('beside', ['from math import *', 'class Box:\n    float = int = sum = type = None'])
def test_conversions_keep_their_provenance_beside_other_things_of_their_names(beside):
    text = f'{beside}\nx = 2.5\na, b, c = float(x), int(x), sum([x, 1])\nd = type(x) is float\n'
    names = run_rewritten(text)
    assert (names['a'], names['b'], names['c'], names['d']) == (2.5, 2, 3.5, True)
    assert all(values.is_tracked(names[name]) for name in 'abc')


@pytest.mark.parametrize('target', ['total', 'box.size', 'self.size'])
def test_what_is_computed_in_place_by_a_simple_target_sees_ints_beside_plain_floats(target):
    text = f"""
class Box:
    def grow(self, box):
        total = box.size = self.size = float('0.5')
        {target} += n * len('abc')
        return {target}
n = 2
x = Box().grow(Box())
"""
    names = run_rewritten(text)
    assert names['x'] == 6.5
    assert values.is_tracked(names['x'])


FRACTIONS = {
    'a quotient': 'x = n / 4',
    'a quotient in a sum': 'x = 3 - n / 4',
    'a product with a fraction': 'x = -(3 * 0.5)',
    'quotients in a tuple': 'x, z = n / 4, n / 2',
}


@pytest.mark.parametrize('statement', FRACTIONS.values(), ids=FRACTIONS)
def test_a_plain_float_beside_a_fraction_is_not_looked_at(statement):
    text = f"half = float('0.5')\nn = 3\n{statement}\ny = half - x\n"
    made = rewrite(text.encode(), '/nowhere/program.py', '/nowhere/program.py')
    assert '__rosslt_sub__' not in made.code.co_names
    assert values.is_tracked(run_rewritten(text)['y'])


@pytest.mark.parametrize(
    'expression', ['round(n / 4)', 'int(n / 2)', 'n // 2', '7 if n > 5 else n / 2', 'n and 7 or 0.5']
)
def test_a_plain_float_beside_a_whole_number_keeps_its_source(expression):
    names = run_rewritten(f"half = float('0.5')\nn = 6\nx = {expression}\ny = half - x\n")
    assert type(values.untracked(names['x'])) is int
    assert values.is_tracked(names['y'])


def test_other_encodings_are_read():
    made = rewrite('# -*- coding: latin-1 -*-\ns = "é"; x = 2.0\n'.encode('latin-1'), '/nowhere/a.py', '/nowhere/a.py')
    (literal,) = made.literals
    assert (literal.line, literal.column) == (2, 14)


DETOURS = {
    'a new value beside the old one': """\
gain = 2.0
class Filter:
    def __init__(self):
        self.x = 0.0
    def step(self, z):
        x_new = self.x + gain * (z - self.x)
        self.x = x_new
        return self.x
f = Filter()
state, given = [f.step(z) for z in (1.0, 2.0)][-1], gain * 3
""",
    'the old value beside the new one': """\
gain, error = 2.0, 1.0
estimate = 0.0
def step(z):
    global estimate
    last = estimate
    estimate = last + gain * (z - last)
    return estimate
state, given = [step(z) for z in (1.0, 2.0)][-1], gain * 3
""",
    'several at once': """\
gain = 2.0
class Robot:
    def __init__(self):
        self.x, self.y = 0.0, 0.0
    def step(self, t):
        x_new, y_new = self.x + gain * t, self.y + 1.5 * t
        self.x, self.y = x_new, y_new
        return self.x + self.y
r = Robot()
state, given = [r.step(t) for t in (1.0, 2.0)][-1], gain * 3
""",
    'an array': """\
import numpy as np
gain = 2.0
class Filter:
    def __init__(self):
        self.x = np.zeros((2, 1))
        self.A = np.array([[1.0, 0.1], [0.0, 1.0]])
    def step(self, u):
        self.x = self.A @ self.x + np.array([[0.5], [1.0]]) * u
        return self.x[0, 0]
f = Filter()
state, given = [f.step(u) for u in (1.0, 2.0)][-1], gain * 3
""",
    'a list that is written out': """\
gain, most = 2.0, 4.0
class Robot:
    def __init__(self):
        self.pose = [0.0, 0.0, 0.0]
        self.heard = [0.0, 0.0]
    def step(self, t):
        x, y, last = self.pose
        x += gain * t
        self.pose = [x, y - 1.5 * t, t * most]
        self.heard = [gain * t, self.heard[0]]
        return self.pose[0] + self.pose[1]
r = Robot()
state = [r.step(t) for t in (1.0, 2.0)][-1]
given = gain if all(isinstance(n, type(gain)) for n in (r.pose[2], *r.heard)) else None
""",
    'an object that is made anew': """\
import collections
gain = 2.0
Pose = collections.namedtuple('Pose', 'x y')
class Place:
    def __init__(self, pose, most):
        self.pose, self.most = pose, most
class Robot:
    def __init__(self):
        self.pose, self.place = Pose(0.0, 0.0), Place(Pose(0.0, 0.0), 0.0)
        self.known = {'x': 0.0, 'most': 0.0}
    def step(self, t):
        self.pose = self.pose._replace(x=self.pose.x + gain * t)
        self.place = Place(Pose(self.place.pose.x + gain * t, 0.0), most=gain)
        self.known = {'x': self.known['x'] + gain, 'most': gain}
        return self.pose.x + self.place.pose.x + self.known['x']
r = Robot()
state = [r.step(t) for t in (1.0, 2.0)][-1]
given = r.place.most if isinstance(r.known['most'], type(gain)) else None
""",
    'a controller and what it controls': """\
gain, goal, x = 2.0, 5.0, 0.0
sleep = len
while True:
    command = gain * (goal - x)
    moved = x + command * 0.1
    x = moved
    if x > 1: break
    sleep("")
state, given = x, command
""",
}


@pytest.mark.parametrize('text', DETOURS.values(), ids=DETOURS)
def test_a_state_that_is_carried_on_by_other_variables_carries_no_provenance_on(text):
    names = run_rewritten(text)
    assert not values.is_tracked(names['state'])
    assert values.is_tracked(names['given'])


@pytest.mark.parametrize(
    'formula',
    [
        'math.pi * -2 / 3',
        'plain * (most - least)',
        'plain + most',
        'plain - n',
        'turned(3)',
        '[plain * i for i in (1, 2)][0]',
    ],
)
def test_a_plain_float_on_the_left_of_an_int_takes_its_provenance(formula):
    text = f"""\
import math
plain = math.pi
least = 1
most = 10
n = 4
def turned(times):
    return plain * times
x = {formula}
del math, turned
"""
    names = run_rewritten(text)
    assert values.is_tracked(names['x'])
    assert shown(names) == shown(plain_run(text))


@pytest.mark.parametrize(
    'text',
    [
        'x = 0\ny = 0\nz = x is y, x is not y\n',
        'x = 2.5\ny = x\nz = x is y\n',
        't = (1, 2.5)\nu = t\nz = t is u, t is None\n',
    ],
)
def test_what_is_the_same_number_is_the_same_object(text):
    assert run_rewritten(text)['z'] == plain_run(text)['z']


def test_the_type_of_a_number_is_the_one_it_has_without_provenance():
    names = run_rewritten('x = 2.5\nn = 3\nz = type(x) is float, type(n) == int, type(x)("1.5"), type("a") is str\n')
    assert names['z'] == (True, True, 1.5, True)


def test_the_default_of_a_parameter_keeps_its_provenance():
    text = 'class Controller:\n    def __init__(self, gain=2.0, offset=1):\n'
    text += '        self.gain, self.offset = gain, offset\n'
    text += 'c = Controller()\nx = c.gain * 0.5\ny = c.offset / 4\ndel c, Controller\n'
    names = run_rewritten(text)
    assert values.is_tracked(names['x'])
    assert values.is_tracked(names['y'])
    assert shown(names) == shown(plain_run(text))


SUMS = """\
n = 2
plain = float('0.5')
a = sum([plain, n])
b = sum(k * 0.1 for k in range(7))
c = sum([plain, n, 3], plain)
d = sum([1, 2]), sum([[1], [2]], []), sum(())
e = plain
e *= n
class Box: pass
box = Box()
box.size = plain
box.size += n
f = box.size
values = [1, 2]
other = values
values += [n]
"""


def test_sums_and_what_is_computed_in_place_see_ints_beside_plain_floats():
    plain = {}
    exec(SUMS, plain)
    ours = run_rewritten(SUMS)
    for name in 'abcdef':
        assert ours[name] == plain[name]
    assert [values.untracked(one) for one in ours['values']] == plain['values']
    assert ours['other'] is ours['values']
    assert all(values.is_tracked(ours[name]) for name in 'abcef')


def test_what_is_added_to_an_element_of_a_kept_list_is_the_step_of_a_state(monkeypatch):
    monkeypatch.setattr(node.MEMORY, 'has_begun', False)  # in a round, it would be plain
    names = run_rewritten(
        """
class Map:
    def __init__(self):
        self.free = -0.4
        self.cells = [[0.5 for i in range(3)] for j in range(3)]

    def see(self):
        fresh = [1.0, 2.0]
        fresh[0] += self.free
        self.row = [0.5, 1.5]
        self.row[0] += self.free
        for _ in range(20):
            self.cells[1][2] += self.free
        return fresh[0], self.row[0]


made = Map()
for _ in range(10):
    fresh, row = made.see()
cell = made.cells[1][2]
"""
    )
    assert names['cell']._size < 300  # two operations for each step would be more
    assert names['cell'] == pytest.approx(0.5 - 200 * 0.4)
    assert all(values.is_tracked(names[name]) for name in ('fresh', 'row'))


def test_a_covariance_in_lists_is_a_state_and_what_is_put_into_a_list_is_none():
    names = run_rewritten(
        """
def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


class Filter:
    def __init__(self):
        self.f = [[1.25 if i == j else 0.03125 for j in range(4)] for i in range(4)]
        self.p = [[0.5 if i == j else 0.0 for j in range(4)] for i in range(4)]
        self.path = []

    def step(self):
        self.p = multiply(multiply(self.f, self.p), self.f)
        self.path = self.path + [self.f[0][0] * 2.0]


made = Filter()
sizes = []
for _ in range(40):
    made.step()
    sizes.append(max(getattr(one, '_size', 0) for row in made.p for one in row))
tracked = [hasattr(one, '_record') for one in made.path]
"""
    )
    assert max(names['sizes']) < 1000
    assert all(names['tracked'])
