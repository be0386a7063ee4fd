"""Holds what `./run` promises to those who call it."""

import json
import os
import re
import shutil
import signal
import subprocess
import time
import uuid
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
RUN = str(ROOT / 'run')
DEMO_TIME_LIMIT = 120

pytestmark = pytest.mark.slow


def run(*arguments, **options):
    options = {'check': False, **options}
    command = [RUN, *arguments]
    return subprocess.run(  # noqa: PLW1510
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=DEMO_TIME_LIMIT, **options
    )


@pytest.fixture
def left_running():
    """A function that gives the commands started in this test that still run."""
    name, value = 'ROSSLT_TEST', uuid.uuid4().hex
    os.environ[name] = value
    mark = '{}={}'.format(name, value).encode()

    def commands():
        found = []
        for process in Path('/proc').glob('[0-9]*'):
            try:
                if mark in (process / 'environ').read_bytes().split(b'\0'):
                    found.append((process / 'cmdline').read_bytes().replace(b'\0', b' ').decode())
            except OSError:  # it ended meanwhile, or is somebody else's
                continue
        return found

    yield commands
    del os.environ[name]


@pytest.mark.parametrize(
    ('arguments', 'named'),
    [
        (['frobnicate'], "'frobnicate'"),
        (['demo', '--kepp'], "'--kepp'"),
        (['build', 'all'], "'all'"),
        (['lint', 'src'], "'src'"),
        (['bench', 'no_such_one'], "'no_such_one'"),
        (['exec'], 'needs a command'),
        ([], 'usage: ./run'),
    ],
)
def test_a_wrong_call_is_refused_and_named(arguments, named):
    result = run(*arguments)
    assert result.returncode == 2
    assert named in result.stderr
    assert result.stdout == ''


def test_what_a_benchmark_prints_is_kept_with_the_machine_and_the_commit(tmp_path):
    result = run('bench', '--json', str(tmp_path / 'kept.json'), 'solving_cases', '--cases', '20')
    assert result.returncode == 0, result.stderr
    kept = json.loads((tmp_path / 'kept.json').read_text())
    assert kept['benchmarks'] == {'solving_cases': result.stdout.splitlines()}
    assert kept['machine']['cores'] == os.cpu_count()
    assert re.fullmatch('[0-9a-f]{40}', kept['commit'])
    assert run('bench', '--json').returncode == 2


def test_a_run_of_no_test_fails():
    assert run('test', '-k', 'there_is_no_such_test').returncode != 0


def test_values_are_tested_in_a_clone_where_nothing_was_built(tmp_path):
    clone = tmp_path / 'clone'
    without = shutil.ignore_patterns('build', '.git', '__pycache__', '.*_cache', '.hypothesis')
    shutil.copytree(ROOT, clone, symlinks=True, ignore=without)
    command = ['test', 'test/values/test_core.py', '-q', '-k', 'the_workspace_has_the_core']
    result = subprocess.run([str(clone / 'run'), *command], stdout=subprocess.PIPE, encoding='utf-8', check=False)
    assert result.returncode == 0, result.stdout
    assert ' passed' in result.stdout
    assert not (clone / 'build' / '.workspace' / 'devel').exists()


def test_exec_hands_on_directory_input_output_and_status(tmp_path):
    link = tmp_path / 'link to run'
    link.symlink_to(RUN)
    environment = dict(os.environ, PYTHONPATH='/nowhere', ROS_PACKAGE_PATH='/nowhere', ROS_LOG_DIR='/somewhere')
    words = 'pwd; cat; which python3; echo $ROS_LOG_DIR; echo $PYTHONPATH; echo $ROS_PACKAGE_PATH; exit 7'
    command = [str(link), 'exec', 'bash', '-c', words]
    result = subprocess.run(
        command, cwd=tmp_path, env=environment, input='in\n', stdout=subprocess.PIPE, encoding='utf-8', check=False
    )
    folder, said, python, log, *paths = result.stdout.splitlines()
    assert (folder, said, python, log) == (str(tmp_path), 'in', '/usr/bin/python3', '/somewhere')
    assert result.returncode == 7
    assert all(path.endswith(':/nowhere') for path in paths), "another workspace is found behind the clone's own"


def test_it_builds_nothing_and_says_nothing_when_there_is_nothing_to_do():
    run('build', check=True)
    log = ROOT / 'build' / '.workspace' / 'build.log'
    built = log.stat().st_mtime_ns
    assert run('build', check=True).stderr == ''
    assert log.stat().st_mtime_ns == built


def test_several_at_the_same_time_take_turns():
    processes = [
        subprocess.Popen(
            [RUN, 'exec', 'rosmsg', 'show', 'rosslt/SourceChange'], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        )
        for _ in range(4)
    ]
    assert [process.wait(timeout=DEMO_TIME_LIMIT) for process in processes] == [0] * 4


def headless():
    return {name: value for name, value in os.environ.items() if name != 'DISPLAY'}


@pytest.mark.rostest
def test_the_demo_shows_a_drag_beside_another_master_and_leaves_nothing_behind(left_running):
    with subprocess.Popen(
        ['rosmaster', '--core', '-p', '11311'],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as master:
        try:
            result = run('demo', env=headless())
        finally:
            master.kill()
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.strip()
    assert left_running() == []


@pytest.mark.rostest
@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGTERM], ids=['interrupted', 'terminated'])
def test_a_demo_that_is_kept_ends_with_all_its_nodes(left_running, end):
    demo = subprocess.Popen(
        [RUN, 'demo', '--keep'],
        env=headless(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding='utf-8',
    )
    try:
        deadline = time.monotonic() + DEMO_TIME_LIMIT
        while not any('slt_visualization' in command for command in left_running()):
            assert demo.poll() is None, demo.communicate()[0]
            assert time.monotonic() < deadline, 'slt_visualization did not start'
            time.sleep(0.1)
    finally:
        demo.send_signal(end)
        output, _ = demo.communicate(timeout=DEMO_TIME_LIMIT)
    assert demo.returncode == 128 + end, output
    assert left_running() == []


@pytest.mark.parametrize(
    ('arguments', 'is_parallel'),
    [
        (['--durations=10', '-x'], True),
        (['--durations', '10', '-v'], True),
        (['--lf'], True),
        (['--ignore', 'test/web'], True),
        (['-k', 'worker'], False),
        (['-x', '-m', 'not slow'], False),
        (['FOLDER'], False),
        (['FOLDER/test_worker.py::test_worker'], False),
    ],
)
def test_tests_run_beside_each_other_unless_some_are_chosen(tmp_path, arguments, is_parallel):
    (tmp_path / 'test_worker.py').write_text(
        'import os\n\n\ndef test_worker():\n    print("worker", os.environ.get("PYTEST_XDIST_WORKER"))\n'
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith('PYTEST_XDIST')}
    environment['PYTEST_ADDOPTS'] = '-rP -p no:cacheprovider -o testpaths={}'.format(tmp_path)
    if '--lf' in arguments:
        environment['PYTEST_ADDOPTS'] = '-rP -o cache_dir={0} -o testpaths={0}'.format(tmp_path)
    result = run('test', *(word.replace('FOLDER', str(tmp_path)) for word in arguments), env=environment)
    assert result.returncode == 0, result.stdout + result.stderr
    assert ('worker gw' in result.stdout, 'worker None' in result.stdout) == (is_parallel, not is_parallel)
