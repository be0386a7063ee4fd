"""The names of numbers that are part of something else last: they have no line and no column in them."""

import ast

import pytest

from rosslt.instrument.literal_names import literal_names


def names(text):
    """The names of all floats of a text that no name stands for, in their order."""
    tree = ast.parse(text)
    floats = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and type(node.value) is float]
    return literal_names(tree, [(node, None) for node in sorted(floats, key=lambda one: (one.lineno, one.col_offset))])


@pytest.mark.parametrize(
    ('text', 'name'),
    [
        ('POINTS = [(1, 2), (3, 4.5)]', 'POINTS.1.1'),
        ('POINTS = [Point(x=1, y=4.5)]', 'POINTS.0.y'),
        ('POINTS = [Point(1, 4.5)]', 'POINTS.0.1'),
        ('gains = {"kp": {"left": 4.5}}', 'gains.kp.left'),
        ('self.gains["kp"] = 4.5', 'gains.kp'),
        ('self.poses[2].x = 4.5 * scale', 'poses.2.x'),
        ('x, y = 1, 4.5', 'y'),
        ('speed: float = 2 * 4.5', 'speed'),
        ('angle += 4.5', 'angle.step'),
        ('self.battery -= 4.5 * dt', 'battery.step'),
        ('self.x, self.y = self.x + 4.5, 0', 'x.step'),
        ('self.x = other.y + 4.5', 'x'),
        ('yaw = math.radians(4.5)', 'yaw'),
        ('goto(1, 2, 4.5)', 'goto.2'),
        ('rospy.sleep(4.5)', 'sleep'),
        ('robot.arm.move(speed=4.5)', 'move.speed'),
        ('def drive(speed, reach=4.5): pass', 'drive.reach'),
        ('def drive(*, reach=4.5): pass', 'drive.reach'),
        ('class Robot:\n    def drive(self):\n        if error < 4.5: pass', 'drive'),
        ('def drive():\n    return 4.5', 'drive'),
        ('if error < 4.5: pass', None),
    ],
)
def test_name_says_where_a_number_stands(text, name):
    assert names(text) == [name]


PID = """
class PID:
    def __init__(self, kp, ki, kd=0): pass
"""

LIMITS = """
@dataclass(frozen=True)
class Limits:
    kind: ClassVar[int]
    low: float
    high: float
"""

POST = """
Post = namedtuple('Post', 'x y hold')
"""

SPOT = """
class Spot(typing.NamedTuple):
    x: float
    y: float = 0
"""

CLAMP = """
def clamp(value, low, high): pass
"""


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        (PID + 'pid = PID(0.5, 1.5, 2.5)', ['pid.kp', 'pid.ki', 'pid.kd']),
        (PID + 'self.pid = PID(0.5, ki=1.5)', ['pid.kp', 'pid.ki']),
        (PID + 'pids = [PID(0.5, 1.5), PID(2.5, 3.5)]', ['pids.0.kp', 'pids.0.ki', 'pids.1.kp', 'pids.1.ki']),
        (PID + 'pid = PID(0.5)', ['pid']),
        (PID + 'class Mine(PID): pass\npid = Mine(0.5, 1.5)', ['pid.kp', 'pid.ki']),
        (LIMITS + 'limits = Limits(0.5, 1.5)', ['limits.low', 'limits.high']),
        (POST + 'posts = [Post(0.5, 1.5, hold=2.5)]', ['posts.0.x', 'posts.0.y', 'posts.0.hold']),
        (POST.replace('y hold', 'y, hold') + 'post = Post(0.5, 1.5)', ['post.x', 'post.y']),
        (POST.replace("'x y hold'", "['x', 'y'], defaults=[0]") + 'post = Post(0.5, 1.5)', ['post.x', 'post.y']),
        ('Post = collections.namedtuple("Post", ("x", "y"))\nf(Post(0.5, 1.5))', ['f.x', 'f.y']),
        ('Post = NamedTuple("Post", [("x", float), ("y", float)])\npost = Post(0.5, 1.5)', ['post.x', 'post.y']),
        ('class Post(namedtuple("Post", "x y")): pass\npost = Post(0.5, 1.5)', ['post.x', 'post.y']),
        (POST + 'class Mine(Post): pass\npost = Mine(0.5, 1.5)', ['post.x', 'post.y']),
        (SPOT + 'spot = Spot(0.5, 1.5)', ['spot.x', 'spot.y']),
        (CLAMP + 'x = clamp(y, 0.5, 1.5)', ['x.low', 'x.high']),
        (CLAMP + 'clamp(y, 0.5, 1.5)', ['clamp.low', 'clamp.high']),
        ('from a import *' + CLAMP + 'x = clamp(y, 0.5, 1.5)', ['x.low', 'x.high']),
        ('class A:\n def f(self, x, y): self.f(0.5, 1.5)', ['f.x', 'f.y']),
        ('class A:\n @staticmethod\n def f(x, y): pass\n def g(self): self.f(0.5, 1.5)', ['f.x', 'f.y']),
    ],
)
def test_arguments_have_the_names_of_their_parameters(text, expected):
    assert names(text) == expected


