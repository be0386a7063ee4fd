"""The rules by which a number literal is a location or none: each row of the table, by its own example."""

import ast
import re
import sys
from pathlib import Path

import pytest

from rosslt.instrument import RULES
from rosslt.instrument.literals import SourceText
from rosslt.instrument.location_rules import judge
from support.programs import literals_of, verdict_of


def judged(text):
    """The rules of the literals of a program, by their text."""
    source = SourceText('/nowhere/program.py', text.encode('utf-8'))
    return [(source.text_of(one.node), one.rule.name) for one in judge(ast.parse(text), source.text_of)]


def needs_newer_python(rule):
    return rule.name == 'pattern' and not hasattr(ast, 'match_case')


@pytest.mark.parametrize('rule', [rule for rule in RULES.values() if rule.name != 'skip'], ids=lambda rule: rule.name)
def test_each_rule_judges_the_literal_of_its_example(rule):
    if needs_newer_python(rule):
        with pytest.raises(SyntaxError):
            ast.parse(rule.example)
        return
    found = judged(rule.example)
    mine = [name for text, name in found if '7' in text or text == '0.0' or '1' in text.replace('0x', '')]
    assert rule.name in mine, found


def test_each_rule_gives_a_reason_in_plain_words():
    assert all(rule.reason and rule.verdict in ('number', 'whole', 'form', 'plain') for rule in RULES.values())


@pytest.mark.parametrize(
    ('text', 'verdict'),
    [
        ('p = Point(3, 0, -1.5)', 'number number number'),
        ('pose.position.x = 2', 'number'),
        ('x = [1, 2, 3.5]', 'number number number'),
        ('for i, (x, y) in enumerate(zip([(1, 0.5)], [2.0])): pass', 'number number number'),
        ('for i, x in enumerate([0.5], 1): pass', 'number plain'),
        ('for i, x in enumerate([0.5], start=1): pass', 'number plain'),
        ('x = deque([0.5, 1], 5)', 'number number plain'),
        ("setattr(self, 'gain', 1.5)", 'number'),
        ('way = [((1.0, 2.0), 0)]', 'number number number'),
        ('yaw = 3 * math.pi / 4', 'number number'),
        ('err -= 2 * math.pi', 'form'),
        ('yaw += math.pi / 2', 'number'),
        ('def f(self, gain=2.5, *, constant=6): pass', 'number number'),
        ('def f(timeout=2.5, id=6): pass', 'plain plain'),
        ('def f(limits=(-2.0, 2.0)): pass', 'number number'),
        ('m = Joy(axes=[0.5, -1.0])', 'number number'),
        ('m = numpy.transpose(a, axes=(1, 0))', 'plain plain'),
        ('def f(n=6):\n    return range(n)', 'plain'),
        ('q = quaternion_from_euler(0, 0, yaw)', 'form form'),
        ('q = quaternion_from_euler(0, 0, 1.5)', 'number number number'),
        ('q = quaternion_from_euler(0, 0, -0.2 * math.pi)', 'number number number'),
        ('q = quaternion_from_euler(0, 0, math.radians(90))', 'number number number'),
        ('q = quaternion_from_euler(0, 1.5, yaw)', 'form number'),
        ('x = radius * math.cos(0.5)', 'number'),
        ('x = 1.5 + 2.0 * math.cos(t * 0.1)', 'number number form'),
        ('rate = rospy.Rate(10)', 'plain'),
        ('rospy.sleep(0.5)', 'plain'),
        ('x = rospy.get_param("~gain", 2.0)', 'plain'),
        ('get = rospy.get_param\nx = get("~gain", 2.0)', 'plain'),
        ('from rospy import get_param as get\nx = get("~gain", 2.0)', 'plain'),
        ('a = numpy.zeros((3, 4))', 'plain plain'),
        ('a = numpy.array([1.0, 2])', 'number number'),
        ('a = np.linspace(0.0, 1.0, 20)', 'number number plain'),
        ('marker.id = 3', 'whole'),
        ('marker.lifetime = rospy.Duration(2)', 'plain'),
        ('x = "%d" % 3', 'plain'),
        ('msg.data = 5', 'number'),
        ('sys.exit(1)', 'plain'),
        ('x = y if z > 2 else 4.0', 'plain number'),
        ('x = lambda: 4.0', 'number'),
        ('x = 1' + 400 * '0', 'plain'),
        ('covariance = [0.1] * 36', 'number plain'),
        ('if abs(x) < 0.05: y = 1', 'plain number'),
        ('for i in range(9): x = i + 1', 'plain form'),
        ('for i in range(100): x = i - 50', 'plain number'),
    ],
)
def test_a_literal_is_judged_by_where_it_stands(text, verdict):
    source = SourceText('/nowhere/program.py', text.encode('utf-8'))
    found = sorted(judge(ast.parse(text), source.text_of), key=lambda one: one.node.col_offset)
    assert ' '.join(one.rule.verdict for one in found) == verdict


