"""Constants of a program that only its set-up reads: what nothing keeps of them changes at the next start."""

import ast

import pytest
import rospy
from geometry_msgs.msg import Point, PoseStamped

from rosslt import node, values
from rosslt.instrument.set_up_names import SetUp, names_of_set_up, reaches_other_modules
from support.processes import wait_until
from support.shell import failure, lines, rosslt
from support.unmodified import Listener, Unmodified

LATE = 'takes effect at the next start, or when {} runs again: nothing that the node keeps came of it'

PURSUIT = """\
import math
import rospy
from geometry_msgs.msg import PoseStamped

START_X, START_Y = -1.0, 0.5
SPAN = 4.0
BASE = dict(x=3.0)
SPOT = [4.0, 5.0]
LIMITS = {'speed': 6.0}
HALF = SPAN / 2
GOAL = (2.0, -1.0)
OFFSET = 0.25
RATE = 20

class Robot:
    def __init__(self):
        self.x, self.y, self.th = START_X, START_Y, 0.0
        self.goal_x = HALF
        self.goal_x = BASE['x']
        self.goal_x, _ = SPOT
        self.limits = LIMITS
        self.offset = OFFSET
        self.pose = rospy.Publisher('~pose', PoseStamped, queue_size=1)
        self.goal = rospy.Publisher('~goal', PoseStamped, queue_size=1)

    def step(self, dt):
        self.x += math.cos(self.th) * dt
        self.goal_x = self.x
        pose = PoseStamped()
        pose.header.frame_id = 'map'
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = self.x, self.y, self.offset
        self.pose.publish(pose)
        goal = PoseStamped()
        goal.header.frame_id = 'map'
        goal.pose.position.x, goal.pose.position.y = GOAL
        self.goal.publish(goal)

def main():
    rospy.init_node('pursuit')
    robot = Robot()
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        robot.step(0.001)
        rate.sleep()

if __name__ == '__main__':
    main()
"""

ORDINARY = """\
import rospy
from dataclasses import dataclass
from geometry_msgs.msg import Point

IN_CALLBACK = 1.0
IN_LOOP = 2.0
IN_METHOD = 3.0
IN_LAMBDA = 4.0
BY_DEFAULT = 5.0
OF_CLASS = 6.0
DECORATED = 7.0
KEPT = 8.0
OF_TUPLE = 9.0
OF_FIELD = 10.0
SHARED = 11.0
GENERATED = 12.0
IN_TEXT = 13.0

def scaled(by):
    def decorate(function):
        return lambda *args: by * function(*args)
    return decorate

@dataclass
class Limits:
    most: float = OF_FIELD

class Ordinary:
    factor = OF_CLASS

    def __init__(self):
        self.kept = KEPT
        self.goal = (OF_TUPLE, 0.0)
        self.limits = Limits()
        self.get = lambda: IN_LAMBDA
        self.shared = SHARED
        self.shared = 0.0
        self.numbers = (GENERATED * i for i in range(10 ** 9))
        self.text = IN_TEXT
        self.text = 0.0
        self.pub = rospy.Publisher('~place', Point, queue_size=1)
        self.other = rospy.Publisher('~other', Point, queue_size=1)
        self.timer = rospy.Timer(rospy.Duration(0.05), self.tick)

    def tick(self, event):
        self.other.publish(IN_CALLBACK, SHARED, next(self.numbers))

    def method(self, number=BY_DEFAULT):
        return IN_METHOD + number + self.factor

    @scaled(DECORATED)
    def step(self):
        self.pub.publish(self.method(), self.get() + self.kept + self.goal[0] + self.limits.most, 0.0)
        return 1.0

rospy.init_node('ordinary')
rospy.loginfo('IN_TEXT is %.1f', IN_TEXT)
ordinary, rate = Ordinary(), rospy.Rate(20)
while not rospy.is_shutdown():
    ordinary.pub.publish(IN_LOOP, ordinary.step(), 0.0)
    rate.sleep()
"""

