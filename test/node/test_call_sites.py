"""Where a call stands in its file is found on every Python, and what identifies it outlives edits around it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import rosgraph

from rosslt.node.locations.call_sites import CallSite, identity_of, name_of, word_of

FOLDER = Path(__file__).resolve().parents[2] / 'src' / 'rosslt' / 'node' / 'locations'

#: Calls in all kinds of places; each says its own name.
CALLS = """\
class Thing:
    first, second = here('a'), here('b')

    def method(self):
        self.gain = here('c', here('d'), key=here('e'))
        return [here('f') for _ in range(1)] + [(lambda: here('g'))()]

    @staticmethod
    def nested():
        def inner(default=here('h')):
            return here('i') if default else here('j')

        return inner(), inner('')


class Chain:
    here = staticmethod(chained)


def lines():
    x = here(
        'k',
        here('l'),
    )
    (Chain
     .here('m').here('n'))
    with open(__file__) as file, file:
        assert here('o'), here('never')
    \u00e9 = '\u00fc'; y = here('p')  # a line with letters of two bytes
    return {here('q'): here('r'), **{here('s'): 1}}, here('t', *here('u'), **{'v': here('v')}), x, y, \u00e9


def unchanged(_marker):
    return lambda function: function


@unchanged(here('w'))
def decorated():
    for number in here('x'):
        while not here('y'):
            pass
        try:
            number = len(here('z'))
        finally:
            here('0')


