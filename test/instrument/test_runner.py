"""A program that `rosslt run` runs behaves as when Python runs it."""

import importlib.util
import os
import re
import signal
import stat
import sys
from pathlib import Path

import pytest

from rosslt.instrument import loader
from rosslt.instrument.loader import OwnModules
from rosslt.instrument.tree_rewriting import CELLS
from support.shell import rosslt
from support.unmodified import Unmodified

PROGRAMS = {
    'arguments and paths': """
import os, sys
print(sys.argv[1:], os.path.basename(sys.argv[0]), __name__, os.path.basename(__file__), sys.path[0])
print(sys.modules['__main__'].__dict__ is globals(), __package__, __spec__, type(__loader__).__name__)
""",
    'its own modules': 'from beside import area\nprint(area(2.0), __name__)\n',
    'exit code': 'import sys\nprint("before")\nsys.exit(3)\n',
    'exit with a text': 'import sys\nsys.exit("it is over")\n',
    'an exception': 'def f(x):\n    return 1.0 / x\n\nprint("so far")\nf(0)\n',
    'an exception in a function of math': 'import math\nx = -1.5\nmath.sqrt(x)\n',
    'an excepthook of its own': 'import sys, traceback\nassert sys.excepthook is sys.__excepthook__\n'
    'def hook(kind, error, tb):\n    print(kind.__name__, [one.name for one in traceback.extract_tb(tb)])\n'
    'sys.excepthook = hook\ndef f(x):\n    return x / 0\nf(2.5)\n',
    'a chain of exceptions': 'try:\n    {}[2]\nexcept KeyError as error:\n    raise RuntimeError("no") from error\n',
    'a signal': 'import os, signal\nos.kill(os.getpid(), signal.SIGTERM)\n',
    'an interrupt': 'raise KeyboardInterrupt\n',
    'the end': 'import atexit\natexit.register(lambda: print("bye"))\nprint(2.5)\n',
    'a syntax error': 'x = = 2\n',
}
#: Programs that print something and go on: each is a module of one program.
MODULES = {
    'a traceback that it prints': 'import traceback, numpy\ndef f(x, n=4):\n    return 10 + x / (n - 4) + 30\n'
    'try:\n    f(2.5)\nexcept ZeroDivisionError as error:\n'
    '    print("".join(traceback.format_tb(error.__traceback__)[1:]))\n',
    'its source': 'import inspect\ndef f():\n    return 2.0 * 3  # six\nprint(inspect.getsource(f))\n',
    'text of numbers': 'import json, yaml, pickle, copy\nv = [1, 2.5, {"a": 1e-3}]\n'
    'print(json.dumps(v), yaml.dump(v), yaml.safe_dump(v), pickle.loads(pickle.dumps(v)), copy.deepcopy(v), v)\n',
    'arguments of rospy': 'import rospy, sys\nprint(rospy.myargv()[1:], rospy.myargv(["a", "b:=c"]))\n',
    'a thread': 'import threading\nt = threading.Thread(target=lambda: print(2.0 / 3))\nt.start()\nt.join()\n',
    'an enumeration': 'from enum import Enum, IntEnum\nclass A(Enum):\n    B = 1\nclass C(IntEnum):\n    D = 2\n'
    'print(A.B, A(1), C.D + 1, C(2))\n',
    'texts of errors': """
x, n = 5.5, 2
for wrong in (
    lambda: [1][x], lambda: range(x), lambda: x(), lambda: x[0], lambda: list(x), lambda: n.foo, lambda: 'a' + n,
    lambda: x + 'a', lambda: len(n),
):
    try:
        wrong()
    except (TypeError, AttributeError) as error:
        print(type(error).__name__, error)
print(type(x), x.__class__, type(n).__name__, type(x) is float, isinstance(n, int))
""",
    'the same object': """
state = 0
def change(new):
    global state
    if new is not state:
        print('changed to', new)
        state = new
change(0); change(1); change(1)
""",
    'a printed message': """
from geometry_msgs.msg import Point
from sensor_msgs.msg import Joy
print(Joy(axes=[0.5, 1.0], buttons=[1, 0]))
print(Point(1, 2.5, -0.5), [Point(1, 2, 3)])
""",
    'numbers of numpy': """
import numpy as np
a = np.array([1.5, 2.5])
print(a[0].item(), a.mean().astype(int), a.max().round(1), np.floor(a[0]), np.linalg.norm(a).shape, a[1].tolist())
""",
    'functions of math that round': """
import math
print(math.fsum([0.1] * 10), math.hypot(0.1, 0.2, 0.3), math.dist((0.1, 2), (1, 0.25, )), math.prod([0.1, 3, 0.7]))
print(math.modf(-0.25), math.modf(-2.0), sum([0.1] * 10), math.hypot(3, 4))
""",
    'classes and pickles': """
import pickle, pickletools
x, n = 1.5, 2
print(x.__class__ is float, n.__class__ is int, n.__class__ is float, type(n) is int)
print([part[0].name for part in pickletools.genops(pickle.dumps([x, n, 'text'])) if 'rosslt' in str(part[1])])
""",
    'arrays of other kinds': """
import numpy as np
a = np.array([1, 2.5, 3])
f = np.zeros(3, dtype=np.float32)
f[0], f[1:] = 0.1, [1.1, 2]
print(a.tolist(), a[0], np.array([[1, 2], [3]], dtype=object), np.array([-0.0, 0.0]).tolist())
print(f, f * 0.1, f.tolist(), f[0], type(f[0]), f[0] * f[1], f.astype(float), np.float32(0.1) + f[2], a.astype('f4'))
try:
    np.array([[1, 2], [3]])
except ValueError as error:
    print(error)
""",
    'a data class': """\
import dataclasses
@dataclasses.dataclass
class P:
    x: float = 1.0
    y: int = 2
print(P(), P(3.5))
""",
}
ARGUMENTS = ('one', '--two=3', 'b:=c', '_x:=1.5', '__name:=other')
BESIDE = 'import math\n\ndef area(r):\n    return math.pi * r ** 2 * 1.0\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'beside.py').write_text(BESIDE)
    return tmp_path