ONE_BY_ONE = """\
import rospy
from geometry_msgs.msg import Point

FIRST = 1.0
SECOND = 2.0
THIRD = 3.0

class Robot:
    def __init__(self):
        self.pub = rospy.Publisher('~place', Point, queue_size=1)

    def go(self, x):
        rate = rospy.Rate(20)
        while x > 0.0 and not rospy.get_param('/ended', 0) >= x:
            self.pub.publish(x, 0.0, 0.0)
            rate.sleep()
        x = 0.0

def second(robot):
    robot.go(SECOND * 1.0)

def main():
    rospy.init_node('one_by_one')
    robot = Robot()
    robot.go(FIRST)
    second(robot)
    robot.go(THIRD)
    while not rospy.is_shutdown():
        rospy.sleep(0.05)

main()
"""


STARTS = """\
from dataclasses import dataclass
import rospy
from geometry_msgs.msg import Point

class Default:
    def __init__(self, x=1.5):
        self.x = x

class Given:
    def __init__(self, x):
        self.x = x

@dataclass
class State:
    x: float = 2.5

@dataclass
class Shared:
    x: float = 3.5

@dataclass
class Several:
    x: float = 5.5

def main():
    rospy.init_node('starts')
    pub = rospy.Publisher('~place', Point, queue_size=1)
    robots = [Default(), Given(4.5), State(), Shared(), Several(6.5), Several(7.5)]
    rate = rospy.Rate(20)
    end = rospy.Time.now() + rospy.Duration(1.0)
    while rospy.Time.now() < end:
        for robot in robots:
            robot.x += 0.5
        pub.publish(*[robot.x for robot in robots[:3]])
        rate.sleep()
    x = 95.5
    while not rospy.has_param('/on'):
        pub.publish(x, 0.0, 0.0)
        rate.sleep()
    x = 96.5
    while not rospy.is_shutdown():
        pub.publish(x, 0.0, 0.0)
        rate.sleep()

def heard(message):
    Shared()

rospy.Subscriber('/other', Point, heard)
main()
"""


def late(name):
    """{name of a location: the last column of `rosslt list`}."""
    return {line[0].split('/', 2)[2]: line[9] for line in lines('list', name, '--all')}


def found_in(text):
    return {name for name in names_of_set_up(ast.parse(text)) if ':' not in name}


@pytest.mark.rostest
def test_what_the_program_runs_once_counts_until_it_is_over(master, tmp_path):
    with Unmodified(tmp_path, 'starts', STARTS), Listener('starts/place', Point) as heard:
        heard.comes(lambda message: message.x == 95.5)
        values = {line[0].split('/', 2)[2]: (line[2], bool(line[9])) for line in lines('list', '/starts', '--all')}
        said = dict(values.values())
        assert [said[number] for number in ('1.5', '4.5', '2.5', '5.5')] == [True] * 4, values
        assert not said['3.5']  # a callback may make one
        assert said['95.5']


@pytest.mark.rostest
def test_a_number_that_the_program_comes_to_later_is_taken_then(master, tmp_path):
    with Unmodified(tmp_path, 'starts', STARTS), Listener('starts/place', Point) as heard:
        heard.comes(lambda message: message.x == 95.5)
        name = next(line[0] for line in lines('list', '/starts', '--all') if line[2] == '96.5')
        changed = rosslt('set', name, '97.5')
        assert (changed.returncode, changed.stderr) == (0, '')
        rospy.set_param('/on', True)
        heard.comes(lambda message: message.x == 97.5)
        assert 'next start' in late('/starts')[name.split('/', 2)[2]]