@pytest.mark.parametrize(
    'text',
    [
        'from control import PID\npid = PID(0.5, 1.5)',
        PID + 'from control import *\npid = PID(0.5, 1.5)',
        PID + 'from control import PID\npid = PID(0.5, 1.5)',
        PID + PID + 'pid = PID(0.5, 1.5)',
        PID + 'def f(PID):\n    pid = PID(0.5, 1.5)',
        PID + 'PID = other\npid = PID(0.5, 1.5)',
        '@wrapped' + PID + 'pid = PID(0.5, 1.5)',
        PID.replace('PID', 'PID(metaclass=Made)') + 'pid = PID(0.5, 1.5)',
        PID.replace('__init__', 'update') + 'pid = PID(0.5, 1.5)',
        PID.replace('(self', '(*self') + 'pid = PID(0.5, 1.5)',
        LIMITS.replace('float', 'float = field()') + 'pid = Limits(0.5, 1.5)',
        LIMITS.replace('frozen', 'init') + 'pid = Limits(0.5, 1.5)',
        '@wrapped' + CLAMP + 'pid = clamp(0.5, 1.5)',
        POST.replace("'x y hold'", "'x y hold', rename=True") + 'pid = Post(0.5, 1.5)',
        POST.replace("'x y hold'", 'FIELDS') + 'pid = Post(0.5, 1.5)',
        'Post = NamedTuple("Post", [()])\npid = Post(0.5, 1.5)',
        POST.replace('namedtuple', 'record') + 'pid = Post(0.5, 1.5)',
        POST + 'Post = other\npid = Post(0.5, 1.5)',
        POST + 'from posts import *\npid = Post(0.5, 1.5)',
        POST + 'class Mine(Post):\n    def __new__(cls, a, b): pass\npid = Mine(0.5, 1.5)',
        'class A:\n def pid(self, x, y): self.pid(0.5, 1.5)\nclass B(A):\n def pid(self, a, b): pass',
        'class A:\n def pid(self, x, y): self.pid(0.5, 1.5)\nA.pid = other',
        'class A:\n @wrapped\n def pid(self, x, y): self.pid(0.5, 1.5)',
    ],
)
def test_parameters_that_are_not_known_are_not_guessed(text):
    assert names(text) == ['pid.0', 'pid.1']


def test_edits_elsewhere_leave_the_fields_of_a_tuple():
    text = POST + 'posts = [Post(0.5, 1.5), Post(2.5, 3.5)]'
    expected = ['posts.0.x', 'posts.0.y', 'posts.1.x', 'posts.1.y']
    assert names(text) == names('import math\n' + text + '\nmath.pi') == expected


def test_what_stands_behind_a_starred_argument_is_not_known():
    assert names(PID + 'pid = PID(0.5, *others, 1.5)') == ['pid.kp', 'pid.2']


def test_no_two_have_the_same_name():
    assert names('goto(1.0, 2.0)\ngoto(1.0, 2.0)\nx = 2.0 * y + 1.0') == [
        'goto.0',
        'goto.1',
        'goto.0.2',
        'goto.1.2',
        'x',
        'x.2',
    ]


def test_a_name_that_is_assigned_is_not_taken():
    tree = ast.parse('x = 2.0 * y\nx = 3.0')
    first, second = tree.body[0].value.left, tree.body[1].value
    assert literal_names(tree, [(first, None), (second, 'x')]) == ['x.2', 'x']


def test_what_is_assigned_twice_is_counted():
    tree = ast.parse('self.v = 1.0\nself.v = 2.0\nv = 3.0\nu = 4.0')
    literals = [(one.value, name) for one, name in zip(tree.body, ['self.v', 'self.v', 'v', 'u'])]
    assert literal_names(tree, literals) == ['v', 'v.2', 'v.3', 'u']


def test_the_default_of_a_field_is_called_after_its_class():
    tree = ast.parse('class Station:\n    wait: float = 2.0\n    limit = 3.0')
    literals = [(one.value, name) for one, name in zip(tree.body[0].body, ['wait', 'limit'])]
    assert literal_names(tree, literals) == ['Station.wait', 'limit']


def test_lines_and_columns_are_no_part_of_a_name():
    text = 'def drive():\n    goto([1.0, 2.0], speed=3.0)\n'
    assert names(text) == names('import math\n\n' + text.replace('1.0', '100.25')) == ['goto.0', 'goto.1', 'goto.speed']
