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
        ('angle += 4.5', 'angle'),
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


def test_lines_and_columns_are_no_part_of_a_name():
    text = 'def drive():\n    goto([1.0, 2.0], speed=3.0)\n'
    assert names(text) == names('import math\n\n' + text.replace('1.0', '100.25')) == ['goto.0', 'goto.1', 'goto.speed']