def test_a_counter_and_its_start_are_a_state():
    text = 'n = 0\nwhile not rospy.is_shutdown():\n    n += 1\n    x = 2.0 * n\n    pub.publish(x)\n'
    assert judged(text) == [('0', 'state'), ('1', 'step'), ('2.0', 'term')]


@pytest.mark.parametrize(
    ('text', 'rules'),
    [
        ('n = 3\nhalf = n // 2\nx = y[i - half:i + half]\n', ['used as an index', 'divisor']),
        ('n = 3\nx = y[:min(n, len(y))]\n', ['used as an index']),
        ('def last(y, k):\n    return y[-k:]\nx = last(y, 3)\n', ['used as an index']),
        ("k, n, mode = 1, 2, 'go'\nx = y[k]\nz = [0.0] * n\n", ['used as an index', 'used as a count', 'term']),
        ('def last(y, k):\n    return y[-k:]\nx = last(y, k=3)\n', ['used as an index']),
        (
            'class A:\n    def __init__(self, size=3):\n        self.size = size\n'
            '    def f(self, y):\n        self.pub.publish(y[-self.size:])\na = A(5)\n',
            ['default', 'used as an index'],
        ),
        ('n = 3\ndef g(count):\n    return [0.5 for i in range(count)]\nx = g(n)\n', ['used as a count', 'value']),
        ('k = 3\nx = y[int(k / 2)]\nz = k * 1.5\n', ['named', 'index', 'term']),
    ],
)
def test_an_int_that_becomes_an_index_by_way_of_other_names_stays_whole(text, rules):
    assert sorted(rule for _, rule in judged(text)) == sorted(rules)


@pytest.mark.parametrize('step', ['+= 1', '-= 1'])
def test_an_int_that_a_counter_is_compared_with_stays_whole(step):
    text = 'PAUSE = 40\nclass A:\n    def tick(self):\n        self.n {}\n        return PAUSE <= self.n\n'
    rules = dict(judged(text.format(step)))
    assert rules['40'] == 'counting name'
    assert dict(judged(text.format(step.replace('1', '0.1'))))['40'] == 'named'


@pytest.mark.parametrize(
    ('use', 'is_set_up'),
    [
        ('def main():\n    A()\nmain()', True),
        ('class B:\n    def __init__(self):\n        self.a = A()\n        self.b = A()\nB()', True),
        ('for _ in range(n):\n    A()', False),
        ('def heard(message):\n    A()\nlisten(heard)', False),
        ('listen(A)', False),
        ('class B(A):\n    def __init__(self):\n        super().__init__()\nB()', False),
        ("A()\nvars()['A']()", False),
        ('', False),
        ('left, right = A(), A()', True),
        ('class B:\n    def build(self):\n        A()\nB().build()', True),
        ('def f():\n    A()\ndef f():\n    A()\nf()', True),
        ('A()\nmarker.type = Marker.CUBE', True),
        ('class B(smach.State):\n    def __init__(self):\n        smach.State.__init__(self)\nB()\nA()', True),
        ('class B(Base):\n    def __init__(self):\n        A()\nB()', False),
        ('class B(metaclass=Known):\n    def __init__(self):\n        A()\nB()', False),
        ('@known\nclass B:\n    def __init__(self):\n        A()\nB()', False),
        ('class B(Thread):\n    def run(self):\n        A()\nB().run()', False),
        ('class B:\n    def __call__(self):\n        A()\nb = B()\nb.__call__()\nlisten(b)', False),
        ('[A() for _ in range(n)]', False),
        ('def f():\n    A()\n    yield\ng = f()', False),
        ('async def f():\n    A()\ng = f()', False),
        ('a = A()\ndef heard(message):\n    a.__init__()', False),
        ('a = A()\ndef heard(message):\n    type(a)()', False),
        ('A()\nimport builtins\ndef heard(message):\n    builtins.globals()[message.data]()', False),
    ],
)
def test_what_an_init_reads_is_set_up_if_the_program_runs_it_once(use, is_set_up):
    (literal,) = literals_of('class A:\n    def __init__(self):\n        self.x = 0.5\n' + use)
    assert literal.is_set_up == is_set_up


