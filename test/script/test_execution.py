"""What a script can do, what it must not do, and that it ends."""

import pytest

import rosslt
from rosslt.files import SourceText
from rosslt.script import ScriptError
from rosslt.script.execution import Goto, Wait, run

NODE = '/interactive_script'


def steps_of(text, **options):
    source = SourceText('tour.script', text.encode())
    numbers = [rosslt.track(number.value, rosslt.Source(NODE, index)) for index, number in enumerate(source.numbers)]
    return run(source, numbers, **options)


def error_of(text, **options):
    with pytest.raises(ScriptError) as caught:
        steps_of(text, **options)
    return caught.value


def test_a_script_is_steps():
    assert steps_of('goto(2.0, 1.0, 1.5)\nwait(1)\n') == [Goto(2.0, 1.0, 1.5), Wait(1.0)]
    assert steps_of('') == []


def test_variables_arithmetic_loops_functions_and_math_are_there():
    assert steps_of("""
height = 1.5
def corner(i, radius=2):
    return radius * cos(i * pi / 2), radius * math.sin(i * pi / 2)
for i in range(4):
    x, y = corner(i)
    if i % 2 == 0:
        goto(round(x), round(y), height)
points = [(p, -p) for p in (1, 2)]
while points:
    goto(*points.pop(), max(height, 2))
""") == [(2, 0, 1.5), (-2, 0, 1.5), (2, -2, 2), (1, -1, 2)]


def test_a_step_knows_the_numbers_that_it_came_of():
    (step,) = steps_of('base = 1.0\ngoto(base + 0.5, 2 * -3, 4)')
    assert rosslt.solve(step.x, 5.0) == {rosslt.Source(NODE, 0): 4.5}
    assert rosslt.solve(step.y, 9.0, rosslt.Source(NODE, 3)) == {rosslt.Source(NODE, 3): 4.5}
    assert [source.location_id for source in rosslt.sources(step)] == [0, 1, 2, 3, 4]


def test_a_number_that_is_written_as_an_integer_can_become_any_number():
    (step,) = steps_of('goto(2, 3, 4)')
    assert rosslt.solve(step.x, 2.345) == {rosslt.Source(NODE, 0): 2.345}
    assert [type(value + 0) for value in rosslt.untracked(list(step))] == [float] * 3


def test_an_integer_is_one_where_it_has_to_be():
    assert steps_of('for i in range(2): goto([5, 6][i], len("abc" * 2), 7 // 2)') == [(5, 6, 3), (6, 6, 3)]


def test_what_a_script_prints_is_printed():
    said = []
    steps_of('print("height", 1.5)', say=lambda *words: said.append(words))
    assert said == [('height', 1.5)]


@pytest.mark.parametrize(
    ('text', 'place', 'reason'),
    [
        ('x = 1\nimport os', '2:1', 'there is no import in a script'),
        ('x = (1).__class__', '1:5', 'there is no access to __class__ in a script'),
        ('x = []._private', '1:5', 'there is no access to _private in a script'),
        ('__builtins__', '1:1', 'there is no name __builtins__ in a script'),
        ('def __tick__(): return 1', '1:1', 'there is no name __tick__ in a script'),
        ('try: x = 1\nexcept: pass', '1:1', 'there is no try in a script'),
        ('def f(): yield 1', '1:10', 'there is no yield in a script'),
    ],
)
def test_what_must_not_be_in_a_script_is_refused_before_it_runs(text, place, reason):
    said = []
    error = error_of(text + '\nprint("ran")', say=lambda *words: said.append(words))
    assert str(error) == 'tour.script:{}: {}'.format(place, reason)
    assert said == []


@pytest.mark.parametrize('name', ['open', 'eval', 'getattr', '__import__', 'rospy'])
def test_a_script_has_no_name_that_leads_out_of_it(name):
    assert name in error_of('{}'.format(name)).reason


