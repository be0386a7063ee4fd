"""generate_tracked_msgs.py writes what was asked for, all of it or nothing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rosslt.cli import run as run_verb

SCRIPT = Path(__file__).resolve().parents[2] / 'scripts' / 'generate_tracked_msgs.py'


@pytest.fixture
def share(tmp_path, monkeypatch):
    """A workspace with packages whose messages clash, and one that is not of ROS 1."""
    messages = {
        'turtlesim/Pose': 'float32 x\n',
        'other_sim/Pose': 'float32 y\nstring class\n',
        'ros2_only/New': 'string<=3 name\n',
        'other_sim/Nothing': '# no fields\n',
        'other_sim/PoseTracked': 'rosslt/Provenance provenance\nother_sim/Pose data\n',
    }
    for name, text in messages.items():
        package, short = name.split('/')
        folder = tmp_path / 'prefix' / 'share' / package / 'msg'
        folder.mkdir(parents=True, exist_ok=True)
        (folder / (short + '.msg')).write_text(text)
    monkeypatch.setenv('CMAKE_PREFIX_PATH', str(tmp_path / 'prefix') + ':' + os.environ.get('CMAKE_PREFIX_PATH', ''))
    return tmp_path / 'prefix' / 'share'


@pytest.fixture
def generate(tmp_path, capsys):
    """Runs the generator into a folder: its exit code, its lines and its errors."""
    folder = tmp_path / 'generated'

    def run(*arguments):
        try:
            code = run_verb('generate', ['-o', str(folder), *arguments])
        except SystemExit as end:
            code = end.code
        printed = capsys.readouterr()
        return code, printed.out.splitlines(), printed.err

    run.folder = folder
    run.files = lambda: {path.name: path.read_text() for path in folder.glob('*')} if folder.is_dir() else {}
    return run


def fields(text):
    return [line for line in text.splitlines() if not line.startswith('#')]


def test_a_type_becomes_its_tracked_type(generate):
    code, lines, _ = generate('geometry_msgs/Pose')
    assert code == 0
    assert lines == [str(generate.folder / 'PoseTracked.msg')]
    assert fields(generate.files()['PoseTracked.msg']) == ['rosslt/Provenance provenance', 'geometry_msgs/Pose data']


def test_several_types_at_once(generate):
    generate('geometry_msgs/Pose', 'std_msgs/String', 'geometry_msgs/Pose')
    assert sorted(generate.files()) == ['PoseTracked.msg', 'StringTracked.msg']


def test_a_whole_package_without_its_tracked_types(generate, share):
    code, _, _ = generate('--package', 'other_sim')
    assert code == 0
    assert sorted(generate.files()) == ['NothingTracked.msg', 'PoseTracked.msg']


def test_all_that_can_be_read_and_what_cannot_is_named(generate, share):
    code, lines, errors = generate('--all')
    assert code == 0
    assert len(lines) >= 100
    assert 'skipped: cannot read the message type ros2_only/New' in errors
    assert 'TurtlesimPoseTracked.msg' in generate.files()


def test_names_that_clash_carry_their_package(generate, share):
    generate('turtlesim/Pose', 'geometry_msgs/Pose', 'std_msgs/String')
    assert fields(generate.files()['TurtlesimPoseTracked.msg'])[1] == 'turtlesim/Pose data'
    assert fields(generate.files()['GeometryMsgsPoseTracked.msg'])[1] == 'geometry_msgs/Pose data'
    assert 'StringTracked.msg' in generate.files()


def test_a_tracked_type_can_be_named(generate):
    generate('geometry_msgs/Pose', '--name', 'Target')
    assert list(generate.files()) == ['Target.msg']


def test_a_name_must_be_one(generate):
    code, _, errors = generate('geometry_msgs/Pose', '--name', '../Pose')
    assert code == 1
    assert "'../Pose' is not the name of a message" in errors
    assert generate.files() == {}


def test_listing_and_dry_runs_write_nothing(generate):
    assert generate('--list', 'geometry_msgs/Pose', 'std_msgs/String')[1] == ['geometry_msgs/Pose', 'std_msgs/String']
    assert generate('--dry-run', 'geometry_msgs/Pose')[1] == [str(generate.folder / 'PoseTracked.msg')]
    assert not generate.folder.exists()


def test_what_is_up_to_date_is_not_touched(generate):
    generate('geometry_msgs/Pose')
    path = generate.folder / 'PoseTracked.msg'
    os.utime(path, (1, 1))
    generate('geometry_msgs/Pose')
    assert path.stat().st_mtime == 1


def test_a_package_can_be_looked_for_elsewhere(generate, tmp_path):
    (tmp_path / 'New.msg').write_text('float64 x\n')
    assert generate('-I', 'mine:' + str(tmp_path), 'mine/New')[0] == 0
    assert generate('-I', 'mine:' + str(tmp_path), '--package', 'mine')[0] == 0


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        (['geometry_msgs/Pos'], 'found no message type geometry_msgs/Pos: looked for Pos.msg in '),
        (['no_such_package/Pose'], 'found no message type no_such_package/Pose: looked for'),
        (['--package', 'no_such_package'], "found no messages of the package 'no_such_package': looked for"),
        (['Pose'], "'Pose' is not the name of a message type"),
        (['../../etc/passwd'], 'is not the name of a message type'),
        (['other_sim/PoseTracked'], 'is already a tracked type, of other_sim/Pose'),
        (['ros2_only/New'], 'cannot read the message type ros2_only/New in '),
        (['std_msgs/String', '--name', 'Two'], '--name needs exactly one message type, found 2'),
    ],
)
def test_what_cannot_be_done_is_said_and_nothing_is_written(generate, share, arguments, reason):
    code, lines, errors = generate('geometry_msgs/Pose', *arguments)
    assert code == 1
    assert reason in errors
    assert lines == []
    assert generate.files() == {}


@pytest.mark.parametrize(
    'arguments',
    [[], ['--name'], ['-I', 'nonsense', 'std_msgs/String'], ['--list', '--dry-run', 'std_msgs/String'], ['--unknown']],
)
def test_a_call_that_is_not_understood_ends_with_2(generate, arguments):
    code, lines, errors = generate(*arguments)
    assert code == 2
    assert lines == []
    assert 'usage:' in errors


def test_a_file_that_was_not_generated_is_not_overwritten(generate):
    generate.folder.mkdir()
    (generate.folder / 'StringTracked.msg').write_text('float64 mine\n')
    code, _, errors = generate('geometry_msgs/Pose', 'std_msgs/String')
    assert code == 1
    assert 'will not overwrite' in errors
    assert generate.files() == {'StringTracked.msg': 'float64 mine\n'}


def test_a_file_of_another_type_is_not_overwritten(generate, share):
    generate('turtlesim/Pose')
    code, _, errors = generate('geometry_msgs/Pose')
    assert code == 1
    assert 'was generated for turtlesim/Pose, not for geometry_msgs/Pose' in errors
    assert fields(generate.files()['PoseTracked.msg'])[1] == 'turtlesim/Pose data'


def test_in_a_virtual_environment_the_messages_of_the_system_are_found(tmp_path):
    subprocess.run([sys.executable, '-m', 'venv', '--without-pip', '--system-site-packages', str(tmp_path)], check=True)
    environment = {name: value for name, value in os.environ.items() if name != 'CMAKE_PREFIX_PATH'}
    listed = subprocess.run(
        [str(tmp_path / 'bin' / 'python'), str(SCRIPT), '--list', 'std_msgs/String'],
        env=environment,
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    ).stdout
    assert listed == 'std_msgs/String\n'


def test_a_folder_that_cannot_be_written_to_is_said(tmp_path, capsys):
    (tmp_path / 'file').write_text('')
    assert run_verb('generate', ['-o', str(tmp_path / 'file' / 'msg'), 'geometry_msgs/Pose']) == 1
    assert 'cannot write' in capsys.readouterr().err


def test_nothing_is_written_if_one_of_several_cannot_be(generate, monkeypatch):
    replace = os.replace
    generate('std_msgs/String')

    def failing(source, target):
        if target.endswith('PoseTracked.msg'):
            raise OSError(28, 'No space left on device', target)
        replace(source, target)

    monkeypatch.setattr(os, 'replace', failing)
    code, _, errors = generate('geometry_msgs/Point', 'geometry_msgs/Pose', 'std_msgs/Int8')
    assert code == 1
    assert 'No space left' in errors
    assert list(generate.files()) == ['StringTracked.msg']


def test_the_script_runs_without_a_workspace(tmp_path):
    environment = {'PATH': os.environ['PATH'], 'PYTHONPATH': str(SCRIPT.parents[1] / 'src')}
    done = subprocess.run(
        [sys.executable, '-B', str(SCRIPT), '-o', str(tmp_path), 'geometry_msgs/Pose'],
        env=environment,
        stdout=subprocess.PIPE,
        encoding='utf-8',
        check=True,
    )
    assert done.stdout.strip() == str(tmp_path / 'PoseTracked.msg')