@pytest.mark.parametrize(
    ('text', 'is_read_once'),
    [
        ('x = [i + 0.5 for i in y]', True),
        ('x = sum(i for i in (z, 0.5))', True),
        ('x = (i + 0.5 for i in y)', False),
        ('x = (i for i in y if f(i, 0.5))', False),
        ('x = (i for i in y for z in (i, 0.5))', False),
    ],
)
def test_a_generator_reads_its_numbers_later(text, is_read_once):
    (literal,) = literals_of(text)
    assert literal.is_read_once == is_read_once


def test_what_several_names_get_is_called_by_the_first():
    text = 'color.r = color.g = color.a = 1.0\n'
    source = SourceText('/nowhere/program.py', text.encode('utf-8'))
    assert [one.name for one in judge(ast.parse(text), source.text_of)] == ['color.r']


def test_functions_of_the_program_are_no_others_of_that_name():
    assert judged('def rand(low, high):\n    return low + high\nx = rand(-1, 1)\n') == [('1', 'value'), ('-1', 'value')]
    assert judged('x = rand(-1, 1)\n') == [('1', 'count'), ('-1', 'count')]
    method = 'class A:\n    def wait(self, turn): pass\n    def f(self):\n        self.wait(0.5)\n'
    assert judged(method) == [('0.5', 'value')]


@pytest.mark.skipif(sys.version_info < (3, 10), reason='Python knows no match')
def test_a_counter_in_a_case_is_a_state():
    text = (
        'class A:\n    def __init__(self):\n        self.n = 0.0\n'
        '    def tick(self, event):\n        match event:\n            case 1:\n                self.n += 0.1\n'
        '            case _:\n                pub.publish(self.n * 2.0)\n'
    )
    assert [one for one in judged(text) if one[0] != '1'] == [('0.0', 'state'), ('0.1', 'step'), ('2.0', 'term')]


def test_a_clock_in_self_is_a_state():
    text = (
        'class A:\n    def __init__(self):\n        self.t = 0.0\n        self.gain = 2.0\n'
        '    def tick(self, event):\n        self.t = self.t + 0.1\n'
    )
    assert judged(text) == [('0.0', 'state'), ('2.0', 'named'), ('0.1', 'step')]


@pytest.mark.parametrize(
    'text',
    [
        'class Filter:\n    def step(self):\n        for p in self.cloud:\n            p.x += 0.1',
        'class Filter:\n    def step(self):\n        for i, p in enumerate(self.cloud):\n            p.x = p.x + 0.1',
        'class Filter:\n    def step(self):\n        for p in self.cloud:\n            self.move(p)\n'
        '    def move(self, p):\n        p.x += 0.1',
        'class Filter:\n    def step(self):\n        first = self.cloud[0]\n        first.x += 0.1',
        'class Wheels:\n    def step(self):\n        self.joints.position[0] += 0.1',
        'class Wheels:\n    def step(self):\n        self.turned[2] = self.limited(self.turned[2] + 0.1)',
        'robot = Robot()\ndef step(event):\n    robot.x += 0.1',
        'def step(state):\n    state.x = state.x + 0.1\n    return state\n'
        'def main():\n    state = State()\n    while not rospy.is_shutdown():\n        state = step(state)\n',
        'def step(robot, dt):\n    turn(robot)\ndef turn(it):\n    it.pose.x += 0.1\n'
        'def main():\n    robot = Robot()\n    while True:\n        step(robot, 0.5)\n',
    ],
)
def test_what_outlives_a_function_is_a_state(text):
    assert ('0.1', 'step') in judged(text)


@pytest.mark.parametrize(
    'text',
    [
        'def shifted(pose):\n    pose.x += 0.1\n    return pose\ndef send(event):\n    pub.publish(shifted(Pose()))',
        'def callback(msg):\n    for p in msg.points:\n        p.x += 0.1\n    pub.publish(msg)',
        'class Path:\n    def send(self):\n        points = [Point(), Point()]\n        for p in points:\n'
        '            p.x += 0.1',
        'class Arm:\n    def send(self):\n        for i, joint in enumerate(self.joints):\n            x = joint.x\n'
        '            x += 0.1\n            self.pub.publish(x)',
        'class Arc:\n    def lengths(self):\n        for i in range(9):\n            self.s[i] = self.s[i - 1] + 0.1',
        'def shift(pose):\n    pose.x += 0.1\ndef main():\n    while True:\n        pose = Pose()\n'
        '        shift(pose)\n        pub.publish(pose)\n',
    ],
)
def test_what_is_made_anew_for_a_function_is_no_state(text):
    assert ('0.1', 'term') in judged(text)


def test_a_sum_that_is_made_anew_in_every_round_is_no_state():
    text = 'while True:\n    total = 0.5\n    for p in points:\n        total += p * 2.0\n    pub.publish(total)\n'
    assert [name for _, name in judged(text)] == ['named', 'term']