Thing().method(), Thing().nested(), lines(), decorated()
"""

PROBE = """\
import importlib.util, json, sys
for name in ('literal_identities', 'call_sites'):
    spec = importlib.util.spec_from_file_location(name, sys.argv[1] + name + '.py')
    call_sites = sys.modules['rosslt.node.locations.' + name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(call_sites)
sites = []

def here(marker, *_values, **_more):
    sites.append((marker, call_sites.call_site(sys._getframe(1))))
    return marker

def chained(marker):
    sites.append((marker, call_sites.call_site(sys._getframe(1))))
    return names['Chain']

path = sys.argv[2]
with open(path, encoding='utf-8') as file:
    code = compile(file.read(), path, 'exec')
names = {'here': here, 'chained': chained, '__name__': 'calls', '__file__': path}
exec(code, names)
print(json.dumps([[marker, *site[1:3], call_sites.identity_of(site, None), site.function] for marker, site in sites]))
"""


def pythons():
    """All Pythons from 3.8 on that are found, this one with and without columns in its code."""
    yield pytest.param(sys.executable, {}, id='this Python')
    yield pytest.param(sys.executable, {'PYTHONNODEBUGRANGES': '1'}, id='this Python without columns')
    folders = [*Path.home().glob('.pyenv/versions/*/bin'), *map(Path, os.environ.get('PATH', '').split(os.pathsep))]
    for minor in range(8, 14):
        found = next(filter(runs, (folder / f'python3.{minor}' for folder in folders)), None)
        if found is not None:
            yield pytest.param(str(found), {}, id=f'3.{minor}')


def runs(python):
    """Whether a path is a Python, and not what only says that there is none."""
    if not python.is_file():
        return False
    return subprocess.run([str(python), '-c', ''], stderr=subprocess.DEVNULL, check=False).returncode == 0


def sites(tmp_path, text, python=sys.executable, environment=None):
    """[(name of the call, line, column, identity, function)], as they are made in a run of the text."""
    path = tmp_path / 'calls.py'
    path.write_text(text, encoding='utf-8')
    result = subprocess.run(
        [python, '-c', PROBE, f'{FOLDER}/', str(path)],
        env={**os.environ, 'PYTHONPATH': '', 'PYTHONIOENCODING': 'utf-8', **(environment or {})},
        capture_output=True,
        encoding='utf-8',
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@pytest.mark.parametrize(('python', 'environment'), pythons())
def test_a_call_is_where_it_is_written_on_every_python(python, environment, tmp_path):
    found = {marker: (line, column) for marker, line, column, _, _ in sites(tmp_path, CALLS, python, environment)}
    written = {}
    for number, line in enumerate(CALLS.splitlines(), 1):
        for match in re.finditer(r"here\('(.)'", line):
            written[match.group(1)] = number, match.start() + 1
    written['k'] = (CALLS[: CALLS.index('here(\n')].count('\n') + 1, 9)
    chain = CALLS[: CALLS.index('(Chain')].count('\n') + 1
    written['m'] = written['n'] = (chain, 6)
    assert found == written


@pytest.mark.parametrize(('python', 'environment'), pythons())
def test_identities_are_the_same_on_every_python(python, environment, tmp_path):
    assert sites(tmp_path, CALLS, python, environment) == sites(tmp_path, CALLS)


def identities(tmp_path, text):
    return {marker: identity for marker, _, _, identity, _ in sites(tmp_path, text)}


def test_lines_above_and_comments_change_no_identity(tmp_path):
    text = "def f():\n    x = here('a')\n    return x, here('b')\n\nf()\n"
    above = "'''New.'''\n\ndef g():\n    here('c')\n\n"
    edited = above + text.replace('):', '):\n    y = 1').replace("('a')", "('a')  # new")
    before, after = identities(tmp_path, text), identities(tmp_path, edited)
    assert before == {marker: after[marker] for marker in before}


@pytest.mark.parametrize(
    ('text', 'edit'),
    [
        ("servo(3, here('a'))\n", ('3', '4')),
        ("servo(\n    here('a'),\n    3)\n", ('3', '4')),
        ("p[0] = here('a')\n", ('0', '1')),
        ("x = [-1.5, here('a')]\n", ('-1.5', '1.5')),
        ("if p[1]:\n    x = here('a')\nelse:\n    x = here('b')\n", ('if', 'if not')),
    ],
)
def test_an_edit_beside_a_number_changes_its_identity(tmp_path, text, edit):
    text = 'def servo(n, x):\n    pass\n\np = [0, 1]\n' + text
    head, tail = text.split('1]\n')
    before = set(identities(tmp_path, text).values())
    assert before
    assert not before & set(identities(tmp_path, head + '1]\n' + tail.replace(*edit, 1)).values())


def test_an_entry_of_a_dict_an_argument_and_an_unpacked_variable_keep_their_identity_when_others_are_edited(tmp_path):
    for text in (
        "x, y = len([here('a', 1)]), len([here('b', 2)])\n",
        "dict(x=(here('a', 1)), y=(here('b', 2)))\n",
        "dict({'x': (here('a', 1)), 'y': (here('b', 2))})\n",
    ):
        edited = text.replace('1', '-5e3')
        assert identities(tmp_path, text) == identities(tmp_path, edited)


@pytest.mark.parametrize('character', ['\x0c', '\x0b', '\x1c', '\x85', '\u2028'], ids=ascii)
def test_what_ends_no_line_for_python_shifts_no_identity(tmp_path, character):
    text = "x = '{}'\na = here('a')\nb = here('b')\nc = here('c')\n"
    assert identities(tmp_path, text.format(character)) == identities(tmp_path, text.format(''))


KEYS = [
    *('+x', '-x', 'x', '_x', ' x', 'a b', 'a-b', 'a_b', 'é', 'è', 'Küche', '', 'a/b', 'a\nb', 'None', '1', '01', '-1'),
    *(
        (0, 1),
        (0, -1),
        (0,),
        0,
        1,
        -1,
        2,
        0.5,
        -0.5,
        1.0,
        5.0,
        True,
        False,
        'True',
        'a_b_' + '0' * 8,
        '\ud800',
        'x' * 300,
    ),
]


def test_different_keys_are_different_words_of_ros_names():
    words = {word_of(key) for key in KEYS}
    assert len(words) == len(KEYS)
    for word in words:
        assert rosgraph.names.is_legal_name('/talker/rosslt/name/' + word)


def test_usual_keys_stay_as_they_are():
    assert [word_of(key) for key in ('left_arm', 'Base2', 0, 17)] == ['left_arm', 'Base2', '0', '17']


def test_a_key_of_a_call_without_a_name_is_part_of_its_identity(tmp_path):
    site = CallSite(str(tmp_path / 'x.py'), 1, 1, '', identity='same')
    assert len({identity_of(site, key) for key in [None, *KEYS]}) == len(KEYS) + 1
    assert len({name_of(site, key) for key in [None, *KEYS]}) == len(KEYS) + 1
