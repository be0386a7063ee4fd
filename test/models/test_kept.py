"""What was learned of nodes, in files: as it was written, damaged, and of a node that has changed."""

import json
import math
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from rosslt import models
from rosslt.models import Answer, BadFile, Dependency, Kept, Learned, LiveProcess, Number, keep, kept_of, read_kept

TREE = {
    'robot': 'a',
    'ns': {'node': {'gain': 4.0, 'limits': {'low': -1, 'high': math.inf}, 'names': ['a', True]}, 'other': {'gain': 1}},
}
NAN = math.nan
LEARNED = Learned(
    dependencies=(
        Dependency(0, 0, 'smooth', 0.494, 2e-6, 0.494, 0.494, -0.1, 0.3),
        Dependency(0, 1, 'saturated', NAN, NAN, 0.0, 1.5, 0.0, 0.0),
    ),
    noise=(1e-9, NAN),
    unrepeatable=(1,),
    unanswered=(),
    untried=(2,),
    tolerance=0.05,
    trials=40,
)
INPUTS = tuple(Number('/joint_states', (('a', 'b'), 3), f'position[{index}]') for index in range(3))
OUTPUTS = tuple(Number('/tf', ('base', 'tip'), f'transforms[0].transform.rotation.{axis}') for axis in 'zw')
ANSWER = Answer(INPUTS, OUTPUTS, (0.3, 0.0, NAN), 0.004, 0.02, LEARNED, True, ('/robot', '/missing', '/ns/node/gain'))


@pytest.fixture
def program(tmp_path):
    """A program that waits."""
    path = tmp_path / 'program'
    path.write_text('waits\n', encoding='utf-8')
    return path


def live(**changes):
    """This process, as if it were a node."""
    types = {'subscribed': {'/joint_states': 'sensor_msgs/JointState'}, 'published': {'/tf': 'tf2_msgs/TFMessage'}}
    about = {'arguments': ('node', '_gain:=4', '__name:=node', 'in:=/x'), 'environment': {}, 'directory': '/', **types}
    process = LiveProcess('/ns/node', os.getpid(), os.path.realpath('/proc/self/exe'), **about)
    return process._replace(**changes)


def version(tree=TREE, **changes):
    return models.version_of(live(**changes), tree, ANSWER.asked)


@pytest.fixture
def file(tmp_path):
    return keep(str(tmp_path / 'learned'), Kept(version(), 1000.5, (ANSWER,)))


def test_what_is_written_is_read(file):
    read = read_kept(file)
    assert repr(read) == repr(Kept(version(), 1000.5, (ANSWER,)))  # NaN is not itself
    assert read.version.parameters == {
        '/ns/node/gain': '4.0',
        '/ns/node/limits/low': '-1',
        '/ns/node/limits/high': 'Infinity',
        '/ns/node/names': '["a", true]',
    }
    assert read.version.asked == {'/robot': '"a"', '/missing': ''}
    assert read.version.arguments == ('in:=/x',)
    (executable,) = read.version.program
    assert (executable.size, len(executable.digest)) == (os.path.getsize('/proc/self/exe'), 64)
    assert read.why_stale(version(), TREE) == ''


def test_there_is_one_file_for_a_node_and_program(file, tmp_path, program):
    folder = os.path.dirname(file)
    assert keep(folder, Kept(version({}), 2000.0, ())) == file
    other = keep(folder, Kept(version(arguments=('node', str(program))), 1500.0, (ANSWER,)))
    keep(folder, Kept(version(node='/ns/node/more'), 9000.0, ()))
    assert len(models.kept_files(folder)) == len(os.listdir(folder)) == 3
    assert other != file
    assert kept_of(folder, '/ns/node').when == 2000.0
    assert kept_of(folder, '/ns/node', version(arguments=('node', str(program)))).when == 1500.0
    assert kept_of(folder, '/nobody') is None
    assert kept_of(str(tmp_path / 'nothing'), '/ns/node') is None


def test_a_file_is_replaced_as_a_whole(file, monkeypatch):
    def fail(*_, **__):
        raise OSError(28, 'No space left on device')

    before = os.listdir(os.path.dirname(file))
    monkeypatch.setattr(json, 'dump', fail)
    with pytest.raises(OSError, match='No space left'):
        keep(os.path.dirname(file), Kept(version(), 3000.0, ()))
    assert os.listdir(os.path.dirname(file)) == before
    assert read_kept(file).when == 1000.5


