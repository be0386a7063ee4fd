"""The compiled core of the room `values`: it does what the Python beside it does, and leaves nothing behind."""

import gc
import importlib
import operator
import os
import random
import shutil
import subprocess
import sys
import sysconfig
import weakref
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy
import pytest

from rosslt import Source, evaluate, explain, math, solve, track, untracked
from rosslt.values import affine, keeping, lazy, lazy_of, to_float, to_int
from rosslt.values.accelerator import CORE
from rosslt.values.arrays.numbers import of_numpy
from rosslt.values.operations.table import ADD, CONCATENATE, SUBTRACT, TO_FLOAT
from rosslt.values.tracked import TRACKED, new, resolve

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / 'test' / 'support' / 'arithmetic_report.py'
#: What runs both the core and Python by itself.
COMPARISON = 'test/values/test_core.py::test_with_and_without_the_core_all_results_are_the_same'
A, B = Source('/a', 1), Source('/b', 2)


def python(*arguments, **settings):
    """Starts ROS's Python with settings in its environment."""
    env = {**{name: text for name, text in os.environ.items() if name != 'ROSSLT_PURE'}, **settings}
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env=env,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        universal_newlines=True,
    )


def output(process):
    """What a program has printed, when it has ended well."""
    text = process.communicate()[0]
    assert process.returncode == 0, text[-4000:]
    return text


def test_the_workspace_has_the_core_unless_python_alone_is_asked_for():
    assert (CORE is None) == bool(os.environ.get('ROSSLT_PURE'))