@pytest.mark.rostest
def test_a_start_that_became_a_state_says_so(master, tmp_path):
    with Unmodified(tmp_path, 'pursuit', PURSUIT), Listener('pursuit/pose', PoseStamped) as heard:
        heard.comes(lambda message: message.pose.position.x > -0.99)
        wait_until(lambda: late('/pursuit').get('START_X'), 'the start to have become a state')
        found = late('/pursuit')
        late_names = {'START_X', 'SPAN', 'HALF', 'RATE', 'BASE_x', 'SPOT_0', 'SPOT_1'}
        assert {name for name, why in found.items() if why} == late_names
        assert found['START_X'] == LATE.format('pursuit.py:5:20')
        assert found['RATE'] == LATE.format('pursuit.py:13:8') + ', but for rospy.Rate at pursuit.py:41'
        assert found['START_Y'] == found['OFFSET'] == found['GOAL_0'] == found['GOAL_1'] == ''
        assert rosslt('set', '/pursuit/START_X', '5').stderr == f'rosslt set: it {found["START_X"]}\n'
        assert rosslt('set', '/pursuit/START_Y', '1.5').stderr == ''
        assert rosslt('set', '/pursuit/OFFSET', '0.75').stderr == ''
        message = heard.comes(lambda message: message.pose.position.y == 1.5 and message.pose.position.z == 0.75)
        assert message.pose.position.x < 0.0


@pytest.mark.rostest
def test_a_start_that_became_a_state_gets_no_handle(master, tmp_path):
    with Unmodified(tmp_path, 'pursuit', PURSUIT), Listener('pursuit/pose', PoseStamped) as heard:
        heard.comes(lambda message: message.pose.position.x > -0.99)
        wait_until(lambda: late('/pursuit').get('START_X'), 'the start to have become a state')
        pose = heard.next().pose.position
        fixed = node.limits(values.sources((pose.x, pose.y, pose.z)))['read_only']
        assert {node.directory().of(source).local_name for source in fixed} == {'START_X'}
        refused = failure('force', '/pursuit/pose/pose/position/x', '1', '--source', '/pursuit/START_X')
        assert LATE.format('pursuit.py:5:20') in refused
        examined = rosslt('doctor', '/pursuit/pose', '--time', '1').stdout
        assert 'a change of /pursuit/START_X ' + LATE.format('pursuit.py:5:20') in examined


@pytest.mark.rostest
def test_what_is_read_again_or_kept_follows(master, tmp_path):
    with Unmodified(tmp_path, 'ordinary', ORDINARY), Listener('ordinary/place', Point) as heard:
        heard.comes(lambda message: message.y == 7.0)
        names = [line.split(' = ')[0] for line in ORDINARY.splitlines() if line[:1].isupper()]
        wait_until(lambda: set(names) <= late('/ordinary').keys(), 'all to be known')
        found = late('/ordinary')
        assert {name: found[name] for name in names} == dict.fromkeys(names, '')
        for name in names:
            assert rosslt('set', '/ordinary/' + name, '20').stderr == ''
        heard.comes(lambda message: (message.x, message.y) == (60.0, 80.0))
        heard.comes(lambda message: (message.x, message.y) == (20.0, 20.0))


@pytest.mark.rostest
def test_what_the_program_will_read_later_is_not_late(master, tmp_path):
    with Unmodified(tmp_path, 'one_by_one', ONE_BY_ONE), Listener('one_by_one/place', Point) as heard:

        def said():
            return {name for name, why in late('/one_by_one').items() if why} & {'FIRST', 'SECOND', 'THIRD'}

        heard.comes(lambda message: message.x == 1.0)
        wait_until(lambda: 'THIRD' in late('/one_by_one'), 'all to be known')
        assert said() == set()
        rosslt('set', '/one_by_one/SECOND', '2.5')
        rosslt('set', '/one_by_one/THIRD', '3.5')
        rospy.set_param('/ended', 1.0)
        heard.comes(lambda message: message.x == 2.5)
        assert said() == {'FIRST'}
        rospy.set_param('/ended', 2.5)
        heard.comes(lambda message: message.x == 3.5)
        assert said() == {'FIRST', 'SECOND'}
        rospy.set_param('/ended', 3.5)
        wait_until(lambda: said() == {'FIRST', 'SECOND', 'THIRD'}, 'the last one to be over')