def changed(file, *steps, to):
    """Write something else in a place of a file."""
    found = json.loads(Path(file).read_text(encoding='utf-8'))
    part = found
    for step in steps[:-1]:
        part = part[step]
    if to is None and isinstance(part, dict):
        del part[steps[-1]]
    else:
        part[steps[-1]] = to
    with open(file, 'w', encoding='utf-8') as written:
        json.dump(found, written)


DEPENDENCY = ('answers', 0, 'learned', 'dependencies', 0)


@pytest.mark.parametrize(
    ('steps', 'to', 'wrong'),
    [
        (('layout',), 2, 'its layout is 2, and 1 is read'),
        (('layout',), True, 'its layout is True'),
        (('layout',), None, 'it has no layout'),
        (('when',), None, 'it is not an object with answers, version, when'),
        (('more',), 1, 'it is not an object with answers, version, when'),
        (('when',), 'now', "when of it is not a finite number, but 'now'"),
        (('when',), math.inf, 'Infinity is no number of JSON'),
        (('when',), -1, 'when of it is not a number from 0 on, but -1'),
        (('when',), True, 'when of it is not a finite number, but True'),
        ((*DEPENDENCY, 'slope'), math.nan, 'NaN is no number of JSON'),
        (
            (*DEPENDENCY, 'slope'),
            10**400,
            'slope of [0] of dependencies of learned of [0] of answers of it is not',
        ),
        (
            (*DEPENDENCY, 'slope'),
            '0.5',
            'slope of [0] of dependencies of learned of [0] of answers of it is not',
        ),
        ((*DEPENDENCY, 'kind'), 'saturated', 'slope of [0] of answers of it is not one of saturated, but 0.494'),
        ((*DEPENDENCY, 'kind'), 'sure', 'is not one of smooth, coupled, kinked, saturated, stepped, discontinuous, '),
        ((*DEPENDENCY, 'kind'), ['smooth'], "but ['smooth']"),
        ((*DEPENDENCY, 'uncertainty'), -1, 'is not a number from 0 on, but -1'),
        ((*DEPENDENCY, 'low'), 1, 'low or high of [0] of answers of it is not around 0'),
        ((*DEPENDENCY, 'output'), 2, 'output of [0] of answers of it is not below 2, but 2'),
        ((*DEPENDENCY, 'input'), -1, 'is not a count, but -1'),
        ((*DEPENDENCY, 'input'), 0.5, 'is not a whole number, but 0.5'),
        (('answers', 0, 'at'), [1.0], 'at of [0] of answers of it is not a list of 3'),
        (('answers', 0, 'learned', 'noise'), [], 'noise of [0] of answers of it is not a list of 2'),
        (('answers', 0, 'learned', 'untried'), [3], 'untried of [0] of answers of it is not below 3, but 3'),
        (('answers', 0, 'outputs', 0, 'path'), 'x\x1b[2J', r"is not a text that can be printed, but 'x\x1b[2J'"),
        (('answers', 0, 'outputs', 0, 'topic'), 'tf', "is not a full name, but 'tf'"),
        (('answers', 0, 'outputs', 0, 'thing'), [{}], 'is not a text or a whole number, but {}'),
        (('answers', 0, 'is_isolated'), 1, 'is not true or false, but 1'),
        (('answers',), {}, 'answers of it is not a list, but {}'),
        (('version', 'node'), 5, 'node of version of it is not a text that can be printed, but 5'),
        (('version', 'program', 0, 'digest'), 'f' * 63, 'digest of [0] of program of version of it is not a SHA-256'),
        (('version', 'parameters'), [], 'parameters of version of it is not an object, but []'),
        (
            ('version', 'parameters', '/ns/node/gain'),
            4.0,
            "'/ns/node/gain' of parameters of version of it is not a",
        ),
    ],
)
def test_a_file_with_something_else_is_refused(file, steps, to, wrong):
    changed(file, *steps, to=to)
    with pytest.raises(BadFile) as refused:
        read_kept(file)
    assert str(refused.value).startswith(f'{file} is not what `rosslt learn` has written: ')
    assert wrong in str(refused.value)
    assert len(str(refused.value)) < len(file) + 400


