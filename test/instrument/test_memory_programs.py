"""What public nodes were caught with, and random ways to keep a number: each does what the plain node does in which a
hand sets the same names at the same moment."""

import random
import re

import pytest

from support.memory_oracle import KINDS, LOCAL, OTHER_LOCAL, USES, differences, read_once, said_by

#: Parts of nodes: (statements of the set-up, what is done in each round, by hand, the number, the other one).
NODES = {
    'a controller that clamps what it sends': (
        'goal = READ\nclass Robot: x = 0.0\n'
        'def step():\n    error = goal - Robot.x\n    speed = max(-1.0, min(1.0, 1.5 * error))\n'
        '    if abs(error) < 0.25: speed = 0.0\n    Robot.x += speed * 0.5\n    return speed',
        'said = "%r %r" % (step() * 1.0, Robot.x * 1.0)',
        'globals()["goal"] = HAND',
        2.5,
        5.0,
    ),
    'a robot that stops beside its goal': (
        'class Robot:\n    def __init__(self): self.goal, self.x = Point(READ, 0.0, 0.0), 0.0\nrobot = Robot()',
        'robot.x += 0.5 if robot.goal.x - robot.x > 0.3 else 0.0\nsaid = repr(robot.x * 1.0)',
        'robot.goal.x = HAND',
        1.125,
        3.0,
    ),
    'a text beside a line': (
        'width = READ\ndiagonal = math.hypot(width, 3.0)',
        'said = "length %.2f m of %r" % (diagonal, math.hypot(width, 3.0) * 1.0)',
        'globals().update(width=HAND, diagonal=math.hypot(HAND, 3.0))',
        2.2,
        3.1,
    ),
    'goals of an action': (
        'first = READ\ngoals = np.array([[first, 1.0], [2.0, first + 1.0]])\n'
        'def goal(count):\n    made = Pose()\n    made.position.x, made.position.y = goals[count % 2]\n    return made',
        'said = crc_of(goal(count))',
        'goals[0, 0], goals[1, 1] = HAND, HAND + 1.0',
        0.7,
        0.9,
    ),
    'a path of 4,000 poses': (
        'path = Path()\nfor number in range(4000):\n    pose = PoseStamped()\n'
        '    pose.pose.position.x = READ * number\n    pose.pose.orientation.w = 1.0\n    path.poses.append(pose)',
        'said = crc_of(path)',
        'for number, pose in enumerate(path.poses): pose.pose.position.x = HAND * number',
        0.05,
        0.06,
    ),
    'a path that is moved as a whole': (
        'class Moved:\n    def __init__(self, offset):\n'
        '        self.points = [(x + offset, x * offset) for x in range(400)]\n'
        'moved = Moved(READ)',
        'said = repr([(x * 1.0, y * 1.0) for x, y in moved.points][count::100])',
        'moved.points[:] = Moved(HAND).points',
        0.3,
        0.45,
    ),
}

SET_UP = """\
import io, zlib
import math
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
def crc_of(message):
    written = io.BytesIO()
    message.serialize(written)
    return str(zlib.crc32(written.getvalue()))
"""

#: What is computed of a number, and of what was computed of it.
EXPRESSIONS = [
    'N + 1.5',
    'N * 2',
    '3 - N',
    'N / 4',
    'N * -1',
    'abs(N)',
    'max(N, -20.5)',
    'min(N, 1e4)',
    'N ** 2',
    '(N, 2.0)[0]',
]

#: The names that parts give to what they keep.
NAMES = re.compile(r'\b(kept|half|a|A|b|B|D|L|make|read|put|box|set_to|work|f|numbers|Once|sent)\b')

#: Those that keep the default of an argument.
DEFAULTS = {'default argument', 'keyword argument'}

#: Those whose readers change what they read.
RESTLESS = {'element that moves', 'element of a deque that rotates'}


@pytest.mark.parametrize('source', ['parameter', 'literal', 'location'])
def test_what_public_nodes_were_caught_with(pair, tmp_path, source):
    def parts(name):
        for before, use, hand, number, other in NODES.values():
            text = SET_UP + before.replace('READ', read_once(name, source, number))
            if 'rosslt' in text:  # it is written with rosslt
                text = text.replace('import math', 'from rosslt import math')
            yield text, 'pass', use, hand.replace('HAND', repr(other))

    changes = {LOCAL: OTHER_LOCAL}
    changes.update({number: other for _, _, _, number, other in NODES.values()})
    wrong = differences(*said_by(pair, tmp_path, parts, source, changes), ['local variable', *NODES])
    assert not wrong, wrong


@pytest.mark.parametrize('seed', [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
@pytest.mark.parametrize('source', ['parameter', 'literal', 'location'])
def test_random_ways_to_keep_a_number(pair, tmp_path, source, seed):
    made = [random_part(random.Random(f'{seed} {at}'), at) for at in range(40)]

    def parts(name):
        for at, (before, use, hand) in enumerate(made):
            text = before.replace('NUMBER', read_once(name, source, number_of(at)))
            if 'rosslt' in text:  # it is written with rosslt
                text = text.replace('float(', 'rosslt.to_float(')
            yield text, 'pass', use, hand

    changes = {LOCAL: OTHER_LOCAL, **{number_of(at): other_of(at) for at in range(len(made))}}
    plain, tracked = said_by(pair, tmp_path, parts, source, changes)
    wrong = differences(plain, tracked, ['local variable', *made])
    assert not wrong, wrong[:3]


def number_of(at):
    return 3.25 + at / 64


def other_of(at):
    return 7.75 + at / 64


def random_part(random_, at):
    """A part that keeps a number in one to three places, each made of the one before: (set-up, use, by hand)."""
    before, by_hand, read = [], [], ''
    for place, kind in enumerate(random_.sample(sorted(KINDS.keys() - RESTLESS), random_.randint(1, 3))):
        keep, read_it, hand = (NAMES.sub(rf'\1_{place}', text) for text in KINDS[kind])
        expression = random_.choice(EXPRESSIONS)
        if not place and kind in DEFAULTS:
            expression = 'N'  # a literal that is a part of a default in the code is not a location
        before.append(keep.replace('READ', f'({expression.replace("N", read or "NUMBER")})'))
        by_hand.append(hand.replace('HAND', f'({expression.replace("N", read or repr(other_of(at)))})'))
        read = f'({read_it})'
    use = '\n'.join(random_.sample(sorted(USES.values()), 2)).replace('READ', read).replace('LIMIT', '6.0')
    return '\n'.join(before), use, '\n'.join(by_hand)