@pytest.mark.parametrize(
    'text',
    [
        'class Tank:\n    radius: float = 1.0\n    views: int = 4',
        'class Tank:\n    views = 4\nfor i in range(TANK.views): pass',
        'TANK = Tank(views=4)\nfor i in range(TANK.views): pass',
    ],
)
def test_a_field_that_is_an_int_or_counts_stays_whole(text):
    assert ('4', 'counting name') in judged(text)


def test_numbers_of_several_names_are_named():
    assert [name for _, name in judged('x, y = 4.0, -2.0')] == ['named', 'named']


def test_an_angle_that_is_normalized_is_no_state():
    text = 'def normalize(a):\n    while a > 3.0:\n        a -= 6.0\n    return a\n'
    assert judged(text) == [('3.0', 'comparison'), ('6.0', 'term')]


def test_a_comment_leaves_out_a_line_or_a_block():
    text = (
        'a = 1.0  # rosslt: skip\nb = 2.0\n# rosslt: skip\nc = 3.0\n\n'
        'def f():  # rosslt: skip\n    x = 4.0\n    return x * 5.0\nd = 6.0\n'
    )
    assert [literal.text for literal in literals_of(text)] == ['2.0', '6.0']


@pytest.mark.parametrize(
    ('comment', 'limits'),
    [
        ('# rosslt: 0.0..5.0', (0.0, 5.0)),
        ('#rosslt: -1..1', (-1, 1)),
        ('# rosslt: 0..', (0, None)),
        ('# rosslt: ..1e3', (None, 1000.0)),
        ('# some words', (None, None)),
    ],
)
def test_a_comment_gives_bounds(comment, limits):
    (literal,) = literals_of('speed = 2.0  ' + comment + '\n')
    assert (literal.minimum, literal.maximum) == limits


def test_a_literal_knows_its_tokens():
    (one, other) = literals_of("s = 'äöü'; x = -2.50\ny = f(\n    1e-3)\n")
    assert (one.line, one.column, one.end_line, one.end_column, one.text, one.value) == (1, 16, 1, 21, '-2.50', -2.5)
    assert (other.line, other.column, other.end_line, other.end_column, other.text) == (3, 5, 3, 9, '1e-3')


def test_an_identity_survives_edits_elsewhere():
    before = literals_of('x = 1.0\ndef f():\n    return 2.0, 2.0\n')
    after = literals_of('# a comment\nimport os\nx = 1.0\n\n\ndef f():\n    y = 3.0\n    return 2.0, 2.0\n')
    assert {one.identity for one in before} < {one.identity for one in after}
    assert len({one.identity for one in after}) == len(after)


def test_an_identity_survives_another_number_and_is_never_that_of_another_literal():
    before = literals_of('a = f(0.25)\nb = g(-0.25)\n')
    assert [one.identity for one in literals_of('a = f( 1.5)  # 3\nb = g(2)\n')] == [
        before[0].identity,
        literals_of('a = f(1)\nb = g(2.5)\n')[1].identity,
    ]
    for text in ('c = f(0.25)\na = f(0.25)\n', 'a = f(0.25)\na = f(0.25)\n', 'a = f(0.25, 0.25)\n'):
        inserted = [one.identity for one in literals_of(text)]
        assert len(set(inserted)) == 2
        assert (before[0].identity in inserted) == text.startswith('c')


def test_equal_literals_of_a_function_have_identities_of_their_own():
    assert (
        len({one.identity for one in literals_of('def f():\n    return 2.0, 2.0\n\ndef g():\n    return 2.0\n')}) == 3
    )


def test_named_constants_rank_before_values_and_those_before_formulas():
    speed, value, term, divisor = (verdict_of(text) for text in ('speed = 7.0', 'f(7.0)', 'x = 7.0 * y', 'x = y / 7.0'))
    assert speed.rank < value.rank < term.rank < divisor.rank


def test_elements_of_tables_rank_like_named_constants():
    for text in (
        'PLACES = [(7.0, 1.5)]',
        "PLACES = {'a': [7.0]}",
        "self.places = [{'x': 7.0}]",
        'for x in (1.5, 7.0): f(x)',
    ):
        assert verdict_of(text).rank == 0, text
    for text in ('place = f(7.0)', 'places = [f(7.0)]', 'f([7.0])'):
        assert verdict_of(text).rank == 1, text


def test_the_page_lists_every_rule():
    page = (Path(__file__).parents[2] / 'docs' / 'unmodified_nodes.md').read_text(encoding='utf-8')
    rows = re.findall(r'^\| (.+?) \| (number|whole|form|plain) \| (.+) \|$', page, flags=re.MULTILINE)
    assert rows == [(rule.name, rule.verdict, rule.reason) for rule in RULES.values()]