@pytest.mark.parametrize(
    ('content', 'wrong'),
    [
        (b'', 'Expecting value'),
        (b'learned: yes', 'Expecting value'),
        (b'\xff\xfe', "'utf-8' codec can't decode"),
        (b'[1]', 'it has no layout'),
        (b'[' * 100000, 'it is nested too deeply'),
        (b'{"layout": 1, "version": {}, "when": 1e999, "answers": []}', 'is not'),
        (b'{"layout": ' + b'9' * 4000 + b'}', 'its layout is 999'),
        (b'{"layout": ' + b'9' * 5000 + b'}', ''),  # Python 3.11 does not read it, and others refuse the layout
    ],
)
def test_a_file_that_is_no_such_json_is_refused(file, content, wrong):
    with open(file, 'wb') as written:
        written.write(content)
    with pytest.raises(BadFile) as refused:
        read_kept(file)
    assert str(refused.value).startswith(f'{file} is not what `rosslt learn` has written: ')
    assert wrong in str(refused.value)


def test_what_is_no_file_or_too_large_is_refused(file):
    with open(file, 'wb') as written:
        written.truncate(2**27)
    with pytest.raises(BadFile, match='it has more than 67108864 bytes'):
        read_kept(file)
    os.unlink(file)
    os.mkfifo(file)
    with pytest.raises(BadFile, match='it is a pipe or a device'):
        read_kept(file)
    os.unlink(file)
    with pytest.raises(BadFile, match=r'cannot be read: No such file or directory'):
        read_kept(file)


def test_other_parameters_make_it_stale(file):
    kept = read_kept(file)
    other = {**TREE, 'ns': {'node': {**TREE['ns']['node'], 'gain': 5.0, 'new': 1}, 'other': {'gain': 2}}}
    assert kept.why_stale(version(other), other) == (
        'it has another value of the parameter /ns/node/gain; it has another value of the parameter /ns/node/new'
    )
    asked = {**TREE, 'robot': 'b', 'missing': 0}
    assert kept.why_stale(version(asked), asked) == (
        'it has another value of the parameter /missing; it has another value of the parameter /robot'
    )
    assert 'parameter /ns/node/limits/low' in kept.why_stale(version({}), {})


def test_another_program_makes_it_stale(tmp_path):
    waiting = tmp_path / 'waiting'
    shutil.copy('/usr/bin/sleep', waiting)
    with subprocess.Popen([waiting, '600']) as process:
        first = version(pid=process.pid, executable=str(waiting))
        process.kill()
    kept = Kept(first, 0.0, ())
    assert kept.why_stale(first, TREE) == ''
    with open(waiting, 'ab') as built_anew:
        built_anew.write(b'more')
    with subprocess.Popen([waiting, '600']) as process:
        assert (
            kept.why_stale(version(pid=process.pid, executable=str(waiting)), TREE) == f"'{waiting}' has changed since"
        )
        process.kill()
    assert kept.why_stale(version(), TREE) == f"it runs '{live().executable}' in place of '{waiting}'"


def test_another_script_makes_it_stale(program):
    arguments = sys.executable, str(program), '--fast'
    kept = Kept(version(arguments=arguments), 0.0, ())
    assert kept.why_stale(version(arguments=arguments), TREE) == ''
    assert kept.why_stale(version(arguments=arguments[:2]), TREE) == 'it was started with other arguments'
    program.write_text('runs\n', encoding='utf-8')
    assert kept.why_stale(version(arguments=arguments), TREE) == f"'{program}' has changed since"


def test_other_messages_make_it_stale(file):
    kept = read_kept(file)
    assert kept.why_stale(version(published={'/tf': 'geometry_msgs/Transform'}), TREE) == (
        'it has another type of messages on /tf'
    )
    changed(file, 'version', 'types', '/tf', to='tf2_msgs/TFMessage 0123')  # as before its .msg file was changed
    assert read_kept(file).why_stale(version(), TREE) == 'it has another type of messages on /tf'
    assert kept.why_stale(version(subscribed={}), TREE) == 'it has another type of messages on /joint_states'


def test_a_node_that_has_ended_has_no_version():
    with subprocess.Popen(['true']) as process:
        pass
    with pytest.raises(models.NotCopied, match='the program of /ns/node cannot be read'):
        version(pid=process.pid)


def test_where_nothing_was_learned_nothing_is_loaded_for_it(tmp_path):
    code = """
        import sys
        from rosslt import node
        from rosslt.cli import learned, learned_forcing
        from rosslt.cli.verbs import explain, force
        received = node.Heard('/out', '/opaque', '', None)
        assert learned.known_of(None, received, '') is None
        assert learned.of_silent('/out') == ''
        assert learned_forcing.basis_of(None, [received], {'/opaque': 'data'}, None) == (None, [])
        assert 'rosslt.models' not in sys.modules
        """
    command = [sys.executable, '-c', textwrap.dedent(code)]
    subprocess.run(command, check=True, env=dict(os.environ, ROS_HOME=str(tmp_path)))