ROBOT = 'START = 1.0\nclass Robot:\n    def __init__(self):\n        self.x = START\n'


@pytest.mark.parametrize(
    'text',
    [
        ROBOT + 'Robot()',
        ROBOT + 'def main():\n    one = Robot()\n    other = Robot()\nmain()',
        'START, Y = 1.0, 2.0\nx = START',
        'START: float = 1.0\nclass Limits:\n    most = START',
        'START = 1.0\ndef f(x=START):\n    pass',
        'START = 1.0\nfor x in (START, 2.0):\n    f(x)',
        'START = 1.0\nx = [START for _ in run()]',
        'START = 1.0\nx = (i for i in (START, 2.0))',
        'START = 1.0\nif late:\n    def f():\n        g(START)\nelse:\n    def f():\n        h(START)\nf()',
        ROBOT + 'Robot()\nmarker.type = Marker.CUBE',
        ROBOT + 'class Other(smach.State):\n    def __init__(self):\n        smach.State.__init__(self)\nRobot()',
    ],
)
def test_these_are_read_once(text):
    assert found_in(text) == {'START'}


@pytest.mark.parametrize(
    'text',
    [
        'START = 1.0',
        ROBOT,
        ROBOT + 'for _ in range(2):\n    Robot()',
        ROBOT + 'call(Robot)',
        ROBOT + 'Robot()\ndef f(event):\n    Robot()',
        ROBOT + 'a, b = Robot(), Robot()',
        ROBOT + 'robot = Robot()\ndef f(event):\n    robot.__init__()',
        ROBOT + 'robot = Robot()\ndef f(event):\n    return type(robot)()',
        ROBOT + 'class Other(Robot):\n    pass\nRobot()',
        ROBOT.replace('Robot:', 'Robot(Base):') + 'Robot()',
        ROBOT.replace('class', '@known\nclass') + 'Robot()',
        ROBOT.replace('__init__', 'execute') + 'Robot().execute()',
        ROBOT + 'Robot()\ndef f(event):\n    return globals()["STA" + "RT"]',
        ROBOT + 'Robot()\ndef f(event):\n    return numexpr.evaluate("START + 1")',
        ROBOT + 'import sys\nRobot()\ndef f(event):\n    return sys.modules[__name__].START',
        'START = 1.0\nx = (START for _ in run())',
        ROBOT + 'x = [Robot() for _ in run()]',
        ROBOT + 'Robot()\nimport builtins\ndef f(event):\n    return builtins.globals()["STA" + "RT"]',
        'START = 1.0\ndef f():\n    yield START\ng = f()',
        'START = 1.0\nasync def f():\n    return START\ng = f()',
        'START = 1.0\ndef f(event):\n    global START\n    START += 1',
        'START = 1.0\nwhile START < 2.0:\n    f()',
        'START = 1.0\nf(lambda: START)',
    ],
)
def test_these_may_be_read_again(text):
    assert found_in(text) - {'g', 'robot', 'x'} == set()


@pytest.mark.parametrize('made', ["{'x': 1.0}", 'dict(x=1.0)', '[1.0, 2.0]'])
@pytest.mark.parametrize('read', ['f(START["x"])', 'x, y = START', 'f(*START)', 'f(**START)', 'START["x"] += 1'])
def test_the_elements_of_these_are_read_once(made, read):
    assert {'START', 'START[]'} <= found_in('START = ' + made + '\n' + read)