@pytest.mark.parametrize('seed', [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_with_and_without_the_core_all_results_are_the_same(seed):
    both = [python(REPORT, 300, seed), python(REPORT, 300, seed, ROSSLT_PURE='1')]
    compiled, alone = [output(process).splitlines() for process in both]
    assert len(compiled) > 1000
    assert compiled == alone


FUNCTIONS = [abs, operator.neg, math.sin, math.degrees]
OPERATORS = [
    *[operator.add, operator.sub, operator.mul, operator.truediv] * 3,
    operator.floordiv,
    operator.mod,
    math.hypot,
]


def _value_of_many_operations(chance):
    values = [track(chance.choice([chance.uniform(-2, 2), chance.randint(-3, 3)]), Source('/n', n)) for n in range(4)]
    for _ in range(chance.randint(1, 60)):
        a = chance.choice(values[-8:])
        b = chance.choice([*values[-8:], chance.uniform(-2, 2), chance.randint(-3, 4), 0, 1e-308])
        one, both = chance.choice(FUNCTIONS), chance.choice(OPERATORS)
        try:
            made = chance.choice([one(a), both(a, b), both(b, a)])
        except ArithmeticError:
            continue
        if type(made) in TRACKED and abs(made) < 1e300:
            values.append(made)
        if chance.random() < 0.02:
            importlib.import_module('rosslt.values.affine').folded(chance.choice(values))
    return values[-1]


def test_the_core_sweeps_as_python_does_to_the_last_bit():
    python_alone = importlib.import_module('rosslt.values.affine')
    chance, compared = random.Random(7), 0
    for _ in range(1500):
        value = _value_of_many_operations(chance)
        if CORE is None or getattr(value, '_fold', None) is not None:
            continue
        assert CORE.swept([value]) is not NotImplemented
        (swept,) = CORE.swept([value])
        expected = python_alone._swept(python_alone._nodes_below([value]), value)
        assert [(id(leaf), repr(slope)) for leaf, slope in swept[0]] == [
            (id(leaf), repr(slope)) for leaf, slope in expected[0]
        ]
        assert swept[1] == expected[1]
        compared += 1
    assert compared > 1000 or CORE is None


def test_the_core_finds_the_terms_that_python_finds():
    python_alone, chance, are_affine = importlib.import_module('rosslt.values.affine'), random.Random(11), 0
    for seed in range(3000):
        found = []
        for find in (affine, python_alone.affine_of_python):  # each of a value that nothing is known of yet
            chance.seed(seed)
            value = _value_of_many_operations(chance)
            found.append([find(value), find(value)])
        for one, other in zip(*found):
            assert (one is None) == (other is None)
            for (source, at, slope), term in zip(one or (), other or ()):
                assert term == (source, at, pytest.approx(slope, rel=1e-12, abs=1e-12))
                assert [type(part) for part in term[1:]] == [type(at), type(slope)]
        are_affine += found[0][0] is not None
    assert are_affine > 100


def test_functions_of_plain_numbers_are_called_with_them_and_others_with_what_may_be_tracked():
    calls = []
    kept = keeping(*[lambda *args, name=name: calls.append((name, args)) for name in ('plain', 'tracked', 'others')])
    x, flag, text = track(1.0, A), track(True, A), track('a', A)
    for arguments in (
        (),
        (1.0, 2),
        ('a', 1),
        (text,),
        (x,),
        (1.0, x),
        (flag,),
        ([1.0],),
        ((),),
        (None,),
        (x, True),
        (True, x),
    ):
        kept(*arguments)
    assert [name for name, _ in calls] == ['plain'] * 4 + ['tracked'] * 5 + ['others'] * 3


def test_a_function_of_numbers_records_what_its_row_of_the_table_does():
    x, n = track(0.25, A), track(3, B)
    made = {
        'sin': math.sin(x),
        'atan2': math.atan2(x, 2.0),
        'hypot': math.hypot(3, x),
        'pow': math.pow(x, n),
        'log': math.log(x),
        'int': to_int(x * 10.0),
        'float': to_float(n),
        '**': x**2,
        'abs': abs(-x),
    }
    for name, value in made.items():
        assert name in explain(value), name
    assert [type(untracked(made[name])) for name in ('int', 'float')] == [int, float]
    assert [evaluate(made['hypot'], {A: 4.0}), evaluate(made['**'], {A: 3.0})] == [5.0, 9.0]
    for call in (lambda: math.sqrt(-x), lambda: math.log(x - 0.25), lambda: math.sin(), lambda: math.sin('a')):
        with pytest.raises((ValueError, TypeError)):
            call()
    assert [pow(n, 2, 5), pow(2, n, 5), type(pow(n, 2, 5))] == [4, 3, int]
    assert isinstance((-x) ** 0.5, complex)


def test_what_is_loaded_or_of_numpy_is_known_not_to_be_affine_without_slopes():
    curved = math.sin(track(0.3, A)) * track(2.0, B)
    loaded = lazy_of([untracked(curved)], lambda _, __: curved)[0]
    for value in (loaded, of_numpy(numpy.float64(untracked(curved)), curved)):
        assert affine(value) is None
        assert CORE is None or getattr(value, '_fold', None) is None


def test_what_the_core_does_not_know_is_swept_in_python():
    affine = importlib.import_module('rosslt.values.affine')
    for value in (track(True, A) * 2.0, track(2**70, A) * 3 + 1, math.prod([track(2.0, A), track(3, B)])):
        made = affine.folded(value)
        assert [leaf._record[1] for leaf, _ in made[1]] == [A, B][: len(made[1])]


STAND_IN = """
import sys, types
sys.modules['rosslt._core'] = core = types.ModuleType('rosslt._core')
core.INTERFACE = {interface}
from rosslt.values.accelerator import CORE
print(CORE is None)
"""


def test_a_core_that_is_older_than_the_python_is_not_used():
    assert output(python('-c', STAND_IN.format(interface=0))) == 'True\n'


def test_a_core_that_was_built_for_another_python_is_not_found(tmp_path):
    package = tmp_path / 'rosslt'
    package.mkdir()
    for part in (ROOT / 'src' / 'rosslt').iterdir():
        (package / part.name).symlink_to(part)
    (package / '_core.cpython-37m-x86_64-linux-gnu.so').write_bytes(b'of another Python')
    program = 'import rosslt; from rosslt.values.accelerator import CORE; print(rosslt.__file__, CORE)'
    assert output(python('-c', program, PYTHONPATH=str(tmp_path))) == f'{package}/__init__.py None\n'


CHAINS = """
from rosslt import Source, track
from rosslt.values.operations.table import ADD, SUBTRACT, TO_FLOAT
from rosslt.values.tracked import new

def grown(step, value, times):
    for _ in range(times):
        value = step(value)
    return value

leaf = track(1.5, Source('/a', 1))
for step in (
    lambda x: new(1.5, (ADD.left, x, 1.0), 5),
    lambda x: new(1.5, (SUBTRACT.both, leaf, x), 5),
    lambda x: new(1.5, (SUBTRACT.both, x, x), 5),
    lambda x: new(1.5, (ADD.left, new(2**70, (ADD.left, x, 1), 5), 1.0), 5),
    lambda x: new(1.5, (TO_FLOAT.left, new(True, (ADD.left, x, 1), 5), None), 5),
    lambda x: new(1.5, (ADD.left, new('a', (ADD.left, [x], 1), 5), 1.0), 5),
):
    value = grown(step, leaf, 200_000)
    del value
print('gone')
"""


def test_a_long_chain_goes_without_filling_the_stack():
    assert output(python('-c', CHAINS)) == 'gone\n'


class Marker:
    """Something that tells when it goes."""


@pytest.mark.parametrize('plain', [0.5, 7, 2**80, True, 'a'])
@pytest.mark.parametrize(
    'made_by',
    [lambda value, load: lazy([value], [load]), lambda value, load: lazy_of([value], lambda one, _: load(one))],
)
def test_what_refers_to_itself_goes_with_the_garbage(plain, made_by):
    marker = Marker()
    gone = weakref.ref(marker)

    def entangle(holder):
        (value,) = made_by(plain, lambda given: track(given, holder[1]))
        holder += [value, value + 'b' if plain == 'a' else value * 2 - value]

    entangle([marker])
    del marker
    gc.collect()
    assert gone() is None


def test_what_is_recorded_goes_at_once():
    """Without a cycle it needs no collector, and the collector needs not look at it."""
    gc.collect()
    gc.disable()
    try:

        def work():
            x, n = track(0.5, A), track(7, B)
            y = 1.0 - (x * 2.0 + n * x) / 3 - -x
            z = math.sin(y) + (n * n + 3) // 2 + 2**70 * n
            assert solve(y, 0.25)
            assert evaluate(x * 2.0 - 1, {A: 3.0}) == 5.0
            assert explain(z)
            for wrong in (lambda: x / 0, lambda: n // 0, lambda: x + 'a', lambda: evaluate(1 / x, {A: 0.0})):
                with pytest.raises((ArithmeticError, TypeError)):
                    wrong()

        for _ in range(20):
            work()
        gc.collect()
        before = sys.getallocatedblocks()
        for _ in range(200):
            work()
        gc.collect()
        assert sys.getallocatedblocks() - before < 150
        if CORE is not None:
            assert not gc.is_tracked(track(0.5, A) * 2.0 + track(7, B))
    finally:
        gc.enable()


def test_values_are_shared_by_threads_while_their_records_are_replaced():
    base = track(0.5, A)
    shared = lazy([0.5] * 50, [lambda plain: base] * 50)
    switch = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)

    def work(own):
        total = own * 0.0
        for _ in range(40):
            for value in shared:
                total = total + math.sin(value * 2.0) / 7
                resolve(value)
                assert evaluate(value * 2.0 + 1, {A: 2.0}) == 5.0
                assert solve(value * 4.0, 4.0) == {A: 1.0}
        assert evaluate(total, {A: 0.5}) == pytest.approx(total._plain)

    try:
        with ThreadPoolExecutor(4) as pool:
            assert len([*pool.map(work, shared[:4])]) == 4
    finally:
        sys.setswitchinterval(switch)


def test_a_tracked_class_makes_plain_values_also_when_it_is_derived_from():
    for tracked in TRACKED:
        kind = type(tracked())
        derived = type('Derived', (tracked,), {})
        assert type(derived()) is kind
        assert derived() == kind()


def test_the_plain_value_is_always_the_same_object():
    number, whole = 0.1 + len(sys.argv), 2**70 + len(sys.argv)
    assert track(number, A)._plain is number
    assert track(whole, A)._plain is whole
    for made in (track(number, A) * 2.0, -track(number, A), track(whole, A) * 2):
        assert made._plain is made._plain


def test_a_record_of_another_shape_is_refused():
    value = track(0.5, A)
    for wrong in (None, (), (ADD.left, value), [ADD.left, value, 1.0]):
        if CORE is not None:
            with pytest.raises(TypeError, match='form, first, second'):
                value._record = wrong
    assert explain(new('ab', (CONCATENATE.left, track('a', B), 'b'), 2)) == "'a' [/b#2] + 'b'"
    assert explain(new(0.0, (SUBTRACT.both, value, value), 2)) == '0.5 [/a#1] - 0.5 [/a#1]'
    assert explain(new(2.0, (TO_FLOAT.left, track(2, B), None), 2)) == 'float(2 [/b#2])'


SANITIZED = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location('rosslt._core', sys.argv[1])
sys.modules['rosslt._core'] = importlib.util.module_from_spec(spec)
import pytest
sys.exit(pytest.main(sys.argv[2:]))
"""


@pytest.mark.slow
def test_sanitizers_find_nothing(tmp_path):
    """The laws and the tests above, with checks of each access to memory and of each computation."""
    core = tmp_path / ('_core' + sysconfig.get_config_var('EXT_SUFFIX'))
    headers = sysconfig.get_path('include')
    options = ['-g', '-O1', '-fPIC', '-shared', '-fsanitize=address,undefined', '-fno-sanitize-recover=undefined']
    sources = sorted((ROOT / 'src' / 'rosslt' / 'values' / 'core').glob('*.c'))
    subprocess.run(['gcc', *options, '-ffp-contract=off', f'-I{headers}', *sources, '-o', core], check=True)
    sanitizer = subprocess.check_output(['gcc', '-print-file-name=libasan.so'], universal_newlines=True).strip()
    tests = ['test/values/test_laws.py', 'test/values/test_core.py', 'test/values/test_core_systems.py']
    tests += ['test/values/test_tracked.py', 'test/messages/test_walkers.py']
    process = python(
        *['-c', SANITIZED, core, *tests, '-q', '-m', 'not slow', '--deselect', COMPARISON],
        LD_PRELOAD=sanitizer,
        PYTHONMALLOC='malloc',  # so that each object is an allocation of its own
        ASAN_OPTIONS='detect_leaks=0',  # Python itself keeps what it has until the end
        ROSSLT_MANY_EXAMPLES='',
    )
    assert ' passed' in output(process)


def pythons_with_headers():
    """Those from 3.8 to 3.11 on this machine that a core can be built for, this one among them: `{version: path}`."""
    ask = 'import sys, sysconfig; print(*sys.version_info[:2], sysconfig.get_path("include"))'
    named = [shutil.which('python3.%d' % minor) for minor in range(8, 12)]
    found = {}
    for path in [*Path.home().glob('.pyenv/versions/3.*/bin/python3'), *filter(None, named), sys.executable]:
        told = subprocess.run([path, '-c', ask], stdout=subprocess.PIPE, text=True, check=False).stdout
        major, minor, headers = (told.split() or ['0', '0', ''])[:3]
        if (3, 8) <= (int(major), int(minor)) < (3, 12) and (Path(headers) / 'Python.h').is_file():
            found[int(minor)] = str(path)
    return found


IN_ANOTHER_PYTHON = """
from rosslt import Source, evaluate, math, solve, track
from rosslt.values.accelerator import CORE
assert CORE is not None
x = track(2.0, Source('/a', 1))
y = math.sin(x * 0.1) + x // 3
assert solve(3 * x - 1, 11.0) == {Source('/a', 1): 4.0}
assert evaluate(y, {Source('/a', 1): 2.5}) == math.sin(2.5 * 0.1)
"""


@pytest.mark.slow
def test_it_is_built_and_works_for_each_python_of_this_machine(tmp_path):
    """ROS Noetic has Python 3.8; its headers differ from those of later ones."""
    sources = sorted((ROOT / 'src' / 'rosslt' / 'values' / 'core').glob('*.c'))
    pythons = pythons_with_headers()
    assert sys.version_info[1] in pythons
    for minor, path in pythons.items():
        folder = tmp_path / str(minor)
        shutil.copytree(ROOT / 'src', folder, ignore=shutil.ignore_patterns('__pycache__'))
        ask = 'import sysconfig; print(sysconfig.get_path("include"), sysconfig.get_config_var("EXT_SUFFIX"))'
        headers, suffix = subprocess.check_output([path, '-c', ask], universal_newlines=True).split()
        core = folder / 'rosslt' / ('_core' + suffix)
        options = ['-O0', '-fPIC', '-shared', '-Wall', '-Werror', '-ffp-contract=off', '-isystem', headers]
        subprocess.run(['gcc', *options, *sources, '-o', core], check=True)
        env = {**os.environ, 'PYTHONPATH': str(folder), 'ROSSLT_PURE': ''}
        subprocess.run([path, '-c', IN_ANOTHER_PYTHON], env=env, check=True)


@pytest.mark.slow
@pytest.mark.parametrize('suite', ['values', 'messages', 'node'])
def test_the_tests_pass_in_python_alone(suite):
    """What needs no master of the room `node`; with fewer examples, as all other results are compared above."""
    process = python(
        *['-m', 'pytest', f'test/{suite}', '-q', '-m', 'not slow and not rostest', '--deselect', COMPARISON],
        ROSSLT_PURE='1',
        ROSSLT_MANY_EXAMPLES='',
    )
    assert ' passed' in output(process)