@pytest.mark.parametrize('code', PROGRAMS.values(), ids=PROGRAMS)
def test_a_program_ends_as_by_itself(folder, code):
    plain = Unmodified(folder, 'program', code.lstrip(), *ARGUMENTS, tracked=False).end()
    assert Unmodified(folder, 'program', code.lstrip(), *ARGUMENTS).end() == plain


def test_what_programs_print_is_what_they_print_by_themselves(folder):
    for number, text in enumerate(MODULES.values()):
        (folder / f'module_{number}.py').write_text(text.lstrip())
    code = '\n'.join(f'import module_{number}' for number in range(len(MODULES)))
    plain = Unmodified(folder, 'program', code, *ARGUMENTS, tracked=False).end()
    assert plain[0] == 0
    for _ in range(2):  # the second time from the cache
        assert Unmodified(folder, 'program', code, *ARGUMENTS).end() == plain


def test_the_debugger_shows_the_lines_of_the_file(folder):
    code = (
        'import pdb, io, sys\nx = 2.5\ndef f(y):\n    z = y * 3.0\n    d.set_trace()\n    return z\n'
        'd = pdb.Pdb(stdin=io.StringIO("p z\\nl\\nc\\n"), stdout=sys.stdout, nosigint=True)\nf(x)\n'
    )
    plain = Unmodified(folder, 'program', code, tracked=False).end()
    status, output, _ = Unmodified(folder, 'program', code).end()
    assert (status, output) == plain[:2]
    assert '7.5' in output
    assert '-> return z' in output


def test_bytecode_is_kept_in_a_folder_of_its_own(folder):
    assert Unmodified(folder, 'program', PROGRAMS['its own modules']).end()[0] == 0
    kept = [path for path in (folder / 'cache').rglob('*') if path.is_file()]
    assert len(kept) == 2
    assert not (folder / '__pycache__').exists()


def test_a_module_that_was_edited_is_rewritten_again(folder):
    assert Unmodified(folder, 'program', PROGRAMS['its own modules']).end()[1].startswith('12.56')
    (folder / 'beside.py').write_text(BESIDE.replace('1.0', '2.0'))
    assert Unmodified(folder, 'program', PROGRAMS['its own modules']).end()[1].startswith('25.13')


def test_a_cache_that_is_damaged_is_made_again(folder):
    first = Unmodified(folder, 'program', PROGRAMS['its own modules']).end()
    for path in (folder / 'cache').rglob('*'):
        if path.is_file():
            path.write_bytes(b'nothing of this kind')
    assert Unmodified(folder, 'program', PROGRAMS['its own modules']).end() == first