@pytest.mark.parametrize(
    'text',
    [
        'START = [1.0]\nf(START)',
        'START = [1.0]\nx = START, 1.0',
        'START = [1.0]\nx = y, z = START',
        'START = other = [1.0]\nf(START[0])',
        'START = make()\nf(START[0])',
        'START = [1.0]\nSTART = make()\nf(START[0])',
        'START = [1.0]\nSTART += other\nf(START[0])',
        'f(START := [1.0])\nf(START[0])',
        'START = {"x": 1.0}\nf(START.get)',
        'START = {"x": 1.0}\nf(START["x"])\ndef g(event):\n    return START["x"]',
        'try:\n    from site_of import *\nexcept ImportError:\n    START = {"x": 1.0}\nf(START["x"])',
        'def dict():\n    return LIVE\nSTART = dict()\nf(START["x"])',
        'from site_of import dict\nSTART = dict()\nf(START["x"])',
        'START = {"x": 1.0}\n@make\ndef START():\n    pass\nf(START["x"])',
        'START = {"x": 1.0}\ntry:\n    f()\nexcept E as START:\n    f(START["x"])',
        'import sys\nSTART = {"x": 1.0}\nf(START["x"])\ndef g(event):\n    return sys._getframe().f_back.f_locals',
        'try:\n    from site_of import START\nexcept ImportError:\n    START = {"x": 1.0}\nf(START["x"])',
    ],
)
def test_the_elements_of_these_may_be_read_again(text):
    assert 'START[]' not in found_in(text)


def test_a_module_that_gets_at_others_is_told_apart():
    assert reaches_other_modules(ast.parse('import __main__'))
    assert reaches_other_modules(ast.parse('from __main__ import START'))
    assert not reaches_other_modules(ast.parse('if __name__ == "__main__":\n    main()'))


@pytest.mark.parametrize(
    ('text', 'running', 'is_over'),
    [
        (ROBOT + 'robot = Robot()\nrun()', [('<module>', 6)], True),
        (ROBOT + 'run()\nrobot = Robot()', [('<module>', 5)], False),
        (ROBOT + 'run(Robot())', [('<module>', 5), ('run', 1)], False),
        (ROBOT + 'Robot().run()', [('<module>', 5), ('run', 1)], True),
        (ROBOT + 'Robot().run()', [('<module>', 5)], False),
        (ROBOT + 'Robot(run()).run()', [('<module>', 5), ('run', 1)], False),
        (ROBOT + 'a = Robot()\nb = Robot()', [('<module>', 5), ('__init__', 5)], False),
        (ROBOT + 'a = Robot()\nb = Robot()', [('<module>', 6), ('__init__', 5)], True),
        ('START = 1.0\ntry:\n    run()\nfinally:\n    f(START)', [('<module>', 3)], False),
        ('START = 1.0\nx = (\n    START\n    if run()\n    else 1.0\n)', [('<module>', 4)], False),
        (ROBOT + 'robot = Robot()\nrun()', [('<module>', None)], False),
        ('START = 1.0\nx = [START for _ in run()]', [('<module>', 2), ('run', 1)], False),
        ('START = 1.0\nx = [START for _ in run()]\nrun()', [('<module>', 3), ('run', 1)], True),
    ],
)
def test_a_reading_is_over_as_the_lines_say(monkeypatch, text, running, is_over):
    monkeypatch.setattr(node.MEMORY, 'is_over', node.MEMORY.is_over)
    set_up, names = SetUp(), {}
    set_up.begin(names, names_of_set_up(ast.parse(text)))
    lines_of = {'<module>': 0, '__init__': 3, 'run': 1}
    monkeypatch.setattr(set_up, '_running', lambda: [((name, lines_of[name]), line) for name, line in running])
    assert node.MEMORY.is_over(names, 'START') is is_over
    assert not node.MEMORY.is_over({}, 'START')


def test_what_else_has_the_elements_is_not_over(monkeypatch):
    monkeypatch.setattr(node.MEMORY, 'is_over', node.MEMORY.is_over)
    set_up, names = SetUp(), {'START': {'x': [1.0]}}
    set_up.begin(names, names_of_set_up(ast.parse('START = {"x": [1.0]}\nf(START["x"])\nrun()')))
    monkeypatch.setattr(set_up, '_running', lambda: [(('<module>', 0), 3)])
    assert node.MEMORY.is_over(names['START'], 'x')
    assert not node.MEMORY.is_over(names['START']['x'], None)
    assert not node.MEMORY.is_over({'x': [1.0]}, 'x')