@pytest.mark.parametrize(
    'text',
    [
        'while True: pass',
        'while True:\n    goto(1, 2, 3)',
        'def f(n): return f(n - 1) + f(n - 1) if n else 1\nf(60)',
        'f = lambda n: f(n - 1) + f(n - 1) if n else 1\nf(60)',
        'x = [1 for a in range(1000) for b in range(1000)]',
        'x = sum(1 for a in range(1000) for b in range(1000))',
        'points = [1]\nfor point in points: points.append(point)',
    ],
)
def test_a_script_without_an_end_ends_with_an_error(text):
    assert 'the script does not end: stopped after 5000 steps' in error_of(text, step_limit=5000).reason


def test_a_range_beyond_the_limit_is_refused():
    assert 'longer than the 100000 steps' in error_of('list(range(10 ** 9))').reason


@pytest.mark.parametrize(
    'text',
    [
        'x = 3\nwhile True: x = x * x',
        'x = [3]\nwhile True: x[0] **= 2',
        'x = 3\nwhile True: x *= x',
        'x = 2 ** 10 ** 9',
        'x = 1 << 10 ** 9',
        'x = factorial(10 ** 9)',
        'x = math.comb(10 ** 9, 5 * 10 ** 8)',
        's = "ab"\nwhile True: s = s + s',
        's = "ab"\nwhile True: s += s',
        's = "ab"\nwhile True: s = f"{s}{s}"',
        's = {"a": "ab"}\nwhile True: s["a"] *= 2',
        's = {"a": "ab"}\nwhile True: s["a"] += s["a"]',
        's = "a" * 10 ** 12',
        's = 10 ** 12 * [1]',
        's = [1]\nwhile True: s.extend(s)',
        's = [1]\nwhile True: s = [*s, *s]',
        's = [1]\nwhile True: s[:0] = s',
        's = (1, 2)\nwhile True: s = sum([s, s], ())',
    ],
)
def test_what_grows_without_an_end_ends_with_an_error(text):
    reason = error_of(text).reason
    assert 'no float holds' in reason or 'is longer than the 100000 steps' in reason


def test_operations_that_may_grow_give_what_they_always_gave():
    (step,) = steps_of("""
a = b = [1.0]
a *= 2
x = {'n': 3}
x['n'] **= 2
n = 1
n <<= 3
goto(len(b) + x['n'], (-2) ** 3 + 1 ** 10 ** 6 + 2 ** -1, n * 2.5 * 0 ** 5 + (3 << 2) + len('ab' * -1))
""")
    assert step == (11, -6.5, 12)
    assert [source.location_id for source in rosslt.sources(steps_of('x = 2\nx *= 3\ngoto(x ** 2, 0, 0)')[0].x)] == [
        0,
        1,
        2,
    ]


def test_functions_that_count_give_what_they_always_gave():
    assert steps_of('goto(factorial(5), comb(10 ** 9, 1) + comb(2, 3), perm(4) + perm(4, 2))') == [(120, 10**9, 36)]
    assert 'ValueError' in error_of('factorial(-1)').reason
    assert 'TypeError' in error_of('factorial(1, 2)').reason


def test_recursion_without_an_end_ends_with_an_error():
    assert error_of('def f(): return f()\nf()').line == 1


@pytest.mark.parametrize(
    ('text', 'line', 'reason'),
    [
        ('x = 1\ngoto(1, 2)\n', 2, "TypeError: goto() missing 1 required positional argument: 'z'"),
        ('def f():\n    return 1 / 0\n\nf()', 2, 'ZeroDivisionError'),
        ('goto("a", 2, 3)', 1, "goto takes numbers, not 'a'"),
        ('goto(True, 2, 3)', 1, 'goto takes numbers, not True'),
        ('goto(inf, 2, 3)', 1, 'goto takes finite numbers, not inf'),
        ('wait(-1)', 1, 'wait takes 0 or more seconds, not -1'),
        ('\n\nreturn 1', 3, "'return' outside function"),
        ('x = sqrt(-1)', 1, 'ValueError: math domain error'),
        ('undefined', 1, "NameError: name 'undefined' is not defined"),
    ],
)
def test_an_error_names_file_line_and_reason(text, line, reason):
    error = error_of(text)
    assert (error.file, error.line) == ('tour.script', line)
    assert reason in error.reason