def test_a_file_that_is_written_for_another_python_runs_untracked(folder):
    program = folder / 'program.py'
    program.write_text('#!/usr/bin/env other_python\nprint "hello"\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    (folder / 'other_python').write_text('#!/bin/sh\nshift\necho other "$@"\nexit 4\n')
    (folder / 'other_python').chmod(0o755)
    result = rosslt('run', str(program), 'a', 'b', PATH=f'{folder}:{os.environ["PATH"]}')
    assert (result.returncode, result.stdout) == (4, 'other a b\n')
    assert 'program.py runs untracked: ' in result.stderr
    assert 'line 2' in result.stderr


def test_what_is_no_python_runs_untracked(folder):
    program = folder / 'node'
    program.write_text('#!/bin/sh\necho "$@"\nexit 4\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    result = rosslt('run', str(program), 'a', 'b')
    assert (result.returncode, result.stdout) == (4, 'a b\n')
    assert 'runs untracked: it is no Python file' in result.stderr


def test_a_program_is_called_as_it_is_named(folder):
    (folder / 'program.py').write_text('import sys\nprint(sys.argv)\n')
    name = os.path.relpath(str(folder / 'program.py'))
    assert rosslt('run', name, 'a').stdout == f"['{name}', 'a']\n"


def test_a_file_does_not_come_before_a_module_of_python_itself(folder, monkeypatch):
    name = next(name for name in sys.builtin_module_names if name not in sys.modules or name == 'time')
    (folder / f'{name}.py').write_text('VALUE = 2.5\n')
    (folder / 'other.py').write_text('VALUE = 2.5\n')
    monkeypatch.syspath_prepend(str(folder))
    finder = OwnModules(str(folder))
    assert finder.find_spec(name) is None
    assert type(finder.find_spec('other').loader) is loader.RewritingLoader


@pytest.mark.parametrize('generated', ['dynamic_reconfigure.cfg.TestConfig', 'geometry_msgs.msg._Pose'])
def test_what_is_generated_is_loaded_as_it_is(folder, generated, monkeypatch):
    text = Path(importlib.util.find_spec(generated).origin).read_text(encoding='utf-8')
    (folder / 'made_by_a_generator.py').write_text(text, encoding='utf-8')
    (folder / 'made_by_hand.py').write_text('gain = 2.0\n', encoding='utf-8')
    monkeypatch.syspath_prepend(str(folder))
    finder = OwnModules(str(folder))
    names = {}
    for name in ('made_by_a_generator', 'made_by_hand'):
        module = importlib.util.module_from_spec(finder.find_spec(name))
        module.__loader__.exec_module(module)
        names[name] = vars(module)
    assert CELLS not in names['made_by_a_generator']
    assert CELLS in names['made_by_hand']


def test_bytecode_is_that_of_all_files_that_rewrite():
    package = Path(loader.__file__).parents[1]
    needed, found = {'instrument/tree_rewriting'}, set()
    while needed - found:
        name = (needed - found).pop()
        found.add(name)
        text = (package / f'{name}.py').read_text()
        needed.update(
            f'instrument/{file}' for file in re.findall(r'^from rosslt\.instrument\.(\w+) import', text, re.M)
        )
    assert set(loader._REWRITING) == {*found, 'node/locations/literal_identities'}


def test_a_relay_of_a_catkin_workspace_is_followed(folder):
    script = folder / 'talker.py'
    script.write_text('import sys\nprint(__file__, sys.argv[1:], 2.5)\n')
    relay = folder / 'relay'
    relay.write_text(
        '#!/usr/bin/python3\n# -*- coding: utf-8 -*-\n# generated from catkin/cmake/template/script.py.in\n'
        f"# creates a relay to a python script source file, acting as that file.\npython_script = '{script}'\n"
    )
    assert rosslt('run', str(relay), 'a').stdout == f"{script} ['a'] 2.5\n"


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ((), 'which node?'),
        (('--what', 'x'), 'unrecognized arguments: --what'),
        (('nothing_of_this_name',), 'there is no file nothing_of_this_name'),
        (('no_such_package', 'node'), 'there is no package no_such_package'),
        (('rosslt', 'no_such_node'), 'there is no executable no_such_node in the package rosslt\n'),
        (('rosslt', 'slt_visualizer'), 'in the package rosslt (did you mean slt_visualization?)'),
        (('rossltt', 'slt_visualization'), '(did you mean rosslt?)'),
    ],
)
def test_what_cannot_be_run_is_said(arguments, words):
    result = rosslt('run', *arguments)
    assert result.returncode in (1, 2)
    assert words in result.stderr


def test_help_is_printed():
    assert 'launch-prefix="rosslt run"' in rosslt('run', '-h').stdout
    assert '--no-markers' in rosslt('launch', '-h').stdout


def test_an_installed_module_is_tracked_on_request(folder):
    package = folder / 'site-packages' / 'far_away'
    package.mkdir(parents=True)
    (package / '__init__.py').write_text('from far_away.part import VALUE\n')
    (package / 'part.py').write_text('VALUE = 2.5\n')
    code = (
        'import sys, os\nsys.path.append(os.path.join(os.path.dirname(__file__), "site-packages"))\n'
        'import far_away, rosslt\nprint(rosslt.is_tracked(far_away.VALUE))\n'
    )
    assert Unmodified(folder, 'program', code).end()[1] == 'False\n'
    assert Unmodified(folder, 'program', code, options=('--include', 'far_away')).end()[1] == 'True\n'


def test_signals_reach_the_program(folder):
    code = """\
import signal, sys, time
signal.signal(signal.SIGUSR1, lambda *_: sys.exit(7))
print("up", flush=True)
time.sleep(60)
"""
    program = Unmodified(folder, 'program', code)
    assert program.process.stdout.readline() == 'up\n'
    os.kill(program.process.pid, signal.SIGUSR1)
    assert program.end()[0] == 7


def test_the_collector_passes_over_what_was_there_before_the_program(folder):
    code = """
import gc, os
from rosslt import instrument
mine = []
seen = {id(thing) for thing in gc.get_objects()}
print(id(mine) in seen, id(vars(instrument)) in seen, id(vars(os)) in seen)
"""
    assert Unmodified(folder, 'program', code).end()[1] == 'True False False\n'
